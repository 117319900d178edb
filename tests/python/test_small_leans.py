"""Tests of tops released at a tiny tilt from the unstable equilibrium.

The result must not depend on the order of the body axes.
"""

import kreisel as kr
import numpy as np
import pytest
from decimal_series import Series, attitude_error
from kreisel.quaternion import conjugate, multiply, turn_back

CYCLES = {0: (0.5, 0.5, 0.5, 0.5), 1: (0.5, -0.5, -0.5, -0.5), 2: (1.0, 0.0, 0.0, 0.0)}
DIGITS = 38  # of the reference solution; errors of the initial tilt grow by up to 20 digits
# the product of this quaternion with a cyclic permutation of the axes is exact
LEAN = (1.0, 2.0**-40, 3.0 * 2.0**-42, 0.0)


def permute_axes(axis, moments, lever=1.0):
    """Return a slightly tilted top whose apex is the body axis with index `axis`."""
    shift = (axis + 1) % 3
    body = kr.Body(1, np.roll(moments, shift), com=np.roll((0, 0, lever), shift), unphysical=True)
    attitude = multiply(LEAN, conjugate(CYCLES[axis]))
    return kr.Scene(body, momentum=(0, 0, 0.25), attitude=attitude, gravity=1)


@pytest.mark.parametrize("moments", [(0.8, 1.0, 1.2), (1.0, 1.2, 0.8), (1.0, 0.8, 1.2)])
def test_general_bodies_keep_a_small_tilt(moments):
    body = kr.Body(1, moments, com=(0, 0, 1), unphysical=True)
    scene = kr.Scene(body, momentum=(0, 0, 0), attitude=(1, 5e-13, 3e-13, 0), gravity=1)
    path = kr.solve(scene, [31.0])
    q, _ = Series(scene, DIGITS).to(31.0)
    assert path.nutation[0] > 0.3
    assert attitude_error(q, path.q[0]) < 1e-11


def test_general_bodies_keep_a_tilt_below_double_precision():
    body = kr.Body(1, (1.0, 0.8, 1.2), com=(0, 0, 1), unphysical=True)
    scene = kr.Scene(body, momentum=(0, 0, 0), attitude=(1, 5e-21, 3e-21, 0), gravity=1)
    q, _ = Series(scene, DIGITS).to(51.0)
    ensemble = kr.solve(kr.Ensemble.of([scene]), [51.0], "taylor")
    for path in (kr.solve(scene, [51.0]), ensemble[0]):
        assert path.nutation[0] > 0.3
        assert attitude_error(q, path.q[0]) < 1e-11


@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("moments", [(0.8, 1.0, 1.2), (1.0, 1.0, 0.7), (1.0, 1.0, 1.0)])
def test_upright_bodies_keep_a_small_tilt_along_each_axis(axis, moments):
    scene = permute_axes(axis, moments)
    assert np.abs(np.array(turn_back(scene.attitude, (0, 0, 1)))[axis - 1]) < 1e-11
    q, _ = Series(scene, DIGITS).to(31.0)
    ensemble = kr.solve(kr.Ensemble.of([scene]), [31.0], "taylor")
    run = kr.start(scene, "taylor")
    run.to(3.0)
    later_path = kr.resume(run.checkpoint).to([31.0])
    for path in (kr.solve(scene, [31.0], "taylor"), ensemble[0], later_path):
        assert path.nutation[0] > 0.3
        assert attitude_error(q, path.q[0]) < 1e-11


@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("method", ["strang", "blanes_moan6", "bobenko_suris", "exact", "rk4"])
def test_the_motion_does_not_depend_on_the_order_of_axes(axis, method):
    words = {} if method == "exact" else {"step": 0.0625}
    paths = [kr.solve(permute_axes(i, (1.0, 1.0, 0.7)), [31.0], method, **words) for i in (2, axis)]
    assert paths[0].nutation[0] > 0.1
    attitude = multiply(paths[1].q[0], CYCLES[axis])
    assert kr.attitude_error(paths[0].q[0], attitude) < 1e-11


def test_sections_and_tangents_keep_a_small_tilt():
    event = kr.events.nutation(direction=-1)
    one, other = (kr.section(permute_axes(i, (0.8, 1.0, 1.2)), event, n=1) for i in (2, 0))
    assert abs(one.t[0] - other.t[0]) < 1e-10
    tangents = [
        kr.solve(permute_axes(i, (0.8, 1.0, 1.2)), [31.0], "taylor", tangents="gravity").tangents
        for i in (2, 0)
    ]
    size = np.abs(tangents[0]).max()
    assert np.abs(tangents[0][0, 3:] - tangents[1][0, 3:]).max() < 1e-11 * size
