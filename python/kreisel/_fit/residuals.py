"""Residuals of measurements in units of their standard deviations, and their Jacobian matrix."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, cast

import numpy as np

from .._core import tangents as TANGENTS
from .._model.scene import Scene
from .._results.path import Error, Path
from .._solve.solve import solve
from .._solve.variational import TangentSpec
from .._utils.validation import Array
from .measurable import SEEN_FROM_BODY
from .parameters import FitPoint, FreeParameters
from .predictions import Prediction, QuantityPredictor
from .records import Record, Series
from .rotations import (
    compute_rotation_vectors,
    conjugate_quaternions,
    cross_matrix,
    inverse_left_jacobian,
    multiply_quaternions,
    rotation_matrix,
    wrap_angle,
)

_STEPS = 4  # a trial may take this many times the steps of the guesses
_STEPS_OF_GUESS = 10  # a guess may take this many times the steps of earlier guesses
STEPS_MOST = 10**6  # steps of a guess, and of a trial before the path of any guess is known
_FEWEST_STEPS = 1000
_AGREE = 0.4  # residuals relative to the spread of the data up to which a motion agrees
_WINDOW = 25  # residuals over which a disagreement is averaged


class ResidualEvaluation(NamedTuple):
    """The residuals for given parameters and, if requested, their Jacobian matrix."""

    residuals: Array
    jacobian: Array


class SegmentEndState(NamedTuple):
    """The attitude q and angular momentum m at the end of a segment, and their derivatives."""

    q: Array
    m: Array
    by: Array


Indices = np.ndarray[tuple[int], np.dtype[np.intp]]


@dataclass(frozen=True, eq=False)
class ResidualRows:
    """A measured series, and the rows of the residual vector that belong to it.

    record  the index of the record
    series  the measurements
    sigma   (n, width) standard deviations used in this fit
    begin   the first row
    """

    record: int
    series: Series
    sigma: Array
    begin: int

    @property
    def shape(self) -> tuple[int, int]:
        return len(self.series.values), self.series.residuals_per_row

    @property
    def measured_mask(self) -> np.ndarray[tuple[int, ...], np.dtype[np.bool_]]:
        return self.series.measured[:, : self.series.residuals_per_row]

    @property
    def residual_slice(self) -> slice:
        return slice(self.begin, self.begin + self.shape[0] * self.shape[1])

    def select_series_residuals(self, residuals: Array) -> Array:
        """Return the residuals of the series, as an array of shape (n, width)."""
        return residuals[self.residual_slice].reshape(self.shape)


def assign_residual_rows(
    records: Sequence[Record], sigmas: Sequence[Array]
) -> tuple[ResidualRows, ...]:
    """Assign consecutive rows of the residual vector to the series of the records."""
    all_rows: list[ResidualRows] = []
    begin = 0
    for i, record in enumerate(records):
        for series in record.series:
            rows = ResidualRows(i, series, sigmas[len(all_rows)], begin)
            begin = rows.residual_slice.stop
            all_rows.append(rows)
    return tuple(all_rows)


class ResidualModel:
    """The residuals of the measurements as functions of the parameters.

    parameters   the free parameters
    rows         the series and their places in the residuals
    size         the number of residuals; rows that were not measured are zero
    evaluations  the number of paths computed so far
    max_steps    the largest number of steps of a trial, or 0 if no path is known
    end          the state at the time `end` of the last evaluated point, if `end` was given
    origin       the time of the motion from which the times of the records count
    """

    def __init__(
        self,
        parameters: FreeParameters,
        records: Sequence[Record],
        sigmas: Sequence[Array],
        end: float | None = None,
        origin: float = 0.0,
    ) -> None:
        self.parameters, self.records, self.origin = parameters, tuple(records), origin
        self.rows = assign_residual_rows(records, sigmas)
        self.size = self.rows[-1].residual_slice.stop
        self.measured = np.concatenate([rows.measured_mask.ravel() for rows in self.rows])
        self.evaluations = 0
        self.end: SegmentEndState | None = None
        self._end_time = [] if end is None else [end]
        times = np.concatenate([*(record.t for record in records), self._end_time])
        self.span = max(float(np.ptp(times)), float(np.abs(times).max()), 1e-300)
        self._unshifted = self._merge_measurement_times(times)
        self.max_steps = 0
        self._tangents = self._list_required_tangent_names()
        self._bits = sum(TANGENTS[name][0] for name in self._tangents)

    def estimate_parameter_scales(self, point: FitPoint) -> Array:
        return self.parameters.estimate_parameter_scales(point, self.span)

    def add_step_within_bounds(self, point: FitPoint, step: Array) -> FitPoint:
        return self.parameters.add_step_within_bounds(point, step)

    def compute_distances_to_lower_bounds(self, point: FitPoint) -> Array:
        return self.parameters.compute_distances_to_lower_bounds(point)

    def evaluate_residuals(self, point: FitPoint, has_jacobian: bool = True) -> ResidualEvaluation:
        """Return the residuals for given parameters, or inf if the motion cannot be computed."""
        try:
            return self._evaluate_residuals(point, has_jacobian)
        except (Error, ValueError, np.linalg.LinAlgError):
            return ResidualEvaluation(
                np.full(self.size, np.inf), np.zeros((self.size, self.parameters.size))
            )

    def _evaluate_residuals(self, point: FitPoint, has_jacobian: bool) -> ResidualEvaluation:
        times, time_indices = self._correct_clock_delays(point)
        scene = self.parameters.build_differentiable_scene(point, self.origin)
        states, tangents = self._solve_both_time_directions(
            scene, times, self._tangents if has_jacobian else ()
        )
        transform = (
            self._differentiate_scene_attributes(point) if has_jacobian else np.empty((0, 0))
        )
        if self._end_time:
            last = int(time_indices[-1][0])
            end_jacobian = tangents[last] @ transform if has_jacobian else np.empty(0)
            self.end = SegmentEndState(states[last, 1:5], states[last, 5:], end_jacobian)
        residuals = np.zeros(self.size)
        jacobian = np.zeros((self.size if has_jacobian else 0, self.parameters.size))
        for i, record in enumerate(self.records):
            solution = states[time_indices[i]], tangents[time_indices[i]], self._bits, transform
            has_rate = has_jacobian and "delay" in record.free
            motion = QuantityPredictor(
                self.parameters, point, scene._block, *solution, has_rate, self.origin
            )
            for rows in self.rows:
                if rows.record == i:
                    single_series = _SeriesResiduals(rows, motion, record.point)
                    residuals[rows.residual_slice] = single_series.residuals.ravel()
                    if has_jacobian:
                        jacobian[rows.residual_slice] = (
                            single_series.differentiate_residuals().reshape(-1, jacobian.shape[1])
                        )
        return ResidualEvaluation(residuals, jacobian)

    def _merge_measurement_times(self, times: Array) -> tuple[Array, list[Indices]]:
        """Return all distinct measurement times, and the indices of each record's times."""
        distinct, inverse = np.unique(times, return_inverse=True)
        ends = np.cumsum([len(record.t) for record in self.records])
        return distinct, np.split(inverse, ends if self._end_time else ends[:-1])

    def _correct_clock_delays(self, point: FitPoint) -> tuple[Array, list[Indices]]:
        """Return the measurement times of all records, corrected for instrument delays."""
        delays = [point.instruments.get(("delay", i, "")) for i in range(len(self.records))]
        if all(delay is None for delay in delays):
            return self._unshifted
        parts = [
            r.t if d is None else r.t - d[0] for r, d in zip(self.records, delays, strict=True)
        ]
        return self._merge_measurement_times(np.concatenate([*parts, self._end_time]))

    def _list_required_tangent_names(self) -> tuple[str, ...]:
        needs = {"start", *self.parameters.free}
        needs |= {"com"} if "lever" in needs else set()
        return tuple(name for name in TANGENTS if name in needs)

    def _solve_both_time_directions(
        self, scene: Scene, t: Array, tangents: tuple[str, ...]
    ) -> tuple[Array, Array]:
        """Return the states and tangents at increasing times, which may be negative."""
        self.evaluations += 1
        split = int(np.searchsorted(t, 0.0))
        parts: list[Path] = []
        for times in (t[:split][::-1], t[split:]):
            if len(times) or not len(t):
                parts.append(self._solve_one_time_direction(scene, times, tangents))
        if not self.max_steps or not tangents:
            steps = max(path.stats.steps for path in parts)
            self.max_steps = max(self.max_steps, _FEWEST_STEPS + _STEPS * steps)
        orders = [slice(None, None, -1)] * (split > 0) + [slice(None)]
        columns = [
            [getattr(path, name)[order] for path, order in zip(parts, orders, strict=False)]
            for name in ("states", *(["tangents"] if tangents else []))
        ]
        states, *tangent_columns = [
            part[0] if len(part) == 1 else np.concatenate(part) for part in columns
        ]
        return states, tangent_columns[0] if tangent_columns else np.empty((len(states), 6, 0))

    def _solve_one_time_direction(self, scene: Scene, t: Array, tangents: tuple[str, ...]) -> Path:
        """Compute the path forwards or backwards in time from the initial state."""
        if not tangents:
            most = min(_STEPS_OF_GUESS * self.max_steps, STEPS_MOST) or STEPS_MOST
            return solve(scene, t, "taylor", max_steps=most)
        names, most = cast(TangentSpec, tangents), self.max_steps or STEPS_MOST
        return solve(scene, t, "taylor", max_steps=most, tangents=names)

    def _differentiate_scene_attributes(self, point: FitPoint) -> Array:
        """Return the Jacobian matrix of the scene's attributes with respect to the parameters."""
        p, places, begin = self.parameters, {}, 0
        for name in self._tangents:
            places[name] = slice(begin, begin + TANGENTS[name][1])
            begin = places[name].stop
        transform = np.zeros((begin, p.size))
        rotation = rotation_matrix(point.attitude)
        for name in p.free:
            part = p.get_parameter_slice(name)
            if name == "attitude":
                transform[:3, part] = np.eye(3)
                transform[3:6, part] = -rotation @ cross_matrix(point.momentum)
                if point.is_support_turning:
                    support = cross_matrix(point.turning @ rotation)
                    transform[3:6, part] += (rotation * point.moments) @ support
            elif name == "velocity":
                transform[3:6, part] = rotation * point.moments
            elif name == "moments":
                transform[3:6, part] = (
                    rotation * point.inertial_velocity
                ) @ p.compute_moments_jacobian()
                transform[places[name], part] = p.compute_moments_jacobian()
            elif name == "lever":
                transform[places["com"], part] = p.lever[:, None]
            elif name == "damping":
                transform[places[name], part] = p.damping
            elif name == "rotor":
                transform[3:6, part] = rotation
                transform[places[name], part] = np.eye(3)
            elif name != "axes":
                transform[places[name], part] = np.eye(part.stop - part.start)
        if p.can_vary("turning"):
            transform[3:6, p.get_parameter_slice("turning")] = (
                rotation * point.moments
            ) @ rotation.T
        if p.can_vary("shaking"):  # the phase at the origin depends on the rate
            transform[places["shaking"].stop - 1, p.get_parameter_slice("shaking").start + 1] = (
                self.origin
            )
        return transform


class SubspaceModel:
    """A least-squares model restricted to a subspace of the parameter space."""

    def __init__(self, model: ResidualModel, projection: Array) -> None:
        self._model, self._allowed, self.evaluations = model, projection, 0
        self.size = model.size
        self.estimate_parameter_scales = model.estimate_parameter_scales
        self.add_step_within_bounds = model.add_step_within_bounds
        self.compute_distances_to_lower_bounds = model.compute_distances_to_lower_bounds

    def evaluate_residuals(self, point: FitPoint) -> ResidualEvaluation:
        evaluations = self._model.evaluations
        residuals, jacobian = self._model.evaluate_residuals(point)
        self.evaluations += self._model.evaluations - evaluations
        self._model.evaluations = evaluations  # the session counts the paths of parts separately
        return ResidualEvaluation(residuals, jacobian @ self._allowed)


class _SeriesResiduals:
    """The residuals of one measured series for given parameters, and their derivatives."""

    def __init__(self, rows: ResidualRows, motion: QuantityPredictor, place: Array | None) -> None:
        self.rows, self.motion = rows, motion
        self.parameters, self.point = motion.parameters, motion.point
        mounting = self._get_instrument_parameter("mounting")
        # the rotation from the frame of description to the instrument
        self.view = None if mounting is None else rotation_matrix(mounting).T
        self.weight = np.where(rows.measured_mask, 1.0 / rows.sigma, 0.0)
        self.residuals = self.weight * (
            self._compute_attitude_residuals()
            if rows.series.is_attitude
            else self._compute_value_residuals(place)
        )

    def _get_instrument_parameter(self, name: str) -> Array | None:
        """Return a fitted property of the measuring instrument, or None if it is not fitted."""
        label = "" if name in ("mounting", "delay") else self.rows.series.name
        return self.point.instruments.get((name, self.rows.record, label))

    def _get_instrument_parameter_columns(self, name: str) -> slice | None:
        """Return the Jacobian columns of an instrument property, or None if it is not fitted."""
        label = "" if name in ("mounting", "delay") else self.rows.series.name
        return self.parameters.slices.get((name, self.rows.record, label))

    def _compute_attitude_residuals(self) -> Array:
        mounting = self._get_instrument_parameter("mounting")
        turn = self.point.axes
        if mounting is not None:
            turn = multiply_quaternions(conjugate_quaternions(mounting), turn)
        attitudes = multiply_quaternions(self.rows.series.values, turn[None])
        inverse = conjugate_quaternions(self.motion.q)
        self.turned = compute_rotation_vectors(multiply_quaternions(inverse, attitudes))
        return -self.turned

    def _compute_value_residuals(self, place: Array | None) -> Array:
        series = self.rows.series
        prediction = self.motion.predict_quantity(series.quantity, place)
        if self.view is not None and series.quantity in SEEN_FROM_BODY:
            prediction = self._transform_prediction_to_instrument(prediction)
        self.whole = prediction.values
        self.found = (
            prediction
            if series.part is None
            else _select_predicted_component(prediction, series.part)
        )
        values, scale, bias = (
            self.found.values,
            self._get_instrument_parameter("scale"),
            self._get_instrument_parameter("bias"),
        )
        values = values if scale is None else values * scale
        change = values - series.values if bias is None else values + bias - series.values
        return wrap_angle(change) if series.is_angle else change

    def _transform_prediction_to_instrument(self, prediction: Prediction) -> Prediction:
        assert self.view is not None
        jacobian = self.view @ prediction.by if prediction.by.size else prediction.by
        rate = prediction.rate @ self.view.T if prediction.rate.size else prediction.rate
        return Prediction(prediction.values @ self.view.T, jacobian, rate)

    def differentiate_residuals(self) -> Array:
        """Return the derivatives of the residuals with respect to the parameters."""
        if self.rows.series.is_attitude:
            jacobian = self._differentiate_attitude_residuals()
        else:
            jacobian = self._differentiate_value_residuals()
        jacobian *= self.weight[:, :, None]
        return jacobian

    def _differentiate_attitude_residuals(self) -> Array:
        p = self.parameters
        left, right = inverse_left_jacobian(self.turned), inverse_left_jacobian(-self.turned)
        jacobian: Array = left @ self.motion.attitude_jacobian
        if p.can_vary("axes"):
            jacobian[:, :, p.get_parameter_slice("axes")] -= right
        mounting, delay = (
            self._get_instrument_parameter_columns("mounting"),
            self._get_instrument_parameter_columns("delay"),
        )
        if mounting is not None and self.view is not None:
            jacobian[:, :, mounting] += (
                right @ (self.view @ self.motion.rotation_from_principal_axes).T
            )
        if delay is not None:
            jacobian[:, :, delay] -= left @ self.motion.state_time_derivatives[:, :3, None]
        return jacobian

    def _differentiate_value_residuals(self) -> Array:
        prediction, part, jacobian = self.found, self.rows.series.part, self.found.by
        mounting, delay = (
            self._get_instrument_parameter_columns("mounting"),
            self._get_instrument_parameter_columns("delay"),
        )
        if mounting is not None and self.rows.series.quantity in SEEN_FROM_BODY:
            skew_matrices = cross_matrix(self.whole)
            jacobian[:, :, mounting] += (
                skew_matrices if part is None else skew_matrices[:, part : part + 1]
            )
        if delay is not None:
            jacobian[:, :, delay] -= prediction.rate[:, :, None]
        scale, scales, bias = (
            self._get_instrument_parameter("scale"),
            self._get_instrument_parameter_columns("scale"),
            self._get_instrument_parameter_columns("bias"),
        )
        width = range(prediction.values.shape[1])
        if scale is not None and scales is not None:
            jacobian *= scale[None, :, None]
            jacobian[:, width, range(scales.start, scales.stop)] += prediction.values
        if bias is not None:
            jacobian[:, width, range(bias.start, bias.stop)] += 1.0
        return jacobian


def _select_predicted_component(prediction: Prediction, part: int) -> Prediction:
    columns = slice(part, part + 1)
    return Prediction(
        prediction.values[:, columns], prediction.by[:, columns], prediction.rate[:, columns]
    )


def find_time_of_large_residuals(rows: ResidualRows, trial: ResidualEvaluation, t: Array) -> float:
    """Return the first time at which the residuals are comparable to the spread of the data."""
    is_measured = rows.measured_mask.any(axis=1)
    if not is_measured.any():
        return np.inf
    scale = np.hypot(rows.series.typical_value_scale, 3.0 * rows.sigma)
    relative = np.minimum(
        np.abs(rows.select_series_residuals(trial.residuals) * rows.sigma / scale), 1.0
    )
    order = np.argsort(t[is_measured], kind="stable")
    error = (relative[is_measured] ** 2).mean(axis=1)[order]
    width = min(max(len(error) // 50, 3), _WINDOW)
    if len(error) > width:
        error = np.convolve(error, np.full(width, 1.0 / width), "valid")
    indices = np.flatnonzero(np.sqrt(error) > _AGREE)
    return float(t[is_measured][order][indices[0]]) if indices.size else np.inf
