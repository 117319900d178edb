"""Results of an ensemble: the status, the final time and the step counts of each top."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any, Self, TypeVar, cast

import numpy as np
import numpy.typing as npt

from .._core import statuses
from .._model.scene import Ensemble
from .._options.ensemble_options import (
    EnsembleOptions,
    format_index,
    get_member_by_flat_index,
    unravel_index,
)
from .._options.methods import methods
from .._options.solve_options import SolveOptions
from .._utils.errors import make_frozen_class_decorator
from .._utils.quantity_attributes import QuantityName
from .._utils.validation import Array, ReadOnlyArrays, freeze_array, short_repr
from .ensemble_buffers import INTERRUPTED, STATUSES, Codes, Counts, EnsembleBuffers
from .indexing import find_flat_index, list_flat_indices
from .path import (
    Error,
    Interrupted,
    Path,
    build_path_from_core_result,
    format_progress,
    make_stop_exception,
)
from .state_quantities import NO_STATES
from .tangent_data import TangentData

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
    _options: EnsembleOptions
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
        return self._options.solve.requested_method

    @property
    def step(self) -> float | None:
        """The magnitude of the step size [T], or None if the method has none or chooses its own."""
        return self._options.solve.step

    @property
    def tol(self) -> float | None:
        """The tolerance that was used, or None if the method has none or chooses its own."""
        return self._options.solve.tol

    @property
    def digits(self) -> int | None:
        """The requested number of digits, or None if it was not given."""
        return self._options.solve.digits

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

    def _make_member_options(self, i: int) -> SolveOptions:
        """Return options to solve the i-th top alone and record complete states."""
        choice = self._buffers.chosen.get(i)
        if choice is not None:
            return SolveOptions(methods[choice.method], abs(choice.step))
        options = self._options.make_options_for_top(get_member_by_flat_index(self.tops, i))
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
            freeze_array(high), freeze_array(rest), truncation, self._options.solve.tangents
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
