"""Tests of the covariances of fits, of the statistics of residuals, and of estimated noise."""

from types import SimpleNamespace

import kreisel as kr
import numpy as np
import pytest
from kreisel._fit import noise, uncertainty
from kreisel._fit.residuals import assign_residual_rows
from kreisel._fit.rotations import multiply_quaternions
from kreisel._fit.uncertainty import FitCovariance

T = np.arange(40.0)
SIX = np.sqrt(6.0)


def make_model(values, parameters=0, sigma=None):
    """Return an object with those attributes of a residual model that the noise estimate uses."""
    first = next(iter(values.values()))
    record = kr.Record(T[: len(first)], values, sigma)
    sigmas = noise.estimate_initial_sigmas((record,))
    rows = assign_residual_rows([record], sigmas)
    measured = np.concatenate([one.measured_mask.ravel() for one in rows])
    return SimpleNamespace(
        rows=rows, measured=measured, parameters=SimpleNamespace(size=parameters)
    )


def compute_statistics(residuals, parameters=2, loss="linear", is_sigma_known=True):
    residuals = np.array(residuals)
    model = make_model({"spin": np.ones(len(residuals))}, parameters, 0.1)
    return uncertainty.compute_residual_statistics(model, residuals, loss, is_sigma_known)


EXPECTED = [2.0, 1.0, -2.0, 0.0, 2.0, -1.0, 1.0, -2.0, 0.0, 1.0]  # chi2 is 20


@pytest.mark.parametrize(
    "residuals, is_sigma_known, inflation",
    [
        # With 8 degrees of freedom, chance explains chi2 / dof up to 1 + 3 sqrt(2 / 8) = 2.5.
        (EXPECTED, True, 1.0),
        ([*EXPECTED[:3], 0.1, *EXPECTED[4:]], True, np.sqrt(20.01 / 8.0)),
        (EXPECTED, False, np.sqrt(2.5)),
        (np.multiply(0.1, EXPECTED), False, 0.1 * np.sqrt(2.5)),
    ],
)
def test_errors_grow_if_residuals_exceed_chance(residuals, is_sigma_known, inflation):
    found = compute_statistics(residuals, is_sigma_known=is_sigma_known)
    assert found.dof == 8 and found.chi2 == pytest.approx(np.dot(residuals, residuals))
    assert found.variance == pytest.approx(found.chi2 / 8.0)
    assert found.inflation == pytest.approx(inflation)
    assert compute_statistics(residuals, parameters=12).dof == 1


def test_the_soft_loss_weights_large_residuals_less():
    residuals = np.array((0.5, -1.0, 3.0, -2.0, 3.5, 0.0, -7.0, 1.0))
    found = compute_statistics(residuals, loss="soft")
    assert found.chi2 == pytest.approx(0.25 + 1.0 + 9.0 + 4.0 + 1.0)
    square = (residuals**2 / (1.0 + residuals**2)).sum()
    slope = np.mean(1.0 / np.sqrt(1.0 + residuals**2) ** 3)
    assert found.dof == 6 and found.variance == pytest.approx(square / 6.0 / slope**2)
    assert found.inflation == pytest.approx(np.sqrt(found.variance))
    small = compute_statistics(0.1 * residuals, loss="soft")
    assert small.variance < 1.0 and small.inflation == 1.0
    # Residuals of equal size c have the variance c^2 (1 + c^2)^2, here 1.37.
    above = compute_statistics(np.tile((0.75, -0.75), 4), loss="soft", parameters=0)
    assert above.inflation == pytest.approx(0.75 * 1.5625)


@pytest.mark.parametrize(
    "correlation, factor",
    [
        (0.5, 1.0),  # 3 / sqrt(36): not beyond chance
        (0.51, 1.51 / 0.49),
        (0.95, 1.95 / 0.05),
        (0.99, 1.99 * 36.0),  # 1 / (1 - correlation) is limited to the number of residuals
        (-0.9, 1.0),
    ],
)
def test_correlations_beyond_chance_enlarge_the_errors(monkeypatch, correlation, factor):
    monkeypatch.setattr(
        uncertainty, "_correlate_neighbouring_residuals", lambda rows, residuals: correlation
    )
    found = compute_statistics(np.tile((2.0, -2.0), 18), parameters=4, is_sigma_known=False)
    assert found.variance == 144.0 / 32.0 and found.correlation == correlation
    assert found.inflation == pytest.approx(np.sqrt(144.0 / 32.0 * factor))


def correlate(column):
    centred = column - column.mean()
    return sum(a * b for a, b in zip(centred[1:], centred, strict=False)) / (centred @ centred)


def test_correlations_are_means_over_columns_of_enough_residuals():
    rng = np.random.default_rng(2)
    values = np.ones((8, 3))
    values[6:, 1] = values[5:, 2] = np.nan  # 8, 6 and 5 residuals
    model = make_model({"apex": values}, sigma=0.1)
    residuals = rng.normal(size=(8, 3))
    residuals[2, 0], residuals[4, 1] = 5.0, -7.0
    limited = np.clip(residuals, -3.0, 3.0)
    expected = (correlate(limited[:, 0]) + correlate(limited[:6, 1])) / 2.0
    found = uncertainty._correlate_neighbouring_residuals(model.rows, residuals.ravel())
    assert found == pytest.approx(expected)


def test_directions_are_determined_if_one_sigma_is_less_than_their_natural_size():
    jacobian, natural = np.diag((8.0, 1.0, 0.25)), np.array((0.5, 2.0, 2.0))
    found = uncertainty.classify_fit_directions(jacobian, natural, 1.5, 3)
    assert np.abs(found.factor) == pytest.approx(np.diag((0.375, 0.75, 0.0))[:, :2])
    assert np.abs(found.blind) == pytest.approx(np.array([[0.0], [0.0], [1.0]]))
    assert uncertainty.classify_fit_directions(jacobian, natural, 2.0, 3).blind.shape == (3, 2)
    assert uncertainty.classify_fit_directions(jacobian, natural, 1.99, 3).blind.shape == (3, 1)
    assert found.natural.tolist() == natural.tolist()


@pytest.mark.parametrize("small, count", [(2.0, 0), (0.5, 1)])
def test_singular_values_below_the_rounding_error_count_as_zero(small, count):
    jacobian = np.diag((1e9, small))
    found = uncertainty.classify_fit_directions(jacobian, np.ones(2), 0.1, 2)
    assert found.blind.shape == (2, count)


@pytest.mark.parametrize("part, count", [(0.9e-3, 0), (1.1e-3, 1)])
def test_blind_changes_of_further_columns_need_a_part_in_the_parameters(part, count):
    """Check a Jacobian matrix whose null space contains the direction (part, 0, 1)."""
    jacobian = 1e3 * np.array(((1.0, 0.0, -part), (0.0, 1.0, 0.0)))
    found = uncertainty.classify_fit_directions(jacobian, np.ones(3), 1.0, 2)
    assert found.blind.shape == (2, count) and found.factor.shape == (2, 2)
    assert np.abs(found.blind) == pytest.approx(np.array([[1.0], [0.0]])[:, :count])


def make_covariance(natural, factor, weak=None, hidden=None):
    none = np.zeros((len(natural), 0))
    weak, hidden = (none if part is None else np.array(part) for part in (weak, hidden))
    blind = np.column_stack((weak, hidden))
    return FitCovariance(np.array(natural), np.array(factor), blind, weak, hidden)


def test_errors_are_propagated_by_gradients():
    natural = np.array((2.0, 0.5, 1.0, 4.0))
    factor = np.array(((0.1, 0.02), (0.0, 0.3), (0.0, 0.0), (0.0, 0.0)))
    weak, hidden = [[0.0], [0.0], [1.5], [0.0]], [[0.0], [0.0], [0.0], [1.0]]
    covariance = make_covariance(natural, factor, weak, hidden)
    gradient = np.array(
        ((1.0, 2.0, 0.0, 0.0), (0.0, 1.0, 0.02, 0.01), (0.0, 1.0, 0.04, 0.0), (0.0, 1.0, 0.0, 0.02))
    )
    found, errors = covariance.propagate_errors(gradient)
    rows = gradient[:2] * natural
    expected = rows @ (factor @ factor.T + np.diag((0.0, 0.0, 1.5**2, 1.0))) @ rows.T
    assert found[:2, :2] == pytest.approx(expected)
    assert errors[:2] == pytest.approx(np.sqrt(np.diag(expected)))
    assert np.isinf(errors[2:]).all() and np.isinf(found[[2, 3], [2, 3]]).all()
    assert np.isnan(found[2, [0, 1, 3]]).all() and np.isnan(found[[0, 1, 3], 2]).all()
    assert covariance.propagate_errors(np.zeros((1, 4)))[1].tolist() == [0.0]
    drawn = covariance.draw_random_parameter_changes(np.random.default_rng(3), 4000)
    scatter = np.diag(natural) @ factor @ factor.T @ np.diag(natural)
    assert np.cov(drawn.T) == pytest.approx(scatter, abs=2e-3)
    assert drawn.shape == (4000, 4) and not drawn[:, 2:].any()


@pytest.mark.parametrize(
    ("own", "weak", "is_lost"),
    [
        (1e-3, 0.0099, False),  # less than a hundredth of the natural size
        (1e-3, 0.0101, True),
        (0.05, 0.049, False),  # less than the error by the determined directions
        (0.05, 0.051, True),
        (0.5, 0.099, False),
        (0.5, 0.101, True),  # more than a tenth of the natural size
    ],
)
def test_errors_by_weak_directions_are_bounded(own, weak, is_lost):
    covariance = make_covariance((3.0, 2.0), ((own,), (0.0,)), ((weak,), (1.0,)))
    [error] = covariance.propagate_errors(np.array(((7.0, 0.0),)))[1]
    assert error == pytest.approx(np.inf if is_lost else 21.0 * np.hypot(own, weak))


@pytest.mark.parametrize(
    ("own", "hidden", "is_lost"),
    [
        (1e-6, 0.99e-4, False),  # rounding errors
        (1e-6, 1.01e-4, True),
        (1e-3, 2.99e-3, False),  # less than three standard deviations
        (1e-3, 3.01e-3, True),
        (0.5, 0.099, False),
        (0.5, 0.101, True),  # more than a tenth of the natural size
    ],
)
def test_errors_by_hidden_directions_are_bounded(own, hidden, is_lost):
    covariance = make_covariance((3.0, 2.0), ((own,), (0.0,)), hidden=((hidden,), (1.0,)))
    [error] = covariance.propagate_errors(np.array(((7.0, 0.0),)))[1]
    assert error == pytest.approx(np.inf if is_lost else 21.0 * np.hypot(own, hidden))


def test_directions_are_weak_or_hidden():
    jacobian = np.diag((1e6, 2.0, 0.5, 0.25, 1e-4))
    found = uncertainty.classify_fit_directions(jacobian, np.ones(5), 1.5, 5)
    assert np.abs(found.factor) == pytest.approx(np.eye(5)[:, :2] * (1.5e-6, 0.75))
    assert np.abs(found.weak) == pytest.approx(np.eye(5)[:, 2:4] * (3.0, 6.0))
    assert np.abs(found.hidden) == pytest.approx(np.eye(5)[:, 4:])
    assert found.blind @ found.blind.T == pytest.approx(np.diag((0.0, 0.0, 1.0, 1.0, 1.0)))


def test_a_gyroscope_with_an_unknown_bias_does_not_determine_the_spin():
    """Check that the search does not follow the noise along the sum of spin and bias."""
    scene, t = kr.scenes.asymmetric_regular, np.linspace(0.0, 6.0, 150)
    noise = 0.02 * np.random.default_rng(1018).normal(size=(150, 3))
    values = kr.solve(scene, t).body_velocity + noise + (0.1, -0.2, 0.05)
    found = kr.fit(scene, kr.Record(t, {"body_velocity": values}, 0.02, free="bias"))
    assert found.has_converged and found.chi2 < 1.1 * found.dof
    bias = "bias[0].body_velocity_"
    names = ("body_velocity_z", bias + "z", "I1", "I2", "I3")
    assert all(np.isinf(found.error[name]) for name in names)
    assert all(np.isinf(error) for _, error in found.moment_ratios.values())
    assert abs(found.values[bias + "z"]) < 0.232  # the spread of the values, its natural size
    assert abs(found.values["I3"] - 1.28) < 0.4
    for name, value in {bias + "x": 0.1, bias + "y": -0.2}.items():
        assert abs(found.values[name] - value) < 4.0 * found.error[name] < 0.01
    heading, combination = found.unidentified
    assert "the heading" in heading and f"{bias}z" in combination
    assert " I1 " in combination and " I2" in combination and "I3" not in combination


class Parabola:
    """A model with the two residuals x + curvature x^2 and y, whose parameter x is bounded."""

    def __init__(self, curvature, distance=np.inf, most=np.inf):
        self.curvature, self.distance, self.most = curvature, distance, most

    def compute_distances_to_lower_bounds(self, point):
        return np.array((self.distance, np.inf))

    def add_step_within_bounds(self, point, step):
        return point + step

    def evaluate_residuals(self, point, has_jacobian=True):
        assert not has_jacobian
        x, y = point
        residuals = np.array((x + self.curvature * x**2, y)) if x < self.most else [np.inf, y]
        return SimpleNamespace(residuals=np.array(residuals))


@pytest.mark.parametrize(
    "curvature, distance, most, expected",
    [
        # (x + c x^2)^2 / x^2 - 1 at x = 1 and -1, where the residual y does not count
        (0.0, np.inf, np.inf, 0.0),
        (0.1, np.inf, np.inf, 1.1**2 - 1.0),
        (-0.1, np.inf, np.inf, 1.1**2 - 1.0),
        (0.1, 0.5, np.inf, 1.1**2 - 1.0),
        (-0.1, 0.5, np.inf, 1.0 - 0.9**2),
        (-0.1, 2.0, np.inf, 1.1**2 - 1.0),
        (-0.1, 1.0, np.inf, 1.1**2 - 1.0),
        (0.1, np.inf, 0.5, np.inf),
    ],
)
def test_nonlinearity_is_the_deviation_from_a_parabola(curvature, distance, most, expected):
    model = Parabola(curvature, distance, most)
    start = np.array((0.0, 0.3))
    for sign in (1.0, -1.0):
        factor = np.array(((0.0, 0.25 * sign), (0.1, 0.0)))
        spectrum = make_covariance((4.0, 1.0), factor)
        found = uncertainty.measure_cost_nonlinearity(model, start, start, spectrum, 1.0)
        assert found == pytest.approx(expected, abs=1e-12)


def test_nonlinearity_is_measured_at_the_enlarged_error():
    """Check the cost (x + c x^2)^2, which is 4 (1 + 2 c)^2 at x = 2."""
    spectrum = make_covariance((1.0, 1.0), ((2.0,), (0.0,)))
    start = np.zeros(2), np.zeros(2)
    found = uncertainty.measure_cost_nonlinearity(Parabola(0.1), *start, spectrum, 2.0)
    assert found == pytest.approx(1.2**2 - 1.0)
    none = make_covariance((1.0, 1.0), np.zeros((2, 0)), hidden=np.eye(2))
    assert uncertainty.measure_cost_nonlinearity(Parabola(0.1), *start, none, 2.0) == 0.0


def alternate(n, size):
    return size * (-1.0) ** np.arange(n)


@pytest.mark.parametrize(
    "name, values, expected",
    [
        # The second differences of an alternating sequence are 4 times its size.
        ("spin", 3.0 * np.arange(20.0) + alternate(20, 0.1), 1.4826 * 0.4 / SIX),
        ("spin", 3.0 * np.arange(6.0) + alternate(6, 0.1), 1.4826 * 0.4 / SIX),
        ("spin", 3.0 * np.arange(5.0) + alternate(5, 0.0), 0.3 * np.sqrt(2.0)),
        ("spin", np.full(9, 2.5), 2.5e-12),
        ("spin", 5.0 + alternate(20, 1.0), 1.0),
        ("precession_angle", alternate(30, 0.01) + 0.9 * np.arange(30.0) % 6.2832 - 3.1, None),
    ],
)
def test_noise_is_estimated_from_second_differences(name, values, expected):
    [found] = noise.estimate_initial_sigmas((kr.Record(T[: len(values)], {name: values}),))
    assert found.shape == (len(values), 1) and (found == found[0]).all()
    expected = 1.4826 * 0.04 / SIX if expected is None else expected
    assert found[0, 0] == pytest.approx(expected, rel=1e-3 if name != "spin" else 1e-9, abs=0.0)


def test_noise_of_attitudes_is_that_of_their_rotation_vectors():
    """Check rotations about (0.6, 0, 0.8) by 0.8 rad per row, with alternating errors 0.02 rad."""
    angle = 0.8 * np.arange(12.0) + alternate(12, 0.02)
    zero = np.zeros(12)
    q = np.column_stack((np.cos(angle / 2.0), zero, zero, np.sin(angle / 2.0)))
    tilted = q.copy()
    tilted[:, 1:3] = q[:, 3:] * (0.6, 0.0)
    tilted[:, 3] = 0.8 * q[:, 3]
    base = np.array((0.6, 0.8, 0.0, 0.0))  # does not change steps in the frame of the body
    tilted = multiply_quaternions(base, tilted)
    [found] = noise.estimate_initial_sigmas((kr.Record(T[:12], {"q": tilted}),))
    # The second differences of the components are 0.08 times (0.6, 0, 0.8); their median is 0.048.
    assert found.shape == (12, 3) and found == pytest.approx(1.4826 * 0.048 / SIX)


def test_given_noise_is_used_and_missing_rows_are_left_out():
    values = np.column_stack([3.0 * T[:20] + alternate(20, 0.1)] * 3)
    values[7, 1] = np.nan
    record = kr.Record(
        T[:20], {"spin": np.ones(20), "body_velocity": values}, {"spin": np.linspace(1, 2, 20)}
    )
    given, estimated = noise.estimate_initial_sigmas((record,))
    assert given[:, 0].tolist() == np.linspace(1, 2, 20).tolist()
    assert estimated == pytest.approx(1.4826 * 0.4 / SIX)


@pytest.mark.parametrize("parameters, share", [(0, 1.0), (5, 0.75), (30, 0.05)])
def test_noise_is_estimated_from_residuals(parameters, share):
    """Test a record in which only one of two measured quantities has a known standard deviation."""
    values = np.ones((7, 3))
    values[:, 1] = np.nan
    model = make_model(
        {"nutation": [0.5] * 6 + [np.nan], "apex": values}, parameters, {"nutation": 0.3}
    )
    residuals, nothing = np.linspace(-1.0, 2.0, 28), np.zeros((28, parameters))
    sample = residuals[7:].reshape(7, 3)[:, [0, 2]].ravel()
    old = model.rows[1].sigma
    for loss, factor in (
        ("linear", np.sqrt((sample**2).sum() / (14.0 * share))),
        ("soft", 1.4826 * np.median(np.abs(sample))),
    ):
        known, found = noise.estimate_sigmas_from_residuals(model, residuals, nothing, loss)
        assert (known[:6] == 0.3).all() and found == pytest.approx(factor * old)
    exact = noise.estimate_sigmas_from_residuals(model, 0.0 * residuals, nothing, "linear")
    assert exact[1] == pytest.approx(1e-12, rel=1e-9, abs=0.0)


def test_noise_of_a_series_without_measurements_stays():
    model = make_model({"spin": [1.0, 2.0], "nutation": [np.nan] * 2}, 7)
    for loss in ("linear", "soft"):
        _, nutation = noise.estimate_sigmas_from_residuals(
            model, np.array((0.3, 0.4, 9.0, 9.0)), np.zeros((4, 7)), loss
        )
        assert nutation is model.rows[1].sigma
    lone = make_model({"spin": [1.0, np.nan], "nutation": [0.5, 0.5]}, 7, {"nutation": 0.1})
    found, _ = noise.estimate_sigmas_from_residuals(
        lone, np.full(4, 0.3), np.zeros((4, 7)), "linear"
    )
    assert found == pytest.approx(lone.rows[0].sigma * 0.3 * np.sqrt(3.0))


def make_absorbed_model():
    """Return a model of two quantities, and a Jacobian matrix that fits mainly the second."""
    model = make_model({"spin": np.ones(20), "nutation": [0.5] * 4 + [np.nan] * 16}, parameters=3)
    jacobian = np.zeros((40, 3))
    jacobian[20, 0] = 100.0
    jacobian[[0, 21], 1] = 300.0, 400.0  # a share 0.36 of this direction lies in spin
    jacobian[5, 2] = 0.9  # not determined
    return model, jacobian


def test_parameters_absorb_degrees_of_freedom_of_the_quantities_that_determine_them():
    model, jacobian = make_absorbed_model()
    assert noise.compute_degrees_of_freedom(model, jacobian) == pytest.approx([19.64, 2.36])
    with_gap = np.vstack((jacobian, 1e5 * np.eye(3)[:1]))  # the gap determines the first parameter
    assert noise.compute_degrees_of_freedom(model, with_gap)[1] == pytest.approx(3.36, abs=1e-5)
    residuals = np.concatenate((np.full(20, 0.3), np.full(20, 0.5)))
    found = noise.estimate_sigmas_from_residuals(model, residuals, jacobian, "linear")
    for rows, one, square, dof in zip(model.rows, found, (1.8, 1.0), (19.64, 2.36), strict=True):
        # 24 - 3 of the 22 degrees of freedom count, as in chi2 per degree of freedom
        assert one == pytest.approx(rows.sigma * np.sqrt(square / (dof * 21.0 / 22.0)))


@pytest.mark.parametrize(("count", "is_uncertain"), [(2, False), (3, True)])
def test_sigmas_estimated_from_few_degrees_of_freedom_are_named(count, is_uncertain):
    model = make_model({"spin": np.ones(20), "nutation": [0.5] * 6 + [np.nan] * 14}, count)
    jacobian = np.zeros((40, count))
    jacobian[range(20, 20 + count), range(count)] = 100.0
    sentences = noise.describe_uncertain_sigmas(model, jacobian)
    start = "the sigma of nutation is estimated from 3.0 degrees of freedom"
    assert [sentence.startswith(start) for sentence in sentences] == [True] * is_uncertain
    noise.refuse_inestimable_sigmas(model, jacobian)
    given = make_model(
        {"spin": np.ones(20), "nutation": [0.5] * 6 + [np.nan] * 14}, count, {"nutation": 0.1}
    )
    assert noise.describe_uncertain_sigmas(given, jacobian) == ()


def test_sigmas_of_numbers_that_are_fitted_exactly_are_refused():
    model = make_model({"spin": np.ones(20), "nutation": [0.5] * 2 + [np.nan] * 18}, 2)
    jacobian = np.zeros((40, 2))
    jacobian[20:22] = 100.0 * np.eye(2)
    found = noise.estimate_sigmas_from_residuals(model, np.ones(40), jacobian, "linear")
    assert found[1] is model.rows[1].sigma
    assert found[0] == pytest.approx(model.rows[0].sigma)
    with pytest.raises(ValueError, match="the sigma of nutation cannot be estimated, because the"):
        noise.refuse_inestimable_sigmas(model, jacobian)


def test_one_attitude_reading_beside_a_gyroscope_needs_a_sigma():
    """Check that the free attitude absorbs the heading of the only attitude reading."""
    scene, t = kr.scenes.asymmetric_regular.replace(attitude=(0.8, 0.6, 0.0, 0.0)), 0.03 * T
    path, q = kr.solve(scene, t), np.full((40, 4), np.nan)
    noise_of_gyroscope = 0.02 * np.random.default_rng(4).normal(size=(40, 3))
    q[20] = multiply_quaternions(path.q[20], np.array((np.cos(0.05), 0.0, np.sin(0.05), 0.0)))
    values = {"body_velocity": path.body_velocity + noise_of_gyroscope, "q": q}
    with pytest.warns(UserWarning, match="sigma of q is estimated from .* give sigma"):
        found = kr.fit(scene, kr.Record(t, values), "start")
    [sentence] = found.uncertain_sigma
    assert f"Uncertain: {sentence}." in str(found)
    found = kr.fit(scene, kr.Record(t, values, {"q": 0.1}), "start")
    assert found.uncertain_sigma == () and "Uncertain" not in str(found)
