"""Quantities that can be recorded along a path."""

from __future__ import annotations

from typing import NamedTuple

from .._core import quantities
from .._utils.arguments import unknown_name_message


class QuantityDescription(NamedTuple):
    """A named function of the state.

    doubles     the number of components
    components  the names of the components
    turns       True if the quantity changes when the top is rotated about the vertical
    dimension   rad, rad/T or rad/T^2, or in terms of M, L and T; empty for a pure number
    text        a description
    """

    name: str
    doubles: int
    components: list[str]
    turns: bool
    dimension: str
    text: str

    @property
    def shape(self) -> tuple[int, ...]:
        """The shape of one value of the quantity."""
        return () if self.doubles == 1 else (3, 3) if self.doubles == 9 else (self.doubles,)


QUANTITIES: dict[str, QuantityDescription] = {  # functions of the state
    row["name"]: QuantityDescription(
        row["name"],
        row["doubles"],
        row["components"],
        row["turns"],
        row["dimension"],
        row["text"],
    )
    for row in quantities
}


def _make_low_word_quantity(name: str) -> QuantityDescription:
    """Return the quantity that contains the low-order part of `name` in extended precision."""
    base = QUANTITIES[name]
    words = [f"{name}_low{component.removeprefix(name)}" for component in base.components]
    text = f"low words of {name}, to be added to {name}; zero up to 16 digits"
    return base._replace(name=f"{name}_low", components=words, text=text)


LOW = {low.name: low for low in map(_make_low_word_quantity, ("q", "m"))}
RECORDABLE = QUANTITIES | LOW  # the quantities that `want` may contain
TIME = QuantityDescription("t", 1, ["t"], False, "T", "times")
HEADING_DEPENDENT = frozenset(name for name, quantity in RECORDABLE.items() if quantity.turns)
ANGLES = frozenset(name for name, quantity in QUANTITIES.items() if quantity.dimension == "rad")


def get_quantity_derivative_shape(name: str) -> tuple[int, ...]:
    """Return the array shape of derivatives of the quantity `name`."""
    return (3,) if name == "q" else QUANTITIES[name].shape


def validate_quantity_name(name: object) -> str:
    """Return `name`. Raise ValueError if no quantity of the state has this name."""
    if not isinstance(name, str) or name not in QUANTITIES:
        raise ValueError(unknown_name_message("quantity", str(name), QUANTITIES))
    return name


def count_quantity_components(name: str) -> int:
    """Return the number of components of a quantity."""
    return (TIME if name == "t" else RECORDABLE[name]).doubles
