"""
Where is a heavy top chaotic?
=============================

A box with its fixed point on one face is tilted, spun about its axis, and released. Each point of
the picture is one top, and its colour is the largest Lyapunov exponent, computed from one tangent.
Dark points are regular, bright points are chaotic.
"""

import kreisel as kr
import matplotlib.pyplot as plt
import numpy as np

body = kr.Body.cuboid(half=(1.0, 0.7, 0.4), pivot=(0.0, 0.0, -0.4), mass=1.0)
tilts, spins = np.radians(np.linspace(4, 176, 48)), np.linspace(0.05, 6, 64)
angles = np.stack(np.broadcast_arrays(0.0, tilts, 0.0), axis=-1)
rates = np.stack(np.broadcast_arrays(0.0, 0.0, spins), axis=-1)
tops = kr.Scene.from_euler(body, angles[:, None], rates, gravity=1)
chaos = kr.chaos(tops, 200)
print(chaos, f"certificates below {chaos.certificate.max():.0e}")

figure, axes = plt.subplots(figsize=(8, 4.4), layout="constrained")
field = axes.pcolormesh(spins, np.degrees(tilts), chaos.lyapunov, cmap="cividis", rasterized=True)
axes.set(xlabel="spin at the start", ylabel="tilt at the start [degrees]")
axes.grid(False)
figure.colorbar(field, label="largest exponent at t = 200")

# %%
# ``chaos.is_chaotic`` classifies each top, and ``chaos.doubt`` gives the reason if a classification
# is doubtful. The classification uses MEGNO, which tends to 2 for regular motion. The exponent of a
# regular motion decreases as log(t) / t and never reaches zero.

curves = [kr.chaos(one, 1000) for one in (kr.scenes.thesis, kr.scenes.kowalewski)]
wild = kr.chaos(kr.scenes.asymmetric, 1000)
figure, axes = plt.subplots(figsize=(7.6, 3.2), layout="constrained")
for curve, name in zip([*curves, wild], ("Lagrange", "Kowalewski", "asymmetric"), strict=True):
    axes.plot(curve.t, curve.megno_curve, label=name)
axes.set(xlabel="time", ylabel="MEGNO", xscale="log", ylim=(0, 12))
axes.legend()
