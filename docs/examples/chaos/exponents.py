"""
Where is a heavy top chaotic?
=============================

At one energy and one vertical momentum the starts of a top fill a surface. Each point of it is
asked for its largest exponent, by one tangent that rides along: islands of order in a chaotic sea.
"""

import kreisel as kr
import matplotlib.pyplot as plt
import numpy as np

body = kr.scenes.asymmetric.body
tops = kr.starts(body, energy=2.0, vertical=1.0, grid=(40, 60))
chaos = kr.lyapunov(tops, 300)
print(chaos, f"certificates below {chaos.certificate.max():.0e}")

begin = kr.solve(tops, [0.0], want=("nutation", "spin_angle"))
height, angle = np.cos(begin.nutation[:, 0]), begin.spin_angle[:, 0]

figure, axes = plt.subplots(figsize=(8, 4.4))
shown = axes.scatter(angle, height, c=np.maximum(chaos.value, 0), s=9, cmap="magma", marker="s")
axes.set(xlabel="spin angle at the start [rad]", ylabel="height of the apex at the start")
axes.grid(False)
figure.colorbar(shown, label="largest exponent at t = 300")

# %%
# An exponent of an ordered motion goes to zero as log(t) / t, and is never quite there. MEGNO tells
# the two apart sooner: 2 is order.

curves = [kr.megno(one, 1000) for one in (kr.scenes.thesis, kr.scenes.kowalewski)]
wild = kr.megno(kr.scenes.asymmetric, 1000)
figure, axes = plt.subplots(figsize=(7.6, 3.2))
for curve, name in zip([*curves, wild], ("Lagrange", "Kowalewski", "asymmetric"), strict=True):
    axes.plot(curve.t, curve.curve, label=name)
axes.set(xlabel="time", ylabel="MEGNO", xscale="log", ylim=(0, 12))
axes.legend()
