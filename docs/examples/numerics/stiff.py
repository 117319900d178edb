"""
Which step can I use for a stiff scene?
=======================================

A fast top nutates a thousand times during one precession. Methods that integrate the free motion
exactly are not limited by the spin. Other methods must resolve the spin.
"""

import kreisel as kr
import matplotlib.pyplot as plt
import numpy as np

scenes = {"fast": kr.scenes.fast, "strong_gravity": kr.scenes.strong_gravity}
names = [
    "bobenko_suris2",
    "bobenko_suris4",
    "strang",
    "takahashi_imada4",
    "implicit_midpoint",
    "rk4",
]
steps = np.geomspace(1e-3, 1, 16)

figure, axes = plt.subplots(1, 2, figsize=(9.2, 4), sharey=True, layout="constrained")
for chart, (title, scene) in zip(axes, scenes.items(), strict=True):
    table = kr.compare(scene, 20.0, names, steps, repeats=1)
    for name in names:
        rows = [row for row in table if row.method == name and not row.failure]
        chart.loglog([row.step for row in rows], [row.attitude_error for row in rows], label=name)
    chart.set(xlabel="step", title=title, ylim=(1e-12, 5))
axes[0].set_ylabel("attitude error at t = 20 [rad]")
axes[0].legend(fontsize=8)

# %%
# A line ends where the method refuses the step or fails. The exception states the reason:

try:
    kr.solve(kr.scenes.strong_gravity, 20.0, "bobenko_suris4", step=0.5)
except ValueError as refusal:
    print(refusal)

# %%
# The closed form has no step, and the Taylor series chooses its own:

for title, scene in scenes.items():
    path = kr.solve(scene, 20.0, "taylor")
    print(f"{title}: taylor takes {path.stats.steps} steps, error {path.error:.1e} rad")
