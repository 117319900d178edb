"""What is wanted of a path, without its states."""
from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from .check import Array
from .states import NO_STATES

if TYPE_CHECKING:
    from .path import Path


def picked(path: Path, names: tuple[str, ...]) -> dict[str, Array]:
    """t and these, which hold on to nothing else."""
    return {name: np.ascontiguousarray(getattr(path, name)) for name in ("t", *names)}


class Columns:
    """What is wanted of n states, filled in piece by piece."""

    def __init__(self, want: tuple[str, ...], n: int) -> None:
        self._want, self._n, self._done = want, n, 0
        self._arrays: dict[str, Array] = {}

    def add(self, part: Path) -> None:
        for name in ("t", *self._want):
            values = getattr(part, name)
            if name not in self._arrays:
                self._arrays[name] = np.empty((self._n, *values.shape[1:]))
            self._arrays[name][self._done:self._done + len(part)] = values
        self._done += len(part)

    def path(self, last: Path) -> Path:
        """The path, with all that is no state from its last piece."""
        columns = {name: values[:self._done] for name, values in self._arrays.items()}
        return replace(last, states=NO_STATES, _low=None, want=self._want, _columns=columns)
