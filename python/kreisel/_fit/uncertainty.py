"""Covariances of fits, and the parameters that records do not determine."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from .._core import values
from .._utils.arguments import Array
from .minimize import LossName
from .parameters import FitPoint, FreeParameters, rotation_matrix
from .residuals import ResidualModel, ResidualRows

_CHANCE = 3.0  # standard deviations beyond which a deviation is not chance
_RANK = 1e-9  # smaller singular values are rounding errors, relative to the largest
_LOST = 0.1  # contribution of blind directions from which an error is infinite
_LOST_IF_WEAK = 0.01  # the same if it exceeds the error by the determined directions
_LOST_IF_HIDDEN = 1e-4  # the same for hidden directions if it exceeds `_CHANCE` times that error
_PRESENT = 1e-3  # part of a blind direction that lies in the parameters
_CLIP = 3.0  # standard deviations at which residuals are cut off for their correlation
_FEWEST = 6  # residuals that a correlation needs


class ResidualStatistics(NamedTuple):
    """Statistics of the residuals of a fit.

    chi2         the sum of squares; for the soft loss, of the residuals within 3 sigma
    dof          the number of residuals minus the number of parameters
    variance     variance of the errors relative to their sigma
    correlation  of neighbouring residuals
    inflation    factor of the standard deviations of the parameters
    """

    chi2: float
    dof: int
    variance: float
    correlation: float
    inflation: float


@dataclass(frozen=True, eq=False)
class FitCovariance:
    """The covariance of fitted parameters, and the parameter changes that affect no residual.

    natural  (size,) the natural sizes of the parameters, which are the units of the other fields
    factor   (size, k) the matrix F for which F F^T is the covariance on the determined directions
    blind    (size, l) unit vectors along all directions that the data do not determine
    weak     (size, m) the same as `factor` for those of them that affect the residuals a little
    hidden   (size, n) unit vectors along those of them that do not affect any residual
    """

    natural: Array
    factor: Array
    blind: Array
    weak: Array
    hidden: Array

    def propagate_errors(self, gradient: Array) -> tuple[Array, Array]:
        """Return the covariance matrix and standard deviations of k functions from their gradients.

        The standard deviation includes the contribution of one standard deviation along the weak
        directions, and of one natural size along the hidden ones. It is infinite if the function
        depends mainly on them, in proportion to its natural size and to the contribution of the
        determined directions.
        """
        scaled = gradient * self.natural
        parts = [scaled @ part for part in (self.factor, self.weak, self.hidden)]
        own, weak, hidden = (np.linalg.norm(part, axis=1) for part in parts)
        size = np.linalg.norm(scaled, axis=1)
        joined = np.concatenate(parts, axis=1)
        covariance = joined @ joined.T
        errors = np.sqrt(np.diag(covariance))
        is_lost = weak > np.clip(own, _LOST_IF_WEAK * size, _LOST * size)
        is_lost |= hidden > np.clip(_CHANCE * own, _LOST_IF_HIDDEN * size, _LOST * size)
        errors = np.where(is_lost, np.inf, errors)
        covariance[is_lost, :] = covariance[:, is_lost] = np.nan
        covariance[is_lost, is_lost] = np.inf
        return covariance, errors

    def draw_random_parameter_changes(self, generator: np.random.Generator, n: int) -> Array:
        """Draw n random parameter changes with no components along undetermined directions."""
        normal = generator.standard_normal((n, self.factor.shape[1]))
        return normal @ self.factor.T * self.natural


def classify_fit_directions(
    jacobian: Array, natural: Array, inflation: float, size: int
) -> FitCovariance:
    """Find the directions in the space of the first `size` parameters that the data determine.

    A direction counts as undetermined if one standard deviation along it exceeds the typical
    magnitude of the parameters.
    """
    triangle = np.linalg.qr(jacobian * natural, mode="r")
    _, values, vectors = np.linalg.svd(triangle)
    values = np.concatenate((values, np.zeros(len(natural) - len(values))))
    is_hidden = values <= _RANK * values[0]
    is_seen = (values > inflation) & ~is_hidden
    is_weak = ~is_seen & ~is_hidden
    factor = vectors[is_seen].T[:size] * (inflation / values[is_seen])
    weak = vectors[is_weak].T[:size] * (inflation / values[is_weak])
    blind = _select_directions_of_parameters(vectors[~is_seen].T[:size])
    hidden = _select_directions_of_parameters(vectors[is_hidden].T[:size])
    return FitCovariance(natural[:size], factor, blind, weak, hidden)


def _select_directions_of_parameters(vectors: Array) -> Array:
    """Return unit vectors that span the columns of `vectors`, without those of negligible length.

    The columns lack the components along further columns of the Jacobian matrix, the starts of
    later pieces.
    """
    directions, lengths, _ = np.linalg.svd(vectors, full_matrices=False)
    selected: Array = directions[:, lengths > _PRESENT]
    return selected


def compute_largest_reduced_chi2(dof: int) -> float:
    """Return the chi2 per degree of freedom up to which noise of the given sigma explains it.

    This is the limit of three standard deviations. Source: Wilson and Hilferty, Proceedings of the
    National Academy of Sciences 17 (1931) 684.
    """
    variance = 2.0 / (9.0 * dof)
    return (1.0 - variance + _CHANCE * math.sqrt(variance)) ** 3


def compute_residual_statistics(
    model: ResidualModel, residuals: Array, loss: LossName, is_sigma_known: bool
) -> ResidualStatistics:
    sample = residuals[model.measured]
    dof = max(sample.size - model.parameters.size, 1)
    if loss == "linear":
        chi2 = float(sample @ sample)
        variance = chi2 / dof
    else:
        inliers = sample[np.abs(sample) <= _CLIP]
        chi2 = float(inliers @ inliers)
        influence = sample / np.hypot(1.0, sample)
        slope = float(((1.0 + sample**2) ** -1.5).mean())
        variance = float(influence @ influence) / dof / slope**2
    correlation = _correlate_neighbouring_residuals(model.rows, residuals)
    factor = variance
    if correlation > _CHANCE / math.sqrt(sample.size):
        factor *= (1.0 + correlation) / max(1.0 - correlation, 1.0 / sample.size)
    chance = 1.0 + _CHANCE * math.sqrt(2.0 / dof) if loss == "linear" else 1.0
    if is_sigma_known and not factor > chance:
        factor = 1.0
    return ResidualStatistics(chi2, dof, variance, correlation, math.sqrt(factor))


def _correlate_neighbouring_residuals(rows: tuple[ResidualRows, ...], residuals: Array) -> float:
    """Return the correlation of neighbouring residuals, averaged over all components of series."""
    correlations = []
    for one in rows:
        values, measured = one.select_series_residuals(residuals), one.measured_mask
        for k in range(values.shape[1]):
            column = np.clip(values[measured[:, k], k], -_CLIP, _CLIP)
            spread = float(((column - column.mean()) ** 2).sum()) if column.size else 0.0
            if column.size >= _FEWEST and spread > 0.0:
                centred = column - column.mean()
                correlations.append(float(centred[1:] @ centred[:-1]) / spread)
    return float(np.mean(correlations)) if correlations else 0.0


def measure_cost_nonlinearity(
    model: ResidualModel,
    point: FitPoint,
    residuals: Array,
    spectrum: FitCovariance,
    inflation: float,
) -> float:
    """Return the relative deviation of chi2 from a quadratic function at one standard deviation.

    The deviation is computed for changes of both signs along the most uncertain direction in
    parameter space, and the larger value is returned.
    """
    if not spectrum.factor.size:
        return 0.0
    k = int(np.linalg.norm(spectrum.factor, axis=0).argmax())
    step = spectrum.natural * spectrum.factor[:, k]
    worst = 0.0
    distances = model.compute_distances_to_lower_bounds(point)
    for sign in (1.0, -1.0):
        if (-sign * step > distances).any():
            continue
        trial_residuals = model.evaluate_residuals(
            model.add_step_within_bounds(point, sign * step), has_jacobian=False
        ).residuals
        with np.errstate(invalid="ignore"):
            rise = float(trial_residuals @ trial_residuals - residuals @ residuals)
        worst = max(worst, abs(rise / inflation**2 - 1.0)) if np.isfinite(rise) else np.inf
    return worst


_ALIKE = 0.999  # cosine from which a generator lies in the blind directions
_LARGEST = 4  # components that describe an unknown direction
_SMALL = 0.1  # smaller components are not described
_ROUNDING = 1e-4
_DELAY = "the delay against the start: a shift in time"
_LEVEL = 1e-3  # horizontal part of an angular velocity that a heading turns, relative to its size


def describe_undetermined_directions(
    parameters: FreeParameters, point: FitPoint, natural: Array, blind: Array, names: list[str]
) -> tuple[str, ...]:
    """Describe each direction in parameter space that the residuals do not determine."""
    sentences: list[str] = []
    basis, described = blind, np.zeros((blind.shape[0], 0))
    for sentence, change in _yield_symmetries(parameters, point):
        length = float(np.linalg.norm(change / natural))
        if not basis.shape[1] or not length > _ROUNDING**2:
            continue
        unit = change / natural / length
        # A symmetry near to a described one, as of a nearly upright top, needs its own direction.
        rest = unit - described @ (described.T @ unit)
        coords = basis.T @ unit
        is_apart = np.linalg.norm(coords) > max(_ROUNDING, _ALIKE * float(np.linalg.norm(rest)))
        if np.linalg.norm(blind.T @ unit) > _ALIKE and is_apart:
            sentences += [sentence] if sentence not in sentences else []
            coords /= np.linalg.norm(coords)
            described = np.column_stack((described, basis @ coords))
            complement = np.linalg.svd(np.eye(len(coords)) - np.outer(coords, coords))[0]
            basis = basis @ complement[:, :-1]
    jacobian = parameters.list_user_parameters_and_jacobian(point)[3] * natural
    changes = jacobian @ basis / np.linalg.norm(jacobian, axis=1)[:, None]
    for direction in (changes / np.linalg.norm(changes, axis=0)).T:
        largest = np.argsort(-np.abs(direction))[:_LARGEST]
        terms = [f"{direction[k]:+.2f} {names[k]}" for k in largest if abs(direction[k]) > _SMALL]
        is_one = len(terms) == 1
        words = f"a combination of parameters: {' '.join(terms)}, in natural units"
        sentences.append(names[int(largest[0])] if is_one else words)
    return tuple(sentences)


def _yield_symmetries(p: FreeParameters, point: FitPoint) -> Iterator[tuple[str, Array]]:
    """Yield changes of the parameters that many instruments do not show, and their descriptions.

    Each is a change of the fields of blocks, all of which are free.
    """
    for sentence, blocks in _list_symmetries(p, point):
        if all(p.can_vary(name) for name in blocks):
            change = np.zeros(p.size)
            for name, value in blocks.items():
                change[p.get_parameter_slice(name)] = value
            if sentence == _DELAY:
                delays = [part for (name, _, _), part in p.slices.items() if name == "delay"]
                if len(delays) < len(p.records):
                    continue
                for part in delays:
                    change[part] = 1.0
            yield sentence, change


def _list_symmetries(
    p: FreeParameters, point: FitPoint
) -> list[tuple[str, Mapping[str, Array | float]]]:
    factors: dict[str, dict[str, Array | float]] = {
        "com": {"com": point.com},
        "lever": {"lever": point.com @ p.columns["lever"]},
        "gravity": {"gravity": point.gravity},
        "mass": {"mass": point.mass},
    }
    if p.can_vary("shaking"):
        factors["gravity"]["shaking"] = point.shaking * (1.0, 0.0, 0.0)
    size: dict[str, Array | float] = {"moments": p.average_tied("moments", point.densities)}
    sizes = {"damping": point.damping, "friction": np.array([point.friction]), "rotor": point.rotor}
    free = [name for name in sizes if p.can_vary(name)]
    size |= {name: p.average_tied(name, sizes[name]) for name in free}
    is_scalable = all(name in free or not value.any() for name, value in sizes.items())
    others = list(dict.fromkeys(("damping", *free)))
    symmetries: list[tuple[str, Mapping[str, Array | float]]] = []
    amplitude, pace, _ = point.shaking
    if is_scalable and (point.gravity or amplitude * pace) and point.com.any():
        symmetries += [
            (
                f"the scale of the moments: moments, {', '.join(others)} and {name} have an "
                "unknown common factor",
                size | blocks,
            )
            for name, blocks in factors.items()
        ]
    elif is_scalable:
        words = " and ".join(others)
        sentence = f"the scale of the moments: only their ratios, and {words} over moments, matter"
        symmetries.append((sentence, size))
    for pair in "gravity com", "gravity lever", "mass com", "mass lever", "gravity mass":
        first, second = pair.split()
        sentence = f"{first} against {second}: only mass * gravity * com counts"
        opposite = {name: -value for name, value in factors[second].items()}
        symmetries.append((sentence, factors[first] | opposite))
    heading = {"attitude": rotation_matrix(point.attitude)[2]}
    turning = np.cross([0.0, 0.0, 1.0], point.turning)
    if np.linalg.norm(turning) > _LEVEL * np.linalg.norm(point.turning):
        sentence = "the heading: a rotation of the start and of turning about the vertical"
        symmetries.append((sentence, {**heading, "turning": turning}))
    symmetries.append(("the heading: a rotation of the start about the vertical", heading))
    scene = point.to_scene()
    [acceleration] = values("body_acceleration", scene._block, scene._start_state)
    shift: dict[str, Array | float] = {"attitude": point.rate, "velocity": acceleration}
    if p.can_vary("shaking"):
        shift["shaking"] = np.array([0.0, 0.0, point.shaking[1]])
    symmetries.append((_DELAY, shift))
    return symmetries
