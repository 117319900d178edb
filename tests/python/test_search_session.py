"""Tests of the search strategy of kreisel.fit, with prescribed residuals and local minima."""

import numpy as np
import pytest
from fit_sessions import (
    BODY_RATES,
    make_best,
    make_record,
    make_session,
    prescribe_minima,
    record_calls,
)
from kreisel._fit import search_session
from kreisel._fit.residuals import ResidualEvaluation, find_time_of_large_residuals


def test_degrees_of_freedom_are_measurements_minus_parameters():
    values = BODY_RATES[:40].copy()
    values[3, 1], values[7] = np.nan, np.nan
    session = make_session(
        make_record(body_velocity=values), make_record([0.0, 1.0], energy=[1, 2])
    )
    assert session.dof == 40 * 3 - 4 + 2 - 3
    assert make_session(make_record([0.0])).dof == 1 and not session.alias
    assert [sigma.shape for sigma in session.sigmas] == [(40, 3), (2, 1)]


@pytest.mark.parametrize("sigma, is_known", [(0.1, True), (None, False)])
def test_a_session_knows_whether_all_noise_is_known(sigma, is_known):
    session = make_session(make_record(), make_record(sigma=sigma))
    assert session.is_sigma_known is is_known and session.evaluations == 0
    assert make_session(make_record([-3.0, 0.0, 1.0]), make_record([0.0, 2.5]))._end == 3.0


@pytest.mark.parametrize(
    ("t", "free", "message"),
    [
        ([100.0, 101.0], "velocity", None),
        ([-101.0, -100.0], "velocity", None),
        ([100.2, 101.2], "velocity", "begin at t = 100.2, .* only 1:"),
        ([5.0], "velocity", None),  # no duration
        ([0.0, 1.0], "start", None),  # six numbers and six parameters
        ([0.0, 1.0], ("start", "gravity"), "have 6 numbers, fewer than the 7 free"),
    ],
)
def test_records_must_be_early_and_long_enough(t, free, message):
    session = make_session(make_record(t), free=free)
    if message is None:
        return session.check_measurement_count_and_start()
    with pytest.raises(ValueError, match=message):
        session.check_measurement_count_and_start()


@pytest.mark.parametrize("count, most", [(20, 10), (21, 10), (3, 1), (1, 1)])
def test_a_piece_needs_two_times(count, most):
    times = np.arange(float(count))
    session = make_session(make_record(times), make_record(times[::-1][:1]))
    session.check_measurements_per_segment(most)
    session.check_measurements_per_segment(None)
    with pytest.raises(ValueError, match=f"at most {most}, .* not {most + 1}"):
        session.check_measurements_per_segment(most + 1)


def test_reduced_chi2_is_estimated_from_the_median_for_the_soft_loss():
    session, soft = make_session(), make_session(loss="soft")
    assert session._compute_best_reduced_chi2() == np.inf and not session._has_small_misfit()
    session.best = make_best(session, 117.0 * 2.0)
    assert session.dof == 117 and session._compute_best_reduced_chi2() == 2.0
    residuals = np.where(np.arange(120) % 2, 3.0, -3.0)
    residuals[:30] = 90.0
    soft.best = make_best(soft, residuals=residuals)
    assert soft._compute_best_reduced_chi2() == pytest.approx((1.4826 * 3.0) ** 2)


@pytest.mark.parametrize(
    ("loss", "sigma", "method", "limit"),
    [
        ("linear", 0.1, "_has_small_misfit", 3.0),
        ("soft", 0.1, "_has_small_misfit", 3.0),
        ("linear", None, "_has_good_fit", 1.5),
        ("soft", 0.1, "_is_plausible", 1.3 + 3.0 * 2.34 / np.sqrt(120.0)),
        ("soft", 0.1, "_has_good_fit", 0.0),
    ],
)
def test_limits_of_residuals(monkeypatch, loss, sigma, method, limit):
    session = make_session(make_record(sigma=sigma), loss=loss)
    for chi2, is_within in ((limit * (1 - 1e-9), True), (limit * (1 + 1e-9) + 1e-9, False)):
        monkeypatch.setattr(session, "_compute_best_reduced_chi2", lambda chi2=chi2: chi2)
        assert getattr(session, method)() == (is_within and limit > 0.0)
    if limit in (3.0, 1.5):
        monkeypatch.setattr(session, "_compute_best_reduced_chi2", lambda: limit)
        assert getattr(session, method)()


def test_progress_counts_all_paths_and_reports_chi2_per_degree():
    reports = []
    session = make_session(progress=lambda *report: reports.append(report))
    session.evaluations, session.model.evaluations = 30, 4
    session._report_cost(117.0 * 3.0)
    assert reports == [(34, 3.0)]
    make_session()._report_cost(1.0)


@pytest.mark.parametrize(
    ("cost", "has_converged", "is_new"),
    [
        (1.0 - 2e-6, True, True),
        (1.0 - 5e-7, True, False),
        (1.0, True, False),
        (1.0, False, True),
        (1.1, False, False),
        (np.inf, True, False),
    ],
)
def test_a_search_keeps_the_nearer_of_equal_minima(monkeypatch, cost, has_converged, is_new):
    session = make_session()
    old = session.best = make_best(session, 4.0, has_converged)
    calls = prescribe_minima(monkeypatch, session, 4.0 * cost)
    monkeypatch.setattr(session, "_fit_growing_time_spans", lambda point, agreement: point)
    session._search_from_point(session.parameters.start, 2.0)
    assert (session.best is not old) == is_new and session.best.cost == (
        4.0 * cost if is_new else 4.0
    )
    [(model, _, search)] = calls
    assert model is session.model and search[:3] == ("linear", 500, 1e-10)


def find_horizons(monkeypatch, session, agreements, agreement, cost=1.0):
    """Return the end times of the successively longer parts of the records that are fitted."""
    horizons, rest = [], list(agreements)
    monkeypatch.setattr(session, "_build_residual_model_until", horizons.append)
    match = lambda point: (rest.pop(0) if rest else 0.0, cost)  # noqa: E731
    monkeypatch.setattr(session, "_find_match_end_and_cost", match)
    start = session.parameters.start
    assert session._fit_growing_time_spans(start, agreement) is start
    return horizons


def test_parts_of_the_records_grow(monkeypatch):
    t = np.arange(-20.0, 60.25, 0.5)
    session = make_session(make_record(t))
    # For three parameters, a part contains at least seven different values of |t|, here up to 3.
    slow = [3.0 * 1.4**k for k in range(9)]
    assert np.allclose(find_horizons(monkeypatch, session, [50.0] * 9, 0.0), slow)
    agreements = [5.0, 6.0, 30.0, 59.9, 60.0]
    expected = [4.0, 5.6, 7.84, 30.0, 59.9]
    assert np.allclose(find_horizons(monkeypatch, session, agreements, 4.0), expected)
    assert find_horizons(monkeypatch, session, agreements, 60.0) == []
    assert find_horizons(monkeypatch, session, [], 4.0, np.inf) == [4.0]
    session.model.evaluations = 500
    assert find_horizons(monkeypatch, session, agreements, 4.0) == []
    short = make_session(make_record([0.0, 1.0, 2.0]))
    assert find_horizons(monkeypatch, short, [], 0.5) == []


def test_parts_of_the_records_include_their_ends():
    t = np.arange(-4.0, 7.0)
    session = make_session(make_record(t), make_record(t[5:], energy=t[5:]), free="start")
    records, sigmas = session._select_records_until(3.0)
    assert records[0].t.tolist() == list(range(-3, 4)) and records[1].t.tolist() == [1, 2, 3]
    assert [s.shape for s in sigmas] == [(7, 3), (3, 1)]
    assert session._build_residual_model_until(0.0) is None  # three numbers, six parameters
    assert session._build_residual_model_until(1.0).size == 10
    few = make_session(make_record(t, energy=t), make_record([0.0], energy=[1.0]), free="velocity")
    assert few._build_residual_model_until(1.0).size == 4
    few = make_session(make_record(t, energy=t), free="velocity")
    assert few._build_residual_model_until(1.0).size == 3
    assert few._build_residual_model_until(0.9) is None


def find_time(relative, t=None, sigma=0.01):
    """Return the first time at which residuals, relative to the spread of the data, are large."""
    n = len(relative)
    t = np.arange(float(n)) if t is None else t
    values = np.tile((1.0, -1.0), n)[:n]
    session = make_session(make_record(np.sort(t), sigma, spin=values), free="velocity")
    [rows] = session.model.rows
    scale = np.hypot(np.std(values), 3.0 * sigma)
    trial = ResidualEvaluation(np.asarray(relative) * scale / sigma, None)
    return find_time_of_large_residuals(rows, trial, np.abs(np.sort(t)))


@pytest.mark.parametrize(
    ("count", "first", "size", "time"),
    [
        (3, 1, 0.41, 1),
        (3, 1, 0.39, np.inf),
        (3, 2, -5.0, 2),
        (100, 50, 0.9, 48),  # one of three
        (200, 50, 0.9, 47),  # one of four
        (200, 50, -9.0, 47),  # residuals count as at most 1
        (2000, 700, 0.95, 680),  # five of 25
        (1299, 700, 0.95, 680),  # five of 25
        (200, 50, 0.3, np.inf),
    ],
)
@pytest.mark.parametrize("sigma", [0.01, 2.0])
def test_large_residuals_are_averaged(count, first, size, time, sigma):
    relative = np.zeros(count)
    relative[first:] = size
    assert find_time(relative, sigma=sigma) == time


def test_two_outliers_are_no_disagreement():
    relative = np.zeros(2000)
    relative[700:702] = 50.0
    assert find_time(relative) == np.inf


def test_large_residuals_are_found_in_the_order_of_their_distance_from_the_start():
    assert find_time([1.0, 0.0, 0.0], np.array((-5.0, 0.0, 1.0))) == 5.0
    relative = np.zeros(100)
    relative[:30] = 1.0  # the times from -50 to -21
    assert find_time(relative, np.arange(-50.0, 50.0)) == 20.0


def test_a_motion_agrees_until_its_first_large_residual(monkeypatch):
    t = np.arange(0.0, 40.0)
    session = make_session(make_record(t, body_velocity=BODY_RATES[:40]), make_record(t, energy=t))
    residuals = np.zeros(160)
    trial = ResidualEvaluation(residuals, None)
    monkeypatch.setattr(session.model, "evaluate_residuals", lambda p, has_jacobian: trial)
    assert session._find_match_end_and_cost(None) == (39.0, 0.0)
    residuals[120 + 20 :] = 1e9
    residuals[3 * 30 : 120] = 1e9
    end, cost = session._find_match_end_and_cost(None)
    assert end == 18.0 and cost == pytest.approx(50 * 2e9, rel=1e-6)
    residuals[0] = np.nan
    assert session._find_match_end_and_cost(None) == (0.0, np.inf)


@pytest.mark.parametrize(
    ("factors", "count"),
    [
        ((1.0, 1.0), 1),  # the first estimate is always used
        ((2.0, 1.02, 1.005), 2),
        ((2.0, 0.98, 0.995), 2),
        ((2.0,) * 9, 6),
    ],
)
def test_unknown_noise_is_estimated_until_it_settles(monkeypatch, factors, count):
    session = make_session(make_record(sigma=None))
    session.best, rest = make_best(session), list(factors)
    monkeypatch.setattr(
        search_session,
        "estimate_sigmas_from_residuals",
        lambda *_: [sigma * rest.pop(0) for sigma in session.sigmas],
    )
    refits = record_calls(monkeypatch, session, ["_refit_with_sigmas"])
    session._refine_with_estimated_sigmas()
    assert len(refits) == count
    session.best = make_best(session, has_converged=False)
    session._refine_with_estimated_sigmas()
    assert len(refits) == count
    known = make_session()
    known.best = make_best(known)
    refits = record_calls(monkeypatch, known, ["_refit_with_sigmas"])
    known._refine_with_estimated_sigmas()
    assert refits == []


def test_a_refit_uses_the_new_noise(monkeypatch):
    session = make_session(make_record(sigma=None))
    session.best = make_best(session)
    session.model.evaluations, session.evaluations = 9, 1
    calls = record_calls(monkeypatch, session, ["_search_from_point", "_fit_by_multiple_shooting"])
    sigmas = [np.full((40, 3), 0.7)]
    session._refit_with_sigmas(sigmas)
    assert calls == [("_search_from_point", session.parameters.start, 2.0)]
    assert session.evaluations == 10 and session.sigmas[0] is sigmas[0] and session.best is None
    start = session.parameters.start
    session.best = make_best(session, pieces=((0.0, start), (1.0, start)))
    session._refit_with_sigmas(sigmas)
    name, model, begin, factor = calls[1]
    assert name == "_fit_by_multiple_shooting" and factor == np.inf
    assert begin.points == (start, start) and len(model.models) == 2


@pytest.mark.parametrize("loss", ["linear", "soft"])
def test_the_misfit_is_relative_to_the_measured_values(loss):
    values = np.array((3.0, -4.0, np.nan, 5.0, 2.0))
    sigma = np.array((0.1, 0.2, 0.1, 0.1, 0.5))
    record = make_record(np.arange(5.0), sigma, spin=values)
    session = make_session(record, free="gravity", loss=loss)
    session.best = make_best(session, residuals=np.array((2.0, -3.0, 0.0, 1.0, 4.0)))
    shares = np.array((0.2, 0.6, 0.1, 2.0)) / np.sqrt((9.0 + 16.0 + 25.0 + 4.0) / 4.0)
    expected = 1.4826 * np.median(shares) if loss == "soft" else np.sqrt(np.mean(shares**2))
    assert session.measure_relative_misfit() == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("size, is_refused", [(0.9e-9, True), (1.1e-9, False)])
def test_quantities_that_hardly_change_are_refused(size, is_refused):
    values = np.tile((3.0, -3.0), 5)
    record = make_record(np.arange(10.0), 0.2, spin=values, energy=values)
    session = make_session(record, free="gravity")
    jacobian = np.ones((20, 1))
    jacobian[10:] = 0.0
    jacobian[13] = -0.5 * size * 3.0 / 0.2
    session.best = make_best(session, jacobian=jacobian)._replace(natural=np.array((2.0,)))
    if not is_refused:
        return session.refuse_insensitive_quantities()
    with pytest.raises(ValueError, match=r"energy does not depend .*gravity"):
        session.refuse_insensitive_quantities()
