"""The parameters of bodies and scenes, and values of them for one top or for many."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from fractions import Fraction
from typing import Any, Final, NamedTuple, NoReturn

import numpy as np
import numpy.typing as npt

from .._core import INPUT_RTOL
from .._utils import arguments
from .._utils.arguments import Array, Numbers, Vector, as_array, short_repr

Shape = tuple[int, ...]
Index = tuple[int, ...]
Column = npt.NDArray[Any]
Scalars = Numbers | Sequence[Sequence[float]]  # a number or an array of numbers, but not a str
BoolArray = npt.NDArray[np.bool_]
# 2 pi to 75 decimal places
_TURN: Final = Fraction(
    "6.283185307179586476925286766559005768394338798750211641949889184615632812572"
)


class Check(NamedTuple):
    """A condition on the values of a parameter, and what it demands of them."""

    is_met: Callable[[Any], Any]
    text: str


POSITIVE = Check(lambda x: x > 0.0, "must be positive")
NON_NEGATIVE = Check(lambda x: x >= 0.0, "must not be negative")


def _is_symmetric(tensors: Array) -> BoolArray:
    with np.errstate(over="ignore"):
        skew = np.abs(tensors - tensors.swapaxes(-1, -2)).max(axis=(-1, -2))
    symmetric: BoolArray = skew <= INPUT_RTOL * np.abs(tensors).max(axis=(-1, -2))
    return symmetric


def _has_rate(shaking: Array) -> BoolArray:
    amplitude, rate = shaking[..., 0], shaking[..., 1]
    good: BoolArray = (rate >= 0.0) & ((amplitude == 0.0) | (rate > 0.0))
    return good


class Parameter(NamedTuple):
    """A parameter: the shapes that one value can have, its components, and what it must be."""

    unit: str | tuple[str, ...] = ""  # of all components, or of each
    shapes: tuple[Shape, ...] = ((),)
    endings: Sequence[str] = ""  # of the names of its components in tables
    check: Check | None = None
    form: str = "a number"
    why: str = ""  # added to the messages of refusals


def _vector(unit: str, endings: Sequence[str] = "xyz", check: Check | None = None) -> Parameter:
    n = len(endings)
    return Parameter(unit, ((n,),), endings, check, f"{n} numbers")


_TENSOR = Parameter(
    "M L^2",
    ((3, 3), (3,)),
    "012",
    Check(
        _is_symmetric,
        "must be 3 moments or a symmetric 3x3 matrix (three bodies are three matrices by np.diag)",
    ),
    "3 moments or a symmetric 3x3 matrix",
)
_QUATERNION = "SciPy's Rotation.from_matrix(...) is accepted as well"
PARAMETERS: Mapping[str, Parameter] = {
    "mass": Parameter("M", check=POSITIVE),
    "density": Parameter("M L^-3", check=POSITIVE),
    **dict.fromkeys(["inertia", "inertia_about_com"], _TENSOR),
    **dict.fromkeys(["com", "pivot"], _vector("L")),
    "rotor": _vector("M L^2 T^-1"),
    "wheels": Parameter(
        shapes=((3, 5), (2, 5), (1, 5)),
        form="at most 3 rows of 5 numbers (the axis, the rate, the moment)",
    ),
    "inertia_rtol": Parameter(
        check=Check(lambda x: (x >= 0.0) & (x < 1.0), "must be at least 0 and less than 1")
    ),
    **dict.fromkeys(["i1", "i3"], Parameter("M L^2")),
    **dict.fromkeys(["height", "inner"], Parameter("L")),
    **dict.fromkeys(["radius", "outer", "length"], Parameter("L", check=POSITIVE)),
    "half": _vector("L", check=Check(lambda x: (x > 0.0).all(axis=-1), "must be positive")),
    "gravity": Parameter("L T^-2", why="it is the acceleration along -e3, positive is down"),
    "damping": Parameter(
        "M L^2 T^-1",
        ((3,), (1,)),
        "012",
        Check(lambda d: (d >= 0.0).all(axis=-1), "must not be negative"),
        "a number or 3 numbers",
        "it removes energy",
    ),
    "turning": _vector("rad/T"),
    "shaking": Parameter(
        ("L", "rad/T", "rad"),
        ((3,),),
        ("amplitude", "rate", "phase"),
        Check(_has_rate, "needs a positive rate"),
        "three numbers (amplitude, rate, phase)",
        "shaking is (amplitude, rate, phase)",
    ),
    "friction": Parameter("M L^2 T^-2", check=NON_NEGATIVE, why="it removes energy"),
    "gradient": Parameter("T^-2", why="it is 3 mu / R^3 at the distance R from an attracting body"),
    **dict.fromkeys(["momentum", "body_momentum"], _vector("M L^2 T^-1")),
    **dict.fromkeys(["velocity", "body_velocity"], _vector("rad/T")),
    "attitude": Parameter("", ((4,),), "wxyz", form=f"4 numbers (w, x, y, z); {_QUATERNION}"),
    "attitude_xyzw": Parameter("", ((4,),), "xyzw", form="4 numbers (x, y, z, w)"),
    **dict.fromkeys(["spin", "precession"], Parameter("rad/T")),
    "energy": Parameter("M L^2 T^-2"),
    **dict.fromkeys(["vertical", "axial"], Parameter("M L^2 T^-1")),
    "tilt": Parameter("rad"),
    "angles": _vector("rad", "012"),
    "rates": _vector("rad/T", "012"),
}
STARTS = "momentum", "velocity", "body_momentum", "body_velocity"
ENVIRONMENT = "gravity", "damping", "turning", "shaking", "friction", "gradient"
FLAGS = "steady", "fast", "degrees"
_AMOUNT, _ROUNDED = ("mass", "density"), ("inertia_rtol", "unphysical")
# The parameters of the classes and of their constructors, without the body of a scene: those that
# must be given, and the others.
Words = tuple[tuple[str, ...], tuple[str, ...]]
SCENE: Words = (), (*STARTS, "attitude", "attitude_xyzw", *ENVIRONMENT)
SCENES: Mapping[str, Words] = {
    "from_euler": (("angles",), ("rates", "degrees", *ENVIRONMENT)),
    "spinning": ((), ("spin", "tilt", "precession", *FLAGS, *ENVIRONMENT)),
    "from_integrals": (
        ("energy", "vertical", "axial"),
        ("lower", "gravity", "damping", "friction"),
    ),
}
BODY: Words = ("mass",), ("inertia", "com", "rotor", "wheels", "inertia_about_com", *_ROUNDED)
WHEEL: Words = ("inertia", "axis", "rate"), ()
BODIES: Mapping[str, Words] = {
    "symmetric": (("mass", "i1", "i3", "height"), _ROUNDED),
    "from_com": (("mass", "inertia_about_com", "com", "pivot"), _ROUNDED),
    "cuboid": (("half", "pivot"), _AMOUNT),
    "cylinder": (("radius", "height", "pivot"), _AMOUNT),
    "tube": (("inner", "outer", "height", "pivot"), _AMOUNT),
    "disk": (("radius", "pivot", "mass"), ()),
    "rod": (("length", "pivot", "mass"), ()),
    "sphere": (("radius", "pivot"), (*_AMOUNT, "shell")),
    "ellipsoid": (("half", "pivot"), _AMOUNT),
    "cone": (("radius", "height", "pivot"), _AMOUNT),
    "from_profile": (("profile", "pivot"), _AMOUNT),
    "from_mesh": (("mesh", "pivot"), (*_AMOUNT, "scale")),
    "from_model": (("path",), ("name", "pivot")),
}


class BatchParameter(NamedTuple):
    """A named parameter and its values."""

    name: str
    values: Array  # (*shape, *value)
    value: Shape  # shape of one value
    degrees: bool = False  # True if angles and rates are in degrees

    @property
    def radians(self) -> Array:
        """The values, with angles and rates in radians."""
        unit = PARAMETERS[self.name].unit
        if not self.degrees:
            return self.values
        if isinstance(unit, str):
            is_angular = arguments.is_angular(unit)
            return self.values * arguments.RADIANS_PER_DEGREE if is_angular else self.values
        factors = [
            arguments.RADIANS_PER_DEGREE if arguments.is_angular(one) else 1.0 for one in unit
        ]
        return np.asarray(self.values * np.array(factors))

    @property
    def shape(self) -> Shape:
        """The shape of the batch: the shape of `values` without the dimensions of one value."""
        return self.values.shape[: self.values.ndim - len(self.value)]


def get_parameter_unit(name: str, degrees: bool, component: int | None = None) -> str:
    """Return the unit of a parameter or of a component of it, in degrees or in radians."""
    unit = PARAMETERS[name].unit if name in PARAMETERS else ""
    if not isinstance(unit, str):
        unit = ", ".join(unit) if component is None else unit[component]
    return arguments.get_angular_unit(unit, degrees)


def read_parameter(
    name: str, given: object, *, degrees: bool = False, check: Check | None = None
) -> BatchParameter:
    """Return the values of a parameter, for one top or for many.

    Raises TypeError if they are not numbers, and ValueError for the first value that is not finite,
    has another shape than the parameter, or fails its check (or `check` instead).
    """
    parameter = PARAMETERS[name]
    chosen = check or parameter.check
    if parameter.shapes == ((),) and (
        (type(given) is float and math.isfinite(given))
        or (type(given) is int and abs(given) < 2**63)
    ):
        plain = float(given)
        if chosen is None or chosen.is_met(plain):
            return BatchParameter(name, np.array(plain), (), degrees)
    hint = f": {parameter.why}" if parameter.why else ""
    if isinstance(given, BatchParameter):
        found, given = given, given.values
    else:
        shared = collapse_broadcast_axes(given) if type(given) is np.ndarray else given
        try:
            small = as_array(name, shared, parameter.form)
        except TypeError as error:
            raise TypeError(f"{error}{hint}") from None
        values = np.broadcast_to(small, given.shape) if isinstance(given, np.ndarray) else small
        if name == "damping" and not values.shape:
            values = values[None]
        shapes = [
            one for one in parameter.shapes if values.shape[max(values.ndim - len(one), 0) :] == one
        ]
        if not shapes:
            many = ", or an array whose last dimension has them" if values.ndim > 1 else ""
            raise ValueError(f"{name} must be {parameter.form}{many}, not {short_repr(given)}")
        found = BatchParameter(name, values, shapes[0], degrees)
    shared = collapse_broadcast_axes(found.values, len(found.shape))
    if not np.isfinite(shared).all():
        axes = tuple(range(-len(found.value), 0))
        bad = ~np.isfinite(found.values).all(axis=axes)
        refuse_first(name, given, bad, "must be finite", hint)
    if parameter is _TENSOR and found.value == (3,):
        chosen = None
    if chosen and not chosen.is_met(shared).all():
        refuse_first(name, given, ~chosen.is_met(found.values), chosen.text, hint)
    return found


def get_member(given: object, index: Index) -> Any:
    """Return the value at an index of what the user gave, as Python numbers."""
    if not index and not isinstance(given, np.ndarray):
        return given
    value = np.asarray(given)[index].tolist()
    return tuple(value) if isinstance(value, list) else value


def refuse_first(name: str, given: object, bad: Any, text: str, hint: str = "") -> NoReturn:
    """Raise ValueError for the first value marked in `bad`."""
    index = tuple(map(int, np.unravel_index(int(np.argmax(bad)), np.shape(bad))))
    value = short_repr(get_member(given, index))
    place = f"{name}{list(index)} = {value}: " if index else ""
    raise ValueError(f"{place}{name} {text}, not {value}{hint}")


def collapse_broadcast_axes(values: Column, lead: int | None = None) -> Column:
    """Reduce broadcast dimensions, in which the stride is zero, to length 1.

    If `lead` is given, only broadcast dimensions among the first `lead` ones are reduced.
    """
    strides = values.strides[:lead]
    if 0 not in strides or not values.size:
        return values
    return values[tuple([slice(0, 1) if stride == 0 else slice(None) for stride in strides])]


def resolve_gravity(gravity: Any, body: Any) -> Any:
    """Return `gravity`, or 0 if it is None and each centre of mass is at the fixed point."""
    is_vector = isinstance(gravity, tuple | list) and len(gravity) == 3
    if is_vector and all(isinstance(x, float | int) for x in gravity) and not any(gravity[:2]):
        raise TypeError(
            f"gravity must be a number, not {short_repr(gravity)}: {PARAMETERS['gravity'].why}"
        )
    if gravity is not None:
        return gravity
    if np.any(body.com):
        raise TypeError(
            "gravity is required unless the centre of mass is at the fixed point: 9.81 in SI "
            "units, 1 in units in which gravity is 1, 0 for a top without weight"
        )
    return 0.0


def read_environment(
    body: Any, around: Sequence[object], degrees: bool = False
) -> dict[str, BatchParameter]:
    """Return the gravity and the given ones of the other parameters in ENVIRONMENT."""
    words = dict(zip(ENVIRONMENT, (resolve_gravity(around[0], body), *around[1:]), strict=True))
    return {
        name: read_parameter(name, value, degrees=degrees)
        for name, value in words.items()
        if value is not None
    }


def advance_shaking_phase(shaking: Vector, t: float) -> Vector:
    """Return `shaking` with the phase at the time `t`, computed in rational numbers."""
    amplitude, rate, phase = shaking
    if not amplitude or not t:
        return shaking
    angle = Fraction(phase) + Fraction(rate) * Fraction(t)
    return amplitude, rate, float(angle - round(angle / _TURN) * _TURN)


def list_disturbances(tops: Any) -> list[str]:
    """List the disturbances of a scene, such as damping or a moving support."""
    shaking = tops.shaking
    amplitudes = shaking[0] if type(shaking) is tuple else np.asarray(shaking)[..., 0]
    disturbances = {
        "damping": has_nonzero_element(tops.damping),
        "friction": has_nonzero_element(tops.friction),
        "a shaken support": has_nonzero_element(amplitudes),
        "a turning support": has_nonzero_element(tops.turning),
        "a gravity gradient": has_nonzero_element(tops.gradient),
    }
    return [name for name, is_there in disturbances.items() if is_there]


def has_nonzero_element(values: Any) -> bool:
    """Return True if a number, tuple or array has a nonzero element."""
    if type(values) is tuple:
        return any(values)
    return values != 0.0 if type(values) is float else bool(np.any(values))


def has_equivalent_support_at_rest(tops: Any) -> bool:
    """Return True if the motion is that of tops on a support at rest, seen from a turning one."""
    is_only_turning = list_disturbances(tops) == ["a turning support"]
    return is_only_turning and not np.any(np.asarray(tops.turning)[..., :2])


def refuse_disturbances(
    tops: Any, statement: str, exceptions: Iterable[str] = (), reason: str = ""
) -> None:
    """Raise ValueError if a scene has disturbances other than those in `exceptions`.

    The message is `statement`, their names, and `reason` or a hint at the inertial frame.
    """
    disturbances = [name for name in list_disturbances(tops) if name not in exceptions]
    if not disturbances:
        return
    if has_equivalent_support_at_rest(tops):
        reason = "replace(turning=None) gives the same motion, seen from the inertial frame"
    raise ValueError(
        f"{statement} with {' and '.join(disturbances)}{': ' if reason else ''}{reason}"
    )
