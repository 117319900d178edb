"""The plan of a sweep: all that decides the bits of its parts, as canonical JSON with a hash; the
machine, its threads and who does the work are no part of it."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from .._core import Worker
from .._ground.arguments import Array, Numbers, shown, whole
from .._model.scene import Ensemble, Scene
from .._recording.paths import Paths
from .._recording.reduced import Reduced
from .._request.many import Order, times_of
from .._request.methods import ELSE
from .._request.plan import BY_TRIAL
from .._request.request import Progress, checked_every
from .._request.times import memory
from .._verbs.many import Words, by_trial, order_of, solve_all
from ..events import checked_events, written
from ..events import read as event_of
from .source import Drawn, Source
from .start_words import Given

FORMAT = 1  # of the parts: another layout has another number
MOST, _BYTES = 1 << 17, 1 << 26  # tops of a part, and about so many bytes of what is kept of them
_INLINE = 1 << 16  # numbers of a word that stand in the plan itself; more have a file beside it
_ROW = 64  # bytes of a top beside what is asked for: its number, its start, how it went


class Solved(NamedTuple):
    """What each top is asked for, in the words of kreisel.solve."""

    t: float | list[float]
    method: str
    words: Words


@dataclass(frozen=True, eq=False)
class SweepPlan:
    """A source of tops, what is asked of each, and how many make a part."""

    source: Source
    solved: Solved
    part: int
    order: Order
    times: Array

    @property
    def states(self) -> int:
        """How many there are of each top."""
        return int(self.times.size)

    @property
    def parts(self) -> int:
        """How many there are."""
        return -(-self.source.size // self.part)

    def tops_of(self, i: int) -> range:
        """The numbers of the tops of a part."""
        return range(i * self.part, min((i + 1) * self.part, self.source.size))

    @cached_property
    def told(self) -> dict[str, Any]:
        """The plan as JSON has it."""
        source, solved = self.source, self.solved
        drawn = source._drawn
        told: dict[str, Any] = {
            "format": FORMAT,
            "scene": source.scene.to_toml(),
            "shape": list(source.shape),
            "axes": list(source.axes),
            "made_of": _words(source._words),
            "varied": _varied(source),
            "flags": dict(source._flags),
            "t": solved.t,
            "method": solved.method,
            "solve": _solve(solved.words),
            "part": self.part,
        }
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
        return "" if self.order.chooses else Worker(*self.order.core, []).kernel[0]

    def solve(self, tops: range, threads: int, progress: Progress | None) -> Paths | Reduced:
        """What becomes of the tops of these numbers. TypeError or ValueError for the first that
        cannot be, with its number."""
        t, method, words = self.solved
        try:
            some = self.source[tops.start : tops.stop]
            return solve_all(some, t, method, words, progress, threads)
        except (TypeError, ValueError) as error:
            at = np.arange(tops.start, tops.stop, dtype=np.int64)
            raise self.source._refusal(
                lambda some: _looked_at(some, t, method, words), at, error
            ) from None


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


def _words(words: Mapping[str, Given]) -> list[list[Any]]:
    """Words in their order, each with the shape of a value and its numbers, or where these are."""
    return [
        [
            name,
            list(one.value),
            name_of(one.values) if one.values.size > _INLINE else one.values.tolist(),
        ]
        for name, one in words.items()
    ]


def _varied(source: Source) -> list[str | list[Any]]:
    """The words that vary: the names of those of which the tops are made, and others whole."""
    return [
        name if source._words.get(name) is one else _words({name: one})[0]
        for name, one in source._told.items()
    ]


def _solve(words: Words) -> dict[str, Any]:
    """The words of solve that were given, as JSON has them."""
    told = {name: value for name, value in words._asdict().items() if value is not None}
    if words.events is not None:
        told["events"] = [written(event) for event in checked_events(ELSE, words.events)]
    if words.want is not None:
        told["want"] = list(words.want)
    if words.reduce is not None:
        told["reduce"] = [[name, kinds] for name, kinds in words.reduce.items()]
    return told


def planned(
    source: Source, t: Numbers, method: object, words: Words, part: int | None = None
) -> SweepPlan:
    """The plan in these words. TypeError, ValueError or MemoryError for what cannot be, by a look
    at some of its tops."""
    if np.ndim(t) > 1:
        raise ValueError("t must be a number or a list of times, which all tops of a sweep share")
    if not isinstance(method, str):
        raise TypeError(f"method must be the name of one, not {shown(method)}")
    words = words._replace(want=_read_once(words.want), reduce=_listed(words.reduce))

    def look(some: Ensemble) -> tuple[Order, Array]:
        return _looked_at(some, t, method, words)

    sample = source._sample()
    try:
        order, times = look(source._made(sample))
    except (TypeError, ValueError) as error:
        raise source._refusal(look, sample, error) from None
    states = times.shape[-1]
    size = _default(order, states) if part is None else whole("part", part, 1)
    kept = min(size, source.size) * _row(order, states)
    if kept > memory():
        raise MemoryError(
            f"a part of {size} tops with {states} states each needs {1e-9 * kept:.3g} GB, more "
            "than this machine has: take smaller parts, fewer times, or keep less"
        )
    asked = Solved(np.asarray(t, dtype=np.float64).tolist(), method, _plain(words, order))
    return SweepPlan(source, asked, size, order, times)


def _looked_at(some: Ensemble, t: Numbers, method: str, words: Words) -> tuple[Order, Array]:
    """The order of some tops, and their times."""
    order = by_trial(words) if method == BY_TRIAL else order_of(some, method, words)
    number = None if order.chooses else checked_every(order.request.method, words.every)
    return order, times_of(some, t, order, number)


def _row(order: Order, states: int) -> int:
    kept = 8 * len(order.kept) if order.kept else states * (8 + order.size)
    return _ROW + kept


def _default(order: Order, states: int) -> int:
    return max(1, min(MOST, _BYTES // _row(order, states)))


def _listed(reduce: Any) -> Any:
    """What is to be reduced, in lists that can be read more than once."""
    if not isinstance(reduce, Mapping):
        return reduce
    return {name: _read_once(kinds) for name, kinds in reduce.items()}


def _read_once(names: Any) -> Any:
    """Names in a list that can be read more than once."""
    return list(names) if isinstance(names, Iterator) else names


def _plain(words: Words, order: Order) -> Words:
    """The words in the forms that the plan has, each way to say the same alike."""
    request = order.request
    reduce = None
    if words.reduce is not None:
        reduce = {
            name: [kinds] if isinstance(kinds, str) else list(dict.fromkeys(kinds))
            for name, kinds in words.reduce.items()
        }
    return words._replace(
        step=None if words.step is None else float(words.step),
        tol=None if words.tol is None else float(words.tol),
        error=None if words.error is None else float(words.error),
        digits=request.digits,
        every=None if words.every is None else int(words.every),
        max_steps=int(words.max_steps),
        want=None if order.kept else request.want,
        reduce=reduce,
    )


def read(told: Mapping[str, Any], load: Callable[[str], Array]) -> SweepPlan:
    """The plan that JSON tells, with what `load` finds in the files beside it; ValueError where it
    is none."""
    try:
        plan = planned(_source(told, load), told["t"], told["method"], *_asked(told))
    except (KeyError, TypeError) as error:
        raise ValueError(f"it is no plan of a sweep: {error}") from None
    if plan.hash != hash_of(told):
        raise ValueError("it is a plan that this version would tell in other words")
    return plan


def _source(told: Mapping[str, Any], load: Callable[[str], Array]) -> Source:
    def words(rows: list[list[Any]]) -> dict[str, Given]:
        return {
            name: Given(
                load(numbers) if isinstance(numbers, str) else np.asarray(numbers, np.float64),
                tuple(value),
            )
            for name, value, numbers in rows
        }

    drawn = None
    if "random" in told:
        random = told["random"]
        drawn = Drawn(random["seed"], words(random["ranges"]), random["widths"])
    made_of = words(told["made_of"])
    varied: dict[str, Given] = {}
    for row in told["varied"]:
        varied |= {row: made_of[row]} if isinstance(row, str) else words([row])
    scene, shape = Scene.from_toml(told["scene"]), tuple(told["shape"])
    return Source(scene, shape, tuple(told["axes"]), made_of, varied, told["flags"], drawn)


def _asked(told: Mapping[str, Any]) -> tuple[Words, int]:
    words: dict[str, Any] = dict(told["solve"])
    if "events" in words:
        words["events"] = [event_of(row) for row in words["events"]]
    if "reduce" in words:
        words["reduce"] = dict(words["reduce"])
    return Words(**words), told["part"]
