"""Events: the times at which a function of the state crosses zero or has an extremum.

    events = [kr.events.nutation(), kr.events.plane((0, 1, 0), direction=1)]
    path = kr.solve(scene, t=300, events=events)
    path.events.t, path.events.which, path.events.direction, path.events.path.apex

    first_low = kr.events.nutation(direction=1, terminal=True)
    half = kr.solve(scene, t=300, events=[first_low]).t[-1]

A function is a sum of terms, factor * component or factor * component * component, in the units of
the scene. kreisel.events.components contains the names of all components, where "1" is the name of
the constant 1. help(kreisel.Path) describes the quantities to which the components belong:

    {"m_x": 2.0, "apex_z*apex_z": 1.0, "1": -0.5}       2 m_x + apex_z^2 - 0.5
    "body_velocity_y"                                   this component alone

Events of general Python functions f cannot be located: the method requires polynomials. Changes of
sign at closely spaced states of a path, np.where(np.diff(np.sign(f(path)))), can miss events.

Within each step of method='taylor', the event function is a polynomial in time. Events are the sign
changes of a polynomial or, for an extremum, of its derivative. The search finds every event within
a step, and does not change the states of the path. The initial state does not count as an event,
nor do points at which a function touches zero without changing sign. An event function is
considered zero if its absolute value is below 2^-50 times a bound on the magnitude of its terms.

The times of events are as accurate as the path itself. Event times are stored as doubles, even if
the path has more digits. Rising and falling refer to increasing time, even if the path runs
backwards in time.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, dataclass
from typing import Any, TypedDict, Unpack

import numpy as np
from numpy.typing import ArrayLike

from ._core import components, quantities, terms_value
from ._model.parameters import refuse_disturbances
from ._model.scene import Scene, validate_one_top
from ._utils import arguments
from ._utils.arguments import Array, short_repr, unknown_name_message
from .quaternion import turn

__all__ = [
    "Event",
    "components",
    "crossing",
    "cusp",
    "extremum",
    "kinetic",
    "loop",
    "nutation",
    "plane",
    "separatrix",
    "stopped",
    "wheel_rate",
]


def __dir__() -> list[str]:
    """List the public names."""
    return sorted(__all__)


Function = Mapping[str, float] | str
Terms = tuple[tuple[float, int, int], ...]
CoreEvent = tuple[list[tuple[float, int, int]], list[tuple[float, int, int]], bool, int, int, bool]
_NAMES = {component: name for name, component in components.items()}


class _Count(TypedDict, total=False):
    direction: int
    max_count: int | None
    terminal: bool


class _More(_Count, total=False):
    where: Function | None


_CONTROLS = "extremum", "direction", "max_count", "terminal"
_VECTORS = [row["name"] for row in quantities if row["in_events"] and row["doubles"] == 3]
_PRECESSION = {f"body_vertical_{i}*body_velocity_{i}": 1.0 for i in "xyz"} | {"apex_z*spin": -1.0}
_SPEED = {f"body_velocity_{i}*body_velocity_{i}": 1.0 for i in "xyz"}


@dataclass(frozen=True)
class Event:
    """A description of events, created by the functions of this module.

    terms      terms (factor, index, index) of the function g, with the indices of components
    where      terms of a function that must be positive at the event; empty for no condition
    extremum   False: g crosses zero; True: g has an extremum
    direction  1: g rises, or has a minimum; -1: g falls, or has a maximum; 0: either
    max_count  largest number of events to record; None for no limit
    terminal   True: the path ends at the event, or at event number `max_count` if that is given
    """

    terms: Terms
    where: Terms = ()
    extremum: bool = False
    direction: int = 0
    max_count: int | None = None
    terminal: bool = False

    def __post_init__(self) -> None:
        if not any(first for _, first, _ in self.terms):
            raise ValueError("the function is constant and has no events: give a nonzero factor")
        if self.direction not in (-1, 0, 1):
            raise ValueError(f"direction must be 1, -1 or 0, not {short_repr(self.direction)}")
        for name in ("extremum", "terminal"):
            self.__dict__[name] = arguments.as_bool(name, getattr(self, name))
        self.__dict__["direction"] = int(self.direction)
        if self.max_count is not None:
            self.__dict__["max_count"] = arguments.as_int("max_count", self.max_count, 1)

    def value(self, path: Any) -> Array:
        """Return the values of the event function at all states of a kreisel.Path."""
        if not isinstance(getattr(path, "scene", None), Scene):
            raise TypeError(f"path must be a kreisel.Path, not {short_repr(path)}")
        if path.shape:
            values: Array = path._compute_per_state(self.value)
            return values
        return terms_value(path.scene._block, path.states, list(self.terms))

    @property
    def _core_arguments(self) -> CoreEvent:
        terms, where = list(self.terms), list(self.where)
        return terms, where, self.extremum, self.direction, self.max_count or 0, self.terminal

    def _to_json(self) -> dict[str, Any]:
        """Return JSON data with names of components, whose indices depend on the build."""
        rows = {"terms": self.terms, "where": self.where}
        return asdict(self) | {
            name: [(float(factor), _NAMES[one], _NAMES[other]) for factor, one, other in terms]
            for name, terms in rows.items()
        }

    @classmethod
    def _from_json(cls, row: Mapping[str, Any]) -> Event:
        """Return the event of JSON data. Raises KeyError, TypeError or ValueError if invalid."""
        words: dict[str, Any] = {name: row[name] for name in _CONTROLS}
        for name in ("terms", "where"):
            terms = [(arguments.as_float("a factor", f), a, b) for f, a, b in row[name]]
            words[name] = tuple((f, components[a], components[b]) for f, a, b in terms)
        return cls(**words)


def crossing(function: Function, value: float = 0.0, **more: Unpack[_More]) -> Event:
    """Find the times at which a function crosses a given value.

    `value` has the units of the function. `direction`, `max_count` and `terminal` are described in
    kreisel.events.Event. A crossing is an event only if the function `where` is positive there.
    Raises TypeError or ValueError if a function is invalid, or if `function` is constant.
    """
    level = arguments.as_float("value", value)
    terms = _validate_terms("function", function) + (((-level, 0, 0),) if level else ())
    return _make_event(terms, False, **more)


def extremum(function: Function, **more: Unpack[_More]) -> Event:
    """Find local minima (direction 1) or local maxima (direction -1) of a function.

    The other arguments are the same as for kreisel.events.crossing.
    """
    return _make_event(_validate_terms("function", function), True, **more)


def _make_event(
    terms: Terms,
    extremum: bool,
    *,
    direction: int = 0,
    where: Function | None = None,
    max_count: int | None = None,
    terminal: bool = False,
) -> Event:
    condition = () if where is None else _validate_terms("where", where)
    if where is not None and not condition:
        raise ValueError("where is zero and never positive: give a nonzero factor")
    return Event(terms, condition, extremum, direction, max_count, terminal)


def plane(normal: ArrayLike, offset: float = 0.0, of: str = "apex", **more: Unpack[_More]) -> Event:
    """Find the points of a Poincaré section, where a motion crosses the plane <normal, v> = offset.

    `of` is the name of the vector v: 'apex', 'm', 'body_vertical', 'body_velocity' or
    'body_momentum', in the units of which `offset` is given. The other arguments are the same as
    for kreisel.events.crossing.
    """
    if of not in _VECTORS:
        raise ValueError(unknown_name_message("vector", str(of), _VECTORS))
    pairs = zip("xyz", arguments.as_three_floats("normal", normal), strict=True)
    level = arguments.as_float("offset", offset)
    return crossing({f"{of}_{i}": n for i, n in pairs if n}, level, **more)


def nutation(**more: Unpack[_More]) -> Event:
    """Find the lowest (direction 1) or the highest (direction -1) points on the path of the apex.

    The other arguments are the same as for kreisel.events.extremum.
    """
    return extremum({"apex_z": 1.0}, **more)


def loop(**more: Unpack[_More]) -> Event:
    """Find the points at which the apex reverses its precession about the vertical.

    A trace with loops has two reversals per loop, whereas a wavy trace has none. At a cusp, where
    the precession rate touches zero, small errors in the path may cause a small loop or none. The
    arguments are the same as for kreisel.events.crossing.
    """
    return crossing(_PRECESSION, **more)


def cusp(within: float = 1e-6, **more: Unpack[_Count]) -> Event:
    """Find the points at which the apex comes to rest and reverses its direction.

    A cusp is a highest or lowest point of the apex trace at which the angular speed of the apex is
    less than `within` times that of the body. `within` must be at least 1e-7, because rounding
    errors dominate for smaller values. The other arguments are the same as for
    kreisel.events.extremum, but without `where`.
    """
    if arguments.as_float("within", within) < 1e-7:
        raise ValueError(
            f"within must be at least 1e-7, the effect of rounding, not {short_repr(within)}"
        )
    terms = {name: factor * (within * within - 1.0) for name, factor in _SPEED.items()}
    return extremum({"apex_z": 1.0}, where=terms | {"spin*spin": 1.0}, **more)


_KINETIC = [f"body_momentum_{i}*body_velocity_{i}" for i in "xyz"]


def kinetic(value: float, *, rotor: ArrayLike = (0.0, 0.0, 0.0), **more: Unpack[_More]) -> Event:
    """Find where the kinetic energy crosses a value [M L^2 T^-2].

    For a body with a rotor, give its momentum `body.rotor` as `rotor` [M L^2 T^-1]. The other
    arguments are the same as for kreisel.events.crossing.
    """
    terms = dict.fromkeys(_KINETIC, 0.5)
    linear = zip("xyz", arguments.as_three_floats("rotor", rotor), strict=True)
    return crossing(terms | {f"body_velocity_{i}": -0.5 * h for i, h in linear if h}, value, **more)


def refuse_kinetic(tops: Scene, events: Iterable[Event]) -> None:
    """Raise ValueError if a kinetic-energy event cannot be used for the given tops.

    The event must take the rotor of the body into account, and the support must not turn.
    """
    has_any: Callable[..., Any] = np.any if tops.shape else any
    is_turning, has_rotor = has_any(tops.turning), has_any(tops.body.rotor)
    if not (is_turning or has_rotor):
        return
    half = set(_validate_terms("function", dict.fromkeys(_KINETIC, 0.5)))
    kinetics = [e for e in events if half == {term for term in e.terms if term[1] and term[2]}]
    if kinetics and is_turning:
        raise ValueError("kinetic does not support turning supports")
    has_linear_terms = [any(i and not j for _, i, j in event.terms) for event in kinetics]
    if has_rotor and not all(has_linear_terms):
        raise ValueError(
            "kinetic needs the rotor of this body: kreisel.events.kinetic(value, rotor=body.rotor)"
        )


def stopped(**more: Unpack[_More]) -> Event:
    """Find the times at which the spin vanishes, for example because dry friction stops it.

    The spin is the angular velocity about the apex. Unless friction stops the top, the events are
    instants at which the spin changes its sign. If friction later lets a stopped top slide again,
    this is not an event. The arguments are the same as for kreisel.events.crossing.

        >>> import kreisel as kr
        >>> body = kr.Body.cone(radius=1, height=2, pivot=(0, 0, 0), mass=1)
        >>> top = kr.Scene.spinning(body, spin=6, tilt=2, friction=0.1, gravity=1)
        >>> end = kr.solve(top, 100, events=kr.events.stopped(terminal=True))
        >>> round(float(end.t[-1]), 9) == round(6 * body.moments[2] / 0.1, 9)
        True
    """
    return crossing("spin", **more)


def wheel_rate(scene: Scene, value: float = 0.0, *, index: int = 0, **more: Unpack[_More]) -> Event:
    """Find the times at which the rate of a wheel on a free axle crosses a value [rad/T].

    scene  the top with the wheel, whose start determines the momentum of the wheel
    index  0, 1 or 2: the wheel, in the order in which the body got them

    The other arguments are the same as for kreisel.events.crossing. Raises ValueError if the body
    has no such wheel, or if the rate of this one is constant.

        >>> import kreisel as kr
        >>> frame = kr.Body(1, (0.4, 0.5, 0.3), (0, 0, 0.2))
        >>> body = frame.with_wheel(inertia=0.1, axis=(1, 0, 0), rate=2)
        >>> top = kr.Scene(body, momentum=(0.3, 0.2, 0.4), gravity=1)
        >>> found = kr.solve(top, 20, events=kr.events.wheel_rate(top, 2.5)).events
        >>> [round(float(rate), 9) for rate in found.wheel_rate[:2]]
        [2.5, 2.5]
    """
    validate_one_top("scene", scene)
    wheels = scene.body._used_wheels
    if arguments.as_int("index", index, 0) >= len(wheels):
        raise ValueError(f"index = {index}: the body has {len(wheels)} wheels on free axles")
    *axis, rate, _ = wheels[index]
    if not any(axis):
        raise ValueError("the rate of this wheel is constant: nothing but it turns about its axle")
    terms = {f"inertial_velocity_{i}": -a for i, a in zip("xyz", axis, strict=True) if a}
    return crossing(terms | {"1": rate}, value, **more)


def separatrix(scene: Scene, **more: Unpack[_More]) -> Event:
    """Find the points at which a top is closest to its unstable equilibrium.

    Motions on both sides of the separatrix are slow near the unstable equilibrium, and the states
    at the events show how close they are to it. Under gravity, the events are the maxima of the
    potential energy. Without torque, they are extrema of the angular velocity about the
    intermediate principal axis.

    The other arguments are the same as for kreisel.events.extremum; under gravity, `direction`
    raises TypeError. Raises ValueError for a moving support, and for a torque-free body that has
    two equal moments, and thus no separatrix, or a rotor.
    """
    validate_one_top("scene", scene)
    if scene._is_shaken or any(scene.turning):
        hint = "find the highest points of the apex by kr.events.nutation()"
        why = "the unstable equilibrium is not known for tops"
        refuse_disturbances(scene, why, ("damping", "friction"), hint)
    if scene.gravity and any(scene.body.com):
        if "direction" in more:
            raise TypeError("under gravity a separatrix has its own direction: leave direction out")
        more["direction"] = -1 if scene.gravity > 0.0 else 1
        return nutation(**more)
    moments = scene.body.moments
    if any(scene.body.rotor):
        raise ValueError(
            "the unstable rotation of a body with a rotor is about no principal axis: describe the "
            "event by kreisel.events.extremum"
        )
    if len(set(moments)) < 3:
        raise ValueError(
            f"a body without torque whose moments are {moments} has no separatrix: two are equal"
        )
    middle = sorted(range(3), key=moments.__getitem__)[1]
    x, y, z = (float(i == middle) for i in range(3))
    pairs = zip("xyz", turn(scene.body.axes, (x, y, z)), strict=True)
    return extremum({f"body_velocity_{i}": a for i, a in pairs if a}, **more)


def _validate_terms(name: str, function: object) -> Terms:
    """Validate a polynomial event function, and return the terms of the polynomial."""
    factors = {function: 1.0} if isinstance(function, str) else function
    if callable(function):
        raise TypeError(
            f"{name} must be a sum of components, as {{'m_x': 1.0, 'apex_z*apex_z': -2.0}}: the "
            f"polynomial of {short_repr(function)} cannot be computed"
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
        first, second = sorted((_component(word) for word in [*words, "1"][:2]), reverse=True)
        terms.append((arguments.as_float(f"the factor of {key!r}", factor), first, second))
    return tuple(sorted((term for term in terms if term[0]), key=lambda term: term[1]))


_INSTEAD = {
    "kinetic": "use kreisel.events.kinetic",
    "nutation": "use 'apex_z', which is its cosine",
    "potential": "use 'apex_z', to which it is proportional on a support at rest",
    "velocity": "use components of 'body_velocity', such as 'body_velocity_y', which are given "
    "in the body frame",
}


def _component(word: str) -> int:
    """Return the index of a component. Raises ValueError if it is unknown or has no series."""
    if word in components:
        return components[word]
    row = next((row for row in quantities if word in (row["name"], *row["components"])), None)
    if row is None:
        raise ValueError(unknown_name_message("quantity", word, [*components, "nutation"]))
    name = row["name"]
    if row["in_events"]:
        *most, last = map(repr, row["components"])
        raise ValueError(f"{name!r} has several components: {', '.join(most)} and {last}")
    names = ", ".join(row["name"] for row in quantities if row["in_events"])
    hint = _INSTEAD.get(name, f"these have: {names}")
    raise ValueError(f"events have no series of {name!r}, {row['text']}; {hint}")


MAKERS: dict[str, Callable[..., Event]] = {  # by their names in commands and files
    name: globals()[name] for name in __all__ if name.islower() and callable(globals()[name])
}
