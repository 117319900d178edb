"""The words of refusals: a name that is not known, and a status of the core where nothing ran."""

from __future__ import annotations

import difflib
from collections.abc import Iterable

from .._core import statuses


def refusal(status: str, detail: str) -> Exception:
    """The exception that a status of the core stands for where nothing was run."""
    what, text = statuses[status]
    return (MemoryError if what == "MEMORY" else ValueError)(f"{text}: {detail}")


def unknown(what: str, name: str, known: Iterable[str]) -> str:
    """A message for a name that is not known, with the nearest that is."""
    return f"unknown {what} {name!r}; {nearest(name, known)}"


def nearest(name: str, known: Iterable[str]) -> str:
    """The name that may have been meant, or all that there are."""
    names = list(known)
    near = difflib.get_close_matches(name.lower().replace("-", "_"), names, n=1)
    return f"did you mean {near[0]!r}?" if near else "known are " + ", ".join(names)
