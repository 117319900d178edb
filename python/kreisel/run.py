"""Runs: a top in motion that can be led on, streamed, saved, and gone on with later, with the same bits."""
from __future__ import annotations

import json
import os
import warnings
import zlib
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path as File
from typing import Any

import numpy as np

from . import _core, check, errors, times, toml
from .check import Array
from .columns import Columns
from .how import How, how
from .how import every as _every
from .how import progress as checked_progress
from .path import Path, made
from .plan import Plan, of
from .scene import Scene
from .states import Stats

Progress = Callable[[float], object]
_MAGIC = b"kreisel run\n"
_FUSED = {"avx512", "avx2"}        # kernels with equal bits


def path_of(
    how: How, back: bool, states: Array, low: Array | None, stats: tuple[int, ...], columns: Any = None
) -> Path:
    """The path that the core has recorded."""
    words = how.scene, states, how.method.name, how.signed(back)
    if columns is None and low is None:
        return made(*words, Stats(*stats), how.tol, digits=how.digits, _asked=how.asked)
    want = how.want if columns else None
    return Path(*words, how.tol, Stats(*stats), digits=how.digits, _low=low, want=want, _columns=columns or {}, _asked=how.asked)


def stopped(status: str, path: Path, end: float) -> BaseException:
    """What the status of a run to `end` stands for."""
    last = path.t[-1] if len(path) else 0.0
    return errors.stopped(status, path, f"{path.method} got to t = {last:g} of {end:g} in {path.stats.steps} steps")


class Run:
    """A top in motion, from kreisel.start or kreisel.resume. Times are counted from its start and lead away from it.

    scene, method, step, tol, digits, want  as in kreisel.solve, step positive
    t      how far it has come: the time of the last state that it gave, or of the last good one where it failed [T]
    """

    def __init__(self, how: How, back: bool) -> None:
        self._how, self._back, self._fresh = how, back, True
        self.scene, self.method, self.want = how.scene, how.method.name, how.want
        self.step, self.tol, self.digits = how.step, how.tol, how.digits
        self.t = 0.0
        self.stats = Stats(0, 0, 0, 0)
        block = how.scene._block
        status, top = _core.start(block, how.method.name, *how.steering(back), how.leave_heading)
        if top is None:
            raise stopped(status, path_of(how, back, np.array([block[12:]]), None, self.stats), 0.0)
        self._top = top

    def __repr__(self) -> str:
        return f"<kreisel.Run: {self.method} at t = {self.t:g}, {self.stats.steps} steps>"

    def to(self, t: float | Any, *, every: int | None = None, progress: Progress | None = None) -> Path:
        """On to t: a number, for the state where the run stands and that at t, or with `every` for each so many steps not
        given yet; or a list, for exactly these. Raises what kreisel.solve raises; the run then stays at its last good state."""
        asked = self._asked(t, every)
        if asked.size:
            self._refuse(asked)
        return self.lead(asked, progress)

    def lead(self, asked: Array, progress: Progress | None) -> Path:
        """The same, where `asked` needs no check."""
        if self.want is None:
            status, path = self._record(asked, progress)
        else:
            status, path = self._reduced(asked, progress)
        if status != "OK":
            raise stopped(status, path, float(asked[-1]))
        return path

    def stream(
        self, t: float | Iterable[float], *, every: int | None = None, chunk: int = times.PIECE, progress: Progress | None = None
    ) -> Iterator[Path]:
        """The states of kreisel.stream, from where the run stands; between two paths the run may be saved."""
        pieces = times.pieces(t, self.step, _every(self._how.method, every), check.whole("chunk", chunk, 1), self._given)
        return self._stream(pieces, progress)

    def _stream(self, pieces: Iterator[Array], callback: Progress | None) -> Iterator[Path]:
        for piece in pieces:
            self._refuse(piece)
            status, path = self._record(piece, callback)
            path = path if self.want is None else path.only(self.want)
            if status != "OK":
                raise stopped(status, path, float(piece[-1]))
            yield path

    @property
    def _given(self) -> float | None:
        return None if self._fresh else self.t

    def _asked(self, t: Any, number: int | None) -> Array:
        asked = times.listed(t, self.step, _every(self._how.method, number), self._how.size)
        if np.ndim(t) > 0 or self._fresh:
            return asked
        if number is not None:
            return asked[np.abs(asked) > abs(self.t)]
        return np.array([self.t, asked[-1]])

    def _refuse(self, asked: Array) -> None:
        times.refuse_disorder(asked, self.t, self._back)
        times.refuse_endless(self.scene, float(asked[-1]), self.step)

    def _record(self, asked: Array, callback: Progress | None) -> tuple[str, Path]:
        try:
            status, states, low, stats = self._top.record(asked, (self.digits or 0) > 16, checked_progress(callback))
        finally:                # also where progress raised
            self.t, self._fresh = self._top.t, self._fresh and not asked.size
        self.stats = Stats(*stats)
        return status, path_of(self._how, self._back, states, low, self.stats)

    def _reduced(self, asked: Array, callback: Progress | None) -> tuple[str, Path]:
        """Piece by piece, so that no more than what is wanted is ever there."""
        columns = Columns(self.want or (), asked.size)
        for first in range(0, max(asked.size, 1), times.PIECE):
            status, part = self._record(asked[first:first + times.PIECE], callback)
            columns.add(part)
            if status != "OK":
                break
        return status, columns.path(part)

    @property
    def plan(self) -> Plan:
        """What is used, and what is left out."""
        return of(self._how)

    @property
    def checkpoint(self) -> bytes:
        """All that the run is, for kreisel.resume: from there it goes on as if it had never stopped, with the same bits."""
        how = self._how
        head = {
            "scene": how.scene.to_toml(), "method": self.method, "step": self.step, "tol": self.tol, "digits": self.digits,
            "max_steps": how.max_steps, "want": self.want, "asked": how.asked, "back": self._back, "fresh": self._fresh,
            "t": self.t, "stats": self.stats, "kernel": self._top.kernel[0],
        }
        body = json.dumps(head).encode() + b"\n" + self._top.save()
        return _MAGIC + b"%08x\n" % zlib.crc32(body) + body

    def save(self, file: str | os.PathLike[str]) -> None:
        """Write the checkpoint; a file of that name is replaced once all is written, never left half done."""
        whole, new = File(file), File(f"{os.fspath(file)}.new")
        new.write_bytes(self.checkpoint)
        os.replace(new, whole)


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
    """A run of a scene that goes on in pieces: run.to(t) is kreisel.solve up to there, run.save(file) and kreisel.resume
    let it go on another day.

        file = pathlib.Path("run.kreisel")
        run = kr.resume(file) if file.exists() else kr.start(scene, "bobenko_suris4", step=0.01)
        for path in run.stream(1e6, every=100):
            keep(path)
            run.save(file)

    The words are those of kreisel.solve; `back` for a run back in time. Any method but 'geometric', which tries whole runs.
    """
    if not isinstance(back, bool):
        raise TypeError(f"back must be True or False, not {back!r}")
    return Run(how(scene, method, step, tol, digits, max_steps, want), back)


def stream(
    scene: Scene,
    t: float | Iterable[float],
    method: str = "auto",
    *,
    step: float | None = None,
    tol: float | None = None,
    digits: int | None = None,
    every: int | None = None,
    max_steps: int = 0,
    want: Iterable[str] | None = None,
    chunk: int = times.PIECE,
    progress: Progress | None = None,
) -> Iterator[Path]:
    """The states of kreisel.solve, with the same bits, as paths of at most `chunk` states: in constant memory.

    t      a list, an iterator of times, which may have no end, or with `every` a number, which may be math.inf [T]

        for path in kr.stream(scene, math.inf, "strang", step=0.01, every=10): ...
        for path in kr.stream(scene, (0.01 * k for k in itertools.count())): ...

    Each path's stats are those of the whole run so far. Raises what kreisel.solve raises: for what can be seen at once,
    at once; for what an iterator brings, when it comes; `.path` is what the last path would have been.
    """
    chosen = how(scene, method, step, tol, digits, max_steps, want)
    number, size = _every(chosen.method, every), check.whole("chunk", chunk, 1)
    back, t = times.direction(t, size)
    pieces = times.pieces(t, chosen.step, number, size, None)
    return Run(chosen, back)._stream(pieces, checked_progress(progress))


def resume(checkpoint: bytes | str | os.PathLike[str], *, max_steps: int | None = None) -> Run:
    """The run of a checkpoint, or of the file in which it was saved, as it stood. `max_steps`: another limit.

    Raises ValueError for what is damaged, of another version of kreisel or another kind of machine; OSError for a file that
    cannot be read. Warns where this processor has another kernel of taylor's: then it goes on to rounding only.
    """
    data = checkpoint if isinstance(checkpoint, bytes) else File(checkpoint).read_bytes()
    name = "the checkpoint" if isinstance(checkpoint, bytes) else os.fspath(checkpoint)
    magic, body = data[:len(_MAGIC) + 9], data[len(_MAGIC) + 9:]
    if magic != _MAGIC + b"%08x\n" % zlib.crc32(body):
        raise ValueError(f"{name} is not what a run has saved, or damaged")
    line, _, memory = body.partition(b"\n")
    head = json.loads(line)
    limit = head["max_steps"] if max_steps is None else max_steps
    method, step, tol, digits = (head[word] for word in ("method", "step", "tol", "digits"))
    chosen = how(toml.parse(head["scene"]), method, step, tol, digits, limit, head["want"], head["asked"])
    run = Run(chosen, head["back"])
    status = run._top.load(memory)
    if status != "OK":
        raise ValueError(f"{name} is {_core.statuses[status][1]}")
    run.t, run.stats, run._fresh = head["t"], Stats(*head["stats"]), head["fresh"]
    then, now = head["kernel"], run._top.kernel[0]
    if then != now and {then, now} != _FUSED:
        warnings.warn(f"{name} was made with the kernel {then!r}; {now!r} goes on to rounding only", stacklevel=2)
    return run
