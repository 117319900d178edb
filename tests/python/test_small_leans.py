"""Tests of tops released at a tiny tilt from the unstable equilibrium.

The result must not depend on the order of the body axes. test_truths.py compares their paths.
"""

import kreisel as kr
import numpy as np
import pytest

multiply = kr.quaternion.multiply

CYCLES = {0: (0.5, 0.5, 0.5, 0.5), 1: (0.5, -0.5, -0.5, -0.5), 2: (1.0, 0.0, 0.0, 0.0)}
LEAN = (1.0, 2.0**-40, 3.0 * 2.0**-42, 0.0)  # its product with a permutation of axes is exact


def permute_axes(axis, moments):
    """Return a slightly tilted top whose apex is the body axis with index `axis`."""
    shift = (axis + 1) % 3
    body = kr.Body(1, np.roll(moments, shift), np.roll((0, 0, 1.0), shift), unphysical=True)
    attitude = multiply(LEAN, kr.quaternion.conjugate(CYCLES[axis]))
    return kr.Scene(body, momentum=(0, 0, 0.25), attitude=attitude, gravity=1)


@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("method", ["strang", "blanes_moan6", "bobenko_suris", "exact", "rk4"])
def test_the_motion_does_not_depend_on_the_order_of_axes(axis, method):
    words = {} if method == "exact" else {"step": 0.0625}
    paths = [kr.solve(permute_axes(i, (1.0, 1.0, 0.7)), [31.0], method, **words) for i in (2, axis)]
    assert paths[0].nutation[0] > 0.1
    attitude = multiply(paths[1].q[0], CYCLES[axis])
    assert kr.attitude_error(paths[0].q[0], attitude) < 1e-11


def test_sections_tangents_and_runs_keep_a_small_tilt():
    event = kr.events.nutation(direction=-1)
    tops = [permute_axes(i, (0.8, 1.0, 1.2)) for i in (2, 0)]
    one, other = (kr.section(top, event, n=1) for top in tops)
    assert abs(one.t[0] - other.t[0]) < 1e-10
    paths = [kr.solve(top, [31.0], "taylor", tangents="gravity") for top in tops]
    push, same = (path.tangents[0, 3:] for path in paths)
    assert np.abs(push - same).max() < 1e-11 * np.abs(paths[0].tangents).max()
    run = kr.start(tops[1], "taylor")
    run.to(3.0)
    later = kr.resume(run.checkpoint).to([31.0])
    assert kr.attitude_error(later.q[0], paths[1].q[0]) < 1e-11
