"""The errata of the thesis: what the text says, what is right, and by how much each is wrong, computed."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Erratum:
    """`text` and `right` are how wrong each is, in the words of `measure`."""

    number: int
    where: str
    says: str
    is_right: str
    measure: str
    text: float
    right: float


_FOUND = {}


def erratum(number, where, says, is_right, measure):
    """Of a function that gives (text's error, right one's)."""

    def add(compute):
        def made():
            return Erratum(number, where, says, is_right, measure, *(float(x) for x in compute()))

        _FOUND[number] = made
        return made

    return add


def all_of_them():
    """By number."""
    from . import errata_maps, errata_mechanics

    assert errata_maps and errata_mechanics
    return [_FOUND[number]() for number in sorted(_FOUND)]
