"""Tests of the results of fits: errors of functions, bounds, paths, residuals and texts."""

from dataclasses import replace

import kreisel as kr
import numpy as np
import pytest
from fits import HEAVY, SIGMA, SYMMETRIC, gyroscope
from kreisel._fit import fit_result
from kreisel._fit.parameters import FreeParameters, expand_free_names
from kreisel._fit.residuals import ResidualModel

T = np.linspace(0.0, 2.0, 60)


@pytest.fixture(scope="module")
def fit():
    path = kr.solve(HEAVY.replace(damping=0.05), T)
    values = {"body_velocity": path.body_velocity.copy(), "spin": path.spin}
    values["body_velocity"][3:5, 1] = np.nan
    sigma = {"body_velocity": SIGMA, "spin": np.linspace(0.1, 0.2, 60)}
    record = kr.Record(T, values, sigma, free="delay")
    return kr.fit(HEAVY.replace(damping=0.04), record, ("velocity", "moments", "damping"))


def test_errors_of_single_parameters_are_their_errors(fit):
    for function, name in (
        (lambda scene: scene.body.moments[1], "I2"),
        (lambda scene: scene.damping[0], "damping_1 = damping_2 = damping_3"),
    ):
        value, error = fit.error_of(function)
        assert value == pytest.approx(fit.values[name]) and type(value) is float
        assert error == pytest.approx(fit.error[name], rel=1e-6)
    values, errors = fit.error_of(lambda scene: np.outer(scene.body.moments, (1.0, -2.0)))
    assert values.shape == errors.shape == (3, 2)
    assert errors[:, 1] == pytest.approx(2.0 * errors[:, 0])


def test_steps_of_derivatives_are_small_against_the_natural_sizes(fit):
    """Check sin(2000 d) for a damping d: its derivative needs steps far smaller than 1 / 2000."""
    name = "damping_1 = damping_2 = damping_3"
    _, error = fit.error_of(lambda scene: np.sin(2000.0 * scene.damping[0]))
    slope = 2000.0 * abs(np.cos(2000.0 * fit.values[name]))
    assert error == pytest.approx(slope * fit.error[name], rel=1e-4)


def test_errors_of_moment_ratios_are_those_of_the_ratios(fit):
    assert list(fit.moment_ratios) == ["I1 / I3", "I2 / I3"]
    for k, (ratio, error) in enumerate(fit.moment_ratios.values()):
        value, other = fit.error_of(
            lambda scene, k=k: scene.body.moments[k] / scene.body.moments[2]
        )
        assert ratio == pytest.approx(value) and error == pytest.approx(other, rel=1e-6)
    assert kr.fit(HEAVY, gyroscope(n=20), "velocity").moment_ratios == {}


@pytest.mark.parametrize("distance", [0.0, 0.3, 1.0, 5.0])
def test_errors_near_a_bound_use_a_shorter_step(fit, distance):
    """Check that a backward step to a parameter bound differentiates a linear function exactly."""
    k = list(fit.names).index("damping_1 = damping_2 = damping_3")
    step = fit_result._DIFFERENCE * fit._spectrum.natural[k]
    point = replace(fit._point, damping=np.full(3, distance * step))
    near = replace(fit, _point=point, scene=fit._parameters.to_scene(point))
    assert near._compute_distance_to_lower_bound(k) == pytest.approx(distance * step, abs=0.0)
    value, error = near.error_of(lambda scene: 3.0 * scene.damping[0])
    assert value == pytest.approx(3.0 * distance * step)
    assert error == pytest.approx(3.0 * fit.error[fit.names[k]], rel=1e-6)


def test_the_path_of_a_fit_has_the_times_of_the_instruments(fit):
    delay = fit.values["delay[0]"]
    path = replace(fit).path
    assert abs(delay) < 1e-3 and path.t == pytest.approx(T - delay, abs=1e-15)
    records = [gyroscope(n=30), gyroscope(n=40, end=2.0)]
    other = kr.fit(HEAVY, records, "velocity").path
    times = np.unique(np.concatenate([record.t for record in records]))
    assert other.t.tolist() == times.tolist()


def test_residuals_and_sigmas_have_the_shapes_of_the_records(fit):
    residuals, sigma = fit.residuals[0], fit.sigma[0]
    assert residuals["body_velocity"].shape == (60, 3) and residuals["spin"].shape == (60,)
    is_missing = np.isnan(residuals["body_velocity"])
    assert is_missing[3:5, 1].all() and is_missing.sum() == 2
    assert sigma["body_velocity"] == SIGMA
    assert sigma["spin"][:, 0].tolist() == np.linspace(0.1, 0.2, 60).tolist()


def test_charts_show_the_values_in_the_units_of_the_user():
    values = np.degrees(kr.solve(HEAVY, T).nutation)
    record = kr.Record(T, {"nutation": values}, 0.5, degrees=True)
    found = kr.fit(HEAVY, record, "velocity")
    [chart] = fit_result._yield_series_chart_data(found)
    assert chart.name == "nutation" and chart.t.tolist() == T.tolist()
    assert chart.values[:, 0] == pytest.approx(values) and chart.residuals.shape == (60, 1)
    assert chart.sigma == pytest.approx(0.5) and chart.sigma.shape == ()


def make_point(scene, free, **words):
    parameters = FreeParameters(scene, expand_free_names(free), [])
    return parameters, replace(parameters.start, **words)


@pytest.mark.parametrize(
    "body, words, sentences",
    [
        (
            HEAVY,
            {"densities": (0.0, 0.4, 0.6)},
            ["I1 = I2 + I3: the body is a plate normal to axis 1"],
        ),
        (HEAVY, {"densities": (0.4, 0.9e-6, 0.6)}, ["I2 = I1 + I3: the body is a plate normal"]),
        (HEAVY, {"densities": (0.4, 1.1e-6, 0.6)}, []),
        (HEAVY, {"densities": (0.4, 1e-6, 0.6)}, ["I2 = I1 + I3: the body is a plate normal"]),
        (HEAVY, {"densities": (0.4, 0.4, 0.0)}, ["I3 = I1 + I2: the body is a plate normal to ax"]),
        (SYMMETRIC, {"densities": (0.0, 0.0, 0.6)}, ["the body is a rod: one moment is zero"]),
        (HEAVY, {"friction": 0.0}, ["friction is zero: negative friction is excluded"]),
        (
            SYMMETRIC,
            {"damping": (0.1, 0.1, 0.0)},
            ["damping_3 is zero: negative damping is exclud"],
        ),
        (
            SYMMETRIC,
            {"damping": (0.0, 0.0, 0.2)},
            ["damping_1 = damping_2 is zero: negative damping is excluded"],
        ),
        (SYMMETRIC, {}, []),
    ],
)
def test_parameters_at_bounds_are_named(body, words, sentences):
    scene = body.replace(damping=(0.2, 0.2, 0.3), friction=0.1)
    parameters, point = make_point(
        scene,
        ("velocity", "moments", "damping", "friction"),
        **{name: np.array(value) if name != "friction" else value for name, value in words.items()},
    )
    found = fit_result._describe_reached_bounds(parameters, point, np.ones(parameters.size))
    assert len(found) == len(sentences)
    for text, beginning in zip(found, sentences, strict=True):
        assert text.startswith(beginning)
    fixed, point = make_point(scene, ("velocity",), damping=np.zeros(3), friction=0.0)
    assert fit_result._describe_reached_bounds(fixed, point, np.ones(3)) == ()


def test_a_fit_is_described_in_one_line(fit):
    assert repr(replace(fit, chi2=50.0, dof=20, evaluations=9, unidentified=())) == (
        f"<kreisel.Fit: {len(fit.names)} parameters, chi2 2.5 per degree of freedom, 9 paths>"
    )
    other = repr(replace(fit, unidentified=("a", "b"), has_converged=False))
    assert "parameters, 2 unidentified, chi2" in other and other.endswith(" paths, not converged>")


def test_the_summary_is_a_comment_in_the_file(fit):
    lines = fit.to_toml().splitlines()
    text = str(fit).splitlines()
    assert lines[: len(text)] == [f"# {line}".rstrip() for line in text]
    assert fit._repr_html_().count("<p>") == 3 == len(text) - len(fit.names)


def test_nonlinearity_is_measured_for_single_motions_and_the_linear_loss():
    record = gyroscope(n=40, end=1.0)
    assert kr.fit(HEAVY, record, ("start", "gravity")).nonlinearity > 0.0
    assert kr.fit(HEAVY, record, ("start", "gravity"), loss="soft").nonlinearity == 0.0
    assert kr.fit(HEAVY, record, ("start", "gravity"), pieces=2).nonlinearity == 0.0


def test_scattered_scenes_follow_the_seed(fit):
    tops = fit.scatter(3, seed=0)
    assert tops.shape == (3,) and fit.scatter(3)[1] == tops[1] != fit.scatter(3, seed=1)[1]
    assert fit.scatter(1).shape == (1,)
    with pytest.raises(ValueError, match="n must be at least 1"):
        fit.scatter(0)
    with pytest.raises(ValueError, match="seed must be at least 0"):
        fit.scatter(1, seed=-1)


def test_sigmas_are_unknown_where_nothing_was_measured():
    nutation = np.degrees(kr.solve(HEAVY, T).nutation)
    nutation[4] = np.nan
    values = {"nutation": nutation, "energy": np.full(60, np.nan)}
    for given in (0.5, np.linspace(0.5, 0.6, 60)):
        record = kr.Record(T, values, given, degrees=True)
        [sigma] = kr.fit(HEAVY, record, "velocity").sigma
        expected = np.where(np.isnan(nutation), np.nan, given)
        if np.ndim(given):
            assert np.allclose(sigma["nutation"][:, 0], expected, equal_nan=True)
        else:
            assert sigma["nutation"] == pytest.approx(0.5) and np.ndim(sigma["nutation"]) == 0
        assert np.isnan(sigma["energy"]).all() and sigma["energy"].shape == (60, 1)


@pytest.mark.parametrize("sigma", [0.5, None])
def test_evaluations_count_the_computed_motions(monkeypatch, sigma):
    count = 0
    compute = ResidualModel._solve_both_time_directions

    def compute_and_count(*arguments):
        nonlocal count
        count += 1
        return compute(*arguments)

    monkeypatch.setattr(ResidualModel, "_solve_both_time_directions", compute_and_count)
    record = kr.Record(T, {"spin": kr.solve(HEAVY, T).spin + 0.1 * np.sin(40.0 * T)}, sigma)
    assert kr.fit(HEAVY.replace(gravity=9.0), record, ("velocity", "gravity")).evaluations == count
