"""What is raised, and when: bad input before anything runs, failures with the path up to the last good state."""
from __future__ import annotations

import difflib
from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from . import _core

if TYPE_CHECKING:
    from .path import Path


class _Stopped(BaseException):
    """A run that ended before its time."""

    status: str
    """The name of the status, as in kreisel.h without its prefix: 'ERR_LIMIT', 'ERR_NOT_FINITE', ..."""
    path: Path
    """The states asked for that were reached, and the last good state where that is later."""

    def __init__(self, message: str, status: str, path: Path) -> None:
        super().__init__(message)
        self.status = status
        self.path = path

    def __reduce__(self) -> tuple[type[_Stopped], tuple[str, str, Path]]:
        return type(self), (str(self), self.status, self.path)


class Error(_Stopped, RuntimeError):
    """A run failed. `.path` holds what was reached, `.status` the reason's name."""


class Interrupted(_Stopped, KeyboardInterrupt):
    """Ctrl-C during a run. `.path` holds what was reached."""


_KINDS: dict[str, type[_Stopped]] = {"FAILURE": Error, "INTERRUPT": Interrupted}


def refusal(status: str, detail: str) -> Exception:
    """What a status of the core stands for where nothing was run."""
    what, text = _core.statuses[status]
    return (MemoryError if what == "MEMORY" else ValueError)(f"{text}: {detail}")


def stopped(status: str, path: Path, where: str) -> BaseException:
    """What a status of a run stands for."""
    what, text = _core.statuses[status]
    if what in _KINDS:
        return _KINDS[what](f"{text}: {where}", status, path)
    would = f", where {_step_that_fits(path)!r} would do" if status == "ERR_STEP_SIZE" else ""
    return refusal(status, f"{path.method} with step = {path.step!r}{would}, tol = {path.tol!r} and {path.scene!r}")


def _step_that_fits(path: Path) -> float | None:
    """The largest of step / 2, step / 4, ... that the method takes."""
    step, none = path.step, np.empty(0)
    while step and _core.record(path.scene._block, path.method, step, 0.0, 0, 0, none)[0] == "ERR_STEP_SIZE":
        step /= 2.0
    return step


def unknown(what: str, name: str, known: Iterable[str]) -> str:
    """A message for a name that is not known, with the nearest that is."""
    names = list(known)
    near = difflib.get_close_matches(name.lower().replace("-", "_"), names, n=1)
    hint = f"did you mean {near[0]!r}?" if near else "known are " + ", ".join(names)
    return f"unknown {what} {name!r}; {hint}"
