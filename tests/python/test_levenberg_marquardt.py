"""Tests of the damped least-squares steps that kreisel.fit takes."""

import numpy as np
import pytest
from kreisel._fit import levenberg_marquardt as lm
from kreisel._fit.residuals import ResidualEvaluation


class ScriptModel:
    """A model with one parameter, whose successive evaluations return prescribed residuals.

    A point is represented by the number of search steps that lead to it.
    """

    def __init__(self, *residuals, jacobian=1.0, natural=1.0):
        self.residuals = [np.atleast_1d(np.array(r, dtype=float)) for r in residuals]
        self.size, self.natural = len(self.residuals[0]), np.full(1, natural)
        self.jacobian = np.full((self.size, 1), jacobian)
        self.evaluations, self.steps = 0, []

    def evaluate_residuals(self, point):
        self.evaluations += 1
        return ResidualEvaluation(self.residuals[self.evaluations - 1], self.jacobian)

    def estimate_parameter_scales(self, point):
        return self.natural

    def add_step_within_bounds(self, point, step):
        self.steps.append(float(step[0]))
        return point + 1

    def compute_distances_to_lower_bounds(self, point):
        return np.full(1, np.inf)


def minimize(model, limit, ftol=0.0, loss="linear"):
    """Minimize the cost of a model, and return the minimum and all costs that are reported."""
    costs = []
    settings = lm.SearchSettings(loss, limit, ftol, lambda minimum: costs.append(minimum.cost))
    return lm.minimize_cost(model, 0, settings), costs


def make_evaluation(jacobian, residuals):
    return ResidualEvaluation(np.array(residuals, dtype=float), np.array(jacobian, dtype=float))


def test_costs_are_sums_of_the_loss():
    residuals = np.array((0.0, 3.0, -4.0))
    assert lm.compute_cost(residuals, "linear") == 25.0
    expected = 2.0 * (np.sqrt(10.0) + np.sqrt(17.0) - 2.0)
    assert lm.compute_cost(residuals, "soft") == pytest.approx(expected, rel=1e-14)


def test_soft_weights_give_the_gradient_of_the_soft_cost():
    rng = np.random.default_rng(1)
    jacobian, residuals = rng.normal(size=(7, 3)), 3.0 * rng.normal(size=7)
    evaluation = ResidualEvaluation(residuals, jacobian)
    assert lm.apply_loss_weights(evaluation, "linear") is evaluation
    weighted = lm.apply_loss_weights(evaluation, "soft")
    step = 1e-6 * np.eye(3)
    differences = [
        lm.compute_cost(residuals + jacobian @ d, "soft")
        - lm.compute_cost(residuals - jacobian @ d, "soft")
        for d in step
    ]
    gradient = 2.0 * weighted.jacobian.T @ weighted.residuals
    assert np.allclose(gradient, np.array(differences) / 2e-6, rtol=1e-7)
    assert np.allclose(weighted.residuals, residuals / (1.0 + residuals**2) ** 0.25, rtol=1e-14)


@pytest.mark.parametrize("is_stiff", [False, True])
@pytest.mark.parametrize("damping", [0.0, 1e-3, 2.0])
def test_a_damped_step_solves_the_scaled_normal_equations(is_stiff, damping):
    rng = np.random.default_rng(2)
    jacobian, residuals = rng.normal(size=(9, 3)), rng.normal(size=9)
    natural = np.array((0.5, 2.0, 3.0))
    scaled = jacobian * natural
    normal = scaled.T @ scaled
    values = np.linalg.eigvalsh(normal)
    unit = values[1] if is_stiff else values[2]
    expected = -natural * np.linalg.solve(normal + damping * unit * np.eye(3), scaled.T @ residuals)
    evaluation = ResidualEvaluation(residuals, jacobian)
    steps = lm._DampedSteps(evaluation, natural, np.full(3, np.inf), is_stiff)
    assert np.allclose(steps.compute_damped_step(damping), expected, rtol=1e-11)


@pytest.mark.parametrize(
    ("distances", "residuals", "expected"),
    [
        ((0.0, 9.0), (2.0, 4.0), (0.0, -3.0)),  # the first parameter decreases: it is held
        ((-1.0, 9.0), (2.0, 4.0), (0.0, -3.0)),
        ((1e-9, 9.0), (2.0, 4.0), (2.0, -4.0)),
        ((0.0, 9.0), (-2.0, 4.0), (6.0, -4.0)),  # it increases
        ((0.0, 9.0), (0.5, 1.0), (0.0, -0.75)),
        ((0.0, 9.0), (0.0, 4.0), (4.0, -4.0)),  # no gradient
    ],
)
def test_parameters_at_their_bounds_do_not_leave_them(distances, residuals, expected):
    """Compare the steps for the residuals (a + b + r, b + s) with `a` free or at its bound."""
    jacobian = np.array(((1.0, 1.0), (0.0, 1.0)))
    evaluation = make_evaluation(jacobian, residuals)
    steps = lm._DampedSteps(evaluation, np.ones(2), np.array(distances), False)
    assert np.allclose(steps.compute_damped_step(0.0), expected, rtol=1e-12, atol=1e-12)


def test_undetermined_directions_have_no_step():
    """Check the steps for a Jacobian J if J^T J has the eigenvalues 1e4, 1e-8 and 1e-10."""
    evaluation = make_evaluation(np.diag((1e2, 1e-4, 1e-5)), (1.0, 1.0, 1.0))
    steps = lm._DampedSteps(evaluation, np.ones(3), np.full(3, np.inf), False)
    assert np.allclose(steps.compute_damped_step(0.0), (-1e-2, -1e4, 0.0), rtol=1e-12)
    nothing = make_evaluation(np.zeros((3, 3)), (1.0, 1.0, 1.0))
    steps = lm._DampedSteps(nothing, np.ones(3), np.full(3, np.inf), False)
    assert (steps.compute_damped_step(1.0) == 0.0).all()


@pytest.mark.parametrize(
    ("second", "others", "weakest", "step"),
    [
        (2.99, 0.0, 1.0, 0.0),  # the cost would fall by 8.94, less than 9
        (3.01, 0.0, 1.0, -6.02),
        (3.01, 0.0, 0.24, -6.02),
        (2.99, 0.0, 0.24, -5.98),  # the eigenvalue 0.25 is larger
        (5.9, 2.0, 1.0, 0.0),  # the mean square residual is more than 4, and 9 times it is 37.2
        (6.2, 2.0, 1.0, -12.4),
    ],
)
def test_weak_directions_have_a_step_if_noise_does_not_explain_the_gain(
    second, others, weakest, step
):
    size = 200
    jacobian, residuals = np.zeros((size, 2)), np.full(size, others)
    jacobian[0, 0], jacobian[1, 1], residuals[1] = 2.0, 0.5, second
    evaluation = make_evaluation(jacobian, residuals)
    steps = lm._DampedSteps(evaluation, np.ones(2), np.full(2, np.inf), False, weakest)
    expected = (-0.5 * residuals[0], step)
    assert np.allclose(steps.compute_damped_step(0.0), expected, rtol=1e-12)


def find_step(model, damping, cost, limit=100, ftol=0.0, jacobian=((1.0,),), residuals=(1.0,)):
    """Search for a cost-reducing step from a given initial cost, and return the result."""
    evaluation = make_evaluation(jacobian, residuals)
    size = evaluation.jacobian.shape[1]
    steps = lm._DampedSteps(evaluation, np.ones(size), np.full(size, np.inf), False)
    settings = lm.SearchSettings("linear", limit, ftol, lambda _: None)
    return lm._find_cost_reducing_step(model, 0, steps, damping, cost, settings)


@pytest.mark.parametrize(
    ("residuals", "damping", "expected"),
    [
        ((1.0,), 1.0, 1.0 / 16.0),  # an equal cost is no failure
        ((2.0, 2.0, 0.5), 1.0, 16.0),
        ((0.5,), 8e-14, 1e-14),
        ((0.5,), 64e-14, 4e-14),
        ((np.nan, 1e200, 0.5), 1.0, 16.0),
    ],
)
def test_the_damping_changes_by_a_factor(residuals, damping, expected):
    model = ScriptModel(*residuals)
    minimum, found = find_step(model, damping, 1.0)
    assert found == pytest.approx(expected, rel=1e-12)
    assert minimum.cost == residuals[-1] ** 2 and not minimum.has_converged
    assert minimum.point == 1 and len(residuals) == model.evaluations
    assert model.steps == pytest.approx(
        [-1.0 / (1.0 + damping * 16.0**k) for k in range(len(residuals))]
    )


@pytest.mark.parametrize(
    ("damping", "words", "expected"),
    [
        (1.0, {}, [1.0, 16.0, 256.0, 4096.0]),
        (1000.0, {}, [1000.0, 16000.0]),
        (1000.5, {}, [1000.5]),
        (1.0, {"limit": 2}, [1.0, 16.0]),
        # With the eigenvalue 1 and the gradient 2, the expected gain is 4 / (1 + damping).
        (1.0, {"ftol": 2.0, "residuals": (2.0,), "cost": 100.0}, [1.0]),
        (1.0, {"ftol": 2.0, "residuals": (2.0,), "cost": 99.0}, [1.0, 16.0]),
    ],
)
def test_failing_steps_end(damping, words, expected):
    """Check the damping parameters that are tried, and the one at the end."""
    model = ScriptModel(*[20.0] * 9)
    minimum, last = find_step(model, damping, **{"cost": 1.0, **words})
    assert minimum is None and model.evaluations == len(expected)
    (residual,) = words.get("residuals", (1.0,))
    assert model.steps == pytest.approx([-residual / (1.0 + one) for one in expected])
    assert last == expected[-1] * (16.0 if "limit" in words else 1.0)


def test_only_determined_directions_have_an_expected_gain():
    jacobian, residuals = np.diag((1.0, 1e-8)), (2.0, 1e9)
    words = {"jacobian": jacobian, "residuals": residuals, "ftol": 2.0}
    model = ScriptModel(*[20.0] * 9)
    assert find_step(model, 1.0, 100.0, **words) == (None, 1.0)


@pytest.mark.parametrize("residual", [np.nan, np.inf, 1e200])
def test_a_search_from_a_point_without_a_cost_ends_at_once(residual):
    model = ScriptModel(residual)
    minimum, costs = minimize(model, 9)
    assert minimum.cost == np.inf and not minimum.has_converged
    assert costs == [] and model.evaluations == 1


def test_a_search_without_noise_ends_at_once(monkeypatch):
    minimum, costs = minimize(ScriptModel((1e-12, 1e-12)), 9)
    assert minimum.has_converged and costs == [minimum.cost]
    monkeypatch.setattr(lm, "_NOISELESS", 0.25)
    minimum, _ = minimize(ScriptModel((0.5, 0.5, 0.5, 0.5)), 9)
    assert minimum.has_converged and minimum.cost == 1.0
    model = ScriptModel((0.5, 0.5, 0.5, 0.6), (0.5,) * 4)
    minimum, _ = minimize(model, 9)
    assert minimum.has_converged and model.evaluations == 2


def test_the_first_step_is_hardly_damped():
    model = ScriptModel(3.0, 2.0, jacobian=0.5, natural=4.0)
    minimum, costs = minimize(model, 2)
    assert minimum.point == 1 and not minimum.has_converged and costs == [9.0, 4.0]
    assert model.steps == pytest.approx([-6.0 / (1.0 + 1e-6)], rel=1e-12)


@pytest.mark.parametrize(
    ("residuals", "limit", "ftol", "count", "has_converged"),
    [
        ((2.0, 1.0), 1, 0.0, 1, False),
        ((np.sqrt(3.0), np.sqrt(2.0), 1.0), 3, 0.5000001, 2, True),  # a gain of half the cost
        ((np.sqrt(3.0), np.sqrt(2.0), 1.0), 3, 0.4999999, 3, False),
        ((1.0, 1.0), 9, 0.0, 2, True),  # no gain
        ((2.0, *[3.0] * 9), 11, 0.0, 10, True),  # no better point, before the limit
        ((2.0, *[3.0] * 9), 4, 0.0, 4, False),
    ],
)
def test_a_search_ends_at_its_limit_or_tolerance(residuals, limit, ftol, count, has_converged):
    model = ScriptModel(*residuals)
    minimum, _ = minimize(model, limit, ftol)
    assert model.evaluations == count and minimum.has_converged == has_converged


def scale_residuals(factor, changes):
    """Return residuals with the first square `factor` and given ratios of successive squares."""
    return np.sqrt(factor * np.cumprod([1.0, *changes]))


@pytest.mark.parametrize(
    ("factor", "changes", "count"),
    [
        (1e4, [0.995] * 9, 7),  # the start and six slow improvements
        (1e4, [0.98] * 9, 10),  # fast
        (1e4, [0.995] * 3 + [0.5] + [0.995] * 6, 11),
        (1e4, [0.995] * 5 + [0.98, 0.98], 8),
        (90.0, [0.995] * 9, 10),  # near the records
    ],
)
def test_slow_searches_far_from_the_records_end(factor, changes, count):
    model = ScriptModel(*scale_residuals(factor, changes))
    minimum, costs = minimize(model, len(changes) + 1)
    assert model.evaluations == len(costs) == count
    assert minimum.has_converged == (count < len(changes) + 1 or changes[3] == 0.5)


def test_a_gain_of_one_hundredth_is_not_slow(monkeypatch):
    monkeypatch.setattr(lm, "_SLOW_MOST", 0)
    for last, count in (((100.0, 0.0), 3), ((100.1, 0.0), 2)):  # the cost before is 10100
        model = ScriptModel((100.0, 10.0), last, (1.0, 0.0))
        minimize(model, 3)
        assert model.evaluations == count


@pytest.mark.parametrize(
    ("residuals", "loss", "is_large"),
    [
        ((10.0, 10.0, 10.0), "linear", False),
        ((10.0, 10.0, -10.1), "linear", True),
        ((6.0, -6.0, 90.0), "soft", False),
        ((-6.1, 6.1, 0.0), "soft", True),
    ],
)
def test_residuals_are_large_beyond_a_limit(residuals, loss, is_large):
    evaluation = make_evaluation(np.zeros((3, 1)), residuals)
    cost = lm.compute_cost(evaluation.residuals, loss)
    minimum = lm.Minimum(None, evaluation, cost, False)
    assert lm._has_large_residuals(minimum, loss) is is_large
