"""kreisel.solve: from a scene to a path. All that can be wrong with a request is found before anything runs."""
from __future__ import annotations

import math
import os
from typing import Any

import numpy as np

from . import _core, check, errors, geometric
from .check import Array
from .methods import ELSE, Method, fitting
from .path import Path, Stats
from .scene import Scene

_EXACT = 2.0**53        # whole numbers, and with them steps and radians, are told apart up to here
_FIRST_STEP = -0.1      # back in time, for a method that would choose its own: to the core a step of 0 means forward


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
) -> Path:
    """The motion of a scene, which starts at t = 0.

    t          a list: exactly these states, all on one side of 0 and ever further from it. A number: the start and the
               end, or with `every` each so many steps. Negative: back in time [T]
    method     a name in kreisel.methods; 'auto' is exact where it applies and no digits are asked for, else taylor;
               'geometric' chooses a structure-preserving method and its step so that `error` is met, and says in path.plan
               what it chose
    step       positive [T]. Methods of fixed step need it: a path has one grid k step, and a time off it is read by a
               side step, so that states do not depend on what else was asked for. Adaptive methods: the first step
    tol        adaptive methods: local error of a step; implicit ones: residual; else not allowed. exact meets any
    digits     taylor only, instead of tol: up to 16, 20 or 30; what doubles leave out is path.q_low and path.m_low
    every      record each so many steps of a fixed-step method, if t is a number
    max_steps  0: no limit; with 'geometric' of each run
    error      with 'geometric': the largest attitude error allowed on [0, t], at most 0.1 [rad]

    Raises TypeError, ValueError, or MemoryError for more states than fit, before anything runs; kreisel.Error for a run
    that fails, kreisel.Interrupted (a KeyboardInterrupt) for Ctrl-C, both with `.path` up to the last good state.
    """
    check.kind("scene", scene, Scene)
    if method == "geometric":
        return _geometric(scene, t, error, max_steps, {"step": step, "tol": tol, "digits": digits, "every": every})
    if error is not None:
        raise ValueError(f"error is for method='geometric', which chooses its step; {method!r} takes step or tol")
    chosen = fitting(ELSE if method == "auto" and digits is not None else method, scene)
    h, accuracy, precision = _step(chosen, step), _tol(chosen, tol), _digits(chosen, digits, tol)
    times = _times(t, h, _every(chosen, every))
    return _run(scene, chosen, times, h, accuracy, precision, check.whole("max_steps", max_steps, 0))


def _run(
    scene: Scene, method: Method, times: Array, step: float | None, tol: float | None, digits: int | None, most: int
) -> Path:
    end = float(times[-1]) if times.size else 0.0
    step = None if step is None else math.copysign(step, end)
    refuse_endless(scene, end, step)
    steering = step if step is not None else _FIRST_STEP if end < 0.0 else 0.0
    how = steering, tol or 0.0, digits or 0, most
    status, states, low, stats = _core.record(scene._block, method.name, *how, times)
    path = Path(scene, states, method.name, step, tol, Stats(*stats), digits=digits, _low=low)
    if status != "OK":
        where = f"{method.name} got to t = {states[-1, 0]:g} of {end:g} in {path.stats.steps} steps"
        raise errors.stopped(status, path, where)
    return path


def _geometric(scene: Scene, t: Any, error: Any, max_steps: int, others: dict[str, Any]) -> Path:
    if error is None:
        raise ValueError("method='geometric' chooses its step: give the error allowed [rad], as in error=1e-6")
    given = [name for name, value in others.items() if value is not None]
    if given:
        raise ValueError(f"method='geometric' chooses its steps: leave {' and '.join(given)} out")
    target = check.positive("error", error)
    if target > 0.1:
        raise ValueError(f"error must be at most 0.1 rad, not {target!r}: beyond it two runs cannot be compared")
    times = _times(t, None, None)
    if not times.any():
        return solve(scene, t, "strang", step=1.0)      # nothing moves
    refuse_endless(scene, float(times[-1]), None)
    return geometric.best(scene, times, target, check.whole("max_steps", max_steps, 0))


def _step(method: Method, step: Any) -> float | None:
    if step is not None:
        h = check.positive("step", step)
        return None if method.exact else h
    if not method.adaptive:
        raise ValueError(f"the method {method.name!r} has a fixed step: give step, as in step=0.01")
    return None


def _tol(method: Method, tol: Any) -> float | None:
    if tol is None:
        return None
    if not (method.adaptive or method.implicit):
        raise ValueError(f"the method {method.name!r} has no tolerance: its step alone decides, leave tol out")
    accuracy = check.positive("tol", tol)
    if method.adaptive and accuracy >= 1.0:
        raise ValueError(f"tol must be below 1: it is what a step may err by, of what it computes; not {tol!r}")
    return None if method.exact else accuracy


def _digits(method: Method, digits: Any, tol: Any) -> int | None:
    if digits is None:
        return None
    if not method.digits:
        raise ValueError(f"the method {method.name!r} has no digits to choose: that is for method='taylor'")
    if tol is not None:
        raise ValueError("digits and tol exclude each other: either says how accurate to be")
    wanted = check.whole("digits", digits, 1)
    if wanted > 30:
        raise ValueError(f"digits must be at most 30, not {digits!r}")
    return 16 if wanted <= 16 else 20 if wanted <= 20 else 30


def _every(method: Method, every: Any) -> int | None:
    if every is None:
        return None
    if method.adaptive:
        steps = "has none" if method.exact else "chooses its steps"
        raise ValueError(f"every needs a method of fixed step; {method.name} {steps}: give t as a list")
    return check.whole("every", every, 1)


def _times(t: Any, step: float | None, every: int | None) -> Array:
    times = check.array("t", t, "a number or a list of times")
    if times.ndim == 0:
        end = float(times)
        return np.array([0.0, end]) if step is None or every is None else _grid(end, step, every)
    if times.ndim > 1:
        raise ValueError(f"t must be a number or a list of times, not an array of shape {times.shape}")
    if every is not None:
        raise ValueError("every is for t as a number; a list says itself which states are wanted")
    back = times.size > 0 and times[-1] < 0.0
    before = np.concatenate(([0.0], times[:-1]))
    wrong = np.flatnonzero(times > before if back else times < before)
    if wrong.size:
        i = int(wrong[0])
        here, there = f"t[{i}] = {float(times[i])!r}", f"t[{i - 1}] = {float(before[i])!r}" if i else "the start at 0"
        raise ValueError(f"times must lead away from 0 in one direction; {here} goes back from {there}")
    return times


def _grid(end: float, step: float, every: int) -> Array:
    """Each so many points of the grid k step from 0 to the end, up to the rounding of the end."""
    length = abs(end)
    if not length / step < _EXACT:
        raise ValueError(_too_many_steps(end, step))
    steps = math.floor(length / step + 0.5)
    if steps * step - length > 2.0 * np.finfo(float).eps * length:
        steps -= 1
    states = steps // every + 1
    if 72 * states > _memory():
        size = f"{72e-9 * states:.3g} GB"
        raise MemoryError(f"{states} states need {size}, more than this machine has: record fewer by a larger every")
    return np.arange(0, steps + 1, every, dtype=np.float64) * math.copysign(step, end)


def _memory() -> int:
    """Bytes of this machine's memory; where it does not tell, no limit."""
    try:
        return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, OSError, ValueError):
        return 2**63


def _too_many_steps(end: float, step: float) -> str:
    return f"t = {end!r} takes more steps of {step!r} than double precision can count (2**53): take larger steps"


def refuse_endless(scene: Scene, end: float, step: float | None) -> None:
    """What would never end, or turns more often than the time's rounding can tell."""
    if step is not None and not abs(end / step) < _EXACT:
        raise ValueError(_too_many_steps(end, abs(step)))
    largest = max(scene.body.moments)
    torque = scene.body.mass * abs(scene.gravity) * math.hypot(*scene.body.com)
    rate = max(math.hypot(*scene.momentum) / largest, math.sqrt(torque / largest))
    angle = rate * abs(end)
    if angle >= _EXACT:
        raise ValueError(f"by t = {end!r} this top turns by {angle:.2g} rad: double precision cannot tell where it is")
