"""
Is a hanging top a pendulum?
============================

Without spin, a hanging top is a spherical pendulum and swings in a plane. With a little spin, the
plane of oscillation turns, like that of Foucault's pendulum. The faster the spin, the farther the
top passes from its lowest point.
"""

import kreisel as kr
import matplotlib.pyplot as plt
import numpy as np

bob = kr.Body.cylinder(radius=0.05, height=0.1, pivot=(0, 0, -0.5), mass=1)
t = np.linspace(0, 20, 6000)

figure, axes = plt.subplots(
    1, 4, figsize=(9.2, 2.8), sharex=True, sharey=True, layout="constrained"
)
for chart, spin in zip(axes, (0, 20, 60, 400), strict=True):
    scene = kr.Scene.spinning(bob, spin, tilt=np.radians(160), gravity=9.81)
    x, y, _ = kr.solve(scene, t).apex.T
    chart.plot(x, y, linewidth=0.6)
    chart.plot(x[:1], y[:1], "o", markersize=4, color="tab:orange")
    chart.set_title(f"{spin} rad/s: {kr.exact(scene).motion_type}")
    chart.set_aspect("equal")
figure.supxlabel("the apex from above", fontsize=9.5)

# %%
# The closed form gives the rate at which the plane of oscillation turns. In one period of the
# height, the plane turns by the precession of the axis minus half a turn:

for spin in (20, 60, 400):
    scene = kr.Scene.spinning(bob, spin, tilt=np.radians(160), gravity=9.81)
    motion = kr.exact(scene)
    plane = motion.precession_rate - np.copysign(np.pi / motion.period, motion.precession_rate)
    print(f"{spin:3} rad/s of spin: the plane turns at {plane:+.5f} rad/s")

kr.view(scene, open=False)
