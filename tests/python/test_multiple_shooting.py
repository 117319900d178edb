"""Tests of motions that are fitted in segments, each of which has its own initial state."""

from dataclasses import replace

import kreisel as kr
import numpy as np
import pytest
from fit_sessions import BODY_RATES, make_record
from fits import HEAVY
from kreisel._fit import multiple_shooting
from kreisel._fit.fit_path import solve_fitted_motion
from kreisel._fit.levenberg_marquardt import Minimum
from kreisel._fit.motion_data import MotionSamples
from kreisel._fit.multiple_shooting import SegmentStartStates, ShootingModel, choose_segment_count
from kreisel._fit.parameters import FreeParameters, convert_scene_to_fit_point, expand_free_names
from kreisel._fit.residuals import ResidualModel
from kreisel._fit.rotations import (
    compute_rotation_quaternions,
    compute_rotation_vectors,
    conjugate_quaternions,
    multiply_quaternions,
)

AT_REST = HEAVY.replace(momentum=(0, 0, 0))


def make_model(records, count, free=("start", "moments"), scene=HEAVY):
    parameters = FreeParameters(scene, expand_free_names(free), records)
    sigmas = [series.sigma for record in records for series in record.series]
    return ShootingModel(parameters, records, sigmas, count)


@pytest.mark.parametrize("scene", [HEAVY, AT_REST, HEAVY.replace(turning=(0.3, 0.0, 1.0))])
@pytest.mark.parametrize("begin, end", [(0.0, 0.5), (0.0, 3.0), (-2.0, 1.0), (-1.0, 2.5)])
def test_the_number_of_segments_follows_from_the_growth_of_errors(scene, begin, end):
    far = begin if -begin > end else end
    tangents = kr.solve(scene, [far], "taylor", tangents="start").tangents[0].copy()
    point = convert_scene_to_fit_point(scene)
    scale = np.linalg.norm(scene.momentum) or 1.0
    tangents[:3, 3:] *= scale
    tangents[3:, :3] /= scale
    growth = np.log(np.linalg.svd(tangents)[1][0])
    records = [make_record(np.linspace(begin, end, 300)), make_record([0.0, 0.1])]
    assert choose_segment_count(point, records) == max(int(np.ceil(2.0 * growth)), 2)


@pytest.mark.parametrize(
    ("count", "most"), [(1, 1), (19, 1), (20, 2), (39, 3), (40, 4), (3999, 399), (4100, 400)]
)
def test_a_segment_has_at_least_ten_times(monkeypatch, count, most):
    def refuse(*_, **__):
        raise ValueError

    record = make_record(np.linspace(0.0, 3.0, count), energy=np.zeros(count))
    point = convert_scene_to_fit_point(HEAVY)
    if count < 100:
        assert choose_segment_count(point, [record, record]) == most
    monkeypatch.setattr(multiple_shooting, "solve", refuse)
    assert choose_segment_count(point, [record, record]) == most


@pytest.mark.parametrize(
    ("begin", "end", "count", "edges"),
    [
        (0.0, 3.0, 3, [0.0, 1.0, 2.0, 3.0]),
        (0.5, 3.0, 3, [0.0, 1.0, 2.0, 3.0]),
        (-1.1, 2.9, 4, [-1.1, 0.0, 0.9, 1.9, 2.9]),
        (-0.4, 1.6, 2, [0.0, 0.6, 1.6]),
        (-1.6, 0.4, 2, [-1.6, 0.0, 0.4]),
        (-3.0, -1.0, 3, [-3.0, -2.0, 0.0, 0.0]),
    ],
)
def test_one_edge_of_equally_spaced_segments_moves_to_the_start(begin, end, count, edges):
    t = np.linspace(begin, end, 41)
    path = kr.solve(HEAVY, t[t >= 0.0])
    values = np.tile((1.0, 0.0, 0.0, 0.0), (41, 1))
    values[t >= 0.0] = path.q
    records = [
        make_record(t, q=values, energy=np.zeros(41)),
        make_record(t[3:], body_velocity=BODY_RATES[:38]),
    ]
    model = make_model(records, count)
    assert np.allclose(model.edges, edges, atol=1e-12) and model.edges[model.first] == 0.0
    assert model.data_size == 41 * 4 + 38 * 3 and model.size == model.data_size + 6 * (count - 1)
    assert model.width == 9 + 6 * (count - 1) and model.evaluations == 0
    assert sorted(np.concatenate(model.rows)) == list(range(model.data_size))
    times = np.concatenate((np.repeat(t, 3), t, np.repeat(t[3:], 3)))
    for k, rows in enumerate(model.rows):
        is_inside = (times >= model.edges[k]) & (times < model.edges[k + 1])
        if k == count - 1:
            is_inside |= times == max(t[-1], model.edges[k])
        is_inside |= (k == 0) & (times < model.edges[0])
        assert set(np.flatnonzero(is_inside)) == set(rows)
        for record, whole in zip(model.models[k].records, records, strict=True):
            assert np.isin(np.round(record.t + model.edges[k], 9), np.round(whole.t, 9)).all()
    columns = [set(c.tolist()) for c in model.columns]
    shared = set(range(6, 9))
    for k in range(count):
        assert len(columns[k]) == 9 and shared <= columns[k]
        assert (set(range(9)) == columns[k]) == (k == model.first)
    assert set.union(*columns) == set(range(model.width))


@pytest.mark.parametrize("words", [{}, {"turning": (0.5, -0.2, 0.8)}])
def test_segments_of_one_motion_have_its_residuals_and_no_gaps(words):
    scene = HEAVY.replace(**words)
    t = np.linspace(-1.1, 2.9, 31)
    records = [make_record(t), make_record(t[9:], energy=np.zeros(22))]
    model = make_model(records, 4, scene=scene)
    point = model.parameters.start
    starts = model.build_segment_starts(point)
    whole = ResidualModel(model.parameters, records, [s.sigma for r in records for s in r.series])
    evaluation = model.evaluate_residuals(starts)
    expected = whole.evaluate_residuals(point).residuals
    assert np.allclose(evaluation.residuals[: model.data_size], expected, atol=1e-6)
    assert np.abs(evaluation.residuals[model.data_size :]).max() < 1e-6
    assert model.evaluations == 1 and evaluation.jacobian.shape == (model.size, model.width)
    assert np.allclose(starts.points[1].attitude, point.attitude, atol=1e-12)
    assert np.allclose(starts.points[1].rate, point.rate, atol=1e-12)
    path = kr.solve(scene, model.edges[2:4])
    for row, start in enumerate(starts.points[2:]):
        assert np.allclose(start.attitude, path.q[row], atol=1e-9)
        assert np.allclose(start.rate, path.body_velocity[row], atol=1e-8)
    scales = model.estimate_parameter_scales(starts)
    assert np.allclose(scales[:9], model.parameters.estimate_parameter_scales(point, 4.0))
    for k in (0, 2, 3):
        part = model.models[k].parameters.estimate_parameter_scales(starts.points[k], 4.0)
        assert np.allclose(scales[model.columns[k][:6]], part[:6])
    distances = model.compute_distances_to_lower_bounds(starts)
    assert np.allclose(distances[:9], model.parameters.compute_distances_to_lower_bounds(point))
    assert (distances[9:] == np.inf).all() and np.isfinite(distances[6:9]).all()


def test_gaps_are_jumps_of_attitude_and_velocity():
    model = make_model([make_record()], 2, free=("start", "moments"))
    starts = model.build_segment_starts(model.parameters.start)
    turn, change = np.array((0.3, -0.2, 0.4)), np.array((1.0, 2.0, -0.5))
    second = starts.points[1]
    rate = second.rate
    attitude = multiply_quaternions(second.attitude, compute_rotation_quaternions(turn))
    moved = replace(second, attitude=attitude, rate=rate + change)
    assert model.gap == 0.1
    for gap in (0.1, 1e-3):
        model.gap = gap
        residuals = model.evaluate_residuals(SegmentStartStates((starts.points[0], moved)))[0]
        expected = np.concatenate((turn, change / np.linalg.norm(rate))) / gap
        assert np.allclose(residuals[120:], expected, rtol=1e-7)


def test_the_gaps_of_a_top_at_rest_are_velocities():
    scene = AT_REST.replace(gravity=0.0)
    model = make_model([make_record()], 2, scene=scene)
    starts = model.build_segment_starts(model.parameters.start)
    moved = replace(starts.points[1], rate=np.array((1.0, 2.0, 3.0)))
    residuals, jacobian = model.evaluate_residuals(SegmentStartStates((starts.points[0], moved)))
    assert np.allclose(residuals[120:], (0.0, 0.0, 0.0, 10.0, 20.0, 30.0), atol=1e-12)
    assert np.isfinite(jacobian).all()


def test_segments_that_cannot_be_computed_have_infinite_residuals():
    model = make_model([make_record()], 3)
    starts = model.build_segment_starts(model.parameters.start)
    wrong = replace(starts.points[1], rate=np.full(3, np.inf))
    points = (starts.points[0], wrong, starts.points[2])
    residuals, _ = model.evaluate_residuals(SegmentStartStates(points))
    assert residuals.shape == (model.size,) and (residuals == np.inf).all()


def test_starts_of_segments_are_measured_states():
    model = make_model([make_record(np.linspace(-1.0, 2.0, 40))], 3)
    t = np.linspace(-1.0, 2.0, 301)
    rate = np.array((0.3, -0.2, 0.9))
    motion = MotionSamples(
        t, compute_rotation_quaternions(t[:, None] * rate), np.tile(rate, (301, 1)), "attitude"
    )
    point = model.parameters.start
    starts = model.data_starts(point, motion)
    assert len(starts.points) == 3 and starts.points[1] is point
    for k, begin in ((0, -1.0), (2, 1.0)):
        start = starts.points[k]
        assert np.allclose(start.attitude, compute_rotation_quaternions(begin * rate), atol=1e-12)
        assert np.allclose(start.rate, rate) and start.com is point.com


def prescribe_costs(monkeypatch, *costs):
    """Prescribe the final costs of the stages of the search, and return the stage settings."""
    stages, rest = [], list(costs)

    def minimize(model, pieces, search):
        stages.append((model.gap, pieces, *search))
        model.evaluations += 7
        return Minimum(pieces + 1, None, rest.pop(0), True)

    monkeypatch.setattr(multiple_shooting, "minimize_cost", minimize)
    return stages


class Model:
    size, evaluations, gap = 20, 5, None


def test_gaps_are_closed_in_stages(monkeypatch):
    stages = prescribe_costs(monkeypatch, 60.0, 9.0, 8.0, 7.0)  # at most three times the size
    minimum = multiple_shooting.minimize_by_multiple_shooting(Model(), 0, "soft", print, 60)
    assert minimum.point == 4 and minimum.cost == 7.0
    assert [stage[0] for stage in stages] == [0.1, 0.01, 0.001, 1e-5]
    assert [stage[1] for stage in stages] == [0, 1, 2, 3]
    assert [stage[3] for stage in stages] == [45, 52, 59, 60]
    assert [stage[5] is print for stage in stages] == [False, False, False, True]
    for stage in stages:
        assert stage[2] == "soft" and stage[4] == 1e-5 and stage[6] is True


@pytest.mark.parametrize("cost", [60.1, np.nan])
def test_hopeless_gaps_are_not_closed(monkeypatch, cost):
    stages = prescribe_costs(monkeypatch, 60.0, cost)
    minimum = multiple_shooting.minimize_by_multiple_shooting(Model(), 0, "linear", print, 900)
    assert minimum.point == 2 == len(stages)


@pytest.mark.parametrize("cost, is_near", [(60.0, True), (60.1, False)])
def test_a_trial_of_segments_allows_gaps(monkeypatch, cost, is_near):
    stages = prescribe_costs(monkeypatch, cost)
    assert multiple_shooting.try_segment_fit(Model(), 0, "linear") is is_near
    [(gap, _, loss, limit, ftol, report, is_stiff, weakest)] = stages
    assert (gap, loss, limit, ftol, is_stiff, weakest) == (0.1, "linear", 40, 1e-5, True, 1.0)
    assert report(None) is None


def make_pieces(begins):
    """Return the free parameters of a fit, and the start time and fit point of each segment."""
    start = convert_scene_to_fit_point(HEAVY)
    points = [replace(start, rate=start.rate * (1.0 + 0.1 * k)) for k in range(len(begins))]
    return FreeParameters(HEAVY, ("velocity",), []), tuple(zip(begins, points, strict=True))


@pytest.mark.parametrize(
    ("begins", "t", "owners"),
    [
        ((0.0,), [0.0, 0.5, 1.0], [0, 0, 0]),
        ((0.0,), [-0.5, -0.2, 0.0, 1.0], [0, 0, 0, 0]),
        ((0.0,), [-0.5, -0.2], [0, 0]),
        ((0.0, 1.0, 2.0), [-0.3, 0.0, 0.9, 1.0, 1.5, 2.0, 2.5], [0, 0, 0, 1, 1, 2, 2]),
        ((-1.0, 0.0, 1.0), [-1.3, -1.0, -0.1, 0.0, 1.1], [0, 0, 0, 1, 2]),
        ((-1.0, 0.0), [0.5], [1]),
        ((0.0, 1.0), [0.2, 0.4], [0, 0]),
    ],
)
def test_the_path_of_segments_starts_from_each(begins, t, owners):
    parameters, pieces = make_pieces(begins)
    path = solve_fitted_motion(parameters, pieces, np.array(t))
    assert path.t.tolist() == pytest.approx(t) and len(path.states) == len(t)
    for row, (time, owner) in enumerate(zip(t, owners, strict=True)):
        begin, point = pieces[owner]
        expected = kr.solve(point.to_scene(), [time - begin])
        turn = multiply_quaternions(conjugate_quaternions(expected.q[0]), path.q[row])
        assert np.abs(compute_rotation_vectors(turn)).max() < 1e-7
        assert np.allclose(path.m[row], expected.m[0], atol=1e-8)
    start = next(point for begin, point in pieces if begin == 0.0)
    assert np.allclose(path.scene.momentum, start.to_scene().momentum)


@pytest.mark.parametrize("begin, end", [(-0.4, 1.6), (-1.6, 0.4), (-3.0, -1.0)])
def test_pieces_of_records_with_negative_times_are_fitted(begin, end):
    t = np.linspace(begin, end, 60)
    noise = 0.02 * np.random.default_rng(0).normal(size=(60, 3))
    parts = [kr.solve(HEAVY, times).body_velocity for times in (t[t < 0.0][::-1], t[t >= 0.0])]
    record = make_record(t, 0.02, body_velocity=np.concatenate((parts[0][::-1], parts[1])) + noise)
    fit = kr.fit(HEAVY, record, "velocity", pieces=2)
    single = kr.fit(HEAVY, record, "velocity")
    assert 0.8 < fit.chi2 / fit.dof < 1.2 and len(fit.piece_starts) == 2
    assert np.allclose(fit.path.t, t, atol=1e-12)
    for name, value in single.values.items():
        assert abs(fit.values[name] - value) < 0.01 * single.error[name]
