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

Events are found on the polynomial that each step of method='taylor' is, none missed inside a step,
without any effect on the path. A place counts where the sign changes, for an extremum that of the
derivative; the start is none. A function nearer to zero than 2^-50 of its terms' sizes cannot be
told from zero: places between which it stays there are a touching, which is none. Times are as
exact as the path, and doubles, also of paths with more digits, whose states at these times have all
their digits. Growing and falling are meant in time, also where the path runs back.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TypedDict, Unpack

from numpy.typing import ArrayLike

from ._core import components, quantities, terms_value
from ._ground.arguments import Array, instance, number, vector, whole
from ._ground.refusals import unknown
from ._model.scene import Scene
from ._recording.path import Events, Path
from ._recording.recording import LookedFor
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

Function = Mapping[str, float]
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
    return _event(terms, False, direction, where, most, terminal)


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
    return _event(_terms("function", function), True, direction, where, most, terminal)


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
            f"within must be at least 1e-7, not {within!r}: nearer to rest rounding decides"
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
    if not isinstance(function, Mapping):
        raise TypeError(
            f"{name} must be a dict like {{'m_x': 1.0, 'apex_z*apex_z': -2.0}}, not {function!r}"
        )
    terms = []
    for key, factor in function.items():
        words = [word.strip() for word in key.split("*")] if isinstance(key, str) else []
        if not 1 <= len(words) <= 2:
            raise ValueError(
                f"a term of {name} must be a quantity or a product of two, as in 'm_x*m_y', not "
                f"{key!r}"
            )
        for word in words:
            if word not in components:
                raise ValueError(unknown("quantity", word, components))
        of, times = sorted((components[word] for word in [*words, "1"][:2]), reverse=True)
        terms.append((number(f"the factor of {key!r}", factor), of, times))
    return tuple(sorted((term for term in terms if term[0]), key=lambda term: term[1]))


def _event(
    terms: Terms,
    extremum: bool,
    direction: int,
    where: Function | None,
    most: int | None,
    terminal: bool,
) -> Event:
    if not any(of for _, of, _ in terms):
        raise ValueError(
            "the function is constant, and has no events: give a quantity with a factor other "
            "than zero"
        )
    if direction not in (-1, 0, 1):
        raise ValueError(f"direction must be 1, -1 or 0, not {direction!r}")
    if not isinstance(terminal, bool):
        raise TypeError(f"terminal must be True or False, not {terminal!r}")
    limit = None if most is None else whole("most", most, 1)
    condition = () if where is None else _terms("where", where)
    if where is not None and not condition:
        raise ValueError(
            "where is zero, and never positive: give a quantity with a factor other than zero"
        )
    return Event(terms, condition, extremum, int(direction), limit, terminal)


def checked_events(method: str, events: object) -> LookedFor:
    """Events as the core takes them; TypeError or ValueError for what it cannot look for."""
    if method != ELSE:
        raise ValueError(f"events need the polynomials of method={ELSE!r}, and {method!r} has none")
    if not isinstance(events, Sequence) or not all(isinstance(event, Event) for event in events):
        raise TypeError(
            "events must be a list of what kreisel.events makes, as kr.events.loop(), "
            f"not {events!r}"
        )
    return [
        (list(e.terms), list(e.where), e.extremum, e.direction, e.most or 0, e.terminal)
        for e in events
    ]
