"""Residuals of records, and their derivatives by the free parameters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .._core import derivatives, values
from .._core import tangents as TANGENTS
from .._model.scene import Scene
from .._results.results import SPECIFIC_FORCE, Error, specific_force
from .._solve.solve import solve
from .._utils.arguments import Array
from .parameters import (
    BLOCKS,
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
    """Predicted values (n, k) of a quantity, and their derivatives (n, k, columns)."""

    values: Array
    by: Array


@dataclass(frozen=True, eq=False)
class QuantityPredictor:
    """The states of a motion in principal axes, and their derivatives (tangents).

    block      the scene of the point, for the core
    states     (n, 8)
    tangents   (n, 6, c) by the numbers of the scene, or (n, 6, 0)
    bits       the flags of the tangents, which select these numbers
    transform  (c, size) derivatives of these numbers with respect to the free parameters
    places     {block of parameters: its columns of derivatives}, empty without tangents; "time" is
               the column of derivatives by time, if they are needed
    origin     the time of the motion at which the scene begins
    """

    parameters: FreeParameters
    point: FitPoint
    block: bytes
    states: Array
    tangents: Array
    bits: int
    transform: Array
    places: dict[str, slice]
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
        if "time" in self.places:
            jacobian = np.concatenate((jacobian, self._state_time_derivatives[:, :3, None]), axis=2)
        return jacobian

    @cached_property
    def _state_time_derivatives(self) -> Array:
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
        if name == SPECIFIC_FORCE.name:
            assert place is not None
            return self._predict_specific_force(place)
        if name == "spin_angle" and not self._is_described_in_principal_axes:
            return self._predict_spin_angle()
        prediction = self._predict_quantity_of_core(name)
        return self._describe_for_user(prediction) if name in SEEN_FROM_BODY else prediction

    def _predict_quantity_of_core(self, name: str) -> Prediction:
        n = len(self.states)
        predicted = values(name, self.block, self.states).reshape(n, MEASURABLE[name].doubles)
        jacobian = np.empty((*predicted.shape, 0))
        if self.places:
            jacobian = self._differentiate_quantity(name, self.bits, self.tangents) @ self.transform
        if "time" in self.places:  # time changes a quantity by the state and the phase of shaking
            pace = float(self.point.shaking[1]) if self.point.shaking[0] else 0.0
            directions = np.zeros((n, 6, 9 if pace else 6))
            directions[:, :, 0] = self._state_time_derivatives
            bits = _START | (_SHAKING if pace else 0)
            change = self._differentiate_quantity(name, bits, directions)
            change[:, :, 0] += pace * change[:, :, -1] if pace else 0.0
            jacobian = np.concatenate((jacobian, change[:, :, :1]), axis=2)
        return Prediction(predicted, jacobian)

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

    def _describe_for_user(self, prediction: Prediction) -> Prediction:
        if self._is_described_in_principal_axes:
            return prediction
        rotation = self.rotation_from_principal_axes
        jacobian = rotation @ prediction.by
        if "axes" in self.places:
            jacobian[:, :, self.places["axes"]] -= rotation @ cross_matrix(prediction.values)
        return Prediction(prediction.values @ rotation.T, jacobian)

    def _predict_specific_force(self, place: Array) -> Prediction:
        """Return W' x r + W x (W x r) + g V at the position r, where V is the vertical."""
        change = self._describe_for_user(self._predict_angular_acceleration())
        rate = self.predict_quantity("inertial_velocity")
        vertical = self._describe_for_user(self._predict_quantity_of_core("body_vertical"))
        t = self.origin + self.states[:, 0]
        weight = self.point.compute_effective_gravity(t)
        force = specific_force(change.values, rate.values, vertical.values, weight, place)
        w = rate.values
        by_rate = (
            w[:, :, None] * place
            - 2.0 * place[:, None] * w[:, None]
            + (w @ place)[:, None, None] * np.eye(3)
        )
        jacobian = -cross_matrix(place) @ change.by + by_rate @ rate.by
        jacobian += weight[:, None, None] * vertical.by
        amplitude, pace, phase = self.point.shaking
        sine, cosine = np.sin(pace * t + phase), np.cos(pace * t + phase)
        by_angle = amplitude * pace**2 * sine
        by_pace = t * by_angle - 2.0 * amplitude * pace * cosine
        weight_jacobians = {
            "gravity": np.ones((len(t), 1)),
            "shaking": np.stack((-(pace**2) * cosine, by_pace, by_angle), axis=-1),
            "time": pace * by_angle[:, None],
        }
        for name, gain in weight_jacobians.items():
            if name in self.places:
                jacobian[:, :, self.places[name]] += vertical.values[:, :, None] * gain[:, None]
        return Prediction(force, jacobian)

    def _predict_angular_acceleration(self) -> Prediction:
        """Predict the angular acceleration relative to the inertial frame."""
        acceleration, jacobian = self._predict_quantity_of_core("body_acceleration")
        if not (self.parameters.can_vary("turning") or self.point.is_support_turning):
            return Prediction(acceleration, jacobian)
        u, u_jacobian = self._predict_quantity_of_core("body_velocity")
        rotation = rotation_matrix(self.q)
        o = self.point.turning @ rotation  # the angular velocity of the support
        o_jacobian = cross_matrix(o) @ self.attitude_jacobian
        if "turning" in self.places:
            o_jacobian[:, :, self.places["turning"]] += np.swapaxes(rotation, 1, 2)
        jacobian = jacobian + cross_matrix(o) @ u_jacobian - cross_matrix(u) @ o_jacobian
        return Prediction(acceleration + np.cross(o, u), jacobian)

    def _predict_spin_angle(self) -> Prediction:
        p, axes = self.parameters, self.rotation_from_principal_axes
        scene = p.to_scene(self.point)
        states = self.states.copy()
        states[:, 1:5] = multiply_quaternions(self.q, conjugate_quaternions(self.point.axes)[None])
        angle = values("spin_angle", scene._block, states)[:, None]
        if not self.places:
            return Prediction(angle, np.empty((*angle.shape, 0)))
        predictor = replace(self, block=scene._block, states=states)
        predictor.__dict__["_is_at_pole"] = self._is_at_pole
        identity = np.zeros((len(states), 6, 9))
        identity[:, range(6), range(6)] = 1.0
        by = predictor._differentiate_quantity("spin_angle", _START | TANGENTS["com"][0], identity)
        by_turn = by[:, :, :3] @ axes
        by_com = by[:, :, 6:] @ rotation_matrix(np.array(scene.body.axes)).T @ axes
        jacobian = by_turn @ self.attitude_jacobian
        for name in ("com", "lever"):
            if name in self.places:
                jacobian[:, :, self.places[name]] += by_com @ p.columns[name]
        if "axes" in self.places:
            change = by_turn + by_com @ cross_matrix(self.point.com)
            jacobian[:, :, self.places["axes"]] -= change
        return Prediction(angle, jacobian)


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
    def measured_mask(self) -> np.ndarray[tuple[int, ...], np.dtype[np.bool_]]:
        return self.series.measured[:, : self.series.residuals_per_row]

    @property
    def residual_slice(self) -> slice:
        return slice(self.begin, self.begin + self.measured_mask.size)

    def select_series_residuals(self, residuals: Array) -> Array:
        """Return the residuals of the series, as an array of shape (n, width)."""
        return residuals[self.residual_slice].reshape(self.measured_mask.shape)


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
        series = [(i, one) for i, record in enumerate(records) for one in record.series]
        rows, self.size = [], 0
        for (i, one), sigma in zip(series, sigmas, strict=True):
            rows.append(ResidualRows(i, one, sigma, self.size))
            self.size = rows[-1].residual_slice.stop
        self.rows = tuple(rows)
        self.measured = np.concatenate([rows.measured_mask.ravel() for rows in self.rows])
        self.evaluations = 0
        self.end: SegmentEndState | None = None
        self._end_time = [] if end is None else [end]
        times = np.concatenate([*(record.t for record in records), self._end_time])
        self.span = max(float(np.ptp(times)), float(np.abs(times).max()), 1e-300)
        self._unshifted = self._merge_measurement_times(times)
        self.max_steps = 0
        needs = {"start", *(BLOCKS[name].tangent for name in parameters.free)}
        self._tangents = tuple(name for name in TANGENTS if name in needs)
        self._places = {n: part for (n, i, _), part in parameters.slices.items() if i < 0}
        self.add_step_within_bounds = parameters.add_step_within_bounds
        self.compute_distances_to_lower_bounds = parameters.compute_distances_to_lower_bounds

    def estimate_parameter_scales(self, point: FitPoint) -> Array:
        return self.parameters.estimate_parameter_scales(point, self.span)

    def evaluate_residuals(self, point: FitPoint, has_jacobian: bool = True) -> ResidualEvaluation:
        """Return the residuals for given parameters, or inf if the motion cannot be computed."""
        try:
            return self._evaluate_residuals(point, has_jacobian)
        except (Error, ValueError, np.linalg.LinAlgError):
            return ResidualEvaluation(
                np.full(self.size, np.inf), np.zeros((self.size, self.parameters.size))
            )

    def _evaluate_residuals(self, point: FitPoint, has_jacobian: bool) -> ResidualEvaluation:
        p, places = self.parameters, self._places if has_jacobian else {}
        delays = [point.instruments.get(("delay", i, "")) for i in range(len(self.records))]
        times, time_indices = self._unshifted
        if any(delay is not None for delay in delays):
            pairs = zip(self.records, delays, strict=True)
            parts = [record.t if d is None else record.t - d[0] for record, d in pairs]
            times, time_indices = self._merge_measurement_times(
                np.concatenate([*parts, self._end_time])
            )
        scene = p.build_differentiable_scene(point, self.origin)
        states, tangents = self._solve_both_time_directions(
            scene, times, self._tangents if has_jacobian else ()
        )
        transform = np.empty((0, 0))
        if has_jacobian:
            transform = p.differentiate_scene(point, self._tangents, self.origin)
        if self._end_time:
            last = int(time_indices[-1][0])
            self.end = SegmentEndState(
                states[last, 1:5], states[last, 5:], tangents[last] @ transform
            )
        bits = sum(TANGENTS[name][0] for name in self._tangents)
        residuals = np.zeros(self.size)
        jacobian = np.zeros((self.size if has_jacobian else 0, p.size))
        for i, record in enumerate(self.records):
            solution = states[time_indices[i]], tangents[time_indices[i]], bits, transform
            columns = places
            if has_jacobian and "delay" in record.free:
                columns = places | {"time": slice(p.size, p.size + 1)}
            motion = QuantityPredictor(p, point, scene._block, *solution, columns, self.origin)
            for rows in self.rows:
                if rows.record == i:
                    found, change = _compute_series_residuals(rows, motion, record.point)
                    residuals[rows.residual_slice] = found.ravel()
                    if has_jacobian:
                        jacobian[rows.residual_slice] = change.reshape(-1, p.size)
        return ResidualEvaluation(residuals, jacobian)

    def _merge_measurement_times(self, times: Array) -> tuple[Array, list[Indices]]:
        """Return all distinct measurement times, and the indices of each record's times."""
        distinct, inverse = np.unique(times, return_inverse=True)
        ends = np.cumsum([len(record.t) for record in self.records])
        return distinct, np.split(inverse, ends if self._end_time else ends[:-1])

    def _solve_both_time_directions(
        self, scene: Scene, t: Array, tangents: tuple[str, ...]
    ) -> tuple[Array, Array]:
        """Return the states and tangents at increasing times, which may be negative."""
        self.evaluations += 1
        most = self.max_steps or STEPS_MOST
        if not tangents:
            most = min(_STEPS_OF_GUESS * self.max_steps, STEPS_MOST) or STEPS_MOST
        words: dict[str, Any] = {"tangents": tangents} if tangents else {}
        split, parts = int(np.searchsorted(t, 0.0)), []
        for times, order in ((t[:split][::-1], -1), (t[split:], 1)):
            if len(times) or not len(t):
                path = solve(scene, times, "taylor", max_steps=most, **words)
                parts.append((path, order))
        if not self.max_steps or not tangents:
            steps = max(path.stats.steps for path, _ in parts)
            self.max_steps = max(self.max_steps, _FEWEST_STEPS + _STEPS * steps)
        states = np.concatenate([path.states[::order] for path, order in parts])
        if not tangents:
            return states, np.empty((len(states), 6, 0))
        return states, np.concatenate([path.tangents[::order] for path, order in parts])


def _compute_series_residuals(
    rows: ResidualRows, motion: QuantityPredictor, place: Array | None
) -> tuple[Array, Array]:
    """Return the residuals (n, k) of a measured series, and their derivatives (n, k, size)."""
    series, p, point, i = rows.series, motion.parameters, motion.point, rows.record
    keys = {name: (name, i, "") for name in ("mounting", "delay")}
    keys |= {name: (name, i, series.name) for name in ("scale", "bias")}
    instrument = {n: point.instruments[key] for n, key in keys.items() if key in p.slices}
    columns = {n: p.slices[keys[n]] for n in instrument} if motion.places else {}
    weight = np.where(rows.measured_mask, 1.0 / rows.sigma, 0.0)
    # the rotation from the frame of description to the instrument
    view = rotation_matrix(instrument["mounting"]).T if "mounting" in instrument else None
    if series.is_attitude:
        turn = point.axes
        if view is not None:
            turn = multiply_quaternions(conjugate_quaternions(instrument["mounting"]), turn)
        attitudes = multiply_quaternions(series.values, turn[None])
        inverse = conjugate_quaternions(motion.q)
        turned = compute_rotation_vectors(multiply_quaternions(inverse, attitudes))
        change = -turned
        if not motion.places:
            return weight * change, np.empty((*change.shape, 0))
        left, right = inverse_left_jacobian(turned), inverse_left_jacobian(-turned)
        jacobian: Array = left @ motion.attitude_jacobian
        if "axes" in motion.places:
            jacobian[:, :, motion.places["axes"]] -= right
        if view is not None:
            axes = motion.rotation_from_principal_axes
            jacobian[:, :, columns["mounting"]] += right @ (view @ axes).T
    else:
        found, jacobian = motion.predict_quantity(series.quantity, place)
        if view is not None and series.quantity in SEEN_FROM_BODY:
            found, jacobian = found @ view.T, view @ jacobian
            if "mounting" in columns:
                jacobian[:, :, columns["mounting"]] += cross_matrix(found)
        if series.part is not None:
            part = slice(series.part, series.part + 1)
            found, jacobian = found[:, part], jacobian[:, part]
        shown, width = found, range(found.shape[1])
        if "scale" in instrument:
            shown = found * instrument["scale"]
            jacobian = jacobian * instrument["scale"][None, :, None]
        if "bias" in instrument:
            shown = shown + instrument["bias"]
        change = shown - series.values
        if series.is_angle:
            change = wrap_angle(change)
        for name, gain in ("scale", found), ("bias", 1.0):
            if name in columns:
                part = columns[name]
                jacobian[:, width, range(part.start, part.stop)] += gain
    if "delay" in columns:
        jacobian[:, :, columns["delay"]] -= jacobian[:, :, motion.places["time"]]
    if motion.places:
        jacobian = weight[:, :, None] * jacobian[:, :, : p.size]
    return weight * change, jacobian


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
