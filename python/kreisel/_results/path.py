"""The path of one top: its states, quantities and events."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from operator import index
from typing import TYPE_CHECKING, Any, NoReturn, Self, TypeVar, cast

import numpy as np
import numpy.typing as npt

from .._core import statuses
from .._model.parameters import advance_shaking_phase
from .._model.scene import Ensemble, Scene
from .._options.methods import EXACT
from .._options.options import (
    RECORDABLE,
    TIME,
    Options,
    format_index,
    get_member_by_flat_index,
    unravel_index,
    validate_requested_quantities,
    validate_time_list,
)
from .._options.plan import Plan, StepChoice, make_solve_plan
from .._utils.arguments import (
    Array,
    Numbers,
    ReadOnlyArrays,
    format_count,
    freeze_array,
    make_frozen_class_decorator,
    short_repr,
    validate_type,
)
from .._utils.files import Integers, atomic_write
from .._utils.html import format_picture_as_html
from .._utils.quantity_attributes import QuantityAttributes, QuantityName
from .archive import encode_ensemble_as_archive, encode_path_as_archive
from .buffers import INTERRUPTED, STATUSES, Counts, EnsembleBuffers, EventColumns
from .error import (
    ORIGIN,
    ROUNDING,
    SERIES,
    CoreResult,
    RunStart,
    compute_angles_between_attitudes,
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
    add_quantity_properties,
    find_flat_index,
    list_flat_indices,
    normalize_path_index,
    validate_times_within_path,
)
from .tables import (
    ColumnTable,
    TableColumn,
    TableExportMethods,
    describe_quantities,
    list_parameter_columns,
    list_quantity_columns,
    name_axes,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from .._plot.charts import FigureAxes
    from .._plot.film import Film


MOST_DISPLAYED = 100_000  # number of states of the longest path that notebooks display as a picture


@dataclass(frozen=True, eq=False, init=False)
class Path(ReadOnlyArrays, PathBase, TableExportMethods):
    """The computed motion of one top or of all tops of an ensemble, sampled at n times.

    All arrays are read-only, but copies of them are writeable. The arrays t, q and m are views of
    `states`, and other quantities are computed on first access. Vectors are given by their
    components in the space frame unless stated otherwise. The documented shapes are those of one
    top, whose `shape` is (). For many tops, each array begins with the dimensions of the ensemble,
    and numbers such as `error` are arrays of its shape. If a top failed, its values after the last
    valid state are NaN.

    path[i]  for one top, a path with the selected states. For many tops, the path of one top with
             the same values, or the path of several tops, selected as in NumPy. Calling the path of
             one top with other times solves this top alone, and taylor may then round differently

    scene   the kreisel.Scene or kreisel.Ensemble
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
    _many: EnsembleResult | None = None  # the result of an ensemble with the same states
    _failure: tuple[str, str] | None = None  # the status and the message of a failed run

    def __init__(
        self,
        scene: Any,
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
        _many: EnsembleResult | None = None,
        _failure: tuple[str, str] | None = None,
    ) -> None:
        fields = self.__dict__  # avoids the slow object.__setattr__ of frozen dataclasses
        fields["scene"], fields["stats"], fields["_options"] = scene, stats, _options
        fields["_is_back"], fields["_low"], fields["_columns"] = _is_back, _low, _columns
        fields["_events"], fields["_choice"] = _events, _choice
        fields["_tangent_data"], fields["_origin"] = _tangent_data, _origin
        fields["_many"], fields["_failure"] = _many, _failure
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

    @classmethod
    def _of_many(cls, tops: Ensemble, t: Array, options: Options, buffers: EnsembleBuffers) -> Self:
        """Return the path of all tops of an ensemble, whose arrays are views of `buffers`."""
        many = EnsembleResult(tops, t, options, buffers)
        shape, states, columns, data = many._reshape_to_ensemble, NO_STATES, None, None
        if options.want is not None:
            columns = {"t": many.t} | {k: shape(rows) for k, rows in buffers.columns.items()}
        elif buffers.states is not None:
            states = shape(buffers.states)
        if buffers.tangents is not None and buffers.truncation is not None:
            high, low = buffers.tangents, buffers.tangents_low
            rest = np.broadcast_to(0.0, high.shape) if low is None else low
            truncation = shape(buffers.truncation)
            data = TangentData(shape(high), shape(rest), truncation, options.tangents)
        low = None if buffers.low is None else shape(buffers.low)
        is_back = options.step is not None and t.size > 0 and bool((t[..., -1] < 0.0).all())
        return cls(
            tops, states, many.stats, options, is_back, low, columns, _tangent_data=data, _many=many
        )

    def __getstate__(self) -> dict[str, Any]:
        return vars(self) if self._many is None else {"_many": self._many}

    def __setstate__(self, state: dict[str, Any]) -> None:
        many = state.get("_many")
        if many is not None:
            path = Path._of_many(many.scene, many._t, many._options, many._buffers)
            state = vars(path) | state
        super().__setstate__(state)

    def __repr__(self) -> str:
        if self._many is not None:
            states = format_count(self.t.shape[-1], "state")
            summary = self._many._format_summary()
            return f"<kreisel.Path of shape {self.shape}, {states} each: {summary}>"
        values = {"step": self.step, "tol": self.tol, "digits": self.digits}
        controls = "".join(f", {k}={v!r}" for k, v in values.items() if v is not None)
        span = f", t = {self.t[0]:g} .. {self.t[-1]:g}" if len(self) else ""
        ran = f"{self.method}{controls}, {format_count(self.stats.steps, 'step')}"
        return f"<kreisel.Path: {format_count(len(self), 'state')}{span}; {ran}>"

    @property
    def status(self) -> str:
        """(*shape) the name of each top's status: 'OK', 'ERR_LIMIT', ...; a str for one top.

        The names are those of the status constants in kreisel.h without the prefix KR_. The method
        `message` describes a failure. The run of one top raises an exception if it fails; the path
        of the exception has the status.
        """
        if self._many is not None:
            return cast(str, self._many.status)
        return "OK" if self._failure is None else self._failure[0]

    @property
    def failed(self) -> npt.NDArray[np.intp]:
        """(f,) the indices of the tops that did not reach their last time.

        For f failed tops, the shape is (f,) for one-dimensional ensembles and (f, ndim) otherwise.
        """
        return list_failed(self.status)

    @property
    def reached(self) -> float:
        """(*shape) the time of the last valid state of each top [T]; a float for one top."""
        if self._many is not None:
            return cast(float, self._many.reached)
        return float(self.t[-1]) if len(self) else self.start_time

    @property
    def state_counts(self) -> int:
        """(*shape) the number of requested times that each top reached; an int for one top."""
        return len(self) if self._many is None else cast(int, self._many.state_counts)

    def message(self, index: int | tuple[int, ...] = ()) -> str:
        """Return the reason why the top at `index` failed, or 'success' if it did not fail."""
        if self._many is not None:
            return self._many.message(index)
        if index != ():
            raise IndexError(f"{short_repr(index)} is not the index of one top, of the shape ()")
        return statuses["OK"][1] if self._failure is None else self._failure[1]

    def check(self) -> Path:
        """Check that every top reached its final time, and return this path.

        Raises kreisel.Error, or kreisel.Interrupted after Ctrl-C, for the first top that did not
        reach its final time. The error message states the index of this top and the total number of
        failed tops. The attribute `path` of the exception is the path of the failed top, and
        `result` is the path of all tops.
        """
        if self._many is not None:
            self._many._check_all(self)
        elif self._failure is not None:
            kind = Interrupted if statuses[self.status][0] == "INTERRUPT" else Error
            raise kind(self._failure[1], self.status, self)
        return self

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
        if self._many is not None:
            return cast(float, self._compute_per_top(lambda path: path.error))
        if not len(self):
            return 0.0
        if self._choice and self._columns is not None and "q" not in self._columns:
            return self._choice.error

        def angle_to(second: Options) -> float:  # including digits beyond double precision
            result = compute_states_at_unordered_times(self.scene, second, self.t, self._origin)
            other = build_path_or_raise(self.scene, second, result, self._origin)
            pairs = (self.q, self.q_low), (other.q, other.q_low)
            return float(compute_angles_between_attitudes(*pairs).max())

        def growth() -> float:
            result, largest = estimate_rounding_growth(
                self.scene, self.t, self.digits or 16, origin=self._origin
            )
            build_path_or_raise(self.scene, SERIES, result, self._origin)
            return largest

        return estimate_attitude_error(self.scene, self.method, self.digits, angle_to, growth)

    @cached_property
    def plan(self) -> Plan:
        """The kreisel.Plan of this path, with the choices of the solver and their reasons.

        For many tops, an array (*shape) with the plan of each top.
        """
        if self._many is not None:
            plans = np.empty(self.size, dtype=object)
            plans[:] = [path.plan for path in self._list_members()]
            plans.flags.writeable = False
            return cast(Plan, plans.reshape(self.shape))
        return make_solve_plan(self.scene, self._options, len(self), self._choice, self.t)

    @cached_property
    def events(self) -> Events:
        """The events that occurred during the run; empty if no events were requested."""
        if self._events is not None:
            return self._events
        if self._many is not None:
            many, found = self._many, self._many._event_columns
            find_path = partial(build_event_path, many.scene, many._options, found)
            return Events._of_many(found, self.shape, find_path)
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
        a kreisel.types.ExactMap, which is defined only at whole steps of the method. Raises
        kreisel.Error and kreisel.Interrupted under the same conditions as kreisel.solve.
        """
        if self._many is not None:
            return _stack_paths(self._many, t, [path(t) for path in self._list_members()])
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

    def __getitem__(self, which: StateIndex | Any) -> Path:
        """Return a path that contains the selected states, but no events, or the selected tops.

        For one top, an integer selects a single state. A slice, a list of integers or a Boolean
        mask selects several states, as in NumPy. For many tops, an index of NumPy selects tops.

            >>> import kreisel as kr
            >>> path = kr.solve(kr.scenes.thesis, [0.0, 1.0, 2.0, 3.0])
            >>> len(path[-1]), path[::2].t.tolist(), path[path.t > 1.5].t.tolist()
            (1, [0.0, 2.0], [2.0, 3.0])
            >>> many = kr.solve(kr.scenes.thesis.vary(gravity=[0.0, 0.5, 1.0]), [0.0, 1.0, 2.0])
            >>> many[2], many[1:].q.shape
            (<kreisel.Path: 3 states, t = 0 .. 2; exact, 2 steps>, (2, 3, 4))
        """
        if self._many is not None:
            i = find_flat_index(self.shape, which)
            if i is not None:
                return self._many._select_member(i)
            return Path._of_many(*self._many._select_rows(which))
        indices = normalize_path_index(len(self), which)
        if self._columns is not None:
            columns = {name: column[indices] for name, column in self._columns.items()}
            return replace(self, states=NO_STATES, _columns=columns, _events=None)
        low = None if self._low is None else self._low[indices]
        data = self._tangent_data
        if data is not None:
            high, rest = freeze_array(data.high[indices]), freeze_array(data.low[indices])
            data = data._replace(high=high, low=rest)
        return replace(
            self, states=self.states[indices], _low=low, _events=None, _tangent_data=data
        )

    def __iter__(self) -> Iterator[Path]:
        """Return an iterator over the states of one top, or over the first dimension."""
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
        IndexError if the path has no state with this index. For many tops, the result is a
        kreisel.Ensemble.
        """
        if self._many is not None:
            scenes = Ensemble.of([path.scene_at(i) for path in self._list_members()])
            return cast(Scene, scenes.reshape(self.shape))
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
        if self._many is not None:
            return self._many._only(self, names)
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

        For many tops, head also contains the scenes, and the entries are t, status, done, counts,
        reached, states or column_nutation and so on, and those of events and tangents.
        """
        if self._many is not None:
            many = self._many
            data = encode_ensemble_as_archive(many.scene, many._t, many._options, many._buffers)
        else:
            data = encode_path_as_archive(self, self._events_for_archive)
        atomic_write(file, data)

    @property
    def _events_for_archive(self) -> tuple[Path, Integers, Integers] | None:
        events = self._events
        return None if events is None else (events.path, events.which, events.direction)

    def _tabulate(self, names: Iterable[str], degrees: bool, unwrap: bool) -> ColumnTable:
        if self._many is not None:
            taken = [each.name for each in describe_quantities(self, names, degrees)]
            axes = name_axes(self._many.scene, taken)
            quantities = list_quantity_columns(self, names, degrees, unwrap, axes)
            return self._many._make_column_table(quantities, taken, {"time": self.t.shape[-1]})
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
        """Draw this path in the same way as kreisel.plot, and return the picture.

        Up to 8 tops are drawn side by side. Raises ValueError for more.
        """
        from .._plot.charts import plot_paths

        return plot_paths(
            [
                (path, path.events.path if len(path.events) else None)
                for path in list_drawn_paths(self)
            ],
            axes,
            degrees,
            time_unit,
        )

    def _repr_html_(self) -> str | None:
        """Return a picture, or None if it is empty, too large, or lacks a quantity."""
        quantities = {"apex", "nutation", "precession_angle"}
        is_stored = self.want is None or quantities.issubset(self.want)
        if not is_stored or not 0 < self.size <= MOST_DRAWN:
            return None
        if not 0 < self.size * self.t.shape[-1] <= MOST_DISPLAYED:
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

        check_is_one("a film shows", self)
        return make_film(self, file, speed, fps, size, time_unit)


@dataclass(frozen=True, eq=False)
class Events(ReadOnlyArrays, QuantityAttributes):
    """k events along the path of one top, or of all tops of an ensemble.

    The events are sorted by top, and for each top in the order in which they occurred. Arrays are
    read-only. The physical quantities at the events are attributes, as of a kreisel.Path, such as
    `events.nutation` (k,).

    which      (k,) for each occurrence, the index of its event in the list passed to solve
    direction  (k,) 1: the event function increased with time, or had a minimum; -1: it decreased,
               or had a maximum
    """

    _source: Path | Callable[[], Path]
    which: npt.NDArray[np.intc]
    direction: npt.NDArray[np.intc]
    _columns: EventColumns | None = None  # None for one top
    shape: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        self.which.flags.writeable = self.direction.flags.writeable = False

    @classmethod
    def _of_many(
        cls, columns: EventColumns, shape: tuple[int, ...], find_path: Callable[[], Path]
    ) -> Events:
        """Return the events of an ensemble; `find_path` returns the attribute `path`."""
        columns.states.flags.writeable = False
        return cls(find_path, columns.which, columns.direction, columns, shape)

    def __len__(self) -> int:
        return len(self.which)

    def __repr__(self) -> str:
        tops = f" of {format_count(math.prod(self.shape), 'top')}" if self.shape else ""
        return f"<kreisel.Events: {format_count(len(self), 'event')}{tops}>"

    @cached_property
    def path(self) -> Path:
        """The states at the events as a kreisel.Path.

        For one top, the path has k states. For an ensemble, it has the shape (k,), with the top and
        one state of each event.
        """
        return self._source if isinstance(self._source, Path) else self._source()

    @cached_property
    def top(self) -> Counts:
        """(k,) the index of the top; (k, ndim) unless the ensemble has one dimension."""
        row = np.zeros(len(self), np.int64) if self._columns is None else self._columns.top
        top: Counts = unravel_rows(row, self.shape)
        return top

    @cached_property
    def count(self) -> int:
        """(*shape) the number of events of each top; an int for one top."""
        if self._columns is None:
            return len(self)
        n = math.prod(self.shape)
        count: Any = np.bincount(self._columns.top, minlength=n).reshape(self.shape)
        return cast(int, freeze_array(count))

    @property
    def states(self) -> Array:
        """(k, 8): t [T], q (w, x, y, z), m [M L^2 T^-1]."""
        return self.path.states if self._columns is None else self._columns.states

    @property
    def t(self) -> Array:
        """(k,) times [T]."""
        return self.path.t if self._columns is None else self.states[:, 0]

    @property
    def q(self) -> Array:
        """(k, 4) unit quaternions (w, x, y, z), from the frame of description to space."""
        return self.path.q if self._columns is None else self.states[:, STATE_COLUMNS["q"]]

    @property
    def m(self) -> Array:
        """(k, 3) angular momentum about the fixed point [M L^2 T^-1]."""
        return self.path.m if self._columns is None else self.states[:, STATE_COLUMNS["m"]]


if TYPE_CHECKING:  # Type checkers tell the path of an ensemble from that of one top.

    class EnsembleEvents(Events):
        count: Counts  # type: ignore[assignment]

    class EnsemblePath(Path):
        scene: Ensemble  # type: ignore[assignment]
        error: Array  # type: ignore[assignment]
        energy_error: Array  # type: ignore[assignment]
        tangents_rest: Array  # type: ignore[assignment]
        status: npt.NDArray[np.str_]  # type: ignore[assignment]
        reached: Array  # type: ignore[assignment]
        state_counts: Counts  # type: ignore[assignment]
        stats: Any
        plan: npt.NDArray[np.object_]  # type: ignore[assignment]
        events: EnsembleEvents
        end: Ensemble  # type: ignore[assignment]

        def scene_at(self, i: int) -> Ensemble: ...  # type: ignore[override]
        def __getitem__(self, which: Any) -> Any: ...
        def __call__(self, t: Numbers) -> Self: ...
        def check(self) -> Self: ...
        def only(self, want: Iterable[QuantityName]) -> Self: ...

else:
    EnsemblePath = Path


def _compute_event_quantity(events: Events, name: str) -> Array:
    values: Array = getattr(events.path, name)
    return values if events._columns is None else values[:, 0]


add_quantity_properties(Events, ("k",), _compute_event_quantity)


def build_event_path(tops: Ensemble, options: Options, columns: EventColumns) -> Path:
    """Return a path of shape (k,) with the top and one state of each of k events."""
    k, t = len(columns.top), columns.states[:, :1].copy()
    options = replace(options, want=None, tangents=(), events=None)
    buffers = EnsembleBuffers.allocate_buffers(k, 1, options, columns.states[:, None])
    buffers.status[:], buffers.done[:], buffers.reached[:] = 0, 1, t[:, 0]
    buffers.low = columns.low[:, None]
    return Path._of_many(tops.ravel()[columns.top], t, options, buffers)


class RunStoppedException(BaseException):
    """Base class of exceptions for runs that ended before the last requested time.

    status  the name of the status in kreisel.h without its prefix: 'ERR_LIMIT', 'ERR_NOT_FINITE',
            ...
    path    the requested states that were reached, and the last valid state if it is later; of
            several tops the path of the first that failed or was not finished; None for sweeps,
            fits and comparisons
    result  all that was computed: the path, or of several tops a kreisel.Path, kreisel.Reductions,
            kreisel.Section or kreisel.Chaos; the finished parts of a sweep; the rows of a
            comparison; the best fit so far or None
    """

    def __init__(
        self,
        message: str,
        status: str = "ERR_INTERRUPTED",
        path: Path | None = None,
        result: Any = None,
    ) -> None:
        super().__init__(message)
        self.status = status
        self.path: Any = path
        self.result: Any = path if result is None else result

    def __reduce__(self) -> tuple[type[RunStoppedException], tuple[str, str, Any, object]]:
        return type(self), (str(self), self.status, self.path, self.result)


class Error(RunStoppedException, RuntimeError):
    """Exception for a failed run; `path` contains the valid states, and `status` is the reason."""

    __module__ = "kreisel"  # a traceback then shows the public name


class Interrupted(RunStoppedException, KeyboardInterrupt):
    """Exception for a computation interrupted by Ctrl-C, with what was computed in `.result`."""

    __module__ = "kreisel"


def make_stop_exception(status: str, path: Path, place: str) -> BaseException:
    """Return the exception for the status of a run that ended at the time in the text `place`."""
    kinds: dict[str, type[RunStoppedException]] = {"FAILURE": Error, "INTERRUPT": Interrupted}
    kind, text = statuses[status]
    if path.tol is not None and status in ("ERR_STEP", "ERR_CONVERGENCE"):
        clause = ", which is below the rounding of doubles" if path.tol < ROUNDING else ""
        text += f" at tol = {path.tol!r}{clause}"
    if kind in kinds:
        vars(path)["_failure"] = status, f"{text}: {place}"
        return kinds[kind](f"{text}: {place}", status, path)
    return make_core_start_error(status, path.scene, path.method, path.step, path.tol)


def build_path_from_core_result(
    scene: Scene, options: Options, result: CoreResult, origin: RunStart = ORIGIN
) -> Path:
    _, states, low, counts, end = result
    is_back = end < 0.0 and options.step is not None
    stats, options = Stats(*counts), options.copy_with_default_run_settings
    return Path(scene, states, stats, options, is_back, low, _origin=origin)


def build_path_or_raise(
    scene: Scene, options: Options, result: CoreResult, origin: RunStart = ORIGIN
) -> Path:
    """Return the path of a result with the requested quantities; raise unless it is "OK"."""
    path = drop_unrequested_quantities(
        build_path_from_core_result(scene, options, result, origin), options.want, result[-1]
    )
    if result[0] != "OK":
        raise make_stop_exception(result[0], path, format_progress(path, result[-1]))
    return path


def drop_unrequested_quantities(
    path: Path, want: tuple[QuantityName, ...] | None, end: float
) -> Path:
    """Return the path with only `want`; if Ctrl-C interrupts, finish and raise Interrupted."""
    if want is None:
        return path
    try:
        return path.only(want)
    except KeyboardInterrupt:
        part = path.only(want)
        raise make_stop_exception("ERR_INTERRUPTED", part, format_progress(part, end)) from None


def format_progress(path: Path, end: float) -> str:
    last = path.t[-1] if len(path) else 0.0
    steps = format_count(path.stats.steps, "step")
    return f"{path.method} reached t = {last:g} of {end:g} in {steps}"


_T = TypeVar("_T", bound=np.generic)


@make_frozen_class_decorator("call solve again for a different result")
@dataclass(frozen=True, eq=False, repr=False)
class EnsembleResult(ReadOnlyArrays):
    """The results of all tops of an ensemble.

    Arrays are read-only. The shape of each array starts with the shape of the ensemble.

    scene  the ensemble
    """

    scene: Ensemble
    _t: Array  # (k,), or (n, k) if each top has its own times
    _options: Options
    _buffers: EnsembleBuffers

    @property
    def shape(self) -> tuple[int, ...]:
        """The shape of the ensemble."""
        return self.scene.shape

    @property
    def ndim(self) -> int:
        """The number of dimensions of the ensemble."""
        return len(self.scene.shape)

    @property
    def size(self) -> int:
        """The number of tops."""
        return self.scene.size

    def __bool__(self) -> bool:
        return self.size > 0

    def __len__(self) -> int:
        return len(self.scene)

    @property
    def method(self) -> str:
        """The name of the requested method.

        For each top of an ensemble, the 'auto' of kreisel.solve and kreisel.reduce uses exact for
        Lagrange tops, spherical bodies and bodies without torque if exact applies to the scene, and
        taylor for all other tops. Sections always use taylor.
        """
        return self._options.requested_method

    @property
    def step(self) -> float | None:
        """The magnitude of the step size [T], or None if the method has none or chooses its own."""
        return self._options.step

    @property
    def tol(self) -> float | None:
        """The tolerance that was used, or None if the method has none or chooses its own."""
        return self._options.tol

    @property
    def digits(self) -> int | None:
        """The requested number of digits, or None if it was not given."""
        return self._options.digits

    def _reshape_to_ensemble(self, rows: npt.NDArray[_T]) -> npt.NDArray[_T]:
        """Return `rows`, an array with one row per top, reshaped to the ensemble's shape."""
        array = rows.reshape(self.shape + rows.shape[1:])
        array.flags.writeable = False
        return array

    @property
    def t(self) -> Array:
        """(k,) times common to all tops, or (*shape, k) if each top has its own times [T]."""
        return freeze_array(self._t[:]) if self._t.ndim == 1 else self._reshape_to_ensemble(self._t)

    @property
    def status(self) -> Any:
        """(*shape) the name of each top's status: 'OK', 'ERR_LIMIT', ...

        The names are those of the status constants in kreisel.h without the prefix KR_. The method
        `message` describes a failure.
        """
        return self._reshape_to_ensemble(np.array(STATUSES)[self._buffers.status])

    @property
    def failed(self) -> npt.NDArray[np.intp]:
        """(f,) the indices of the tops that did not reach their last time.

        For f failed tops, the shape is (f,) for one-dimensional ensembles and (f, ndim) otherwise.
        """
        return list_failed(self.status)

    @property
    def reached(self) -> Array:
        """(*shape) the time of the last valid state of each top [T]."""
        return self._reshape_to_ensemble(self._buffers.reached)

    @property
    def state_counts(self) -> Counts:
        """(*shape) the number of requested times that each top reached."""
        return self._reshape_to_ensemble(self._buffers.done)

    @property
    def stats(self) -> Any:
        """The cost of the run: four arrays (*shape) in a named tuple, such as `stats.steps`."""
        arrays: Any = [
            self._reshape_to_ensemble(column) for column in self._buffers.counts.T.copy()
        ]
        return Stats(*arrays)

    def message(self, index: int | tuple[int, ...]) -> str:
        """Return the reason why the top at `index` failed, or 'success' if it did not fail."""
        i = find_flat_index(self.shape, index)
        if i is None:
            raise IndexError(
                f"{short_repr(index)} is not the index of one top, of the shape {self.shape}"
            )
        return statuses["OK"][1] if self._buffers.status[i] == 0 else str(self._make_top_error(i))

    def check(self) -> Self:
        """Check that every top reached its final time, and return this result.

        Raises kreisel.Error, or kreisel.Interrupted after Ctrl-C, for the first top that did not
        reach its final time. The error message states the index of this top and the total number of
        failed tops. The attribute `path` of the exception is the path of the failed top, and
        `result` is this result.
        """
        self._check_all(self)
        return self

    def _check_all(self, result: object) -> None:
        indices = np.flatnonzero(self._buffers.status)
        if indices.size:
            raise self._make_stop_error(int(indices[0]), indices.size, result)

    def _make_top_error(self, i: int) -> BaseException:
        """Return the exception that would be raised if the i-th top were solved alone."""
        if i in self._buffers.messages:
            return ValueError(self._buffers.messages[i])
        path = self._select_member(i)
        place = format_progress(path, self._select_last_time(i))
        return make_stop_exception(STATUSES[self._buffers.status[i]], path, place)

    def _make_stop_error(self, i: int, count: int, result: object) -> Error | Interrupted:
        """Return the exception for `count` unfinished tops of `result`, first the `i`-th."""
        is_interrupted = bool(self._buffers.status[i] == INTERRUPTED)
        first = f", the first of {count} of {self.size}" if count > 1 else ""
        text = f"top{format_index(unravel_index(i, self.shape))}{first}: {self._make_top_error(i)}"
        kind = Interrupted if is_interrupted else Error
        return kind(text, STATUSES[self._buffers.status[i]], self._select_member(i), result)

    def _select_times_of_top(self, i: int) -> Array:
        return self._t if self._t.ndim == 1 else self._t[i]

    def _select_member(self, i: int) -> Path:
        """Return the path of the i-th top, counted in C order.

        If the top failed, the path ends with its last valid state, unless it stores tangents.
        """
        buffers, done = self._buffers, int(self._buffers.done[i])
        states, low = NO_STATES, None
        if buffers.states is not None:
            states = buffers.states[i, :done]
            low = None if buffers.low is None else buffers.low[i, :done]
        path = self._build_path_of_top(i, states, low)
        if buffers.tangents is not None:
            assert buffers.truncation is not None
            high, low = buffers.tangents[i, :done], buffers.tangents_low
            rest = np.zeros_like(high) if low is None else low[i, :done]
            error, by = float(buffers.truncation[i]), self._options.tangents
            data = TangentData(freeze_array(high), freeze_array(rest), error, by)
            return replace(path, _tangent_data=data)
        if buffers.columns:
            columns = {name: column[i, :done] for name, column in buffers.columns.items()}
            path = replace_states_by_quantities(
                path, {"t": self._select_times_of_top(i)[:done].copy()} | columns
            )
        if i in buffers.last or buffers.status[i]:
            path = self._append_last_valid_state(i, path)
        if buffers.status[i]:
            name = STATUSES[buffers.status[i]]
            place = format_progress(path, self._select_last_time(i))
            vars(path)["_failure"] = name, f"{statuses[name][1]}: {place}"
        if self._options.requests_events:
            found = self._event_columns
            rows = slice(*map(int, np.searchsorted(found.top, [i, i + 1])))
            states, low = found.states[rows].copy(), found.low[rows].copy()
            at_events = self._build_path_of_top(i, states, low)
            events = Events(at_events, found.which[rows].copy(), found.direction[rows].copy())
            vars(path)["_events"] = events
        return path

    @cached_property
    def _event_columns(self) -> EventColumns:
        return concatenate_slice_events(self._buffers.events)

    def _select_last_time(self, i: int) -> float:
        times = self._select_times_of_top(i)
        return float(times[-1]) if times.size else 0.0

    def _build_path_of_top(self, i: int, states: Array, low: Array | None) -> Path:
        steps, rejected, evaluations, iterations = self._buffers.counts[i].tolist()
        counts = steps, rejected, evaluations, iterations
        result = "OK", states, low, counts, self._select_last_time(i)
        scene, choice = get_member_by_flat_index(self.scene, i), self._buffers.chosen.get(i)
        if choice is None:
            options = replace(self._options.for_member(scene), want=None, error=None)
        else:
            options = Options(choice.method, abs(choice.step))
        path = build_path_from_core_result(scene, options, result)
        vars(path)["_choice"] = choice
        return path

    def _append_last_valid_state(self, i: int, path: Path) -> Path:
        """Return the path of the i-th top; append its last valid state if the path lacks it."""
        last = self._buffers.last.get(i)
        state = get_member_by_flat_index(self.scene, i)._start_state if last is None else last[:1]
        if len(path) == len(self._select_times_of_top(i)) or (
            len(path) and path.t[-1] == state[0, 0]
        ):
            return path
        low = None
        if path._low is not None:
            low = np.vstack([path._low, np.zeros((1, 8)) if last is None else last[1:]])
        if path._columns is None:
            return self._build_path_of_top(i, np.vstack([path.states, state]), low)
        more = self._build_path_of_top(i, state, None).only(path.want or ())
        return replace_states_by_quantities(
            path,
            {
                name: np.concatenate([column, getattr(more, name)])
                for name, column in path._columns.items()
            },
        )

    def _select_tops(self, key: Any) -> Self:
        return type(self)(*self._select_rows(key))

    def _select_rows(self, key: Any) -> tuple[Ensemble, Array, Options, EnsembleBuffers]:
        indices = list_flat_indices(self.shape, key)
        rows = key if isinstance(key, slice) and self.ndim == 1 else indices.reshape(-1)
        t = self._t if self._t.ndim == 1 else self._t[rows]
        return self.scene[key], t, self._options, self._buffers.select_buffer_rows(rows)

    def _only(self, path: Path, want: tuple[QuantityName, ...]) -> Path:
        columns: dict[str, Array] = {
            name: np.array(getattr(path, name)).reshape(
                self.size, self._t.shape[-1], *RECORDABLE[name].shape
            )
            for name in want
        }
        buffers = replace(
            self._buffers, states=None, low=None, tangents=None, tangents_low=None, columns=columns
        )
        return Path._of_many(
            self.scene, self._t, replace(self._options, want=want, tangents=()), buffers
        )

    def __iter__(self) -> Iterator[Any]:
        """Return an iterator over the results along the first dimension."""
        return (self[i] for i in range(len(self)))

    def __getitem__(self, key: Any) -> Any:
        """Return the result of one or several tops, selected by a NumPy index."""
        raise NotImplementedError

    def _make_column_table(
        self,
        columns: Sequence[TableColumn],
        taken: Iterable[str] = (),
        times: Mapping[str, int] | None = None,
    ) -> ColumnTable:
        """Return a table of the varying parameters, apart from the names `taken`, and `columns`."""
        axes = name_axes(self.scene, taken)
        text = "the time of the last valid state"
        states = [
            TableColumn(
                "status",
                axes,
                self.status,
                "",
                "OK, or the name of the failure",
                is_coordinate=True,
            ),
            TableColumn("reached", axes, self.reached, TIME.dimension, text, is_coordinate=True),
        ]
        controls = {"method": self.method, "step": self.step, "tol": self.tol}
        return ColumnTable(
            {**dict(zip(axes, self.shape, strict=True)), **(times or {})},
            [*list_parameter_columns(self.scene, taken), *states, *columns],
            {k: v for k, v in (controls | {"digits": self.digits}).items() if v is not None},
        )

    def _format_summary(self) -> str:
        values = {"step": self.step, "tol": self.tol, "digits": self.digits}
        controls = "".join(f", {k}={v!r}" for k, v in values.items() if v is not None)
        count = int(np.count_nonzero(self._buffers.status))
        failures = f"{count} failed" if count else "none failed"
        return f"{self.method}{controls}, {failures}"


def replace_states_by_quantities(path: Path, columns: dict[str, Array]) -> Path:
    want = cast(tuple[QuantityName, ...], tuple(name for name in columns if name != "t"))
    options = replace(path._options, want=want)
    return replace(path, states=NO_STATES, _options=options, _low=None, _columns=columns)


def concatenate_slice_events(parts: list[EventColumns]) -> EventColumns:
    """Return the events of several slices as one table, sorted by the index of the top."""
    if not parts:
        empty = np.empty(0, dtype=np.intc)
        return EventColumns(
            np.empty(0, dtype=np.int64), np.empty((0, 8)), np.empty((0, 8)), empty, empty
        )
    columns = [np.concatenate(column) for column in zip(*parts, strict=True)]
    order = np.argsort(columns[0], kind="stable")
    return EventColumns(*(column[order] for column in columns))


def unravel_rows(rows: Any, shape: tuple[int, ...]) -> Any:
    """Return the indices of tops from their positions in C order.

    The array has the shape (k,) for a one-dimensional ensemble, and otherwise (k, dimensions).
    """
    if len(shape) == 1:
        return freeze_array(rows)
    indices: Any = np.array(np.unravel_index(rows, shape) if shape else (), np.int64)
    return freeze_array(indices.T.reshape(len(rows), len(shape)))


def list_failed(status: Any) -> npt.NDArray[np.intp]:
    """Return the indices of the tops whose status is not 'OK', as in Path.failed."""
    indices = np.argwhere(np.asarray(status) != "OK")
    return indices[:, 0] if np.ndim(status) == 1 else indices


def _stack_paths(many: EnsembleResult, t: Numbers, paths: Sequence[Path]) -> Path:
    """Return the paths of all tops of an ensemble, at times common to all, as one path."""
    times = np.array(validate_time_list(t)).reshape(-1)
    options = replace(many._options, tangents=(), events=None)
    buffers = EnsembleBuffers.allocate_buffers(len(paths), times.size, options)
    buffers.status[:], buffers.done[:], buffers.chosen = 0, times.size, many._buffers.chosen
    for i, path in enumerate(paths):
        buffers.counts[i], buffers.reached[i] = path.stats, path.reached
        for name, column in buffers.columns.items():
            column[i] = getattr(path, name)
        if buffers.states is not None:
            buffers.states[i] = path.states
        if buffers.low is not None:
            buffers.low[i] = path._low
    return Path._of_many(many.scene, times, options, buffers)


MOST_DRAWN = 8  # number of tops in one picture


def list_drawn_paths(*paths: Path) -> list[Path]:
    """Return the path of each top. Raises ValueError if there are too many for a picture."""
    count = sum(path.size for path in paths)
    if not 1 <= count <= MOST_DRAWN:
        raise ValueError(
            f"path must be one path or a list of up to {MOST_DRAWN} paths, not of {count}: select "
            f"tops, as in path[:{MOST_DRAWN}]"
        )
    return [one for path in paths for one in (path._list_members() if path.shape else [path])]


def check_is_one(what: str, path: Path) -> None:
    """Raise ValueError unless the path is of one top; `what` begins the message."""
    if validate_type("path", path, Path).shape:
        raise ValueError(f"{what} one top: select it, as in path[0], not of shape {path.shape}")


CoreEvents = tuple[Array, Array, npt.NDArray[np.intc], npt.NDArray[np.intc]]


def add_events_to_path(path: Path, core_events: CoreEvents) -> Path:
    states, low, which, direction = core_events
    event_path = replace(path, states=states, _low=low)
    return replace(path, _events=Events(event_path, which, direction))


def join_path_events(event_parts: list[Events]) -> Events:
    states = np.concatenate([one.states for one in event_parts])
    low = np.concatenate([low for one in event_parts if (low := one.path._low) is not None])
    path = replace(event_parts[-1].path, states=states, _low=low)
    which, direction = (
        [getattr(one, name) for one in event_parts] for name in ("which", "direction")
    )
    return Events(path, np.concatenate(which), np.concatenate(direction))
