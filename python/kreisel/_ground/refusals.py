"""The words of refusals: a name that is not known, and a status of the core where nothing ran."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Callable, Iterable
from dataclasses import FrozenInstanceError
from typing import TypeVar

from .._core import statuses
from .arguments import shown

_T = TypeVar("_T")
_PASSED = {__package__.partition(".")[0], "dataclasses"}  # what a user called lies above these


def refusal(status: str, detail: str) -> Exception:
    """The exception that a status of the core stands for where nothing was run."""
    what, text = statuses[status]
    return (MemoryError if what == "MEMORY" else ValueError)(f"{text}: {detail}")


_LONGEST = 100  # letters of what may be a name misspelt
_OTHER_WORDS = {  # that books have for the same
    "attitude": "q",
    "omega": "velocity",
    "phi": "precession_angle",
    "psi": "spin_angle",
    "theta": "nutation",
}


def unknown(what: str, name: str, known: Iterable[str]) -> str:
    """A message for a name that is not known, with the nearest that is."""
    return f"unknown {what} {shown(name)}; {nearest(name, known)}"


def nearest(name: str, known: Iterable[str]) -> str:
    """The name that may have been meant, or all that there are."""
    import difflib  # here, since most programs name what there is

    names = list(known)
    word, _, axis = name.lower().replace("-", "_").partition("_")
    word = "_".join(filter(None, (_OTHER_WORDS.get(word, word), axis)))
    near = difflib.get_close_matches(word[:_LONGEST], names, n=1)
    return f"did you mean {near[0]!r}?" if near else "known are " + ", ".join(names)


def unchangeable(instead: str) -> Callable[[type[_T]], type[_T]]:
    """Return a decorator for a class that refuses assignments, and says what to do instead."""

    def of(made: type[_T]) -> type[_T]:
        def refuse(_: object, name: str, __: object) -> None:
            raise FrozenInstanceError(f"cannot assign to field {name!r}: {instead.format(name)}")

        type.__setattr__(made, "__setattr__", refuse)
        return made

    return of


def warn(said: str) -> None:
    """Warns where a user called the package, however deep inside it this is."""
    level, frame = 2, sys._getframe(1)
    while frame.f_back and frame.f_globals.get("__name__", "").partition(".")[0] in _PASSED:
        level, frame = level + 1, frame.f_back
    warnings.warn(said, stacklevel=level)
