"""kreisel.solve: from a scene to a path. All that can be wrong with a request is found before anything runs."""
from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from typing import Any

from . import _core, check, geometric, times
from .check import Array
from .columns import picked
from .events import Event, Events, blocks
from .how import How, how, wanted
from .how import every as checked_every
from .how import progress as checked_progress
from .methods import ELSE
from .path import Path
from .run import Run, path_of, stopped
from .scene import Scene
from .states import NO_STATES


def solve(
    scene: Scene,
    t: float | Any,
    method: str = "auto",
    *,
    step: float | None = None,
    tol: float | None = None,
    digits: int | None = None,
    every: int | None = None,
    max_steps: int = 0,
    error: float | None = None,
    want: Iterable[str] | None = None,
    progress: Callable[[float], object] | None = None,
    events: Sequence[Event] | None = None,
) -> Path:
    """The motion of a scene, which starts at t = 0.

    t          a list: exactly these states, all on one side of 0 and ever further from it. A number: the start and the
               end, or with `every` each so many steps. Negative: back in time [T]
    method     a name in kreisel.methods; 'auto' is exact where it applies, taylor elsewhere and for digits and events;
               'geometric' chooses a structure-preserving method and its step so that `error` is met
    step       positive [T]. Fixed-step methods need it, and read times off their grid by a side step. Else the first
    tol        adaptive methods: local error of a step; implicit ones: residual; else not allowed. exact meets any
    digits     taylor only, instead of tol: up to 16, 20 or 30; what doubles leave out is path.q_low and path.m_low
    every      record each so many steps of a fixed-step method, if t is a number
    max_steps  0: no limit; with 'geometric' of each run
    error      with 'geometric': the largest attitude error allowed on [0, t], at most 0.1 [rad]
    want       names, as ("nutation", "energy"): the path keeps t and these; without the heading where none needs it
    progress   called about ten times a second with the time reached [T]; what it raises stops the run
    events     taylor only: what kreisel.events makes, for path.events to tell; a terminal one ends the path

    Raises TypeError, ValueError, or MemoryError for more states than fit, before anything runs; kreisel.Error for a run
    that fails, kreisel.Interrupted (a KeyboardInterrupt) for Ctrl-C, both with `.path` up to the last good state.
    """
    if method == "geometric":
        others = {"step": step, "tol": tol, "digits": digits, "every": every, "events": events}
        return _geometric(scene, t, error, max_steps, others, want, progress)
    if error is not None:
        raise ValueError(f"error is for method='geometric', which chooses its step; {method!r} takes step or tol")
    return _solve(scene, method, (step, tol, digits, max_steps, want), t, every, progress, events)


def _solve(
    scene: Any, method: Any, words: tuple[Any, Any, Any, Any, Any], t: Any, number: Any, callback: Any, events: Any
) -> Path:
    name = ELSE if method == "auto" and events is not None else method
    chosen = how(scene, name, *words, method)
    watched = None if events is None else blocks(chosen.method.name, events)
    wanted_times = times.listed(t, chosen.step, checked_every(chosen.method, number), chosen.size)
    end = float(wanted_times[-1]) if wanted_times.size else 0.0
    times.refuse_endless(chosen.scene, end, chosen.step)
    if watched is None and chosen.want is not None and wanted_times.size > times.PIECE:
        return Run(chosen, end < 0.0).lead(wanted_times, callback)
    block, name, steering = chosen.scene._block, chosen.method.name, chosen.steering(end < 0.0)
    progress = checked_progress(callback)
    if watched is not None:
        return _finished(chosen, end, *_core.record_events(block, name, *steering, wanted_times, watched, progress))
    return _finished(chosen, end, *_core.record(block, name, *steering, wanted_times, chosen.leave_heading, progress))


def _finished(
    how: How, end: float, status: str, states: Array, low: Array | None, stats: tuple[int, ...], met: Any = None
) -> Path:
    """The path that the core has recorded, with the events that it met; raises what its status stands for."""
    path = path_of(how, end < 0.0, states, low, stats)
    if how.want is not None:
        path = path_of(how, end < 0.0, NO_STATES, None, stats, picked(path, how.want))
    if met is not None:
        path = replace(path, events=Events(path_of(how, end < 0.0, met[0], met[1], stats), *met[2:]))
    if status != "OK":
        raise stopped(status, path, end)
    return path


def _geometric(
    scene: Scene, t: Any, error: Any, max_steps: int, others: dict[str, Any], want: Any, callback: Any
) -> Path:
    check.kind("scene", scene, Scene)
    if error is None:
        raise ValueError("method='geometric' chooses its step: give the error allowed [rad], as in error=1e-6")
    given = [name for name, value in others.items() if value is not None]
    if given:
        raise ValueError(f"method='geometric' chooses its steps: leave {' and '.join(given)} out")
    target = check.positive("error", error)
    if target > 0.1:
        raise ValueError(f"error must be at most 0.1 rad, not {target!r}: beyond it two runs cannot be compared")
    names, listed = wanted(want), times.listed(t, None, None)
    if not listed.any():
        return solve(scene, t, "strang", step=1.0, want=names)      # nothing moves
    times.refuse_endless(scene, float(listed[-1]), None)
    most = check.whole("max_steps", max_steps, 0)
    path = geometric.best(scene, listed, target, most, checked_progress(callback))
    return path if names is None else path.only(names)
