"""The plan of a sweep: all that decides the bits of its parts, as canonical JSON with a hash; the
machine, its threads and who does the work are no part of it."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from .._core import Worker
from .._model.scene import Ensemble, Scene
from .._options.ensemble_options import EnsembleOptions
from .._options.solve_options import Progress
from .._options.times import total_memory
from .._utils.validation import Array, as_int
from .parameter_values import ParameterValues
from .source import Places, RandomSpec, Source
from .task import Became, SweepTask, task_from_json

FORMAT = 1  # of the parts: another layout has another number
MOST, _BYTES = 1 << 17, 1 << 26  # tops of a part, and about so many bytes of what is kept of them
_INLINE = 1 << 16  # numbers of a word that stand in the plan itself; more have a file beside it
_ROW = 64  # bytes of a top beside what is asked for: its number, its start, how it went


@dataclass(frozen=True, eq=False)
class SweepPlan:
    """A source of tops, what is asked of each, and how many make a part."""

    source: Source
    asked: SweepTask
    part: int
    order: EnsembleOptions
    times: Array
    sample: tuple[Places, Ensemble] | None = None  # the tops by which the plan was validated

    @property
    def states(self) -> int:
        """The number of states of each top."""
        return int(self.times.size)

    @property
    def parts(self) -> int:
        """The number of parts."""
        return -(-self.source.size // self.part)

    def tops_of(self, i: int) -> range:
        """The numbers of the tops of a part."""
        return range(i * self.part, min((i + 1) * self.part, self.source.size))

    @cached_property
    def told(self) -> dict[str, Any]:
        """The plan as JSON has it."""
        source = self.source
        drawn = source._drawn
        told: dict[str, Any] = {
            "format": FORMAT,
            "scene": source.scene.to_toml(),
            "shape": list(source.shape),
            "axes": list(source.axes),
            "made_of": _words(source._words),
            "varied": _varied_parameters(source),
            "flags": dict(source._flags),
            "part": self.part,
        } | self.asked.told
        if drawn is not None:
            told["random"] = {
                "seed": drawn.seed,
                "ranges": _words(drawn.ranges),
                "widths": dict(drawn.widths),
            }
        return told

    @cached_property
    def hash(self) -> str:
        """SHA-256 of the plan as JSON, its names in order, without spaces."""
        return hash_of(self.told)

    @property
    def arrays(self) -> Iterator[Array]:
        """The numbers that are too many for the plan itself."""
        for words in (self.source._words, self.source._told):
            yield from (one.values for one in words.values() if one.values.size > _INLINE)

    @cached_property
    def kernel(self) -> str:
        """The instruction set of the series here; the bits are the same on all that have fma."""
        return "" if self.order.searches_step else Worker(*self.order.core, []).kernel[0]

    def ensemble(self, tops: range) -> Ensemble:
        """Return the tops of these numbers; those of the sample are not made again."""
        if self.sample is not None:
            numbers, ensemble = self.sample
            if len(numbers) == len(tops) and (numbers[0], numbers[-1]) == (tops[0], tops[-1]):
                return ensemble
        return self.source[tops.start : tops.stop]

    def compute_tops(self, tops: range, threads: int, progress: Progress | None) -> Became:
        """Compute the tops with these indices.

        Raises TypeError or ValueError for the first invalid top, with its index.
        """
        try:
            return self.asked.compute_tops(self.ensemble(tops), threads, progress)
        except (TypeError, ValueError) as error:
            at = np.arange(tops.start, tops.stop, dtype=np.int64)
            raise self.source._refusal(self.asked.look, at, error) from None


def hash_of(told: Mapping[str, Any]) -> str:
    """SHA-256 of a plan as canonical JSON."""
    return hashlib.sha256(canonical(told).encode()).hexdigest()


def canonical(told: Mapping[str, Any]) -> str:
    """JSON that is the same for the same plan."""
    return json.dumps(told, sort_keys=True, separators=(",", ":"), allow_nan=False)


def name_of(values: Array) -> str:
    """The name of the file that has these numbers: it tells what they are."""
    digest = hashlib.sha256(str(values.shape).encode())
    digest.update(np.ascontiguousarray(values, dtype="<f8").data)
    return f"starts-{digest.hexdigest()}.npy"


def _words(words: Mapping[str, ParameterValues]) -> list[list[Any]]:
    """Words in their order, each with the shape of a value and its numbers, or where these are."""
    return [
        [
            name,
            list(one.value),
            name_of(one.values) if one.values.size > _INLINE else one.values.tolist(),
        ]
        for name, one in words.items()
    ]


def _varied_parameters(source: Source) -> list[str | list[Any]]:
    """The words that vary: the names of those of which the tops are made, and others whole."""
    return [
        name if source._words.get(name) is one else _words({name: one})[0]
        for name, one in source._told.items()
    ]


def make_plan(source: Source, asked: SweepTask, part: int | None = None) -> SweepPlan:
    """The plan that asks this of the tops of a source. TypeError, ValueError or MemoryError for
    what cannot be, by a look at some of its tops."""
    sample = source._sample()
    try:
        ensemble = source._made(sample)
        order, times = asked.look(ensemble)
    except (TypeError, ValueError) as error:
        raise source._refusal(asked.look, sample, error) from None
    states = times.shape[-1]
    size = _default(order, states) if part is None else as_int("part", part, 1)
    kept = min(size, source.size) * _row(order, states)
    if kept > total_memory():
        raise MemoryError(
            f"a part of {size} tops with {states} states each needs {1e-9 * kept:.3g} GB, more "
            "than this machine has: take smaller parts, fewer times, or keep less"
        )
    return SweepPlan(source, asked.normalized(order), size, order, times, (sample, ensemble))


def _row(order: EnsembleOptions, states: int) -> int:
    kept = 8 * len(order.reductions) if order.reductions else states * (8 + order.size)
    return _ROW + kept


def _default(order: EnsembleOptions, states: int) -> int:
    return max(1, min(MOST, _BYTES // _row(order, states)))


def read(told: Mapping[str, Any], load: Callable[[str], Array]) -> SweepPlan:
    """The plan that JSON tells, with what `load` finds in the files beside it; ValueError where it
    is none."""
    try:
        plan = make_plan(_source(told, load), task_from_json(told), told["part"])
    except (KeyError, TypeError) as error:
        raise ValueError(f"it is no plan of a sweep: {error}") from None
    if plan.hash != hash_of(told):
        raise ValueError("it is a plan that this version would tell in other words")
    return plan


def _source(told: Mapping[str, Any], load: Callable[[str], Array]) -> Source:
    def words(rows: list[list[Any]]) -> dict[str, ParameterValues]:
        return {
            name: ParameterValues(
                load(numbers) if isinstance(numbers, str) else np.asarray(numbers, np.float64),
                tuple(value),
            )
            for name, value, numbers in rows
        }

    drawn = None
    if "random" in told:
        random = told["random"]
        drawn = RandomSpec(random["seed"], words(random["ranges"]), random["widths"])
    made_of = words(told["made_of"])
    varied: dict[str, ParameterValues] = {}
    for row in told["varied"]:
        varied |= {row: made_of[row]} if isinstance(row, str) else words([row])
    scene, shape = Scene.from_toml(told["scene"]), tuple(told["shape"])
    return Source(scene, shape, tuple(told["axes"]), made_of, varied, told["flags"], drawn)
