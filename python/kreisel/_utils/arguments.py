"""Checks of arguments, units of angles, and the messages of refusals with hints of names."""

from __future__ import annotations

import contextlib
import math
import re
import reprlib
import sys
import warnings
from collections.abc import Callable, Container, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import FrozenInstanceError
from functools import update_wrapper
from importlib import import_module
from inspect import Parameter, getattr_static, isfunction, signature
from numbers import Integral, Real
from types import MappingProxyType, ModuleType
from typing import TYPE_CHECKING, Any, NoReturn, Protocol, TypedDict, TypeVar

import numpy as np
import numpy.typing as npt

from .._core import statuses


def format_count(number: int, noun: str) -> str:
    """Return a number and its noun in the singular or plural, such as '1 step' or '2 steps'."""
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"


Array = npt.NDArray[np.float64]
Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]


class SupportsArray(Protocol):
    """An object that NumPy can convert to an array."""

    def __array__(self) -> npt.NDArray[np.generic]: ...


# a number or a sequence of numbers, not a str
Numbers = float | SupportsArray | Sequence[float] | Sequence[SupportsArray]
R = TypeVar("R", float, Array)  # a float, or an array of values
_PLAIN = {float, int, np.float64}
_T = TypeVar("_T")
_SHORT = reprlib.Repr()
_SHORT.maxlevel, _SHORT.maxstring, _SHORT.maxother = 2, 60, 80


def short_repr(value: object) -> str:
    """Return a short representation of a value for error messages."""
    if isinstance(value, np.ndarray) and value.size > 4:
        return f"an array of shape {value.shape}"
    try:
        return " ".join(_SHORT.repr(value).split())
    except ValueError:  # Python limits the digits of an int in a str
        return f"{type(value).__name__} with too many digits"


_spellings: ContextVar[Mapping[str, str]] = ContextVar("spellings", default=MappingProxyType({}))


@contextmanager
def spell_as_options(options: Mapping[str, str]) -> Iterator[None]:
    """Return a context manager in which messages name the options of a command, not arguments."""
    token = _spellings.set({**_spellings.get(), **options})
    try:
        yield
    finally:
        _spellings.reset(token)


def spell(name: str, value: object = None) -> str:
    """Return an argument, perhaps with a value, as the user writes it: step=0.1 or --step 0.1."""
    option = _spellings.get().get(name)
    if value is None:
        return option or name
    return f"{option} {value}" if option else f"{name}={value!r}"


def validate_type(name: str, value: object, expected: type[_T]) -> _T:
    """Return `value` if it is an instance of `expected`; raise TypeError otherwise."""
    if not isinstance(value, expected):
        kind = f"a kreisel.{expected.__name__}"
        raise TypeError(f"{spell(name)} must be {kind}, not {short_repr(value)}")
    return value


def has_unit_attribute(value: object) -> bool:
    return hasattr(value, "unit") or hasattr(value, "units")


def as_float(name: str, value: object) -> float:
    if has_unit_attribute(value):
        raise TypeError(f"{spell(name)} must be a number without a unit, not {short_repr(value)}")
    scalar = value[()] if isinstance(value, np.ndarray) and value.ndim == 0 else value
    if isinstance(scalar, bool) or not isinstance(scalar, Real):
        raise TypeError(f"{spell(name)} must be a number, not {short_repr(value)}")
    try:
        real = float(scalar)
    except OverflowError:
        real = math.inf
    if not math.isfinite(real):
        raise ValueError(f"{spell(name)} must be finite in doubles, not {short_repr(value)}")
    return real


def as_positive(name: str, value: object) -> float:
    real = as_float(name, value)
    if not real > 0.0:
        raise ValueError(f"{spell(name)} must be positive, not {short_repr(value)}")
    return real


def as_int(name: str, value: object, least: int) -> int:
    """Return `value` as an integer n with least <= n < 2**63."""
    if isinstance(value, bool) or not isinstance(value, Integral):
        raise TypeError(f"{spell(name)} must be a whole number, not {short_repr(value)}")
    n = int(value)
    if not least <= n < 2**63:
        raise ValueError(
            f"{spell(name)} must be at least {least} and less than 2**63, not {short_repr(value)}"
        )
    return n


def as_bool(name: str, value: object) -> bool:
    """Return `value` as a bool; raise TypeError if it is neither True nor False."""
    if not isinstance(value, bool | np.bool_):
        raise TypeError(f"{spell(name)} must be True or False, not {short_repr(value)}")
    return bool(value)


def as_unit_name(name: str, value: object) -> str:
    """Return `value` as the name of a unit, which must be a nonempty, printable str."""
    if isinstance(value, str) and value.strip() and value.isprintable():
        return value
    kind = ValueError if isinstance(value, str) else TypeError
    raise kind(f"{spell(name)} must be the name of a unit such as 's', not {short_repr(value)}")


def as_array(name: str, value: object, description: str) -> Array:
    """Convert `value`, which errors describe by `description`, to a new array of doubles."""
    # No array is masked unless numpy.ma is loaded; importing it only for this check is slow.
    if "numpy.ma" in sys.modules and np.ma.is_masked(value):
        raise TypeError(f"{spell(name)} must be {description} without masked values")
    kinds = set(map(type, value)) if isinstance(value, (list, tuple)) else set()
    if any(map(has_unit_attribute, (value, *kinds))):
        raise TypeError(
            f"{spell(name)} must be {description} without a unit: pass plain numbers in your units"
        )
    try:
        numbers = np.asarray(value)
    except ValueError:
        raise ValueError(f"{spell(name)} must be {description}, not {short_repr(value)}") from None
    if numbers.dtype.kind not in "iuf":
        raise TypeError(f"{spell(name)} must be {description}, not {short_repr(value)}")
    with np.errstate(over="ignore"):
        return numbers.astype(np.float64)


def as_finite_array(name: str, value: object, description: str) -> Array:
    numbers = as_array(name, value, description)
    if not np.isfinite(numbers).all():
        if numbers.ndim == 0:
            raise ValueError(f"{spell(name)} must be finite, not {short_repr(value)}")
        index = tuple(map(int, np.argwhere(~np.isfinite(numbers))[0]))
        suffix = "".join(f"[{i}]" for i in index)
        raise ValueError(f"{spell(name)} must be finite, not {name}{suffix} = {numbers[index]}")
    return numbers


def as_float_list(name: str, value: object, n: int, description: str) -> list[float]:
    """Return `value` as a list of exactly `n` finite floats."""
    if (type(value) is tuple or type(value) is list) and _PLAIN.issuperset(map(type, value)):
        with contextlib.suppress(OverflowError):  # the common case: this is ten times as fast
            plain = [float(x) for x in value]
            if len(plain) == n and all(map(math.isfinite, plain)):
                return plain
    numbers = as_finite_array(name, value, description)
    if numbers.shape != (n,):
        raise ValueError(f"{spell(name)} must be {description}, not {short_repr(value)}")
    return [float(x) for x in numbers]


def as_three_floats(name: str, value: object) -> Vector:
    x, y, z = as_float_list(name, value, 3, "3 numbers")
    return x, y, z


def freeze_array(values: Array) -> Array:
    """Make the array `values` read-only, and return it."""
    values.flags.writeable = False
    return values


def freeze_arrays(value: object) -> None:
    """Make all arrays in `value` read-only, including those in tuples, lists and dictionaries."""
    if isinstance(value, np.ndarray):
        value.flags.writeable = False
    elif isinstance(value, (tuple, list)):
        for part in value:
            freeze_arrays(part)
    elif isinstance(value, dict):
        for part in value.values():
            freeze_arrays(part)


class ReadOnlyArrays:
    """Base class that keeps the arrays of copied and unpickled objects read-only."""

    def __setstate__(self, state: dict[str, object]) -> None:
        self.__dict__.update(state)
        freeze_arrays(state)


class ShapedBase(ReadOnlyArrays):
    """Base class of what describes one top, with the shape (), or an array of tops."""

    @property
    def shape(self) -> tuple[int, ...]:
        """The shape of the array of tops; () for one top."""
        raise NotImplementedError

    @property
    def ndim(self) -> int:
        """The number of dimensions of the shape; 0 for one top."""
        return len(self.shape)

    @property
    def size(self) -> int:
        """The number of members; 1 for one top."""
        return math.prod(self.shape)

    def __bool__(self) -> bool:
        return self.size > 0


@contextmanager
def optional_dependency(requirement: str) -> Iterator[None]:
    """Return a context manager that adds an installation hint to the error for a missing module."""
    try:
        yield
    except ModuleNotFoundError as error:
        raise ModuleNotFoundError(
            f"this needs {error.name}, which is not installed: pip install {requirement}",
            name=error.name,
        ) from None


_Class = TypeVar("_Class")
_SKIPPED_PACKAGES = {
    __package__.partition(".")[0],
    "dataclasses",
}  # warnings point at the nearest caller outside these packages


def make_exception_from_status(status: str, detail: str) -> Exception:
    kind, text = statuses[status]
    return (MemoryError if kind == "MEMORY" else ValueError)(f"{text}: {detail}")


_MAX_LENGTH = 100  # characters of an unknown name that are compared with the known names
_SYNONYMS = {  # words of textbooks and of other packages
    "angular_momentum": "m",
    "angular_velocity": "velocity",
    "attitude": "q",
    "box": "cuboid",
    "integrate": "solve",
    "kovalevskaya": "kowalewski",
    "omega": "velocity",
    "orientation": "q",
    "phi": "precession_angle",
    "psi": "spin_angle",
    "quaternion": "q",
    "simulate": "solve",
    "theta": "nutation",
    "times": "t",
    "to_dataframe": "to_pandas",
}


def unknown_name_message(kind: str, name: str, candidates: Iterable[str]) -> str:
    """Return an error message that reports an unknown name and suggests the nearest known one."""
    return f"unknown {kind} {short_repr(name)}; {suggest_name(name, candidates)}"


def suggest_name(name: str, candidates: Iterable[str]) -> str:
    """Return a suggestion of the known name nearest to `name`, or the list of all known names."""
    import difflib  # imported here because most programs never need it

    names = list(candidates)
    whole = name.lower().replace("-", "_")
    word, _, axis = whole.partition("_")
    word = _SYNONYMS.get(whole) or "_".join(filter(None, (_SYNONYMS.get(word, word), axis)))
    matches = difflib.get_close_matches(word[:_MAX_LENGTH], names, n=1)
    return f"did you mean {matches[0]!r}?" if matches else "known are " + ", ".join(names)


def make_frozen_class_decorator(advice: str) -> Callable[[type[_Class]], type[_Class]]:
    """Return a decorator for classes without assignments; {} in `advice` is an attribute's name."""

    def refuse_all_assignments(cls: type[_Class]) -> type[_Class]:
        def refuse_assignment(_: object, name: str, __: object) -> None:
            raise FrozenInstanceError(f"cannot assign to field {name!r}: {advice.format(name)}")

        type.__setattr__(cls, "__setattr__", refuse_assignment)
        return cls

    return refuse_all_assignments


def warn_user(message: str) -> None:
    """Issue a UserWarning that refers to the user's line of code, however deep the call stack."""
    level, frame = 2, sys._getframe(1)
    while (
        frame.f_back and frame.f_globals.get("__name__", "").partition(".")[0] in _SKIPPED_PACKAGES
    ):
        level, frame = level + 1, frame.f_back
    warnings.warn(message, stacklevel=level)


RADIANS_PER_DEGREE = math.pi / 180.0
_ANGULAR = re.compile(r"(rad|deg|°)(?:ians?|rees?)?\s*(.*)")  # the unit of an angle, and the rest
_HEAD = re.compile(r"(.*\S)\s*\[([^\[\]]*)\]")  # the name and the unit in the head of a column


def is_angular(unit: str) -> bool:
    return unit.startswith("rad")


def get_angular_unit(unit: str, degrees: bool) -> str:
    return unit.replace("rad", "deg") if degrees else unit


def find_unit_of_angles(columns: Iterable[tuple[str, str, str]], degrees: bool | None) -> bool:
    """Return True if the angles and rates of a table are in degrees.

    `columns` has the name of each column, the unit that its head states, and the unit of the
    quantity that it contains. If no head states a unit, `degrees` decides. Raises ValueError if
    heads contradict each other, `degrees` or a quantity.
    """
    if degrees is not None:
        as_bool("degrees", degrees)
    stated: dict[bool, str] = {}

    def find_order(match: re.Match[str] | None) -> int | None:
        """Return the order of the derivative of an angle that has this unit."""
        return match and (0 if not match[2] else 2 if re.search("[2²]", match[2]) else 1)

    for name, unit, expected in columns:
        match = _ANGULAR.fullmatch(unit)
        if match is None and (not is_angular(expected) or len(unit) < 2):
            continue  # as body_velocity [x]
        if match is None or find_order(match) != find_order(_ANGULAR.fullmatch(expected)):
            right = f"{expected} or {get_angular_unit(expected, True)}" if expected else "no unit"
            raise ValueError(f"the column {name!r} is in {unit}, but it must be in {right}")
        stated[match[1] != "rad"] = name
    if len(stated) == 2:
        raise ValueError(
            f"the column {stated[False]!r} is in radians, but {stated[True]!r} is in degrees"
        )
    if stated and degrees not in (None, *stated):
        given = "degrees" if degrees else "radians"
        raise ValueError(
            f"{spell('degrees')} contradicts the column {stated[not degrees]!r}, whose head says "
            f"that it is not in {given}"
        )
    return bool(degrees) if not stated else True in stated


def split_column_head(head: str) -> tuple[str, str]:
    """Return the name and the unit in the head of a column, or an empty string without a unit."""
    match = _HEAD.fullmatch(head.strip())
    return (match[1], match[2].strip()) if match else (head.strip(), "")


_F = TypeVar("_F", bound=Callable[..., Any])
_TIMES = "t gives the times of the states: a number for the start and the end, or a list"
_ADVICE = {  # {keyword of another package: (our parameter, advice if the function has it)}
    "dt": ("step", "step is the step of a method with fixed steps, and t gives the times"),
    "t_span": ("t", _TIMES),
    "t_eval": ("t", _TIMES),
    "rtol": ("tol", "use tol"),
    "atol": ("tol", "use tol"),
}
_RADIANS = "angles are in radians here; numpy.radians and numpy.degrees convert them"


class NoKeywords(TypedDict):
    """The type of `unknown`, for which type checkers allow no keyword."""


def refuse_unknown_keywords(
    function: Callable[..., Any], unknown: Iterable[str], name: str = ""
) -> NoReturn:
    """Raise TypeError for the first of the keyword arguments that a function does not have."""
    word, known = next(iter(unknown)), []
    for parameter in signature(function).parameters.values():
        if parameter.kind is not Parameter.VAR_KEYWORD:
            known.append(parameter.name)
        elif "Unpack" in str(parameter.annotation):
            (words,) = eval(parameter.annotation, function.__globals__).__args__
            known += words.__annotations__
    needed, hint = _ADVICE.get(word, ("self", _RADIANS if word == "degrees" else ""))
    if not hint or needed not in [*known, "self"]:
        hint = suggest_name(word, [one for one in known if one not in ("self", "cls")])
    public = name or function.__qualname__
    raise TypeError(f"{public}() got an unexpected keyword argument {word!r}: {hint}")


def has_unknown_keywords(name: str, required: Container[str] = ()) -> Callable[[_F], _F]:
    """Return a decorator for a function with the parameter `unknown`, which it refuses by itself.

    This costs less time in a call than the wrappers of the other public functions. The signature
    that help and other tools show has no parameter `unknown`, and no defaults of the parameters in
    `required`. They have a default only to find the unknown keywords of a call without them.
    """

    def decorate(function: _F) -> _F:
        shown = signature(function)
        parameters = [
            one.replace(default=Parameter.empty) if one.name in required else one
            for one in shown.parameters.values()
            if one.name != "unknown"
        ]
        function.__dict__["__signature__"] = shown.replace(parameters=parameters)
        function.__qualname__ = name
        return function

    return decorate


def _explain_type_errors(function: Callable[..., Any], name: str) -> Callable[..., Any]:
    """Return the function with messages that give its public name and suggest keywords."""

    def call(*args: Any, **words: Any) -> Any:
        try:
            return function(*args, **words)
        except TypeError as error:
            found = re.search(r"got an unexpected keyword argument '(\w+)'", str(error))
            is_of_call = error.__traceback__ is not None and error.__traceback__.tb_next is None
            if not is_of_call and not (found and found[1] in words):
                raise
            message = str(error).replace(f"{function.__qualname__}()", f"{name}()")
        if found:
            refuse_unknown_keywords(function, [found[1]], name)
        raise TypeError(message)

    return update_wrapper(call, function)


def explain_public_names(
    module: ModuleType,
    constructible: Container[str] = (),
    later: Mapping[str, str] = MappingProxyType({}),
) -> None:
    """Let all public functions, methods, calls of objects and constructors explain wrong arguments.

    Unknown attributes of the module suggest names. `constructible` are the classes that users call,
    and `later` maps names to the modules from which they are imported on first access.
    """
    names = getattr(module, "__all__", None) or dir(module)
    package = __name__.partition(".")[0]

    def explain(public: str) -> Any:
        value = getattr(module, public)
        owners: list[tuple[Any, str, str]] = [(module, public, public)]
        if isinstance(value, type) and value.__module__.startswith(package):
            called = ["__call__", *(["__init__"] if public in constructible else [])]
            owners = [
                (value, name, f"{public}.{name}" if name[0] != "_" else public)
                for name in dir(value)
                if name[0] != "_" or name in called
            ]
        for owner, name, shown in owners:
            member = getattr_static(owner, name)
            function = getattr(member, "__func__", member)
            if not isfunction(function) or vars(function).keys() & {"__signature__", "__wrapped__"}:
                continue
            if owner is module or len(signature(function).parameters) > 1:
                wrapper = _explain_type_errors(function, shown)
                if owner is module:
                    wrapper.__module__ = module.__name__  # where pickle finds it
                setattr(owner, name, wrapper if function is member else type(member)(wrapper))
        return getattr(module, public)

    def import_or_refuse(name: str) -> Any:
        if name in later:
            setattr(module, name, getattr(import_module(later[name], package), name))
            return explain(name)
        hint = "" if name.startswith("_") else f"; {suggest_name(name, names)}"
        raise AttributeError(f"module {module.__name__!r} has no attribute {name!r}{hint}")

    for name in names:
        if name not in later:
            explain(name)
    vars(module)["__getattr__"] = import_or_refuse


class HintingType(type):
    """A metaclass whose classes suggest names for unknown attributes, as constructors."""

    if not TYPE_CHECKING:

        def __getattr__(cls, name: str) -> NoReturn:
            is_asked_by_dataclass = name in cls.__annotations__
            public = [] if is_asked_by_dataclass else [one for one in dir(cls) if one[0] != "_"]
            hint = "" if name[0] == "_" or not public else f"; {suggest_name(name, public)}"
            raise AttributeError(f"{cls.__name__} has no attribute {name!r}{hint}")
