"""Quantities as attributes of what was recorded: each is computed when it is first read, and
kept."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import TypeVar

from .._ground.arguments import Array
from .._request.quantities import QUANTITIES, Quantity

Recorded = TypeVar("Recorded")


def add_quantities(
    kind: type[Recorded], lead: tuple[str, ...], column: Callable[[Recorded, str], Array]
) -> None:
    """Adds to a class an attribute for each quantity that it does not define itself.

    lead      the sizes in front of a quantity's own, by name
    column    gives the values of a quantity by its name
    """
    for name in [name for name in QUANTITIES if name not in vars(kind)]:
        attribute = _attribute(QUANTITIES[name], lead, column)
        attribute.__set_name__(kind, name)
        setattr(kind, name, attribute)


def _attribute(
    quantity: Quantity, lead: tuple[str, ...], column: Callable[[Recorded, str], Array]
) -> cached_property[Array]:
    def of(recorded: Recorded) -> Array:
        return column(recorded, quantity.name)

    sizes = [*lead, *map(str, quantity.shape)]
    shape = ", ".join(sizes) + ("," if len(sizes) == 1 else "")
    unit = f" [{quantity.dimension}]" if quantity.dimension else ""
    of.__doc__ = f"({shape}) {quantity.text}{unit}."
    return cached_property(of)
