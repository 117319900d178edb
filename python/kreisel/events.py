"""Events: where, on its way, a function of the state passes zero or is largest or smallest.

    path = kr.solve(scene, t=300, events=[kr.events.nutation(), kr.events.plane((0, 1, 0), direction=1)])
    path.events.t, path.events.which, path.events.direction, path.events.path.apex

    first_low = kr.events.nutation(direction=1, terminal=True)
    half = kr.solve(scene, t=300, events=[first_low]).t[-1]

A function is a sum of terms, factor * quantity or factor * quantity * quantity, in the scene's units:

    {"m_x": 2.0, "apex_z*apex_z": 1.0, "1": -0.5}       2 m_x + apex_z^2 - 0.5

    q_w q_x q_y q_z         the attitude
    apex_x y z              from the fixed point to the centre of mass (as path.apex), a unit vector, in space
    m_x y z                 angular momentum, in space [M L^2 T^-1]
    body_vertical_x y z     the upward vertical, seen from the frame in which the body was described
    body_velocity_x y z     angular velocity, seen from there [T^-1]
    body_momentum_x y z     angular momentum, seen from there [M L^2 T^-1]
    spin                    angular velocity about the apex [T^-1]
    1                       nothing: for a constant

Found on the polynomial that each step of method='taylor' is, none missed inside a step, without any effect on the path.
A place counts where the sign changes, for an extremum that of the derivative; the start is none. A function nearer to
zero than 2^-50 of its terms' sizes cannot be told from zero: places between which it stays there are a touching, which
is none. Times are as exact as the path, and doubles, also of paths with more digits, whose states at these times have
all their digits. Growing and falling are meant in time, also where the path runs back.
"""
from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from . import _core, check, errors, quaternion
from .check import Array, VectorLike
from .methods import ELSE
from .scene import Scene

if TYPE_CHECKING:
    from .path import Path

Function = Mapping[str, float]
Terms = tuple[tuple[float, int, int], ...]
Block = tuple[list[tuple[float, int, int]], list[tuple[float, int, int]], bool, int, int, bool]

_NUMBER = _core.components
_VECTORS = ("apex", "m", "body_vertical", "body_velocity", "body_momentum")
_PRECESSION = {f"body_vertical_{i}*body_velocity_{i}": 1.0 for i in "xyz"} | {"apex_z*spin": -1.0}
_SPEED = {f"body_velocity_{i}*body_velocity_{i}": 1.0 for i in "xyz"}


@dataclass(frozen=True)
class Event:
    """What to look for; made by the functions of this module.

    terms      of the function g, as (factor, number, number) into the quantities
    where      of a function that must be positive for the event to count; none: it counts everywhere
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
        return _core.terms_value(path.scene._block, path.states, list(self.terms))


@dataclass(frozen=True, eq=False)
class Events:
    """k events in the order in which a path met them.

    path       the states at the events, with all that a path can tell; its t is (k,), in the path's order [T]
    which      (k,) the index of each in the list that solve was given
    direction  (k,) 1: the function grew with time, or was smallest; -1: it fell, or was largest
    """

    path: Path
    which: npt.NDArray[np.intc]
    direction: npt.NDArray[np.intc]

    def __len__(self) -> int:
        return len(self.path)

    @property
    def t(self) -> Array:
        """(k,) times [T]."""
        return self.path.t

    @property
    def states(self) -> Array:
        """(k, 8): t [T], q (w, x, y, z), m [M L^2 T^-1]."""
        return self.path.states


def crossing(
    function: Function,
    value: float = 0.0,
    *,
    direction: int = 0,
    where: Function | None = None,
    most: int | None = None,
    terminal: bool = False,
) -> Event:
    """Where a function passes a value, in its own units: the function's sign less the value changes.

    direction, most and terminal are as in Event; where is a function that must be positive there. Raises TypeError and
    ValueError for functions that are none, and for one that is constant.
    """
    level = check.number("value", value)
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
    """Where a function is smallest (direction 1) or largest (-1) for the time being; the rest as in crossing."""
    return _event(_terms("function", function), True, direction, where, most, terminal)


def plane(normal: VectorLike, offset: float = 0.0, of: str = "apex", **more: Any) -> Event:
    """A Poincare section: where <normal, v> passes the offset, v being 'apex', 'm', 'body_vertical', 'body_velocity' or
    'body_momentum'; the offset in units of v, the rest as in crossing."""
    if of not in _VECTORS:
        raise ValueError(errors.unknown("vector", str(of), _VECTORS))
    components = zip("xyz", check.vector("normal", normal))
    return crossing({f"{of}_{i}": n for i, n in components if n}, offset, **more)


def nutation(**more: Any) -> Event:
    """Where the apex is lowest (direction 1) or highest (-1); the rest as in extremum."""
    return extremum({"apex_z": 1.0}, **more)


def loop(**more: Any) -> Event:
    """Where the apex turns back on its way round the vertical: its precession changes its sense. Two to each loop of a
    trace with loops, none for a wavy one; at a cusp the precession touches zero, which within the path's error may look
    like a small loop or like none. The rest as in crossing."""
    return crossing(_PRECESSION, **more)


def cusp(within: float = 1e-6, **more: Any) -> Event:
    """Where the apex stands still and turns back: a highest or lowest point at which it moves at less than `within` of
    the body's angular speed, at least 1e-7, below which rounding decides; the rest as in extremum, without `where`."""
    if check.number("within", within) < 1e-7:
        raise ValueError(f"within must be at least 1e-7, not {within!r}: nearer to rest rounding decides")
    left = {name: factor * (within * within - 1.0) for name, factor in _SPEED.items()} | {"spin*spin": 1.0}
    return extremum({"apex_z": 1.0}, where=left, **more)


def kinetic(value: float, **more: Any) -> Event:
    """Where the kinetic energy passes a value [M L^2 T^-2]; the rest as in crossing."""
    return crossing({f"body_momentum_{i}*body_velocity_{i}": 0.5 for i in "xyz"}, value, **more)


def separatrix(scene: Scene, **more: Any) -> Event:
    """Where a scene is nearest to its unstable equilibrium, near which motions on both sides of the separatrix linger.

    Under gravity the points at which the centre of mass is highest; without torque those at which the angular velocity
    turns back near the axis of the middle moment, on either side. How near they come is for the states to tell. The
    rest as in extremum, without `direction` under gravity. ValueError for a body without torque and with two equal
    moments, which has no separatrix.
    """
    if not isinstance(scene, Scene):
        raise TypeError(f"scene must be a kreisel.Scene, not {scene!r}")
    if scene.gravity and any(scene.body.com):
        return nutation(direction=-1 if scene.gravity > 0.0 else 1, **more)
    moments = scene.body.moments
    if len(set(moments)) < 3:
        raise ValueError(f"a body without torque whose moments are {moments} has no separatrix: two are equal")
    middle = sorted(range(3), key=moments.__getitem__)[1]
    x, y, z = (float(i == middle) for i in range(3))
    axis = quaternion.turn(scene.body.axes, (x, y, z))
    return extremum({f"body_velocity_{i}": a for i, a in zip("xyz", axis) if a}, **more)


def _terms(name: str, function: Any) -> Terms:
    if not isinstance(function, Mapping):
        raise TypeError(f"{name} must be a dict like {{'m_x': 1.0, 'apex_z*apex_z': -2.0}}, not {function!r}")
    terms = []
    for key, factor in function.items():
        words = [word.strip() for word in key.split("*")] if isinstance(key, str) else []
        if not 1 <= len(words) <= 2:
            raise ValueError(f"a term of {name} must be a quantity or a product of two, as in 'm_x*m_y', not {key!r}")
        for word in words:
            if word not in _NUMBER:
                raise ValueError(errors.unknown("quantity", word, _NUMBER))
        of, times = sorted((_NUMBER[word] for word in [*words, "1"][:2]), reverse=True)
        terms.append((check.number(f"the factor of {key!r}", factor), of, times))
    return tuple(sorted((term for term in terms if term[0]), key=lambda term: term[1]))


def _event(
    terms: Terms, extremum: bool, direction: Any, where: Function | None, most: Any, terminal: Any
) -> Event:
    if not any(of for _, of, _ in terms):
        raise ValueError("the function is constant, and has no events: give a quantity with a factor other than zero")
    if direction not in (-1, 0, 1):
        raise ValueError(f"direction must be 1, -1 or 0, not {direction!r}")
    if not isinstance(terminal, bool):
        raise TypeError(f"terminal must be True or False, not {terminal!r}")
    limit = None if most is None else check.whole("most", most, 1)
    condition = () if where is None else _terms("where", where)
    if where is not None and not condition:
        raise ValueError("where is zero, and never positive: give a quantity with a factor other than zero")
    return Event(terms, condition, extremum, int(direction), limit, terminal)


def blocks(method: str, events: Any) -> list[Block]:
    """Events as the core takes them; TypeError or ValueError for what it cannot look for."""
    if method != ELSE:
        raise ValueError(f"events need the polynomials of method={ELSE!r}, and {method!r} has none")
    if not isinstance(events, Sequence) or not all(isinstance(event, Event) for event in events):
        raise TypeError(f"events must be a list of what kreisel.events makes, as kr.events.loop(), not {events!r}")
    return [(list(e.terms), list(e.where), e.extremum, e.direction, e.most or 0, e.terminal) for e in events]
