"""Runs: a top in motion that can be led on, streamed, saved, and gone on with later, with the same
bits."""

from __future__ import annotations

import json
import os
import warnings
import zlib
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path as File

import numpy as np
from numpy.typing import ArrayLike

from .._core import start as start_top
from .._core import statuses
from .._ground.arguments import Array, whole
from .._ground.files import write
from .._model.scene import Scene, parse
from .._recording.path import Path, Stats, kept, path_of, stopped, way
from .._recording.recording import in_pieces, told
from .._request.plan import Plan, plan_of
from .._request.request import Progress, Request, checked_every, checked_progress, request
from .._request.times import (
    PIECE,
    direction,
    listed,
    pieces,
    refuse_disorder,
    refuse_endless,
)

MAGIC = b"kreisel run\n"  # how a checkpoint begins
_FUSED = {"avx512", "avx2"}  # kernels with equal bits


class Run:
    """A top in motion, from kreisel.start or kreisel.resume. Times are counted from its start and
    lead away from it.

    scene, method, step, tol, digits, want  as in kreisel.solve, step positive
    t      how far it has come: the time of the last state that it gave, or of the last good one
           where it failed [T]
    stats  what it has cost so far
    """

    def __init__(self, scene: Scene, request: Request, back: bool) -> None:
        self._request, self._back, self._fresh = request, back, True
        self.scene, self.method, self.want = scene, request.method.name, request.want
        self.step, self.tol, self.digits = request.step, request.tol, request.digits
        self.t = 0.0
        self.stats = Stats(0, 0, 0, 0)
        status, top = start_top(scene._block, *request.core, back)
        if top is None:
            rows = status, scene._start.copy(), None, (0, 0, 0, 0), -0.1 if back else 0.0
            path = path_of(scene, request, rows)
            raise stopped(status, path, way(path, 0.0))
        self._top = top

    def __repr__(self) -> str:
        return f"<kreisel.Run: {self.method} at t = {self.t:g}, {self.stats.steps} steps>"

    def to(
        self, t: ArrayLike, *, every: int | None = None, progress: Progress | None = None
    ) -> Path:
        """On to t: a number, for the state where the run stands and that at t, or with `every` for
        each so many steps not given yet; or a list, for exactly these. Raises what kreisel.solve
        raises; the run then stays at its last good state."""
        asked = self._asked(t, every)
        if asked.size:
            self._refuse(asked)
        return self.lead(asked, progress)

    def lead(self, times: Array, progress: Progress | None) -> Path:
        """On to these times, which need no check."""
        callback = checked_progress(progress)
        if self.want is None:
            status, path = self._record(times, callback)
        else:
            status, path = in_pieces(times, self.want, lambda piece: self._record(piece, callback))
        if status != "OK":
            raise stopped(status, path, way(path, float(times[-1]) if times.size else self.t))
        return told(path, callback)

    def stream(
        self,
        t: ArrayLike | Iterator[float],
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
        for piece in pieces:
            self._refuse(piece)
            status, path = self._record(piece, progress)
            path = kept(path, self.want, float(piece[-1]))
            if status != "OK":
                raise stopped(status, path, way(path, float(piece[-1])))
            yield path
        if progress is not None and not self._fresh:
            progress(self.t)

    def _asked(self, t: ArrayLike, every: int | None) -> Array:
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
        try:
            came = self._top.record(times, self._request.low, progress)
        finally:  # also where progress raised
            self.t, self._fresh = self._top.t, self._fresh and not times.size
        path = path_of(self.scene, self._request, came)
        self.stats = path.stats
        return came[0], path

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


def start(
    scene: Scene,
    method: str = "auto",
    *,
    step: float | None = None,
    tol: float | None = None,
    digits: int | None = None,
    max_steps: int = 0,
    want: Iterable[str] | None = None,
    back: bool = False,
) -> Run:
    """A run of a scene that goes on in pieces: run.to(t) is kreisel.solve up to there,
    run.save(file) and kreisel.resume let it go on another day.

        file = pathlib.Path("run.kreisel")
        run = kr.resume(file) if file.exists() else kr.start(scene, "strang", step=0.01)
        for path in run.stream(1e6, every=100):
            keep(path)
            run.save(file)

    The words are those of kreisel.solve; `back` for a run back in time. Any method but 'geometric',
    which tries whole runs.
    """
    if not isinstance(back, bool):
        raise TypeError(f"back must be True or False, not {back!r}")
    return Run(scene, request(scene, method, step, tol, digits, max_steps, want), back)


def stream(
    scene: Scene,
    t: ArrayLike | Iterator[float],
    method: str = "auto",
    *,
    step: float | None = None,
    tol: float | None = None,
    digits: int | None = None,
    every: int | None = None,
    max_steps: int = 0,
    want: Iterable[str] | None = None,
    chunk: int = PIECE,
    progress: Progress | None = None,
) -> Iterator[Path]:
    """The states of kreisel.solve, with the same bits, as paths of at most `chunk` states: in
    constant memory.

    t      a list, an iterator of times, which may have no end, or with `every` a number, which may
           be math.inf [T]

        for path in kr.stream(scene, math.inf, "strang", step=0.01, every=10): ...
        for path in kr.stream(scene, (0.01 * k for k in itertools.count())): ...

        >>> import kreisel as kr
        >>> words = {"method": "strang", "step": 0.01, "every": 10, "want": ["nutation"]}
        >>> [len(path) for path in kr.stream(kr.scenes.asymmetric, 1000, chunk=4000, **words)]
        [4000, 4000, 2001]

    Each path's stats are those of the whole run so far. Raises what kreisel.solve raises: for what
    can be seen at once, at once; for what an iterator brings, when it comes; `.path` is what the
    last path would have been.
    """
    asked = request(scene, method, step, tol, digits, max_steps, want)
    number, size = checked_every(asked.method, every), whole("chunk", chunk, 1)
    back, t = direction(t, size)
    found = pieces(t, asked.step, number, size, None)
    return Run(scene, asked, back)._stream(found, checked_progress(progress))


def resume(checkpoint: bytes | str | os.PathLike[str], *, max_steps: int | None = None) -> Run:
    """The run of a checkpoint, or of the file in which it was saved, as it stood. `max_steps`:
    another limit.

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
    if kernel != now and {kernel, now} != _FUSED:
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
    run = Run(scene, request(scene, *words), head["back"])
    status = run._top.load(memory)
    if status != "OK":
        raise ValueError(statuses[status][1])
    t, stats, fresh, kernel = (head[word] for word in ("t", "stats", "fresh", "kernel"))
    costs = [whole("a number of the stats", n, 0) for n in stats]
    if len(costs) != len(Stats._fields) or not isinstance(fresh, bool) or t != run._top.t:
        raise ValueError("its time, stats and motion do not belong together")
    if not isinstance(kernel, str):
        raise TypeError(f"a kernel has a name, not {kernel!r}")
    run.t, run.stats, run._fresh = run._top.t, Stats(*costs), fresh
    return run, kernel
