"""Least squares by Levenberg and Marquardt, and the noise of records."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Generic, Literal, NamedTuple, Protocol, TypeVar

import numpy as np

from .._utils.arguments import Array
from .parameters import (
    compute_rotation_vectors,
    conjugate_quaternions,
    multiply_quaternions,
    wrap_angle,
)
from .records import Record, Series
from .residuals import ResidualEvaluation, ResidualModel

LossName = Literal["linear", "soft"]

# Along eigenvectors of J^T J with weaker eigenvalues, one sigma is larger than the natural size.
# They are followed only if the cost falls by more than noise explains.
WEAKEST = 1.0
_RANK_RTOL = 1e-13  # smaller eigenvalues of J^T J are rounding errors, relative to the largest
_CHANCE = 9.0  # decrease of the cost that noise explains, relative to the mean square residual
_DAMPING = 1e-6  # first damping, relative to the largest eigenvalue (to the median one if is_stiff)
_DAMPING_MOST = 1e3
_DAMPING_LEAST = 1e-14
_FACTOR = 16.0  # change of the damping after a failed and after a successful step
_FAR = 100.0  # mean square residual of points that are far from the records
_FAR_MEDIAN = 6.0  # the same for the median of the absolute residuals, without outliers
_SLOW = 1e-2  # relative improvement there that is slow
_SLOW_MOST = 5  # slow improvements in succession after which a search far away ends
_NOISELESS = 1e-22  # mean square residual that is rounding error

P = TypeVar("P")


class LeastSquaresModel(Protocol[P]):
    """Interface of a model that can be fitted by least squares."""

    @property
    def evaluations(self) -> int: ...
    @property
    def size(self) -> int: ...
    def evaluate_residuals(self, point: P) -> ResidualEvaluation: ...
    def estimate_parameter_scales(self, point: P) -> Array: ...
    def add_step_within_bounds(self, point: P, step: Array) -> P: ...
    def compute_distances_to_lower_bounds(self, point: P) -> Array: ...


class Minimum(NamedTuple, Generic[P]):
    """The point with the lowest cost that a search has found.

    has_converged  False if the search ended at its limit, or if no cost was finite
    """

    point: P
    evaluation: ResidualEvaluation
    cost: float
    has_converged: bool


def compute_cost(residuals: Array, loss: LossName) -> float:
    """Return the sum of r^2, or of 2 (sqrt(1 + r^2) - 1) for the soft loss; inf beyond doubles."""
    with np.errstate(all="ignore"):
        if loss == "linear":
            cost = float(residuals @ residuals)
        else:
            cost = float(2.0 * (np.hypot(1.0, residuals) - 1.0).sum())
    return cost if np.isfinite(cost) else np.inf


class SearchSettings(NamedTuple):
    """Settings of a search.

    limit     the largest number of evaluations of the model, including those before the search
    ftol      relative improvement of the cost that ends the search
    report    a function that receives each improved minimum
    is_stiff  True if some residuals have far smaller sigmas, as the gaps between pieces
    """

    loss: LossName
    limit: int
    ftol: float
    report: Callable[[Minimum[Any]], None]
    is_stiff: bool = False


def minimize_cost(model: LeastSquaresModel[P], point: P, search: SearchSettings) -> Minimum[P]:
    """Search for a local minimum of the cost, starting from `point`, and return the minimum.

    Each iteration increases the damping of a Gauss-Newton step until the cost does not rise. The
    search stops early if the residuals are large and hardly decrease.
    """
    loss, natural = search.loss, model.estimate_parameter_scales(point)
    evaluation = model.evaluate_residuals(point)
    best = Minimum(point, evaluation, compute_cost(evaluation.residuals, loss), False)
    if not np.isfinite(best.cost):
        return best
    search.report(best)
    damping, slow_count = _DAMPING, 0
    while model.evaluations < search.limit:
        if best.cost <= _NOISELESS * model.size:
            return best._replace(has_converged=True)
        residuals, scaled = best.evaluation.residuals, best.evaluation.jacobian * natural
        if loss == "soft":
            weight = (1.0 + residuals**2) ** -0.25
            residuals, scaled = residuals * weight, scaled * weight[:, None]
        gradient = scaled.T @ residuals
        # steps along these parameters would leave the bounds
        is_held = (model.compute_distances_to_lower_bounds(best.point) <= 0.0) & (gradient > 0.0)
        scaled[:, is_held] = 0.0
        values, vectors = np.linalg.eigh(scaled.T @ scaled)
        along = vectors.T @ np.where(is_held, 0.0, gradient)
        excess = max(float(np.mean(residuals**2)), 1.0)
        is_seen = values > _RANK_RTOL * values[-1]
        is_seen &= (values > WEAKEST) | (along**2 > _CHANCE * excess * values)
        scale = float(np.median(values)) if search.is_stiff else float(values[-1])
        gain = -1.0
        while gain < 0.0:
            divisor = values + damping * scale
            part = np.divide(along, divisor, out=np.zeros_like(divisor), where=is_seen)
            candidate = model.add_step_within_bounds(best.point, -natural * (vectors @ part))
            evaluation = model.evaluate_residuals(candidate)
            cost = compute_cost(evaluation.residuals, loss)
            gain = best.cost - cost
            predicted = float(along[is_seen] ** 2 @ (1.0 / divisor[is_seen]))
            is_stuck = damping > _DAMPING_MOST or predicted <= search.ftol * best.cost * 1e-2
            if gain < 0.0 and (is_stuck or model.evaluations >= search.limit):
                return best._replace(has_converged=model.evaluations < search.limit)
            damping = damping * _FACTOR if gain < 0.0 else max(damping / _FACTOR, _DAMPING_LEAST)
        best = Minimum(candidate, evaluation, cost, False)
        search.report(best)
        if loss == "linear":
            is_far = cost > _FAR * evaluation.residuals.size
        else:
            is_far = bool(np.median(np.abs(evaluation.residuals)) > _FAR_MEDIAN)
        slow_count = slow_count + 1 if gain < _SLOW * cost and is_far else 0
        if gain <= search.ftol * cost or slow_count > _SLOW_MOST:
            return best._replace(has_converged=True)
    return best


_FEWEST = 6  # values that an estimate needs
_UNKNOWN = 0.1  # standard deviation without an estimate, relative to the spread
_LEAST = 1e-12  # least standard deviation, relative to the spread
_NO_DOF = 0.5  # degrees of freedom from which a standard deviation cannot be estimated
_FEW_DOF = 4.0  # degrees of freedom from which the estimate is reliable
MEDIAN = 1.4826  # standard deviation of a normal distribution, relative to its median deviation


def estimate_initial_sigmas(records: tuple[Record, ...]) -> list[Array]:
    """Return the standard deviations of each series, either given or estimated from its values."""
    sigmas: list[Array] = []
    for record in records:
        for series in record.series:
            shape = len(record.t), series.residuals_per_row
            if series.sigma is None:
                sigmas.append(np.full(shape, _estimate_series_noise(series)))
            else:
                sigmas.append(series.sigma)
    return sigmas


def _estimate_series_noise(series: Series) -> float:
    """Return the noise level of a series, estimated from second differences of its values."""
    values = series.values[series.measured.all(axis=1)]
    if len(values) < _FEWEST:
        return _UNKNOWN * series.typical_value_scale
    if series.is_attitude:
        steps = compute_rotation_vectors(
            multiply_quaternions(conjugate_quaternions(values[:-1]), values[1:])
        )
    else:
        steps = np.diff(values, axis=0)
        steps = wrap_angle(steps) if series.is_angle else steps
    noise = MEDIAN * float(np.median(np.abs(np.diff(steps, axis=0)))) / np.sqrt(6.0)
    return float(np.clip(noise, _LEAST * series.typical_value_scale, series.typical_value_scale))


def estimate_sigmas_from_residuals(
    model: ResidualModel, residuals: Array, scaled_jacobian: Array, loss: LossName
) -> list[Array]:
    dofs = compute_degrees_of_freedom(model, scaled_jacobian)
    total = int(model.measured.sum())
    share = max(total - model.parameters.size, 1) / max(sum(dofs), 1.0)
    sigmas: list[Array] = []
    for rows, dof in zip(model.rows, dofs, strict=True):
        sample = rows.select_series_residuals(residuals)[rows.measured_mask]
        if rows.series.sigma is not None or not sample.size or dof < _NO_DOF:
            sigmas.append(rows.sigma)
            continue
        if loss == "soft":
            factor = MEDIAN * float(np.median(np.abs(sample)))
        else:
            factor = float(np.sqrt((sample @ sample) / (dof * min(share, 1.0))))
        least = _LEAST * rows.series.typical_value_scale
        sigmas.append(np.maximum(rows.sigma * factor, least))
    return sigmas


def compute_degrees_of_freedom(model: ResidualModel, scaled_jacobian: Array) -> list[float]:
    """Return the number of values of each series minus the share that the parameters absorb.

    This share is the sum of the diagonal elements of the hat matrix, which takes the measured
    values to the fitted ones. Directions that the data do not determine absorb nothing.

    scaled_jacobian  (m, k) derivatives of the residuals, and of the gaps between pieces, with
                     respect to the parameters in their natural units
    """
    triangle = np.linalg.qr(scaled_jacobian, mode="r")  # fewer rows, for a faster decomposition
    _, values, vectors = np.linalg.svd(triangle, full_matrices=False)
    is_seen = values**2 > WEAKEST
    left = scaled_jacobian @ (vectors[is_seen].T / values[is_seen])
    absorbed = (left**2).sum(axis=1)
    return [
        float(rows.measured_mask.sum() - absorbed[rows.residual_slice].sum()) for rows in model.rows
    ]


def describe_uncertain_sigmas(
    model: ResidualModel, scaled_jacobian: Array, *, refuses: bool = False
) -> tuple[str, ...]:
    """Return a sentence for each standard deviation that is estimated from few numbers.

    With `refuses`, raises ValueError if the parameters fit all numbers of a quantity exactly.
    """
    sentences = []
    if any(rows.series.sigma is None for rows in model.rows):
        dofs = compute_degrees_of_freedom(model, scaled_jacobian)
        for rows, dof in zip(model.rows, dofs, strict=True):
            name = rows.series.name
            if rows.series.sigma is not None or not rows.measured_mask.any() or dof >= _FEW_DOF:
                continue
            if refuses and dof < _NO_DOF:
                raise ValueError(
                    f"the sigma of {name} cannot be estimated, because the free parameters fit its "
                    "numbers exactly: give sigma, add measurements, or remove names from free"
                )
            sentences.append(
                f"the sigma of {name} is estimated from {dof:.1f} degrees of freedom, too few for "
                "reliable errors"
            )
    return tuple(sentences)
