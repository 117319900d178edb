"""Tests of the linear equations from which kreisel.fit computes its initial guesses."""

import itertools
from dataclasses import replace

import kreisel as kr
import numpy as np
import pytest
from fits import HEAVY, SYMMETRIC
from kreisel._fit import initial_guess
from kreisel._fit.initial_guess import _EnergyLossFlags, _LinearBodyEstimates
from kreisel._fit.motion_data import ApexSamples, MotionSamples
from kreisel._fit.parameters import FreeParameters, convert_scene_to_fit_point, expand_free_names
from kreisel._fit.rotations import (
    compute_rotation_quaternions,
    conjugate_quaternions,
    multiply_quaternions,
    rotation_matrix,
)

T = 0.2 + np.linspace(0.0, 0.4, 401)
COM = np.array(HEAVY.body.com)
ROTOR_BODY = kr.Body(1.2, (1.0, 1.3, 0.6), com=COM, rotor=(0.8, -0.5, 2.0), unphysical=True)
OBLIQUE, UPRIGHT = (0.6, -0.4, 0.9), (0.0, 0.0, 1.3)


def make_parameters(scene, free):
    return FreeParameters(scene, expand_free_names(free), [])


def change(scene, **words):
    """Return a copy of a scene with changed properties and the same initial angular velocity."""
    return kr.Scene(
        words.pop("body", scene.body),
        attitude=scene.attitude,
        body_velocity=(3.0, 2.0, 12.0),
        **{"gravity": scene.gravity, **words},
    )


def measure_motion(scene, source, t=T):
    """Return exact measurements of a motion, and the quantities that an initial guess estimates.

    The measurements come from one kind of instrument. The estimated quantities are the inertia
    tensor, the angular momentum, the lever vector (mass times gravity times centre of mass) and the
    vertical, all at the first time.
    """
    path, point = kr.solve(scene, t), convert_scene_to_fit_point(scene)
    q, rate, first = path.q, path.body_velocity, rotation_matrix(path.q[0])
    inertia, lever = np.diag(point.moments), scene.body.mass * scene.gravity * point.com
    momentum = first @ (point.moments * (rate[0] + point.turning @ first) + point.rotor)
    vertical = np.array((0.0, 0.0, 1.0))
    if source == "space":
        q, rate = multiply_quaternions(q, conjugate_quaternions(q[0])), rate @ first.T
        inertia, lever = first @ inertia @ first.T, first @ lever
    elif source == "gyroscope":
        q = multiply_quaternions(conjugate_quaternions(q[0]), q)
        momentum, vertical = first.T @ momentum, first.T @ vertical
    return MotionSamples(t, q, rate, source), (inertia, momentum, lever, vertical)


MOTIONS = [
    ("attitude", {}),
    ("attitude", {"gravity": -3.0}),
    ("attitude", {"turning": OBLIQUE, "body": ROTOR_BODY}),
    ("attitude", {"shaking": (0.02, 30.0, 0.5), "damping": 0.3}),
    ("attitude", {"friction": 2.0, "damping": 0.3}),
    ("attitude", {"gravity": 0.0}),
    ("vertical", {"turning": UPRIGHT}),
    ("vertical", {"body": ROTOR_BODY}),
    ("space", {"damping": 0.3}),
    ("space", {"turning": OBLIQUE}),
    ("gyroscope", {}),
    ("gyroscope", {"friction": 2.0, "damping": 0.3}),
    ("gyroscope", {"body": ROTOR_BODY, "shaking": (0.02, 30.0, 0.5)}),
]


@pytest.mark.parametrize("source, words", MOTIONS)
def test_the_momentum_equation_holds_for_a_motion(source, words):
    """Check that the true parameters of a top are the only solution of the momentum equation."""
    scene = change(HEAVY, **words)
    base = convert_scene_to_fit_point(scene)
    motion, (inertia, momentum, lever, vertical) = measure_motion(scene, source)
    losses = _EnergyLossFlags("damping" in words, "friction" in words)
    is_heavy = scene.gravity != 0.0
    columns = initial_guess._list_momentum_equation_columns(motion, base, is_heavy, losses)
    values = np.diag(inertia).tolist()
    values += [inertia[1, 2], inertia[2, 0], inertia[0, 1]] if source == "space" else []
    values += [1.0] if base.rotor.any() else []
    values += momentum.tolist()
    if is_heavy:
        values += (np.outer(vertical, lever) if source == "gyroscope" else lever).ravel().tolist()
    values += [0.3] * losses.is_damped + [2.0] * losses.is_rubbed
    terms = np.concatenate(columns, axis=2) * values
    assert np.abs(terms.sum(axis=2)).max() < 2e-4
    assert np.abs(terms).max(axis=(0, 1)).min() > 4e-3
    found = initial_guess._fit_momentum_equation(motion, base, is_heavy, losses)
    if base.rotor.any() and source == "space":
        assert found is None
        return
    factor = np.trace(inertia) / np.trace(found.inertia)
    assert factor > 0.0 and np.allclose(factor * found.inertia, inertia, atol=2e-3)
    assert found.damping * factor == pytest.approx(0.3 if losses.is_damped else 0.0, abs=2e-3)
    assert found.friction * factor == pytest.approx(2.0 if losses.is_rubbed else 0.0, abs=2e-3)
    if is_heavy:
        expected = np.outer(vertical, lever)
        assert np.allclose(factor * np.outer(found.vertical, found.lever), expected, atol=0.02)
        assert np.linalg.norm(found.vertical) == pytest.approx(1.0, rel=1e-12)


def test_the_momentum_equation_needs_as_many_rows_as_unknowns():
    losses, base = _EnergyLossFlags(False, False), convert_scene_to_fit_point(HEAVY)
    motion, _ = measure_motion(HEAVY, "attitude", T[::50])

    def solve(count):
        part = motion.select_first_samples(count)
        return initial_guess._fit_momentum_equation(part, base, True, losses)

    assert solve(2) is None and solve(3) is not None
    rate = motion.rate.copy()
    rate[4, 1] = np.nan
    motion = motion._replace(rate=rate)
    assert solve(4) is not None and solve(5) is None
    rotor = convert_scene_to_fit_point(change(HEAVY, body=ROTOR_BODY))
    motion, _ = measure_motion(HEAVY, "space")
    assert initial_guess._fit_momentum_equation(motion, rotor, True, losses) is None


@pytest.mark.parametrize(
    ("source", "is_at_rest", "turning"),
    [
        ("attitude", False, OBLIQUE),
        ("space", False, OBLIQUE),
        ("vertical", False, (0.0, 0.0, 0.9)),
        ("gyroscope", False, (0.0, 0.0, 0.0)),
        ("vertical", True, (0.0, 0.0, 0.0)),
        ("attitude", True, (0.0, 0.0, 0.0)),
    ],
)
def test_the_turning_of_the_support_counts_as_far_as_it_is_seen(source, is_at_rest, turning):
    base = convert_scene_to_fit_point(change(HEAVY, turning=OBLIQUE))
    motion = MotionSamples(T, np.zeros((401, 4)), np.zeros((401, 3)), source, is_at_rest)
    assert tuple(initial_guess._get_turning_in_momentum_equation(motion, base)) == turning


def test_a_motion_seen_from_the_inertial_frame_is_turned_into_that_of_the_support():
    scene = change(HEAVY, turning=OBLIQUE)
    seen, _ = measure_motion(scene, "attitude")
    turns = compute_rotation_quaternions((T - T[0])[:, None] * np.array(OBLIQUE))
    rate = seen.rate + np.array(OBLIQUE) @ rotation_matrix(seen.attitude)
    motion = MotionSamples(T, multiply_quaternions(turns, seen.attitude), rate, "vertical", True)
    found = initial_guess._transform_motion_to_support_frame(motion, np.array(OBLIQUE))
    assert not found.is_at_rest and found.source == "vertical" and found.t is T
    assert np.allclose(found.attitude, seen.attitude, atol=1e-13)
    assert np.allclose(found.rate, seen.rate, atol=1e-12)


def solve_back(scene, attitude, rate):
    """Return the state at time 0 of the motion that has the given state at time 0.7."""
    amplitude, frequency, phase = scene.shaking
    trial = kr.Scene(
        scene.body,
        attitude=attitude,
        body_velocity=rate,
        gravity=scene.gravity,
        turning=scene.turning,
        shaking=(amplitude, frequency, phase + 0.7 * frequency),
    )
    path = kr.solve(trial, [-0.7])
    return {"attitude": path.q[0], "rate": path.body_velocity[0]}


@pytest.mark.parametrize(
    ("free", "names"),
    [("start", {"attitude", "rate"}), ("attitude", {"attitude"}), ("velocity", {"rate"})],
)
@pytest.mark.parametrize("words", [{}, {"shaking": (0.02, 30.0, 0.5)}, {"turning": OBLIQUE}])
def test_a_motion_passes_through_a_given_state(free, names, words):
    scene = change(HEAVY, **words)
    parameters = make_parameters(scene, free)
    path, point = kr.solve(scene, [0.0, 0.7]), parameters.start
    given = {"attitude": path.q[1], "rate": path.body_velocity[1]}
    trial = {name: given[name] if name in names else getattr(point, name) for name in given}
    expected = solve_back(scene, **trial)
    found = initial_guess._find_parameters_through_state(parameters, point, 0.7, **given)
    start = initial_guess._find_parameters_through_state(parameters, point, 0.0, **given)
    for name in names:
        assert np.allclose(getattr(found, name), expected[name], rtol=0, atol=3e-14)
        assert np.array_equal(getattr(start, name), given[name])
    for name in given.keys() - names:
        assert getattr(found, name) is getattr(start, name) is getattr(point, name)
    if free == "start":
        assert np.allclose(found.attitude, point.attitude, rtol=0, atol=3e-14)
        assert np.allclose(found.rate, point.rate, rtol=0, atol=3e-14)


@pytest.mark.parametrize("names", [("q",), ("body_velocity", "body_vertical"), ("velocity",)])
@pytest.mark.parametrize("free", [("start", "moments", "com"), ("start", "com")])
def test_a_guess_moves_through_the_first_measured_state(names, free):
    path = kr.solve(HEAVY, np.linspace(0.3, 2.0, 60))
    record = kr.Record(path.t, {name: getattr(path, name) for name in names})
    parameters = FreeParameters(HEAVY, expand_free_names(free), [record])
    guesses = initial_guess.guess_parameters_from_records(parameters, [record])
    assert len(guesses) == 2  # from all samples and from the first ones
    for guess in guesses:
        motion = guess.motion
        state = kr.solve(guess.point.to_scene(), [motion.t[0]])
        rows = rotation_matrix(state.q[0]), rotation_matrix(motion.attitude[0])
        assert np.allclose(*rows, atol=1e-9)
        expected = (motion.rate[0] + motion.rate[1] + motion.rate[2]) / 3.0
        assert np.allclose(state.body_velocity[0], expected, atol=1e-8)


@pytest.mark.parametrize("count, parts", [(20, {20}), (60, {60, 40}), (300, {300, 75})])
def test_guesses_come_from_all_samples_and_from_the_first_ones(monkeypatch, count, parts):
    def store_part(parameters, motion, part):
        assert len(motion.t) == count
        found.append(part)
        return []

    found = []
    monkeypatch.setattr(initial_guess, "_guess_parameters_from_motion", store_part)
    t = np.linspace(0.0, 1.0, count)
    record = kr.Record(t, {"body_velocity": np.random.default_rng(0).normal(size=(count, 3))})
    parameters = FreeParameters(HEAVY, ("velocity",), [record])
    assert initial_guess.guess_parameters_from_records(parameters, [record] * 3) == []
    assert {len(part.t) for part in found} == parts and len(found) == 2 * len(parts)
    assert all((part.t == t[: len(part.t)]).all() for part in found)


@pytest.mark.parametrize(
    ("source", "words", "free", "is_heavy", "losses"),
    [
        ("attitude", {}, "start", True, (False, False)),
        ("attitude", {"gravity": 0.0}, ("start", "com"), False, (False, False)),
        ("attitude", {"damping": 0.1}, "damping", True, (True, False)),
        ("attitude", {"damping": (0.0, 0.1, 0.0)}, "start", True, (True, False)),
        ("attitude", {"friction": 0.1}, "start", True, (False, True)),
        ("attitude", {}, "friction", True, (False, True)),
        ("space", {"friction": 0.1}, "friction", True, (False, False)),
    ],
)
def test_terms_of_the_momentum_equation_are_chosen(
    monkeypatch, source, words, free, is_heavy, losses
):
    found = []
    monkeypatch.setattr(initial_guess, "_fit_momentum_equation", lambda *a: found.append(a[2:]))
    scene = change(HEAVY, **words)
    motion, _ = measure_motion(scene, source)
    parameters = make_parameters(scene, free)
    assert initial_guess._guess_parameters_from_motion(parameters, motion, motion) == []
    assert found == [(is_heavy, losses)]
    free_body = kr.Body(1.0, HEAVY.body.moments, com=(0, 0, 0), unphysical=True)
    for name, is_heavy in (("start", False), ("com", bool(scene.gravity)))[
        : 2 - ("friction" in words)
    ]:
        parameters = make_parameters(change(HEAVY, body=free_body, **words), name)
        initial_guess._guess_parameters_from_motion(parameters, motion, motion)
        assert found[-1][0] is is_heavy


def test_guesses_take_fixed_damping_into_account():
    path = kr.solve(change(HEAVY, damping=1.5), T - T[0])
    record = kr.Record(path.t, {"body_velocity": path.body_velocity})
    unknown = kr.Body(1.0, (1.1, 1.2, 0.7), com=(0.0, 0.0, 0.2), unphysical=True)
    parameters = make_parameters(path.scene.replace(body=unknown), ("start", "moments", "com"))
    [guess, *_] = initial_guess.guess_parameters_from_records(parameters, [record])
    scale = HEAVY.body.moments[0] / guess.point.moments[0]  # the guess has the right ratios
    assert scale * guess.point.com == pytest.approx(COM, rel=1e-3)


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("gravity", [9.81, -9.81])
def test_a_gyroscope_guess_is_on_the_side_of_the_scene(side, gravity):
    motion, _ = measure_motion(change(HEAVY, gravity=gravity), "gyroscope")
    body = kr.Body(1.0, HEAVY.body.moments, com=0.8 * side * COM, unphysical=True)
    parameters = make_parameters(change(HEAVY, body=body, gravity=gravity), ("start", "com"))
    [guess] = initial_guess._guess_parameters_from_motion(parameters, motion, motion)
    assert np.allclose(guess.point.com, side * COM, atol=0.02)
    vertical = rotation_matrix(guess.motion.attitude[0])[2]
    true = rotation_matrix(kr.solve(change(HEAVY, gravity=gravity), T[:1]).q[0])[2]
    assert np.allclose(vertical, side * true, atol=0.02)


@pytest.mark.parametrize(
    ("row", "spin", "count"),
    [(8, 0.0499, 8), (8, -0.01, 8), (8, 0.05, 20), (8, 0.06, 20), (7, 0.01, 20), (15, 0.0, 15)],
)
def test_samples_end_where_the_spin_nearly_stops(row, spin, count):
    rate = np.tile((0.6, 0.7, -0.8), (20, 1))
    rate[row:] = np.array((0.6, 0.0, -0.8)) * spin
    rate[0, 1] = -50.0  # no part of the spin
    motion = MotionSamples(np.arange(20.0), np.zeros((20, 4)), rate, "attitude")
    axis = np.array((0.6, 0.0, -0.8))
    assert len(initial_guess._select_samples_before_spin_stops(motion, axis).t) == count


@pytest.mark.parametrize("free, count", [("start", 401), ("friction", 100)])
def test_friction_uses_the_samples_before_the_spin_stops(monkeypatch, free, count):
    found = []
    monkeypatch.setattr(initial_guess, "_fit_momentum_equation", lambda *a: found.append(a[0]))
    motion, _ = measure_motion(HEAVY, "attitude")
    rate = motion.rate * (np.arange(401) < 100)[:, None]
    motion = motion._replace(rate=rate)
    initial_guess._guess_parameters_from_motion(make_parameters(HEAVY, free), motion, motion)
    assert [len(part.t) for part in found] == [count]


def test_friction_acts_about_the_centre_of_mass_or_the_third_axis():
    base = convert_scene_to_fit_point(HEAVY)
    axis = initial_guess._compute_friction_axis(base)
    assert np.allclose(axis, COM / np.sqrt(COM @ COM), rtol=1e-15)
    axis = initial_guess._compute_friction_axis(replace(base, com=np.zeros(3)))
    assert tuple(axis) == (0.0, 0.0, 1.0)


ESTIMATES = _LinearBodyEstimates(np.eye(3), np.zeros(3), np.zeros(3), 0.3, 0.7)


@pytest.mark.parametrize(
    ("free", "gravity", "factor"),
    [
        (("moments",), 9.81, "lever"),
        (("moments",), -9.81, "lever"),
        (("moments", "damping", "friction"), 9.81, "lever"),
        (("moments", "com", "damping"), 9.81, "trace"),
        (("moments", "damping"), 0.0, "trace"),
        (("com", "friction"), 9.81, "trace"),
        (("damping", "friction"), 9.81, "trace"),
    ],
)
def test_the_free_parameters_of_the_body_are_set(free, gravity, factor):
    """Compare estimated body parameters, scaled to the known lever vector or sum of moments."""
    parameters = make_parameters(change(HEAVY, gravity=gravity, damping=0.01), free)
    base, moments = parameters.start, np.array((3.0, 4.0, 5.0))
    lever = np.array((2.0, 0.0, -1.0))
    point = initial_guess._set_free_body_parameters(parameters, moments, lever, ESTIMATES)
    trace = sum(HEAVY.body.moments) / 12.0
    ratio = 9.81 * np.sqrt(COM @ COM) / np.sqrt(5.0) if factor == "lever" else trace
    expected = ratio * moments if "moments" in free else base.moments
    assert np.allclose(point.moments, expected, rtol=1e-13)
    com = ratio * lever / gravity if "com" in free else COM
    assert np.allclose(point.com, com, rtol=1e-13)
    assert np.allclose(point.damping, 0.3 * ratio if "damping" in free else 0.01, rtol=1e-13)
    assert point.friction == pytest.approx(0.7 * ratio if "friction" in free else 0.0)
    losses = ESTIMATES._replace(damping=-1.0, friction=-1.0)
    point = initial_guess._set_free_body_parameters(parameters, moments, lever, losses)
    assert (point.damping == (0.0 if "damping" in free else 0.01)).all() and point.friction == 0.0
    point = initial_guess._set_free_body_parameters(parameters, moments, lever, None)
    assert (point.damping == (0.0 if "damping" in free else 0.01)).all() and point.friction == 0.0


def test_guesses_of_moments_are_physical_and_as_symmetric_as_the_scene():
    lever = np.zeros(3)
    parameters = make_parameters(HEAVY, "moments")
    moments = np.array((1.0, 1.0, 3.0))
    point = initial_guess._set_free_body_parameters(parameters, moments, lever, None)
    densities = np.array((1.5, 1.5, 3e-3))
    expected = densities * sum(HEAVY.body.moments) / 2.0 / densities.sum()
    assert np.allclose(point.densities, expected, rtol=1e-13)
    parameters = make_parameters(SYMMETRIC, "moments")
    moments = np.array((1.0, 2.0, 2.5))
    point = initial_guess._set_free_body_parameters(parameters, moments, lever, None)
    expected = np.array((1.5, 1.5, 2.5)) * sum(SYMMETRIC.body.moments) / 5.5
    assert np.allclose(point.moments, expected, rtol=1e-13)


@pytest.mark.parametrize("order", list(itertools.permutations(range(3))))
@pytest.mark.parametrize("gravity", [2.0, -2.0])
def test_principal_axes_are_ordered_like_the_moments_of_the_scene(order, gravity):
    moments = np.array((1.0, 1.5, 2.0))[list(order)]
    com = np.array((0.3, -0.2, 0.1))
    body = kr.Body(1.0, moments, com=com, unphysical=True)
    base = convert_scene_to_fit_point(kr.Scene(body, (0, 0, 1), gravity=gravity))
    true = rotation_matrix(compute_rotation_quaternions(np.array((0.4, -1.1, 0.8))))
    inertia = true @ np.diag(moments) @ true.T
    found = _LinearBodyEstimates(inertia, gravity * true @ com, np.zeros(3), 0.0, 0.0)
    frame = initial_guess._orient_principal_axes_like_scene(found, base)
    assert np.allclose(frame, true, atol=1e-12)


def test_principal_axes_of_a_body_without_a_centre_of_mass_stay():
    base = convert_scene_to_fit_point(
        kr.Scene(kr.Body(1.0, (1.0, 1.5, 2.0), com=(0, 0, 0)), (0, 0, 1))
    )
    found = ESTIMATES._replace(inertia=np.diag((1.1, 1.2, 1.9)))
    assert (initial_guess._orient_principal_axes_like_scene(found, base) == np.eye(3)).all()


@pytest.mark.parametrize(
    "vertical", [(1, 0, 0), (0, -1, 0), (0, 0, 1), (0.6, 0.0, 0.8), (2, -1, 2)]
)
def test_a_frame_has_the_vertical_as_its_last_row(vertical):
    vertical = np.array(vertical) / np.linalg.norm(vertical)
    frame = initial_guess._build_frame_from_vertical(vertical)
    assert np.allclose(frame @ frame.T, np.eye(3), atol=1e-14)
    assert np.linalg.det(frame) == pytest.approx(1.0) and np.allclose(frame[2], vertical)


def make_symmetric_scene(com=(0.0, 0.0, 0.4), **words):
    moments = (1.0, 1.0, 0.6) if com[2] else (0.6, 1.0, 1.0)
    body = kr.Body(1.0, moments, com=com, rotor=words.pop("rotor", (0, 0, 0)), unphysical=True)
    start = {"attitude": (0.9, 0.3, 0.1, 0.3), "gravity": 9.81}
    velocity = 15.0 * np.array(com) / 0.4 + (0.5, 0.9, 0.4)
    return kr.Scene(body, body_velocity=velocity, **{**start, **words})


@pytest.mark.parametrize(
    ("words", "free"),
    [
        ({}, "start"),
        ({"com": (-0.4, 0.0, 0.0)}, "start"),
        ({"rotor": (0.0, 0.0, 2.0)}, "start"),
        ({"turning": OBLIQUE}, "start"),
        ({"turning": OBLIQUE, "friction": 2.0}, "start"),
        ({"friction": 2.0}, ("start", "friction")),
        ({"shaking": (0.02, 30.0, 0.5)}, "start"),
    ],
)
def test_the_equation_of_the_apex_gives_its_ratios(monkeypatch, words, free):
    """Compare the ratios a = (I3 W3 + h3) / I1, k = M g |c| / I1 and s = f / I1 (here I1 is 1)."""
    found = []
    monkeypatch.setattr(initial_guess, "_guess_from_apex_and_spin", lambda *a: found.append(a[1:]))
    scene = make_symmetric_scene(**words)
    parameters = make_parameters(scene, free)
    base, path = parameters.start, kr.solve(scene, T)
    axis = base.com / 0.4
    initial_guess._guess_parameters_from_apex(parameters, ApexSamples(T, path.apex))
    spin = path.body_velocity[0] @ axis + base.turning @ path.apex[0]
    _, smooth, (a, k, slowing) = found[0]
    assert a == pytest.approx(0.6 * spin + base.rotor @ axis, rel=1e-4)
    assert k == pytest.approx(9.81 * 0.4, rel=1e-3)
    assert slowing == pytest.approx(scene.friction, abs=0.02)
    assert np.allclose(smooth[0], path.apex, atol=1e-4) and len(found) > 1
    assert all(ratios[2] == 0.0 for _, _, ratios in found[1:])


@pytest.mark.parametrize("count, is_enough", [(9, False), (10, True)])
def test_a_trace_needs_more_samples_than_its_smoothing(count, is_enough):
    trace = ApexSamples(T[:count], kr.solve(SYMMETRIC, T[:count]).apex)
    guesses = initial_guess._guess_parameters_from_apex(make_parameters(SYMMETRIC, "start"), trace)
    assert bool(guesses) == is_enough


@pytest.mark.parametrize("power", [0, 1, 2, 3])
def test_smoothing_keeps_local_cubics(power):
    t = 3.0 + 0.25 * np.arange(20)
    coefficients = np.array((0.5, -1.0, 2.0))
    apex = (t[:, None] - 5.0) ** power * coefficients
    derivative = power * (t[:, None] - 5.0) ** max(power - 1, 0) * coefficients
    values, changes = initial_guess._smooth_by_local_cubics(t, apex)
    rows = slice(None) if power < 2 else slice(4, -4)
    assert np.allclose(values[rows], apex[rows], atol=1e-11)
    assert np.allclose(changes[rows], derivative[rows], atol=1e-11)
    first, last = values[0], values[-1]  # the reflections keep the ends
    assert np.allclose(first, apex[0], atol=1e-11) and np.allclose(last, apex[-1], atol=1e-11)


def test_smoothing_fits_a_cubic_to_nine_samples():
    t, apex = 0.25 * np.arange(20), np.random.default_rng(0).normal(size=(20, 3))
    values, changes = initial_guess._smooth_by_local_cubics(t, apex)
    for row in range(4, 16):
        window = slice(row - 4, row + 5)
        cubic = np.polyfit(t[window] - t[row], apex[window], 3)
        assert np.allclose(values[row], cubic[3]) and np.allclose(changes[row], cubic[2])


@pytest.mark.parametrize("precession, mean", [(0.05, 0.4), (-0.03, -0.2)])
def test_frequencies_of_the_nutation_give_spin_and_torque(precession, mean):
    """Compare with analytic results for a motion of the apex with two known frequencies."""
    n, pace = 400, 0.5
    rows, turning = np.arange(n), 0.02
    lines = [2.0 * np.pi * m / n for m in (60, 110)]
    height = mean + 0.02 * np.cos(lines[0] * rows) + 0.007 * np.cos(lines[1] * rows)
    height += 0.015 * np.cos(np.pi * rows / n + 0.2)  # a trend
    height += mean - height.mean()
    angle = precession * rows
    level = np.sqrt(1.0 - height**2)
    apex = np.stack((level * np.sin(angle), -level * np.cos(angle), height), axis=-1)
    trace = ApexSamples(7.0 + pace * rows, apex)
    rate = initial_guess._estimate_mean_precession_rate(trace)
    assert rate == pytest.approx(precession / pace, rel=1e-10)
    pairs = initial_guess._estimate_spin_and_torque_ratios(trace, turning)
    expected, w = [], precession / pace + turning
    for line in lines:
        root = np.sqrt((line / pace) ** 2 - w**2 * (1.0 - mean**2))
        for a in (2.0 * w * mean + root, 2.0 * w * mean - root):
            expected.append((a, a * w - w**2 * mean))
    assert len(pairs) == 6 and np.allclose(pairs[:4], expected, rtol=1e-9)


def test_a_nutation_slower_than_the_precession_has_one_spin():
    rows = np.arange(400)
    height = 0.1 * np.cos(0.3 * rows)
    level = np.sqrt(1.0 - height**2)
    apex = np.stack((level * np.sin(rows), -level * np.cos(rows), height), axis=-1)
    trace = ApexSamples(1.0 * rows, apex)
    one, other = initial_guess._estimate_spin_and_torque_ratios(trace, 0.0)[:2]
    assert one == other


@pytest.mark.parametrize(
    ("words", "free", "ratios"),
    [
        ({}, "start", (9.0, 3.9, 0.0)),
        ({"com": (-0.4, 0.0, 0.0)}, ("start", "moments"), (9.0, 3.0, 0.0)),
        ({}, ("start", "moments"), (9.0, 30.0, 0.0)),
        ({}, ("start", "moments"), (9.0, -3.0, 0.0)),
        ({"turning": OBLIQUE, "rotor": (0.0, 0.0, 2.0)}, "start", (-9.0, 3.9, 0.0)),
        ({"friction": 0.4}, "start", (9.0, 3.9, 0.3)),
        ({}, ("start", "friction"), (9.0, 3.9, 20.0)),
        ({}, ("start", "friction"), (-9.0, 3.9, -20.0)),
        ({}, ("start", "friction"), (-9.0, 3.9, 0.3)),
    ],
)
def test_the_motion_of_the_apex_and_a_spin_make_a_guess(words, free, ratios):
    scene = make_symmetric_scene(**words)
    parameters = make_parameters(scene, free)
    a, k, slowing = ratios
    base, t = parameters.start, 1.5 + np.linspace(0.0, 1.0, 30)
    axis = base.com / 0.4
    path = kr.solve(scene, t)
    change = np.random.default_rng(0).normal(size=(30, 3))
    change -= (change * path.apex).sum(axis=1)[:, None] * path.apex
    trace = ApexSamples(t, path.apex)
    guess = initial_guess._guess_from_apex_and_spin(
        parameters, trace, (1.001 * path.apex, change), ratios
    )
    i1, i3 = 1.0, 0.6
    if "moments" in free and k > 0.0:
        i1 = 9.81 * 0.4 / k
        i3 = min(0.6, 1.9 * i1)
    expected = i1 + (i3 - i1) * np.abs(axis)
    assert np.allclose(guess.point.moments, expected, rtol=1e-12)
    spin = (a * i1 - base.rotor @ axis) / i3 - 1.001 * base.turning @ path.apex[0]
    friction = max(i1 * slowing * np.sign(spin), 0.0) if "friction" in free else scene.friction
    assert guess.point.friction == pytest.approx(friction, rel=1e-12)
    motion, space = guess.motion, rotation_matrix(guess.motion.attitude)
    assert motion.source == "apex" and (motion.t == t).all()
    assert np.allclose(space @ axis, path.apex, atol=1e-12)
    spins = np.sign(spin) * np.maximum(np.abs(spin) - friction / i3 * (t - 1.5), 0.0)
    velocity = 1.001 * (np.cross(path.apex, change) + spins[:, None] * path.apex)
    assert np.allclose(np.einsum("nij,nj->ni", space, motion.rate), velocity, atol=1e-11)
    first = kr.solve(guess.point.to_scene(), t[:1])
    assert np.allclose(rotation_matrix(first.q[0]), space[0], atol=1e-8)
    assert np.allclose(first.body_velocity[0], motion.rate[0], atol=1e-7)
