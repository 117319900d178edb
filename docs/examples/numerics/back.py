"""
Can I run it backwards?
=======================

A reversible method undoes its own steps; other methods return only approximately. Here each method
runs forward and back to the start, with a step that is not small:
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
        there = kr.solve(scene, end, name, step=0.05)
        back = kr.solve(there.end, -end, name, step=0.05)
        misses.append(kr.attitude_error(back.q[-1:], there.q[:1])[0])
    axes.loglog(ends, np.maximum(misses, 1e-16), "o-", markersize=3, label=name)
axes.set(
    xlabel="time before the reversal", ylabel="distance from the start [rad]", ylim=(1e-16, 10)
)
axes.legend()

# %%
# Each method lists its properties:

for name in names:
    method = kr.methods[name]
    print(
        f"{name:18} order {method.order}, reversible: {method.reversible}, "
        f"conserves {method.conserves}"
    )
