"""Runs of ensembles, and the reductions of their paths."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING, Any, TypeVar, cast, overload

import numpy as np

from .._core import Work
from .._core import reductions as KINDS
from .._model.scene import Ensemble
from .._options.options import QUANTITIES, TIME, Options
from .._utils.arguments import Array, freeze_array, unknown_name_message
from .._utils.processes import Job, Progress, WorkerPool
from .buffers import INTERRUPTED, EnsembleBuffers, Slice, SliceRunner
from .path import Path, make_top_error, select_member
from .results import RunResult, find_flat_index
from .tables import TableColumn, list_component_labels

if TYPE_CHECKING:
    from pandas import DataFrame
    from xarray import Dataset


_Result = TypeVar("_Result", bound=RunResult)


def run_ensemble(
    kind: Callable[[Ensemble, Array, Options, EnsembleBuffers], _Result],
    tops: Ensemble,
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
    work, is_remote = Work(), pool.has_workers_in_other_processes
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
        result = kind(tops, t, options, buffers)
        raise result._make_stop_error(int(indices[0]), indices.size) from None
    if progress is not None:
        progress(1.0)
    return kind(tops, t, options, buffers)


def run_slice(runner: SliceRunner, part: Slice) -> EnsembleBuffers:
    """Compute the results of a slice, and return its rows."""
    runner.run(part)
    return part.rows


def run_slice_in_worker(
    runner: SliceRunner, options: Options, tops: Ensemble, t: Array
) -> EnsembleBuffers:
    """Compute the results of some tops in a worker process, and return them."""
    rows = EnsembleBuffers.allocate_buffers(len(tops), t.shape[-1], options)
    return run_slice(runner, Slice(rows, options, tops, 0, len(tops), t))


class Reductions(RunResult, Mapping[str, dict[str, Array]]):
    """The result of kreisel.reduce, a mapping from quantity names to dictionaries of arrays.

    The possible keys of these dictionaries are 'min', 'max', 'mean', 'variance', 'last',
    'where_min' and 'where_max'. The arrays are read-only. The shape of each array is the shape of
    the ensemble, followed by that of the quantity. If the computation of a top failed, its values
    are NaN. The variance is the mean squared deviation of the recorded values from their mean. The
    minimum and the maximum are first attained at the times where_min and where_max [T].

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
        """Return the reductions of the quantity named `key`, or of the tops that `key` selects.

        The reductions of a quantity are a mapping from the kind of reduction, such as 'min', to an
        array.
        """
        if not isinstance(key, str):
            if find_flat_index(self.shape, key) is not None:
                raise TypeError(
                    "reductions contain no paths: index their arrays, as in "
                    "reduced['nutation']['max'][3]"
                )
            return super().__getitem__(key)
        if key not in self._options.reduce:
            text = unknown_name_message("quantity among the reductions:", key, self._options.reduce)
            raise KeyError(text)
        assert self._buffers.reduced is not None
        columns: dict[str, list[Array]] = {}
        for one, column in zip(self._options.reductions, self._buffers.reduced.T, strict=True):
            if one.name == key:
                columns.setdefault(KINDS[one.kind], []).append(column)
        shape = self.shape + (QUANTITIES[key].shape if key in QUANTITIES else ())
        return {
            kind: freeze_array(np.stack(rows, axis=-1).reshape(shape))
            for kind, rows in columns.items()
        }

    def __iter__(self) -> Iterator[str]:
        return iter(self._options.reduce)

    def __len__(self) -> int:
        """Return the number of quantities for which reductions were computed."""
        return len(self._options.reduce)

    def __contains__(self, name: object) -> bool:
        return name in self._options.reduce

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
        columns, tops = [], cast(Any, self.scene)
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
                column = TableColumn(f"{name}_{kind}", tops.axes, values, unit, text, parts, labels)
                columns.append(column)
        return columns

    def _select_member(self, i: int) -> Path:
        return select_member(self, i)

    def _make_top_error(self, i: int) -> BaseException:
        return make_top_error(self, i)
