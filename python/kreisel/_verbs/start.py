"""kreisel.start and kreisel.stream: runs from the start of a scene."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, overload

from .._ground.arguments import Numbers, shown
from .._ground.names import MethodName, QuantityName
from .._model.scene import Scene
from .._recording.watched import WatchedPath
from .._request.methods import ELSE
from .._request.request import Progress, Request, request
from .._request.times import PIECE
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
