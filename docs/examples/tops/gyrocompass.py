r"""
How does a spinning wheel find north?
=====================================

A gyrocompass is a wheel with a horizontal axle, in a housing whose centre of mass is below its
pivot. The Earth turns under it. Its weight and its spin then force the axle towards the meridian, and
drag lets it come to rest there.
"""

import kreisel as kr
import matplotlib.pyplot as plt
import numpy as np

EARTH = 7.292e-5  # angular velocity of the Earth [1/s]
latitude = np.radians(52.5)  # Berlin
east, north, up = np.eye(3)
turning = EARTH * (np.cos(latitude) * north + np.sin(latitude) * up)

# %%
# The housing has its centre of mass 1 cm below the pivot. A motor keeps the momentum of the wheel
# constant: it is the ``rotor`` of the body. The axle first points to the east, at rest.

housing = kr.Body(1.0, (0.010, 0.012, 0.012), (0, 0, -0.01))
compass = housing.with_rotor(spin=500, inertia=1e-4, axis=(1, 0, 0))
scene = kr.Scene(
    compass, velocity=(0, 0, 0), gravity=9.81, damping=1e-4, turning=turning
)
path = kr.solve(scene, np.linspace(0, 4000, 8000))
axle = path.frame[:, 0]  # the first principal axis, along the wheel's axle
heading = np.degrees(np.arctan2(axle @ east, axle @ north))

figure, axes = plt.subplots(figsize=(7.6, 3.2), layout="constrained")
axes.plot(path.t / 60, heading)
axes.axhline(0, color="tab:gray", linestyle="--")
axes.set(xlabel="time [minutes]", ylabel="axle, from north [degrees]")
print(f"after {path.t[-1] / 60:.0f} minutes: {heading[-1]:+.3f} degrees from north")

# %%
# Without drag the axle swings about the meridian. The theory of small swings gives the period
# :math:`2\pi\sqrt{h / (M g l\,\omega \cos\varphi)}`:

momentum, weight = compass.rotor[0], 9.81 * 0.01
period = 2 * np.pi * np.sqrt(momentum / (weight * EARTH * np.cos(latitude)))
near = scene.replace(
    damping=0, attitude=(np.cos(np.radians(85) / 2), 0, 0, np.sin(np.radians(85) / 2))
)
near = near.replace(velocity=(0, 0, 0))
crossings = kr.solve(near, 3 * period, "taylor", events=kr.events.plane(east, of="m")).events
