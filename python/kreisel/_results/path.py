"""The path of one or of many tops, its events, and reductions of it."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property, partial
from operator import index
from typing import TYPE_CHECKING, Any, NoReturn, Self, cast, overload

import numpy as np
import numpy.typing as npt

from .._core import reductions as KINDS
from .._core import start, statuses
from .._model.parameters import advance_shaking_phase
from .._model.scene import Scene, Scenes
from .._options import options as choices
from .._options.methods import EXACT, explain_no_closed_form, has_torus_closed_form
from .._options.options import QUANTITIES, RECORDABLE, TIME, Options
from .._options.plan import Plan, StepChoice, make_plan_of_tops, make_solve_plan
from .._utils import arguments
from .._utils.arguments import Array, Numbers, format_count, freeze_array, short_repr
from .._utils.files import atomic_write
from .._utils.html import format_html_table, format_picture_as_html
from .._utils.quantity_attributes import QuantityAttributes, QuantityName
from . import calls, results, tables
from .calls import NO_STATES, ORIGIN, EnsembleBuffers, EventColumns
from .results import Error, Interrupted, PathBase, RunResult, find_flat_index
from .tables import ColumnTable, TableColumn, TableExportMethods

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from pandas import DataFrame
    from xarray import Dataset

    from .._plot.charts import FigureAxes
    from .._plot.film import Film
    from .._proof.enclosure import Verification


MOST_DISPLAYED = 100_000  # number of states of the longest path that notebooks display as a picture
MOST_DRAWN = 8  # number of tops in one picture


def normalize_path_index(n: int, key: Any) -> slice | npt.NDArray[np.intp]:
    """Convert an index of n states to a slice, of length 1 for an integer, or an integer array."""
    if isinstance(key, slice):
        return key
    numbers = np.asarray(key)
    kinds = "iub" if numbers.ndim else "iu"
    if numbers.ndim > 1 or (numbers.size and numbers.dtype.kind not in kinds):
        raise TypeError(
            "the states of a path are indexed by a whole number, a slice or a list of numbers, not "
            f"{short_repr(key)}; its quantities are attributes"
        )
    if numbers.ndim == 0:
        i = int(numbers)
        if not -n <= i < n:
            raise IndexError(f"a path of {n} states has no state of index {i}")
        return slice(i % n, i % n + 1)
    indices: npt.NDArray[np.intp] = np.arange(n)[numbers if numbers.size else []]
    return indices


def split_index(ndim: int, key: Any) -> tuple[Any, Any]:
    """Split an index of an array of shape (*shape, k) into those of the tops and of the states.

    The index of the states is None if the key selects only tops, whose shape has `ndim` dimensions.
    """
    parts = list(key) if isinstance(key, tuple) else [key]
    widths = []  # the number of dimensions that each part selects from
    for part in parts:
        is_mask = part is not None and np.asarray(part).dtype == np.bool_
        widths.append(np.ndim(part) if is_mask else int(part is not None and part is not ...))
    missing = ndim + 1 - sum(widths)
    gaps = [place for place, part in enumerate(parts) if part is ...]
    if not gaps and missing > 0:
        return key, None
    if missing < 0 or len(gaps) > 1 or widths[-1] > 1 or parts[-1] is None:
        raise IndexError(
            f"{short_repr(key)} is not an index of the {ndim} dimensions of the tops and of the "
            "states, as in path[:, -1]"
        )
    for place in gaps:
        parts[place : place + 1] = [slice(None)] * missing
    *tops, states = parts
    if any(isinstance(one, (list, np.ndarray)) for one in tops) and isinstance(
        states, (list, np.ndarray)
    ):
        raise IndexError("select tops before states, as in path[tops][:, states]")
    return tuple(tops), states


@dataclass(frozen=True, eq=False, init=False)
class Path(PathBase, TableExportMethods):
    """The computed motion of one top or of all tops of an ensemble, sampled at n times.

    All arrays are read-only, but copies of them are writeable. The arrays t, q and m are views of
    `states`, and other quantities are computed on first access. Vectors are given by their
    components in the space frame unless stated otherwise. The documented shapes are those of one
    top, whose `shape` is (). For many tops, each array begins with the dimensions of the ensemble,
    and numbers such as `error` are arrays of its shape. If a top failed, its values after the last
    valid state are NaN.

    path[i]     for one top, a path with the selected states. For many tops, the path of one top
                with the same values, or the path of several tops. Calling the path of one top with
                other times solves this top alone, and taylor may then round differently
    path[:, j]  for many tops, the path of the selected tops with the selected states

    scene   the kreisel.Scene, of one top or of many
    states  (n, 8): t [T], q (w, x, y, z), m [M L^2 T^-1]
    """

    scene: Scene
    states: Array  # not set if the path has _columns
    stats: Any
    _options: Options
    _is_back: bool = False
    _low: Array | None = None  # low words of the states
    _columns: dict[str, Array] | None = None  # t and the quantities in want, instead of states
    _events: Events | None = None
    _choice: StepChoice | None = None  # the choice of method='geometric'
    _tangent_data: calls.TangentData | None = None
    _origin: calls.RunStart = ORIGIN
    _failure: tuple[str, str] | None = None  # the status and the message of a failed run
    _is_many: bool = False  # True: `_t` and `_buffers` have the same results of many tops

    def __init__(
        self,
        scene: Any,
        states: Array,
        stats: Any,
        _options: Options,
        _is_back: bool = False,
        **fields: Any,
    ) -> None:
        own = self.__dict__  # avoids the slow object.__setattr__ of frozen dataclasses
        own["scene"], own["stats"], own["_options"] = scene, stats, _options
        if _is_back:
            own["_is_back"] = True
        if fields:
            own.update(fields)
            columns = fields.get("_columns") or {}
            arguments.freeze_arrays([fields.get("_low"), columns])
            own.update({k: x for k, x in columns.items() if k not in calls.STATE_COLUMNS})
            if columns:
                return
        states.flags.writeable = False
        own["states"] = states

    @classmethod
    def _of_many(cls, tops: Scene, t: Array, options: Options, buffers: EnsembleBuffers) -> Self:
        """Return the path of all tops of an ensemble, whose arrays are views of `buffers`."""
        many = RunResult(tops, t, options, buffers)
        shape, columns, data = many._reshape_to_ensemble, None, None
        if options.want is not None:
            columns = {"t": many.t} | {k: shape(rows) for k, rows in buffers.columns.items()}
        states = NO_STATES if buffers.states is None else shape(buffers.states)
        low = None if buffers.low is None else shape(buffers.low)
        if buffers.tangents is not None and buffers.truncation is not None:
            high, rest = buffers.tangents, buffers.tangents_low
            rest = np.broadcast_to(0.0, high.shape) if rest is None else rest
            truncation = shape(buffers.truncation)
            data = calls.TangentData(shape(high), shape(rest), truncation, options.tangents)
        is_back = options.step is not None and t.size > 0 and bool((t[..., -1] < 0.0).all())
        path = cls(
            tops, states, many.stats, options, is_back, _low=low, _columns=columns,
            _tangent_data=data, _is_many=True,
        )  # fmt: skip
        vars(path).update(_t=t, _buffers=buffers)
        return path

    def __getstate__(self) -> dict[str, Any]:
        names = ("scene", "_t", "_options", "_buffers") if self._is_many else vars(self)
        return {name: vars(self)[name] for name in names}

    def __setstate__(self, state: dict[str, Any]) -> None:
        if "_t" in state:
            state = vars(Path._of_many(*state.values()))
        super().__setstate__(state)

    def __repr__(self) -> str:
        if self._is_many:
            states = format_count(self.t.shape[-1], "state")
            return f"<kreisel.Path of shape {self.shape}, {states} each: {self._format_summary()}>"
        span = f", t = {self.t[0]:g} .. {self.t[-1]:g}" if len(self) else ""
        ran = f"{self._format_controls()}, {format_count(self.stats.steps, 'step')}"
        return f"<kreisel.Path: {format_count(len(self), 'state')}{span}; {ran}>"

    @cached_property
    def _buffers(self) -> EnsembleBuffers:  # type: ignore[override]
        """The status of one top."""
        reached = self.t[-1] if len(self) else self.start_time
        code = calls.STATUSES.index(self._failure[0]) if self._failure else 0
        done, counts = np.array([len(self)]), np.array([self.stats])
        return EnsembleBuffers(np.array([code], np.int8), done, counts, np.array([reached]))

    @cached_property
    def error(self) -> float:
        """The estimated error of the attitude [rad], as the maximum over all states.

        The reference is a closed form if one applies exactly and is sufficiently accurate,
        otherwise a Taylor series in 20-digit arithmetic. A 30-digit series is used if `digits` was
        passed to solve, or if the closed form deviates too much from the 20-digit series.

        For 30 digits, the value is three times the largest difference from three runs with shorter
        steps, or from rounding the initial state if that is larger. It is typically four times the
        true error, and smaller than the true error in less than one of 200 runs.

        The value includes the error by rounding the principal axes of an inertia matrix to
        doubles, except where the reference is a closed form. 20 and 30 digits do not round them.

        If a path computed with method='geometric' does not store the attitude, the value is the
        error that was estimated when the step size was chosen. If nothing is known about the
        accuracy of the attitude, the value is pi, the largest possible error.

        Raises AttributeError if `want` was given without 'q' or, for 20 or 30 digits, without
        'q_low', unless the method was 'geometric'.
        """
        if self._is_many:
            return cast(float, self._compute_per_top(lambda path: path.error))
        scene, digits, origin = self.scene, self.digits, self._origin
        if not len(self):
            return 0.0
        if self._choice and self._columns is not None and "q" not in self._columns:
            return self._choice.error

        def angle_to(second: Options) -> float:  # including digits beyond double precision
            result = calls.compute_states_at_unordered_times(scene, second, self.t, origin)
            other = build_path_or_raise(scene, second, result, origin)
            pairs = (self.q, self.q_low), (other.q, other.q_low)
            return float(calls.compute_angles_between_attitudes(*pairs).max())

        def growth() -> float:  # the factor by which the motion amplifies rounding of the start
            result, largest = calls.estimate_rounding_growth(
                scene, self.t, digits or 16, origin=origin
            )
            build_path_or_raise(scene, calls.SERIES, result, origin)
            return largest

        if not digits and self.method != EXACT and calls.has_cheap_exact_form(scene):
            error = angle_to(calls.CLOSED_FORM)
            if error >= calls.ROUNDINGS * calls.ROUNDING * growth():
                return error
        if digits == 30:
            # No other run is more accurate than the path, whose error may therefore exceed its
            # distance from each of them. All have the error by rounding the start in common.
            errors = [*map(angle_to, calls.SHORTER_STEPS), calls.ROUNDING**2 * growth()]
            return min(calls.FACTOR_30 * max(errors), math.pi)
        error = 0.0 if digits else angle_to(calls.LONGER_SERIES)
        # A closed form rounds only once, but the motion can magnify the rounding errors of a
        # series. A large difference may be an error of the series with 20 digits: use 30 digits.
        is_unsure = self.method == EXACT and error > calls.ROUNDINGS * calls.ROUNDING
        return angle_to(calls.LONGEST_SERIES) if digits or is_unsure else error

    def verify(self, digits: int = 45) -> Verification:
        """Prove how far the states of one top are from the exact motion.

        digits  as in kreisel.enclose, which this method compares with the path

        Raises ValueError for many tops and for a path that does not begin at t = 0.
        """
        check_is_one("verify needs", self)
        if self.start_time:
            raise ValueError(f"verify needs a path from t = 0, not from {self.start_time!r}")
        from .._proof.enclosure import enclose

        return enclose(self.scene, self.t, digits=digits).compare(self)

    @cached_property
    def plan(self) -> Plan:
        """The kreisel.Plan of this path, with the choices of the solver and their reasons.

        For many tops, a plan of their shape; that of one top is path[i].plan. Raises ValueError if
        method='geometric' chose no method, because the run failed or has no duration.
        """
        if self._is_many:
            first = self._select_member(0).plan if self.size else None
            return make_plan_of_tops(self.scene, self._options, first, self._t.shape[-1])
        return make_solve_plan(self.scene, self._options, len(self), self._choice, self.t)

    @cached_property
    def events(self) -> Events:
        """The events that occurred during the run; empty if no events were requested."""
        if self._events is not None:
            return self._events
        if self._is_many:
            found = self._event_columns
            find_path = partial(build_event_path, self.scene, self._options, found)
            return Events(find_path, found.which, found.direction, found, self.shape)
        empty, options = np.empty(0, dtype=np.intc), replace(self._options, want=None)
        return Events(Path(self.scene, NO_STATES, self.stats, options), empty, empty.copy())

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

        Raises ValueError for times outside the range of the path, and kreisel.Error and
        kreisel.Interrupted under the same conditions as kreisel.solve.
        """
        if self._is_many:
            return self._evaluate_all_tops(t)
        times, begin = choices.validate_time_list(t), self.start_time
        low, high = float(self.t.min(initial=begin)), float(self.t.max(initial=begin))
        outside = np.flatnonzero((times < low) | (times > high))
        if outside.size:
            label = f"t[{outside[0]}]" if times.ndim else "t"
            raise ValueError(
                f"{label} = {float(times.reshape(-1)[outside[0]])!r} lies outside the path, whose "
                f"times go from {low!r} to {high!r}: solve for a longer time"
            )
        result = calls.compute_states_at_unordered_times(
            self.scene, self._options, times.reshape(-1), self._origin
        )
        path = build_path_or_raise(self.scene, self._options, result, self._origin)
        states = NO_STATES if path._columns else path.states
        return replace(path, states=states, _is_back=self._is_back, _choice=self._choice)

    def _evaluate_all_tops(self, t: Numbers) -> Path:
        times = np.ravel(choices.validate_time_list(t))
        paths = [path(t) for path in self._list_members()]
        options = replace(self._options, tangents=(), events=None)
        buffers = EnsembleBuffers.allocate_buffers(len(paths), times.size, options)
        buffers.status[:], buffers.done[:], buffers.chosen = 0, times.size, self._buffers.chosen
        for i, path in enumerate(paths):
            buffers.counts[i], buffers.reached[i] = path.stats, path.reached
            for name, column in buffers.columns.items():
                column[i] = getattr(path, name)
            if buffers.states is not None:
                buffers.states[i] = path.states
            if buffers.low is not None:
                buffers.low[i] = path._low
        return Path._of_many(self.scene, times, options, buffers)

    def __getitem__(self, which: Any) -> Path:
        """Return a path that contains the selected states, but no events, or the selected tops.

        For one top, the index is a whole number, a slice, a list of numbers or a Boolean mask. For
        many tops, it is that of an array of shape (*shape, k): first the dimensions of the tops,
        then that of the states, which a whole number does not remove. Without an entry for the
        states, it selects tops with all of their states and events. `path[-1]` is the last top,
        `path[:, -1]` the last state of each top, and `path[2, ::10]` every tenth state of one top.

            >>> import kreisel as kr
            >>> path = kr.solve(kr.scenes.thesis, [0.0, 1.0, 2.0, 3.0])
            >>> len(path[-1]), path[::2].t.tolist(), path[path.t > 1.5].t.tolist()
            (1, [0.0, 2.0], [2.0, 3.0])
            >>> many = kr.solve(kr.scenes.thesis.vary(gravity=[0.0, 0.5, 1.0]), [0.0, 1.0, 2.0])
            >>> many[2], many[1:].q.shape, many[:, -1].q.shape
            (<kreisel.Path: 3 states, t = 0 .. 2; exact, 2 steps>, (2, 3, 4), (3, 1, 4))
        """
        if self._is_many:
            tops, states = split_index(self.ndim, which)
            if states is not None:
                rows = normalize_path_index(self._t.shape[-1], states)
                options = replace(self._options, events=() if self._options.events else None)
                buffers = self._buffers.select_states(rows)
                return Path._of_many(self.scene, self._t[..., rows], options, buffers)[tops]
            i = find_flat_index(self.shape, tops)
            return Path._of_many(*self._select_rows(tops)) if i is None else self._select_member(i)
        rows, low, data = normalize_path_index(len(self), which), self._low, self._tangent_data
        if self._columns is not None:
            columns = {name: column[rows] for name, column in self._columns.items()}
            return replace(self, states=NO_STATES, _columns=columns, _events=None)
        if data is not None:
            high, rest = freeze_array(data.high[rows]), freeze_array(data.low[rows])
            data = data._replace(high=high, low=rest)
        low, states = None if low is None else low[rows], self.states[rows]
        return replace(self, states=states, _low=low, _events=None, _tangent_data=data)

    def __array__(self, dtype: object = None, copy: object = None) -> NoReturn:
        """Raise TypeError, because a path cannot be converted to a single array."""
        raise TypeError("a path is not an array: use an array such as path.q or path.states")

    @property
    def start_time(self) -> float:
        """The time [T] of the initial state of `path.scene`.

        The value is 0 unless the path is from a kreisel.Run that has been pushed, reset or changed;
        it is then the time of the last change before the first state of the path.
        """
        return self._origin.begin

    def scene_at(self, i: int) -> Scene:
        """Return a scene whose initial state, at t = 0, is the i-th state of this path.

        The phase of a shaken support is advanced to the time of the selected state. Raises
        IndexError if the path has no state with this index. For many tops, the result has their
        shape.
        """
        if self._is_many:
            scenes = Scene.stack([path.scene_at(i) for path in self._list_members()])
            return scenes.reshape(self.shape)
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
        names = choices.validate_requested_quantities(want) or ()
        words: tuple[str, ...] = "t", *names
        columns = {name: np.ascontiguousarray(getattr(self, name)) for name in words}
        if not self._is_many:
            options: Any = {"_options": replace(self._options, want=names).with_heading(self.scene)}
            options |= {"states": NO_STATES, "_low": None, "_tangent_data": None}
            return replace(self, _columns=columns, **options)
        k, none = self._t.shape[-1], dict.fromkeys(("states", "low", "tangents", "tangents_low"))
        rows: Any = {n: columns[n].reshape(self.size, k, *RECORDABLE[n].shape) for n in names}
        buffers = replace(self._buffers, columns=rows, **cast(Any, none))
        own = replace(self._options, want=names, tangents=())
        return Path._of_many(self.scene, self._t, own, buffers)

    def save(self, file: str | os.PathLike[str]) -> None:
        """Write the path to a file that can be read by kreisel.load.

        The file is replaced atomically. Raises OSError if the file cannot be written, and
        ValueError for the path of no tops. The file is an archive that can also be read by
        numpy.load. Its entries are:

        - t, q, m (and q_low, m_low), or t and the quantities in `want`;
        - scene, in TOML;
        - head, in JSON: method, step, tol, digits, want, stats, the choice of method="geometric";
        - events_t, events_q, events_m, events_which and events_direction, if there are events;
        - tangents and tangents_low, if there are tangents.

        For many tops, head also contains the scenes, and the entries are t, status, done, counts,
        reached, states or column_nutation and so on, and those of events and tangents.
        """
        if self._is_many and not self.size:
            raise ValueError("the path of no tops cannot be saved")
        atomic_write(file, tables.encode_as_archive(self))

    def _tabulate(self, names: Iterable[str], degrees: bool, unwrap: bool) -> ColumnTable:
        if self._is_many:
            taken = [each.name for each in tables.describe_quantities(self, names, degrees)]
            axes = tables.name_axes(self.scene, taken)
            quantities = tables.list_quantity_columns(self, names, degrees, unwrap, axes)
            return self._make_column_table(quantities, taken, {"time": self.t.shape[-1]})
        return ColumnTable(
            {"time": len(self)},
            tables.list_quantity_columns(self, names, degrees, unwrap),
            {**self._list_controls(), "scene": self.scene.to_toml()},
        )

    def plot(
        self, axes: Iterable[Axes] | None = None, *, degrees: bool = True, time_unit: str = "T"
    ) -> FigureAxes:
        """Draw this path in the same way as kreisel.plot, and return the picture.

        Up to 8 tops are drawn side by side. Raises ValueError for more.
        """
        from .._plot.charts import plot_paths

        paths = list_drawn_paths(self)
        drawn = [(path, path.events.path if len(path.events) else None) for path in paths]
        return plot_paths(drawn, axes, degrees, time_unit)

    def _repr_html_(self) -> str | None:
        """Return a picture, or for more than 8 tops a table.

        None if the path is empty, too long, or lacks a quantity of the picture.
        """
        if self.size > MOST_DRAWN:
            counts = (
                ("states", f"{self.t.shape[-1]} each", ""),
                ("method", self._format_summary(), ""),
            )
            rows = [("tops", str(self.shape), ""), *counts, *self.scene._list_parameter_rows()]
            return format_html_table(rows, ("ensemble", "value", "unit"))
        is_stored = self.want is None or {"apex", "nutation", "precession_angle"} <= {*self.want}
        if not is_stored or not self.size:
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
        cuboids, with proportions derived from the moments of inertia. The floor is below the lowest
        position of the body. The first clear tilt is seen from the side. Up to 8 tops move side by
        side, over the time that their paths share.

        file       a name ending in .gif, .mp4 (needs ffmpeg) or .html; the file is written
                   atomically
        speed      the time of the path that passes in one second of the film [T]; default: the
                   whole path in 8 seconds
        fps        frames per second; the duration of a frame of a GIF is rounded to 1/100 second,
                   at least 2/100
        size       the height and width of the picture of a top [pixels]
        time_unit  the unit of time in which the scene is described, for the clock; default: none

            >>> import kreisel as kr
            >>> path = kr.solve(kr.scenes.cusps, 2)
            >>> path.animate(fps=5, size=120)
            <Film: 41 frames, 5 a second, t = 0 .. 2>

        The frames are evenly spaced in time, and their states are computed by calling `path(t)`,
        which may raise exceptions. The trace contains the motion between the frames or, if it has
        hundreds of turns, separate points. Raises ValueError for a path without duration, for more
        than 8 tops or 2**28 pixels in total, and for an unknown suffix. Raises OSError if the file
        cannot be written.
        """
        from .._plot.film import make_film

        return make_film(list_drawn_paths(self), file, speed, fps, size, time_unit)

    def _select_member(self, i: int) -> Path:
        return select_member(self, i) if self._is_many else self

    def _make_top_error(self, i: int) -> BaseException:
        if self._failure is None:
            return make_top_error(self, i)
        status, text = self._failure
        return (Interrupted if status == "ERR_INTERRUPTED" else Error)(text, status, self)


def replace_states_by_quantities(path: Path, columns: dict[str, Array]) -> Path:
    options = replace(path._options, want=cast(Any, tuple(name for name in columns if name != "t")))
    return replace(path, states=NO_STATES, _options=options, _low=None, _columns=columns)


def get_last_time(result: RunResult, i: int) -> float:
    """Return the last requested time of the i-th top."""
    times = result._select_times_of_top(i)
    return float(times[-1]) if times.size else 0.0


def build_path_of_top(result: RunResult, i: int, states: Array, low: Array | None) -> Path:
    """Return the path of the i-th of many tops, which went through these states."""
    counts: Any = tuple(result._buffers.counts[i].tolist())
    scene, choice = choices.get_member_by_flat_index(result.scene, i), result._buffers.chosen.get(i)
    if choice is None:
        options = replace(result._options.for_member(scene), want=None, error=None)
    else:
        options = Options(choice.method, abs(choice.step))
    end = get_last_time(result, i)
    path = build_path_from_core_result(scene, options, ("OK", states, low, counts, end))
    vars(path)["_choice"] = choice
    return path


def select_member(result: RunResult, i: int) -> Path:
    """Return the path of the i-th top, counted in C order.

    If the top failed, the path ends with its last valid state, unless it stores tangents.
    """
    buffers, done = result._buffers, int(result._buffers.done[i])
    states = NO_STATES if buffers.states is None else buffers.states[i, :done]
    low = None if buffers.low is None else buffers.low[i, :done]
    path = build_path_of_top(result, i, states, low)
    if buffers.tangents is not None and buffers.truncation is not None:
        high, low = buffers.tangents[i, :done], buffers.tangents_low
        rest = np.zeros_like(high) if low is None else low[i, :done]
        error, by = float(buffers.truncation[i]), result._options.tangents
        data = calls.TangentData(freeze_array(high), freeze_array(rest), error, by)
        return replace(path, _tangent_data=data)
    if buffers.columns:
        columns = {"t": result._select_times_of_top(i)[:done].copy()}
        columns |= {name: column[i, :done] for name, column in buffers.columns.items()}
        path = replace_states_by_quantities(path, columns)
    if i in buffers.last or buffers.status[i]:  # also for a terminal event
        path = append_last_valid_state(result, i, path)
    if buffers.status[i]:
        make_stop_exception(calls.STATUSES[buffers.status[i]], path, get_last_time(result, i))
    if result._options.events is not None:
        first, end = np.searchsorted(result._event_columns.top, [i, i + 1])
        columns_of_top: list[Any] = [x[first:end].copy() for x in result._event_columns]
        _, states, low, which, direction = columns_of_top
        at_events = build_path_of_top(result, i, states, low)
        vars(path)["_events"] = Events(at_events, which, direction)
    return path


def append_last_valid_state(result: RunResult, i: int, path: Path) -> Path:
    """Return the path of the i-th top; append its last valid state if the path lacks it."""
    last = result._buffers.last.get(i)
    state = path.scene._start_state if last is None else last[:1]
    if len(path) == result._t.shape[-1] or (len(path) and path.t[-1] == state[0, 0]):
        return path
    if path._columns is None:
        low = None
        if path._low is not None:
            low = np.vstack([path._low, np.zeros((1, 8)) if last is None else last[1:]])
        return build_path_of_top(result, i, np.vstack([path.states, state]), low)
    more = build_path_of_top(result, i, state, None).only(path.want or ())
    names = path._columns
    columns = {n: np.concatenate([getattr(one, n) for one in (path, more)]) for n in names}
    return replace_states_by_quantities(path, columns)


def make_top_error(result: RunResult, i: int) -> BaseException:
    """Return the exception that would be raised if the i-th of many tops were computed alone."""
    if i in result._buffers.messages:
        return ValueError(result._buffers.messages[i])
    status = calls.STATUSES[result._buffers.status[i]]
    return make_stop_exception(status, result._select_member(i), get_last_time(result, i))


def list_drawn_paths(*paths: Path) -> list[Path]:
    """Return the path of each top. Raises ValueError if there are too many for a picture."""
    count = sum(path.size for path in paths)
    if not 1 <= count <= MOST_DRAWN:
        raise ValueError(
            f"path must be one path or a list of up to {MOST_DRAWN} paths, not of {count}: select "
            f"tops, as in path[:{MOST_DRAWN}]"
        )
    return [one for path in paths for one in path._list_members()]


def check_is_one(what: str, path: Path) -> None:
    """Raise ValueError unless the path is of one top; `what` begins the message."""
    if arguments.validate_type("path", path, Path).shape:
        raise ValueError(f"{what} one top: select it, as in path[0], not of shape {path.shape}")


class Reductions(RunResult, Mapping[str, dict[str, Array]]):
    """The result of kreisel.reduce, a mapping from quantity names to dictionaries of arrays.

    The keys of these dictionaries are among 'min', 'max', 'mean', 'variance', 'last', 'where_min'
    and 'where_max'. The shape of each array is that of the ensemble, followed by that of the
    quantity. The values of a failed top are NaN. The variance is the mean squared deviation of the
    recorded values from their mean. The minimum and the maximum are first attained at the times
    where_min and where_max [T]. The arrays are read-only.

    scene  the scene or the ensemble

        >>> import kreisel as kr
        >>> tops = kr.scenes.cusps.vary(gravity=[0.5, 1.0])
        >>> falls = kr.reduce(tops, [0.0, 0.5, 1.0], {"nutation": ("min", "max")})
        >>> falls["nutation"]["max"].round(3)
        array([1.023, 1.13 ])
    """

    __eq__, __hash__ = object.__eq__, object.__hash__

    def __repr__(self) -> str:
        items = self._options.reduce.items()
        listing = ", ".join(f"{name}: {' '.join(kinds)}" for name, kinds in items)
        return f"<kreisel.Reductions of shape {self.shape}, {listing}: {self._format_summary()}>"

    @overload
    def __getitem__(self, key: str) -> dict[str, Array]: ...
    @overload
    def __getitem__(self, key: Any) -> Any: ...
    def __getitem__(self, key: Any) -> Any:
        """Return {kind of reduction: array} of the quantity `key`, or reductions of some tops."""
        if not isinstance(key, str):
            if find_flat_index(self.shape, key) is not None:
                raise TypeError(
                    "reductions contain no paths: index their arrays, as in "
                    "reduced['nutation']['max'][3]"
                )
            return super().__getitem__(key)
        if key not in self._options.reduce:
            what, known = "quantity among the reductions:", self._options.reduce
            raise KeyError(arguments.unknown_name_message(what, key, known))
        columns: dict[str, list[Array]] = {}
        reduced = self._buffers.arrays["reduced"].T
        for (*_, kind, name), column in zip(self._options.reductions, reduced, strict=True):
            if name == key:
                columns.setdefault(KINDS[kind], []).append(column)
        shape = self.shape + (QUANTITIES[key].shape if key in QUANTITIES else ())
        stacks = {kind: np.stack(rows, axis=-1) for kind, rows in columns.items()}
        return {kind: freeze_array(rows.reshape(shape)) for kind, rows in stacks.items()}

    def __iter__(self) -> Iterator[str]:
        return iter(self._options.reduce)

    def __len__(self) -> int:
        """Return the number of quantities."""
        return len(self._options.reduce)

    def __contains__(self, name: object) -> bool:
        return name in self._options.reduce

    def to_xarray(self) -> Dataset:
        """Return an xarray.Dataset with one variable per reduction, such as nutation_max.

        Its dimensions are those of the ensemble, and the varying parameters, `status` and `reached`
        its coordinates. Variables have units. Raises ImportError if xarray is not installed.
        """
        return self._make_column_table(self._list_columns()).to_xarray()

    def to_pandas(self) -> DataFrame:
        """Return a pandas.DataFrame with one row per top, in C order.

        The columns are the varying parameters, `status`, `reached` and the statistics of each
        component, such as nutation_max or apex_z_mean. `attrs` contains the units. Raises
        ImportError if pandas is not installed.
        """
        return self._make_column_table(self._list_columns()).to_pandas()

    def _list_columns(self) -> list[TableColumn]:
        """Return a column for each reduction of each quantity."""
        columns = []
        for name, kinds in self.items():
            quantity = QUANTITIES.get(name) or next(
                each for each in QUANTITIES.values() if name in each.components
            )
            for kind, values in kinds.items():
                unit = quantity.dimension
                if kind.startswith("where_"):
                    unit = TIME.dimension
                elif kind == "variance" and unit:
                    unit = f"({unit})^2"
                text = f"{kind} over the times: {quantity.text}"
                parts = [f"{component}_{kind}" for component in quantity.components]
                labels = tables.list_component_labels(quantity) if values.ndim > self.ndim else {}
                rest = unit, text, parts, labels
                columns.append(TableColumn(f"{name}_{kind}", self.scene.axes, values, *rest))
        return columns

    _select_member, _make_top_error = select_member, make_top_error


@dataclass(frozen=True, eq=False)
class Events(arguments.ReadOnlyArrays, QuantityAttributes):
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
        arguments.freeze_arrays((self.which, self.direction, self._columns))

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
    def top(self) -> Any:
        """(k,) the index of the top; (k, ndim) unless the ensemble has one dimension."""
        row = np.zeros(len(self), np.int64) if self._columns is None else self._columns.top
        return results.unravel_rows(row, self.shape)

    @cached_property
    def count(self) -> Any:
        """(*shape) the number of events of each top; an int for one top."""
        if self._columns is None:
            return len(self)
        count: Any = np.bincount(self._columns.top, minlength=math.prod(self.shape))
        return freeze_array(count.reshape(self.shape))

    @property
    def states(self) -> Array:
        """(k, 8): t [T], q (w, x, y, z), m [M L^2 T^-1]."""
        return self.path.states if self._columns is None else self._columns.states

    @property
    def t(self) -> Array:
        """(k,) times [T]."""
        return self.states[:, 0]


if TYPE_CHECKING:  # Type checkers tell the path of an ensemble from that of one top.

    class EnsemblePath(Path):
        scene: Scenes
        error: Array  # type: ignore[assignment]
        energy_error: Array  # type: ignore[assignment]
        tangents_rest: Array  # type: ignore[assignment]
        status: npt.NDArray[np.str_]
        reached: Array
        state_counts: calls.Counts
        stats: Any
        end: Scenes

        def scene_at(self, i: int) -> Scenes: ...
        def __getitem__(self, which: Any) -> Any: ...
        def __call__(self, t: Numbers) -> Self: ...
        def only(self, want: Iterable[QuantityName]) -> Self: ...

else:
    EnsemblePath = Path


def _compute_event_quantity(events: Events, name: str) -> Array:
    if name in calls.STATE_COLUMNS:  # as the states, without their path
        return events.states[:, calls.STATE_COLUMNS[name]]
    values: Array = getattr(events.path, name)
    return values if events._columns is None else values[:, 0]


results.add_quantity_properties(Events, ("k",), _compute_event_quantity)


def build_event_path(tops: Scene, options: Options, columns: EventColumns) -> Path:
    """Return a path of shape (k,) with the top and one state of each of k events."""
    k, t = len(columns.top), columns.states[:, :1].copy()
    options = replace(options, want=None, tangents=(), events=None)
    buffers = EnsembleBuffers.allocate_buffers(k, 1, options, columns.states[:, None])
    buffers.status[:], buffers.done[:], buffers.reached[:] = 0, 1, t[:, 0]
    buffers.low = columns.low[:, None]
    return Path._of_many(tops.ravel()[columns.top], t, options, buffers)


def make_stop_exception(status: str, path: Path, place: str | float) -> BaseException:
    """Return the exception for a run that ended at the time in a text, or on its way to a time."""
    if not isinstance(place, str):
        last, steps = path.t[-1] if len(path) else 0.0, format_count(path.stats.steps, "step")
        place = f"{path.method} reached t = {last:g} of {place:g} in {steps}"
    kind, text = statuses[status]
    scene, method, step, tol = path.scene, path.method, path.step, path.tol
    if tol is not None and status in ("ERR_STEP", "ERR_CONVERGENCE"):
        clause = ", which is below the rounding of doubles" if tol < calls.ROUNDING else ""
        text += f" at tol = {tol!r}{clause}"
    vars(path)["_failure"] = status, f"{text}: {place}"
    if kind in ("FAILURE", "INTERRUPT"):
        return (Error if kind == "FAILURE" else Interrupted)(f"{text}: {place}", status, path)
    if status == "ERR_METHOD" and has_torus_closed_form(scene):
        return ValueError(f"the method {method!r} does not apply: {explain_no_closed_form(scene)}")
    hint = ""
    if status == "ERR_STEP_SIZE" and step:
        smaller_step = step
        while smaller_step and start(scene._block, method, smaller_step, 0.0, 0, 0)[0] == status:
            smaller_step /= 2.0
        hint = f", where {smaller_step!r} would suffice"
    return arguments.make_exception_from_status(
        status, f"{method} with step = {step!r}{hint}, tol = {tol!r} and {scene!r}"
    )


def build_path_from_core_result(
    scene: Scene, options: Options, result: calls.CoreResult, origin: calls.RunStart = ORIGIN
) -> Path:
    _, states, low, counts, end = result
    is_back = end < 0.0 and options.step is not None
    stats, options = calls.Stats(*counts), options.copy_with_default_run_settings
    return Path(scene, states, stats, options, is_back, _low=low, _origin=origin)


def build_path_or_raise(
    scene: Scene, options: Options, result: calls.CoreResult, origin: calls.RunStart = ORIGIN
) -> Path:
    """Return the path of a result with the requested quantities; raise unless it is "OK"."""
    path = drop_unrequested_quantities(
        build_path_from_core_result(scene, options, result, origin), options.want, result[-1]
    )
    if result[0] != "OK":
        raise make_stop_exception(result[0], path, result[-1])
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
        raise make_stop_exception("ERR_INTERRUPTED", path.only(want), end) from None


CoreEvents = tuple[Array, Array, npt.NDArray[np.intc], npt.NDArray[np.intc]]


def add_events_to_path(path: Path, core_events: CoreEvents) -> Path:
    states, low, which, direction = core_events
    event_path = replace(path, states=states, _low=low)
    return replace(path, _events=Events(event_path, which, direction))


def join_events(found: list[Events]) -> Events:
    """Return the events of consecutive pieces of the path of one top."""
    states, which, direction = (
        np.concatenate([getattr(one, name) for one in found])
        for name in ("states", "which", "direction")
    )
    low = np.concatenate([low for one in found if (low := one.path._low) is not None])
    return Events(replace(found[-1].path, states=states, _low=low), which, direction)


def join_paths(pieces: list[Path]) -> Path:
    """Return consecutive pieces of the path of one top, with their events, as one path."""
    last = pieces[-1]
    found = [piece._events for piece in pieces if piece._events is not None]
    events = join_events(found) if found else None
    if last.want is not None:
        names: tuple[str, ...] = "t", *last.want
        columns = {n: np.concatenate([getattr(p, n) for p in pieces]) for n in names}
        return replace(last, states=NO_STATES, _events=events, _columns=columns)
    lows = [piece._low for piece in pieces if piece._low is not None]
    states = np.concatenate([piece.states for piece in pieces])
    low = np.concatenate(lows) if lows else None
    return replace(last, states=states, _events=events, _low=low)
