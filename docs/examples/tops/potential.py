r"""
Between which angles does the axis of a top oscillate?
======================================================

The energy and the momenta about the vertical and about the axis are constant, which leaves one
equation for the nutation: :math:`\tfrac12 I_1 \dot\vartheta^2 + U(\vartheta) = E`. The axis moves
where the effective potential is below the energy.
"""

import kreisel as kr
import matplotlib.pyplot as plt
import numpy as np

scene = kr.scenes.cusps
motion = kr.exact(scene)
angles = np.linspace(0.6, 1.5, 500)
energy = float(kr.solve(scene, [0.0]).energy[0])
turns = np.array([motion.least_nutation, motion.greatest_nutation])

figure, (left, right) = plt.subplots(1, 2, sharey=True, figsize=(8.4, 4), layout="constrained")
left.plot(motion.potential(angles), np.degrees(angles))
left.axvline(energy, color="tab:orange", label="energy")
left.fill_betweenx(np.degrees(turns), 0, 1, transform=left.get_xaxis_transform(), alpha=0.12)
left.plot([energy, energy], np.degrees(turns), "o", color="tab:orange")
left.set(
    xlabel="effective potential", ylabel="nutation [degrees]", xlim=(energy - 0.3, energy + 0.8)
)
left.legend(loc="lower right")

t = np.linspace(0, 3 * motion.period, 600)
right.plot(t, np.degrees(motion(t).nutation))
for turn in np.degrees(turns):
    right.axhline(turn, color="tab:orange", linestyle="--", linewidth=0.9)
right.set(xlabel="time")
print(f"{motion.motion_type}: {np.degrees(turns).round(4)} degrees, period {motion.period:.6f}")
