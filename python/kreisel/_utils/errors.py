"""Error messages for unknown names and for status codes of the C library."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Callable, Iterable
from dataclasses import FrozenInstanceError
from typing import TypeVar

from .._core import statuses
from .validation import short_repr

_T = TypeVar("_T")
_SKIPPED_PACKAGES = {
    __package__.partition(".")[0],
    "dataclasses",
}  # warnings point at the nearest caller outside these packages


def make_exception_from_status(status: str, detail: str) -> Exception:
    """Return the exception for a status code of the C library."""
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
    "position": "apex",
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


def make_frozen_class_decorator(advice: str) -> Callable[[type[_T]], type[_T]]:
    """Return a class decorator that makes every attribute assignment raise FrozenInstanceError.

    The error message ends with the text `advice`, in which {} is replaced by the attribute name.
    """

    def refuse_all_assignments(cls: type[_T]) -> type[_T]:
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
