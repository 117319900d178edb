"""Tests of the Taylor method with 16, 20 and 30 digits, and of its error estimates.

If a solution is an elementary function of time, the last Taylor terms are a poor estimate of the
truncation error.
"""

from fractions import Fraction

import kreisel as kr
import mpmath as mp
import numpy as np
import pytest

from validation.references.quadrature import product

CORNER = kr.Body.cuboid(half=(0.6, 0.8, 1), pivot=(0.1, -0.2, -1))  # no two moments are equal
GENERAL = kr.Scene(
    CORNER, momentum=(0.172, -1.862, 1.46), attitude=(0.8, 0.4, -0.2, 0.4), gravity=1
)
TIMES = (1.5, 8.0)


def normalize(q):
    return np.array(q) / np.linalg.norm(q)


def add_words(path, name, index=-1):
    """Return an attitude or a momentum of a path as exact sums of its two words."""
    words = (getattr(path, x)[index].tolist() for x in (name, f"{name}_low"))
    return [Fraction(x) + Fraction(y) for x, y in zip(*words, strict=True)]


def find_angle(a, b):
    """Return the angle between the final attitudes of two paths."""
    p, q = add_words(a, "q"), add_words(b, "q")
    vector = product([p[0], -p[1], -p[2], -p[3]], q)[1:]
    return 2 * float(sum(x * x for x in vector)) ** 0.5


def to_exact(numbers):
    return [mp.mpf(float(x)) for x in numbers]


def rotate_by(vector, angle):
    """Return the quaternion of a rotation by `angle` * |vector| about `vector`."""
    size = mp.sqrt(sum(x * x for x in vector))
    sine = mp.sin(size * angle / 2) / size if size else mp.mpf(0)
    return [mp.cos(size * angle / 2), *(x * sine for x in vector)]


def follow_free_symmetric_body(scene, t):
    """Return the attitude from the closed-form solution."""
    axes, m = to_exact(scene.body.axes), to_exact(scene.momentum)
    q = product(to_exact(scene.attitude), axes)
    norm = mp.sqrt(sum(x * x for x in q))
    q = [x / norm for x in q]
    one, _, lone = to_exact(scene.body.moments)
    axis = product(product(q, [0, 0, 0, 1]), [q[0], -q[1], -q[2], -q[3]])[1:]
    axial = sum(x * y for x, y in zip(m, axis, strict=True))
    spin = [mp.mpf(0), mp.mpf(0), axial * (1 / lone - 1 / one)]
    principal = product(product(rotate_by([x / one for x in m], t), q), rotate_by(spin, t))
    norm = mp.sqrt(sum(x * x for x in axes))
    return [x / norm for x in product(principal, [axes[0], *(-x for x in axes[1:])])]


def find_largest_error(path):
    """Return the largest angle [rad] between the attitudes of a path and the exact solution."""
    worst = mp.mpf(0)
    for i, t in enumerate(path.t.tolist()):
        q = [mp.mpf(x.numerator) / x.denominator for x in add_words(path, "q", i)]
        w, x, y, z = follow_free_symmetric_body(path.scene, mp.mpf(t))
        vector = product([w, -x, -y, -z], q)[1:]
        worst = max(worst, 2 * mp.sqrt(sum(x * x for x in vector)))
    return float(worst)


def draw_free_tops():
    random = np.random.default_rng(2)
    for upright in (True, False) * 6:
        body = kr.Body(1.0, (1, 1, random.uniform(0.2, 1.8)), (0, 0, 1), unphysical=True)
        momentum = random.normal(size=3) * ((0, 0, 1) if upright else (1, 1, 1))
        yield kr.Scene(body, momentum, normalize(random.normal(size=4)), gravity=0)


def draw_thin_bodies(lone, has_rotation):
    """Yield random free bodies with one small moment of inertia."""
    random = np.random.default_rng(5)
    for _ in range(8):
        body = kr.Body(1.0, (1, 1, lone), (0, 0, 1), unphysical=True)
        if has_rotation:
            body = body.turn(normalize(random.normal(size=4)))
        push = kr.quaternion.turn(body.axes, tuple(random.normal(size=3) * (1, 1, lone)))
        attitude = normalize(random.normal(size=4))
        yield kr.Scene(body, body_momentum=push, attitude=attitude, gravity=0)


@pytest.mark.parametrize("digits, bound", [(20, 1e-19), (30, 1e-29)])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_sum_of_few_exponentials_is_accurate_to_all_digits(digits, bound, sign):
    with mp.workdps(60):
        for scene in draw_free_tops():
            path = kr.solve(scene, [sign * t for t in TIMES], "taylor", digits=digits)
            assert find_largest_error(path) < bound, scene


def test_a_steady_precession_is_accurate_to_all_digits():
    scene = kr.scenes.steady_precession
    paths = [kr.solve(scene, 20, "taylor", digits=digits) for digits in (20, 30)]
    low, high = ((path.m[-1, 2] - scene.momentum[2]) + path.m_low[-1, 2] for path in paths)
    assert abs(low) < 1e-18 and abs(high) < 1e-28 and paths[0].error < 1e-18


@pytest.mark.parametrize("has_rotation", [False, True])
@pytest.mark.parametrize("lone", [1e-2, 1e-5, 1e-7])
def test_thin_bodies_are_accurate_to_30_digits_with_right_error_estimates(lone, has_rotation):
    """Check thin bodies, whose small moment of inertia amplifies rounding errors."""
    if has_rotation:
        pytest.importorskip("flint")
    ratios = []
    with mp.workdps(60):
        for end, scene in zip((8.0, -8.0) * 4, draw_thin_bodies(lone, has_rotation), strict=True):
            path = kr.solve(scene, [end], "taylor", digits=30)
            # a turned body is symmetric up to rounding, so its truth is a proved enclosure
            true = path.verify().error if has_rotation else find_largest_error(path)
            assert true < 3e-30
            ratios.append(path.error / true)
    assert min(ratios) > 1 and np.median(ratios) < 10 and max(ratios) < 60


def test_the_error_estimate_of_30_digits_is_not_below_the_true_error():
    with mp.workdps(60):
        paths = [kr.solve(scene, list(TIMES), "taylor", digits=30) for scene in draw_free_tops()]
        ratios = sorted(path.error / find_largest_error(path) for path in paths)
    assert ratios[0] > 1 and ratios[-1] < 60
    assert ratios[len(ratios) // 2] < 10
    # The attitude error of the asymmetric top is proved (interval arithmetic with 144 bits).
    assert 1.97e-24 < kr.solve(kr.scenes.asymmetric, [100.0], "taylor", digits=30).error < 2e-23


def test_the_error_of_30_digits_is_at_most_pi():
    body = kr.Body(1.0, (1.0, 1.5, 2.0), (0.0, 0.0, 0.0))
    free = kr.Scene(body, body_momentum=(1e-200, 1, 0), gravity=0.0)
    assert kr.solve(free, np.linspace(0.0, 1900.0, 20), digits=30).error == np.pi
    assert kr.solve(free, [20.0], digits=30).error < 1e-20
    assert kr.solve(free, []).error == 0.0 and kr.solve(free, [0.0]).error < 1e-15


def test_low_words_extend_the_state():
    plain, twenty, thirty = (kr.solve(GENERAL, 10, digits=digits) for digits in (16, 20, 30))
    assert 1e-17 < find_angle(plain, thirty) < 1e-13
    assert 1e-23 < find_angle(twenty, thirty) < 1e-18
    assert not plain.q_low.any() and not plain.m_low.any()
    assert abs(float(sum(x * x for x in add_words(thirty, "q")) - 1)) < 1e-30
    assert abs(float(add_words(thirty, "m")[2] - Fraction(1.46))) < 1e-28
    assert thirty.digits == 30 and thirty.tol is None and "digits=30" in repr(thirty)
    with pytest.raises(ValueError, match="read-only"):
        thirty.q_low[0, 0] = 1
    assert kr.solve(kr.scenes.thesis, 2, digits=30).method == "taylor"  # and no closed form


@pytest.mark.parametrize(
    "digits, expected", [(None, 16), (1, 16), (16, 16), (17, 20), (20, 20), (21, 30), (30, 30)]
)
def test_digits_are_rounded_up(digits, expected):
    path, same = (kr.solve(GENERAL, 2, digits=n) for n in (digits, expected))
    assert path.digits in (digits, expected)
    assert np.array_equal(path.states, same.states) and np.array_equal(path.q_low, same.q_low)


@pytest.mark.parametrize(
    "options, low, high",
    [
        ({}, 1e-16, 1e-13),
        ({"tol": 1e-6}, 1e-8, 1e-4),
        ({"digits": 20}, 1e-22, 1e-18),
        ({"method": "strang", "step": 0.01}, 1e-7, 1e-2),
    ],
)
def test_a_path_estimates_its_error(options, low, high):
    path, truth = kr.solve(GENERAL, [1, 5, 10], **options), kr.solve(GENERAL, 10, digits=30)
    assert low < path.error < high
    assert path.error == pytest.approx(find_angle(path, truth), rel=1e-3)


def test_the_error_of_tops_is_estimated_within_a_factor_of_three():
    random, errors = np.random.default_rng(5), []
    for i in range(25):
        half, pivot = random.uniform(0.5, 1.5, 3), random.uniform(-1.5, 1.5, 3)
        if i % 3 == 0:  # a Lagrange top, whose closed form provides the estimate of a large error
            half[1], pivot[:2] = half[0], 0.0
        momentum, attitude = random.normal(scale=5, size=3), normalize(random.normal(size=4))
        scene = kr.Scene(kr.Body.cuboid(half=half, pivot=pivot), momentum, attitude, gravity=1)
        options = {"tol": 10.0 ** -random.integers(4, 12)} if i % 5 else {"digits": 16}
        path = kr.solve(scene, 5, method="taylor", **options)
        true = find_angle(path, kr.solve(scene, 5, method="taylor", digits=30))
        assert 1e-17 < true < 1e-2 and true / 3 < path.error < true * 3, (i, true, path.error)
        errors.append(true)
    assert min(errors) < 1e-13 and max(errors) > 1e-6


def test_dense_output_needs_no_extra_steps():
    many, one = kr.solve(GENERAL, np.linspace(0, 10, 5001)), kr.solve(GENERAL, 10)
    assert many.stats == one.stats and many.stats.steps < 30
    assert np.array_equal(many.states[-1], one.states[-1])
    assert np.ptp(many.energy) < 1e-14 * many.kinetic.max()


def test_max_steps_keeps_the_low_words():
    with pytest.raises(kr.Error) as failure:
        kr.solve(GENERAL, [1, 2, 50], digits=30, max_steps=5)
    path = failure.value.path
    assert len(path) == len(path.q_low) >= 2 and path.q_low[-1].any()


@pytest.mark.parametrize(
    "options, error, word",
    [
        ({"digits": 31}, ValueError, "30"),
        ({"digits": 0}, ValueError, "digits"),
        ({"digits": 20.0}, TypeError, "digits"),
        ({"digits": 20, "tol": 1e-9}, ValueError, "both"),
        ({"digits": 20, "method": "extrap"}, ValueError, "taylor"),
    ],
)
def test_bad_digits_are_refused(options, error, word):
    with pytest.raises(error, match=word):
        kr.solve(GENERAL, 1, **options)
