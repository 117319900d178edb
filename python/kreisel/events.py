"""Events: the times at which a function of the state crosses zero or has an extremum.

    events = [kr.events.nutation(), kr.events.plane((0, 1, 0), direction=1)]
    path = kr.solve(scene, t=300, events=events)
    path.events.t, path.events.which, path.events.direction, path.events.path.apex

    first_low = kr.events.nutation(direction=1, terminal=True)
    half = kr.solve(scene, t=300, events=[first_low]).t[-1]

A function is a sum of terms, factor * component or factor * component * component, in the scene's
units. kreisel.events.components names all components, "1" stands for a constant, and
help(kreisel.Path) describes the quantities that they belong to:

    {"m_x": 2.0, "apex_z*apex_z": 1.0, "1": -0.5}       2 m_x + apex_z^2 - 0.5
    "body_velocity_y"                                   this component alone

Python functions are not supported, because events are roots of a polynomial. For those, search a
path with close states for sign changes, where(diff(sign(f(path)))) in NumPy, without a guarantee.

Events are the sign changes of the polynomial of each step of method='taylor'; for an extremum,
those of its derivative. No event inside a step is missed, and the path does not change. The start
is not an event. Below 2^-50 of the sizes of its terms a function counts as zero: it touches zero
there, and a touch is not an event. Times are as accurate as the path and are doubles, also for
paths with more digits, whose states at these times have all their digits. Rising and falling refer
to time, also where the path runs backwards.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TypedDict, Unpack

from numpy.typing import ArrayLike

from ._core import components, quantities, terms_value
from ._model.scene import Scene
from ._options.methods import FALLBACK
from ._results.path import Events, Path
from ._utils.errors import unknown_name_message
from ._utils.validation import Array, as_float, as_int, as_vector, check_type, short_repr
from .quaternion import turn

__all__ = [
    "Event",
    "Events",
    "components",
    "crossing",
    "cusp",
    "extremum",
    "kinetic",
    "loop",
    "nutation",
    "plane",
    "separatrix",
]


def __dir__() -> list[str]:
    """List the public names."""
    return sorted(__all__)


Function = Mapping[str, float] | str
Terms = tuple[tuple[float, int, int], ...]


class _Count(TypedDict, total=False):
    """Keyword arguments of crossing and extremum except `where`."""

    direction: int
    max_count: int | None
    terminal: bool


class _More(_Count, total=False):
    """Keyword arguments of crossing and extremum."""

    where: Function | None


_VECTORS = [row["name"] for row in quantities if row["in_events"] and row["doubles"] == 3]
_PRECESSION = {f"body_vertical_{i}*body_velocity_{i}": 1.0 for i in "xyz"} | {"apex_z*spin": -1.0}
_SPEED = {f"body_velocity_{i}*body_velocity_{i}": 1.0 for i in "xyz"}


@dataclass(frozen=True)
class Event:
    """A description of events, built by the functions of this module.

    terms      terms of the function g: (factor, index, index) by the indices of the components
    where      terms of a function that must be positive at the event; empty: no condition
    extremum   False: g crosses zero; True: g has an extremum
    direction  1: g rises, or has a minimum; -1: g falls, or has a maximum; 0: either
    max_count  number of events to record, the first ones; None: all
    terminal   True: the path ends at the event, or at the last one if `max_count` is given
    """

    terms: Terms
    where: Terms = ()
    extremum: bool = False
    direction: int = 0
    max_count: int | None = None
    terminal: bool = False

    def value(self, path: Path) -> Array:
        """Return (n,) values of g at the states of a path."""
        check_type("path", path, Path)
        return terms_value(path.scene._block, path.states, list(self.terms))


def crossing(
    function: Function,
    value: float = 0.0,
    *,
    direction: int = 0,
    where: Function | None = None,
    max_count: int | None = None,
    terminal: bool = False,
) -> Event:
    """Find where a function crosses a value, given in its own units.

    direction, max_count and terminal are as in Event; `where` is a function that must be positive
    at the event. Raises TypeError and ValueError for invalid functions and for a constant.
    """
    level = as_float("value", value)
    terms = _terms("function", function) + (((-level, 0, 0),) if level else ())
    return _event(terms, _condition(where), False, direction, max_count, terminal)


def extremum(
    function: Function,
    *,
    direction: int = 0,
    where: Function | None = None,
    max_count: int | None = None,
    terminal: bool = False,
) -> Event:
    """Find local minima (direction 1) or maxima (-1) of a function; the rest as in crossing."""
    terms = _terms("function", function)
    return _event(terms, _condition(where), True, direction, max_count, terminal)


def plane(normal: ArrayLike, offset: float = 0.0, of: str = "apex", **more: Unpack[_More]) -> Event:
    """Find crossings of a plane, a Poincaré section: <normal, v> = offset.

    of is the name of v: 'apex', 'm', 'body_vertical', 'body_velocity' or 'body_momentum'. The
    offset has the units of v; the rest is as in crossing.
    """
    if of not in _VECTORS:
        raise ValueError(unknown_name_message("vector", str(of), _VECTORS))
    along = zip("xyz", as_vector("normal", normal), strict=True)
    return crossing({f"{of}_{i}": n for i, n in along if n}, offset, **more)


def nutation(**more: Unpack[_More]) -> Event:
    """Find the lowest (direction 1) or highest (-1) points of the apex; the rest as in extremum."""
    return extremum({"apex_z": 1.0}, **more)


def loop(**more: Unpack[_More]) -> Event:
    """Find where the apex reverses its precession about the vertical.

    A trace with loops has two such points for each loop, a wavy trace none. At a cusp the
    precession touches zero, which within the path's error may look like a small loop or like none.
    The rest is as in crossing.
    """
    return crossing(_PRECESSION, **more)


def cusp(within: float = 1e-6, **more: Unpack[_Count]) -> Event:
    """Find where the apex stands still and turns back.

    A cusp is a highest or lowest point at which the apex moves at less than `within` of the body's
    angular speed; `within` is at least 1e-7, below which rounding decides. The rest is as in
    extremum, without `where`.
    """
    if as_float("within", within) < 1e-7:
        raise ValueError(
            f"within must be at least 1e-7, the effect of rounding, not {short_repr(within)}"
        )
    left = {name: factor * (within * within - 1.0) for name, factor in _SPEED.items()}
    return extremum({"apex_z": 1.0}, where=left | {"spin*spin": 1.0}, **more)


def kinetic(value: float, **more: Unpack[_More]) -> Event:
    """Find where the kinetic energy crosses a value [M L^2 T^-2]; the rest as in crossing."""
    twice = {f"body_momentum_{i}*body_velocity_{i}": 0.5 for i in "xyz"}
    return crossing(twice, value, **more)


def separatrix(scene: Scene, **more: Unpack[_More]) -> Event:
    """Find where a scene is nearest to its unstable equilibrium.

    Motions on both sides of the separatrix linger there. Under gravity these are the points at
    which the centre of mass is highest. Without torque they are those at which the angular velocity
    turns back near the axis of the middle moment, on either side. The states tell how near they
    come. The rest is as in extremum, without `direction` under gravity. Raises ValueError for a
    body without torque and with two equal moments, which has no separatrix.
    """
    check_type("scene", scene, Scene)
    if scene.gravity and any(scene.body.com):
        if "direction" in more:
            raise TypeError("under gravity a separatrix has its own direction: leave direction out")
        more["direction"] = -1 if scene.gravity > 0.0 else 1
        return nutation(**more)
    moments = scene.body.moments
    if len(set(moments)) < 3:
        raise ValueError(
            f"a body without torque whose moments are {moments} has no separatrix: two are equal"
        )
    middle = sorted(range(3), key=moments.__getitem__)[1]
    x, y, z = (float(i == middle) for i in range(3))
    axis = turn(scene.body.axes, (x, y, z))
    along = zip("xyz", axis, strict=True)
    return extremum({f"body_velocity_{i}": a for i, a in along if a}, **more)


def _terms(name: str, function: object) -> Terms:
    factors = {function: 1.0} if isinstance(function, str) else function
    if callable(function):
        raise TypeError(
            f"{name} must be a sum of components, as {{'m_x': 1.0, 'apex_z*apex_z': -2.0}}: no "
            f"polynomial can be taken through {short_repr(function)}"
        )
    if not isinstance(factors, Mapping):
        raise TypeError(
            f"{name} must be a component, as 'apex_z', or a dict like "
            f"{{'m_x': 1.0, 'apex_z*apex_z': -2.0}}, not {short_repr(function)}"
        )
    terms = []
    for key, factor in factors.items():
        words = [word.strip() for word in key.split("*")] if isinstance(key, str) else []
        if not 1 <= len(words) <= 2:
            raise ValueError(
                f"a term of {name} must be a quantity or a product of two, as in 'm_x*m_y', not "
                f"{key!r}"
            )
        of, times = sorted((_component(word) for word in [*words, "1"][:2]), reverse=True)
        terms.append((as_float(f"the factor of {key!r}", factor), of, times))
    return tuple(sorted((term for term in terms if term[0]), key=lambda term: term[1]))


_INSTEAD = {
    "kinetic": "kreisel.events.kinetic makes an event of it",
    "nutation": "take 'apex_z', which is its cosine",
    "potential": "take 'apex_z', the height of which it is a multiple",
    "velocity": "take those of 'body_velocity', as 'body_velocity_y', which are seen from the body",
}


def _component(word: str) -> int:
    """Return the index of a component; raise ValueError if it is unknown or has no series."""
    if word in components:
        return components[word]
    rows = (row for row in quantities if word in (row["name"], *row["components"]))
    row = next(rows, None)
    if row is None:
        raise ValueError(unknown_name_message("quantity", word, [*components, "nutation"]))
    name = row["name"]
    if row["in_events"]:
        *most, last = map(repr, row["components"])
        raise ValueError(f"{name!r} has several components: {', '.join(most)} and {last}")
    there = ", ".join(row["name"] for row in quantities if row["in_events"])
    instead = _INSTEAD.get(name, f"there are some of {there}")
    raise ValueError(f"events have no series of {name!r}, {row['text']}; {instead}")


def _condition(where: Function | None) -> Terms:
    condition = () if where is None else _terms("where", where)
    if where is not None and not condition:
        raise ValueError(
            "where is zero, and never positive: give a quantity with a factor other than zero"
        )
    return condition


def _event(
    terms: Terms,
    where: Terms,
    extremum: bool,
    direction: int,
    max_count: int | None,
    terminal: bool,
) -> Event:
    if not any(of for _, of, _ in terms):
        raise ValueError(
            "the function is constant, and has no events: give a quantity with a factor other "
            "than zero"
        )
    if direction not in (-1, 0, 1):
        raise ValueError(f"direction must be 1, -1 or 0, not {short_repr(direction)}")
    for name, value in {"extremum": extremum, "terminal": terminal}.items():
        if not isinstance(value, bool):
            raise TypeError(f"{name} must be True or False, not {short_repr(value)}")
    limit = None if max_count is None else as_int("max_count", max_count, 1)
    return Event(terms, where, extremum, int(direction), limit, terminal)


MAKERS: dict[str, Callable[..., Event]] = {  # by the names that a shell and files have for them
    name: globals()[name] for name in __all__ if name.islower() and callable(globals()[name])
}


def parse_events(method: str, events: object) -> tuple[Event, ...]:
    """Validate the events of a call; raise TypeError or ValueError if the method has none."""
    if method != FALLBACK:
        raise ValueError(
            f"events need the polynomials of method={FALLBACK!r}, and {method!r} has none"
        )
    listed = [events] if isinstance(events, Event) else events
    if not isinstance(listed, Sequence) or not all(isinstance(event, Event) for event in listed):
        raise TypeError(
            "events must be a list of what kreisel.events makes, as kr.events.loop(), "
            f"not {short_repr(events)}"
        )
    return tuple(listed)


CoreEvents = list[
    tuple[list[tuple[float, int, int]], list[tuple[float, int, int]], bool, int, int, bool]
]


def to_core_events(events: Iterable[Event]) -> CoreEvents:
    """Convert events to the tuples that the core takes."""
    return [
        (list(e.terms), list(e.where), e.extremum, e.direction, e.max_count or 0, e.terminal)
        for e in events
    ]


_NAMES = {component: name for name, component in components.items()}


class EventRecord(TypedDict):
    """An event in a checkpoint, with components by name: their indices depend on the build."""

    terms: list[tuple[float, str, str]]
    where: list[tuple[float, str, str]]
    extremum: bool
    direction: int
    max_count: int | None
    terminal: bool


def to_record(event: Event) -> EventRecord:
    """Convert an event for a checkpoint."""
    return {
        "terms": _terms_by_name(event.terms),
        "where": _terms_by_name(event.where),
        "extremum": event.extremum,
        "direction": event.direction,
        "max_count": event.max_count,
        "terminal": event.terminal,
    }


def _terms_by_name(terms: Terms) -> list[tuple[float, str, str]]:
    return [(float(factor), _NAMES[of], _NAMES[times]) for factor, of, times in terms]


def from_record(row: EventRecord) -> Event:
    """Restore an event of a checkpoint.

    Raises KeyError, TypeError or ValueError if it is invalid."""
    return _event(
        _terms_by_index(row["terms"]),
        _terms_by_index(row["where"]),
        row["extremum"],
        row["direction"],
        row["max_count"],
        row["terminal"],
    )


def _terms_by_index(terms: Iterable[tuple[float, str, str]]) -> Terms:
    return tuple((as_float("a factor", f), components[a], components[b]) for f, a, b in terms)
