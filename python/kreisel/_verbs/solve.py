"""kreisel.solve: from a scene to a path. All that can be wrong with a request is found before
anything runs."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from concurrent.futures import Executor
from typing import Literal, overload

from .._ground.arguments import Array, Numbers, instance, whole
from .._ground.names import MethodName, QuantityName
from .._model.scene import Ensemble, Scene
from .._recording.path import Path
from .._recording.paths import Paths
from .._recording.recording import recorded, recorded_at_once, told
from .._recording.reduced import Reduced
from .._recording.watched import WatchedPath
from .._request.many import Reductions
from .._request.request import Progress, Request, checked_every, checked_progress, wanted
from .._request.times import listed, refuse_endless
from ..events import Event
from .geometric import best, checked_error, no_error
from .many import Words, refuse_words_of_many, solve_all
from .run import Run
from .start import Looked, asked_for
from .tangents import Tangents, solve_with_tangents


@overload
def solve(
    scene: Scene,
    t: Numbers,
    method: MethodName | Literal["geometric"] = "auto",
    *,
    step: float | None = None,
    tol: float | None = None,
    digits: int | None = None,
    every: int | None = None,
    max_steps: int = 0,
    error: float | None = None,
    want: Iterable[QuantityName] | None = None,
    progress: Progress | None = None,
    events: None = None,
    threads: None = None,
    executor: None = None,
    reduce: None = None,
    out: None = None,
    tangents: Tangents | None = None,
) -> Path: ...
@overload
def solve(
    scene: Scene,
    t: Numbers,
    method: MethodName = "auto",
    *,
    step: float | None = None,
    tol: float | None = None,
    digits: int | None = None,
    every: int | None = None,
    max_steps: int = 0,
    error: float | None = None,
    want: Iterable[QuantityName] | None = None,
    progress: Progress | None = None,
    events: Looked,
    threads: None = None,
    executor: None = None,
    reduce: None = None,
    out: None = None,
) -> WatchedPath: ...
@overload
def solve(
    scene: Ensemble,
    t: Numbers,
    method: MethodName | Literal["geometric"] = "auto",
    *,
    step: float | None = None,
    tol: float | None = None,
    digits: int | None = None,
    every: int | None = None,
    max_steps: int = 0,
    error: float | None = None,
    want: Iterable[QuantityName] | None = None,
    progress: Progress | None = None,
    events: Looked | None = None,
    threads: int | None = None,
    executor: Executor | None = None,
    reduce: None = None,
    out: Array | None = None,
) -> Paths: ...
@overload
def solve(
    scene: Ensemble,
    t: Numbers,
    method: MethodName = "auto",
    *,
    step: float | None = None,
    tol: float | None = None,
    digits: int | None = None,
    every: int | None = None,
    max_steps: int = 0,
    error: None = None,
    want: None = None,
    progress: Progress | None = None,
    events: None = None,
    threads: int | None = None,
    executor: Executor | None = None,
    reduce: Reductions,
    out: None = None,
) -> Reduced: ...
def solve(
    scene: Scene | Ensemble,
    t: Numbers,
    method: MethodName | Literal["geometric"] = "auto",
    *,
    step: float | None = None,
    tol: float | None = None,
    digits: int | None = None,
    every: int | None = None,
    max_steps: int = 0,
    error: float | None = None,
    want: Iterable[QuantityName] | None = None,
    progress: Progress | None = None,
    events: Looked | None = None,
    threads: int | None = None,
    executor: Executor | None = None,
    reduce: Reductions | None = None,
    out: Array | None = None,
    tangents: Tangents | None = None,
) -> Path | Paths | Reduced:
    """The motion of a scene, which starts at t = 0; or of many, as a kreisel.Ensemble.

    t          a list: exactly these states, all on one side of 0 and ever further from it. A
               number: the start and the end, or with `every` each so many steps. Negative: back in
               time [T]
    method     a name in kreisel.methods; 'auto' is exact where it applies, taylor elsewhere and for
               digits and events; 'geometric' chooses a structure-preserving method and its step so
               that `error` is met
    step       positive [T]. Fixed-step methods need it, and read times off their grid by a side
               step. Else it is the first
    tol        adaptive methods: local error of a step; implicit ones: residual; else not allowed.
               exact meets any
    digits     taylor only, instead of tol: up to 16, 20 or 30; what doubles leave out is path.q_low
               and path.m_low
    every      record each so many steps of a fixed-step method, if t is a number
    max_steps  0: no limit; with 'geometric' of each run
    error      with 'geometric': the largest attitude error allowed on [0, t], at most 0.1 [rad];
               met, by a reference with 20 digits or the closed form, or refused, at the latest
               after 64 times the steps first thought of
    want       names, as ("nutation", "energy"): the path keeps t and these; without the heading
               where none needs it
    progress   called about ten times a second with the time reached, and with the end [T]; what it
               raises stops the run
    events     taylor only: what kreisel.events makes, one or a list, for path.events to tell; a
               terminal one ends the path

    tangents   of a path of taylor's with all its states, and of one scene: "start", "moments",
               "com", "gravity", "mass", or several of these: the derivatives by them ride along,
               for path.tangents; the path is the same to the last bit

        >>> import kreisel as kr
        >>> path = kr.solve(kr.scenes.cusps, t=300, method="strang", step=0.01, every=100)
        >>> path
        <kreisel.Path: 301 states, t = 0 .. 300; strang, step=0.01, 30000 steps>
        >>> truth = kr.solve(kr.scenes.cusps, path.t)
        >>> truth.method, bool(kr.attitude_error(path.q, truth.q).max() < 1e-3)
        ('exact', True)
        >>> lows = kr.solve(kr.scenes.cusps, 50, events=[kr.events.nutation(direction=1)]).events
        >>> [f"{t:.6f}" for t in lows.t[:2]]
        ['1.174941', '3.524823']

    Of an ensemble the words mean the same for each top, and the result is a kreisel.Paths: arrays
    that begin with the shape of the ensemble. A top's numbers are its own to the last bit, whatever
    else is moved, where and by whom; they are those of the top alone but for roundings of taylor's.
    `t` may also be an array (*shape, k) of times of each top, `progress` is called with the part of
    the tops that is done, 0 .. 1, and there is more to say:

    threads    how many move the tops; left out: as many as there are processors
    executor   of concurrent.futures, in their place; tops that go to other processes are copied
    reduce     what to keep of each top in place of its path, as {"nutation": ("min", "max")}: names
               of quantities or their components, with one or several of min, max, mean, variance,
               last, where_min, where_max; then the result is a kreisel.Reduced
    out        a float64 array (*shape, k, 8) in C order, which gets the states

        >>> import numpy as np
        >>> tops = kr.scenes.cusps.vary(gravity=np.linspace(0.5, 1.0, 3))
        >>> paths = kr.solve(tops, [0.0, 1.0, 2.0])
        >>> paths.q.shape, paths.failed.tolist(), paths[2].nutation[1].round(3)
        ((3, 3, 4), [], np.float64(1.13))

    Raises TypeError, ValueError, or MemoryError for more states than fit, before anything runs;
    kreisel.Error for a run that fails, kreisel.Interrupted (a KeyboardInterrupt) for Ctrl-C, both
    with `.path` up to the last good state. Of an ensemble a run that fails is told by
    paths.status, and raised by paths.check(); Interrupted has all that was done as `.paths`.
    """
    if tangents is not None:
        others = error, want, events, threads, executor, reduce, out
        steering = step, tol, digits, max_steps
        return solve_with_tangents(scene, t, method, tangents, steering, every, others, progress)
    if isinstance(scene, Ensemble):
        steered = Words(step, tol, digits, every, max_steps, error, want, events, reduce)
        return solve_all(scene, t, method, steered, progress, threads, executor, out)
    if any(word is not None for word in (threads, executor, reduce, out)):
        refuse_words_of_many(threads, executor, reduce, out)
    if method == "geometric":
        words = {"step": step, "tol": tol, "digits": digits, "every": every, "events": events}
        return _geometric(scene, t, error, max_steps, words, want, progress)
    if error is not None:
        raise no_error(method)
    asked, sought = asked_for(scene, method, step, tol, digits, max_steps, want, events)
    number = checked_every(asked.method, every)
    plain = sought is None and number is None and (progress is None or callable(progress))
    if plain and (path := recorded_at_once(scene, asked, t, progress)) is not None:
        return path
    return _at_second_look(scene, asked, sought, t, number, progress)


def _at_second_look(
    scene: Scene,
    asked: Request,
    sought: tuple[Event, ...] | None,
    t: Numbers,
    number: int | None,
    progress: Progress | None,
) -> Path:
    """The path of a request whose times had to be looked at, with the events on its way."""
    times = listed(t, asked.step, number, asked.size)
    end = float(times[-1]) if times.size else 0.0
    refuse_endless(scene, end, asked.step)
    callback = checked_progress(progress)
    if sought is not None or times.size > asked.limit:
        return Run(scene, asked, end < 0.0, sought)._lead(times, callback)
    return recorded(scene, asked, times, callback)


def _geometric(
    scene: Scene,
    t: Numbers,
    error: float | None,
    max_steps: int,
    others: Mapping[str, object],
    want: Iterable[QuantityName] | None,
    progress: Progress | None,
) -> Path:
    instance("scene", scene, Scene)
    target = checked_error(error, others)
    names, times = wanted(want), listed(t, None, None)
    if not times.any():
        return solve(scene, t, "strang", step=1.0, want=names, progress=progress)  # nothing moves
    refuse_endless(scene, float(times[-1]), None)
    most = whole("max_steps", max_steps, 0)
    callback = checked_progress(progress)
    path = told(best(scene, times, target, most, callback), callback)
    return path if names is None else path.only(names)
