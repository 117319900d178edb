"""What a path can be asked for: the core's table of quantities, and what a recording has beside
it."""

from __future__ import annotations

from typing import NamedTuple

from .._ground.core_table import quantities


class Quantity(NamedTuple):
    """A named function of the state.

    doubles    how many it is; shape: its own, after the n of the states
    turns      whether it changes when the top is turned about the vertical
    dimension  in [M L T]; text: what it is
    """

    name: str
    doubles: int
    turns: bool
    dimension: str
    text: str

    @property
    def shape(self) -> tuple[int, ...]:
        return () if self.doubles == 1 else (3, 3) if self.doubles == 9 else (self.doubles,)

    @property
    def components(self) -> list[str]:
        """The names of its numbers: itself, or apex_x, apex_y, apex_z; of q and m without the
        line."""
        if self.doubles == 1:
            return [self.name]
        link = "_" if len(self.name) > 1 else ""
        return [f"{self.name}{link}{axis}" for axis in _AXES.get(self.doubles, range(self.doubles))]


_AXES = {3: "xyz", 4: "wxyz", 9: [f"{axis}{x}" for axis in "NBT" for x in "xyz"]}
_TABLE = [
    Quantity(row["name"], row["doubles"], row["turns"], row["dimension"], row["text"])
    for row in quantities
]
_LOW = [
    Quantity("q_low", 4, True, "1", "what the doubles of q leave out; zero up to 16 digits"),
    Quantity("m_low", 3, True, "M L^2 T^-1", "what the doubles of m leave out"),
]

QUANTITIES = {quantity.name: quantity for quantity in _TABLE}  # functions of the state
WANTED = {quantity.name: quantity for quantity in [*_TABLE, *_LOW]}  # what `want` can name
TIME = Quantity("t", 1, False, "T", "times")
TURNING = frozenset(name for name, quantity in WANTED.items() if quantity.turns)


def doubles(name: str) -> int:
    """How many doubles a state's quantity or time is."""
    return (TIME if name == "t" else WANTED[name]).doubles
