"""Paths of an ensemble, stored as arrays and accessible one by one."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, NoReturn

import numpy as np

from .._options.quantities import LOW, RECORDABLE, validate_quantity_name
from .._utils.counts import format_count
from .._utils.errors import suggest_name
from .._utils.quantity_attributes import QuantityAttributes, QuantityName
from .._utils.validation import Array, freeze_array, short_repr
from .ensemble_buffers import EventColumns, compute_quantity_derivatives, values
from .ensemble_events import (
    EnsembleEvents,
    concatenate_slice_events,
    convert_columns_to_ensemble_events,
)
from .ensemble_result import EnsembleResult
from .indexing import find_flat_index
from .path import Events, Path
from .state_quantities import NO_STATES, STATE_COLUMNS, add_quantity_properties
from .tables import build_quantity_value_pairs
from .tangent_data import TANGENT_ATTRIBUTES

if TYPE_CHECKING:
    from xarray import Dataset


class Paths(EnsembleResult, QuantityAttributes):
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
        return self._options.solve.want

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
        return self._reshape_to_ensemble(values(name, self.tops, self._buffers))

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
        name, bits = validate_quantity_name(quantity), self._options.solve.tangent_bit_mask
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
        if self._options.core_events is None:
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

    def to_xarray(self, *names: str, degrees: bool = False, unwrap: bool = False) -> Dataset:
        """Return an xarray.Dataset with one variable per quantity in `names`.

        If no names are given, the Dataset contains all quantities that the paths store. The
        dimensions are those of the ensemble, followed by time and by the component dimensions
        described in Path.to_xarray. If each top has its own times, the coordinate t depends on the
        ensemble dimensions and on time.

            >>> import kreisel as kr
            >>> tops = kr.scenes.thesis.vary(gravity=[0.5, 1.0])
            >>> kr.solve(tops, [0.0, 1.0]).to_xarray("apex")["apex"].dims
            ('gravity', 'time', 'axis')

        The varying parameters, `status` and `reached` are stored as coordinates of the Dataset. A
        parameter with the name of a quantity in the Dataset is called, for example, spin_given, and
        so is its dimension. In other respects, the Dataset has the same form as that returned by
        Path.to_xarray.
        """
        from .ensemble_tables import build_state_dataset

        return build_state_dataset(self, build_quantity_value_pairs(self, names, degrees, unwrap))


add_quantity_properties(Paths, ("*shape", "k"), Paths._compute_quantity)
