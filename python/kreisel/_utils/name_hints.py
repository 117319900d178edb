"""Hints in error messages about unknown keyword arguments and attributes of public names."""

from __future__ import annotations

import re
from collections.abc import Callable, Container, Iterable, Mapping
from functools import update_wrapper
from importlib import import_module
from inspect import Parameter, getattr_static, isfunction, signature
from types import MappingProxyType, ModuleType
from typing import TYPE_CHECKING, Any, NoReturn, TypedDict, TypeVar

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
