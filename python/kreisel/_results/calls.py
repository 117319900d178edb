"""Calls of the core: one top, slices of many tops and memory for their results, and estimates."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from itertools import combinations
from typing import Any, NamedTuple, Self, TypeVar

import numpy as np
import numpy.typing as npt

from .. import _core as core
from .._model.parameters import refuse_disturbances
from .._model.scene import Scene
from .._options.methods import EXACT, FALLBACK, has_torus_closed_form
from .._options.options import QUANTITIES, RECORDABLE, Options
from .._options.plan import StepChoice
from .._utils.arguments import Array, as_finite_array, as_float, freeze_array
from .._utils.processes import Job, Progress, WorkerPool
from ..quaternion import conjugate, multiply, turn

Codes = npt.NDArray[np.int8]
Counts = npt.NDArray[np.int64]
Which = slice | npt.NDArray[np.integer | np.bool_]
# The name of the status; the states reached (n, 8), as t, q, m; the low words of these states or
# None; the numbers of steps, rejected steps, evaluations and iterations; the last requested time.
CoreResult = tuple[str, Array, Array | None, tuple[int, int, int, int], float]

STATUSES = list(core.statuses)  # names of the statuses; the code of a status is its index
_NOT_YET = -1  # the status of a top that has not run
INTERRUPTED = STATUSES.index("ERR_INTERRUPTED")
NO_STATES = np.empty((0, 8))
STATE_COLUMNS = {"t": slice(0, 1), "q": slice(1, 5), "m": slice(5, 8)}


class Stats(NamedTuple):
    """The numbers of steps, rejected steps, torque evaluations and solver iterations in a run."""

    steps: int
    rejected: int
    evaluations: int
    iterations: int


class TangentData(NamedTuple):
    """(n, 6, columns) tangents, their low words and their truncation error.

    The truncation error is the largest magnitude among the last retained terms of the Taylor
    series. `by` lists the parameters of the derivatives, in the order of the C library.
    """

    high: Array
    low: Array
    truncation: float | Any  # an array (*shape) for many tops
    by: tuple[str, ...]

    @classmethod
    def from_flat_arrays(
        cls, high: Array, low: Array, truncation: float, names: tuple[str, ...]
    ) -> TangentData:
        shape = len(high), 6, sum(core.tangents[name][1] for name in names)
        high, low = freeze_array(high.reshape(shape)), freeze_array(low.reshape(shape))
        return cls(high, low, truncation, names)


class RunStart(NamedTuple):
    """The time [T] of a run's initial state, and the low-order words of that state, if any.

    The time is nonzero only after a `push`, a `reset` or a change of the scene.
    """

    begin: float = 0.0
    low: Array | None = None

    def to_json(self) -> list[object] | None:
        low = None if self.low is None else self.low.tolist()
        return [self.begin, low] if self.begin or low else None

    @classmethod
    def from_json(cls, value: object) -> RunStart:
        if value is None:
            return ORIGIN
        if not isinstance(value, list) or len(value) != 2:
            raise TypeError("the start must be a time and low words")
        low = None if value[1] is None else as_finite_array("low", value[1], "8 numbers")
        if low is not None and low.shape != (8,):
            raise ValueError(f"the low words of the start must be 8 numbers, not {low.size}")
        return cls(as_float("the time of the start", value[0]), low)


ORIGIN = RunStart()


class EventColumns(NamedTuple):
    """Events of several tops, as columns of equal length.

    For each event, `top` contains the row of the top in the ensemble's arrays, `states` and `low`
    the state and its low words, `which` the index of the event function, and `direction` the
    direction of its sign change.
    """

    top: Counts
    states: Array
    low: Array
    which: npt.NDArray[np.intc]
    direction: npt.NDArray[np.intc]


@dataclass
class EnsembleBuffers:
    """Buffers for the results of n tops at k times; unused buffers are None or empty.

    status, done   (n,) the code of the status, and the number of times with valid states
    counts         (n, 4) numbers of steps, rejected steps, evaluations and iterations
    reached        (n,) the time of the last valid state [T]
    states         (n, k, 8) states as in a path; q and m are NaN after the last valid state
    low            (n, k, 8) the low words of the states
    tangents       (n, k, 6, c) the tangents of the states
    tangents_low   (n, k, 6, c) their low words
    truncation     (n,) the truncation error of the tangents of each top
    columns        quantities stored instead of states, (n, k, ...) each
    reduced        (n, r) the reductions of each top's path, in the order of the options
    last           {row of a failed top: array (1, 8) with the last valid state}; if low words are
                   computed, the array is (2, 8) and its second row contains the low words
    messages       {row: the message of a failure that no status describes}
    events         events of all tops, not sorted by top
    chosen         {row: the method and step that method='geometric' chose}
    """

    status: Codes
    done: Counts
    counts: Counts
    reached: Array
    states: Array | None = None
    low: Array | None = None
    tangents: Array | None = None
    tangents_low: Array | None = None
    truncation: Array | None = None
    columns: dict[str, Array] = field(default_factory=dict)
    reduced: Array | None = None
    last: dict[int, Array] = field(default_factory=dict)
    messages: dict[int, str] = field(default_factory=dict)
    events: list[EventColumns] = field(default_factory=list)
    chosen: dict[int, StepChoice] = field(default_factory=dict)

    @classmethod
    def allocate_buffers(cls, n: int, k: int, options: Options, out: Array | None = None) -> Self:
        """Allocate buffers for n tops at k times; `out` is an optional array for the states."""
        status, done = np.full(n, _NOT_YET, np.int8), np.zeros(n, np.int64)
        buffers = cls(status, done, np.zeros((n, 4), np.int64), np.zeros(n))
        if options.reductions:
            buffers.reduced = np.empty((n, len(options.reductions)))
        elif options.want is not None:
            for name in options.want:
                buffers.columns[name] = np.empty((n, k, *RECORDABLE[name].shape))
        else:
            buffers.states = np.empty((n, k, 8)) if out is None else out
            buffers.low = np.empty((n, k, 8)) if options.has_extended_precision else None
        if options.tangents:
            shape = n, k, 6, options.tangent_column_count
            buffers.tangents, buffers.truncation = np.empty(shape), np.full(n, np.nan)
            buffers.tangents_low = np.empty(shape) if options.has_extended_precision else None
        return buffers

    @property
    def size(self) -> int:
        """The number of tops."""
        return len(self.status)

    @property
    def arrays(self) -> dict[str, npt.NDArray[Any]]:
        """The allocated arrays, except `columns`."""
        return {name: x for name, x in vars(self).items() if isinstance(x, np.ndarray)}

    def select_buffer_rows(self, selection: Which) -> EnsembleBuffers:
        """Return buffers of the selected rows; for a slice, their arrays are views."""
        arrays: dict[str, Any] = {name: array[selection] for name, array in self.arrays.items()}
        columns = {name: array[selection] for name, array in self.columns.items()}
        part = EnsembleBuffers(**arrays, columns=columns)
        if not (self.last or self.messages or self.chosen or self.events):
            return part
        rows = np.arange(self.size)[selection]
        for name in ("last", "messages", "chosen"):
            notes = getattr(self, name)
            setattr(part, name, {j: notes[i] for j, i in enumerate(rows.tolist()) if i in notes})
        for events in self.events:
            order = np.argsort(events.top, kind="stable")
            first = np.searchsorted(events.top, rows, "left", order)
            count = np.searchsorted(events.top, rows, "right", order) - first
            places = np.repeat(first - np.cumsum(count) + count, count) + np.arange(count.sum())
            found = EventColumns(*(column[order[places]] for column in events))
            part.events.append(found._replace(top=np.repeat(np.arange(rows.size), count)))
        return part

    def select_states(self, which: Which) -> EnsembleBuffers:
        """Return buffers of the selected times, without events.

        A top is done with all times up to the last selected one that it reached.
        """

        def select(array: Array | None) -> Any:
            return None if array is None else np.ascontiguousarray(array[:, which])

        names = "states", "low", "tangents", "tangents_low"
        chosen: dict[str, Any] = {name: select(getattr(self, name)) for name in names}
        columns = {name: select(column) for name, column in self.columns.items()}
        k = next(a.shape[1] for a in (self.states, *self.columns.values()) if a is not None)
        is_reached = np.arange(k)[which] < self.done[:, None]
        done = (is_reached * np.arange(1, is_reached.shape[1] + 1)).max(axis=1, initial=0)
        return replace(self, done=done, columns=columns, events=[], **chosen)

    def insert_part_at_row(self, begin: int, part: EnsembleBuffers) -> None:
        targets = self.arrays | self.columns
        for name, array in (part.arrays | part.columns).items():
            targets[name][begin : begin + part.size] = array
        self.add_events_and_failures(begin, part)

    def add_events_and_failures(self, begin: int, part: EnsembleBuffers) -> None:
        """Add failures, chosen steps and events of `part`, and add `begin` to their top indices."""
        if part is self:
            return
        self.last |= {begin + i: states for i, states in part.last.items()}
        self.messages |= {begin + i: text for i, text in part.messages.items()}
        self.chosen |= {begin + i: choice for i, choice in part.chosen.items()}
        self.events += [events._replace(top=events.top + begin) for events in part.events]

    def mark_unrun_tops_interrupted(self, t: Array) -> None:
        """Mark all tops that are still to be run as interrupted, and set their values to NaN."""
        waiting = np.flatnonzero(self.status == _NOT_YET)
        self.status[waiting] = INTERRUPTED
        values = self.states, self.reduced, self.low, self.tangents, self.tangents_low
        for array in (*values, *self.columns.values()):
            if array is not None:
                array[waiting] = np.nan
        if self.states is not None:
            self.states[waiting, :, 0] = t[waiting] if t.ndim == 2 else t


class Slice(NamedTuple):
    """Consecutive tops of an ensemble, whose results are to be computed with the same options.

    rows   the buffers for the results of these tops
    times  (k,), or (end - begin, k) if each top has its own times
    work   the object that counts finished tops and can stop the run; None in a worker process
    """

    rows: EnsembleBuffers
    options: Options
    tops: Scene
    begin: int
    end: int
    times: Array
    work: core.Work | None = None


class SliceRunner(NamedTuple):
    """A function that computes the results of a slice and writes them to its rows."""

    run: Callable[[Slice], object]
    is_native: bool = False  # True: the C library distributes the tops over threads


def run_slice_in_lanes(part: Slice) -> None:
    """Compute the motions of a slice in SIMD lanes."""
    rows, options, tops, begin, end, t, work = part
    reductions = [one[:3] for one in options.reductions]
    failures, last = core.Worker(*options.core_arguments, reductions, work).run(
        tops._core_scenes, begin, end, t,
        rows.status, rows.done, rows.counts, rows.reached, rows.states, rows.reduced, rows.columns,
    )  # fmt: skip
    rows.last = {i: last[j : j + 1] for j, i in enumerate(failures.tolist())}


def run_slice_sequentially(part: Slice) -> None:
    """Compute the motions of a slice one at a time, with their events and tangents."""
    rows, options, tops, begin, end, t, work = part
    last, low, failures, event_tops, (states, rest, which, direction) = core.alone(
        *options.core_arguments, options.core_events, work, tops._core_scenes, begin, end, t,
        rows.status, rows.done, rows.counts, rows.reached, rows.states, rows.low, rows.columns,
        options.tangent_bit_mask, rows.tangents, rows.tangents_low, rows.truncation,
    )  # fmt: skip
    rows.last = {i: np.array([last[j], low[j]]) for j, i in enumerate(failures.tolist())}
    if options.events is not None:
        rows.events = [EventColumns(event_tops, states, rest, which, direction)]


LANES = SliceRunner(run_slice_in_lanes, is_native=True)
SCALAR = SliceRunner(run_slice_sequentially)


def compute_quantity_values(
    name: str, tops: Scene, buffers: EnsembleBuffers, bits: int | None = None
) -> Array:
    """Return the values (n, k, ...) of a quantity for all states, or with `bits` its derivatives.

    The derivatives are with respect to the parameters with these bits, and have the shape (n, k,
    ..., c).
    """
    assert buffers.states is not None
    inputs = name, tops._core_scenes, buffers.states, buffers.done
    if bits is None or buffers.tangents is None:
        out = np.empty((*buffers.states.shape[:2], *QUANTITIES[name].shape))
        core.values_of_tops(*inputs, out)
        return out
    n, k, _, columns = buffers.tangents.shape
    shape = (3,) if name == "q" else QUANTITIES[name].shape
    out = np.empty((n, k, *shape, columns))
    core.derivatives_of_tops(*inputs, bits, buffers.tangents, out)
    return out


_Result = TypeVar("_Result")


def run_ensemble(
    kind: Callable[[Scene, Array, Options, EnsembleBuffers], _Result],
    tops: Scene,
    t: Array,
    options: Options,
    pool: WorkerPool,
    runner: SliceRunner,
    progress: Progress | None = None,
    out: Array | None = None,
    buffers: EnsembleBuffers | None = None,
) -> _Result:
    """Compute the motions of all tops in an ensemble at times that have been validated.

    Raises kreisel.Interrupted, with all results obtained so far, after Ctrl-C.
    """
    n = tops.size
    if buffers is None:
        buffers = EnsembleBuffers.allocate_buffers(n, t.shape[-1], options, out)
    work, is_remote = core.Work(), pool.has_workers_in_other_processes
    flat = tops.ravel() if is_remote else tops

    def make_job(begin: int, end: int) -> Job[EnsembleBuffers]:
        times = t[begin:end] if t.ndim == 2 else t
        if is_remote:
            return run_slice_in_worker, (runner, options, flat[begin:end], times)
        rows = buffers if end - begin == n else buffers.select_buffer_rows(slice(begin, end))
        return run_slice, (runner, Slice(rows, options, tops, begin, end, times, work))

    collect = buffers.insert_part_at_row if is_remote else buffers.add_events_and_failures
    try:
        pool.run_slices(n, make_job, collect, work, progress, runner.is_native)
    except KeyboardInterrupt:
        buffers.mark_unrun_tops_interrupted(t)
        indices = np.flatnonzero(buffers.status == INTERRUPTED)
        if not indices.size:
            raise
        stopped: Any = kind(tops, t, options, buffers)
        raise stopped._make_stop_error(int(indices[0]), indices.size) from None
    if progress is not None:
        progress(1.0)
    return kind(tops, t, options, buffers)


def run_slice(runner: SliceRunner, part: Slice) -> EnsembleBuffers:
    """Compute the results of a slice, and return its rows."""
    runner.run(part)
    return part.rows


def run_slice_in_worker(runner: SliceRunner, options: Options, tops: Scene, t: Array) -> Any:
    """Compute the results of some tops in a worker process, and return them."""
    rows = EnsembleBuffers.allocate_buffers(len(tops), t.shape[-1], options)
    return run_slice(runner, Slice(rows, options, tops, 0, len(tops), t))


def compute_states_at_times(
    scene: Scene,
    options: Options,
    times: Array,
    progress: Progress | core.Work | None = None,
    origin: RunStart = ORIGIN,
) -> CoreResult:
    return core.record(scene._block, *options.core_arguments, times, progress, *origin)


def compute_states_at_unordered_times(
    scene: Scene, options: Options, times: Array, origin: RunStart = ORIGIN
) -> CoreResult:
    """Compute the states at times of any sign and order, up to the first failure of a run."""
    states = np.empty((times.size, 8))
    low = np.empty((times.size, 8)) if options.has_extended_precision else None
    counts, end = np.zeros(4, dtype=np.int64), 0.0
    for side in (times < 0.0, times >= 0.0):
        indices = np.flatnonzero(side)
        indices = indices[np.argsort(np.abs(times[indices]), kind="stable")]
        if not indices.size:
            continue
        result = compute_states_at_times(scene, options, times[indices], None, origin)
        if result[0] != "OK":
            return result
        states[indices], end, counts = result[1], result[-1], counts + result[3]
        if low is not None:
            low[indices] = result[2]
    steps, rejected, evaluations, iterations = counts.tolist()
    return "OK", states, low, (steps, rejected, evaluations, iterations), end


CLOSED_FORM = Options(EXACT, requested_method=EXACT)
SERIES = Options(FALLBACK, requested_method=FALLBACK)
LONGER_SERIES, LONGEST_SERIES = replace(SERIES, digits=20), replace(SERIES, digits=30)
# Runs with 30 digits and shorter steps, whose rounding errors differ from those of LONGEST_SERIES.
SHORTER_STEPS = [replace(LONGEST_SERIES, tol=2.0**-n) for n in (108, 109, 110)]
# No error of 200 runs with 30 digits is beyond this multiple of the largest difference.
FACTOR_30 = 3.0

ROUNDING = 2.0**-53
_MAX_POINTS = 1024  # maximal number of times of a path at which tangents are computed
# The error of a closed form is far below this multiple of the error caused by rounding the start.
ROUNDINGS = 128


def has_cheap_exact_form(scene: Scene) -> bool:
    """Return True if the scene has a closed form that is exact for its body and quick to set up.

    A closed form is inexact if it treats nearly equal moments of inertia as equal, or if it moves
    the centre of mass or the rotor to a nearby principal axis.
    """
    if not CLOSED_FORM.integrator.suits(scene) or has_torus_closed_form(scene):
        return False
    tolerance = 2.0 * core.KIND_RTOL
    pairs = combinations(scene.body.moments, 2)
    if any(a != b and abs(a - b) <= tolerance * max(a, b) for a, b in pairs):
        return False
    com, rotor = scene.body.principal_com, scene.body.principal_rotor
    reach, most = max(map(abs, com)), max(map(abs, rotor))
    if any(0.0 < abs(h) <= tolerance * most for h in rotor):
        return False
    return not scene.gravity or not any(0.0 < abs(c) <= tolerance * reach for c in com)


def compute_state_changes_by_rounding(scene: Scene, digits: int = 16) -> Array:
    """Return a matrix whose columns are changes of the state per unit of relative rounding error.

    Beyond 16 digits, the C library stores the momentum in the body frame, so that rounding the
    attitude also rotates the momentum in space.
    """
    if digits <= 16:
        return np.diag([1.0] * 3 + [max(scene.body.moments) * scene._rotation_rate] * 3)
    basis: Any = tuple(np.eye(3))
    rotation, principal = (np.array(turn(q, basis)) for q in (scene.attitude, scene.body.axes))
    # Each component of the stored quaternion of the principal axes is a sum of rounded products.
    each: Any = np.diag(scene.attitude)
    sizes: Any = np.diag(np.linalg.norm(multiply(each, scene.body.axes), axis=1))
    products = multiply(sizes, conjugate(scene.body.axes))
    turns = 2.0 * np.array(multiply(conjugate(scene.attitude), products))[1:]
    body_momentum = rotation.T @ np.array(scene.momentum)
    momentum_changes = rotation @ np.cross(turns.T, body_momentum).T
    momentum_roundings = rotation @ (principal * (principal.T @ body_momentum))
    return np.block([[turns, np.zeros((3, 3))], [momentum_changes, momentum_roundings]])


def estimate_rounding_growth(
    scene: Scene,
    times: Array,
    digits: int = 16,
    max_steps: int = 0,
    progress: Progress | core.Work | None = None,
    origin: RunStart = ORIGIN,
) -> tuple[CoreResult, float]:
    """Return a run of the Taylor series, and how much it amplifies rounding errors of the start.

    The amplification is the change of attitude [rad] per relative rounding error: up to 16 digits
    of the worst single error, beyond of all errors as if they were independent. It is infinite if a
    tangent overflows. If the run fails, the states after the failure are missing.
    """
    directions, most = compute_state_changes_by_rounding(scene, digits), 1.0
    result: CoreResult = "OK", NO_STATES, None, (0, 0, 0, 0), 0.0
    arguments = replace(SERIES, max_steps=max_steps).core_arguments
    for side in (times[times < 0.0], times[times > 0.0]):
        if not side.size:
            continue
        is_back, columns = bool(side[0] < 0.0), core.tangents["start"][0]
        begun = core.start(scene._block, *arguments, is_back, [], columns, begin=origin.begin)
        top = begun[1]
        if top is None:
            refuse_disturbances(scene, "the growth of rounding errors is not known for tops")
        assert top is not None
        each = -(-side.size // _MAX_POINTS)
        # Every `each`-th time, counted back from the last time, which is thus included.
        check_times = side[np.argsort(np.abs(side))][::-each][::-1]
        result, high, *_ = top.record_tangents(check_times, False, progress)
        if result[0] == "ERR_TANGENT":
            return ("OK", *result[1:]), math.inf
        if result[0] != "OK":
            states = result[1] if len(result[1]) else scene._start_state.copy()
            return (result[0], states, *result[2:]), most
        turns = np.linalg.norm(high.reshape(-1, 6, 6)[:, :3] @ directions, axis=1)
        growths = turns.max(axis=1) if digits <= 16 else np.linalg.norm(turns, axis=1)
        most = max(most, float(growths.max()))
    return result, most


def compute_angles_between_attitudes(one: tuple[Array, Array], other: tuple[Array, Array]) -> Array:
    """Return the angles [rad] between attitudes, given as pairs of arrays (q, low words of q).

    The quaternions are subtracted before they are multiplied, so that small angles keep their
    relative accuracy.
    """
    (p, p_low), (q, q_low) = one, other
    dot = (p * q).sum(axis=1)
    sign = np.where(dot < 0.0, -1.0, 1.0)[:, None]
    d = (sign * q - p) + (sign * q_low - p_low)
    # The vector part of conjugate(p) * (q - p), in terms of d = q - p.
    vec = p[:, :1] * d[:, 1:] - d[:, :1] * p[:, 1:] - np.cross(p[:, 1:], d[:, 1:])
    angles: Array = 2.0 * np.arctan2(np.sqrt((vec**2).sum(axis=1)), np.abs(dot))
    return angles
