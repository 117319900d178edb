"""Estimation of the standard deviations of measurements."""

from __future__ import annotations

import numpy as np

from .._utils.validation import Array
from .levenberg_marquardt import LossName
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
    model: ResidualModel, residuals: Array, loss: LossName
) -> list[Array]:
    """Estimate unknown standard deviations from the residuals of a fit."""
    total = int(model.measured.sum())
    share = max(1.0 - model.parameters.size / total, 1.0 / total)
    sigmas: list[Array] = []
    for rows in model.rows:
        if rows.series.sigma is not None:
            sigmas.append(rows.sigma)
            continue
        sample = rows.select_series_residuals(residuals)[rows.measured_mask]
        if loss == "soft" and sample.size:
            factor = MEDIAN * float(np.median(np.abs(sample)))
        else:
            factor = float(np.sqrt((sample @ sample) / max(sample.size * share, 1e-300)))
        least = _LEAST * rows.series.typical_value_scale
        sigmas.append(np.maximum(rows.sigma * factor, least) if sample.size else rows.sigma)
    return sigmas
