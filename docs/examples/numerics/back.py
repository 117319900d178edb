"""
Can I run a motion backwards?
=============================

A reversible method can undo its own steps, while other methods return to the initial state only
approximately. Here each method runs forwards and back to the initial state with a large step:
"""

import kreisel as kr
import matplotlib.pyplot as plt
import numpy as np

scene = kr.scenes.asymmetric_regular
names = ["strang", "veselov2", "implicit_midpoint", "rk4"]
ends = np.geomspace(1, 300, 14).round(1)

figure, axes = plt.subplots(layout="constrained")
for name in names:
    misses = []
    for end in ends:
        path = kr.solve(scene, end, name, step=0.05)
        back = kr.solve(path.end, -end, name, step=0.05)
        misses.append(kr.attitude_error(back.q[-1:], path.q[:1])[0])
    axes.loglog(ends, np.maximum(misses, 1e-16), "o-", markersize=3, label=name)
axes.set(
    xlabel="time before the reversal", ylabel="distance from the start [rad]", ylim=(1e-16, 10)
)
axes.legend()

# %%
# The properties of each method are listed in ``kr.methods``:

for name in names:
    method = kr.methods[name]
    print(
        f"{name:18} order {method.order}, reversible: {method.reversible}, "
        f"conserves {method.conserves}"
    )
