r"""
How fast does a toy gyroscope precess?
======================================

A disk on a light axle spins at 3000 revolutions per minute, and its axis is tilted by 60 degrees.
The textbook rule for the precession of a fast top is :math:`\dot\varphi = m g l / (I_3 \omega)`.
How accurate is the rule, and at which spin does it fail?
"""

import kreisel as kr
import matplotlib.pyplot as plt
import numpy as np

foot = (0, 0, -0.06)  # the fixed point, seen from the middle of disk and axle [m]
disk, axle = kr.Body.disk(0.05, foot, mass=0.5), kr.Body.rod(0.12, foot, mass=0.02)
gyroscope = disk + axle
spin = 3000 * 2 * np.pi / 60
scene = kr.Scene.spinning(gyroscope, spin, tilt=np.radians(60), steady=True, gravity=9.81)
kr.plot(kr.solve(scene, np.linspace(0, 3, 600)), time_unit="s")

# %%
# ``steady=True`` chooses the initial state without nutation. The following output compares its
# precession with the rule:

transverse, _, axial = gyroscope.moments
torque = gyroscope.mass * 9.81 * gyroscope.com[2]
rate = kr.exact(scene).precession_rate
print(f"closed form {rate:.4f} rad/s, rule {torque / axial / spin:.4f} rad/s")

# %%
# One call computes the precession for all spins. The rule is the limit for fast tops. Below a
# minimum spin, no steady precession exists.

least = 2 * np.sqrt(transverse * torque * np.cos(np.radians(60))) / axial
spins = np.linspace(1.001 * least, 600, 300)
tops = kr.Scene.spinning(gyroscope, spins, tilt=np.radians(60), steady=True, gravity=9.81)
rates = kr.exact(tops).precession_rate

figure, axes = plt.subplots(layout="constrained")
axes.plot(spins, rates, label="slow steady precession")
axes.plot(spins, torque / axial / spins, "--", label="$m g l / I_3 \\omega$")
axes.axvline(least, color="grey", linewidth=0.8)
axes.annotate("least spin", (least, 1), xytext=(4, 0), textcoords="offset points", color="grey")
axes.set(xlabel="spin [rad/s]", ylabel="precession [rad/s]", xlim=(0, 600), ylim=(0, 12))
axes.legend()

# %%
# The viewer shows the same gyroscope. The top and its momentum can be dragged:

kr.view(scene, speed=0.2, open=False)
