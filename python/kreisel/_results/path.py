"""The path of one top: its states, quantities and events."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from operator import index
from typing import TYPE_CHECKING, Any, NoReturn

import numpy as np
import numpy.typing as npt

from .._core import Request, statuses
from .._model.parameters import advance_shaking_phase
from .._model.scene import Scene
from .._options.methods import EXACT, FALLBACK, compute_closed_form_error_limit
from .._options.options import (
    Options,
    make_options,
    validate_requested_quantities,
)
from .._options.plan import Plan, StepChoice, make_solve_plan
from .._options.times import CHUNK_SIZE
from .._utils.arguments import Array, Numbers, ReadOnlyArrays, format_count
from .._utils.files import Integers, atomic_write
from .._utils.html import format_picture_as_html
from .._utils.processes import Progress
from .._utils.quantity_attributes import QuantityName
from .archive import encode_path_as_archive
from .error import (
    ORIGIN,
    ROUNDING,
    SERIES,
    CoreResult,
    RunStart,
    compute_max_angle_between_attitudes,
    compute_states_at_times,
    compute_states_at_unordered_times,
    estimate_attitude_error,
    estimate_rounding_growth,
    make_core_start_error,
)
from .quantities import (
    NO_STATES,
    STATE_COLUMNS,
    PathBase,
    StateIndex,
    Stats,
    TangentData,
    normalize_path_index,
    validate_times_within_path,
)
from .tables import ColumnTable, TableExportMethods, list_quantity_columns

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from .._plot.charts import FigureAxes
    from .._plot.film import Film


MOST_DISPLAYED = 100_000  # number of states of the longest path that notebooks display as a picture


@dataclass(frozen=True, eq=False, init=False)
class Path(ReadOnlyArrays, PathBase, TableExportMethods):
    """The computed motion of a scene, sampled at n times.

    All arrays are read-only, but copies of them are writeable. The arrays t, q and m are views of
    `states`, and other quantities are computed on first access. Vectors are given by their
    components in the space frame unless stated otherwise.

    states  (n, 8): t [T], q (w, x, y, z), m [M L^2 T^-1]
    method  the name of the method; the attributes step (negative: back in time), tol and digits
            have the values used, or None if the method has no such parameter or chose it itself
    stats   the cost of the run, including trial runs
    events  the events that occurred during the run; empty if none were requested
    want    the quantities that the path stores in addition to t; None: the states, from which all
            quantities can be computed
    """

    scene: Scene
    states: Array  # not set if the path has _columns
    stats: Stats
    _options: Options
    _is_back: bool = False
    _low: Array | None = None  # low words of the states
    _columns: dict[str, Array] | None = None  # t and the quantities in want, instead of states
    _events: Events | None = None
    _choice: StepChoice | None = None  # the choice of method='geometric'
    _tangent_data: TangentData | None = None
    _origin: RunStart = ORIGIN

    def __init__(
        self,
        scene: Scene,
        states: Array,
        stats: Stats,
        _options: Options,
        _is_back: bool = False,
        _low: Array | None = None,
        _columns: dict[str, Array] | None = None,
        _events: Events | None = None,
        _choice: StepChoice | None = None,
        _tangent_data: TangentData | None = None,
        _origin: RunStart = ORIGIN,
    ) -> None:
        fields = self.__dict__  # avoids the slow object.__setattr__ of frozen dataclasses
        fields["scene"], fields["stats"], fields["_options"] = scene, stats, _options
        fields["_is_back"], fields["_low"], fields["_columns"] = _is_back, _low, _columns
        fields["_events"], fields["_choice"] = _events, _choice
        fields["_tangent_data"], fields["_origin"] = _tangent_data, _origin
        if _low is not None:
            _low.flags.writeable = False
        if _columns is None:
            states.flags.writeable = False
            fields["states"] = states
            return
        for name, column in _columns.items():
            column.flags.writeable = False
            if name not in STATE_COLUMNS:
                fields[name] = column

    def __repr__(self) -> str:
        values = {"step": self.step, "tol": self.tol, "digits": self.digits}
        controls = "".join(f", {k}={v!r}" for k, v in values.items() if v is not None)
        span = f", t = {self.t[0]:g} .. {self.t[-1]:g}" if len(self) else ""
        ran = f"{self.method}{controls}, {format_count(self.stats.steps, 'step')}"
        return f"<kreisel.Path: {format_count(len(self), 'state')}{span}; {ran}>"

    @cached_property
    def error(self) -> float:
        """The estimated error of the attitude [rad], as the maximum over all states.

        The error is estimated relative to a reference, which is a closed-form solution if one
        applies exactly and is sufficiently accurate. If no closed form is suitable, the reference
        is a Taylor series in 20-digit arithmetic. A 30-digit series is used if `digits` was passed
        to solve, or if the closed form deviates too much from the 20-digit series.

        For a path computed with 30 digits, there is no better reference. The value is three times
        the largest difference from three runs with shorter steps, which round differently, or three
        times the effect of rounding the initial state if that is larger. It is typically four times
        the true error, and smaller than the true error in less than one of 200 runs.

        A path computed with method='geometric' does not necessarily store the attitude. If the
        attitude is not stored, the returned value is the error that was estimated when the step
        size was chosen. If nothing is known about the accuracy of the attitude, the value is pi,
        the largest possible error.

        Raises AttributeError if `want` was given without 'q' or, for 20 or 30 digits, without
        'q_low', unless the method was 'geometric'.
        """
        if not len(self):
            return 0.0
        if self._choice and self._columns is not None and "q" not in self._columns:
            return self._choice.error
        return estimate_attitude_error(
            self.scene,
            self.method,
            self.digits,
            self._compute_max_angle_to_second_run,
            self._estimate_rounding_growth,
        )

    def _estimate_rounding_growth(self) -> float:
        result, largest = estimate_rounding_growth(
            self.scene, self.t, self.digits or 16, origin=self._origin
        )
        build_path_or_raise(self.scene, SERIES, result, self._origin)
        return largest

    def _compute_max_angle_to_second_run(self, second: Options) -> float:
        """Return the largest angle [rad] between the attitudes of this path and of a second run.

        The comparison includes the digits of both paths beyond double precision.
        """
        result = compute_states_at_unordered_times(self.scene, second, self.t, self._origin)
        other = build_path_or_raise(self.scene, second, result, self._origin)
        return compute_max_angle_between_attitudes((self.q, self.q_low), (other.q, other.q_low))

    @cached_property
    def plan(self) -> Plan:
        """The kreisel.Plan of this path, with the choices of the solver and their reasons."""
        return make_solve_plan(self.scene, self._options, len(self), self._choice, self.t)

    @cached_property
    def events(self) -> Events:
        """The events that occurred during the run; empty if no events were requested."""
        if self._events is not None:
            return self._events
        empty = np.empty(0, dtype=np.intc)
        return Events(self[:0], empty, empty.copy())

    def __call__(self, t: Numbers) -> Path:
        """Return the path of the same motion at other times.

        The states are bitwise identical to those that kreisel.solve returns for the same times.

        t  a number, for a path with one state, or a list in any order; all times must lie between
           the start and the end of the path [T]

            >>> import kreisel as kr
            >>> path = kr.solve(kr.scenes.asymmetric, 10)
            >>> path([2.5, 1.0]).t.tolist()
            [2.5, 1.0]

        Closed forms are evaluated directly; any other motion is computed again from its initial
        state. The returned path contains the quantities in `want`, but neither events nor tangents.

        Raises ValueError for times outside the range of the path. Raises ValueError for the path of
        a kreisel.ExactMap, which is defined only at whole steps of the method. Raises kreisel.Error
        and kreisel.Interrupted under the same conditions as kreisel.solve.
        """
        if self._options.requested_method == EXACT != self.method:
            raise ValueError(
                f"this path is from the closed form of {self.method}, a map without states "
                "between its steps: call the result of kreisel.exact with the numbers of steps"
            )
        times = validate_times_within_path(self.t, t, self.start_time)
        result = compute_states_at_unordered_times(self.scene, self._options, times, self._origin)
        path = build_path_or_raise(self.scene, self._options, result, self._origin)
        states = NO_STATES if path._columns else path.states
        return replace(path, states=states, _is_back=self._is_back, _choice=self._choice)

    def __getitem__(self, which: StateIndex) -> Path:
        """Return a path that contains the selected states, but no events.

        An integer selects a single state. A slice, a list of integers or a Boolean mask selects
        several states, as in NumPy.

            >>> import kreisel as kr
            >>> path = kr.solve(kr.scenes.thesis, [0.0, 1.0, 2.0, 3.0])
            >>> len(path[-1]), path[::2].t.tolist(), path[path.t > 1.5].t.tolist()
            (1, [0.0, 2.0], [2.0, 3.0])
        """
        indices = normalize_path_index(len(self), which)
        if self._columns is not None:
            columns = {name: column[indices] for name, column in self._columns.items()}
            return replace(self, states=NO_STATES, _columns=columns, _events=None)
        low = None if self._low is None else self._low[indices]
        tangent_data = self._tangent_data and self._tangent_data.select_tangents_at_states(indices)
        return replace(
            self, states=self.states[indices], _low=low, _events=None, _tangent_data=tangent_data
        )

    def __iter__(self) -> Iterator[Path]:
        """Return an iterator over the states, each of which is a path of length 1."""
        return (self[i] for i in range(len(self)))

    def __array__(self, dtype: object = None, copy: object = None) -> NoReturn:
        """Raise TypeError, because a path cannot be converted to a single array."""
        raise TypeError("a path is not an array: use an array such as path.q or path.states")

    @property
    def start_time(self) -> float:
        """The time [T] of the initial state of `path.scene`.

        The value is 0 unless the path is from a kreisel.Run that has been pushed, reset or changed.
        If the run was changed, the value is the time of the last change before the first state of
        the path.
        """
        return self._origin.begin

    def scene_at(self, i: int) -> Scene:
        """Return a scene whose initial state, at t = 0, is the i-th state of this path.

        The phase of a shaken support is advanced to the time of the selected state. Raises
        IndexError if the path has no state with this index.
        """
        (state,) = self.states[normalize_path_index(len(self), index(i))]
        shaking = advance_shaking_phase(self.scene.shaking, float(state[0]))
        return self.scene.replace(attitude=state[1:5], momentum=state[5:], shaking=shaking)

    @property
    def end(self) -> Scene:
        """The scene whose initial state, at t = 0, is the final state of this path.

        Raises IndexError if the path has no states.
        """
        return self.scene_at(-1)

    def only(self, want: Iterable[QuantityName]) -> Path:
        """Return a copy of the path that contains only t and the quantities in `want`."""
        names = validate_requested_quantities(want) or ()
        words: tuple[str, ...] = ("t", *names)
        columns = {name: np.ascontiguousarray(getattr(self, name)) for name in words}
        options = replace(self._options, want=names).with_heading(self.scene)
        return replace(
            self,
            states=NO_STATES,
            _options=options,
            _low=None,
            _columns=columns,
            _tangent_data=None,
        )

    def save(self, file: str | os.PathLike[str]) -> None:
        """Write the path to a file that can be read by kreisel.load.

        The file is replaced atomically. Raises OSError if the file cannot be written.

        The file is an archive that can also be read by numpy.load. Its entries are:

        - t, q, m (and q_low, m_low), or t and the quantities in `want`;
        - scene, in TOML;
        - head, in JSON: method, step, tol, digits, want, stats, the choice of method="geometric";
        - events_t, events_q, events_m, events_which and events_direction, if there are events;
        - tangents and tangents_low, if there are tangents.
        """
        atomic_write(file, encode_path_as_archive(self, self._events_for_archive))

    @property
    def _events_for_archive(self) -> tuple[Path, Integers, Integers] | None:
        """The events in the form in which path.save writes them.

        The tuple contains the path of the states at the events, the indices of the events, and
        their directions.
        """
        events = self._events
        return None if events is None else (events.path, events.which, events.direction)

    def _tabulate(self, names: Iterable[str], degrees: bool, unwrap: bool) -> ColumnTable:
        controls = {"method": self.method, "step": self.step, "tol": self.tol}
        attributes = {**controls, "digits": self.digits, "scene": self.scene.to_toml()}
        return ColumnTable(
            {"time": len(self)},
            list_quantity_columns(self, names, degrees, unwrap),
            {name: value for name, value in attributes.items() if value is not None},
        )

    def plot(
        self,
        axes: Iterable[Axes] | None = None,
        *,
        degrees: bool = True,
        time_unit: str = "T",
    ) -> FigureAxes:
        """Draw this path in the same way as kreisel.plot, and return the picture."""
        from .._plot.charts import plot_paths

        events = self.events.path if len(self.events) else None
        return plot_paths([(self, events)], axes, degrees, time_unit)

    def _repr_html_(self) -> str | None:
        """Return this path as a picture for display in notebooks.

        Returns None if matplotlib is not installed, if the path is empty or too long, or if a
        quantity needed for the picture is missing. If no picture is returned, the notebook displays
        the repr.
        """
        quantities = {"apex", "nutation", "precession_angle"}
        is_stored = self.want is None or quantities.issubset(self.want)
        if not is_stored or not 0 < len(self) <= MOST_DISPLAYED:
            return None
        return format_picture_as_html(lambda: self.plot()[0], repr(self))

    def animate(
        self,
        file: str | os.PathLike[str] | None = None,
        *,
        speed: float | None = None,
        fps: int = 25,
        size: int = 480,
        time_unit: str | None = None,
    ) -> Film:
        """Return an animation of the body with the trace of its apex, drawn with matplotlib.

        The animation can be displayed in a notebook or saved to a file. Bodies that are symmetric
        about the axis through the apex are drawn as bodies of revolution, and all others as
        cuboids. The proportions of the drawn body are derived from the moments of inertia. The
        centre of the drawn body is on the line through the fixed point and the centre of mass. The
        floor is below the lowest position of the body, and shows the shadow of the body. The camera
        is placed so that the first clear tilt is seen from the side.

        file       a name ending in .gif, .mp4 (needs ffmpeg) or .html; the file is written
                   atomically
        speed      the time of the path that passes in one second of the film [T]; default: the
                   whole path in 8 seconds
        fps        frames per second; the duration of a frame of a GIF is rounded to 1/100 second,
                   at least 2/100
        size       the height and width of a frame [pixels]
        time_unit  the unit of time in which the scene is described, for the clock; default: none

            >>> import kreisel as kr
            >>> path = kr.solve(kr.scenes.cusps, 2)
            >>> path.animate(fps=5, size=120)
            <Film: 41 frames, 5 a second, t = 0 .. 2>

        The frames are evenly spaced in time, regardless of the times of the path. The states in the
        frames are computed by calling `path(t)`, which may raise exceptions. The trace contains the
        motion between the frames or, if it has hundreds of turns, separate points. Raises
        ValueError for a path without duration, an unknown suffix, or more than 2**28 pixels in
        total. Raises OSError if the file cannot be written.
        """
        from .._plot.film import make_film

        return make_film(self, file, speed, fps, size, time_unit)


@dataclass(frozen=True, eq=False)
class Events(ReadOnlyArrays):
    """k events in the order in which they occurred along a path. Arrays are read-only.

    path       a kreisel.Path of the states at the events; its times t (k,) are in the order of the
               original path [T]
    which      (k,) for each occurrence, the index of its event in the list passed to solve
    direction  (k,) 1: the event function increased with time, or had a minimum; -1: it decreased,
               or had a maximum
    """

    path: Path
    which: npt.NDArray[np.intc]
    direction: npt.NDArray[np.intc]

    def __post_init__(self) -> None:
        self.which.flags.writeable = self.direction.flags.writeable = False

    def __len__(self) -> int:
        return len(self.path)

    @property
    def t(self) -> Array:
        """(k,) times [T]."""
        return self.path.t

    @property
    def states(self) -> Array:
        """(k, 8): t [T], q (w, x, y, z), m [M L^2 T^-1]."""
        return self.path.states


class RunStoppedException(BaseException):
    """Base class of exceptions for runs that ended before the last requested time.

    status  the name of the status in kreisel.h without its prefix: 'ERR_LIMIT', 'ERR_NOT_FINITE',
            ...
    path    the requested states that were reached, and the last valid state if it is later
    paths   the kreisel.Paths or kreisel.Reductions of an ensemble, or a kreisel.Indicator,
            otherwise None; `path` is then the path of the first top that failed or was not finished
    """

    def __init__(self, message: str, status: str, path: Path, paths: Any = None) -> None:
        super().__init__(message)
        self.status = status
        self.path = path
        self.paths = paths

    def __reduce__(self) -> tuple[type[RunStoppedException], tuple[str, str, Path, object]]:
        return type(self), (str(self), self.status, self.path, self.paths)


class Error(RunStoppedException, RuntimeError):
    """Exception for a failed run; `path` contains the valid states, and `status` is the reason."""

    __module__ = "kreisel"  # a traceback then shows the public name


class Interrupted(RunStoppedException, KeyboardInterrupt):
    """Exception for a run interrupted by Ctrl-C, with the computed states in `.path`."""

    __module__ = "kreisel"


def make_stop_exception(status: str, path: Path, place: str) -> BaseException:
    """Return the exception for the status with which a run ended.

    The exception is a RunStoppedException that contains the path, unless the input was invalid. The
    text `place` states the time that the run reached.
    """
    kinds: dict[str, type[RunStoppedException]] = {"FAILURE": Error, "INTERRUPT": Interrupted}
    kind, text = statuses[status]
    if path.tol is not None and status in ("ERR_STEP", "ERR_CONVERGENCE"):
        clause = ", which is below the rounding of doubles" if path.tol < ROUNDING else ""
        text += f" at tol = {path.tol!r}{clause}"
    if kind in kinds:
        return kinds[kind](f"{text}: {place}", status, path)
    return make_core_start_error(status, path.scene, path.method, path.step, path.tol)


def build_path_from_core_result(
    scene: Scene, options: Options, result: CoreResult, origin: RunStart = ORIGIN
) -> Path:
    """Build a path from a result of the C library."""
    _, states, low, counts, end = result
    is_back = end < 0.0 and options.step is not None
    stats, options = Stats(*counts), options.copy_with_default_run_settings
    return Path(scene, states, stats, options, is_back, low, _origin=origin)


def build_path_or_raise(
    scene: Scene, options: Options, result: CoreResult, origin: RunStart = ORIGIN
) -> Path:
    """Build a path with the requested quantities from a result of the C library.

    If the status of the result is not 'OK', the exception given by make_stop_exception is raised.
    """
    path = drop_unrequested_quantities(
        build_path_from_core_result(scene, options, result, origin), options.want, result[-1]
    )
    if result[0] != "OK":
        raise make_stop_exception(result[0], path, format_progress(path, result[-1]))
    return path


def drop_unrequested_quantities(
    path: Path, want: tuple[QuantityName, ...] | None, end: float
) -> Path:
    """Return a copy of the path with only t and the quantities in `want`.

    If `want` is None, the path itself is returned. If Ctrl-C interrupts the computation of these
    quantities, it is repeated, and kreisel.Interrupted is raised with the complete path. `end`
    is the last requested time.
    """
    if want is None:
        return path
    try:
        return path.only(want)
    except KeyboardInterrupt:
        part = path.only(want)
        raise make_stop_exception("ERR_INTERRUPTED", part, format_progress(part, end)) from None


def format_progress(path: Path, end: float) -> str:
    """Return a message with the time that a path reached and the last requested time `end`."""
    last = path.t[-1] if len(path) else 0.0
    steps = format_count(path.stats.steps, "step")
    return f"{path.method} reached t = {last:g} of {end:g} in {steps}"


CoreEvents = tuple[Array, Array, npt.NDArray[np.intc], npt.NDArray[np.intc]]


def record_path(scene: Scene, options: Options, times: Array, progress: Progress | None) -> Path:
    """Return the path of a scene at times that have already been validated."""
    result = compute_states_at_times(scene, options, times, progress)
    return report_final_time(build_path_or_raise(scene, options, result), progress)


def report_final_time(path: Path, progress: Progress | None) -> Path:
    """Report the final time of a path to the callback `progress`, and return the path."""
    if progress is not None and len(path):
        progress(float(path.t[-1]))
    return path


def add_events_to_path(path: Path, core_events: CoreEvents) -> Path:
    """Return a copy of a path to which the recorded events are added.

    For each event, `core_events` contains the state, its low-order part, and the index and
    direction of the event.
    """
    states, low, which, direction = core_events
    event_path = replace(path, states=states, _low=low)
    return replace(path, _events=Events(event_path, which, direction))


def _join_path_events(event_parts: list[Events]) -> Events:
    """Concatenate the events of consecutive paths, and return the result."""
    states = np.concatenate([one.states for one in event_parts])
    low = np.concatenate([low for one in event_parts if (low := one.path._low) is not None])
    path = replace(event_parts[-1].path, states=states, _low=low)
    which, direction = (
        [getattr(one, name) for one in event_parts] for name in ("which", "direction")
    )
    return Events(path, np.concatenate(which), np.concatenate(direction))


class ColumnRecorder:
    """A buffer for quantities and events that are recorded in chunks."""

    def __init__(self, want: tuple[QuantityName, ...], n: int) -> None:
        self._want, self._n, self._done = want, n, 0
        self._arrays: dict[str, Array] = {}
        self._events: list[Events] = []

    def append_path_part(self, part: Path) -> None:
        """Append the recorded quantities and events of the path `part`."""
        for name in ("t", *self._want):
            column = getattr(part, name)
            if name not in self._arrays:
                self._arrays[name] = np.empty((self._n, *column.shape[1:]))
            self._arrays[name][self._done : self._done + len(part)] = column
        self._done += len(part)
        if part._events is not None:
            self._events.append(part._events)

    def build_recorded_path(self, last: Path) -> Path:
        """Build a path from the recorded quantities and events."""
        columns = {name: column[: self._done] for name, column in self._arrays.items()}
        events = _join_path_events(self._events) if self._events else None
        options = replace(last._options, want=self._want)
        return replace(
            last, states=NO_STATES, _options=options, _low=None, _events=events, _columns=columns
        )


def record_quantities_in_chunks(
    times: Array,
    want: tuple[QuantityName, ...],
    record: Callable[[Array], tuple[str, Path]],
    has_ended: Callable[[], bool],
) -> tuple[str, Path]:
    """Record selected quantities in chunks, and return the status and the path of the run.

    The first chunk is a single state, so that Ctrl-C leaves a path that is not empty.
    """
    columns = ColumnRecorder(want, times.size)
    status, part = record(times[:1])
    columns.append_path_part(part)
    try:
        for first in range(1, times.size, CHUNK_SIZE):
            if status != "OK" or has_ended():
                break
            status, part = record(times[first : first + CHUNK_SIZE])
            columns.append_path_part(part)
    except KeyboardInterrupt:
        status = "ERR_INTERRUPTED"
    return status, columns.build_recorded_path(part)


@lru_cache(maxsize=256, typed=True)
def build_request_from_solve_arguments(
    method: object,
    step: object = None,
    tol: object = None,
    digits: object = None,
    max_steps: object = 0,
    want: object = None,
) -> Request:
    """Validate arguments of kreisel.solve, and return them as a reusable request.

    With method='auto', the method is chosen separately for each scene. Raises TypeError or
    ValueError for an invalid argument, and TypeError for an argument that is not hashable.
    """
    options = make_options(
        method, step=step, tol=tol, digits=digits, max_steps=max_steps, want=want
    )
    if options.has_step_search:
        raise ValueError("a search for the step takes several runs")
    if not options.is_auto:
        return _build_request(options.with_method(options.method))
    closed_form = _build_request(options.with_method(EXACT))
    decide = compute_closed_form_error_limit if step is tol is None else None
    return _build_request(options.with_method(FALLBACK), closed_form, decide)


def build_request_from_solve_options(options: Options) -> Request | None:
    """Build a request from the options, or return None if it needs several C library calls."""
    if options.error is not None or options.requests_events or options.tangents:
        return None
    return _build_request(replace(options, every=None))


@lru_cache(maxsize=256, typed=True)
def _build_request(
    options: Options,
    closed_form: Request | None = None,
    decide: Callable[..., float] | None = None,
) -> Request:
    want, path_options = options.want, options.copy_with_default_run_settings
    if want is not None:
        path_options = replace(path_options, want=want)
    core, most, limit = (
        options.core_arguments,
        options.max_time_with_exact_step_count,
        options.chunk_size,
    )
    classes = Path, Stats, Scene
    return Request(classes, options, path_options, core, want, most, limit, closed_form, decide)


def try_to_solve_in_core(
    scene: Scene,
    t: object,
    method: object,
    step: object,
    tol: object,
    digits: object,
    max_steps: object,
    want: object,
    progress: Progress | None,
) -> Path | None:
    """Return the path of a scene, or None if Python code must first validate the arguments.

    Raises the exception returned by make_stop_exception if the run fails.
    """
    names = tuple(want) if type(want) is list else want
    if names is not None and type(names) is not tuple:
        return None  # an iterator, which can be read only once
    try:
        request = build_request_from_solve_arguments(method, step, tol, digits, max_steps, names)
    except (TypeError, ValueError):
        return None
    path: Path | tuple[Options, CoreResult] | None = request.solve(scene, t, progress)
    if not isinstance(path, tuple):
        return path
    options, result = path
    return report_final_time(build_path_or_raise(scene, options, result), progress)
