"""Fits of chaotic motions by multiple shooting."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from .._results.path import Error
from .._solve.solve import solve
from .._utils.arguments import Array
from .guess import MotionSamples, interpolate_motion
from .minimize import WEAKEST, LossName, Minimum, SearchSettings, minimize_cost
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


class SegmentStartStates(NamedTuple):
    """The initial states of all segments of a motion, with the parameters of the segments.

    Parameters other than initial states have the same values in all segments.
    """

    points: tuple[FitPoint, ...]


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
        self.models: list[ResidualModel] = []
        self.rows: list[Indices] = []
        for k in range(count):
            self._add_segment(k, records, sigmas)
        self.first = int(np.flatnonzero(self.edges[:-1] <= 0.0)[-1])  # the piece with the start
        self.columns = self._list_jacobian_columns_of_segments()
        self.data_size = sum(len(rows) for rows in self.rows)
        self.size = self.data_size + 6 * (count - 1)
        self.evaluations = 0

    def _add_segment(self, k: int, records: Sequence[Record], sigmas: Sequence[Array]) -> None:
        begin, end = self.edges[k], self.edges[k + 1]
        is_last = k == len(self.edges) - 2
        parts, segment_sigmas, rows = [], [], []
        series, offset = iter(sigmas), 0
        for record in records:
            low = int(np.searchsorted(record.t, begin)) if k else 0
            high = len(record.t) if is_last else int(np.searchsorted(record.t, end))
            parts.append(slice_record(record, low, high, float(begin)))
            for one in record.series:
                segment_sigmas.append(next(series)[low:high])
                rows.append(
                    offset + np.arange(low * one.residuals_per_row, high * one.residuals_per_row)
                )
                offset += len(record.t) * one.residuals_per_row
        names = [n for n in self.parameters.free if n not in _START]
        is_first = begin == 0.0
        free = self.parameters.free if is_first else (*_START, *names)
        segment_parameters = FreeParameters(self.parameters.scene, free, parts)
        model = ResidualModel(
            segment_parameters, parts, segment_sigmas, float(end - begin), float(begin)
        )
        self.models.append(model)
        self.rows.append(np.concatenate(rows))

    def _list_jacobian_columns_of_segments(self) -> list[Indices]:
        """Return the column indices of the parameters of each segment."""
        column_lists, width = [], self.parameters.size
        for k, model in enumerate(self.models):
            columns = np.empty(model.parameters.size, dtype=np.intp)
            for key, part in model.parameters.slices.items():
                if k != self.first and key[0] in _START:
                    columns[part] = np.arange(width, width + 3)
                    width += 3
                else:
                    columns[part] = np.arange(width)[self.parameters.slices[key]]
            column_lists.append(columns)
        self.width = width
        return column_lists

    def data_starts(self, point: FitPoint, motion: MotionSamples) -> SegmentStartStates:
        """Take the state at t = 0 from `point`, and all other states from a measured motion."""
        points = []
        for k, edge in enumerate(self.edges[:-1]):
            attitude, rate = interpolate_motion(motion, float(edge))
            start_point = replace(point, attitude=attitude, rate=rate)
            points.append(point if k == self.first else start_point)
        return SegmentStartStates(tuple(points))

    def build_segment_starts(self, point: FitPoint) -> SegmentStartStates:
        """Set the initial states of all segments to states of the motion that starts at `point`."""
        points = {}
        scene, edges = point.to_scene(), self.edges[:-1]
        for times in (edges[edges < 0.0][::-1], edges[edges >= 0.0]):
            path = solve(scene, times, "taylor")
            for t, q, m in zip(times, path.q, path.m, strict=True):
                points[float(t)] = replace(
                    point, attitude=q, rate=point.relative_angular_velocity(q, m)
                )
        return SegmentStartStates(tuple(points[float(t)] for t in edges))

    def add_step_within_bounds(self, pieces: SegmentStartStates, step: Array) -> SegmentStartStates:
        points = [
            model.add_step_within_bounds(point, step[columns])
            for model, point, columns in zip(self.models, pieces.points, self.columns, strict=True)
        ]
        return SegmentStartStates(tuple(points))

    def estimate_parameter_scales(self, pieces: SegmentStartStates) -> Array:
        scales = np.ones(self.width)
        span = float(self.edges[-1] - self.edges[0])
        for k in sorted(range(len(self.models)), key=lambda k: k == self.first):
            segment_scales = self.models[k].parameters.estimate_parameter_scales(
                pieces.points[k], span
            )
            scales[self.columns[k]] = segment_scales
        return scales

    def compute_distances_to_lower_bounds(self, pieces: SegmentStartStates) -> Array:
        distances = np.full(self.width, np.inf)
        distances[self.columns[self.first]] = self.models[
            self.first
        ].compute_distances_to_lower_bounds(pieces.points[self.first])
        return distances

    def evaluate_residuals(self, pieces: SegmentStartStates) -> ResidualEvaluation:
        self.evaluations += 1
        residuals, jacobian = np.zeros(self.size), np.zeros((self.size, self.width))
        for k, model in enumerate(self.models):
            evaluation = model.evaluate_residuals(pieces.points[k])
            if not np.isfinite(evaluation.residuals).all():
                return ResidualEvaluation(np.full(self.size, np.inf), jacobian)
            residuals[self.rows[k]] = evaluation.residuals
            jacobian[np.ix_(self.rows[k], self.columns[k])] = evaluation.jacobian
        for k in range(len(self.models) - 1):
            rows = slice(self.data_size + 6 * k, self.data_size + 6 * k + 6)
            residuals[rows], jacobian[rows] = self._compute_gap_after_segment(pieces, k)
        return ResidualEvaluation(residuals, jacobian)

    def _compute_gap_after_segment(self, pieces: SegmentStartStates, k: int) -> tuple[Array, Array]:
        """Return the jump of the state from segment k to segment k + 1, and its derivatives."""
        end, point, following = self.models[k].end, pieces.points[k], pieces.points[k + 1]
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
    pieces: SegmentStartStates,
    loss: LossName,
    report: Callable[[Minimum], None],
    limit: int,
) -> Minimum:
    """Fit a motion in segments, and close the gaps between them in several stages.

    The search stops early if the segments do not fit the measurements even with gaps between them.
    """
    minimum: Minimum | None = None
    for gap in GAPS:
        model.gap = gap
        stage = min(model.evaluations + _STAGE_LIMIT, limit)
        report_minimum = report if gap == GAPS[-1] else _do_not_report_minimum
        minimum = minimize_cost(
            model,
            pieces,
            SearchSettings(loss, stage, _FTOL, report_minimum, is_stiff=True, weakest=WEAKEST),
        )
        pieces = minimum.point  # type: ignore[assignment]
        if not minimum.cost <= _HOPELESS * model.size:
            break
    assert minimum is not None
    return minimum


def try_segment_fit(model: ShootingModel, pieces: SegmentStartStates, loss: LossName) -> bool:
    """Return True if the segments fit the records when gaps between the segments are allowed."""
    model.gap = GAPS[0]
    search = SearchSettings(
        loss, _STAGE_LIMIT, _FTOL, _do_not_report_minimum, is_stiff=True, weakest=WEAKEST
    )
    return minimize_cost(model, pieces, search).cost <= _HOPELESS * model.size


def _do_not_report_minimum(_: Minimum) -> None:
    """Ignore a minimum at which gaps between successive segments of the motion remain."""
