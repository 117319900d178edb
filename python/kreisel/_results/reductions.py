"""Reductions over the path of each top in an ensemble, such as the minimum, maximum and mean."""

from __future__ import annotations

from collections.abc import ItemsView, Iterator, KeysView, ValuesView
from typing import TYPE_CHECKING, Any, overload

from .._core import reductions as KINDS
from .._options.quantities import QUANTITIES
from .._utils.errors import unknown_name_message
from .._utils.validation import Array
from .ensemble_result import EnsembleResult
from .indexing import find_flat_index

if TYPE_CHECKING:
    from pandas import DataFrame
    from xarray import Dataset


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
        names: dict[str, list[str]] = {}
        for one in self._options.reductions:
            kinds = names.setdefault(one.name, [])
            if KINDS[one.kind] not in kinds:
                kinds.append(KINDS[one.kind])
        return names

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
        from .ensemble_tables import build_reduction_dataset

        return build_reduction_dataset(self, dict(self.items()))

    def to_pandas(self) -> DataFrame:
        """Return a pandas.DataFrame with one row per top, in C order.

        There is one column per statistic of a component, such as nutation_max or apex_z_mean. The
        columns of the DataFrame also include `status`, `reached` and the varying parameters.
        `attrs` contains the units. Raises ImportError if pandas is not installed.
        """
        from .ensemble_tables import build_reduction_data_frame

        return build_reduction_data_frame(self, dict(self.items()))
