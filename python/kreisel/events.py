"""Events: where, on its way, a function of the state passes zero or is largest or smallest.

    events = [kr.events.nutation(), kr.events.plane((0, 1, 0), direction=1)]
    path = kr.solve(scene, t=300, events=events)
    path.events.t, path.events.which, path.events.direction, path.events.path.apex

    first_low = kr.events.nutation(direction=1, terminal=True)
    half = kr.solve(scene, t=300, events=[first_low]).t[-1]

A function is a sum of terms, factor * component or factor * component * component, in the scene's
units; kreisel.events.components names them all, "1" stands for a constant, and the quantities that
they belong to are told by help(kreisel.Path):

    {"m_x": 2.0, "apex_z*apex_z": 1.0, "1": -0.5}       2 m_x + apex_z^2 - 0.5
    "body_velocity_y"                                   this component alone

A function of Python's own cannot be one: a polynomial cannot be taken through it. Where it passes
zero shows in a path of close states, where(diff(sign(f(path)))) in numpy's words, without the
promise that none is missed.

Events are found on the polynomial that each step of method='taylor' is, none missed inside a step,
without any effect on the path. A place counts where the sign changes, for an extremum that of the
derivative; the start is none. A function nearer to zero than 2^-50 of its terms' sizes cannot be
told from zero: places between which it stays there are a touching, which is none. Times are as
exact as the path, and doubles, also of paths with more digits, whose states at these times have all
their digits. Growing and falling are meant in time, also where the path runs back.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TypedDict, Unpack

from numpy.typing import ArrayLike

from ._core import components, quantities, terms_value
from ._ground.arguments import Array, instance, number, shown, vector, whole
from ._ground.refusals import unknown
from ._model.scene import Scene
from ._recording.path import Events, Path
from ._request.methods import ELSE
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
    """What a user looks for here."""
    return sorted(__all__)


Function = Mapping[str, float] | str
Terms = tuple[tuple[float, int, int], ...]


class _Count(TypedDict, total=False):
    """The words of crossing and extremum but for `where`."""

    direction: int
    most: int | None
    terminal: bool


class _More(_Count, total=False):
    """The words of crossing and extremum."""

    where: Function | None


_VECTORS = [row["name"] for row in quantities if row["in_events"] and row["doubles"] == 3]
_PRECESSION = {f"body_vertical_{i}*body_velocity_{i}": 1.0 for i in "xyz"} | {"apex_z*spin": -1.0}
_SPEED = {f"body_velocity_{i}*body_velocity_{i}": 1.0 for i in "xyz"}


@dataclass(frozen=True)
class Event:
    """What to look for; made by the functions of this module.

    terms      of the function g, as (factor, number, number) by the numbers of the components
    where      of a function that must be positive for the event to count; none: it counts
               everywhere
    extremum   False: where g passes zero; True: where g is largest or smallest
    direction  1: g grows with time, or is smallest; -1: g falls, or is largest; 0: either
    most       how many are recorded, the first ones; None: all
    terminal   whether the path ends at the event, or where `most` is given, at the last of these
    """

    terms: Terms
    where: Terms = ()
    extremum: bool = False
    direction: int = 0
    most: int | None = None
    terminal: bool = False

    def value(self, path: Path) -> Array:
        """(n,) g at each state of a path."""
        instance("path", path, Path)
        return terms_value(path.scene._block, path.states, list(self.terms))


def crossing(
    function: Function,
    value: float = 0.0,
    *,
    direction: int = 0,
    where: Function | None = None,
    most: int | None = None,
    terminal: bool = False,
) -> Event:
    """Where a function passes a value, in its own units: the function's sign less the value
    changes.

    direction, most and terminal are as in Event; where is a function that must be positive there.
    Raises TypeError and ValueError for functions that are none, and for one that is constant.
    """
    level = number("value", value)
    terms = _terms("function", function) + (((-level, 0, 0),) if level else ())
    return _event(terms, _condition(where), False, direction, most, terminal)


def extremum(
    function: Function,
    *,
    direction: int = 0,
    where: Function | None = None,
    most: int | None = None,
    terminal: bool = False,
) -> Event:
    """Where a function is smallest (direction 1) or largest (-1) for the time being; the rest as in
    crossing."""
    terms = _terms("function", function)
    return _event(terms, _condition(where), True, direction, most, terminal)


def plane(normal: ArrayLike, offset: float = 0.0, of: str = "apex", **more: Unpack[_More]) -> Event:
    """A Poincare section: where <normal, v> passes the offset, v being 'apex', 'm',
    'body_vertical', 'body_velocity' or 'body_momentum'; the offset in units of v, the rest as in
    crossing."""
    if of not in _VECTORS:
        raise ValueError(unknown("vector", str(of), _VECTORS))
    along = zip("xyz", vector("normal", normal), strict=True)
    return crossing({f"{of}_{i}": n for i, n in along if n}, offset, **more)


def nutation(**more: Unpack[_More]) -> Event:
    """Where the apex is lowest (direction 1) or highest (-1); the rest as in extremum."""
    return extremum({"apex_z": 1.0}, **more)


def loop(**more: Unpack[_More]) -> Event:
    """Where the apex turns back on its way round the vertical: its precession changes its sense.

    There are two to each loop of a trace with loops, none for a wavy one; at a cusp the precession
    touches zero, which within the path's error may look like a small loop or like none. The rest as
    in crossing."""
    return crossing(_PRECESSION, **more)


def cusp(within: float = 1e-6, **more: Unpack[_Count]) -> Event:
    """Where the apex stands still and turns back: a highest or lowest point at which it moves at
    less than `within` of the body's angular speed, at least 1e-7, below which rounding decides; the
    rest as in extremum, without `where`."""
    if number("within", within) < 1e-7:
        raise ValueError(
            f"within must be at least 1e-7, not {shown(within)}: nearer to rest rounding decides"
        )
    left = {name: factor * (within * within - 1.0) for name, factor in _SPEED.items()}
    return extremum({"apex_z": 1.0}, where=left | {"spin*spin": 1.0}, **more)


def kinetic(value: float, **more: Unpack[_More]) -> Event:
    """Where the kinetic energy passes a value [M L^2 T^-2]; the rest as in crossing."""
    twice = {f"body_momentum_{i}*body_velocity_{i}": 0.5 for i in "xyz"}
    return crossing(twice, value, **more)


def separatrix(scene: Scene, **more: Unpack[_More]) -> Event:
    """Where a scene is nearest to its unstable equilibrium, near which motions on both sides of the
    separatrix linger.

    Under gravity these are the points at which the centre of mass is highest; without torque those
    at which the angular velocity turns back near the axis of the middle moment, on either side. How
    near they come is for the states to tell. The rest as in extremum, without `direction` under
    gravity. ValueError for a body without torque and with two equal moments, which has no
    separatrix.
    """
    instance("scene", scene, Scene)
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
            f"polynomial can be taken through {shown(function)}"
        )
    if not isinstance(factors, Mapping):
        raise TypeError(
            f"{name} must be a component, as 'apex_z', or a dict like "
            f"{{'m_x': 1.0, 'apex_z*apex_z': -2.0}}, not {shown(function)}"
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
        terms.append((number(f"the factor of {key!r}", factor), of, times))
    return tuple(sorted((term for term in terms if term[0]), key=lambda term: term[1]))


_INSTEAD = {
    "kinetic": "kreisel.events.kinetic makes an event of it",
    "nutation": "take 'apex_z', which is its cosine",
    "potential": "take 'apex_z', the height of which it is a multiple",
    "velocity": "take those of 'body_velocity', as 'body_velocity_y', which are seen from the body",
}


def _component(word: str) -> int:
    """The number of a component; ValueError where there is none, or no series of it."""
    if word in components:
        return components[word]
    rows = (row for row in quantities if word in (row["name"], *row["components"]))
    row = next(rows, None)
    if row is None:
        raise ValueError(unknown("quantity", word, [*components, "nutation"]))
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
    most: int | None,
    terminal: bool,
) -> Event:
    if not any(of for _, of, _ in terms):
        raise ValueError(
            "the function is constant, and has no events: give a quantity with a factor other "
            "than zero"
        )
    if direction not in (-1, 0, 1):
        raise ValueError(f"direction must be 1, -1 or 0, not {shown(direction)}")
    for name, value in {"extremum": extremum, "terminal": terminal}.items():
        if not isinstance(value, bool):
            raise TypeError(f"{name} must be True or False, not {shown(value)}")
    limit = None if most is None else whole("most", most, 1)
    return Event(terms, where, extremum, int(direction), limit, terminal)


MAKERS: dict[str, Callable[..., Event]] = {  # by the names that a shell and files have for them
    name: globals()[name] for name in __all__ if name.islower() and callable(globals()[name])
}


def checked_events(method: str, events: object) -> tuple[Event, ...]:
    """What to look for, where the method can; TypeError or ValueError for what it cannot."""
    if method != ELSE:
        raise ValueError(f"events need the polynomials of method={ELSE!r}, and {method!r} has none")
    listed = [events] if isinstance(events, Event) else events
    if not isinstance(listed, Sequence) or not all(isinstance(event, Event) for event in listed):
        raise TypeError(
            "events must be a list of what kreisel.events makes, as kr.events.loop(), "
            f"not {shown(events)}"
        )
    return tuple(listed)


LookedFor = list[
    tuple[list[tuple[float, int, int]], list[tuple[float, int, int]], bool, int, int, bool]
]


def looked_for(events: Iterable[Event]) -> LookedFor:
    """Events as the core takes them."""
    return [
        (list(e.terms), list(e.where), e.extremum, e.direction, e.most or 0, e.terminal)
        for e in events
    ]


_NAMES = {component: name for name, component in components.items()}


class Written(TypedDict):
    """An event as a checkpoint keeps it: components by name, for their numbers are of one build."""

    terms: list[tuple[float, str, str]]
    where: list[tuple[float, str, str]]
    extremum: bool
    direction: int
    most: int | None
    terminal: bool


def written(event: Event) -> Written:
    """An event for a checkpoint."""
    return {
        "terms": _named(event.terms),
        "where": _named(event.where),
        "extremum": event.extremum,
        "direction": event.direction,
        "most": event.most,
        "terminal": event.terminal,
    }


def _named(terms: Terms) -> list[tuple[float, str, str]]:
    return [(float(factor), _NAMES[of], _NAMES[times]) for factor, of, times in terms]


def read(row: Written) -> Event:
    """The event that was written; KeyError, TypeError or ValueError for what is none."""
    return _event(
        _numbered(row["terms"]),
        _numbered(row["where"]),
        row["extremum"],
        row["direction"],
        row["most"],
        row["terminal"],
    )


def _numbered(terms: Iterable[tuple[float, str, str]]) -> Terms:
    return tuple((number("a factor", f), components[a], components[b]) for f, a, b in terms)
