"""The paths of an ensemble."""

from __future__ import annotations

from collections.abc import ItemsView, Iterable, Iterator, KeysView, Mapping, Sequence, ValuesView
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, NoReturn, Self, TypeVar, cast, overload

import numpy as np
import numpy.typing as npt

from .._core import Work, statuses
from .._core import reductions as KINDS
from .._model.scene import Ensemble
from .._options.options import (
    Options,
    format_index,
    get_member_by_flat_index,
    unravel_index,
)
from .._options.quantities import (
    LOW,
    QUANTITIES,
    RECORDABLE,
    TIME,
    validate_quantity_name,
)
from .._utils.arguments import (
    Array,
    ReadOnlyArrays,
    format_count,
    freeze_array,
    make_frozen_class_decorator,
    short_repr,
    suggest_name,
    unknown_name_message,
)
from .._utils.processes import Job, Progress, WorkerPool
from .._utils.quantity_attributes import QuantityName
from .buffers import (
    INTERRUPTED,
    STATUSES,
    Codes,
    Counts,
    EnsembleBuffers,
    EventColumns,
    SliceRunner,
    compute_quantity_derivatives,
    compute_quantity_values,
)
from .path import (
    Error,
    Events,
    Interrupted,
    Path,
    build_path_from_core_result,
    format_progress,
    make_stop_exception,
)
from .quantities import (
    NO_STATES,
    STATE_COLUMNS,
    TANGENT_ATTRIBUTES,
    TangentData,
    add_quantity_properties,
    find_flat_index,
    list_flat_indices,
)
from .tables import (
    ColumnTable,
    TableColumn,
    TableExportMethods,
    describe_quantities,
    list_component_labels,
    list_parameter_columns,
    list_quantity_columns,
    name_axes,
)

if TYPE_CHECKING:
    from pandas import DataFrame
    from xarray import Dataset


_T = TypeVar("_T", bound=np.generic)


@make_frozen_class_decorator("call solve again for a different result")
@dataclass(frozen=True, eq=False, repr=False)
class EnsembleResult(ReadOnlyArrays):
    """The results of all tops of an ensemble.

    Arrays are read-only. The shape of each array starts with the shape of the ensemble.

    tops  the ensemble
    """

    tops: Ensemble
    _t: Array  # (k,), or (n, k) if each top has its own times
    _options: Options
    _buffers: EnsembleBuffers

    @property
    def shape(self) -> tuple[int, ...]:
        """The shape of the ensemble."""
        return self.tops.shape

    @property
    def ndim(self) -> int:
        """The number of dimensions of the ensemble."""
        return len(self.tops.shape)

    @property
    def size(self) -> int:
        """The number of tops."""
        return self.tops.size

    def __len__(self) -> int:
        return len(self.tops)

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
    def status(self) -> Codes:
        """(*shape) 0 for a top without failure, otherwise the code of its failure.

        The attribute `status_names` contains the names of the status codes, and `message` describes
        a failure.
        """
        return self._reshape_to_ensemble(self._buffers.status)

    @property
    def status_names(self) -> npt.NDArray[np.str_]:
        """(*shape) the name of each top's status: 'OK', 'ERR_LIMIT', ...

        The names are those of the status constants in kreisel.h without the prefix KR_.
        """
        return self._reshape_to_ensemble(np.array(STATUSES)[self._buffers.status])

    @property
    def failed(self) -> npt.NDArray[np.intp]:
        """(f,) the indices of the tops that did not reach their last time.

        For f failed tops, the shape is (f,) for one-dimensional ensembles and (f, ndim) otherwise.
        """
        indices = np.argwhere(self.status)
        return indices[:, 0] if self.ndim == 1 else indices

    @property
    def reached(self) -> Array:
        """(*shape) the time of the last valid state of each top [T]."""
        return self._reshape_to_ensemble(self._buffers.reached)

    @property
    def state_counts(self) -> Counts:
        """(*shape) the number of requested times that each top reached."""
        return self._reshape_to_ensemble(self._buffers.done)

    @property
    def steps(self) -> Counts:
        """(*shape) the number of steps of the method."""
        return self._reshape_to_ensemble(self._buffers.counts[:, 0])

    @property
    def rejected(self) -> Counts:
        """(*shape) the number of rejected steps."""
        return self._reshape_to_ensemble(self._buffers.counts[:, 1])

    @property
    def evaluations(self) -> Counts:
        """(*shape) the number of evaluations of the right-hand side or of the torque."""
        return self._reshape_to_ensemble(self._buffers.counts[:, 2])

    @property
    def iterations(self) -> Counts:
        """(*shape) the number of iterations of an implicit solver."""
        return self._reshape_to_ensemble(self._buffers.counts[:, 3])

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
        `paths` is this result.
        """
        indices = np.flatnonzero(self._buffers.status)
        if indices.size:
            raise self._make_stop_error(int(indices[0]), indices.size)
        return self

    def _make_top_error(self, i: int) -> BaseException:
        """Return the exception that would be raised if the i-th top were solved alone."""
        if i in self._buffers.messages:
            return ValueError(self._buffers.messages[i])
        path = self._select_member(i)
        times = self._select_times_of_top(i)
        end = float(times[-1]) if times.size else 0.0
        return make_stop_exception(
            STATUSES[self._buffers.status[i]], path, format_progress(path, end)
        )

    def _make_stop_error(self, i: int, count: int) -> Error | Interrupted:
        """Return the exception for `count` unfinished tops, the first of which has index `i`."""
        is_interrupted = bool(self._buffers.status[i] == INTERRUPTED)
        first = f", the first of {count} of {self.size}" if count > 1 else ""
        text = f"top{format_index(unravel_index(i, self.shape))}{first}: {self._make_top_error(i)}"
        kind = Interrupted if is_interrupted else Error
        return kind(text, STATUSES[self._buffers.status[i]], self._select_member(i), self)

    def _select_times_of_top(self, i: int) -> Array:
        return self._t if self._t.ndim == 1 else self._t[i]

    def _make_member_options(self, i: int) -> Options:
        """Return options to solve the i-th top alone and record complete states."""
        choice = self._buffers.chosen.get(i)
        if choice is not None:
            return Options(choice.method, abs(choice.step))
        options = self._options.for_member(get_member_by_flat_index(self.tops, i))
        return replace(options, want=None, error=None)

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
            return replace(path, _tangent_data=self._build_tangent_data_of_top(i))
        if buffers.columns:
            columns = {name: column[i, :done] for name, column in buffers.columns.items()}
            path = replace_states_by_quantities(
                path, {"t": self._select_times_of_top(i)[:done].copy()} | columns
            )
        return (
            self._append_last_valid_state(i, path)
            if i in buffers.last or buffers.status[i]
            else path
        )

    def _build_tangent_data_of_top(self, i: int) -> TangentData:
        """Return the tangents of the i-th top."""
        buffers, done = self._buffers, int(self._buffers.done[i])
        assert buffers.tangents is not None and buffers.truncation is not None
        high, low = buffers.tangents[i, :done], buffers.tangents_low
        rest = np.zeros_like(high) if low is None else low[i, :done]
        truncation = float(buffers.truncation[i])
        return TangentData(
            freeze_array(high), freeze_array(rest), truncation, self._options.tangents
        )

    def _build_path_of_top(self, i: int, states: Array, low: Array | None) -> Path:
        times = self._select_times_of_top(i)
        end = float(times[-1]) if times.size else 0.0
        steps, rejected, evaluations, iterations = self._buffers.counts[i].tolist()
        counts = steps, rejected, evaluations, iterations
        result = "OK", states, low, counts, end
        path = build_path_from_core_result(
            get_member_by_flat_index(self.tops, i), self._make_member_options(i), result
        )
        choice = self._buffers.chosen.get(i)
        return path if choice is None else replace(path, _choice=choice)

    def _append_last_valid_state(self, i: int, path: Path) -> Path:
        """Return the path of the i-th top; append its last valid state if the path lacks it."""
        last = self._buffers.last.get(i)
        state = get_member_by_flat_index(self.tops, i)._start_state if last is None else last[:1]
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
        """Return the result for the tops selected by `key`."""
        indices = list_flat_indices(self.shape, key)
        rows = key if isinstance(key, slice) and self.ndim == 1 else indices.reshape(-1)
        t = self._t if self._t.ndim == 1 else self._t[rows]
        return type(self)(self.tops[key], t, self._options, self._buffers.select_buffer_rows(rows))

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
        """Return a table of `columns`, the varying parameters, `status` and `reached`.

        A parameter with one of the names `taken` is called, for example, spin_given.
        """
        axes = name_axes(self.tops, taken)
        text = "the time of the last valid state"
        states = [
            TableColumn(
                "status", axes, self.status, "", "0 if the run succeeded", is_coordinate=True
            ),
            TableColumn("reached", axes, self.reached, TIME.dimension, text, is_coordinate=True),
        ]
        controls = {"method": self.method, "step": self.step, "tol": self.tol}
        return ColumnTable(
            {**dict(zip(axes, self.shape, strict=True)), **(times or {})},
            [*list_parameter_columns(self.tops, taken), *states, *columns],
            {k: v for k, v in (controls | {"digits": self.digits}).items() if v is not None},
        )

    def _format_summary(self) -> str:
        """Return a summary of the method, its parameters and the number of failures."""
        values = {"step": self.step, "tol": self.tol, "digits": self.digits}
        controls = "".join(f", {k}={v!r}" for k, v in values.items() if v is not None)
        count = int(np.count_nonzero(self._buffers.status))
        failures = f"{count} failed" if count else "none failed"
        return f"{self.method}{controls}, {failures}"


def replace_states_by_quantities(path: Path, columns: dict[str, Array]) -> Path:
    """Return a copy of the path that stores the quantities `columns` instead of states."""
    want = cast(tuple[QuantityName, ...], tuple(name for name in columns if name != "t"))
    options = replace(path._options, want=want)
    return replace(path, states=NO_STATES, _options=options, _low=None, _columns=columns)


@dataclass(frozen=True, eq=False)
class EnsembleEvents(ReadOnlyArrays):
    """e events of an ensemble, sorted by top, and for each top in the order of occurrence.

    Arrays are read-only.

    top        (e,) the index of the top; (e, dimensions) unless the ensemble has one dimension
    states     (e, 8): t [T], q (w, x, y, z), m [M L^2 T^-1]
    which      (e,) for each occurrence, the index of its event in the list passed to solve
    direction  (e,) 1: the event function increased with time, or had a minimum; -1: it decreased,
               or had a maximum
    count      (*shape) the number of events of each top
    """

    top: Counts
    states: Array
    which: npt.NDArray[np.intc]
    direction: npt.NDArray[np.intc]
    count: Counts

    def __len__(self) -> int:
        return len(self.which)

    @property
    def t(self) -> Array:
        """(e,) times [T]."""
        return self.states[:, 0]

    @property
    def q(self) -> Array:
        """(e, 4) attitudes as unit quaternions (w, x, y, z)."""
        return self.states[:, 1:5]

    @property
    def m(self) -> Array:
        """(e, 3) angular momentum about the fixed point [M L^2 T^-1]."""
        return self.states[:, 5:]


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


def convert_columns_to_ensemble_events(
    events: EventColumns, shape: tuple[int, ...]
) -> EnsembleEvents:
    """Build an EnsembleEvents object from the recorded events of an ensemble of the given shape."""
    n = int(np.prod(shape, dtype=np.int64))
    count = np.bincount(events.top, minlength=n).astype(np.int64).reshape(shape)
    top = events.top
    if len(shape) != 1:
        top = np.array(np.unravel_index(events.top, shape)).T.reshape(len(events.top), len(shape))
    for array in (top, events.states, events.which, events.direction, count):
        array.flags.writeable = False
    return EnsembleEvents(top, events.states, events.which, events.direction, count)


_Result = TypeVar("_Result", bound=EnsembleResult)


def run_ensemble(
    kind: type[_Result],
    tops: Ensemble,
    t: Array,
    options: Options,
    pool: WorkerPool,
    runner: SliceRunner,
    progress: Progress | None = None,
    out: Array | None = None,
) -> _Result:
    """Compute the motions of all tops in an ensemble at times that have been validated.

    Raises kreisel.Interrupted, with all results obtained so far, after Ctrl-C.
    """
    n = tops.size
    buffers, work = EnsembleBuffers.allocate_buffers(n, t.shape[-1], options, out), Work()
    flat = tops.ravel() if pool.has_workers_in_other_processes else tops

    def make_local_job(begin: int, end: int) -> Job[EnsembleBuffers]:
        return runner.run, (buffers, options, tops, begin, end, t, work)

    def make_remote_job(begin: int, end: int) -> Job[EnsembleBuffers]:
        times = t[begin:end] if t.ndim == 2 else t
        return run_slice_in_worker, (runner, options, flat[begin:end], times)

    job, collect = (
        (make_remote_job, buffers.insert_part_at_row)
        if pool.has_workers_in_other_processes
        else (make_local_job, buffers.add_events_and_failures)
    )
    try:
        pool.run_slices(n, job, collect, work, progress, runner.is_native)
    except KeyboardInterrupt:
        buffers.mark_unrun_tops_interrupted(t)
        indices = np.flatnonzero(buffers.status == INTERRUPTED)
        if not indices.size:
            raise
        result = kind(tops, t, options, buffers)
        raise result._make_stop_error(int(indices[0]), indices.size) from None
    if progress is not None:
        progress(1.0)
    return kind(tops, t, options, buffers)


def run_slice_in_worker(
    runner: SliceRunner, options: Options, tops: Ensemble, t: Array
) -> EnsembleBuffers:
    """Compute the motions of a slice of an ensemble in a worker process, and return the results."""
    buffers = EnsembleBuffers.allocate_buffers(len(tops), t.shape[-1], options)
    part: EnsembleBuffers = runner.run(buffers, options, tops, 0, len(tops), t, None)
    return part


class Reductions(EnsembleResult):
    """The result of kreisel.reduce, which maps each quantity name to a dictionary of arrays.

    The possible keys of these dictionaries are 'min', 'max', 'mean', 'variance', 'last',
    'where_min' and 'where_max'. The arrays are read-only. The shape of each array is the shape of
    the ensemble, followed by that of the quantity. If the computation of a top failed, its values
    are NaN. The variance is the mean squared deviation of the recorded values from their mean. The
    minimum and the maximum are first attained at the times where_min and where_max [T].

    tops  the ensemble

        >>> import kreisel as kr
        >>> tops = kr.scenes.cusps.vary(gravity=[0.5, 1.0])
        >>> falls = kr.reduce(tops, [0.0, 0.5, 1.0], {"nutation": ("min", "max")})
        >>> falls["nutation"]["max"].round(3)
        array([1.023, 1.13 ])
    """

    def __repr__(self) -> str:
        listing = ", ".join(
            f"{name}: {' '.join(kinds)}"
            for name, kinds in self._group_reductions_by_quantity().items()
        )
        return f"<kreisel.Reductions of shape {self.shape}, {listing}: {self._format_summary()}>"

    def _group_reductions_by_quantity(self) -> dict[str, list[str]]:
        """Return a mapping from the name of each quantity to the statistics computed for it."""
        return self._options.reduce

    def _select_reduced_values(self, name: str, kind: str) -> Array:
        assert self._buffers.reduced is not None
        reductions = self._options.reductions
        indices = [
            i for i, one in enumerate(reductions) if one.name == name and KINDS[one.kind] == kind
        ]
        columns = self._buffers.reduced[:, indices[0] : indices[-1] + 1]
        shape = QUANTITIES[name].shape if name in QUANTITIES else ()
        return self._reshape_to_ensemble(columns.reshape(len(columns), *shape))

    @overload
    def __getitem__(self, key: str) -> dict[str, Array]: ...
    @overload
    def __getitem__(self, key: Any) -> Any: ...
    def __getitem__(self, key: Any) -> Any:
        """Return the reductions of the quantity named `key`, or of the tops that `key` selects.

        The reductions of a quantity are a mapping from the kind of reduction, such as 'min', to an
        array.
        """
        if isinstance(key, str):
            names = self._group_reductions_by_quantity()
            if key not in names:
                raise KeyError(unknown_name_message("quantity among the reductions:", key, names))
            return {kind: self._select_reduced_values(key, kind) for kind in names[key]}
        if find_flat_index(self.shape, key) is not None:
            raise TypeError(
                "reductions contain no paths: index their arrays, as in "
                "reduced['nutation']['max'][3]"
            )
        return self._select_tops(key)

    def __iter__(self) -> Iterator[str]:
        return iter(self._group_reductions_by_quantity())

    def __len__(self) -> int:
        """Return the number of quantities for which reductions were computed."""
        return len(self._group_reductions_by_quantity())

    def __contains__(self, name: object) -> bool:
        return name in self._group_reductions_by_quantity()

    def keys(self) -> KeysView[str]:
        """Return the quantity names."""
        return self._group_reductions_by_quantity().keys()

    def items(self) -> ItemsView[str, dict[str, Array]]:
        """Return pairs of a quantity name and a dictionary {kind of reduction: array}."""
        return {name: self[name] for name in self}.items()

    def values(self) -> ValuesView[dict[str, Array]]:
        """Return, for each quantity, a dictionary {kind of reduction: array}."""
        return {name: self[name] for name in self}.values()

    def to_xarray(self) -> Dataset:
        """Return an xarray.Dataset with one variable per reduction, such as nutation_max.

        Variables have units. The dimensions of the Dataset are those of the ensemble. The varying
        parameters, `status` and `reached` are stored as coordinates of the Dataset. Raises
        ImportError if xarray is not installed.
        """
        return self._make_column_table(self._list_columns()).to_xarray()

    def to_pandas(self) -> DataFrame:
        """Return a pandas.DataFrame with one row per top, in C order.

        There is one column per statistic of a component, such as nutation_max or apex_z_mean. The
        columns of the DataFrame also include `status`, `reached` and the varying parameters.
        `attrs` contains the units. Raises ImportError if pandas is not installed.
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
                labels = list_component_labels(quantity) if values.ndim > self.ndim else {}
                columns.append(
                    TableColumn(f"{name}_{kind}", self.tops.axes, values, unit, text, parts, labels)
                )
        return columns


class Paths(EnsembleResult, TableExportMethods):
    """The motions of all tops in an ensemble, each at k times.

    All arrays are read-only. The arrays q and m are views of `states`, and other quantities are
    computed on first access. The shape of an array is (*shape, k) followed by the shape of the
    quantity. If a top failed, its values after the last valid state are NaN.

    tops    the ensemble
    paths[i], paths[i, j]   a kreisel.Path of one top with the same values. Calling this path with
            other times solves the top alone, and taylor may then round differently. Slices, lists
            and masks give the kreisel.Paths of several tops, as in NumPy
    """

    _one = Path  # the class that describes one top

    def __repr__(self) -> str:
        states = format_count(self._t.shape[-1], "state")
        return f"<kreisel.Paths of shape {self.shape}, {states} each: {self._format_summary()}>"

    @property
    def want(self) -> tuple[QuantityName, ...] | None:
        """The stored quantities other than t, or None if the paths store complete states."""
        return self._options.want

    @property
    def _low(self) -> Array | None:
        return self._buffers.low

    @property
    def states(self) -> Array:
        """(*shape, k, 8): t [T], q (w, x, y, z), m [M L^2 T^-1]."""
        if self._buffers.states is None:
            raise self._make_missing_quantity_error("states")
        return self._reshape_to_ensemble(self._buffers.states)

    def _compute_quantity(self, name: str) -> Array:
        """Return the values of a quantity for all tops."""
        columns = self._buffers.columns
        if name in columns:
            return self._reshape_to_ensemble(columns[name])
        if self.want is not None:
            raise self._make_missing_quantity_error(name)
        if name in STATE_COLUMNS:
            return self.states[..., STATE_COLUMNS[name]]
        if name in LOW:
            part, low = STATE_COLUMNS[name.removesuffix("_low")], self._buffers.low
            if low is None:
                return freeze_array(0.0 * self.states[..., part])
            return self._reshape_to_ensemble(low)[..., part]
        return self._reshape_to_ensemble(compute_quantity_values(name, self.tops, self._buffers))

    def _make_missing_quantity_error(self, name: str) -> AttributeError:
        more = f"add {name!r} to want" if name in RECORDABLE else "solve without want"
        return AttributeError(
            f"this result has no {name!r}: it has only the quantities of want={self.want!r}; {more}"
        )

    @property
    def q(self) -> Array:
        """(*shape, k, 4) unit quaternions (w, x, y, z), from the frame of description to space."""
        return self._compute_quantity("q")

    @property
    def m(self) -> Array:
        """(*shape, k, 3) angular momentum about the fixed point [M L^2 T^-1]."""
        return self._compute_quantity("m")

    @cached_property
    def q_low(self) -> Array:
        """(*shape, k, 4) low words of q; zero if at most 16 digits were requested."""
        return self._compute_quantity("q_low")

    @cached_property
    def m_low(self) -> Array:
        """(*shape, k, 3) low words of m [M L^2 T^-1]; zero if at most 16 digits were requested."""
        return self._compute_quantity("m_low")

    @property
    def tangents(self) -> Array:
        """(*shape, k, 6, c) derivatives of the states, as in Path.tangents."""
        return self._reshape_to_ensemble(self._get_tangents_or_raise())

    @property
    def tangents_low(self) -> Array:
        """(*shape, k, 6, c) low words of the tangents; zero up to 16 digits."""
        high, low = self._get_tangents_or_raise(), self._buffers.tangents_low
        return self._reshape_to_ensemble(0.0 * high if low is None else low)

    @property
    def tangents_rest(self) -> Array:
        """(*shape) the truncation error of the tangents of each top, relative to their size."""
        self._get_tangents_or_raise()
        assert self._buffers.truncation is not None
        return self._reshape_to_ensemble(self._buffers.truncation)

    def derivative(self, quantity: QuantityName) -> Array:
        """Return the derivatives of a quantity for all tops, in an array (*shape, k, ..., c).

            >>> import kreisel as kr
            >>> tops = kr.scenes.asymmetric.vary(gravity=[0.5, 1.0])
            >>> paths = kr.solve(tops, [0.0, 1.0], tangents="start")
            >>> paths.derivative("apex").shape
            (2, 2, 3, 6)

        Raises AttributeError if the paths store no tangents, and ValueError for an unknown name.
        """
        self._get_tangents_or_raise()
        name, bits = validate_quantity_name(quantity), self._options.tangent_bit_mask
        return self._reshape_to_ensemble(
            compute_quantity_derivatives(name, self.tops, self._buffers, bits)
        )

    def _get_tangents_or_raise(self) -> Array:
        """Return the tangents of all tops; raise AttributeError if none are stored."""
        if self._buffers.tangents is None:
            hint = TANGENT_ATTRIBUTES["tangents"]
            raise AttributeError(f"these paths have no tangents: {hint}")
        return self._buffers.tangents

    @property
    def q_xyzw(self) -> Array:
        """(*shape, k, 4) unit quaternions (x, y, z, w), with the scalar component last."""
        return self._compute_quantity("q")[..., [1, 2, 3, 0]]

    if not TYPE_CHECKING:

        def __getattr__(self, name: str) -> NoReturn:
            """Raise AttributeError, with a hint if a quantity is missing or its name misspelled."""
            if name.startswith("_"):
                raise AttributeError(name)
            if self.want is not None and hasattr(type(self), name):
                raise self._make_missing_quantity_error(name)
            if name in TANGENT_ATTRIBUTES and self._buffers.tangents is None:
                hint = TANGENT_ATTRIBUTES[name]
                raise AttributeError(f"these paths have no {name!r}: {hint}")
            names = [word for word in sorted(dir(type(self))) if word[0] != "_"]
            raise AttributeError(f"paths have no {short_repr(name)}; {suggest_name(name, names)}")

    @cached_property
    def events(self) -> EnsembleEvents:
        """The events that occurred during the runs; empty if none were requested."""
        return convert_columns_to_ensemble_events(self._event_columns, self.shape)

    @cached_property
    def _event_columns(self) -> EventColumns:
        return concatenate_slice_events(self._buffers.events)

    def _select_member(self, i: int) -> Path:
        path = super()._select_member(i)
        if not self._options.requests_events:
            return path
        columns = self._event_columns
        first, last = np.searchsorted(columns.top, [i, i + 1])
        rows = slice(int(first), int(last))
        event_path = self._build_path_of_top(
            i, columns.states[rows].copy(), columns.low[rows].copy()
        )
        events = Events(event_path, columns.which[rows].copy(), columns.direction[rows].copy())
        states = path.states if self.want is None else NO_STATES
        return replace(path, states=states, _events=events)

    def __getitem__(self, key: Any) -> Any:
        """Return the path of one top, or the paths of several tops, selected by a NumPy index.

        >>> import numpy as np
        >>> import kreisel as kr
        >>> tops = kr.scenes.thesis.vary(gravity=np.linspace(0, 1, 4))
        >>> paths = kr.solve(tops, [0.0, 1.0, 2.0])
        >>> paths[3], paths[1:3].q.shape
        (<kreisel.Path: 3 states, t = 0 .. 2; exact, 2 steps>, (2, 3, 4))
        """
        i = find_flat_index(self.shape, key)
        return self._select_tops(key) if i is None else self._select_member(i)

    def __array__(self, dtype: object = None, copy: object = None) -> NoReturn:
        """Raise TypeError, because the paths cannot be converted to a single array."""
        raise TypeError("paths are not an array: use an array such as paths.q or paths.states")

    def _tabulate(self, names: Iterable[str], degrees: bool, unwrap: bool) -> ColumnTable:
        taken = [each.name for each in describe_quantities(self, names, degrees)]
        axes = name_axes(self.tops, taken)
        quantities = list_quantity_columns(self, names, degrees, unwrap, axes)
        return self._make_column_table(quantities, taken, {"time": self.t.shape[-1]})


add_quantity_properties(Paths, ("*shape", "k"), Paths._compute_quantity)
