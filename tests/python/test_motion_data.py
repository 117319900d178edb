"""Tests of attitudes and angular velocities that kreisel.fit computes directly from records."""

import kreisel as kr
import numpy as np
import pytest
from fits import HEAVY, SYMMETRIC
from kreisel._fit import motion_data
from kreisel._fit.motion_data import MotionSamples
from kreisel._fit.parameters import convert_scene_to_fit_point
from kreisel._fit.rotations import (
    compute_rotation_quaternions,
    compute_rotation_vectors,
    conjugate_quaternions,
    multiply_quaternions,
    rotation_matrix,
)

AXIS = np.array((2.0, -1.0, 2.0)) / 3.0
FIRST = np.array((0.5, -0.5, 0.1, 0.7))


def rotate(angles, axis=AXIS):
    """Return the quaternions of rotations about an axis."""
    return compute_rotation_quaternions(np.asarray(angles, dtype=float)[..., None] * axis)


def make_record(t, **values):
    return kr.Record(np.asarray(t, dtype=float), values)


def assert_same_attitudes(q, expected, tolerance=1e-12):
    turns = multiply_quaternions(conjugate_quaternions(np.asarray(expected)), np.asarray(q))
    assert np.abs(compute_rotation_vectors(turns)).max() < tolerance


def find_regular_rows(values):
    """Return a mask of the rows whose values are all close to the median of their neighbours."""
    n = len(values)
    is_regular = np.ones(values.shape, dtype=bool)
    for column in range(values.shape[1]):
        v = values[:, column]

        def reflect(i, v=v):
            if i < 0:
                return 2.0 * v[1] - v[2 - i]
            return v[i] if i < n else 2.0 * v[-2] - v[2 * (n - 2) - i]

        deviations = [
            abs(v[i] - np.median([reflect(i + k) for k in (-2, -1, 1, 2)])) for i in range(n)
        ]
        usual = max(np.median(deviations), 1e-9 * np.abs(v).max())
        is_regular[:, column] = np.array(deviations) <= 8.0 * usual
    rows = is_regular.all(axis=1)
    return rows if rows.mean() >= 0.8 else np.ones(n, dtype=bool)


@pytest.mark.parametrize("count", [8, 9, 20, 60])
@pytest.mark.parametrize("share", [0.1, 0.2, 0.3])
def test_outliers_are_far_from_the_median_of_their_neighbours(count, share):
    rng = np.random.default_rng(count)
    values = np.cumsum(rng.normal(size=(count, 2)), axis=0) * (1.0, 1e-3) + (5.0, -2e-3)
    for row in range(count):
        values[row] += (rng.uniform(size=2) < 0.5 * share) * (30.0, 0.03)
    expected = find_regular_rows(values)
    assert (motion_data._compute_inlier_mask(values, False) == expected).all()


@pytest.mark.parametrize(
    ("spikes", "outliers"),
    [
        ({4: 4.0}, []),  # eight times the usual deviation
        ({4: 4.001}, [4]),
        ({4: 9.0, 8: -9.0}, [4, 8]),
        ({0: 9.0}, [0]),
        ({11: 9.0}, [11]),
        ({1: 9.0, 4: 9.0, 7: 9.0}, []),  # more than a fifth
    ],
)
def test_limits_of_outliers(spikes, outliers):
    values = np.tile((0.5, -0.5), 6)[:, None]
    for row, value in spikes.items():
        values[row] = value
    mask = motion_data._compute_inlier_mask(values, False)
    assert np.flatnonzero(~mask).tolist() == outliers


def test_a_fifth_of_the_rows_may_be_outliers():
    values = np.tile((0.5, -0.5), 5)[:, None]
    values[[2, 7]] = 9.0
    assert np.flatnonzero(~motion_data._compute_inlier_mask(values, False)).tolist() == [2, 7]


@pytest.mark.parametrize(("size", "is_outlier"), [(7e-9, False), (9e-9, True)])
def test_rounding_errors_of_constants_are_no_outliers(size, is_outlier):
    values = np.full((12, 2), (1.0, 1e-5))
    values[5] *= 1.0 + size
    mask = motion_data._compute_inlier_mask(values, False)
    assert mask[5] == (not is_outlier) and mask.sum() == 12 - is_outlier
    assert motion_data._compute_inlier_mask(np.zeros((12, 2)), False).all()
    assert motion_data._compute_inlier_mask(np.array([[0.0]] * 6 + [[9.0]]), False).all()  # too few


def test_signs_of_attitudes_are_no_outliers():
    rows = np.arange(30)
    q = multiply_quaternions(FIRST, rotate(0.1 * rows + 0.1 * (-1.0) ** rows))
    q[17] = multiply_quaternions(q[17], rotate(2.5))
    signs = np.random.default_rng(3).choice((-1.0, 1.0), size=30)
    for one in (q, q * signs[:, None]):
        mask = motion_data._compute_inlier_mask(one, True)
        assert np.flatnonzero(~mask).tolist() == [17]


def select(t, values):
    """Return the row indices of the longest gapless part of a series of measurements."""
    record = make_record(t, spin=np.asarray(values, dtype=float))
    times, found = motion_data._select_longest_gapless_samples(record.t, record.series[0])
    rows = np.searchsorted(record.t, times)
    assert (record.t[rows] == times).all() and (record.series[0].values[rows] == found).all()
    return rows.tolist()


@pytest.mark.parametrize(
    ("pauses", "first", "last"),
    [
        ([1.0] * 9 + [6.0] + [1.0] * 9, 0, 19),  # no gap
        ([1.0] * 9 + [6.1] + [1.0] * 9, 0, 9),  # the first of equal stretches
        ([1.0] * 8 + [6.1] + [1.0] * 9, 9, 18),
        ([1.0] * 3 + [7.0] + [1.0] * 9 + [7.0] + [1.0] * 3, 4, 13),
        ([0.1] * 9 + [0.65], 0, 9),
        ([20.0] * 9 + [110.0], 0, 10),
    ],
)
def test_the_longest_stretch_without_a_gap_is_selected(pauses, first, last):
    t = np.concatenate(([0.0], np.cumsum(pauses)))
    assert select(t, 0.5 * (-1.0) ** np.arange(len(t))) == list(range(first, last + 1))


def test_complete_distinct_and_regular_rows_are_selected():
    t = np.arange(12.0)
    values = 0.1 * t
    assert select(t[:8], values[:8]) == list(range(8)) and select(t[:7], values[:7]) == []
    values[3] = np.nan
    assert select(t, values) == [0, 1, 2, *range(4, 12)]
    values[6] = 50.0
    assert select(t, values) == [0, 1, 2, 4, 5, *range(7, 12)]
    t[10] = t[9]
    record = make_record(t, spin=values)
    times, found = motion_data._select_longest_gapless_samples(record.t, record.series[0])
    assert times.tolist() == [0, 1, 2, 4, 5, 7, 8, 9, 11]
    assert np.allclose(found[:, 0], (0.0, 0.1, 0.2, 0.4, 0.5, 0.7, 0.8, 0.9, 1.1))


@pytest.mark.parametrize(
    ("angle", "count", "stride"),
    [(0.1, 40, 5), (0.17, 40, 3), (0.3, 40, 2), (1.2, 40, 1), (0.01, 40, 10), (0.0, 9, 2)],
)
def test_angular_velocities_are_differences_over_half_a_radian(angle, count, stride):
    steps = np.tile((0.8, 1.1, 1.1), count)[: count - 1]
    t = np.concatenate(([2.0], 2.0 + 0.05 * np.cumsum(steps)))
    rate = angle / 0.05
    q = multiply_quaternions(FIRST, rotate(rate * (t - 2.0)))
    [motion] = motion_data.reconstruct_motions(
        [make_record(t, q=q)], convert_scene_to_fit_point(HEAVY)
    )
    assert motion.source == "attitude" and not motion.is_at_rest
    assert len(motion.t) == count - stride
    assert np.allclose(motion.t, 0.5 * (t[stride:] + t[:-stride]), rtol=1e-14)
    assert np.allclose(motion.rate, rate * AXIS, atol=1e-6 * rate)
    assert_same_attitudes(
        motion.attitude, multiply_quaternions(FIRST, rotate(rate * (motion.t - 2.0))), 1e-7
    )


@pytest.mark.parametrize("is_in_space", [False, True])
@pytest.mark.parametrize("count", [2, 3, 8, 13])
def test_attitudes_are_products_of_small_rotations(is_in_space, count):
    rng = np.random.default_rng(count)
    t, rate = np.sort(rng.uniform(0.0, 1.0, count)), rng.normal(size=(count, 3))
    attitude = FIRST / np.linalg.norm(FIRST)
    found = motion_data._integrate_angular_velocity(t, rate, attitude, is_in_space)
    for k in range(count):
        if k:
            turn = compute_rotation_quaternions((t[k] - t[k - 1]) * (rate[k] + rate[k - 1]) / 2.0)
            pair = (turn, attitude) if is_in_space else (attitude, turn)
            attitude = multiply_quaternions(*pair)
        assert np.allclose(found[k], attitude, atol=1e-14)


def make_turned_point(**changes):
    """Return a scene whose principal axes differ from the frame of description, and its point."""
    inertia = rotation_matrix(FIRST / np.linalg.norm(FIRST)) * (1.0, 1.3, 0.6)
    inertia = inertia @ rotation_matrix(FIRST / np.linalg.norm(FIRST)).T
    body = kr.Body(1.0, inertia=inertia, com=(0.1, 0.2, 0.3), unphysical=True)
    scene = kr.Scene(body, momentum=(1, 2, 3), gravity=9.81, **changes)
    return scene, convert_scene_to_fit_point(scene)


@pytest.mark.parametrize("turning", [None, (0.0, 0.0, 0.7)])
def test_motions_of_a_gyroscope_are_in_principal_axes(turning):
    scene, point = make_turned_point(turning=turning)
    path = kr.solve(scene, np.linspace(0.0, 1.0, 200))
    for name in ("body_velocity", "inertial_velocity"):
        values = {name: getattr(path, name), "body_vertical": path.body_vertical}
        record = make_record(path.t, **values)
        [motion] = motion_data.reconstruct_motions([record], point)
        principal = kr.solve(point.to_scene(), motion.t)
        assert motion.source == "vertical" and len(motion.t) > 190
        assert motion.is_at_rest == (name == "inertial_velocity" and turning is not None)
        assert np.allclose(motion.rate, getattr(principal, name), atol=1e-10)
        vertical = rotation_matrix(motion.attitude)[:, 2]
        assert np.allclose(vertical, principal.body_vertical, atol=1e-3)
        assert np.allclose(vertical[0], principal.body_vertical[0], atol=1e-10)
    [motion] = motion_data.reconstruct_motions([make_record(path.t, q=path.q)], point)
    expected = kr.solve(point.to_scene(), motion.t).q
    assert_same_attitudes(motion.attitude, expected, 0.05)


def test_motions_of_both_angular_velocities_have_a_fixed_order():
    _, point = make_turned_point(turning=(0.0, 0.0, 0.7))
    path = kr.solve(point.to_scene(), np.linspace(0.0, 1.0, 50))
    names = "inertial_velocity", "body_velocity"
    record = make_record(path.t, **{name: path.body_velocity for name in names})
    motions = motion_data.reconstruct_motions([record], point)
    assert [motion.is_at_rest for motion in motions] == [False, True]


def test_motions_with_known_attitudes_precede_others():
    t = np.linspace(0.0, 1.0, 50)
    path = kr.solve(HEAVY, t)
    records = [
        make_record(t, body_velocity=path.body_velocity),
        make_record(t, velocity=path.velocity),
        make_record(t, body_velocity=path.body_velocity, body_vertical=path.body_vertical),
        make_record(t, q=path.q),
    ]
    point = convert_scene_to_fit_point(HEAVY)
    motions = motion_data.reconstruct_motions(records, point)
    assert [m.source for m in motions] == ["attitude", "vertical", "space", "gyroscope"]
    assert (motions[3].attitude[0] == (1.0, 0.0, 0.0, 0.0)).all()
    space = motions[2]
    assert (space.attitude[0] == (1.0, 0.0, 0.0, 0.0)).all()
    turned = np.einsum("nij,nj->ni", rotation_matrix(space.attitude), space.rate)
    assert np.allclose(turned, path.velocity, atol=1e-12)
    first = motions[0].select_first_samples(7)
    assert len(first.t) == len(first.attitude) == len(first.rate) == 7
    assert (first.t == motions[0].t[:7]).all() and (first.rate == motions[0].rate[:7]).all()
    assert (first.attitude == motions[0].attitude[:7]).all()


@pytest.mark.parametrize("count", [7, 8])
@pytest.mark.parametrize("name", ["q", "velocity", "body_velocity"])
def test_a_motion_has_at_least_eight_samples(name, count):
    path = kr.solve(HEAVY, np.linspace(0.0, 0.1, count))
    record = make_record(path.t, **{name: getattr(path, name)})
    motions = motion_data.reconstruct_motions([record], convert_scene_to_fit_point(HEAVY))
    assert len(motions) == (count == 8)


@pytest.mark.parametrize(
    ("present", "time", "row"),
    [((0, 1, 2, 3), 2.2, 2), ((0, 3), 1.4, 0), ((0, 3), 1.6, 3), ((2,), 0.0, 2), ((), 0.0, None)],
)
def test_the_nearest_vertical_is_found(present, time, row):
    values = np.full((4, 3), np.nan)
    for k in present:
        values[k] = (0.1 * k, 0.5, 1.0)
    series = make_record(range(4), body_vertical=values, spin=np.ones(4)).series[0]
    found = motion_data._find_measured_vertical_near_time(
        np.arange(4.0), series, np.array((time, 0.0))
    )
    assert found is None if row is None else (found == values[row]).all()


@pytest.mark.parametrize(
    ("t", "row"),
    [(-1.0, 0), (0.0, 0), (0.4, 0), (0.6, 1), (2.4, 2), (3.5, 4), (4.0, 4), (7.7, 7), (9.0, 7)],
)
def test_a_motion_is_extrapolated_from_its_nearest_sample(t, row):
    rng = np.random.default_rng(0)
    q = multiply_quaternions(FIRST / np.linalg.norm(FIRST), rotate(np.arange(8.0)))
    motion = MotionSamples(np.arange(8.0), q, rng.normal(size=(8, 3)), "attitude")
    attitude, rate = motion_data.interpolate_motion(motion, t)
    rows = [k for k in range(8) if abs(k - row) <= 2]
    assert np.allclose(rate, sum(motion.rate[k] for k in rows) / len(rows), rtol=1e-14)
    turn = compute_rotation_quaternions((t - row) * rate)
    assert np.allclose(attitude, multiply_quaternions(q[row], turn), atol=1e-14)


def find_apex(point, t, **values):
    """Return the samples of the apex direction that can be computed from a record."""
    return motion_data.compute_apex_samples([make_record(t, **values)], point)


def test_traces_of_the_apex_are_unit_vectors_at_even_times():
    point = convert_scene_to_fit_point(SYMMETRIC)
    t = np.array((0.0, 0.5, 1.0, 2.0, 3.0, 4.0, 4.0, 5.0, 7.0))
    side = 0.1 * (-1.0) ** np.arange(9)
    side[6] = 7.0  # the first of two measurements at the same time counts
    apex = np.stack((side, 1.0 + side, 0.3 - side), axis=-1)
    [trace] = find_apex(point, t, apex=apex)
    assert np.allclose(trace.t, np.linspace(0.0, 7.0, 8), rtol=1e-14)
    rows = [0, 1, 2, 3, 4, 5, 7, 8]
    even = np.interp(trace.t, t[rows], side[rows])
    expected = np.stack((even, 1.0 + even, 0.3 - even), axis=-1)
    expected /= np.sqrt((expected**2).sum(axis=1))[:, None]
    assert np.allclose(trace.apex, expected, rtol=1e-13)
    assert find_apex(point, t[1:], apex=apex[1:]) == []


@pytest.mark.parametrize("attitude, side", [((1, 0, 0, 0), 1.0), ((0, 1, 0, 0), -1.0)])
@pytest.mark.parametrize("com", [(0.0, 0.0, 0.2), (0.2, 0.0, 0.0)])
def test_the_height_of_the_apex_follows_from_its_horizontal_components(attitude, side, com):
    body = kr.Body(1.0, (1.0, 1.0, 0.9), com=com)
    point = convert_scene_to_fit_point(kr.Scene(body, (0, 0, 1), attitude, gravity=1))
    t = np.arange(12.0)
    x, y = 0.6 + 0.001 * t, -0.3 + 0.001 * t
    x[5], y[7], x[11], y[11] = np.nan, np.nan, 0.8, -0.61
    [trace] = find_apex(point, t, apex_x=x, apex_y=y)
    assert np.allclose(trace.t, np.linspace(0.0, 11.0, 10), rtol=1e-14)
    rows = [0, 1, 2, 3, 4, 6, 8, 9, 10, 11]
    squares = np.maximum(1.0 - x[rows] ** 2 - y[rows] ** 2, 0.0)  # the last one would be negative
    z = (side if com[2] else 1.0) * np.sqrt(squares)
    expected = [np.interp(trace.t, t[rows], values) for values in (x[rows], y[rows], z)]
    unit = np.stack(expected, axis=-1) / np.linalg.norm(expected, axis=0)[:, None]
    assert np.allclose(trace.apex, unit, rtol=1e-12)


def test_angles_of_the_apex_give_its_direction():
    path = kr.solve(SYMMETRIC, np.linspace(0.0, 1.0, 30))
    nutation, precession = path.nutation.copy(), path.precession_angle.copy()
    nutation[4], precession[9] = np.nan, np.nan
    rows = np.isfinite(nutation + precession)
    point = convert_scene_to_fit_point(SYMMETRIC)
    [trace] = find_apex(point, path.t, nutation=nutation, precession_angle=precession)
    assert len(trace.t) == 28
    expected = [np.interp(trace.t, path.t[rows], e[rows]) for e in path.apex.T]
    expected = np.stack(expected, axis=-1) / np.linalg.norm(expected, axis=0)[:, None]
    assert np.allclose(trace.apex, expected, atol=1e-12)


def test_outliers_of_the_apex_are_left_out():
    path, point = (
        kr.solve(SYMMETRIC, np.linspace(0.0, 0.2, 30)),
        convert_scene_to_fit_point(SYMMETRIC),
    )
    apex = path.apex + 0.05 * np.random.default_rng(1).normal(size=(30, 3))
    apex[12] = (1.0, 0.0, 0.0)
    [trace] = find_apex(point, path.t, apex=apex)
    rows = np.arange(30) != 12
    expected = [np.interp(trace.t, path.t[rows], e[rows]) for e in apex.T]
    expected = np.stack(expected, axis=-1) / np.linalg.norm(expected, axis=0)[:, None]
    assert len(trace.t) == 29 and np.allclose(trace.apex, expected, atol=1e-12)
    assert find_apex(point, path.t[8:16], apex=apex[8:16]) == []
