"""Runs: a top in motion that can be led on, streamed, saved, and gone on with later, with the same
bits."""

from __future__ import annotations

import json
import os
import warnings
import zlib
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path as File
from typing import TYPE_CHECKING

import numpy as np

from .._core import start as start_top
from .._core import statuses
from .._ground.arguments import Array, Numbers, whole
from .._ground.files import write
from .._ground.names import MethodName, QuantityName
from .._ground.refusals import unchangeable
from .._model.scene import Scene, parse
from .._recording.path import Path, Stats, kept, path_of, stopped, way
from .._recording.recording import in_pieces, told, with_events
from .._request.plan import Plan, plan_of
from .._request.request import Progress, Request, checked_every, checked_progress, request
from .._request.times import (
    PIECE,
    listed,
    pieces,
    refuse_disorder,
    refuse_endless,
)
from ..events import Event, checked_events, looked_for, read, written

if TYPE_CHECKING:
    from .._core import Run as Motion

MAGIC = b"kreisel run\n"  # how a checkpoint begins
_FUSED = {"avx512", "avx2", "neon"}  # kernels with equal bits


@unchangeable(
    "a run goes on as it began; kreisel.start(path.end.replace(momentum=...)) begins another one "
    "at the last state of its path"
)
class Run:
    """A top in motion, from kreisel.start or kreisel.resume. Times are counted from its start and
    lead away from it.

    scene, method, step, tol, digits, want, events  as in kreisel.solve, step positive
    t      how far it has come: the time of the last state that it gave, or of the last good one
           where it failed [T]
    stats  what it has cost so far
    """

    scene: Scene
    method: MethodName
    step: float | None
    tol: float | None
    digits: int | None
    want: tuple[QuantityName, ...] | None
    events: tuple[Event, ...] | None
    t: float
    stats: Stats
    _request: Request
    _back: bool
    _fresh: bool
    _top: Motion

    def __init__(
        self,
        scene: Scene,
        request: Request,
        back: bool,
        events: tuple[Event, ...] | None = None,
    ) -> None:
        own = self.__dict__  # past the guard against assignments
        own["_request"], own["_back"], own["_fresh"] = request, back, True
        own["scene"], own["method"], own["want"] = scene, request.method.name, request.want
        own["events"] = events
        own["step"], own["tol"], own["digits"] = request.step, request.tol, request.digits
        own["t"], own["stats"] = 0.0, Stats(0, 0, 0, 0)
        status, top = start_top(scene._block, *request.core, back, looked_for(events or ()))
        if top is None:
            rows = status, scene._start.copy(), None, (0, 0, 0, 0), -0.1 if back else 0.0
            path = path_of(scene, request, rows)
            raise stopped(status, path, way(path, 0.0))
        own["_top"] = top

    def __repr__(self) -> str:
        return f"<kreisel.Run: {self.method} at t = {self.t:g}, {self.stats.steps} steps>"

    def to(self, t: Numbers, *, every: int | None = None, progress: Progress | None = None) -> Path:
        """On to t: a number, for the state where the run stands and that at t, or with `every` for
        each so many steps not given yet; or a list, for exactly these. Raises what kreisel.solve
        raises; the run then stays at its last good state."""
        asked = self._asked(t, every)
        if asked.size:
            self._refuse(asked)
        if self.ended:
            raise ValueError(
                f"this run has ended at t = {self.t!r}, where a terminal event was met: the scene "
                "path.end goes on from there"
            )
        return self._lead(asked, progress)

    def _lead(self, times: Array, progress: Progress | None) -> Path:
        """On to these times, which need no check."""
        callback = checked_progress(progress)
        if self.want is None:
            status, path = self._record(times, callback)
        else:
            status, path = in_pieces(
                times, self.want, lambda piece: self._record(piece, callback), lambda: self.ended
            )
        if status != "OK":
            raise stopped(status, path, way(path, float(times[-1]) if times.size else self.t))
        return told(path, callback)

    def stream(
        self,
        t: Numbers | Iterator[float],
        *,
        every: int | None = None,
        chunk: int = PIECE,
        progress: Progress | None = None,
    ) -> Iterator[Path]:
        """The states of kreisel.stream, from where the run stands; between two paths the run may be
        saved."""
        number = checked_every(self._request.method, every)
        given = None if self._fresh else self.t
        found = pieces(t, self.step, number, whole("chunk", chunk, 1), given)
        return self._stream(found, checked_progress(progress))

    def _stream(self, pieces: Iterator[Array], progress: Progress | None) -> Iterator[Path]:
        while not self.ended and (piece := next(pieces, None)) is not None:
            self._refuse(piece)
            status, path = self._record(piece, progress)
            path = kept(path, self.want, float(piece[-1]))
            if status != "OK":
                raise stopped(status, path, way(path, float(piece[-1])))
            yield path
        if progress is not None and not self._fresh:
            progress(self.t)

    def _asked(self, t: Numbers, every: int | None) -> Array:
        number = checked_every(self._request.method, every)
        asked = listed(t, self.step, number, self._request.size)
        if np.ndim(t) > 0 or self._fresh:
            return asked
        if number is not None:
            return asked[np.abs(asked) > abs(self.t)]
        return np.array([self.t, asked[-1]])

    def _refuse(self, times: Array) -> None:
        refuse_disorder(times, self.t, self._back)
        refuse_endless(self.scene, float(times[-1]), self.step)

    def _record(self, times: Array, progress: Progress | None) -> tuple[str, Path]:
        met = None
        try:
            if self.events is None:
                came = self._top.record(times, self._request.low, progress)
            else:
                came, met = self._top.record_events(times, progress)
        finally:  # also where progress raised
            fresh = self._fresh and not times.size
            self.__dict__.update(t=self._top.t, _fresh=fresh)
        path = path_of(self.scene, self._request, came)
        if met is not None:
            path = with_events(path, met)
        self.__dict__["stats"] = path.stats
        return came[0], path

    @property
    def ended(self) -> bool:
        """Whether a terminal event was met, where the run then stands: it goes no further."""
        return self._top.ended

    @property
    def plan(self) -> Plan:
        """What is used, and what is left out."""
        return plan_of(self.scene, self._request)

    @property
    def checkpoint(self) -> bytes:
        """All that the run is, for kreisel.resume: from there it goes on as if it had never
        stopped, with the same bits."""
        head = {
            "scene": self.scene.to_toml(),
            "method": self.method,
            "step": self.step,
            "tol": self.tol,
            "digits": self.digits,
            "max_steps": self._request.max_steps,
            "want": self.want,
            "asked": self._request.asked,
            "back": self._back,
            "fresh": self._fresh,
            "t": self.t,
            "stats": self.stats,
            "kernel": self._top.kernel[0],
            "events": None if self.events is None else [written(event) for event in self.events],
            "found": self._top.found,
        }
        body = json.dumps(head).encode() + b"\n" + self._top.save()
        return MAGIC + b"%08x\n" % zlib.crc32(body) + body

    def __reduce__(self) -> tuple[Callable[[bytes], Run], tuple[bytes]]:
        """Copies and pickles go by the checkpoint: two runs never share a motion."""
        return resume, (self.checkpoint,)

    def save(self, file: str | os.PathLike[str]) -> None:
        """Write the checkpoint; a file of that name is replaced once all is on the disk, never left
        half done."""
        write(file, self.checkpoint)


def resume(checkpoint: bytes | str | os.PathLike[str], *, max_steps: int | None = None) -> Run:
    """The run of a checkpoint, or of the file in which it was saved, as it stood, with the events
    that it looks for. `max_steps`: another limit. How to keep results exactly once though a run is
    killed is told by help(kreisel.start).

    Raises ValueError for what is damaged, of another version of kreisel or another kind of machine;
    OSError for a file that cannot be read. Warns where this processor has another kernel of
    taylor's: then it goes on to rounding only.
    """
    data = checkpoint if isinstance(checkpoint, bytes) else File(checkpoint).read_bytes()
    name = "the checkpoint" if isinstance(checkpoint, bytes) else os.fspath(checkpoint)
    magic, body = data[: len(MAGIC) + 9], data[len(MAGIC) + 9 :]
    if magic != MAGIC + b"%08x\n" % zlib.crc32(body):
        raise ValueError(f"{name} is not what a run has saved, or damaged")
    line, _, memory = body.partition(b"\n")
    try:
        run, kernel = _restored(line, memory, max_steps)
    except (AttributeError, KeyError, RecursionError, TypeError, ValueError) as error:
        raise ValueError(f"{name} is no checkpoint of a run: {error}") from None
    now = run._top.kernel[0]
    if kernel != now and not {kernel, now} <= _FUSED:
        said = f"{name} was made with the kernel {kernel!r}; {now!r} goes on to rounding only"
        warnings.warn(said, stacklevel=2)
    return run


def _restored(line: bytes, memory: bytes, max_steps: int | None) -> tuple[Run, str]:
    """The run of a checkpoint's two parts, and the kernel that it was made with."""
    head = json.loads(line)
    limit = head["max_steps"] if max_steps is None else max_steps
    method, step, tol, digits = (head[word] for word in ("method", "step", "tol", "digits"))
    words = method, step, tol, digits, limit, head["want"], head["asked"]
    scene = parse(head["scene"])
    if not isinstance(head["back"], bool):
        raise TypeError(f"back must be true or false, not {head['back']!r}")
    asked, rows = request(scene, *words), head.get("events")
    events = (
        None if rows is None else checked_events(asked.method.name, [read(row) for row in rows])
    )
    run = Run(scene, replace(asked, watched=events is not None), head["back"], events)
    found = [whole("a count of events", n, 0) for n in head.get("found", [])]
    status = run._top.load(memory, found)
    if status != "OK":
        raise ValueError(statuses[status][1])
    t, stats, fresh, kernel = (head[word] for word in ("t", "stats", "fresh", "kernel"))
    costs = [whole("a number of the stats", n, 0) for n in stats]
    if len(costs) != len(Stats._fields) or not isinstance(fresh, bool) or t != run._top.t:
        raise ValueError("its time, stats and motion do not belong together")
    if not isinstance(kernel, str):
        raise TypeError(f"a kernel has a name, not {kernel!r}")
    run.__dict__.update(t=run._top.t, stats=Stats(*costs), _fresh=fresh)
    return run, kernel
