r"""
Can shaking keep a pendulum upright?
====================================

Kapitza's pendulum stands upright if its pivot is shaken fast enough. The faster a top spins, the
less shaking it needs.
"""

import kreisel as kr
import matplotlib.pyplot as plt
import numpy as np

rod = kr.Body.cylinder(radius=0.02, height=0.2, pivot=(0, 0, -0.1), mass=0.1)
upright = kr.Scene.spinning(rod, spin=0, tilt=np.radians(5), gravity=9.81)
rate = 400.0  # of the shaking [rad/s]
t = np.linspace(0, 2, 4000)
figure, axes = plt.subplots(figsize=(7.6, 3.2), layout="constrained")
for amplitude in (0.0, 0.003, 0.006):
    path = kr.solve(upright.replace(shaking=(amplitude, rate, 0.0)), t)
    axes.plot(t, np.degrees(path.nutation), label=f"{1000 * amplitude:.0f} mm")
axes.set(xlabel="time [s]", ylabel="nutation [degrees]")
axes.legend(title="amplitude")

# %%
# Averaged over a period, the shaking adds the potential :math:`(M l A r)^2 \sin^2\vartheta / (4
# I_1)`. Hence a top with the spin :math:`\omega_3` stands if :math:`(I_3\,\omega_3)^2 + 2 (M l A
# r)^2 > 4 I_1 M g l`. Each point of the map is one top, integrated for two seconds, and the line is
# the limit of this condition:

spins, amplitudes = np.linspace(0, 1300, 40), np.linspace(0, 0.006, 31)
tops = upright.vary(
    spin=spins[:, None],
    tilt=np.radians(0.5),
    shaking=np.stack([amplitudes, 0 * amplitudes + rate, 0 * amplitudes], axis=-1),
)
lowest = kr.reduce(tops, np.linspace(0, 2, 101), {"apex_z": "min"})["apex_z"]["min"]
figure, axes = plt.subplots(figsize=(7.6, 4.2), layout="constrained")
axes.pcolormesh(spins, 1000 * amplitudes, (lowest > np.cos(np.radians(20))).T, cmap="Blues", vmax=2)
i1, _, i3 = rod.moments
lever = rod.mass * 0.1
border = np.sqrt(np.maximum(4 * i1 * lever * 9.81 - (i3 * spins) ** 2, 0) / 2) / (lever * rate)
axes.plot(spins, 1000 * border, color="tab:orange")
axes.set(xlabel="spin [rad/s]", ylabel="amplitude [mm]", title="blue: the top stands")
