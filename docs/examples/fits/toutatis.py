"""
What are the moments of inertia of a tumbling asteroid?
=======================================================

The asteroid Toutatis tumbles: it rotates about its long axis and precesses at the same time. In
December 1992 radar determined its attitude and angular velocity on 17 days. The fit determines the
ratios of its moments of inertia and both periods. The moments themselves are not determined,
because a common factor of all moments does not change the motion of a free body.

The measurements are from Y. Takahashi, M. W. Busch and D. J. Scheeres, *The Astronomical Journal*
146 (2013) 95, who obtained the ratios 3.0836 and 3.235 from five flybys, including the torques of
the Earth and the Sun.
"""

import kreisel as kr
import matplotlib.pyplot as plt
import numpy as np

# days since 1992-12-02 at 21:40, Euler's angles z-x-z [degrees], angular velocity [degrees a day]
MEASURED = np.array(
    [
        (0.0000, 122.2, 86.5, 107.0, -35.6, 7.2, -97.0),
        (0.9097, 86.3, 81.8, 24.5, -16.4, -29.1, -91.9),
        (1.8542, 47.8, 60.7, 284.0, 29.1, -23.2, -97.8),
        (2.8819, 14.6, 39.4, 207.1, 33.3, 8.2, -92.2),
        (3.8264, 331.3, 23.7, 151.6, 6.6, 34.5, -95.8),
        (4.8194, 222.5, 25.4, 143.9, 12.8, 25.4, -104.1),
        (5.7917, 169.8, 45.5, 106.9, -31.1, -21.9, -97.7),
        (6.8403, 137.3, 71.3, 22.3, 11.8, -36.9, -94.9),
        (7.8194, 103.1, 85.2, 292.6, 35.8, -8.9, -97.9),
        (8.5000, 77.0, 85.7, 225.5, 31.0, 17.0, -96.3),
        (9.4861, 42.8, 70.2, 133.2, -1.3, 37.0, -95.9),
        (10.4375, 13.7, 44.4, 51.9, -38.3, 17.9, -97.3),
        (11.4236, 323.7, 14.0, 0.0, -70.5, -30.6, -91.1),
        (12.4236, 193.2, 24.4, 21.4, 22.1, -26.6, -96.6),
        (13.3958, 165.1, 46.4, 310.6, 33.4, -3.4, -93.7),
        (14.3813, 130.6, 76.1, 234.9, 12.6, 33.9, -94.0),
        (15.3951, 91.6, 81.6, 142.4, -24.3, 29.6, -102.0),
    ]
)
t, angles, velocities = MEASURED[:, 0], MEASURED[:, 1:4], MEASURED[:, 4:]


def attitude(precession, nutation, spin):
    """Return the quaternion of Euler's angles [degrees]."""
    a, b, c = np.radians((precession, nutation, spin)) / 2
    return (
        np.cos(b) * np.cos(a + c),
        np.sin(b) * np.cos(a - c),
        np.sin(b) * np.sin(a - c),
        np.cos(b) * np.sin(a + c),
    )


# %%
# The noise of the measurements is not given, so the fit estimates it from the residuals. The scene
# contains only rough moments of a body that is elongated along its third axis. The initial guess of
# the motion comes from the measurements.

record = kr.Record(
    t,
    {"q": [attitude(*row) for row in angles], "body_velocity": np.radians(velocities)},
)
long_body = kr.Body(mass=1, inertia=(3, 3.1, 1), com=(0, 0, 0))
scene = kr.Scene(long_body, body_velocity=(0, 0, -1.7), gravity=0)
fit = kr.fit(scene, record)
print(fit)
for ratio, (value, error) in fit.moment_ratios.items():
    print(f"{ratio} = {value:.3f} +- {error:.3f}")

# %%
# The closed form of the fitted motion gives both periods. For comparison, Hudson and Ostro
# (*Science* 270, 1995) found 5.41 and 7.35 days.

motion = kr.exact(fit.scene)
rates = motion.spin_angle_rate, motion.precession_rate
rotation, precession = (2 * np.pi / abs(rate) for rate in rates)
print(f"rotation {rotation:.2f} days, precession {precession:.2f} days")

# %%
# The picture compares the measured angular velocity with the fitted motion.

fine = np.linspace(0, 16, 400)
path = kr.solve(fit.scene, fine)
figure, axes = plt.subplots()
for k, axis in enumerate("xyz"):
    [line] = axes.plot(fine, np.degrees(path.body_velocity[:, k]), label=axis)
    axes.plot(t, velocities[:, k], "o", color=line.get_color())
axes.set(xlabel="days", ylabel="angular velocity [degrees a day]")
axes.legend()
