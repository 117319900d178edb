r"""
How fast must a top spin to stand?
==================================

An upright top *sleeps* if its spin exceeds the critical spin :math:`2 \sqrt{I_1 m g l} / I_3`.
Below the critical spin, the smallest push makes the top fall. The picture shows how far many
thousands of tops fall, depending on their spin and initial tilt.
"""

import kreisel as kr
import matplotlib.pyplot as plt
import numpy as np

cone = kr.Body.cone(radius=0.03, height=0.06, pivot=(0, 0, 0), mass=0.1)
toy = kr.Scene.spinning(cone, spin=100, tilt=0.3, gravity=9.81)
spins, tilts = np.linspace(0, 400, 320), np.radians(np.linspace(0.05, 40, 240))
tops = toy.vary(spin=spins[:, None], tilt=tilts)
motion = kr.exact(tops)
fall = np.degrees(motion.greatest_nutation - tilts)
critical = motion.critical_spin[0, 0]

figure, axes = plt.subplots(layout="constrained")
field = axes.pcolormesh(spins, np.degrees(tilts), fall.T, vmin=0, vmax=180, rasterized=True)
levels = axes.contour(
    spins, np.degrees(tilts), fall.T, [10, 30, 60, 120], colors="w", linewidths=0.8
)
axes.clabel(levels, fmt="%d°", fontsize=8)
axes.axvline(critical, color="w", linestyle="--")
axes.text(critical + 4, 36, "critical spin", color="w")
axes.set(xlabel="spin [rad/s]", ylabel="tilt at the start [degrees]")
axes.grid(False)
figure.colorbar(field, label="falls by [degrees]")

# %%
# No motion was integrated, because the turning points have a closed form. ``toy.vary`` names the
# axes of the ensemble, and each member of the ensemble is a scene:

print(tops, tops.axes)
print(np.degrees(kr.exact(tops[200, 20]).greatest_nutation), "degrees at most")

# %%
# The next figure compares two tops with spins above and below the critical spin, both released at a
# tilt of two degrees:

pair = [
    kr.Scene.spinning(cone, spin=factor * critical, tilt=np.radians(2), gravity=9.81)
    for factor in (0.95, 1.05)
]
figure, axes = plt.subplots(figsize=(7.6, 3), layout="constrained")
t = np.linspace(0, 2, 2000)
for scene, name in zip(pair, ("5 % below", "5 % above"), strict=True):
    axes.plot(t, np.degrees(kr.solve(scene, t).nutation), label=name)
axes.set(xlabel="time [s]", ylabel="nutation [degrees]")
axes.legend()
