"""
What is an integrable map good for?
===================================

A top without spin that swings in a plane is a pendulum. With a step of a sixth of its period, a
symplectic method becomes the standard map, the textbook example of chaos. The map of Bobenko and
Suris is integrable, like the top itself: every motion remains on a curve, for any step.
"""

import kreisel as kr
import matplotlib.pyplot as plt
import numpy as np

body, step = kr.Body.symmetric(mass=1, i1=1, i3=0.5, height=1, unphysical=True), 1.1
tilts = np.concatenate([np.linspace(0.02, 3.1, 22), np.full(8, np.pi)])
swings = np.concatenate([np.zeros(22), np.linspace(2.1, 3.2, 4), -np.linspace(2.1, 3.2, 4)])
attitude = np.stack([np.cos(tilts / 2), np.sin(tilts / 2), 0 * tilts, 0 * tilts], axis=-1)
momentum = np.stack([swings, 0 * swings, 0 * swings], axis=-1)
tops = kr.Scene(body, momentum=momentum, attitude=attitude, gravity=1)

figure, axes = plt.subplots(
    1, 2, figsize=(9.4, 4.4), sharex=True, sharey=True, layout="constrained"
)
for chart, name in zip(axes, ("bobenko_suris2", "strang"), strict=True):
    paths = kr.solve(tops, 1500 * step, name, step=step, every=1)
    angle = np.arctan2(paths.apex[..., 1], -paths.apex[..., 2])
    chart.scatter(angle, paths.m[..., 0], s=0.35, linewidths=0, rasterized=True)
    chart.set(title=name, xlabel="angle from hanging [rad]", ylim=(-3.4, 3.4))
    chart.grid(False)
axes[0].set_ylabel("momentum")

# %%
# The closed form of the Bobenko-Suris map gives the state after any number of steps directly, here
# after a billion steps:

scene = kr.scenes.cusps
map = kr.exact(scene, map="bobenko_suris", step=0.4)
print(map(10**9).apex)
steps = np.arange(0, 4001)
path = kr.solve(scene, 4000 * 0.4, "bobenko_suris", step=0.4, every=1)
difference = kr.attitude_error(path.q, map(steps).q).max()
print(f"4000 steps and the closed form differ by {difference:.1e} rad")

# %%
# The viewer shows two methods side by side. Press the space bar to start them:

kr.view(scene, methods=["bobenko_suris", "strang"], step=0.4, open=False)
