"""Tests that all programs compute the same motions of an ensemble."""

import csv
import re
from math import isnan

import kreisel as kr
import mpmath as mp
import numpy as np
import pytest

from validation.competitors import ensemble_runs, equal_error
from validation.competitors.equal_error import Run
from validation.competitors.single_runs import Setting
from validation.parts import ensembles as part
from validation.references import equations, reference
from validation.references import random_ensembles as tops_of
from validation.references.problems import attitude_error, attitude_errors
from validation.report import main as report

KINDS = list(tops_of.SCENES)
TIGHT = Setting(tol=1e-13)


def problem_of(tops, k):
    return tops_of.replace(tops.problem, momentum=tuple(tops.momenta[k]))


@pytest.mark.parametrize("kind", KINDS)
def test_larger_ensembles_begin_with_the_same_tops(kind):
    few, more = tops_of.draw_tops(kind, 3), tops_of.draw_tops(kind, 20)
    assert np.array_equal(few.momenta, more.momenta[:3])
    assert np.array_equal(few.starts, more.first(3).starts)
    assert len(set(map(tuple, more.momenta))) == 20


@pytest.mark.parametrize("kind", KINDS)
def test_references_agree_with_heyoka_in_128_bit(kind):
    tops = tops_of.draw_tops(kind, 2, end=10.0)
    for k, q in enumerate(tops_of.compute_truths(tops)):
        (true,) = reference.integrate_states(problem_of(tops, k), [tops.end])
        assert attitude_error(q, [mp.nstr(x, 25) for x in true[:4]]) < 1e-18


@pytest.mark.parametrize("kind", KINDS)
def test_other_integrators_start_from_the_same_states(kind):
    tops = tops_of.draw_tops(kind, 2)
    for k in range(2):
        start = [float(x) for x in equations.start_state(problem_of(tops, k))]
        np.testing.assert_allclose(tops.starts[k], start, rtol=3e-16, atol=1e-17)


@pytest.mark.parametrize("kind", KINDS)
def test_conditioning_agrees_with_the_references(kind):
    """Compare the effects of rounding errors computed for ensembles with those for single tops."""
    tops = tops_of.draw_tops(kind, 2, end=10.0)
    for k, own in enumerate(tops_of.compute_conditioning(tops)):
        (other,) = reference.compute_conditioning(problem_of(tops, k), [tops.end], "velocity")
        assert 0.05 * other < own < 2 * other


@pytest.mark.parametrize("kind", KINDS)
def test_every_program_returns_the_tops_in_order(kind):
    """Check that every integrator returns the final attitudes in the order of the tops."""
    tops = tops_of.draw_tops(kind, 11, end=10.0)
    true = tops_of.compute_truths(tops)
    for mover in ensemble_runs.select_movers(tops):
        setting = TIGHT if mover.settings[0].tol else mover.settings[0]
        call = mover.make(tops.first(4) if mover.is_serial else tops, setting, 2)
        for q in (call(), call()):
            assert len(q) == (4 if mover.is_serial else 11)
            assert attitude_errors(q, true[: len(q)]).max() < 1e-10, mover.name


def runs(errors, seconds):
    return [
        Run("it", str(i), 1, error, error, error, times)
        for i, (error, times) in enumerate(zip(errors, seconds, strict=True))
    ]


STRAIGHT = runs([1e-2, 1e-6, 1e-10], [[1.0, 10.0], [2.0, 20.0], [4.0, 40.0]])


def test_times_are_interpolated_between_settings():
    assert equal_error.seconds_at(1e-6, STRAIGHT) == pytest.approx([2.0, 20.0])
    assert equal_error.seconds_at(1e-4, STRAIGHT) == pytest.approx([2**0.5, 10 * 2**0.5])
    assert equal_error.seconds_at(1.0, STRAIGHT) == pytest.approx([1.0, 10.0])
    assert all(isnan(s) for s in equal_error.seconds_at(0.9e-10, STRAIGHT))


def test_accidentally_small_errors_and_slow_settings_do_not_count():
    lucky = runs([1e-7, 1e-6, 1e-10, 1e-10], [[1.0], [2.0], [4.0], [9.0]])
    assert equal_error.seconds_at(1e-7, lucky) == pytest.approx([4**0.25]), "1e-6 is its error"
    assert equal_error.seconds_at(1e-10, lucky) == pytest.approx([4.0])


def test_ratios_are_medians_of_rounds():
    other = runs([1e-6], [[6.0, 40.0]])
    value, theirs, ours = equal_error.time_ratio(other, STRAIGHT, 1e-6)
    assert (value, theirs, ours) == pytest.approx((2.5, 23.0, 11.0))
    assert isnan(equal_error.time_ratio(other, STRAIGHT, 1e-9)[0])
    assert equal_error.tightest_common_error(STRAIGHT, other) == pytest.approx(
        equal_error.NEAR * 1e-6
    )


def test_the_tightest_common_error_is_reached_by_both_programs():
    """Check that two programs reach their smallest common error if errors decrease irregularly."""
    uneven = runs([1e-3, 4e-10, 6e-10], [[1.0], [2.0], [3.0]])
    straight = runs([1e-2, 1e-10], [[1.0], [4.0]])
    target = equal_error.tightest_common_error(straight, uneven)
    assert not isnan(equal_error.time_ratio(uneven, straight, target)[0])
    assert target == pytest.approx(equal_error.NEAR * 6e-10)


def test_the_map_shows_sleeping_tops():
    findings = part.compute_sleeping_map(9)
    spins, tilts = np.linspace(0, part.FASTEST, 9), np.linspace(part.LEAST, part.LARGEST, 9)
    top = kr.Body.symmetric(mass=1.0, i1=1.0, i3=0.5, height=1.0, unphysical=True)
    for i, j in ((0, 0), (3, 5), (8, 8)):
        one = kr.exact(kr.Scene.spinning(top, spin=spins[i], tilt=tilts[j], gravity=1))
        assert findings[i, j] == pytest.approx(one.greatest_nutation, rel=1e-12)
    assert (findings[spins > 4, 0] < 0.01).all() and (findings[spins < 4, 0] > 1.0).all()


@pytest.mark.parametrize("kind", KINDS)
def test_members_are_as_accurate_as_their_single_runs(kind):
    """Compare errors of ensembles and single tops, relative to the effect of one rounding error."""
    tops = tops_of.draw_tops(kind, 200)
    true, unit = tops_of.compute_truths(tops), tops_of.compute_conditioning(tops)
    closed = [("exact", Setting())] if kind == "Lagrange" else []
    series = [("taylor", Setting(tol=10.0**-k)) for k in range(6, 16, 3)]
    for method, setting in closed + series:
        many = ensemble_runs.make_kreisel_call(method, tops, setting, 2)()
        single = [
            kr.solve(tops.scene(k), [tops.end], method, **setting.keywords).q[-1]
            for k in range(len(tops))
        ]
        errors, others = (attitude_errors(q, true) / unit for q in (many, single))
        assert np.median(errors) <= 1.3 * np.median(others), (method, setting)
        assert errors.max() <= 3.0 * others.max(), (method, setting)


@pytest.fixture(scope="module")
def quick_report(tmp_path_factory):
    """Return the folder of a shortened report that maps the nutation angles on a coarse grid."""
    out = tmp_path_factory.mktemp("many")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(part, "SIDE", 50)
        assert report.main(["--quick", "--only", "ensembles", "--out", str(out)]) == 0
    return out


def test_the_report_writes_the_programs_to_csv(quick_report):
    with (quick_report / "ensembles.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert tuple(rows[0]) == part.COLUMNS
    for kind in KINDS:
        names = {row["mover"] for row in rows if row["kind"] == kind}
        assert {"taylor", ensemble_runs.HEYOKA, ensemble_runs.OWN_CALL, "scipy_dop853"} <= names
        assert ("exact" in names) == (kind == "Lagrange")
    assert all(float(row["microseconds"]) > 0 for row in rows)


def test_the_report_shows_the_programs_and_the_map(quick_report):
    page = (quick_report / "index.html").read_text()
    section = page.split('id="ensembles"')[1]
    assert section.count("<svg") == len(KINDS) + 1
    assert not re.search(r"{{|{%|\bNone\b|\bnan\b|Undefined", section)
    assert "tops from t = 0 to 100 with a median error of" in re.sub(r"\s+", " ", page)
