"""Sections: the states in which tops meet an event."""

from __future__ import annotations

from concurrent.futures import Executor
from functools import cached_property
from typing import TYPE_CHECKING, Any, NoReturn

import numpy as np
from numpy.typing import ArrayLike

from .._core import Worker, horizons
from .._model.scene import Scene
from .._options import options as checks
from .._options.methods import FALLBACK
from .._options.options import QUANTITIES, TIME, Options
from .._results import calls
from .._results.calls import STATUSES, Counts
from .._results.path import Path, build_path_of_top, make_stop_exception
from .._results.results import RunResult, add_quantity_properties, find_flat_index, unravel_rows
from .._utils import arguments
from .._utils.arguments import Array, as_bool, as_finite_array, as_int, short_repr
from .._utils.html import format_picture_as_html
from .._utils.processes import Progress, WorkerPool
from .._utils.quantity_attributes import QuantityAttributes
from ..events import Event, nutation, refuse_kinetic
from .chaos import Chaos, estimate_turn_durations

if TYPE_CHECKING:
    from matplotlib.axes import Axes


_DRAWABLE = (TIME, *QUANTITIES.values())


class Section(RunResult, QuantityAttributes):
    """The states of an ensemble at the occurrences of an event, computed by kreisel.section.

    The arrays of states and quantities have one row for each of the e states, sorted by top and
    then by time. All arrays are read-only; quantities are computed on first access.

    scene       the ensemble
    section[i]  a kreisel.Path with the states of one top; slices, lists and masks give the
                kreisel.Section of several tops
    """

    def __repr__(self) -> str:
        states = arguments.format_count(len(self.states), "state")
        counts = f"{states} of {arguments.format_count(self.size, 'top')}"
        return f"<kreisel.Section of shape {self.shape}, {counts}: {self._format_summary()}>"

    @property
    def n(self) -> int:
        """The number of states requested for each top."""
        return int(self._t.shape[1])

    @property
    def count(self) -> Counts:
        """(*shape) the number of states found for each top."""
        counts: Counts = self.state_counts
        return counts

    @property
    def max_wait(self) -> Array:
        """(*shape) the longest allowed time from the start, or an event, to the next event [T].

        The times are negative if the section is computed backwards in time.
        """
        return self._reshape_to_ensemble(self._t[:, 0].copy())

    def _drop_missing_states(self, rows: Array) -> Array:
        """Return the entries of `rows`, whose shape is (tops, n, ...), for all states found."""
        is_found = np.arange(self.n) < self._buffers.done[:, None]
        is_complete = bool(is_found.all())
        return arguments.freeze_array(
            rows.reshape(-1, *rows.shape[2:]) if is_complete else rows[is_found]
        )

    @cached_property
    def top(self) -> Counts:
        """(e,) the index of the top of each state; (e, ndim) unless the shape has one dimension."""
        top: Counts = unravel_rows(self._list_rows(), self.shape)
        return top

    def _list_rows(self) -> Counts:
        return np.repeat(np.arange(self.size), self._buffers.done)

    @cached_property
    def states(self) -> Array:
        """(e, 8): t [T], q (w, x, y, z), m [M L^2 T^-1]."""
        assert self._buffers.states is not None
        return self._drop_missing_states(self._buffers.states)

    @property
    def t(self) -> Array:
        """(e,) times [T]."""
        return self.states[:, 0]

    def plot(
        self,
        axes: Axes | None = None,
        *,
        x: str = "spin_angle",
        y: str = "apex_z",
        chaos: Chaos | None = None,
        degrees: bool = True,
        time_unit: str = "T",
    ) -> Axes:
        """Plot each state of the section as a point with matplotlib, and return the axes.

        axes       the axes to draw in; default: a new figure
        x, y       the names of the components to draw, as in path.to_pandas, or "t". A section over
                   spin_angle and axial_momentum, which are conjugate, preserves areas
        chaos      the result of kreisel.chaos for the same tops. Colours then tell regular, chaotic
                   and doubtful tops apart; otherwise each top has a colour of its own
        degrees    False: angles and rates in radians instead of degrees
        time_unit  the unit of time in which the scenes are described, for the labels

            >>> import kreisel as kr
            >>> tops = kr.starts(kr.scenes.asymmetric.body, energy=2, vertical=1, gravity=1, n=5)
            >>> axes = kr.section(tops, n=20).plot(chaos=kr.chaos(tops, 1000))
            >>> axes.get_xlabel(), axes.get_ylabel()
            ('spin angle [°]', 'apex z')

        Raises ValueError for an unknown name, or for indicators of another shape. Raises TypeError
        for arguments of a wrong type, and ImportError if matplotlib is not installed.
        """
        if chaos is not None:
            shape = arguments.validate_type("chaos", chaos, Chaos).shape
            if shape != self.shape:
                raise ValueError(f"chaos must be of the same tops, not of shape {shape}")
        unit = arguments.as_unit_name("time_unit", time_unit)
        has_degrees = as_bool("degrees", degrees)
        from .._plot import charts

        quantities = {part: quantity for quantity in _DRAWABLE for part in quantity.components}
        columns, labels = [], []
        for axis, name in {"x": x, "y": y}.items():
            if not isinstance(name, str):
                raise TypeError(f"{axis} must be the name of a component, not {short_repr(name)}")
            if name not in quantities:
                raise ValueError(arguments.unknown_name_message("component", name, quantities))
            quantity = quantities[name]
            values = getattr(self, quantity.name).reshape(len(self.states), -1)
            column, unit_of_column = values[:, quantity.components.index(name)], quantity.dimension
            if has_degrees and arguments.is_angular(unit_of_column):
                column = np.degrees(column)
                unit_of_column = arguments.get_angular_unit(unit_of_column, True)
            columns.append(column)
            labels.append(charts.format_axis_label(name.replace("_", " "), unit_of_column, unit))
        classes = None if chaos is None else charts.classify_tops_by_chaos(chaos)
        return charts.draw_section_points(
            axes, (columns[0], columns[1]), (labels[0], labels[1]), self._list_rows(), classes
        )

    def _repr_html_(self) -> str | None:
        """Return the section as a picture, or None if there is nothing to draw."""
        return format_picture_as_html(self.plot, repr(self)) if len(self.states) else None

    if not TYPE_CHECKING:

        def __getattr__(self, name: str) -> NoReturn:
            """Raise AttributeError, with a suggestion if the name is misspelled."""
            names = [word for word in sorted(dir(type(self))) if word[0] != "_"]
            hint = "" if name.startswith("_") else f"; {arguments.suggest_name(name, names)}"
            raise AttributeError(f"a section has no {short_repr(name)}{hint}")

    def _select_member(self, i: int) -> Path:
        assert self._buffers.states is not None
        states = self._buffers.states[i, : int(self._buffers.done[i])]
        return build_path_of_top(self, i, states, None)

    def _make_top_error(self, i: int) -> BaseException:
        done, reached = int(self._buffers.done[i]), float(self._buffers.reached[i])
        text, name = (
            f"{done} of {self.n} events found by t = {reached:g}",
            STATUSES[self._buffers.status[i]],
        )
        if name == "ERR_EVENT":
            text += f", after waiting for {abs(float(self._t[i, 0])):g}"
        return make_stop_exception(name, self._select_member(i), text)

    def __getitem__(self, key: Any) -> Any:
        """Return the path of one top, or the section of several tops, selected by a NumPy index.

        >>> import kreisel as kr
        >>> tops = kr.starts(kr.scenes.asymmetric.body, energy=2, vertical=1, gravity=1, n=5)
        >>> kr.section(tops, n=20)[2:4]
        <kreisel.Section of shape (2,), 40 states of 2 tops: taylor, none failed>
        """
        i = find_flat_index(self.shape, key)
        return super().__getitem__(key) if i is None else self._select_member(i)

    def __array__(self, dtype: object = None, copy: object = None) -> NoReturn:
        """Raise TypeError, because a section cannot be converted to a single array."""
        raise TypeError("a section is not an array: use an array such as section.q")


add_quantity_properties(
    Section,
    ("e",),
    lambda section, name: section._drop_missing_states(
        calls.compute_quantity_values(name, section.scene, section._buffers)
    ),
)


def _find_sections_of_slice(part: calls.Slice) -> None:
    """Compute the sections of a slice, whose times are the longest waiting time of each top."""
    rows, options, tops, begin, end, t, work = part
    assert rows.states is not None
    Worker(*options.core_arguments, (), work).section(
        tops._core_scenes, begin, end, options.core_events, t.shape[1], np.array(t[:, 0]),
        rows.status, rows.done, rows.counts, rows.reached, rows.states,
    )  # fmt: skip


_TURNS = 1024.0  # the default of max_wait, in estimated turns of a top


def section(
    scene: Scene,
    event: Event | None = None,
    n: int = 500,
    *,
    max_wait: ArrayLike | None = None,
    tol: float | None = None,
    digits: int | None = None,
    max_steps: int = 0,
    progress: Progress | None = None,
    threads: int | None = None,
    executor: Executor | None = None,
) -> Section:
    """Find the states of each top at the first `n` occurrences of an event.

    event      an event of kreisel.events; default: nutation(direction=1), the lowest points of the
               apex, which occur in every motion that is not steady. No occurrence is missed. An
               occurrence at the start itself does not count
    n          the number of states of each top
    max_wait   the longest allowed time from the start, or from the previous event, to the next
               event [T]: a number, or an array of the ensemble's shape; negative: back in time. If
               no event occurs in this time, the status of the top is 'ERR_EVENT', and the states
               found so far are kept. Default: 1024 times an estimate of the time of one turn, but
               at most a quarter of the time up to which doubles resolve the attitude

    The other arguments are the same as for kreisel.solve. The results for each top do not depend on
    the other tops, not even in the last bit. The search is fastest if the event is linear in
    body_vertical, body_velocity, body_momentum, apex_z and spin.

        >>> import kreisel as kr
        >>> tops = kr.starts(kr.scenes.asymmetric.body, energy=2, vertical=1, gravity=1, n=5)
        >>> section = kr.section(tops, n=20)
        >>> section
        <kreisel.Section of shape (5,), 100 states of 5 tops: taylor, none failed>
        >>> section.spin_angle.shape, section.top[:3].tolist(), section.count.tolist()
        ((100,), [0, 0, 0], [20, 20, 20, 20, 20])

    Raises TypeError or ValueError for invalid arguments, before any computation starts. Raises
    MemoryError if the states do not fit in memory, and kreisel.Interrupted after Ctrl-C. The status
    of each top is section.status; section.check raises an exception for the first failed top.

    Sources: Poincaré (1892). Dullin and Wittek (Journal of Physics A 28, 1995) construct sections
    that are crossed by every motion.
    """
    arguments.validate_type("scene", scene, Scene)
    waits, options = validate_section_arguments(
        scene, event, n, max_wait, tol=tol, digits=digits, max_steps=max_steps
    )
    pool = WorkerPool(checks.validate_thread_count(threads, executor), executor)
    callback = checks.validate_progress_callback(progress)
    checks.check_result_memory(scene, waits, options)
    runner = calls.SliceRunner(_find_sections_of_slice, is_native=True)
    return calls.run_ensemble(Section, scene, waits, options, pool, runner, callback)


def validate_section_arguments(
    tops: Scene, event: object, n: object, max_wait: object, **controls: object
) -> tuple[Array, Options]:
    """Return the longest allowed waiting times (tops, n), equal in each row, and the options."""
    one = validate_section_event(event)
    options = checks.make_options(FALLBACK, events=[one], **controls)
    refuse_kinetic(tops, [one])
    if max_wait is None:
        longest = np.empty(tops.size)
        horizons(tops._core_scenes, longest)
        waits = np.minimum(_TURNS * estimate_turn_durations(tops), 0.25 * longest)
    else:
        waits = as_finite_array("max_wait", max_wait, "a number, or one for each top")
        if (waits == 0.0).any():
            raise ValueError("max_wait must not be zero")
        try:
            waits = np.array(np.broadcast_to(waits, tops.shape)).reshape(-1)
        except ValueError:
            raise ValueError(
                f"max_wait must be a number or an array of shape {tops.shape}, "
                f"not {short_repr(max_wait)}"
            ) from None
    return np.broadcast_to(waits[:, None], (tops.size, as_int("n", n, 1))), options


def validate_section_event(event: object) -> Event:
    """Return the event. Raises ValueError if it is terminal or limits its occurrences."""
    if event is None:
        return nutation(direction=1)
    [one] = checks.make_options(FALLBACK, events=[event]).events or ()
    if one.max_count is not None or one.terminal:
        raise ValueError(
            "n sets the number of events: leave max_count and terminal out of the event"
        )
    return one
