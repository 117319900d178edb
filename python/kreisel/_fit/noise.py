"""Estimation of the standard deviations of measurements."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from .._utils.validation import Array
from .levenberg_marquardt import WEAKEST, LossName
from .records import Record, Series
from .residuals import ResidualModel
from .rotations import (
    compute_rotation_vectors,
    conjugate_quaternions,
    multiply_quaternions,
    wrap_angle,
)

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
    """Estimate unknown standard deviations from the residuals of a fit."""
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


def refuse_inestimable_sigmas(model: ResidualModel, scaled_jacobian: Array) -> None:
    """Raise ValueError if the parameters absorb all numbers of a quantity without a sigma."""
    for name, dof in _yield_estimated_series(model, scaled_jacobian):
        if dof < _NO_DOF:
            raise ValueError(
                f"the sigma of {name} cannot be estimated, because the free parameters fit its "
                "numbers exactly: give sigma, add measurements, or remove names from free"
            )


def describe_uncertain_sigmas(model: ResidualModel, scaled_jacobian: Array) -> tuple[str, ...]:
    """Return a sentence for each standard deviation that is estimated from few numbers."""
    return tuple(
        f"the sigma of {name} is estimated from {dof:.1f} degrees of freedom, too few for reliable "
        "errors"
        for name, dof in _yield_estimated_series(model, scaled_jacobian)
        if dof < _FEW_DOF
    )


def _yield_estimated_series(
    model: ResidualModel, scaled_jacobian: Array
) -> Iterator[tuple[str, float]]:
    """Yield the names and degrees of freedom of the quantities whose sigma is estimated."""
    if all(rows.series.sigma is not None for rows in model.rows):
        return
    dofs = compute_degrees_of_freedom(model, scaled_jacobian)
    for rows, dof in zip(model.rows, dofs, strict=True):
        if rows.series.sigma is None and rows.measured_mask.any():
            yield rows.series.name, dof
