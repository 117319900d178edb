"""Words of many members: each an array that broadcasts, kept once and looked at as a whole.

A column has the shape of the members and behind it that of one value, () or (3,) and so on. Where
it does not vary its stride is zero, so that what many share is held once.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from .._ground.arguments import Array, at_least_zero, doubles, frozen, number, positive, row, shown
from .inertia import tensor_of

Shape = tuple[int, ...]
Index = tuple[int, ...]
Looked = Callable[[str, Any], object]  # at one value, by its name: refuses it, or lets it pass
Column = npt.NDArray[Any]
Change = Callable[[Column], Column]
_BLOCK = 4096  # members whose numbers stay in the cache from one operation to the next


class Word(NamedTuple):
    """A word with its values."""

    name: str
    values: Array  # (*shape, *value)
    value: Shape  # of one

    @property
    def shape(self) -> Shape:
        """That of the members of which it tells."""
        return self.values.shape[: self.values.ndim - len(self.value)]

    def over(self, shape: Shape) -> Array:
        """The values, broadcast to the shape of the members."""
        return spread(self.values, shape + self.value)

    def refused(self, bad: Any, look: Looked) -> None:
        """Raises what a look at the first bad value does, after its index and value."""
        if np.any(bad):
            index = tuple(map(int, np.unravel_index(int(np.argmax(bad)), self.shape)))
            raise self.refusal(index, look)

    def refusal(self, index: Index, look: Looked) -> Exception:
        """What a look at one value raises, after its index and value."""
        value = plain(self.values[index])
        try:
            look(self.name, value)
        except (TypeError, ValueError) as error:
            place = f"{self.name}{list(index)} = {shown(value)}: " if index else ""
            return type(error)(f"{place}{error}")
        return ValueError(f"{self.name}{list(index)} = {shown(value)} is not what it must be")


def plain(value: Any) -> Any:
    """The numbers of a value, as Python's own; vectors as tuples."""
    return tuple(map(plain, value)) if np.ndim(value) else value.item()


def word(name: str, given: object, value: Shape = (), what: str = "") -> Word:
    """A word of finite numbers, each value of this shape."""
    said = what or (f"{value[0]} numbers" if value else "a number")
    values = doubles(name, compact(given) if type(given) is np.ndarray else given, said)
    if isinstance(given, np.ndarray):
        values = np.broadcast_to(values, given.shape)
    if value and values.shape[-len(value) :] != value:
        raise ValueError(
            f"{name} must be {said}, or an array whose last dimension has them, not {shown(given)}"
            if len(value) == 1
            else f"{name} must be {said}, not {shown(given)}"
        )
    made = Word(name, values, value)
    if not np.isfinite(compact(values)).all():
        finite = np.isfinite(values)
        behind = tuple(range(-len(value), 0))
        made.refused(~(finite.all(axis=behind) if value else finite), _look(value))
    return made


def _look(value: Shape) -> Looked:
    if not value:
        return number
    if len(value) == 2:
        return tensor_of
    return lambda name, given: row(name, given, value[0], f"{value[0]} numbers")


def above_zero(name: str, given: object) -> Word:
    """A word of positive numbers."""
    made = word(name, given)
    made.refused(~(made.values > 0.0), positive)
    return made


def not_below_zero(name: str, given: object) -> Word:
    """A word of numbers that are not negative."""
    made = word(name, given)
    made.refused(~(made.values >= 0.0), at_least_zero)
    return made


def compact(values: Column, lead: int | None = None) -> Column:
    """The array with a single entry along dimensions in which it does not vary, of the first `lead`
    or of all."""
    if not values.size:
        return values
    strides = values.strides[:lead]
    return values[tuple(slice(0, 1) if stride == 0 else slice(None) for stride in strides)]


def once(change: Change) -> Change:
    """The change, made once of columns that are the same numbers in memory."""
    made: dict[tuple[object, ...], Column] = {}

    def changed(held: Column) -> Column:
        data = held.__array_interface__["data"][0]
        key = data, held.shape, held.strides, held.dtype.str
        if key not in made:
            made[key] = change(held)
        return made[key]

    return changed


def spread(values: Column, shape: Shape) -> Column:
    """The array broadcast to a shape, read-only."""
    return np.broadcast_to(values, shape)


def column(values: Column, shape: Shape, trailing: int) -> Column:
    """The column of these members, of values that have some trailing dimensions."""
    lead = values.ndim - trailing
    kept = np.asarray(values).view()
    kept.flags.writeable = False
    return spread(kept, shape + kept.shape[lead:])


def common(words: Iterable[tuple[str, Shape]]) -> Shape:
    """The shape to which those of all words broadcast."""
    given = list(words)
    try:
        return np.broadcast_shapes(*(shape for _, shape in given))
    except ValueError:
        told = ", ".join(f"{name} {shape}" for name, shape in given if shape)
        raise ValueError(f"the shapes of the members do not broadcast to one: {told}") from None


def together(*words: Word) -> Shape:
    """The shape of the members, of words that broadcast to one."""
    return common((each.name, each.shape) for each in words)


def names_of(shape: Shape, words: Iterable[Word]) -> tuple[str | None, ...]:
    """Of each dimension the word that alone varies along it, and along no other, where that is one
    of single numbers."""
    along: list[list[Word]] = [[] for _ in shape]
    places: dict[str, int] = {}
    for each in words:
        for back, n in enumerate(reversed(each.shape), 1):
            if n != 1 or shape[-back] == 1:
                along[-back].append(each)
                places[each.name] = places.get(each.name, 0) + 1
    return tuple(
        here[0].name if len(here) == 1 and not here[0].value and places[here[0].name] == 1 else None
        for here in along
    )


def vectors(*components: Array) -> Array:
    """Vectors of these components."""
    return np.stack(np.broadcast_arrays(*components), axis=-1)


def parts(values: Array) -> tuple[Array, ...]:
    """The components of vectors."""
    return tuple(np.moveaxis(values, -1, 0))


def blocks(shape: Shape) -> Iterator[slice]:
    """Pieces of the first dimension, of members whose numbers stay in the cache."""
    n = shape[0] if shape else 1
    each = max(1, int(np.prod(shape[1:], dtype=np.int64)))
    step = max(1, _BLOCK // each)
    return (slice(begin, begin + step) for begin in range(0, n, step))


def in_blocks(
    compute: Callable[..., tuple[Array, ...]], shape: Shape, width: int, *given: Array
) -> Array:
    """What is computed of columns of vectors or numbers, component by component: a column of
    vectors of this width. Each column is handed over as its components."""
    out = np.empty((*shape, width))
    wide = [spread(values, (*(shape or (1,)), values.shape[-1])) for values in given]
    to = out if shape else out[None]
    for piece in blocks(shape):
        with np.errstate(all="ignore"):
            made = compute(*(parts(values[piece]) for values in wide))
        for k, component in enumerate(made):
            to[piece][..., k] = component
    return frozen(out)
