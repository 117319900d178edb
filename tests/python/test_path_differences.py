"""Tests of the chart that shows the difference between two paths."""

import kreisel as kr
import numpy as np
import pytest
from tops import GENERAL

pytest.importorskip("matplotlib")

T = np.linspace(0.0, 5.0, 101)
FINE = kr.solve(GENERAL, T)
COARSE = {"method": "rk4", "step": 0.05}
ROUGH = kr.solve(GENERAL, 5.0, **COARSE)


def draw_difference(one, other):
    """Return the times and angles [rad] of the last chart, where angles of 0 are NaN."""
    return kr.plot(one, other, degrees=False)[6].lines[0].get_data()


def test_paths_are_compared_at_common_times():
    t, angle = draw_difference(FINE, ROUGH)
    expected = kr.attitude_error(kr.solve(GENERAL, t).q, kr.solve(GENERAL, t, **COARSE).q)
    assert (t[0], t[-1]) == (0.0, 5.0) and np.isnan(angle[0]) and expected[0] == 0.0
    assert angle[1:] == pytest.approx(expected[1:], rel=1e-6)
    t, angle = draw_difference(FINE, kr.solve(GENERAL, [4.0, 6.0]))
    assert t.min() >= 4.0 and t.max() <= 5.0 and len(t) > 10 and np.nanmax(angle) < 1e-12
    _, angle = draw_difference(*(kr.solve(GENERAL, T, digits=digits) for digits in (20, 30)))
    assert 1e-22 < np.nanmax(angle) < 1e-17
    for other in (FINE, kr.solve(GENERAL, [-1.0, -2.0])):
        assert kr.plot(FINE, other)[6].get_title()
