"""kreisel.start and kreisel.stream: runs from the start of a scene."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, overload

from .._ground.arguments import Numbers, shown, whole
from .._ground.names import MethodName, QuantityName
from .._model.scene import Scene
from .._recording.path import Path
from .._recording.watched import WatchedPath
from .._request.methods import ELSE
from .._request.request import Progress, Request, checked_every, checked_progress, request
from .._request.times import PIECE, direction, pieces
from ..events import Event, checked_events
from .run import Run

Looked = Event | Sequence[Event]  # what is looked for

if TYPE_CHECKING:

    class WatchedRun(Run):
        """A run that was asked for events: its paths have them."""

        def to(
            self, t: Numbers, *, every: int | None = None, progress: Progress | None = None
        ) -> WatchedPath: ...
        def stream(
            self,
            t: Numbers | Iterator[float],
            *,
            every: int | None = None,
            chunk: int = PIECE,
            progress: Progress | None = None,
        ) -> Iterator[WatchedPath]: ...


@overload
def start(
    scene: Scene,
    method: MethodName = "auto",
    *,
    step: float | None = None,
    tol: float | None = None,
    digits: int | None = None,
    max_steps: int = 0,
    want: Iterable[QuantityName] | None = None,
    events: None = None,
    back: bool = False,
) -> Run: ...
@overload
def start(
    scene: Scene,
    method: MethodName = "auto",
    *,
    step: float | None = None,
    tol: float | None = None,
    digits: int | None = None,
    max_steps: int = 0,
    want: Iterable[QuantityName] | None = None,
    events: Looked,
    back: bool = False,
) -> WatchedRun: ...
def start(
    scene: Scene,
    method: MethodName = "auto",
    *,
    step: float | None = None,
    tol: float | None = None,
    digits: int | None = None,
    max_steps: int = 0,
    want: Iterable[QuantityName] | None = None,
    events: Looked | None = None,
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
    which tries whole runs. With events each path tells those that it met, all together those of one
    solve; a terminal one ends the run, which then goes no further: run.ended, and run.t is its
    time.

    A run killed between keep and save goes on behind what was kept last. For each state to be kept
    once, cut off what lies behind run.t, as here where rows of eight doubles are appended to a
    file:

        file, begun = pathlib.Path("run.kreisel"), os.path.exists("run.kreisel")
        run = kr.resume(file) if begun else kr.start(scene, "strang", step=0.01)
        with open("states", "r+b" if begun else "w+b") as kept:
            t = np.fromfile(kept, dtype=[("t", float), ("q and m", float, 7)])["t"]
            kept.truncate(64 * np.count_nonzero(abs(t) <= abs(run.t)))
            kept.seek(0, os.SEEK_END)
            for path in run.stream(1e6, every=100):
                kept.write(path.states.tobytes())
                kept.flush()
                os.fsync(kept.fileno())
                run.save(file)
    """
    if not isinstance(back, bool):
        raise TypeError(f"back must be True or False, not {shown(back)}")
    asked, sought = asked_for(scene, method, step, tol, digits, max_steps, want, events)
    return Run(scene, asked, back, sought)


def asked_for(
    scene: object,
    method: object,
    step: object,
    tol: object,
    digits: object,
    max_steps: object,
    want: object,
    events: object,
) -> tuple[Request, tuple[Event, ...] | None]:
    """The request in these words, and the events to look for: 'auto' is then what can."""
    if events is None:
        return request(scene, method, step, tol, digits, max_steps, want), None
    name = ELSE if method == "auto" else method
    asked = request(scene, name, step, tol, digits, max_steps, want, method)
    return replace(asked, watched=True), checked_events(asked.method.name, events)


@overload
def stream(
    scene: Scene,
    t: Numbers | Iterator[float],
    method: MethodName = "auto",
    *,
    step: float | None = None,
    tol: float | None = None,
    digits: int | None = None,
    every: int | None = None,
    max_steps: int = 0,
    want: Iterable[QuantityName] | None = None,
    events: None = None,
    chunk: int = PIECE,
    progress: Progress | None = None,
) -> Iterator[Path]: ...
@overload
def stream(
    scene: Scene,
    t: Numbers | Iterator[float],
    method: MethodName = "auto",
    *,
    step: float | None = None,
    tol: float | None = None,
    digits: int | None = None,
    every: int | None = None,
    max_steps: int = 0,
    want: Iterable[QuantityName] | None = None,
    events: Looked,
    chunk: int = PIECE,
    progress: Progress | None = None,
) -> Iterator[WatchedPath]: ...
def stream(
    scene: Scene,
    t: Numbers | Iterator[float],
    method: MethodName = "auto",
    *,
    step: float | None = None,
    tol: float | None = None,
    digits: int | None = None,
    every: int | None = None,
    max_steps: int = 0,
    want: Iterable[QuantityName] | None = None,
    events: Looked | None = None,
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

    Each path's stats are those of the whole run so far, its events those of its part of the way; a
    terminal one ends the stream. Raises what kreisel.solve raises: for what can be seen at once, at
    once; for what an iterator brings, when it comes; `.path` is what the last path would have been.
    """
    asked, sought = asked_for(scene, method, step, tol, digits, max_steps, want, events)
    number, size = checked_every(asked.method, every), whole("chunk", chunk, 1)
    back, t = direction(t)
    found = pieces(t, asked.step, number, size, None)
    return Run(scene, asked, back, sought)._stream(found, checked_progress(progress))
