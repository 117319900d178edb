"""Hints in error messages about unknown keyword arguments and attributes of public names."""

from __future__ import annotations

import re
from collections.abc import Callable, Container, Iterable
from functools import update_wrapper
from inspect import Parameter, getattr_static, isfunction, signature
from types import ModuleType
from typing import TYPE_CHECKING, Any, NoReturn, TypedDict, TypeVar, cast

from .arguments import suggest_name

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


def unknown_keyword_message(function: Callable[..., Any], name: str, word: str) -> str:
    """Return the message for a keyword argument that a function does not have."""
    known: list[str] = []
    for parameter in signature(function).parameters.values():
        if parameter.kind is not Parameter.VAR_KEYWORD:
            known.append(parameter.name)
        elif "Unpack" in str(parameter.annotation):
            (words,) = eval(parameter.annotation, function.__globals__).__args__
            known += words.__annotations__
    needed, hint = _ADVICE.get(word, ("self", _RADIANS if word == "degrees" else ""))
    if not hint or needed not in [*known, "self"]:
        hint = suggest_name(word, [one for one in known if one not in ("self", "cls")])
    return f"{name}() got an unexpected keyword argument {word!r}: {hint}"


def refuse_unknown_keywords(function: Callable[..., Any], unknown: Iterable[str]) -> NoReturn:
    """Raise TypeError for the first of the unknown keyword arguments of a function."""
    raise TypeError(unknown_keyword_message(function, function.__qualname__, next(iter(unknown))))


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


def _explain_type_errors(function: _F, name: str) -> _F:
    """Return the function with messages that give its public name and suggest keywords."""

    def call(*args: Any, **words: Any) -> Any:
        try:
            return function(*args, **words)
        except TypeError as error:
            found = re.search(r"got an unexpected keyword argument '(\w+)'", str(error))
            if found and found[1] in words:
                message = unknown_keyword_message(function, name, found[1])
            elif error.__traceback__ is not None and error.__traceback__.tb_next is None:
                message = str(error).replace(f"{function.__qualname__}()", f"{name}()")
            else:
                raise
        raise TypeError(message)

    return cast(_F, update_wrapper(call, function))


def _is_explained(function: object) -> bool:
    return not isfunction(function) or not {"__signature__", "__wrapped__"}.isdisjoint(
        vars(function)
    )


def _explain_methods(kind: type, names: Iterable[str]) -> None:
    for name in names:
        method = getattr_static(kind, name)
        function = method.__func__ if isinstance(method, (classmethod, staticmethod)) else method
        if _is_explained(function) or len(signature(function).parameters) < 2:
            continue
        public = kind.__name__ if name == "__init__" else f"{kind.__name__}.{name}"
        wrapper = _explain_type_errors(function, public)
        setattr(kind, name, wrapper if function is method else type(method)(wrapper))


def explain_public_names(module: ModuleType, constructible: Iterable[type] = ()) -> None:
    """Let the functions of a module, and the methods of its classes, explain wrong arguments.

    Unknown attributes of the module suggest names. `constructible` are the classes that users call.
    """
    names = getattr(module, "__all__", None) or dir(module)
    for name in names:
        value = getattr(module, name)
        if isinstance(value, type) and value.__module__.startswith(__name__.partition(".")[0]):
            _explain_methods(value, [one for one in dir(value) if one[0] != "_"])
        elif not _is_explained(value):
            wrapper = _explain_type_errors(value, name)
            wrapper.__module__ = module.__name__  # where pickle finds it
            setattr(module, name, wrapper)
    for kind in constructible:
        _explain_methods(kind, ["__init__"])

    def refuse_attribute(name: str) -> NoReturn:
        hint = "" if name.startswith("_") else f"; {suggest_name(name, names)}"
        raise AttributeError(f"module {module.__name__!r} has no attribute {name!r}{hint}")

    vars(module)["__getattr__"] = refuse_attribute


class HintingType(type):
    """A metaclass whose classes suggest names for unknown attributes, as constructors."""

    if not TYPE_CHECKING:

        def __getattr__(cls, name: str) -> NoReturn:
            is_asked_by_dataclass = name in cls.__annotations__
            public = [] if is_asked_by_dataclass else [one for one in dir(cls) if one[0] != "_"]
            hint = "" if name[0] == "_" or not public else f"; {suggest_name(name, public)}"
            raise AttributeError(f"{cls.__name__} has no attribute {name!r}{hint}")
