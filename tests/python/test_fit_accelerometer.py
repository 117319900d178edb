"""The specific force that an accelerometer measures, against differences of its path."""

import kreisel as kr
import numpy as np
import pytest
from fits import HEAVY, PLACE, is_near, simulate
from mpmath import mp, mpf

SCENES = {
    "heavy": HEAVY,
    "damped": HEAVY.replace(damping=(0.1, 0.25, 0.4)),
    "free": HEAVY.replace(gravity=0.0),
    "upward gravity": HEAVY.replace(gravity=-2.0),
    "turned": HEAVY.replace(body=HEAVY.body.turn((0.6, 0.48, 0.0, 0.64))),
    "with a rotor": HEAVY.replace(
        body=HEAVY.body.with_rotor(spin=5.0, inertia=0.3, axis=(1.0, 2.0, -1.0))
    ),
    "turning": HEAVY.replace(turning=(0.3, -2.0, 0.5)),
    "shaken": HEAVY.replace(shaking=(0.05, 7.0, 0.4)),
    "all together": HEAVY.replace(
        body=HEAVY.body.turn((0.6, 0.48, 0.0, 0.64)).with_rotor(
            spin=5, inertia=0.3, axis=(1, 2, 3)
        ),
        turning=(0.3, -2.0, 0.5),
        shaking=(0.05, 7.0, 0.4),
        friction=0.3,
        damping=0.2,
    ),
}


def turn(q, v):
    """Rotate the vector `v` by the quaternion `q`, which need not be normalized."""
    w, x, y, z = q
    square = w * w + x * x + y * y + z * z
    rows = (
        (w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z),
    )
    return [sum(a * b for a, b in zip(row, v, strict=True)) / square for row in rows]


def attitudes_at_rest(scene, times):
    """Return attitudes in the inertial frame that coincides with the support frame at mid-time."""
    path, middle = kr.solve(scene, times, digits=30), mpf(times[len(times) // 2])
    rate = mp.sqrt(sum(mpf(x) ** 2 for x in scene.turning))
    attitudes = []
    for t, *words in zip(times, path.q.tolist(), path.q_low.tolist(), strict=True):
        q = [mpf(high) + mpf(low) for high, low in zip(*words, strict=True)]
        half = 0.5 * rate * (mpf(t) - middle)
        axis = [mp.sin(half) * mpf(x) / (rate or 1) for x in scene.turning]
        attitudes.append(kr.quaternion.multiply((mp.cos(half), *axis), tuple(q)))
    return attitudes


def specific_force_by_differences(scene, t, step=2.0**-12):
    """Return the specific force in the body frame, computed by finite differences."""
    q = attitudes_at_rest(scene, [t + k * step for k in range(-3, 4)])
    places = [turn(each, [mpf(x) for x in PLACE]) for each in q]
    weights = [mpf(w) / 180 for w in (2, -27, 270, -490, 270, -27, 2)]
    total = [sum(w * p[i] for w, p in zip(weights, places, strict=True)) for i in range(3)]
    force = [x / mpf(step) ** 2 for x in total]
    amplitude, rate, phase = map(mpf, scene.shaking)
    force[2] += mpf(scene.gravity) - amplitude * rate**2 * mp.cos(rate * t + phase)
    w, x, y, z = q[3]
    return np.array([float(f) for f in turn((w, -x, -y, -z), force)])


@pytest.mark.parametrize("scene", SCENES.values(), ids=SCENES)
def test_the_specific_force_is_the_acceleration_of_the_point_minus_gravity(scene):
    with mp.workdps(40):
        truth = specific_force_by_differences(scene, 0.5)
    found = kr.solve(scene, [0.5]).specific_force(PLACE)[0]
    assert np.abs(found - truth).max() < 1e-11 * np.abs(truth).max()


def test_the_specific_force_at_the_fixed_point_is_vertical():
    path = kr.solve(HEAVY, [0.0, 1.0])
    assert (path.specific_force((0, 0, 0)) == 9.81 * path.body_vertical).all()


@pytest.mark.parametrize("point", [None, (1, 2), (1, 2, np.nan), "abc", 3.0])
def test_invalid_points_are_refused(point):
    with pytest.raises((TypeError, ValueError), match="point"):
        kr.solve(HEAVY, [0.0]).specific_force(point)


def test_an_accelerometer_separates_gravity_from_the_lever():
    t, free = np.linspace(0.0, 3.0, 200), ("start", "com", "gravity")
    records = [simulate(HEAVY, t, {name: 0.05}) for name in ("body_velocity", "specific_force")]
    assert "gravity against com" in kr.fit(HEAVY, records[0], free).unidentified[0]
    fit = kr.fit(HEAVY.replace(gravity=9.7), records, free)
    assert len(fit.unidentified) == 1 and is_near(fit, {"gravity": 9.81, "com_z": 0.4})
    assert fit.error["gravity"] < 0.005 and fit.error["com_z"] < 0.005
