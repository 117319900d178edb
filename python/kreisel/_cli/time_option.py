"""Times given on the command line as comma-separated numbers and grids start:end:step."""

from __future__ import annotations

import bisect
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import click
import numpy as np

from .._utils.validation import Array

HELP = "The final time, or the times to record: comma-separated numbers and grids start:end:step."
METAVAR = "TIME[,...]"
_COUNTABLE = 2.0**53


@dataclass(frozen=True)
class TimeGrid:
    """The times start + (skip + k) * step for 0 <= k < count.

    Each time is computed directly from its index, so rounding errors do not accumulate. The later
    times of a grid are bitwise equal to those in the whole grid.
    """

    start: float
    step: float
    count: int
    skip: int = 0

    def __getitem__(self, k: int) -> float:
        return self.start + (self.skip + k) * self.step

    def to_array(self) -> Array:
        """Return the times as an array."""
        return self.start + (self.skip + np.arange(self.count, dtype=np.float64)) * self.step

    def select_later_times(self, t: float) -> TimeGrid:
        """Return the part of the grid whose times exceed |t| in absolute value."""
        k = bisect.bisect_right(range(self.count), abs(t), key=lambda k: abs(self[k]))
        return TimeGrid(self.start, self.step, self.count - k, self.skip + k)


@dataclass(frozen=True)
class TimeSequence:
    """Requested times, given as one or more grids."""

    grids: tuple[TimeGrid, ...]
    one: bool  # True if the user gave a single number, the time to reach

    def __len__(self) -> int:
        return sum(grid.count for grid in self.grids)

    def __iter__(self) -> Iterator[float]:
        return (grid[k] for grid in self.grids for k in range(grid.count))

    @property
    def end(self) -> float:
        """The last time."""
        return self.grids[-1][self.grids[-1].count - 1]

    def to_array(self) -> Array:
        """Return the times as an array. Raises MemoryError if the times do not fit in memory."""
        return np.concatenate([grid.to_array() for grid in self.grids])

    def to_solve_argument(self) -> float | Array:
        """Return the times in the form that kreisel.solve accepts."""
        return self.end if self.one else self.to_array()

    def select_later_times(self, t: float) -> TimeSequence:
        """Return the requested times whose absolute value exceeds |t|."""
        grids = (grid.select_later_times(t) for grid in self.grids)
        return TimeSequence(tuple(grid for grid in grids if grid.count), self.one)


def parse_times(words: str) -> TimeSequence:
    """Parse comma-separated times, each given as a number or as a grid start:end:step."""
    grids = tuple(map(_parse_time_grid, words.split(",")))
    _refuse_unordered_time_grids([t for grid in grids for t in (grid[0], grid[grid.count - 1])])
    return TimeSequence(grids, len(grids) == 1 and ":" not in words)


def _parse_time_grid(word: str) -> TimeGrid:
    try:
        numbers = [float(part) for part in word.split(":")]
    except ValueError:
        numbers = []
    if len(numbers) not in (1, 3):
        raise click.BadParameter(
            f"{word!r} is not a number or a grid start:end:step such as 0:10:0.01"
        )
    if not all(map(math.isfinite, numbers)):
        raise click.BadParameter(f"t must be finite, not {word!r}")
    if len(numbers) == 1:
        return TimeGrid(numbers[0], 0.0, 1)
    return _build_time_grid(word, *numbers)


def _build_time_grid(word: str, start: float, end: float, step: float) -> TimeGrid:
    """Return the grid of times from start to end."""
    length = end - start
    if step == 0.0 or (step < 0.0 < length):
        raise click.BadParameter(f"{word!r} cannot go from {start:g} to {end:g} with this step")
    steps = abs(length / step)
    if not steps < _COUNTABLE:
        raise click.BadParameter(f"{word!r} has too many times: use larger steps")
    step_count = math.floor(steps + 0.5)
    slack = 2.0 * np.finfo(float).eps * max(abs(start), abs(end))
    count = step_count + 1 if step_count * abs(step) - abs(length) <= slack else step_count
    return TimeGrid(start, math.copysign(step, length), count)


def _refuse_unordered_time_grids(ends: Sequence[float]) -> None:
    is_back = ends[-1] < 0.0
    last = 0.0
    for t in ends:
        if (t > last) if is_back else (t < last):
            raise click.BadParameter(
                f"times must move away from 0 in one direction, but {t!r} goes back from {last!r}"
            )
        last = t
