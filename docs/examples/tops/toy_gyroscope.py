r"""
How fast does a toy gyroscope precess?
======================================

A disk on a light axle spins at 3000 turns a minute and leans by 60 degrees. School says that the
axis goes round the vertical at :math:`\dot\varphi = m g l / (I_3 \omega)`, as long as the spin is
fast. How good is that, and at which spin does it fail?
"""

import kreisel as kr
import matplotlib.pyplot as plt
import numpy as np

foot = (0, 0, -0.06)  # the fixed point, seen from the middle of disk and axle [m]
disk, axle = kr.Body.disk(0.05, foot, mass=0.5), kr.Body.rod(0.12, foot, mass=0.02)
gyroscope = disk + axle
spin = 3000 * 2 * np.pi / 60
scene = kr.Scene.spinning(gyroscope, spin, tilt=np.radians(60), steady=True, gravity=9.81)
kr.plot(kr.solve(scene, np.linspace(0, 3, 600)), degrees=True)

# %%
# ``steady=True`` chooses the start whose axis does not nod. Its precession, beside the rule:

across, _, along = gyroscope.moments
torque = gyroscope.mass * 9.81 * gyroscope.com[2]
print(f"closed form {kr.exact(scene).precession:.4f} rad/s, rule {torque / along / spin:.4f} rad/s")

# %%
# One call moves a whole row of spins. The rule is the limit of fast tops; below the least spin of
# a steady precession there is nothing to approximate.

least = 2 * np.sqrt(across * torque * np.cos(np.radians(60))) / along
spins = np.linspace(1.001 * least, 600, 300)
tops = kr.Ensemble.spinning(gyroscope, spins, tilt=np.radians(60), steady=True, gravity=9.81)
rates = kr.exact(tops).precession

figure, axes = plt.subplots(layout="constrained")
axes.plot(spins, rates, label="slow steady precession")
axes.plot(spins, torque / along / spins, "--", label="$m g l / I_3 \\omega$")
axes.axvline(least, color="grey", linewidth=0.8)
axes.annotate("least spin", (least, 1), xytext=(4, 0), textcoords="offset points", color="grey")
axes.set(xlabel="spin [rad/s]", ylabel="precession [rad/s]", xlim=(0, 600), ylim=(0, 12))
axes.legend()

# %%
# The same gyroscope in the page, where its tip can be taken and its momentum turned:

kr.view(scene, speed=0.2, open=False)
