"""Tests of kreisel_step.h, the step for other engines, against closed forms and the library."""

import ctypes

import kreisel as kr
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from toolbox import CSRC, need, run

LAWS = settings(max_examples=60, derandomize=True, deadline=None, database=None)
METHODS = {2: "strang", 4: "takahashi_imada4"}
ORDERS = st.sampled_from([2, 4])
SEEDS = st.integers(0, 2**32 - 1)
FRAME = 1 / 60


@pytest.fixture(scope="module")
def library(tmp_path_factory):
    """Return the functions of the header in a shared library."""
    need("gcc")
    folder = tmp_path_factory.mktemp("step")
    (folder / "step.c").write_text('#define KR_STEP_API\n#include "kreisel_step.h"\n')
    words = ["-std=c99", "-O1", "-ffp-contract=off", "-fPIC", "-shared", f"-I{CSRC}"]
    run("gcc", *words, folder / "step.c", "-lm", "-o", folder / "step.so")
    return ctypes.CDLL(folder / "step.so")


def advance(library, moments, q, m, h, order=2, *, impulse=None, number=np.float64, steps=1):
    """Return the attitude and the momentum after `steps` steps of doubles or floats."""
    real, suffix = (ctypes.c_float, "f") if number is np.float32 else (ctypes.c_double, "")
    function = getattr(library, "kr_step" + suffix)
    moments, q, m = (np.array(x, dtype=number) for x in (moments, q, m))
    push = None if impulse is None else np.array(impulse, dtype=number)
    words = [None if x is None else x.ctypes for x in (moments, q, m, push)]
    for _ in range(steps):
        function(*words, real(h), order)
    return q, m


def draw_body(seed):
    """Return three different moments, an attitude and a momentum.

    The norm of the attitude is exactly 1, so that the library does not change it.
    """
    rng = np.random.default_rng(seed)
    a, b, c = rng.uniform(0.2, 2.0, 3)
    q = np.zeros(4)
    while q[0] ** 2 + (q[1] ** 2 + q[2] ** 2 + q[3] ** 2) != 1:
        q = rng.normal(size=4)
        q /= np.linalg.norm(q)
    return np.array([b + c, c + a, a + b]), q, rng.normal(size=3)


def solve(moments, q, m, t, **options):
    body = kr.Body(mass=1, inertia=moments, com=(0, 0, 0))
    return kr.solve(kr.Scene(body, attitude=q, momentum=m, gravity=0), [t], **options).q[-1]


@LAWS
@given(seed=SEEDS, order=ORDERS, turn=st.sampled_from([1e-3, 0.1, 1.4, 2.0]))
def test_a_step_has_the_bits_of_the_library(library, seed, order, turn):
    """Unless the second moment is between the others, the library renames axes by a product.

    It has sines of its own for larger angles. In both cases the results differ by rounding errors.
    """
    moments, q, m = draw_body(seed)
    h = turn * moments.min() / np.linalg.norm(m)
    truth = solve(moments, q, m, h, method=METHODS[order], step=h)
    stepped, momentum = advance(library, moments, q, m, h, order)
    is_same = turn < 2 and np.median(moments) == moments[1]
    np.testing.assert_allclose(stepped, truth, rtol=0, atol=0 if is_same else 1e-15)
    np.testing.assert_array_equal(momentum, m)


@pytest.mark.parametrize(
    ("order", "number", "largest"),
    [(2, np.float64, 2e-3), (4, np.float64, 1e-6), (2, np.float32, 2e-3), (4, np.float32, 1e-4)],
)
def test_a_tumbling_cuboid_stays_near_its_closed_form(library, order, number, largest):
    moments = np.array([0.1, 0.26, 0.34]) / 3
    m = moments * [3, 1, 2]
    truth = solve(moments, (1, 0, 0, 0), m, 10)
    q, _ = advance(library, moments, (1, 0, 0, 0), m, FRAME, order, number=number, steps=600)
    assert kr.attitude_error(q / np.linalg.norm(q), truth) < largest
    q, m = advance(library, moments, q, m, FRAME, order, number=number, steps=20000)
    body = kr.quaternion.turn_back(q, m)
    assert body @ (body / moments) / 2 == pytest.approx(0.42, rel=1e-4)


@LAWS
@given(seed=SEEDS, order=ORDERS, turn=st.sampled_from([0.3, 100.0]), axis=st.integers(0, 3))
def test_the_step_is_exact_for_symmetric_bodies(library, seed, order, turn, axis):
    moments, q, m = draw_body(seed)
    moments[[(axis + 1) % 3, (axis + 2) % 3]] = moments[0] + moments[1]
    if axis == 3:
        moments[:] = moments[0]
    h = turn * moments.min() / np.linalg.norm(m)
    stepped, _ = advance(library, moments, q, m, h, order)
    assert kr.attitude_error(stepped, solve(moments, q, m, h)) < 1e-15 * (5 + turn)


@LAWS
@given(seed=SEEDS, order=ORDERS, turn=st.sampled_from([0.0, 1e-30, 1.0, 100.0]))
def test_large_steps_keep_the_momentum_and_the_norm(library, seed, order, turn):
    moments, q, m = draw_body(seed)
    h = turn * moments.min() / np.linalg.norm(m)
    for number, largest in ((np.float64, 1e-13), (np.float32, 1e-4)):
        stepped, momentum = advance(library, moments, q, m, h, order, number=number, steps=100)
        np.testing.assert_array_equal(momentum, m.astype(number))
        assert abs(np.linalg.norm(stepped) - 1) < largest
        rest, _ = advance(library, moments, q, 0 * m, h, order, number=number)
        np.testing.assert_allclose(rest, q, rtol=0, atol=largest)


@LAWS
@given(seed=SEEDS, order=ORDERS)
def test_a_step_is_undone_by_the_opposite_step(library, seed, order):
    moments, q, m = draw_body(seed)
    there = advance(library, moments, q, m, 0.1, order, impulse=(0.3, -0.2, 0.1))
    back, momentum = advance(library, moments, *there, -0.1, order, impulse=(-0.3, 0.2, -0.1))
    np.testing.assert_allclose(back, q, rtol=0, atol=2e-15)
    np.testing.assert_allclose(momentum, m, rtol=0, atol=2e-15)


def test_a_constant_torque_accelerates_a_wheel(library):
    """The angle about its axle is w t + a t^2 / 2."""
    q, m = advance(library, (1, 1, 2), (1, 0, 0, 0), (0, 0, 3), 0.1, impulse=(0, 0, 0.4), steps=9)
    angle = 1.5 * 0.9 + 2.0 * 0.9**2 / 2
    np.testing.assert_allclose(q, (np.cos(angle / 2), 0, 0, np.sin(angle / 2)), atol=1e-14)
    np.testing.assert_allclose(m, (0, 0, 6.6), rtol=1e-14)


@LAWS
@given(seed=SEEDS)
def test_velocities_and_momenta_are_those_of_a_path(library, seed):
    moments, q, m = draw_body(seed)
    body = kr.Body(mass=1, inertia=moments, com=(0, 0, 0))
    truth = kr.solve(kr.Scene(body, attitude=q, momentum=m, gravity=0), [0.0]).velocity[0]
    w, back = np.zeros(3), np.zeros(3)
    library.kr_step_velocity(moments.ctypes, q.ctypes, m.ctypes, w.ctypes)
    library.kr_step_momentum(moments.ctypes, q.ctypes, w.ctypes, back.ctypes)
    np.testing.assert_allclose(w, truth, rtol=0, atol=1e-14)
    np.testing.assert_allclose(back, m, rtol=0, atol=1e-14)
