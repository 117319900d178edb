r"""
How does a spinning wheel find north?
=====================================

A gyrocompass is a wheel with a horizontal axle, in a housing whose centre of mass is below its
pivot. The Earth turns under the compass. The weight and the spin together drive the axle towards
the meridian, and drag brings the axle to rest there.
"""

import kreisel as kr
import matplotlib.pyplot as plt
import numpy as np

latitude = np.radians(52.5)  # Berlin
east, north, up = np.eye(3)
turning = 7.292e-5 * (np.cos(latitude) * north + np.sin(latitude) * up)  # of the Earth [1/s]

# %%
# The housing has its centre of mass 1 cm below the pivot. A motor keeps the momentum of the wheel
# constant, so the wheel is the ``rotor`` of the body. At the start the axle is at rest and points
# to the east.

housing = kr.Body(1.0, (0.010, 0.012, 0.012), (0, 0, -0.01))
compass = housing.with_rotor(spin=500, inertia=1e-4, axis=(1, 0, 0))
scene = kr.Scene(compass, velocity=(0, 0, 0), gravity=9.81, damping=3e-4, turning=turning)
path = kr.solve(scene, np.linspace(0, 3000, 6000))
axle = path.frame[:, 0]  # the principal axis along the axle
heading = np.degrees(np.arctan2(axle @ east, axle @ north))

figure, axes = plt.subplots(figsize=(7.6, 3.2), layout="constrained")
axes.plot(path.t / 60, heading)
axes.axhline(0, color="tab:gray", linestyle="--")
axes.set(xlabel="time [minutes]", ylabel="axle, from north [degrees]")
print(f"after {path.t[-1] / 60:.0f} minutes: {heading[-1]:+.4f} degrees from north")

# %%
# Small oscillations about the meridian have the period :math:`2\pi\sqrt{(I + h^2 / (M g l)) /
# (h\,\Omega \cos\varphi)}`, where :math:`h` is the momentum of the wheel and :math:`I` the moment
# about the vertical. Without drag the oscillation does not decay:

momentum = compass.rotor[0]
stiff = compass.moments[2] + momentum**2 / (9.81 * 0.01)
period = 2 * np.pi * np.sqrt(stiff / (momentum * (turning @ north)))
half = np.radians(85) / 2  # five degrees from north
start = kr.Scene(
    compass,
    attitude=(np.cos(half), 0, 0, np.sin(half)),
    velocity=(0, 0, 0),
    gravity=9.81,
    turning=turning,
)
swing = kr.solve(start, np.linspace(0, 4 * period, 4001))
offset = swing.frame[:, 0] @ east
crossings = swing.t[1:][np.diff(np.sign(offset)) > 0]
print(f"period {np.diff(crossings).mean():.1f} s, of small swings {period:.1f} s")
