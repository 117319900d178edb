"""Tests of the turning points and motion types of closed-form solutions."""

import math

import kreisel as kr
import mpmath as mp
import numpy as np
import pytest

BODY = kr.Body.symmetric(1.0, 1.0, 0.5, 1.0, unphysical=True)
TILTED = (0.8**0.5, 0.2**0.5, 0.0, 0.0)  # cosine 0.6
STEADY = kr.scenes.steady_precession
GENERAL = kr.scenes.asymmetric


def unit(q):
    return np.array(q) / np.linalg.norm(q)


def exact_start(scene):
    """Return the initial height of the apex, and the vertical and axial momentum."""
    w, x, y, z = (mp.mpf(c) for c in scene.attitude)
    norm = w * w + x * x + y * y + z * z
    apex = [2 * (x * z + w * y) / norm, 2 * (y * z - w * x) / norm]
    apex.append((w * w - x * x - y * y + z * z) / norm)
    m = [mp.mpf(c) for c in scene.momentum]
    return apex[2], m[2], sum(a * b for a, b in zip(apex, m, strict=True))


def roots_of(a, b, c, d):
    """Return the three real roots of a cubic equation in ascending order."""
    shift, p = b / (3 * a), c / a - (b / a) ** 2 / 3
    q = 2 * shift**3 - shift * c / a + d / a
    size = 2 * mp.sqrt(max(-p / 3, 0))
    third = mp.acos(max(-1, min(1, 3 * q / (p * size)))) / 3 if size else 0
    return sorted(size * mp.cos(third - 2 * mp.pi * k / 3) - shift for k in range(3))


def true_turning(scene):
    """Return the smallest and largest nutation angles of a symmetric top in high precision."""
    with mp.workdps(250):
        u, vertical, axial = exact_start(scene)
        pull = 2 * mp.mpf(scene.body.moments[0]) * mp.mpf(scene.body.mass)
        pull *= mp.mpf(scene.gravity) * mp.mpf(scene.body.com[2])
        # I1^2 (du/dt)^2 = (free - pull u)(1 - u^2) - (vertical - axial u)^2
        square = sum(mp.mpf(c) ** 2 for c in scene.momentum) - axial**2
        free = square + pull * u
        roots = roots_of(pull, -free - axial**2, 2 * vertical * axial - pull, free - vertical**2)
        low, high = roots[:2] if pull > 0 else roots[1:]
        return float(mp.acos(min(high, 1))), float(mp.acos(max(low, -1)))


def draw_top(rng, kind):
    """Return a random top, close to a special case such as a cusp unless `kind` is "anywhere"."""
    deviation, tilt = 10.0 ** rng.uniform(-14, -1), rng.uniform(0.1, 3.0)
    i1, lever = 10.0 ** rng.uniform(-1, 1), 10.0 ** rng.uniform(-2, 2)
    body = kr.Body.symmetric(1.0, i1, 0.1, lever, unphysical=True)
    q, gravity = unit((math.cos(tilt / 2), math.sin(tilt / 2), 0, 0)), 1.0
    apex, speed = np.array((0, -math.sin(tilt), math.cos(tilt))), math.sqrt(i1 * lever)
    momentum = deviation * rng.normal(size=3)
    if kind == "anywhere":
        momentum = rng.normal(size=3) * 10.0 ** rng.uniform(-2, 2)
        gravity = rng.uniform(-1, 1)
    elif kind == "cusp":
        momentum += 3 * speed * apex
    elif kind == "steady":
        rate = rng.uniform(0.3, 3) * math.sqrt(lever / i1)
        transverse = np.array((0, math.cos(tilt), math.sin(tilt)))
        momentum += (i1 * rate**2 * math.cos(tilt) + lever) / rate * apex
        momentum += i1 * rate * math.sin(tilt) * transverse
    elif kind == "upright":
        q, momentum[2] = unit((1, deviation, 0, 0)), rng.uniform(0.2, 4) * speed
    else:  # a pendulum that is a little faster than on the separatrix
        momentum = np.array((2 * speed * math.sin(tilt / 2) * (1 + deviation), 0, 0))
    return kr.Scene(body, momentum, q, gravity)


@pytest.mark.parametrize("kind", ["anywhere", "cusp", "steady", "upright", "separatrix"])
def test_turning_points_are_roots_of_the_cubic(kind):
    rng = np.random.default_rng(7)
    for _ in range(20):
        scene = draw_top(rng, kind)
        top = kr.exact(scene)
        least, greatest = true_turning(scene)
        assert top.least_nutation == pytest.approx(least, rel=1e-14, abs=1e-15), scene
        assert top.greatest_nutation == pytest.approx(greatest, rel=1e-14, abs=1e-15), scene


COURSES = {
    "cusps": kr.scenes.cusps,
    "steady": STEADY,
    "loops": kr.Scene(BODY, body_momentum=(0.0, -0.4, 3.0), attitude=TILTED, gravity=1),
    "waves": kr.Scene(BODY, body_momentum=(0.0, 0.3, 3.0), attitude=TILTED, gravity=1),
    "rosette": kr.Scene(BODY, momentum=(0.3, 0, 1), gravity=1),
    "pendulum": kr.Scene(BODY, momentum=(0, 0, 0), attitude=TILTED, gravity=1),
    "separatrix": kr.Scene(BODY, momentum=(2, 0, 0), attitude=(0, 1, 0, 0), gravity=1),
    "sleeping": kr.Scene(BODY, momentum=(0, 0, 3), gravity=1),
    "hanging": kr.Scene(BODY, momentum=(0, 0, 3), attitude=(0, 1, 0, 0), gravity=1),
    "circle": kr.Scene(BODY, momentum=(1, 2, 3), attitude=TILTED, gravity=0),
    "resting": kr.Scene(BODY, momentum=(0, 0, 0), attitude=TILTED, gravity=0),
}
SPHERE = kr.Body(1.0, (1.0, 1.0, 1.0), (0, 0, 0), rotor=(0, 0, -1.3))
MOTIONS = {**COURSES, "sphere": kr.Scene(SPHERE, (1, 2, 3), TILTED, gravity=0)}
TURNED = {  # the same motion upside down, and with the axis of the body reversed
    "as it is": lambda scene: scene,
    "gravity upwards": lambda s: s.replace(
        attitude=kr.quaternion.multiply((0, 1, 0, 0), s.attitude),
        momentum=(s.momentum[0], -s.momentum[1], -s.momentum[2]),
        gravity=-s.gravity,
    ),
    "centre of mass below": lambda s: s.replace(
        body=kr.Body.symmetric(1.0, 1.0, 0.5, -1.0, unphysical=True),
        gravity=s.gravity,
        attitude=kr.quaternion.multiply(s.attitude, (0, 1, 0, 0)),
    ),
}


@pytest.mark.parametrize("description", TURNED)
@pytest.mark.parametrize("course", COURSES)
def test_motion_types_do_not_depend_on_the_description(course, description):
    plain, top = kr.exact(COURSES[course]), kr.exact(TURNED[description](COURSES[course]))
    assert plain.motion_type == top.motion_type == course
    expected = plain.least_nutation, plain.greatest_nutation, plain.t_least, plain.t_greatest
    if description == "gravity upwards":
        expected = math.pi - expected[1], math.pi - expected[0], expected[3], expected[2]
    limits = top.least_nutation, top.greatest_nutation, top.t_least, top.t_greatest
    assert limits == pytest.approx(expected, abs=1e-14)


@pytest.mark.parametrize("course", MOTIONS)
@pytest.mark.parametrize("description", TURNED)
def test_the_path_stays_between_turning_points_and_reaches_them(course, description):
    scene = TURNED[description](MOTIONS[course])
    top = kr.exact(scene)
    nutation = kr.solve(scene, np.linspace(0, 10, 4001), method="taylor").nutation
    assert nutation.min() > top.least_nutation - 1e-12
    assert nutation.max() < top.greatest_nutation + 1e-12
    for t, angle in (top.t_least, top.least_nutation), (top.t_greatest, top.greatest_nutation):
        assert t >= 0
        if t < math.inf:
            assert top(t).nutation[0] == pytest.approx(angle, abs=1e-13)
    if top.period < math.inf and course not in ("steady", "separatrix"):
        assert abs(top.t_least - top.t_greatest) == pytest.approx(top.period / 2, rel=1e-14)


def test_on_the_separatrix_the_upright_position_is_never_reached():
    rising = kr.exact(COURSES["separatrix"])
    assert rising.t_least == math.inf and rising.t_greatest == 0
    falling = kr.exact(rising(5.0).scene_at(0).replace(momentum=-np.array(rising(5.0).m[0])))
    assert falling.t_greatest == pytest.approx(5.0, rel=1e-12)


@pytest.mark.parametrize("name", ["loops", "cusps", "waves", "steady", "circle", "pendulum"])
@pytest.mark.parametrize("description", TURNED)
def test_the_potential_is_energy_minus_kinetic_energy_of_nutation(name, description):
    scene = TURNED[description](COURSES[name])
    top, path = kr.exact(scene), kr.solve(scene, np.linspace(0.1, 7.1, 50))
    inertia = scene.body.moments[0]
    rate = np.cross(path.velocity, path.apex)[:, 2] / np.sin(path.nutation)
    potential = path.energy - inertia * rate**2 / 2
    assert top.potential(path.nutation) == pytest.approx(potential, rel=1e-12)
    ends = top.potential([top.least_nutation, top.greatest_nutation])
    if name != "pendulum":
        assert ends == pytest.approx([path.energy[0]] * 2, rel=1e-13)


def test_the_potential_has_the_shape_of_its_angles_and_is_infinite_at_poles():
    top = kr.exact(kr.scenes.cusps)
    assert top.potential(1.0).shape == () and top.potential(np.ones((2, 3))).shape == (2, 3)
    assert top.potential([]).shape == (0,)
    assert top.potential(0.0) == math.inf and top.potential(math.pi) > 1e30
    assert kr.exact(kr.scenes.thesis).potential(0.0) < math.inf  # its apex can reach the vertical


def test_the_critical_spin_separates_sleeping_from_falling_tops():
    spin = kr.exact(COURSES["sleeping"]).critical_spin
    assert spin == 4.0
    for factor, falls in (0.99, True), (1.01, False):
        scene = kr.Scene(BODY, velocity=(1e-9, 0, factor * spin), gravity=1)
        assert (kr.exact(scene).greatest_nutation > 1e-2) is falls
    assert kr.exact(COURSES["circle"]).critical_spin == 0.0


FREE = GENERAL.replace(gravity=0.0)
PLATE = kr.Scene(kr.Body(1.0, (1, 2, 2), (0, 0, 0)), momentum=(1, 2, 3))


@pytest.mark.parametrize(
    "call, word",
    [
        (lambda: kr.exact(FREE).least_nutation, "general"),
        (lambda: kr.exact([kr.scenes.thesis, FREE]).greatest_nutation, r"scene\[1\]"),
        (lambda: kr.exact(PLATE).motion_type, "euler"),
        (lambda: kr.exact(kr.scenes.cusps.replace(damping=(0, 0, 0.1))), "damping"),
        (lambda: kr.exact(kr.scenes.cusps.replace(friction=0.2)), "friction"),
        *[
            (lambda x=x: kr.exact(kr.scenes.cusps).potential(x), "nutation")
            for x in ("upright", None, math.nan, [1j])
        ],
    ],
)
def test_turning_points_and_potentials_are_refused(call, word):
    with pytest.raises((TypeError, ValueError), match=word):
        call()


@pytest.mark.parametrize("size", [1e-9, 1.0, 1e9])
def test_turning_points_of_spherical_bodies_need_a_rotor_along_the_third_axis(size):
    axial, oblique = (
        kr.exact(kr.Scene(kr.Body(1, (1, 1, 1), (0, 0, 0), rotor=rotor), momentum=(0.1, 0.2, 0.3)))
        for rotor in ((0, 0, size), (1e-9 * size, 0, size))
    )
    assert axial.motion_type == "circle"
    with pytest.raises(ValueError, match="Lagrange"):
        oblique.motion_type  # noqa: B018


def test_tops_beyond_the_range_of_doubles_have_no_closed_form():
    body = kr.Body(1e-300, (1e300, 1e300, 1e-300), (0, 0, 1e-300), unphysical=True)
    top = kr.Scene(body, (0, 0, 1e300), gravity=1e300)
    with pytest.raises(ValueError, match="range"):
        kr.exact(top)
    many = kr.exact(top.vary(gravity=[1.0, 1e300]))
    with pytest.raises(ValueError, match=r"top\[0\].*range"):
        many.period  # noqa: B018
