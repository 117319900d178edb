"""
How far is the centre of mass of a gyroscope from its fixed point?
==================================================================

A camera follows the tip of a gyroscope's axis at 60 frames a second, with errors of 3 mm on an axis
of 30 cm. The mass and the moment perpendicular to the axis are known from a pendulum experiment.
The fit determines the lever, the distance of the centre of mass from the fixed point.
"""

import kreisel as kr
import matplotlib.pyplot as plt
import numpy as np

gravity = 9.81  # kilogram, metre, second
truth = kr.Body.symmetric(mass=0.5, i1=6e-3, i3=9e-4, height=0.08)
true_scene = kr.Scene.spinning(truth, spin=200, tilt=1.0, gravity=gravity)

t = np.arange(0, 3, 1 / 60)
noise = np.random.default_rng(1).normal(size=(len(t), 3))
tip = kr.solve(true_scene, t).apex + 0.01 * noise

# %%
# The scene contains the known values and rough values of the others. The spin was not measured. The
# initial guess of the motion comes from the frequencies of precession and nutation.

rough = kr.Body.symmetric(mass=0.5, i1=6e-3, i3=9e-4, height=0.06)
scene = kr.Scene.spinning(rough, spin=100, tilt=1.0, gravity=gravity)
fit = kr.fit(scene, kr.Record(t, {"apex": tip}, sigma=0.01), free=("start", "lever"))
print(fit)
print(f"lever: {100 * fit.values['lever']:.2f} +- {100 * fit.error['lever']:.2f} cm, truth 8 cm")

# %%
# The tip determines neither the spin angle nor the spin itself, but only the product of the spin
# and the moment about the axis.

fine = np.linspace(0, 3, 2000)
path = kr.solve(fit.scene, fine)
figure, axes = plt.subplots()
axes.plot(*path.apex[:, :2].T, lw=0.8, label="fit")
axes.plot(*tip[:, :2].T, ".", ms=4, label="camera")
axes.set(aspect="equal", xlabel="x / length of the axis", ylabel="y / length of the axis")
axes.legend()
