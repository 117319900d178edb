"""Fits of chaotic motions by multiple shooting."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from .._results.results import Error
from .._solve.solve import solve
from .._utils.arguments import Array
from .guess import MotionSamples, interpolate_motion
from .minimize import LossName, Minimum, SearchSettings, minimize_cost
from .parameters import (
    FitPoint,
    FreeParameters,
    compute_rotation_vectors,
    conjugate_quaternions,
    inverse_left_jacobian,
    multiply_quaternions,
    rotation_matrix,
)
from .records import Record, slice_record
from .residuals import Indices, ResidualEvaluation, ResidualModel

GAPS = (0.1, 1e-2, 1e-3, 1e-5)  # standard deviations of the gaps in each stage [rad]
_PER_GROWTH = 2.0  # pieces for each factor e of the growth of errors
_ROWS = 10  # fewest times of a piece
_MOST = 400
_FTOL = 1e-5
_HOPELESS = 3.0  # mean squared residual from which smaller gaps are not tried
_STAGE_LIMIT = 40  # evaluations of all pieces in a stage
_START = ("attitude", "velocity")


Segments = tuple[FitPoint, ...]  # with the start of each segment, and equal other parameters


def choose_segment_count(point: FitPoint, records: Sequence[Record]) -> int:
    """Return a number of segments that is large enough to limit the error growth in each one."""
    times = np.concatenate([record.t for record in records])
    most = max(min(len(np.unique(times)) // _ROWS, _MOST), 1)
    end = float(times[np.abs(times).argmax()])
    try:
        path = solve(point.to_scene(), [end], "taylor", tangents="start", max_steps=10**6)
    except (Error, ValueError):
        return most
    sizes = np.ones(6)
    sizes[3:] = float(np.linalg.norm(point.momentum)) or 1.0
    tangents = path.tangents[0] / sizes[:, None] * sizes
    growth = math.log(max(float(np.linalg.norm(tangents, 2)), 1.0))
    return min(max(math.ceil(_PER_GROWTH * growth), 2), most)


class ShootingModel:
    """A least-squares model of a motion that consists of several segments.

    The parameter vector consists of all parameters of the segment that begins at t = 0 and the
    initial states of the other segments.
    """

    def __init__(
        self,
        parameters: FreeParameters,
        records: Sequence[Record],
        sigmas: Sequence[Array],
        count: int,
    ) -> None:
        self.parameters, self.gap = parameters, GAPS[0]
        times = np.concatenate([record.t for record in records])
        first, last = min(float(times.min()), 0.0), max(float(times.max()), 0.0)
        self.edges = np.linspace(first, last, count + 1)
        self.edges[np.abs(self.edges[:-1]).argmin()] = 0.0  # a piece begins at the start
        self.first = int(np.flatnonzero(self.edges[:-1] <= 0.0)[-1])  # the piece with the start
        self.models: list[ResidualModel] = []
        self.rows: list[Indices] = []  # of each segment
        self.columns: list[Indices] = []
        self.width = parameters.size
        names = [name for name in parameters.free if name not in _START]
        for k, (begin, end) in enumerate(itertools.pairwise(self.edges.tolist())):
            parts, segment_sigmas, rows, offset, series = [], [], [], 0, iter(sigmas)
            for record in records:
                low = int(np.searchsorted(record.t, begin)) if k else 0
                high = int(np.searchsorted(record.t, end)) if k < count - 1 else len(record.t)
                parts.append(slice_record(record, low, high, begin))
                for one in record.series:
                    segment_sigmas.append(next(series)[low:high])
                    width = one.residuals_per_row
                    rows.append(offset + np.arange(low * width, high * width))
                    offset += len(record.t) * width
            free = parameters.free if k == self.first else (*_START, *names)
            own = FreeParameters(parameters.scene, free, parts)
            self.models.append(ResidualModel(own, parts, segment_sigmas, end - begin, begin))
            self.rows.append(np.concatenate(rows))
            columns = np.empty(own.size, dtype=np.intp)
            for key, part in own.slices.items():
                if k != self.first and key[0] in _START:
                    columns[part] = np.arange(self.width, self.width + 3)
                    self.width += 3
                else:
                    columns[part] = np.arange(self.width)[parameters.slices[key]]
            self.columns.append(columns)
        self.data_size = sum(len(rows) for rows in self.rows)
        self.size = self.data_size + 6 * (count - 1)
        self.evaluations = 0

    def data_starts(self, point: FitPoint, motion: MotionSamples) -> Segments:
        """Take the state at t = 0 from `point`, and all other states from a measured motion."""
        points = []
        for k, edge in enumerate(self.edges[:-1]):
            attitude, rate = interpolate_motion(motion, float(edge))
            own = replace(point, attitude=attitude, rate=rate)
            points.append(point if k == self.first else own)
        return tuple(points)

    def build_segment_starts(self, point: FitPoint) -> Segments:
        """Set the initial states of all segments to states of the motion that starts at `point`."""
        points = {}
        scene, edges = point.to_scene(), self.edges[:-1]
        for times in (edges[edges < 0.0][::-1], edges[edges >= 0.0]):
            path = solve(scene, times, "taylor")
            for t, q, m in zip(times, path.q, path.m, strict=True):
                rate = point.relative_angular_velocity(q, m)
                points[float(t)] = replace(point, attitude=q, rate=rate)
        return tuple(points[float(t)] for t in edges)

    def add_step_within_bounds(self, pieces: Segments, step: Array) -> Segments:
        parts = zip(self.models, pieces, self.columns, strict=True)
        return tuple(
            model.add_step_within_bounds(point, step[columns]) for model, point, columns in parts
        )

    def estimate_parameter_scales(self, pieces: Segments) -> Array:
        scales = np.ones(self.width)
        span = float(self.edges[-1] - self.edges[0])
        for k in sorted(range(len(self.models)), key=lambda k: k == self.first):
            own = self.models[k].parameters.estimate_parameter_scales(pieces[k], span)
            scales[self.columns[k]] = own
        return scales

    def compute_distances_to_lower_bounds(self, pieces: Segments) -> Array:
        distances = np.full(self.width, np.inf)
        distances[self.columns[self.first]] = self.models[
            self.first
        ].compute_distances_to_lower_bounds(pieces[self.first])
        return distances

    def evaluate_residuals(self, pieces: Segments) -> ResidualEvaluation:
        self.evaluations += 1
        residuals, jacobian = np.zeros(self.size), np.zeros((self.size, self.width))
        for k, model in enumerate(self.models):
            evaluation = model.evaluate_residuals(pieces[k])
            if not np.isfinite(evaluation.residuals).all():
                return ResidualEvaluation(np.full(self.size, np.inf), jacobian)
            residuals[self.rows[k]] = evaluation.residuals
            jacobian[np.ix_(self.rows[k], self.columns[k])] = evaluation.jacobian
        for k in range(len(self.models) - 1):
            rows = slice(self.data_size + 6 * k, self.data_size + 6 * k + 6)
            residuals[rows], jacobian[rows] = self._compute_gap_after_segment(pieces, k)
        return ResidualEvaluation(residuals, jacobian)

    def _compute_gap_after_segment(self, pieces: Segments, k: int) -> tuple[Array, Array]:
        """Return the jump of the state from segment k to segment k + 1, and its derivatives."""
        end, point, following = self.models[k].end, pieces[k], pieces[k + 1]
        assert end is not None
        turn = compute_rotation_vectors(
            multiply_quaternions(conjugate_quaternions(end.q), following.attitude)
        )
        rate = point.relative_angular_velocity(end.q, end.m)
        scale = float(np.linalg.norm(rate)) or 1.0
        gap = np.concatenate((turn, (following.rate - rate) / scale)) / self.gap
        rotation, p = rotation_matrix(end.q), self.models[k].parameters
        by = replace(point, attitude=end.q, rate=rate).differentiate_momentum()
        change = end.by[3:] - by["attitude"] @ end.by[:3]  # of the momentum, at a fixed attitude
        for name in ("moments", "rotor", "turning"):
            if p.can_vary(name):
                change[:, p.get_parameter_slice(name)] -= by[name] @ p.columns[name]
        rate_jacobian = rotation.T @ change / point.moments[:, None]
        jacobian = np.zeros((6, self.width))
        jacobian[:3, self.columns[k]] = -inverse_left_jacobian(turn) @ end.by[:3]
        jacobian[3:, self.columns[k]] = -rate_jacobian / scale
        q, columns = self.models[k + 1].parameters, self.columns[k + 1]
        if q.can_vary("attitude"):
            jacobian[:3, columns[q.get_parameter_slice("attitude")]] += inverse_left_jacobian(-turn)
        if q.can_vary("velocity"):
            jacobian[3:, columns[q.get_parameter_slice("velocity")]] += np.eye(3) / scale
        return gap, jacobian / self.gap


def minimize_by_multiple_shooting(
    model: ShootingModel,
    pieces: Segments,
    loss: LossName,
    limit: int,
    report: Callable[[Minimum[Segments]], None] | None = None,
) -> Minimum[Segments]:
    """Fit a motion in segments, and close the gaps between them in several stages.

    The search stops early if the segments do not fit the measurements even with gaps between them.
    Without `report`, it is only tried whether they do.
    """
    for gap in GAPS:
        model.gap = gap
        stage = min(model.evaluations + _STAGE_LIMIT, limit)
        shown = report if report and gap == GAPS[-1] else lambda _: None
        settings = SearchSettings(loss, stage, _FTOL, shown, is_stiff=True)
        minimum = minimize_cost(model, pieces, settings)
        pieces = minimum.point
        if report is None or not fits_with_gaps(model, minimum):
            break
    return minimum


def fits_with_gaps(model: ShootingModel, minimum: Minimum[Segments]) -> bool:
    return minimum.cost <= _HOPELESS * model.size
