"""Tests of the order in which a fit tries initial guesses, multiple shooting and other spins."""

from dataclasses import replace

import kreisel as kr
import numpy as np
import pytest
from fit_sessions import (
    make_best,
    make_record,
    make_session,
    prescribe_minima,
    record_calls,
)
from fits import HEAVY
from kreisel._fit import search_session
from kreisel._fit.initial_guess import Guess
from kreisel._fit.levenberg_marquardt import Minimum
from kreisel._fit.residuals import ResidualEvaluation, SubspaceModel


@pytest.mark.parametrize("excess, is_new", [(0.9e-6, True), (1.1e-6, False)])
def test_an_equivalent_point_must_fit_as_well(monkeypatch, excess, is_new):
    session = make_session()
    best, twin = make_best(session, 2.0), replace(session.parameters.start, gravity=3.0)
    residuals = np.zeros(120)
    residuals[7] = np.sqrt(2.0 * (1.0 + excess))
    evaluation = ResidualEvaluation(residuals, np.ones((120, 3)))
    monkeypatch.setattr(session.model, "evaluate_residuals", lambda point: evaluation)
    session._try_equivalent(best, twin)
    assert (session.best is not None) == is_new
    if is_new:
        assert session.best.point is twin and session.best.has_converged
        assert session.best.cost == pytest.approx(2.0) and session.best.residuals is residuals


@pytest.mark.parametrize(
    ("names", "free", "side", "is_reversed"),
    [
        (["body_velocity"], ("start", "com"), -1.0, True),
        (["body_velocity", "kinetic"], ("attitude", "com"), -1.0, True),
        (["body_velocity"], ("start", "com"), 1.0, False),
        (["body_velocity"], ("velocity", "com"), -1.0, False),
        (["body_velocity"], "start", -1.0, False),
        (["body_velocity", "body_vertical"], ("start", "com"), -1.0, False),
    ],
)
def test_the_centre_of_mass_is_reversed_if_no_instrument_sees_it(
    monkeypatch, names, free, side, is_reversed
):
    t = np.linspace(0.0, 1.0, 10)
    path = kr.solve(HEAVY, t)
    session = make_session(make_record(t, **{n: getattr(path, n) for n in names}), free=free)
    start = session.parameters.start
    calls = record_calls(monkeypatch, session, ["_try_equivalent"])
    session._reverse_com_to_match_scene()
    session.best = make_best(session)._replace(point=replace(start, com=side * start.com))
    session._reverse_com_to_match_scene()
    assert len(calls) == is_reversed
    for _, _, twin in calls:
        assert np.allclose(twin.com, start.com)
        w, x, y, z = start.attitude
        assert np.allclose(twin.attitude, (-x, w, -z, y))  # a half turn about e1
    session.best = session.best._replace(pieces=((0.0, start),))
    session._reverse_com_to_match_scene()
    assert len(calls) == is_reversed


@pytest.mark.parametrize(
    ("turning", "source", "is_turned"),
    [
        ((0.0, 2.0, 0.5), (1.0, 0.0, 0.3), True),
        ((1.0, 1.0, 0.0), (-1.0, 1.0, 0.3), True),
        ((0.0, 0.0, 0.5), (1.0, 0.0, 0.3), False),
        ((0.0, 2.0, 0.5), (0.0, 0.0, 0.3), False),
    ],
)
def test_the_turning_is_rotated_to_the_azimuth_of_the_scene(
    monkeypatch, turning, source, is_turned
):
    scene = HEAVY.replace(turning=turning)
    session = make_session(free=("start", "turning"), scene=scene)
    calls = record_calls(monkeypatch, session, ["_try_equivalent"])
    best = session.best = make_best(session)
    session.best = best._replace(point=replace(best.point, turning=np.array(source)))
    session._align_best_solution_with_scene()
    assert len(calls) == is_turned
    for _, _, twin in calls:
        azimuths = [np.arctan2(o[1], o[0]) for o in (twin.turning, turning)]
        assert azimuths[0] == pytest.approx(azimuths[1], abs=1e-12)
        assert twin.turning[2] == source[2]
        one, other = (
            point.turning @ kr.quaternion.turn(tuple(point.attitude), (0.3, 0.5, 0.7))
            for point in (twin, session.best.point)
        )
        assert one == pytest.approx(other, rel=1e-12)


def test_a_restricted_model_counts_its_own_evaluations():
    session = make_session(free="start")
    projection = np.diag((1.0, 1.0, 1.0, 0.0, 0.0, 0.0))
    model = SubspaceModel(session.model, projection)
    assert model.evaluations == 0 and model.size == 120
    session.model.evaluations = 5
    for count in (1, 2):
        residuals, jacobian = model.evaluate_residuals(session.parameters.start)
        assert model.evaluations == count and session.model.evaluations == 5
    full = session.model.evaluate_residuals(session.parameters.start)
    assert (full.residuals == residuals).all() and np.allclose(full.jacobian @ projection, jacobian)


def test_rough_fits_count_their_paths(monkeypatch):
    session = make_session()
    calls = prescribe_minima(monkeypatch, session, 1.0)
    session.model.evaluations, session.evaluations = 7, 2
    session._fit_point_roughly(session.model, session.parameters.start)
    assert session.evaluations == 9 and calls[0][2][:3] == ("linear", 12, 1e-3)


@pytest.mark.parametrize(
    ("cost", "factor", "is_new"),
    [(0.5, 0.5, True), (0.51, 0.5, False), (1e9, np.inf, True), (np.inf, np.inf, False)],
)
def test_a_fit_in_pieces_must_be_better(monkeypatch, cost, factor, is_new):
    session = make_session()
    old = session.best = make_best(session, 1.0)
    model = search_session.ShootingModel(session.parameters, session.records, session.sigmas, 2)
    model.evaluations, session.evaluations = 5, 3
    begin = model.build_segment_starts(session.parameters.start)
    evaluation = model.evaluate_residuals(begin)
    minimum = Minimum(begin, evaluation, cost, False)
    monkeypatch.setattr(search_session, "minimize_by_multiple_shooting", lambda *_: minimum)
    session._fit_by_multiple_shooting(model, begin, factor)
    assert (session.best is not old) == is_new and session.evaluations == 3 + 6
    if is_new:
        begins = [t for t, _ in session.best.pieces]
        assert begins == [0.0, 1.0] and session.best.cost == cost
        assert session.best.point is begin.points[0] and len(session.best.residuals) == 120
        assert not session.best.has_converged and len(session.best.natural) == 9


class PiecesModel:
    """A stub model in which the gravity of a point stands for the start of its segments."""

    def __init__(self, parameters, records, sigmas, count):
        self.parameters, self.records, self.sigmas = parameters, records, sigmas
        self.count = count

    def data_starts(self, point, motion):
        return point.gravity

    def build_segment_starts(self, point):
        return point.gravity


TRIAL = "_try_gapped_fit"
AGREEMENT = "_has_guess_agreeing_with_records"


@pytest.mark.parametrize(
    ("pieces", "least", "counts", "words", "expected"),
    [
        (None, 8, (7, 8), {}, [(8, 2.0)]),
        (None, 8, (8, 9), {}, [(8, 1.0)]),
        (None, 8, (9, 9), {}, [TRIAL, (9, 1.0)]),
        (None, 8, (9, 9), {"is_near": False}, [TRIAL]),
        (None, 8, (9, 20), {"last": 9}, []),
        (None, 8, (2, 3), {}, []),
        (20, 2, (5, 5), {}, [(20, 1.0)]),
        (None, 28, (28, 3), {"has_agreement": True}, [AGREEMENT]),
        (None, 28, (28, 3), {}, [AGREEMENT, TRIAL, (28, 1.0)]),
        (4, 2, (5, 5), {"motion": None}, [(4, 9.81)]),
        (None, 2, (5, 5), {"motion": None}, []),
    ],
)
def test_the_number_of_pieces_decides_what_is_tried(
    monkeypatch, pieces, least, counts, words, expected
):
    """Check which guess is fitted, and in how many segments, if a least number is given."""
    session = make_session()
    session._piece_count = words.get("last", 0)
    start, motion = session.parameters.start, words.get("motion", object())
    guesses = [Guess(replace(start, gravity=g), motion) for g in (1.0, 2.0)]
    monkeypatch.setattr(
        search_session, "choose_segment_count", lambda point, _: counts[int(point.gravity) - 1]
    )
    monkeypatch.setattr(search_session, "ShootingModel", PiecesModel)
    results = {TRIAL: words.get("is_near", True), AGREEMENT: words.get("has_agreement", False)}
    calls = record_calls(monkeypatch, session, ["_fit_by_multiple_shooting", *results], results)
    session._try_multiple_shooting(guesses, pieces, least)
    found = []
    for name, first, *rest in calls:
        if name != "_fit_by_multiple_shooting":
            found.append(name)
            continue
        found.append((first.count, rest[0]))
        assert rest[1] == 0.5 and first.parameters is session.parameters
        assert first.records is session.records and first.sigmas[0] is session.sigmas[0]
        assert session._piece_count == (first.count if motion else 0)
    assert found == expected


@pytest.mark.parametrize("count, size", [(20, 17), (10, 33), (80, 5)])
def test_a_few_pieces_are_tried_first(monkeypatch, count, size):
    t = np.linspace(0.0, 10.0, 41)
    session = make_session(make_record(t))
    calls = []

    def fit(model, pieces, loss):
        calls.append((model, loss))
        model.evaluations = 11
        return "near"

    monkeypatch.setattr(search_session, "try_segment_fit", fit)
    monkeypatch.setattr(search_session.ShootingModel, "data_starts", lambda *_: None)
    session.evaluations = 4
    guess = Guess(session.parameters.start, object())
    assert session._try_gapped_fit(guess, count) == "near" and session.evaluations == 15
    [(model, loss)] = calls
    assert loss == "linear" and len(model.models) == 8 and model.data_size == 3 * size
    assert session._try_gapped_fit(guess._replace(motion=None), count) and len(calls) == 1


@pytest.mark.parametrize(
    ("cost", "other", "change", "has_alias", "is_better"),
    [
        (100.0, 108.9, 1.0, True, False),  # a rise of up to nine counts as equal
        (100.0, 109.1, 1.0, False, False),
        (100.0, 91.1, 1.0, True, False),
        (100.0, 90.9, 1.0, False, True),
        (234.0, 251.9, 1.0, True, False),  # nine times chi2 per degree of freedom, which is 2
        (234.0, 252.1, 1.0, False, False),
        (100.0, 100.0, 0.51, True, False),
        (100.0, 100.0, 0.49, False, False),  # the search went back to the first spin
        (117.0 * 4.0, 117.0 * 4.0, 1.0, False, False),  # no fit
        (117.0 * 1.0001e4, 1.0, 1.0, False, False),
        (117.0 * 0.9999e4, 1.0, 1.0, False, True),
    ],
)
def test_another_spin_must_fit_as_well(monkeypatch, cost, other, change, has_alias, is_better):
    session = make_session()
    best = session.best = make_best(session, cost)
    start = session.parameters.start
    aliases = [[replace(start, rate=start.rate + np.array((0.0, 0.0, 30.0)))], []]

    def list_aliases(parameters, point, records):
        assert parameters is session.parameters and records is session.records
        assert point is session.best.point
        return aliases.pop(0)

    monkeypatch.setattr(search_session, "list_spin_aliases_of_point", list_aliases)
    monkeypatch.setattr(session, "_can_determine_velocity", lambda best: True)
    found = start.rate + np.array((0.0, 0.0, 30.0 * change))
    calls = prescribe_minima(monkeypatch, session, other, rate=found)
    results = {"_find_match_end_and_cost": (1.5, 0.0)}
    searches = record_calls(monkeypatch, session, ["_search_from_point", *results], results)
    session.model.evaluations = 40
    session._try_alternative_spins()
    assert (session.alias is not None) == has_alias
    if has_alias:
        assert (session.alias.rate == found).all()
    assert (session.best is not best) == is_better == (len(searches) == 2)
    if is_better:
        assert searches[1][0] == "_search_from_point" and searches[1][2] == 1.5
    for _, _, search in calls:
        assert search[:3] == ("linear", 65, 1e-6)


def test_a_spin_that_the_records_do_not_determine_has_no_alias(monkeypatch):
    session = make_session()
    best = make_best(session, jacobian=np.tile(np.eye(3), (40, 1)))
    assert session._can_determine_velocity(best)
    blind = make_best(session, jacobian=np.tile(np.diag((1.0, 1.0, 0.0)), (40, 1)))
    assert not session._can_determine_velocity(blind)
    start = session.parameters.start
    monkeypatch.setattr(search_session, "list_spin_aliases_of_point", lambda *_: [start])
    calls = prescribe_minima(monkeypatch, session)
    for one in (None, blind, best._replace(pieces=((0.0, start),))):
        session.best = one
        session._try_alternative_spins()
    assert calls == []


def test_guesses_are_tried_in_the_order_of_their_agreement(monkeypatch):
    session = make_session()
    start = session.parameters.start
    points = [replace(start, gravity=g) for g in (1.0, 2.0, 3.0, 4.0)]
    matches = {1.0: (1.0, 5.0), 2.0: (2.0, 9.0), 3.0: (2.0, 8.0), 4.0: (0.0, 1.0)}
    guesses = [Guess(point, None) for point in points]
    match = {"_find_match_end_and_cost": lambda point: matches[point.gravity]}
    searches = ["_search_from_point", "_fit_slowly_growing_time_spans"]
    calls = record_calls(monkeypatch, session, [*searches, *match], match)

    def search():
        calls.clear()
        session._search_from_guesses(guesses)
        return [
            (call[1].gravity, *call[2:]) for call in calls if call[0] != "_find_match_end_and_cost"
        ]

    tried = [(3.0, 2.0), (2.0, 2.0), (1.0, 1.0), (4.0, 0.0)]
    assert search() == [*tried, (3.0,)]
    assert [g.point.gravity for g in session._sort_guesses(guesses)] == [3.0, 2.0, 1.0, 4.0]
    session._end = 2.0
    assert session._has_guess_agreeing_with_records(guesses)
    session._end = 2.1
    assert not session._has_guess_agreeing_with_records(guesses)
    session.loss, session._end = "soft", 7.0
    assert search() == [*tried, (4.0, 7.0), (3.0,)]
    monkeypatch.setattr(session, "_is_plausible", lambda: True)
    assert search() == [*tried, (4.0, 7.0)]
    session.loss = "linear"
    monkeypatch.setattr(session, "_has_good_fit", lambda: len(calls) > 5)
    assert search() == tried[:2]
    guesses.clear()
    assert search() == []


def test_a_slow_search_begins_with_the_body_of_the_scene(monkeypatch):
    session = make_session()
    calls = record_calls(monkeypatch, session, ["_search_from_point"])
    start = session.parameters.start
    zeros = np.zeros(3)
    point = replace(
        start, rate=zeros, densities=zeros, com=zeros, damping=zeros + 1.0, friction=3.0
    )
    session._fit_slowly_growing_time_spans(point)
    [(_, found, agreement)] = calls
    assert agreement == 0.0 and found.rate is zeros and found.friction == start.friction
    for name in ("densities", "com", "damping"):
        assert getattr(found, name) is getattr(start, name)


@pytest.mark.parametrize("count, is_divided", [(28, True), (27, False)])
def test_very_chaotic_motions_are_divided(monkeypatch, count, is_divided):
    session = make_session(make_record(np.linspace(0.0, 2.0, 60)))
    monkeypatch.setattr(search_session, "choose_segment_count", lambda *_: count)
    calls = record_calls(monkeypatch, session, ["_fit_by_multiple_shooting"])
    session._fit_chaotic_motion_in_segments(session.parameters.start)
    assert len(calls) == is_divided
    for _, model, begin, factor in calls:
        assert len(model.models) == 28 == len(begin.points) and factor == np.inf
