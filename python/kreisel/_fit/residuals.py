"""Residuals of records, and their derivatives by the free parameters."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from .._core import derivatives, values
from .._core import tangents as TANGENTS
from .._model.scene import Scene
from .._results.path import Error, Path
from .._results.quantities import SPECIFIC_FORCE, specific_force
from .._solve.solve import solve
from .._solve.tangents import TangentSpec
from .._utils.arguments import Array
from .parameters import (
    FitPoint,
    FreeParameters,
    compute_rotation_vectors,
    conjugate_quaternions,
    cross_matrix,
    inverse_left_jacobian,
    multiply_quaternions,
    rotation_matrix,
    wrap_angle,
)
from .records import MEASURABLE, SEEN_FROM_BODY, Record, Series

_POLE = 1e-9  # least distance from a pole at which an angle about the vertical has a derivative
_START, _SHAKING = TANGENTS["start"][0], TANGENTS["shaking"][0]
_EULER = ("precession_angle", "nutation", "spin_angle")


class Prediction(NamedTuple):
    """Predicted values of a quantity and, if requested, their derivatives.

    by    (n, k, size) by the free parameters of the motion
    rate  (n, k) by time
    """

    values: Array
    by: Array
    rate: Array


@dataclass(frozen=True, eq=False)
class QuantityPredictor:
    """The states of a motion in principal axes, and their derivatives (tangents).

    block      the scene of the point, for the core
    states     (n, 8)
    tangents   (n, 6, c) by the numbers of the scene, or (n, 6, 0)
    bits the flags of the tangents, which select these numbers
    transform  (c, size) derivatives of these numbers with respect to the free parameters
    has_rate   True if time derivatives are needed
    origin     the time of the motion at which the scene begins
    """

    parameters: FreeParameters
    point: FitPoint
    block: bytes
    states: Array
    tangents: Array
    bits: int
    transform: Array
    has_rate: bool
    origin: float = 0.0

    @property
    def q(self) -> Array:
        return self.states[:, 1:5]

    @cached_property
    def rotation_from_principal_axes(self) -> Array:
        return rotation_matrix(self.point.axes)

    @property
    def _is_described_in_principal_axes(self) -> bool:
        return abs(self.point.axes[0]) == 1.0 and not self.parameters.can_vary("axes")

    @cached_property
    def attitude_jacobian(self) -> Array:
        """Derivatives of the attitude, expressed as rotation vectors."""
        jacobian: Array = self.tangents[:, :3] @ self.transform
        return jacobian

    @cached_property
    def state_time_derivatives(self) -> Array:
        """Time derivatives of the attitude (as a rotation vector) and of the angular momentum."""
        rotation, m = rotation_matrix(self.q), self.states[:, 5:]
        rate = values("body_velocity", self.block, self.states)
        change = values("body_acceleration", self.block, self.states)
        # the velocity of the support, seen from the body, changes by the rotation of the body
        change += np.cross(self.point.turning @ rotation, rate)
        body_momentum = (m[:, None] @ rotation)[:, 0]
        gain = self.point.moments * change + np.cross(rate, body_momentum)
        return np.concatenate((rate, (rotation @ gain[:, :, None])[:, :, 0]), axis=1)

    def predict_quantity(self, name: str, place: Array | None = None) -> Prediction:
        """Predict the values of a quantity along the motion."""
        if name == SPECIFIC_FORCE.name:
            assert place is not None
            return self._predict_specific_force(place)
        if name == "spin_angle" and not self._is_described_in_principal_axes:
            return self._predict_spin_angle()
        prediction = self._predict_quantity_of_core(name)
        return (
            self._transform_to_user_body_frame(prediction) if name in SEEN_FROM_BODY else prediction
        )

    def _predict_quantity_of_core(self, name: str) -> Prediction:
        n = len(self.states)
        quantities = values(name, self.block, self.states).reshape(n, MEASURABLE[name].doubles)
        jacobian, rate = np.empty((n, 0, 0)), np.empty((n, 0))
        if self.tangents.shape[2]:
            jacobian = self._differentiate_quantity(name, self.bits, self.tangents) @ self.transform
        if self.has_rate:
            rate = self._differentiate_quantity_by_time(name)
        return Prediction(quantities, jacobian, rate)

    def _differentiate_quantity_by_time(self, name: str) -> Array:
        pace = float(self.point.shaking[1]) if self.point.shaking[0] else 0.0
        directions = np.zeros((len(self.states), 6, 9 if pace else 6))
        directions[:, :, 0] = self.state_time_derivatives
        jacobian = self._differentiate_quantity(
            name, _START | (_SHAKING if pace else 0), directions
        )
        # time changes a quantity by the state and by the phase of the shaking
        return jacobian[:, :, 0] + pace * jacobian[:, :, 8] if pace else jacobian[:, :, 0]

    def _differentiate_quantity(self, name: str, bits: int, tangents: Array) -> Array:
        """Differentiate a quantity, replacing undefined derivatives by zero."""
        n, _, c = tangents.shape
        jacobian = derivatives(name, self.block, self.states, bits, tangents).reshape(
            n, MEASURABLE[name].doubles, c
        )
        if name in _EULER:
            jacobian[self._is_at_pole] = 0.0
        jacobian[np.isnan(jacobian)] = 0.0  # by com, if it is zero
        return jacobian

    @cached_property
    def _is_at_pole(self) -> NDArray[np.bool_]:
        apex = values("apex", self.block, self.states)
        is_at_pole: NDArray[np.bool_] = np.hypot(apex[:, 0], apex[:, 1]) < _POLE
        return is_at_pole

    def _transform_to_user_body_frame(self, prediction: Prediction) -> Prediction:
        """Transform a vector from the principal axes to the user's body frame."""
        if self._is_described_in_principal_axes:
            return prediction
        jacobian = (
            self.rotation_from_principal_axes @ prediction.by
            if prediction.by.size
            else prediction.by
        )
        if jacobian.size and self.parameters.can_vary("axes"):
            jacobian[:, :, self.parameters.get_parameter_slice("axes")] -= (
                self.rotation_from_principal_axes @ cross_matrix(prediction.values)
            )
        rate = (
            prediction.rate @ self.rotation_from_principal_axes.T
            if prediction.rate.size
            else prediction.rate
        )
        return Prediction(prediction.values @ self.rotation_from_principal_axes.T, jacobian, rate)

    def _predict_specific_force(self, place: Array) -> Prediction:
        """Return W' x r + W x (W x r) + g V at the position r, where V is the vertical."""
        change = self._transform_to_user_body_frame(self._predict_angular_acceleration())
        rate = self.predict_quantity("inertial_velocity")
        vertical = self._transform_to_user_body_frame(
            self._predict_quantity_of_core("body_vertical")
        )
        t = self.origin + self.states[:, 0]
        weight = self.point.compute_effective_gravity(t)
        force = specific_force(change.values, rate.values, vertical.values, weight, place)
        change_jacobian = -cross_matrix(place)
        w = rate.values
        rate_jacobian = (
            w[:, :, None] * place
            - 2.0 * place[:, None] * w[:, None]
            + (w @ place)[:, None, None] * np.eye(3)
        )
        jacobian, rates = np.empty((len(w), 0, 0)), np.empty((len(w), 0))
        if change.by.size:
            jacobian = (
                change_jacobian @ change.by
                + rate_jacobian @ rate.by
                + weight[:, None, None] * vertical.by
            )
            for name, gain in self._differentiate_effective_gravity(t):
                jacobian[:, :, self.parameters.get_parameter_slice(name)] += (
                    vertical.values[:, :, None] * gain[:, None]
                )
        if self.has_rate:
            rates = change.rate @ change_jacobian.T + weight[:, None] * vertical.rate
            rates += (rate_jacobian @ rate.rate[:, :, None])[:, :, 0]
            amplitude, pace, phase = self.point.shaking
            rates += (amplitude * pace**3 * np.sin(pace * t + phase))[:, None] * vertical.values
        return Prediction(force, jacobian, rates)

    def _differentiate_effective_gravity(self, t: Array) -> Iterator[tuple[str, Array]]:
        """Yield the derivatives of the acceleration along -e3, one for each free parameter."""
        if self.parameters.can_vary("gravity"):
            yield "gravity", np.ones((len(t), 1))
        if self.parameters.can_vary("shaking"):
            amplitude, pace, phase = self.point.shaking
            angle = pace * t + phase
            sine, cosine = amplitude * pace**2 * np.sin(angle), np.cos(angle)
            rate_derivative = t * sine - 2.0 * amplitude * pace * cosine
            yield "shaking", np.stack((-(pace**2) * cosine, rate_derivative, sine), axis=-1)

    @property
    def _is_on_turning_support(self) -> bool:
        return self.parameters.can_vary("turning") or self.point.is_support_turning

    @cached_property
    def _support_angular_velocity(self) -> Prediction:
        """The angular velocity of the support, in principal-axis components."""
        rotation = rotation_matrix(self.q)
        velocity, jacobian = self.point.turning @ rotation, np.empty((len(rotation), 0, 0))
        if self.tangents.shape[2]:
            jacobian = cross_matrix(velocity) @ self.attitude_jacobian
            if self.parameters.can_vary("turning"):
                jacobian[:, :, self.parameters.get_parameter_slice("turning")] += np.swapaxes(
                    rotation, 1, 2
                )
        rate = (
            np.cross(velocity, self.state_time_derivatives[:, :3])
            if self.has_rate
            else np.empty((len(rotation), 0))
        )
        return Prediction(velocity, jacobian, rate)

    def _predict_angular_acceleration(self) -> Prediction:
        """Predict the angular acceleration relative to the inertial frame."""
        relative = self._predict_quantity_of_core("body_acceleration")
        if not self._is_on_turning_support:
            return relative
        (u, u_jacobian, u_rate), (o, o_jacobian, o_rate) = (
            self._predict_quantity_of_core("body_velocity"),
            self._support_angular_velocity,
        )
        acceleration, jacobian, rate = relative
        if jacobian.size:
            jacobian = jacobian + cross_matrix(o) @ u_jacobian - cross_matrix(u) @ o_jacobian
        if rate.size:
            rate = rate + np.cross(o, u_rate) + np.cross(o_rate, u)
        return Prediction(acceleration + np.cross(o, u), jacobian, rate)

    def _predict_spin_angle(self) -> Prediction:
        """Predict the spin angle if the user's body frame differs from the principal axes."""
        p, axes, n = self.parameters, self.rotation_from_principal_axes, len(self.states)
        body = p.to_scene(self.point)
        states = self.states.copy()
        states[:, 1:5] = multiply_quaternions(self.q, conjugate_quaternions(self.point.axes)[None])
        predictor = QuantityPredictor(
            p, self.point, body._block, states, self.tangents, 0, self.transform, False
        )
        predictor.__dict__["_is_at_pole"] = self._is_at_pole
        identity = np.zeros((n, 6, 9))
        identity[:, range(6), range(6)] = 1.0
        gradient = predictor._differentiate_quantity(
            "spin_angle", _START | TANGENTS["com"][0], identity
        )
        turn_jacobian = gradient[:, :, :3] @ axes
        com_jacobian = gradient[:, :, 6:] @ rotation_matrix(np.array(body.body.axes)).T @ axes
        angle = values("spin_angle", body._block, states)[:, None]
        jacobian, rate = np.empty((n, 0, 0)), np.empty((n, 0))
        if self.tangents.shape[2]:
            jacobian = turn_jacobian @ self.attitude_jacobian
            if p.can_vary("com"):
                jacobian[:, :, p.get_parameter_slice("com")] += com_jacobian
            if p.can_vary("lever"):
                jacobian[:, :, p.get_parameter_slice("lever")] += com_jacobian @ p.lever[:, None]
            if p.can_vary("axes"):
                jacobian[:, :, p.get_parameter_slice("axes")] -= (
                    turn_jacobian + com_jacobian @ cross_matrix(self.point.com)
                )
        if self.has_rate:
            rate = (turn_jacobian @ self.state_time_derivatives[:, :3, None])[:, :, 0]
        return Prediction(angle, jacobian, rate)


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
