"""Tests of the chart that shows the difference between two paths."""

import kreisel as kr
import numpy as np
import pytest
from tops import GENERAL, LAGRANGE

pytest.importorskip("matplotlib")

T = np.linspace(0.0, 5.0, 101)
FINE = kr.solve(GENERAL, T)
COARSE = {"method": "rk4", "step": 0.05}
ROUGH = kr.solve(GENERAL, 5.0, **COARSE)
APEX = ("apex", "nutation", "precession_angle")


def draw_difference(one, other):
    """Return the times and angles [rad] of the last chart, where angles of 0 are NaN."""
    (line,) = kr.plot(one, other, degrees=False)[6].lines
    return line.get_data()


@pytest.mark.parametrize("other", [ROUGH, kr.solve(GENERAL, T, **COARSE)])
def test_paths_are_compared_at_common_times(other):
    t, angle = draw_difference(FINE, other)
    expected = kr.attitude_error(kr.solve(GENERAL, t).q, kr.solve(GENERAL, t, **COARSE).q)
    assert (t[0], t[-1]) == (0.0, 5.0) and np.isnan(angle[0]) and expected[0] == 0.0
    assert angle[1:] == pytest.approx(expected[1:], rel=1e-6)
    assert kr.plot(FINE, other)[6].get_yscale() == "log"


def test_paths_are_compared_only_where_both_are_known():
    late = kr.solve(GENERAL, [4.0, 6.0])
    for pair in (FINE, late), (late, FINE):
        t, angle = draw_difference(*pair)
        assert t.min() >= 4.0 and t.max() <= 5.0 and len(t) > 10 and np.nanmax(angle) < 1e-12


def test_differences_below_the_rounding_of_doubles_are_shown():
    one, other = (kr.solve(GENERAL, T, digits=digits) for digits in (20, 30))
    assert 1e-22 < np.nanmax(draw_difference(one, other)[1]) < 1e-17


def test_without_attitudes_the_apexes_are_compared():
    one = kr.solve(GENERAL, T, want=APEX)
    t, angle = draw_difference(one, ROUGH)
    pair = kr.solve(GENERAL, t).apex, kr.solve(GENERAL, t, **COARSE).apex
    expected = np.linalg.norm(np.cross(*pair), axis=1)
    assert angle[1:] == pytest.approx(expected[1:], abs=2e-8)
    whole = kr.solve(GENERAL, T, want=(*APEX, "q"))
    titles = [kr.plot(path, ROUGH)[6].get_title() for path in (one, whole)]
    assert titles == ["angle between the apexes", "angle between the attitudes"]


def test_equal_paths_and_paths_without_common_times_are_labelled():
    assert kr.plot(FINE, FINE)[6].get_title() == "the attitudes are equal"
    back = kr.solve(GENERAL, [-1.0, -2.0])
    assert kr.plot(FINE, back)[6].get_title() == "the paths have no times in common"


def test_a_map_is_compared_at_its_own_steps():
    steps = kr.exact(LAGRANGE, map="bobenko_suris", step=0.1)([0, 1, 2, 3])
    path = kr.solve(LAGRANGE, np.linspace(0, 0.4, 7))
    for pair in (path, steps), (steps, path):
        t, angle = draw_difference(*pair)
        assert t == pytest.approx(steps.t) and not angle[0] > 1e-15 and angle[-1] > 1e-15
    other = kr.exact(LAGRANGE, map="bobenko_suris", step=0.2)([0, 1])
    assert draw_difference(steps, other)[0].tolist() == [0.0, 0.2]
