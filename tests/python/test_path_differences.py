"""Tests of the chart that shows the difference between two paths."""

import kreisel as kr
import numpy as np
import pytest
from tops import GENERAL, LAGRANGE

pytest.importorskip("matplotlib")
from kreisel._analysis.difference import compute_angle_between_paths
from matplotlib.figure import Figure

T = np.linspace(0.0, 5.0, 101)
FINE = kr.solve(GENERAL, T)
ROUGH = kr.solve(GENERAL, 5.0, "rk4", step=0.05)


def test_the_last_chart_shows_the_angle_between_both_attitudes():
    rough = kr.solve(GENERAL, T, "rk4", step=0.05)
    picture = kr.plot(FINE, rough, degrees=False, time_unit="s")
    chart = picture[6]
    angle = kr.attitude_error(FINE.q, rough.q)
    line = chart.lines[0]
    assert np.array_equal(line.get_xdata(), T) and chart.get_yscale() == "log"
    assert np.isnan(line.get_ydata()[0]) and angle[0] == 0.0
    assert line.get_ydata()[1:] == pytest.approx(angle[1:], rel=1e-6)
    assert chart.get_ylabel() == "difference [rad]" and chart.get_xlabel() == "time [s]"
    degrees = kr.plot([FINE, rough])[6].lines[0].get_ydata()
    assert degrees[1:] == pytest.approx(np.degrees(angle[1:]), rel=1e-6)
    axes = Figure().subplots(7)
    assert list(kr.plot(FINE, rough, axes=axes)) == list(axes)
    with pytest.raises(ValueError, match=r"axes must be 6.*or 7 with their difference, not 8"):
        kr.plot(FINE, rough, axes=Figure().subplots(8))


def test_paths_with_other_times_are_compared_at_common_times():
    difference = compute_angle_between_paths(FINE, ROUGH)
    again = kr.solve(GENERAL, T, "rk4", step=0.05)
    assert np.array_equal(difference.t, T)
    assert difference.angle == pytest.approx(
        kr.attitude_error(FINE.q, again.q), rel=1e-6, abs=1e-15
    )
    late = kr.solve(GENERAL, [4.0, 6.0])
    assert compute_angle_between_paths(FINE, late).t.tolist() == T[T >= 4.0].tolist()
    assert compute_angle_between_paths(late, FINE).t.tolist() == T[T >= 4.0].tolist()
    assert compute_angle_between_paths(late, FINE).angle.max() < 1e-12


def test_differences_below_the_rounding_of_doubles_are_shown():
    one, other = (kr.solve(GENERAL, T, digits=digits) for digits in (20, 30))
    difference = compute_angle_between_paths(one, other)
    assert 1e-22 < difference.angle.max() < 1e-17


def test_without_attitudes_the_apexes_are_compared():
    want = ("apex", "nutation", "precession_angle")
    one = kr.solve(GENERAL, T, want=want)
    difference = compute_angle_between_paths(one, ROUGH)
    rough = kr.solve(GENERAL, T, "rk4", step=0.05)
    expected = np.arccos(np.clip((one.apex * rough.apex).sum(axis=1), -1.0, 1.0))
    assert difference.what == "apexes" and difference.angle == pytest.approx(expected, abs=2e-8)
    assert kr.plot(one, ROUGH)[6].get_title() == "angle between the apexes"
    full_path = kr.solve(GENERAL, T, want=(*want, "q"))
    assert compute_angle_between_paths(full_path, FINE).what == "attitudes"


def test_equal_paths_and_paths_without_common_times_are_labelled():
    assert kr.plot(FINE, FINE)[6].get_title() == "the attitudes are equal"
    back = kr.solve(GENERAL, [-1.0, -2.0])
    assert kr.plot(FINE, back)[6].get_title() == "the paths have no times in common"


def test_a_map_is_compared_at_its_own_steps():
    steps = kr.exact(LAGRANGE, map="bobenko_suris", step=0.1)([0, 1, 2, 3])
    path = kr.solve(LAGRANGE, np.linspace(0, 0.4, 7))
    difference = compute_angle_between_paths(path, steps)
    assert (
        difference.t == pytest.approx(steps.t)
        and difference.angle[0] < 1e-15 < difference.angle[-1]
    )
    other = kr.exact(LAGRANGE, map="bobenko_suris", step=0.2)([0, 1])
    assert compute_angle_between_paths(steps, other).t.tolist() == [0.0, 0.2]
    assert compute_angle_between_paths(steps, path).t == pytest.approx(steps.t)
