"""Tests of the derivatives of fit residuals against finite differences."""

from dataclasses import replace

import kreisel as kr
import numpy as np
import pytest
from kreisel._fit.measurable import MEASURABLE, SEEN_FROM_BODY
from kreisel._fit.parameters import FreeParameters, expand_free_names
from kreisel._fit.residuals import ResidualModel
from kreisel._fit.rotations import compute_rotation_vectors

TIMES = np.linspace(-1.0, 3.0, 9)
TURN = np.array((0.8, -0.3, 0.4, 0.2)) / np.linalg.norm((0.8, -0.3, 0.4, 0.2))
PLACE = (0.4, -0.7, 0.5)
ALL = ("start", "moments", "com", "gravity", "mass", "damping", "axes")
DESCRIPTIONS = {
    "principal axes": lambda body: body,
    "turned": lambda body: body.turn(TURN),
}


ENVIRONMENTS = {
    "turning": {"turning": (0.3, -0.2, 0.5)},
    "shaking": {"shaking": (0.05, 7.0, 0.4)},
    "friction": {"friction": 0.13},
}
EVERYTHING = ENVIRONMENTS["turning"] | ENVIRONMENTS["shaking"] | ENVIRONMENTS["friction"]
JUMPING = ("body_acceleration", "specific_force")  # friction jumps at a stop


def make_scene(description, **words):
    body = kr.Body(1.1, (1.0, 1.3, 0.7), com=(0.1, -0.2, 0.3), unphysical=True)
    return kr.Scene(
        DESCRIPTIONS[description](body),
        attitude=TURN[[1, 0, 3, 2]],
        body_velocity=(1.0, 0.7, -0.5),
        gravity=1.3,
        damping=(0.1, 0.15, 0.2),
        **words,
    )


def measure(name, path):
    if name == "specific_force":
        return path.specific_force(PLACE)
    return np.array(getattr(path, name))


def make_record(name, t, values, sigma, **words):
    place = {"point": PLACE} if name == "specific_force" else {}
    return kr.Record(t, {name: values}, sigma, **words, **place)


def make_model(name, scene, free):
    """Return a fit model for the measured quantity `name`, and values of its free parameters."""
    rng = np.random.default_rng(3)
    values = measure(name, kr.solve(scene, TIMES[TIMES >= 0.0]))
    values = np.concatenate((values[1:5][::-1], values))[: len(TIMES)]
    if name != "q":
        values = values + 0.05 * rng.normal(size=values.shape)
    instrument = ["delay"] if name == "q" else ["bias", "scale", "delay"]
    instrument += ["mounting"] if name == "q" or name in SEEN_FROM_BODY else []
    record = make_record(name, TIMES, values, 0.3, free=instrument)
    parameters = FreeParameters(scene, expand_free_names(free), [record])
    model = ResidualModel(parameters, [record], [record.series[0].sigma])
    natural = np.minimum(model.estimate_parameter_scales(parameters.start), 1.0)
    return model, model.add_step_within_bounds(
        parameters.start, 0.03 * natural * rng.normal(size=parameters.size)
    )


@pytest.mark.parametrize(
    "name, free, description",
    [
        *((name, ALL, "principal axes") for name in MEASURABLE),
        *(
            (name, ALL, "turned")
            for name in ("q", "body_velocity", "specific_force", "frame", "spin_angle")
        ),
        *((name, (*ALL[:-1], "rotor"), "turned") for name in MEASURABLE),
        *((name, ("lever",), "turned") for name in ("apex", "potential", "spin", "spin_angle")),
    ],
)
def test_derivatives_agree_with_differences(name, free, description):
    check_jacobian(*make_model(name, make_scene(description), free))


@pytest.mark.parametrize(
    "name, words",
    [
        *((name, "turning shaking") for name in JUMPING),
        *((name, "turning shaking friction") for name in MEASURABLE if name not in JUMPING),
        *(("q", word) for word in ENVIRONMENTS),
    ],
)
def test_derivatives_on_moving_supports_and_with_friction(name, words):
    environment = {word: EVERYTHING[word] for word in words.split()}
    free = (*ALL[:-1], "rotor", *environment)
    check_jacobian(*make_model(name, make_scene("turned", **environment), free))


def check_jacobian(model, point):
    jacobian = model.evaluate_residuals(point).jacobian * model.estimate_parameter_scales(point)
    assert np.isfinite(jacobian).all() and np.abs(jacobian).max() > 0.1
    for k in range(jacobian.shape[1]):
        step = np.zeros(jacobian.shape[1])
        step[k] = 1e-4 * model.estimate_parameter_scales(point)[k]
        residuals = {
            i: model.evaluate_residuals(
                model.add_step_within_bounds(point, i * step), has_jacobian=False
            ).residuals
            for i in (-2, -1, 1, 2)
        }
        difference = (8.0 * (residuals[1] - residuals[-1]) - (residuals[2] - residuals[-2])) / 12e-4
        assert np.abs(difference - jacobian[:, k]).max() < 1e-7 * np.abs(jacobian).max()


@pytest.mark.parametrize("words", [{}, EVERYTHING], ids=["plain", "moving"])
@pytest.mark.parametrize("description", DESCRIPTIONS)
@pytest.mark.parametrize("name", MEASURABLE)
def test_model_values_equal_those_of_a_path(name, description, words):
    own = {} if name in JUMPING else words
    scene = make_scene(description, **own)
    path = kr.solve(scene, np.linspace(0.0, 3.0, 9))
    record = make_record(name, path.t, measure(name, path), 1.0)
    parameters = FreeParameters(scene, ("attitude",), [record])
    model = ResidualModel(parameters, [record], [record.series[0].sigma])
    assert np.abs(model.evaluate_residuals(parameters.start).residuals).max() < 1e-13


def test_derivatives_of_the_parameters_shown_to_users_are_right():
    scene = make_scene("turned")
    record = make_record("apex", TIMES, np.zeros((len(TIMES), 3)), 1.0)
    parameters = FreeParameters(scene, expand_free_names(ALL), [record])
    names, _, values, jacobian = parameters.list_user_parameters_and_jacobian(parameters.start)
    assert values[names.index("axes_x") :] == pytest.approx(
        compute_rotation_vectors(np.array(scene.body.axes)), abs=1e-12
    )
    rows = [k for k, name in enumerate(names) if not name.startswith(("attitude", "axes"))]
    for k in range(parameters.size):
        step = 1e-5 * (np.arange(parameters.size) == k)
        ends = [
            parameters.add_step_within_bounds(parameters.start, sign * step) for sign in (1.0, -1.0)
        ]
        there = [parameters.list_user_parameters_and_jacobian(end)[2] for end in ends]
        assert np.allclose(((there[0] - there[1]) / 2e-5)[rows], jacobian[rows, k], atol=1e-8)


@pytest.mark.parametrize("name", ["spin", "kinetic", "energy"])
def test_derivatives_without_a_lever_are_finite(name):
    scene = make_scene("principal axes")
    body = kr.Body(1.0, scene.body.moments, com=(0.0, 0.0, 0.0))
    model, point = make_model(name, scene.replace(body=body), ("start", "moments"))
    assert np.isfinite(model.evaluate_residuals(point).jacobian).all()


def test_derivatives_at_a_pole_are_finite():
    record = kr.Record([0.0, 0.1], {"nutation": [0.0, 0.1], "precession_angle": [0.0, 0.1]}, 0.1)
    parameters = FreeParameters(kr.scenes.sleeping, ("attitude", "velocity"), [record])
    sigmas = [series.sigma for series in record.series]
    model = ResidualModel(parameters, [record], sigmas)
    assert np.isfinite(model.evaluate_residuals(parameters.start).jacobian).all()


@pytest.mark.parametrize("name", ["q", "body_velocity", "spin_angle", "frame"])
def test_derivatives_by_axes_are_right_where_they_are_principal(name):
    model, _ = make_model(name, make_scene("principal axes"), ("attitude", "com", "axes"))
    check_jacobian(model, model.parameters.start)


@pytest.mark.parametrize(
    "t, end, span",
    [
        ([1.0, 4.0], None, 4.0),
        ([-1.0, 4.0], None, 5.0),
        ([-3.0, -2.0], None, 3.0),
        ([1.0, 4.0], 6.0, 6.0),
        ([0.0], None, 1e-300),
    ],
)
def test_the_span_reaches_from_the_start_to_all_times(t, end, span):
    record = kr.Record(t, {"spin": np.ones(len(t))}, 0.1)
    parameters = FreeParameters(make_scene("turned"), ("velocity",), [record])
    assert ResidualModel(parameters, [record], [record.series[0].sigma], end).span == span


def test_a_motion_that_cannot_be_computed_has_infinite_residuals():
    model, point = make_model("apex", make_scene("turned"), ("start",))
    found = model.evaluate_residuals(replace(point, mass=np.nan))
    assert np.isinf(found.residuals).all() and found.residuals.shape == (27,)
    assert found.jacobian.shape == (27, model.parameters.size) and not found.jacobian.any()


def test_rows_of_residuals_follow_the_series():
    """Check that missing measurements have the residual 0, and that times may repeat."""
    scene = make_scene("turned")
    path = kr.solve(scene, [0.0, 1.0, 2.0])
    spin = np.add(path.spin, (0.1, np.nan, -0.3))
    records = [
        kr.Record(path.t, {"spin": spin, "apex_y": path.apex[:, 1] + 0.2}, 0.1),
        kr.Record([1.0, 1.0], {"apex": path.apex[[1, 1]] - 0.1}, 0.5),
    ]
    sigmas = [series.sigma for record in records for series in record.series]
    parameters = FreeParameters(scene, ("velocity",), records)
    model = ResidualModel(parameters, records, sigmas)
    assert [(rows.record, rows.begin, rows.shape) for rows in model.rows] == [
        *((0, 0, (3, 1)), (0, 3, (3, 1)), (1, 6, (2, 3))),
    ]
    assert model.size == 12 and model.measured.tolist() == [True, False, *[True] * 10]
    found = model.evaluate_residuals(parameters.start).residuals
    assert found == pytest.approx([-1.0, 0.0, 3.0, *[-2.0] * 3, *[0.2] * 6])


@pytest.mark.parametrize("lean, is_at_pole", [(0.5e-9, True), (2e-9, False)])
def test_angles_at_a_pole_have_no_derivative(lean, is_at_pole):
    q = (np.cos(0.5 * lean), np.sin(0.5 * lean), 0.0, 0.0)
    scene = kr.scenes.sleeping.replace(attitude=q)
    record = kr.Record([0.0], {"precession_angle": [0.1]}, 0.1)
    parameters = FreeParameters(scene, ("attitude",), [record])
    model = ResidualModel(parameters, [record], [record.series[0].sigma])
    jacobian = model.evaluate_residuals(parameters.start).jacobian
    assert np.isfinite(jacobian).all() and jacobian.any() != is_at_pole
