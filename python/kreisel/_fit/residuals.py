"""Residuals of records, their derivatives by the free parameters, and their least squares."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Literal, NamedTuple

import numpy as np

from .._core import derivatives, values
from .._core import tangents as TANGENTS
from .._model.scene import Scene
from .._results.path import Path
from .._results.results import SPECIFIC_FORCE, Error, specific_force
from .._solve.solve import solve
from .._utils.arguments import Array, spell
from . import rotations
from .parameters import BLOCKS, FitPoint, FreeParameters, Places
from .records import MEASURABLE, SEEN_FROM_BODY, Mask, Record, Series, slice_record

_POLE = 1e-9  # least distance from a pole at which an angle about the vertical has a derivative
_START, _SHAKING = TANGENTS["start"][0], TANGENTS["shaking"][0]
_EULER = ("precession_angle", "nutation", "spin_angle")
Prediction = tuple[Array, Array]  # values (n, k) of a quantity, their derivatives (n, k, columns)


@dataclass(frozen=True, eq=False)
class QuantityPredictor:
    """The states of a motion in principal axes, and their derivatives (tangents).

    block      the scene of the point, for the core
    states     (n, 8)
    tangents   (n, 6, c) by the numbers of the scene, or (n, 6, 0)
    bits       the flags of the tangents, which select these numbers
    transform  (c, width) derivatives of these numbers with respect to the free parameters
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
    places: Places
    origin: float

    @property
    def q(self) -> Array:
        return self.states[:, 1:5]

    @cached_property
    def rotation_from_principal_axes(self) -> Array:
        return rotations.to_matrix(self.point.axes)

    @property
    def _is_described_in_principal_axes(self) -> bool:
        return abs(self.point.axes[0]) == 1.0 and "axes" not in self.parameters.places

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
        rotation, m = rotations.to_matrix(self.q), self.states[:, 5:]
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
        return self._describe_for_user(*prediction) if name in SEEN_FROM_BODY else prediction

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
        return predicted, jacobian

    def _differentiate_quantity(self, name: str, bits: int, tangents: Array) -> Array:
        """Differentiate a quantity, replacing undefined derivatives by zero."""
        n, _, c = tangents.shape
        jacobian = derivatives(name, self.block, self.states, bits, tangents).reshape(
            n, MEASURABLE[name].doubles, c
        )
        if name in _EULER:
            apex = values("apex", self.block, self.states)
            jacobian[np.hypot(apex[:, 0], apex[:, 1]) < _POLE] = 0.0
        jacobian[np.isnan(jacobian)] = 0.0  # by com, if it is zero
        return jacobian

    def _describe_for_user(self, predicted: Array, jacobian: Array) -> Prediction:
        if self._is_described_in_principal_axes:
            return predicted, jacobian
        rotation = self.rotation_from_principal_axes
        jacobian = rotation @ jacobian
        if "axes" in self.places:
            jacobian[:, :, self.places["axes"]] -= rotation @ rotations.cross(predicted)
        return predicted @ rotation.T, jacobian

    def _predict_specific_force(self, place: Array) -> Prediction:
        """Return W' x r + W x (W x r) + g V - k (<V, r> V - r / 3) at the position r."""
        change, by_change = self._describe_for_user(*self._predict_angular_acceleration())
        w, by_w = self.predict_quantity("inertial_velocity")
        vertical, by_vertical = self._describe_for_user(
            *self._predict_quantity_of_core("body_vertical")
        )
        t = self.origin + self.states[:, 0]
        weight = self.point.compute_effective_gravity(t)
        gradient = self.point.gradient
        force = specific_force(change, w, vertical, weight, place, gradient)
        by_rate = (
            w[:, :, None] * place
            - 2.0 * place[:, None] * w[:, None]
            + (w @ place)[:, None, None] * np.eye(3)
        )
        jacobian = -rotations.cross(place) @ by_change + by_rate @ by_w
        height = (vertical @ place)[:, None, None]
        jacobian += (weight[:, None, None] - gradient * height) * by_vertical
        jacobian -= gradient * vertical[:, :, None] * (place @ by_vertical)[:, None, :]
        if "gradient" in self.places:
            tide = height * vertical[:, :, None] - place[:, None] / 3.0
            jacobian[:, :, self.places["gradient"]] -= tide
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
                jacobian[:, :, self.places[name]] += vertical[:, :, None] * gain[:, None]
        return force, jacobian

    def _predict_angular_acceleration(self) -> Prediction:
        """Predict the angular acceleration relative to the inertial frame."""
        acceleration, jacobian = self._predict_quantity_of_core("body_acceleration")
        if "turning" not in self.parameters.places and not self.point.turning.any():
            return acceleration, jacobian
        u, u_jacobian = self._predict_quantity_of_core("body_velocity")
        rotation = rotations.to_matrix(self.q)
        o = self.point.turning @ rotation  # the angular velocity of the support
        o_jacobian = rotations.cross(o) @ self.attitude_jacobian
        if "turning" in self.places:
            o_jacobian[:, :, self.places["turning"]] += np.swapaxes(rotation, 1, 2)
        jacobian = jacobian + rotations.cross(o) @ u_jacobian - rotations.cross(u) @ o_jacobian
        return acceleration + np.cross(o, u), jacobian

    def _predict_spin_angle(self) -> Prediction:
        p, axes = self.parameters, self.rotation_from_principal_axes
        scene = p.to_scene(self.point)
        states = self.states.copy()
        states[:, 1:5] = rotations.multiply(self.q, rotations.conjugate(self.point.axes)[None])
        angle = values("spin_angle", scene._block, states)[:, None]
        if not self.places:
            return angle, np.empty((*angle.shape, 0))
        predictor = replace(self, block=scene._block, states=states)
        identity = np.zeros((len(states), 6, 9))
        identity[:, range(6), range(6)] = 1.0
        by = predictor._differentiate_quantity("spin_angle", _START | TANGENTS["com"][0], identity)
        by_turn = by[:, :, :3] @ axes
        by_com = by[:, :, 6:] @ rotations.to_matrix(np.array(scene.body.axes)).T @ axes
        jacobian = by_turn @ self.attitude_jacobian
        for name in ("com", "lever"):
            if name in self.places:
                jacobian[:, :, self.places[name]] += by_com @ p.columns[name]
        if "axes" in self.places:
            change = by_turn + by_com @ rotations.cross(self.point.com)
            jacobian[:, :, self.places["axes"]] -= change
        return angle, jacobian


class ResidualRows(NamedTuple):
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
    def measured_mask(self) -> Mask:
        return self.series.measured[:, : self.series.residuals_per_row]

    @property
    def residual_slice(self) -> slice:
        return slice(self.begin, self.begin + self.measured_mask.size)

    def select_series_residuals(self, residuals: Array) -> Array:
        """Return the residuals of the series, as an array of shape (n, width)."""
        return residuals[self.residual_slice].reshape(self.measured_mask.shape)

    def compute_residuals(self, motion: QuantityPredictor, place: Array | None) -> Prediction:
        """Return the residuals (n, k) of the series, and their derivatives (n, k, width)."""
        series, p, point, i = self.series, motion.parameters, motion.point, self.record
        keys = {name: (name, i, "") for name in ("mounting", "delay")}
        keys |= {name: (name, i, series.name) for name in ("scale", "bias")}
        instrument = {n: point.extra[key] for n, key in keys.items() if key in p.slices}
        columns = {n: p.slices[keys[n]] for n in instrument} if motion.places else {}
        weight = np.where(self.measured_mask, 1.0 / self.sigma, 0.0)
        mounting = instrument.get("mounting", rotations.UNTURNED)
        # the rotation from the frame of description to the instrument
        view = rotations.to_matrix(mounting).T if "mounting" in instrument else None
        if series.is_attitude:
            turn = rotations.multiply(rotations.conjugate(mounting), point.axes)
            measured = rotations.multiply(series.values, turn[None])
            change = -rotations.difference(motion.q, measured)
            if not motion.places:
                return weight * change, np.empty((*change.shape, 0))
            left, right = map(rotations.inverse_left_jacobian, (-change, change))
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
                    jacobian[:, :, columns["mounting"]] += rotations.cross(found)
            if series.part is not None:
                part = slice(series.part, series.part + 1)
                found, jacobian = found[:, part], jacobian[:, part]
            scale, width = instrument.get("scale", 1.0), range(found.shape[1])
            change = found * scale + instrument.get("bias", 0.0) - series.values
            jacobian = jacobian * np.reshape(scale, (-1, 1))
            if series.is_angle:
                change = rotations.wrap(change)
            for name, gain in ("scale", found), ("bias", 1.0):
                if name in columns:
                    part = columns[name]
                    jacobian[:, width, range(part.start, part.stop)] += gain
        if "delay" in columns:
            jacobian[:, :, columns["delay"]] -= jacobian[:, :, motion.places["time"]]
        if motion.places:
            jacobian = weight[:, :, None] * jacobian[:, :, : p.width]
        return weight * change, jacobian


_STEPS = 4  # a trial may take this many times the steps of the guesses
_STEPS_OF_GUESS = 10  # a guess may take this many times the steps of earlier guesses
STEPS_MOST = 10**6  # steps of a guess, and of a trial before the path of any guess is known
_FEWEST_STEPS = 1000
LossName = Literal["linear", "soft"]


def solve_from_start(scene: Scene, t: Array, **words: Any) -> list[Path]:
    """Return the paths from the start at t = 0 through increasing times, back and forth."""
    parts = [part for part in (t[t < 0.0][::-1], t[t >= 0.0]) if len(part)] or [t]
    return [solve(scene, part, "taylor", **words) for part in parts]


def join_paths(paths: Sequence[Path], name: str) -> Array:
    """Return an attribute of the paths of `solve_from_start` at increasing times."""
    return np.concatenate([getattr(x, name)[:: -1 if (x.t < 0.0).any() else 1] for x in paths])


class Piece(NamedTuple):
    """A part of the motion with its own start: its times, up to that of the next piece."""

    begin: float
    end: float | None
    times: list[Array]
    rows: list[ResidualRows]


class ResidualModel:
    """The residuals of the measurements as functions of the parameters.

    parameters   the free parameters, with the starts of the pieces
    rows         the series and their places in the residuals
    size         the number of residuals; rows that were not measured are zero. Six for each gap
                 between two pieces follow those of the series
    measured     (size,) True for measured values
    loss         "linear" or "soft"
    begins       the times at which the pieces of the motion begin, one of which is 0
    gap          standard deviation of the gaps between the pieces [rad]
    evaluations  the number of paths computed so far
    max_steps    the largest number of steps of a trial, or 0 if no path is known
    """

    def __init__(
        self,
        parameters: FreeParameters,
        records: Sequence[Record],
        sigmas: Sequence[Array],
        loss: LossName,
        begins: Sequence[float] = (0.0,),
    ) -> None:
        self.records, self.loss, self.begins, self.gap = tuple(records), loss, tuple(begins), 1.0
        self.parameters = parameters.with_piece_starts(k for k, t in enumerate(begins) if t)
        series = [(i, one) for i, record in enumerate(records) for one in record.series]
        self.rows: list[ResidualRows] = []
        self.size = 0
        for (i, one), sigma in zip(series, sigmas, strict=True):
            self.rows.append(ResidualRows(i, one, sigma, self.size))
            self.size = self.rows[-1].residual_slice.stop
        gaps = np.zeros(6 * (len(self.begins) - 1), dtype=bool)
        masks = [rows.measured_mask.ravel() for rows in self.rows]
        self.measured = np.concatenate((*masks, gaps))
        self.size = len(self.measured)
        self.pieces = [self._select_piece(k) for k in range(len(self.begins))]
        times = np.concatenate([record.t for record in records])
        self.span = max(float(np.ptp(times)), float(np.abs(times).max()), 1e-300)
        self.evaluations = self.max_steps = 0
        needs = {"start", *(BLOCKS[name].tangent for name in parameters.free)}
        self._tangents = tuple(name for name in TANGENTS if name in needs)

    def _select_piece(self, k: int) -> Piece:
        begin, end = self.begins[k], [*self.begins, None][k + 1]
        edges = begin if k else -np.inf, np.inf if end is None else end
        spans = [np.searchsorted(record.t, edges).tolist() for record in self.records]
        pairs = zip(self.records, spans, strict=True)
        parts = [slice_record(record, low, high, begin) for record, (low, high) in pairs]
        rows, series = [], [iter(part.series) for part in parts]
        for i, _, sigma, first in self.rows:
            low, high = spans[i]
            first += low * sigma.shape[1]
            rows.append(ResidualRows(i, next(series[i]), sigma[low:high], first))
        span = None if end is None else end - begin
        return Piece(begin, span, [part.t for part in parts], rows)

    def estimate_parameter_scales(self, point: FitPoint) -> Array:
        return self.parameters.estimate_parameter_scales(point, self.span)

    def compute_cost(self, residuals: Array) -> float:
        """Return the sum of r^2, or of 2 (sqrt(1 + r^2) - 1) for the soft loss, if it is finite."""
        with np.errstate(all="ignore"):
            if self.loss == "linear":
                cost = float(residuals @ residuals)
            else:
                cost = float(2.0 * (np.hypot(1.0, residuals) - 1.0).sum())
        return cost if np.isfinite(cost) else np.inf

    def evaluate_residuals(self, point: FitPoint, has_jacobian: bool = True) -> tuple[Array, Array]:
        """Return the residuals and their Jacobian, or inf if the motion cannot be computed."""
        self.evaluations += 1
        residuals = np.zeros(self.size)
        jacobian = np.zeros((self.size if has_jacobian else 0, self.parameters.width))
        row, end = self.size - 6 * (len(self.pieces) - 1), None
        try:
            for k in range(len(self.pieces)):
                own = point.at_piece(k) if self.begins[k] else point
                if end is not None:
                    rows, row = slice(row, row + 6), row + 6
                    residuals[rows], change = self._compute_gap(*end, own, k)
                    if has_jacobian:
                        jacobian[rows] = change
                end = self._evaluate_piece(k, own, residuals, jacobian if has_jacobian else None)
        except (Error, ValueError, np.linalg.LinAlgError):
            residuals[:] = np.inf
        return residuals, jacobian

    def _evaluate_piece(
        self, k: int, point: FitPoint, residuals: Array, jacobian: Array | None
    ) -> tuple[Array, Array, Array] | None:
        """Fill the rows of piece k, and return q, m and their derivatives at its end, if any."""
        p, (begin, end, record_times, piece_rows) = self.parameters, self.pieces[k]
        places: Places = {} if jacobian is None else p.places_of_piece(k)
        times = point.subtract_delays(record_times)
        times += [] if end is None else [np.array([end])]
        distinct, inverse = np.unique(np.concatenate(times), return_inverse=True)
        indices = np.split(inverse, np.cumsum([len(t) for t in times]))
        scene = p.build_differentiable_scene(point, begin)
        if jacobian is None:
            most = min(_STEPS_OF_GUESS * self.max_steps, STEPS_MOST) or STEPS_MOST
            paths = solve_from_start(scene, distinct, max_steps=most)
            tangents, transform = np.empty((len(distinct), 6, 0)), np.empty((0, 0))
        else:
            most = self.max_steps or STEPS_MOST
            paths = solve_from_start(scene, distinct, max_steps=most, tangents=self._tangents)
            tangents = join_paths(paths, "tangents")
            transform = p.differentiate_scene(point, self._tangents, begin, places)
        if jacobian is None or not self.max_steps:
            steps = _FEWEST_STEPS + _STEPS * max(path.stats.steps for path in paths)
            self.max_steps = max(self.max_steps, steps)
        states = join_paths(paths, "states")
        bits = sum(TANGENTS[name][0] for name in self._tangents)
        for i, record in enumerate(self.records):
            columns = places
            if jacobian is not None and "delay" in record.free:
                columns = places | {"time": slice(p.width, p.width + 1)}
            solution = states[indices[i]], tangents[indices[i]], bits, transform
            motion = QuantityPredictor(p, point, scene._block, *solution, columns, begin)
            for rows in piece_rows:
                if rows.record == i:
                    found, change = rows.compute_residuals(motion, record.point)
                    residuals[rows.residual_slice] = found.ravel()
                    if jacobian is not None:
                        jacobian[rows.residual_slice] = change.reshape(-1, p.width)
        if end is None:
            return None
        last = int(indices[len(self.records)][0])
        return states[last, 1:5], states[last, 5:], tangents[last] @ transform

    def _compute_gap(
        self, q: Array, m: Array, by: Array, point: FitPoint, k: int
    ) -> tuple[Array, Array]:
        """Return the jump from a state (q, m) to the start of piece k, and its derivatives."""
        p, places = self.parameters, self.parameters.places_of_piece(k)
        turn = rotations.difference(q, point.attitude)
        rate = point.relative_angular_velocity(q, m)
        scale = float(np.linalg.norm(rate)) or 1.0
        gap = np.concatenate((turn, (point.rate - rate) / scale)) / self.gap
        if not by.size:
            return gap, by
        momentum = point.start_at(q, rate).differentiate_momentum()
        change = by[3:] - momentum["attitude"] @ by[:3]  # of the momentum, at a fixed attitude
        for name in {"moments", "rotor", "turning"} & p.places.keys():
            change[:, p.places[name]] -= momentum[name] @ p.columns[name]
        rate_jacobian = rotations.to_matrix(q).T @ change / point.moments[:, None]
        left, right = map(rotations.inverse_left_jacobian, (turn, -turn))
        jacobian = -np.concatenate((left @ by[:3], rate_jacobian / scale))
        if "attitude" in places:
            jacobian[:3, places["attitude"]] += right
        if "velocity" in places:
            jacobian[3:, places["velocity"]] += np.eye(3) / scale
        return gap, jacobian / self.gap


# Along eigenvectors of J^T J with weaker eigenvalues, one sigma is larger than the natural size.
# They are followed only if the cost falls by more than noise explains.
_WEAKEST = 1.0
_RANK_RTOL = 1e-13  # smaller eigenvalues of J^T J are rounding errors, relative to the largest
_CHANCE = 9.0  # decrease of the cost that noise explains, relative to the mean square residual
_DAMPING = 1e-6  # first damping, relative to the largest eigenvalue (to the median one in pieces)
_DAMPING_MOST = 1e3
_DAMPING_LEAST = 1e-14
_FACTOR = 16.0  # change of the damping after a failed and after a successful step
_FAR = 100.0  # mean square residual of points that are far from the records
_FAR_MEDIAN = 6.0  # the same for the median of the absolute residuals, without outliers
_SLOW = 1e-2  # relative improvement there that is slow
_SLOW_MOST = 5  # slow improvements in succession after which a search far away ends
_NOISELESS = 1e-22  # mean square residual that is rounding error


class Minimum(NamedTuple):
    """The point with the lowest cost that a search has found.

    has_converged  False if the search ended at its limit, or if no cost was finite
    """

    model: ResidualModel
    point: FitPoint
    residuals: Array
    jacobian: Array
    cost: float
    has_converged: bool

    @property
    def scaled_jacobian(self) -> Array:
        scaled: Array = self.jacobian * self.model.estimate_parameter_scales(self.point)
        return scaled


def minimize_cost(
    model: ResidualModel,
    point: FitPoint,
    limit: int,
    ftol: float,
    report: Callable[[Minimum], None] = lambda _: None,
) -> Minimum:
    """Search for a local minimum of the cost by the method of Levenberg and Marquardt.

    limit   the largest number of evaluations
    ftol    relative improvement of the cost that ends the search
    report  a function that receives each improved minimum

    Each iteration increases the damping of a Gauss-Newton step until the cost does not rise. The
    search stops early if the residuals are large and hardly decrease.
    """
    parameters, natural = model.parameters, model.estimate_parameter_scales(point)
    last = model.evaluations + limit
    residuals, jacobian = model.evaluate_residuals(point)
    best = Minimum(model, point, residuals, jacobian, model.compute_cost(residuals), False)
    if not np.isfinite(best.cost):
        return best
    report(best)
    damping, slow_count = _DAMPING, 0
    while model.evaluations < last:
        if best.cost <= _NOISELESS * model.size:
            return best._replace(has_converged=True)
        residuals, scaled = best.residuals, best.jacobian * natural
        if model.loss == "soft":
            weight = (1.0 + residuals**2) ** -0.25
            residuals, scaled = residuals * weight, scaled * weight[:, None]
        gradient = scaled.T @ residuals
        # steps along these parameters would leave the bounds
        distances = parameters.compute_distances_to_lower_bounds(best.point)
        is_held = (distances <= 0.0) & (gradient > 0.0)
        scaled[:, is_held] = 0.0
        values, vectors = np.linalg.eigh(scaled.T @ scaled)
        along = vectors.T @ np.where(is_held, 0.0, gradient)
        excess = max(float(np.mean(residuals**2)), 1.0)
        is_seen = values > _RANK_RTOL * values[-1]
        is_seen &= (values > _WEAKEST) | (along**2 > _CHANCE * excess * values)
        # the gaps between pieces have far smaller sigmas
        scale = float(np.median(values)) if len(model.pieces) > 1 else float(values[-1])
        gain = -1.0
        while gain < 0.0:
            divisor = values + damping * scale
            part = np.divide(along, divisor, out=np.zeros_like(divisor), where=is_seen)
            candidate = parameters.add_step_within_bounds(best.point, -natural * (vectors @ part))
            residuals, jacobian = model.evaluate_residuals(candidate)
            cost = model.compute_cost(residuals)
            gain = best.cost - cost
            predicted = float(along[is_seen] ** 2 @ (1.0 / divisor[is_seen]))
            is_stuck = damping > _DAMPING_MOST or predicted <= ftol * best.cost * 1e-2
            if gain < 0.0 and (is_stuck or model.evaluations >= last):
                return best._replace(has_converged=model.evaluations < last)
            damping = damping * _FACTOR if gain < 0.0 else max(damping / _FACTOR, _DAMPING_LEAST)
        best = Minimum(model, candidate, residuals, jacobian, cost, False)
        report(best)
        if model.loss == "linear":
            is_far = cost > _FAR * model.size
        else:
            is_far = bool(np.median(np.abs(residuals)) > _FAR_MEDIAN)
        slow_count = slow_count + 1 if gain < _SLOW * cost and is_far else 0
        if gain <= ftol * cost or slow_count > _SLOW_MOST:
            return best._replace(has_converged=True)
    return best


_FEWEST = 6  # values that an estimate needs
_UNKNOWN = 0.1  # standard deviation without an estimate, relative to the spread
_LEAST = 1e-12  # least standard deviation, relative to the spread
_NO_DOF = 0.5  # degrees of freedom from which a standard deviation cannot be estimated
_FEW_DOF = 4.0  # degrees of freedom from which the estimate is reliable
MEDIAN = 1.4826  # standard deviation of a normal distribution, relative to its median deviation


def estimate_initial_sigmas(records: Sequence[Record]) -> list[Array]:
    """Return the standard deviations of each series, either given or estimated from its values."""
    series = [(one, (len(r.t), one.residuals_per_row)) for r in records for one in r.series]
    return [
        np.full(shape, _estimate_series_noise(one)) if one.sigma is None else one.sigma
        for one, shape in series
    ]


def _estimate_series_noise(series: Series) -> float:
    """Return the noise level of a series, estimated from second differences of its values."""
    values = series.values[series.measured.all(axis=1)]
    if len(values) < _FEWEST:
        return _UNKNOWN * series.typical_value_scale
    if series.is_attitude:
        steps = rotations.difference(values[:-1], values[1:])
    else:
        steps = np.diff(values, axis=0)
        steps = rotations.wrap(steps) if series.is_angle else steps
    noise = MEDIAN * float(np.median(np.abs(np.diff(steps, axis=0)))) / np.sqrt(6.0)
    return float(np.clip(noise, _LEAST * series.typical_value_scale, series.typical_value_scale))


def estimate_sigmas_from_residuals(best: Minimum) -> list[Array]:
    model, dofs = best.model, compute_degrees_of_freedom(best)
    share = max(int(model.measured.sum()) - model.parameters.size, 1) / max(sum(dofs), 1.0)
    sigmas: list[Array] = []
    for rows, dof in zip(model.rows, dofs, strict=True):
        sample = rows.select_series_residuals(best.residuals)[rows.measured_mask]
        if rows.series.sigma is not None or not sample.size or dof < _NO_DOF:
            sigmas.append(rows.sigma)
            continue
        if model.loss == "soft":
            factor = MEDIAN * float(np.median(np.abs(sample)))
        else:
            factor = float(np.sqrt((sample @ sample) / (dof * min(share, 1.0))))
        least = _LEAST * rows.series.typical_value_scale
        sigmas.append(np.maximum(rows.sigma * factor, least))
    return sigmas


def compute_degrees_of_freedom(best: Minimum) -> list[float]:
    """Return the number of values of each series minus the share that the parameters absorb.

    This share is the sum of the diagonal elements of the hat matrix, which takes the measured
    values to the fitted ones. Directions that the data do not determine absorb nothing.
    """
    scaled = best.scaled_jacobian
    triangle = np.linalg.qr(scaled, mode="r")  # fewer rows, for a faster decomposition
    _, values, vectors = np.linalg.svd(triangle, full_matrices=False)
    is_seen = values**2 > _WEAKEST
    left = scaled @ (vectors[is_seen].T / values[is_seen])
    absorbed = (left**2).sum(axis=1)
    return [
        float(rows.measured_mask.sum() - absorbed[rows.residual_slice].sum())
        for rows in best.model.rows
    ]


def describe_uncertain_sigmas(best: Minimum, *, refuses: bool = False) -> tuple[str, ...]:
    """Return a sentence for each standard deviation that is estimated from few numbers.

    With `refuses`, raises ValueError if the parameters fit all numbers of a quantity exactly.
    """
    sentences = []
    if any(rows.series.sigma is None for rows in best.model.rows):
        for rows, dof in zip(best.model.rows, compute_degrees_of_freedom(best), strict=True):
            name = rows.series.name
            if rows.series.sigma is not None or not rows.measured_mask.any() or dof >= _FEW_DOF:
                continue
            if refuses and dof < _NO_DOF:
                raise ValueError(
                    f"the sigma of {name} cannot be estimated, because the free parameters fit its "
                    f"numbers exactly: give {spell('sigma')}, more measurements or fewer names"
                )
            sentences.append(
                f"the sigma of {name} is estimated from {dof:.1f} degrees of freedom, too few for "
                "reliable errors"
            )
    return tuple(sentences)
