"""Tests of initial states given by Euler angles, rates or steady precession."""

import math
import re

import kreisel as kr
import numpy as np
import pytest
from tops import CORNER, MOMENTUM, TILT, matrix

TOP, THESIS = kr.scenes.asymmetric, kr.scenes.thesis

CONE = kr.Body.cone(radius=1, height=2, pivot=(0, 0, 0), mass=1.5)
I1, _, I3 = CONE.moments
TORQUE = 1.5 * 9.81 * 1.5
ANGLES, RATES = (0.7, 1.1, -0.4), (0.3, -0.8, 5.0)
NAMES = ("precession_angle", "nutation", "spin_angle")
WATER = kr.Body(1, (0.345, 0.653, 1.0), (0, 0, 0), inertia_rtol=0.0021)


def angles_of(scene, t=0.0):
    path = kr.solve(scene, [t])
    return [float(getattr(path, name)[0]) for name in NAMES]


# Euler's angles


def test_the_attitude_agrees_with_scipy():
    Rotation = pytest.importorskip("scipy.spatial.transform").Rotation
    scene = kr.Scene.from_euler(CONE, ANGLES, gravity=1)
    expected = Rotation.from_euler("ZXZ", ANGLES).as_matrix()
    np.testing.assert_allclose(matrix(scene.attitude), expected, atol=1e-15)
    assert scene.momentum == (0, 0, 0)


@pytest.mark.parametrize("body", [CONE, CORNER, CORNER.turn(TILT), CONE.turn((0, 1, 0, 0))])
@pytest.mark.parametrize("angles", [ANGLES, (-3, 0.01, 3), (2, 3.1, -2), (0.3, 1.5, 0)])
def test_paths_start_with_the_given_angles(body, angles):
    """Check the initial Euler angles of bodies whose apex lies along different body axes."""
    scene = kr.Scene.from_euler(body, angles, RATES, gravity=1)
    np.testing.assert_allclose(angles_of(scene), angles, atol=2e-13)


@pytest.mark.parametrize("body", [CONE, CORNER, CORNER.turn(TILT), WATER])
def test_paths_start_with_the_given_rates(body):
    scene = kr.Scene.from_euler(body, ANGLES, RATES, gravity=2.0)
    h = 1e-4
    before, after = (np.array(angles_of(scene, t)) for t in (-h, h))
    np.testing.assert_allclose((after - before) / (2 * h), RATES, atol=2e-6)


def test_degrees_is_a_keyword_argument():
    other = kr.Scene.from_euler(
        CONE, np.degrees(ANGLES), np.degrees(RATES), degrees=True, gravity=1
    )
    scene = kr.Scene.from_euler(CONE, ANGLES, RATES, gravity=1)
    np.testing.assert_allclose(other.attitude, scene.attitude, atol=1e-15)
    np.testing.assert_allclose(other.momentum, scene.momentum, rtol=1e-14)
    with pytest.raises(TypeError, match="positional"):
        kr.Scene.from_euler(CONE, ANGLES, RATES, True, gravity=1)


@pytest.mark.parametrize(
    "words, exception, message",
    [
        ({"angles": (1, 2)}, ValueError, "angles must be 3 numbers"),
        ({"rates": (1, 2, np.inf)}, ValueError, "rates must be finite"),
        ({"degrees": 1}, TypeError, "degrees must be True or False, not 1"),
        ({"body": TILT}, TypeError, "body must be a kreisel.Body"),
        ({"gravity": "g"}, TypeError, "gravity must be a number"),
    ],
)
def test_invalid_angles_are_refused(words, exception, message):
    with pytest.raises(exception, match=message):
        kr.Scene.from_euler(**{"body": CONE, "angles": ANGLES, "gravity": 1, **words})


# Attitudes


def test_an_attitude_may_be_given_by_scipy():
    Rotation = pytest.importorskip("scipy.spatial.transform").Rotation
    w, x, y, z = TILT
    rotation = Rotation.from_quat((x, y, z, w))
    scene = kr.Scene(CORNER, MOMENTUM, rotation, gravity=1)
    np.testing.assert_allclose(scene.attitude, TILT, rtol=1e-15)
    assert scene.replace(attitude=rotation) == scene
    for several in (Rotation.concatenate([rotation, rotation]), rotation.as_rotvec):
        with pytest.raises((TypeError, ValueError), match=r"a single rotation|attitude must be 4"):
            kr.Scene(CORNER, MOMENTUM, several, gravity=1)


@pytest.mark.parametrize("dtype", [np.float32, np.float16])
def test_a_single_precision_attitude_is_normalized_in_double(dtype):
    rng = np.random.default_rng(5)
    for _ in range(50):
        q = rng.normal(size=4).astype(dtype)
        q /= np.linalg.norm(q)
        for words in ({"attitude": q}, {"attitude_xyzw": q}, {"attitude": list(q)}):
            scene = kr.Scene(CORNER, MOMENTUM, gravity=1, **words)
            assert abs(math.hypot(*scene.attitude) - 1) < 4e-16
        np.testing.assert_allclose(scene.attitude, q.astype(float), atol=4 * np.finfo(dtype).eps)
    with pytest.raises(ValueError, match="divide by it"):
        kr.Scene(CORNER, MOMENTUM, q.astype(float) * (1 + 1e-7), gravity=1)
    with pytest.raises(ValueError, match="divide by it"):
        kr.Scene(CORNER, MOMENTUM, q * dtype(1.1), gravity=1)


# Steady precession


@pytest.mark.parametrize("fast", [False, True])
@pytest.mark.parametrize("gravity", [9.81, -9.81, 0.0])
@pytest.mark.parametrize("tilt", [1e-3, 0.4, 1.0, 2.0, 3.1])
@pytest.mark.parametrize("spin", [60.0, -60.0])
def test_a_steady_precession_stays_steady(spin, tilt, gravity, fast):
    scene = kr.Scene.spinning(CONE, spin, tilt, steady=True, fast=fast, gravity=gravity)
    path = kr.solve(scene, np.linspace(0, 3, 31))
    assert abs(path.nutation - tilt).max() < 1e-12
    np.testing.assert_allclose(path.spin, spin, rtol=1e-14)


@pytest.mark.parametrize("fast", [False, True])
@pytest.mark.parametrize(
    "changes", [{"spin": [30.0, -40.0], "tilt": 0.7}, {"tilt": [0.2, 2.0]}, {}]
)
def test_a_nodding_scene_can_be_varied_to_steady_precessions(changes, fast):
    scene = kr.Scene.from_euler(CONE, (0.1, 0.8, 0.3), rates=(0.2, 0.9, 20.0), gravity=1)
    tops = [*scene.vary(steady=True, fast=fast, **changes).reshape(-1)]
    grid = {"spin": [30.0, 40.0], "steady": True, "fast": fast}
    for top in [*tops, *(kr.Source.grid(scene, **grid)[i] for i in range(2))]:
        for end in (5.0, -5.0):
            assert np.ptp(kr.solve(top, np.linspace(0, end, 50)).nutation) < 1e-13
    nodding = scene.vary(**changes, precession=0.1).reshape(-1)[0]
    assert np.ptp(kr.solve(nodding, np.linspace(0, 5, 50)).nutation) > 0.1


def rate_of(scene):
    """Return the initial precession rate."""
    path = kr.solve(scene, [0.0])
    velocity, apex = path.velocity[0], path.apex[0]
    transverse = velocity - (velocity @ apex) * apex
    return float(np.cross(apex, [0, 0, 1]) @ np.cross(apex, transverse)) / (1 - apex[2] ** 2)


@pytest.mark.parametrize("spin", [60.0, 1e3, -1e4])
@pytest.mark.parametrize("tilt", [0.5, 2.5])
def test_slow_and_fast_are_the_roots_of_the_quadratic(spin, tilt):
    words = {"steady": True, "gravity": 9.81}
    slow, fast = (kr.Scene.spinning(CONE, spin, tilt, fast=fast, **words) for fast in (False, True))
    a, b, root = I1 * math.cos(tilt), I3 * spin, 0.0
    for _ in range(200):  # the slow precession, by a fixed-point iteration without cancellation
        root = (TORQUE + a * root * root) / b
    rounding = 1e-15 * abs(spin)  # rounding error of a velocity
    assert rate_of(slow) == pytest.approx(root, rel=1e-13, abs=rounding)
    assert rate_of(fast) == pytest.approx(TORQUE / a / root, rel=1e-13, abs=rounding)


def test_slow_precession_of_a_horizontal_axis_is_exact():
    scene = kr.Scene.spinning(CONE, 60.0, math.pi / 2, steady=True, gravity=9.81)
    assert rate_of(scene) == pytest.approx(TORQUE / (I3 * 60.0), rel=1e-13)
    level = {"tilt": 90, "degrees": True, "steady": True, "gravity": 9.81}
    with pytest.raises(ValueError, match="only one steady precession"):
        kr.Scene.spinning(CONE, 60.0, fast=True, **level)
    with pytest.raises(ValueError, match="without spin falls"):
        kr.Scene.spinning(CONE, 0.0, **level)


def test_without_spin_steady_precession_is_the_conical_pendulum():
    scene = kr.Scene.spinning(CONE, 0.0, 2.5, steady=True, gravity=9.81)
    path = kr.solve(scene, 5)
    assert abs(path.nutation - 2.5).max() < 1e-13
    assert abs(rate_of(scene)) == pytest.approx(math.sqrt(-TORQUE / (I1 * math.cos(2.5))))


@pytest.mark.parametrize("gravity, tilt", [(9.81, 1.0), (9.81, 0.1), (-9.81, 2.0)])
@pytest.mark.parametrize("degrees", [False, True])
def test_the_reported_least_spin_allows_steady_precession(gravity, tilt, degrees):
    words = {"tilt": np.degrees(tilt) if degrees else tilt, "gravity": gravity}
    words |= {"degrees": degrees, "steady": True}
    with pytest.raises(ValueError, match="no steady precession at this tilt") as error:
        kr.Scene.spinning(CONE, 0.01, **words)
    least = float(re.search(r"one is ([-+.\de]+)$", str(error.value))[1])
    expected = 2 * math.sqrt(I1 * abs(math.cos(tilt)) * TORQUE) / I3
    assert (math.radians(least) if degrees else least) == pytest.approx(expected, rel=1e-14)
    path = kr.solve(kr.Scene.spinning(CONE, -least, **words), 1)
    # near a double root, the error is about the square root of a rounding error
    assert abs(path.nutation - tilt).max() < 1e-6
    with pytest.raises(ValueError, match="no steady precession"):
        kr.Scene.spinning(CONE, least * (1 - 1e-9), **words)


@pytest.mark.parametrize("tilt", [0, 180])
@pytest.mark.parametrize("gravity", [9.81, -9.81, 0])
@pytest.mark.parametrize("spin", [0, 3.0, -200])
def test_at_a_pole_every_spin_is_steady(tilt, gravity, spin):
    words = {"tilt": tilt, "degrees": True, "steady": True, "gravity": gravity}
    scene = kr.Scene.spinning(CONE, spin, **words)
    np.testing.assert_allclose(
        scene.momentum, (0, 0, I3 * math.radians(spin) * (1 if tilt == 0 else -1)), atol=1e-13
    )


# Spinning


def test_spinning_starts_with_or_without_precession():
    free = kr.Scene.spinning(CONE, 30.0, 1.0, gravity=9.81)
    path = kr.solve(free, 1)
    np.testing.assert_allclose(path.velocity[0], 30.0 * path.apex[0], atol=1e-13)
    assert path.nutation[0] == path.nutation.min() == pytest.approx(1.0, abs=1e-15)
    precessing = kr.Scene.spinning(CONE, 30.0, 1.0, precession=2.0, gravity=9.81)
    assert rate_of(precessing) == pytest.approx(2.0, rel=1e-13)
    assert kr.solve(precessing, [0.0]).spin[0] == pytest.approx(30.0, rel=1e-15)
    other = kr.Scene.spinning(
        CONE, np.degrees(30.0), np.degrees(1.0), np.degrees(2.0), degrees=True, gravity=9.81
    )
    np.testing.assert_allclose(other.momentum, precessing.momentum, rtol=1e-14)


@pytest.mark.parametrize(
    "body",
    [
        CONE.turn(TILT),
        CONE.turn((0, 1, 0, 0)),
        kr.Body(1, (2, 2, 2), (0.3, -0.4, 1.2), unphysical=True),
        kr.Body(1, (2, 1, 2), (0, -0.5, 0)),
        kr.Body(1, (2, 2, 1), (0, 0, 0)),
    ],
)
def test_the_axis_may_have_any_direction(body):
    path = kr.solve(kr.Scene.spinning(body, 30.0, 0.6, steady=True, gravity=1), 3)
    assert abs(path.nutation - 0.6).max() < 1e-12 and abs(path.spin - 30.0).max() < 1e-12


@pytest.mark.parametrize(
    "words, exception, message",
    [
        ({"body": CORNER}, ValueError, "spinning needs a symmetric body"),
        (
            {"body": kr.Body(1, (1, 2, 2), (0, 0, 0))},
            ValueError,
            "or the third axis if these points coincide",
        ),
        ({"body": kr.Body(1, (2, 2, 1), (0.5, 0, 0))}, ValueError, "symmetric body"),
        ({"tilt": -0.1}, ValueError, "tilt must lie between 0 and pi, .* degrees=True, not -0.1"),
        ({"tilt": 181, "degrees": True}, ValueError, "between 0 and 180, not 181"),
        ({"spin": None}, TypeError, "spin must be a number"),
        ({"precession": "1"}, TypeError, "precession must be a number"),
        ({"fast": True}, ValueError, "pass steady=True"),
        ({"steady": 1}, TypeError, "steady must be True or False"),
        (
            {"steady": True, "precession": 1},
            ValueError,
            "cannot be combined with precession",
        ),
        (
            {"steady": True, "damping": (0, 0, 1)},
            ValueError,
            "cannot be combined with damping",
        ),
        ({"steady": True, "gravity": (0, 0, -1)}, TypeError, "positive is down"),
    ],
)
def test_spinning_refuses_invalid_arguments(words, exception, message):
    with pytest.raises(exception, match=message):
        kr.Scene.spinning(**{"body": CONE, "spin": 3.0, "tilt": 0.3, "gravity": 1, **words})


def test_textbook_starts_may_be_damped():
    free, damped = (
        kr.Scene.spinning(CONE, 60.0, 1.0, gravity=9.81, damping=d) for d in (None, 0.1)
    )
    assert damped == free.replace(damping=0.1) and damped.damping == (0.1, 0.1, 0.1)
    assert kr.Scene.from_euler(CONE, ANGLES, RATES, damping=(1, 1, 2), gravity=1).damping == (
        1,
        1,
        2,
    )
    assert kr.solve(damped, 1).spin[-1] < 59.9
    assert kr.Scene.spinning(CONE, 60.0, 1.0, steady=True, damping=0.0, gravity=1).damping == (
        0,
        0,
        0,
    )


# Boundary values


def test_the_tilt_is_at_most_half_a_turn():
    body = THESIS.body
    scene = kr.Scene.spinning(body, tilt=math.pi, spin=10.0, steady=True, gravity=1)
    many = kr.Ensemble.spinning(body, tilt=[0.5, math.pi], spin=10.0, steady=True, gravity=1)
    assert scene.attitude[0] == pytest.approx(0.0, abs=1e-15) and len(many) == 2
    for wrong in (math.nextafter(math.pi, 4.0), -5e-324):
        with pytest.raises(ValueError, match=r"tilt"):
            kr.Ensemble.spinning(body, tilt=[0.5, wrong], spin=10.0, steady=True, gravity=1)


@pytest.mark.parametrize("scale", [1e-9, 1.0, 1e9])
def test_symmetry_does_not_depend_on_the_units(scale):
    moments = np.array([1.0, 1.0 + 1e-11, 0.5]) * scale
    lever = 0.5 * scale**0.5
    unlike = kr.Body(1.0, tuple(moments), (0, 0, lever))
    with pytest.raises(ValueError, match="symmetric"):
        kr.Scene.spinning(unlike, tilt=0.5, spin=10.0, steady=True, gravity=1)
    symmetric = kr.Body(1.0, (scale, scale, 0.5 * scale), (0, 0, lever))
    both = kr.Ensemble.of([THESIS.replace(body=unlike), THESIS.replace(body=symmetric)]).body
    with pytest.raises(ValueError, match=r"^body\[0\]: "):
        kr.Ensemble.spinning(both, tilt=0.5, spin=10.0, steady=True, gravity=1)
    leans = kr.Body(1.0, tuple(moments), (1e-3 * lever, 0, lever))
    path = kr.solve(TOP.replace(body=leans), [0.0])
    with pytest.raises(ValueError, match="no rod for this top"):
        kr.rod(path)


def test_steady_precessions_of_symmetric_ensembles_equal_single_ones():
    bodies = [kr.Body(1.0, (4.0, 4.0, c), (0, 0, z)) for c, z in ((3.0, 1.0), (2.0, -0.5))]
    many = kr.Ensemble.of([THESIS.replace(body=body) for body in bodies]).body
    tops = kr.Ensemble.spinning(many, tilt=0.5, spin=10.0, steady=True, gravity=1)
    for i, body in enumerate(bodies):
        one = kr.Scene.spinning(body, tilt=0.5, spin=10.0, steady=True, gravity=1)
        np.testing.assert_allclose(tops[i].momentum, one.momentum, rtol=1e-14, atol=1e-14)
