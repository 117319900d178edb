"""Method and step chosen for the user: the cheapest geometric method that keeps the attitude error
below what is asked for.

A method of order p errs by about w t (c h r)^p, where the rate r and the weight w come from the
integrals of motion and the constants c were measured. With that the cheapest method and its step h
are guessed; then two runs are compared, the error of the finer one being |difference| / (ratio^p -
1), and refined until it is small enough.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from .._core import values
from .._ground.arguments import Array
from .._model.scene import Scene
from .._recording.path import Path, Stats, stopped
from .._recording.rows import rows
from .._request.methods import methods
from .._request.plan import Choice
from .._request.request import Progress, Request
from ..quaternion import attitude_error

# The constants c, and the price of a step in kicks and drifts
_SYMMETRIC = {
    "takahashi_imada4": (0.165, 1.25),
    "blanes_moan6": (0.04, 15.0),
    "kahan_li8": (0.122, 17.0),
}
_GENERAL = {"takahashi_imada4": (0.10, 3.2), "kahan_li8": (0.10, 17.0)}

_SHORTER = 1.05  # a step too short costs less than one more run
_AIM = 0.4  # a refined run aims at this part of the target, and
_ENOUGH = 0.8  # one is good enough with an estimate below this
_UNLIKE = 0.1  # two runs that part by more tell nothing of the error [rad]
_SAMPLES = 64  # the errors are compared at about so many times
_NUDGE = 2.0**-36  # by which data are moved to see how far the attitude moves
_ROUNDING = 2.0**-53
_ROUNDINGS = 8  # of the data come to as much as all of a run, whose sums are compensated
_DOUBT = (
    1000.0  # conditioning is measured where so many times what the growth of errors shows is more
)
_RUNS = 12


@dataclass(frozen=True)
class _Run:
    steps: int
    states: Array
    samples: Array  # attitudes at the times of comparison


class _Search:
    """Runs of one method, compared at common times."""

    def __init__(
        self,
        scene: Scene,
        times: Array,
        target: float,
        max_steps: int,
        progress: Progress | None,
    ) -> None:
        self.scene, self.times, self.target = scene, times, target
        self.max_steps, self.progress = max_steps, progress
        self.end = float(times[-1])
        self.spent = Stats(0, 0, 0, 0)
        self.method, guess, self.rate = _guess(scene, abs(self.end), target)
        self.order = methods[self.method].order
        half = max(1, math.ceil(guess / 2.0))
        each = math.ceil(half / _SAMPLES)
        self.intervals = math.ceil(half / each)
        self.grid = self.end * np.arange(1, self.intervals + 1) / self.intervals
        self.coarse = self.intervals * each

    def whole(self, steps: float) -> int:
        """So many steps or a few more, for every run to meet the times of comparison."""
        return self.intervals * math.ceil(steps / self.intervals)

    def run(self, steps: int, scene: Scene, times: Array) -> _Run | None:
        """None where the step is too large for the method."""
        sign = math.copysign(1.0, self.end)
        wanted = sign * np.unique(np.abs(np.concatenate([self.grid, times])))
        step, method = self.end / steps, methods[self.method]
        request = Request(method, abs(step), max_steps=self.max_steps)
        status, states, _, counts, _ = rows(scene, request, wanted, self.progress)
        self.spent = Stats(*(a + b for a, b in zip(self.spent, counts, strict=True)))
        if status == "ERR_STEP_SIZE":
            return None
        if status != "OK":
            path = Path(scene, states, self.method, step, None, self.spent)
            way = f"{self.method} got to t = {states[-1, 0]:g} of {self.end:g}"
            raise stopped(status, path, way)
        at = states[np.searchsorted(np.abs(wanted), np.abs(self.grid)), 1:5]
        return _Run(steps, states[np.searchsorted(np.abs(wanted), np.abs(times))], at)

    def apart(self, a: _Run, b: _Run) -> float:
        return float(attitude_error(a.samples, b.samples).max())

    def growth(self, a: _Run, b: _Run) -> float:
        """How far one rounding of the momentum moves the attitude, if that grows as the difference
        of two runs does; a regular motion's grows as t."""
        speed = np.maximum(attitude_error(a.samples, b.samples), _ROUNDING) / np.abs(self.grid)
        more = float(speed.max() / np.median(speed[: -(-speed.size // 8)]))
        return _ROUNDING * (1.0 + self.rate * abs(self.end)) * more

    def conditioning(self, run: _Run) -> float:
        """How far one rounding of the momentum moves the attitude, from a neighbour of the
        scene."""
        x, y, z = self.scene.momentum
        nudged = self.scene.replace(
            momentum=(x * (1.0 + _NUDGE), y * (1.0 - _NUDGE), z * (1.0 + _NUDGE))
        )
        near = self.run(run.steps, nudged, self.grid)
        return self.apart(run, near) * _ROUNDING / _NUDGE if near else math.inf

    def refuse(self, conditioning: float, why: str) -> ValueError:
        return ValueError(
            f"error = {self.target!r} cannot be met at t = {self.end!r}: {why}; one rounding "
            "(2**-53) of "
            f"this scene's momentum moves the attitude by about {conditioning:.1e} rad. "
            "Ask for a larger error or a shorter time"
        )

    def finer(self, run: _Run, error: float) -> int:
        """Steps with which the error should be small enough."""
        more = (error / (_AIM * self.target)) ** (1.0 / self.order)
        return max(self.whole(run.steps * min(4.0, max(1.25, more))), run.steps + self.intervals)


def best(
    scene: Scene, times: Array, target: float, max_steps: int, progress: Progress | None = None
) -> Path:
    """The path at these times, with an attitude error below the target on all of [0, t]; progress
    is told of each run in turn."""
    search = _Search(scene, times, target, max_steps, progress)
    conditioning, measured = 0.0, False
    last, steps = search.run(search.coarse, scene, search.grid), 2 * search.coarse
    for _ in range(_RUNS):
        before = search.spent.evaluations
        run = search.run(steps, scene, times)
        cost = search.spent.evaluations - before
        error = math.inf
        if last and run:
            apart = search.apart(last, run)
            if not measured:
                conditioning = search.growth(last, run)
                measured = apart >= _UNLIKE or _DOUBT * conditioning > target
                conditioning = search.conditioning(last) if measured else conditioning
            if conditioning > target:
                raise search.refuse(conditioning, "the data do not hold so much")
            if apart < _UNLIKE:
                error = apart / ((run.steps / last.steps) ** search.order - 1.0)
                if _ROUNDINGS * conditioning > target:
                    why = f"the roundings of a run come to {_ROUNDINGS} of the data's"
                    raise search.refuse(conditioning, why)
                if error <= _ENOUGH * target:
                    error += _ROUNDINGS * conditioning
                    return _path(search, run, error, conditioning, cost)
        last, steps = run, search.finer(run, error) if run else 2 * steps
    known = search.conditioning(last) if last else math.inf
    raise search.refuse(known, f"{_RUNS} ever finer runs did not agree so well")


def _path(search: _Search, run: _Run, error: float, conditioning: float, cost: int) -> Path:
    choice = Choice(
        method=search.method,
        step=search.end / run.steps,
        order=search.order,
        target=search.target,
        error=error,
        conditioning=conditioning,
        run=cost,
        trials=search.spent.evaluations - cost,
    )
    method, step, spent = search.method, choice.step, search.spent
    return Path(search.scene, run.states, method, step, None, spent, _choice=choice)


def _guess(scene: Scene, t: float, target: float) -> tuple[str, float, float]:
    """The cheapest method, how many steps it will take, and how fast the top turns."""
    body = scene.body
    symmetric = body.is_symmetric
    lever = body.mass * abs(scene.gravity) * math.hypot(*body.com)
    kinetic, potential = (
        float(values(name, scene._block, scene._start)[0]) for name in ("kinetic", "potential")
    )
    moment = sorted(body.moments)[1 if symmetric else 2]
    if symmetric:  # a drift is exact, so all error comes with the torque
        fall = 2.0 * (potential + lever) / moment
        rate = math.sqrt((math.hypot(*scene.momentum) / moment) ** 2 + fall)
        weight = lever / moment / rate if rate else 0.0
    else:
        weight = rate = math.sqrt(2.0 * (kinetic + potential + lever) / moment)
    prices = {}
    for name, (c, price) in (_SYMMETRIC if symmetric else _GENERAL).items():
        steps = _SHORTER * c * rate * t * (weight * t / target) ** (1.0 / methods[name].order)
        prices[name] = price * max(1.0, steps), steps
    method = min(prices, key=lambda name: prices[name][0])
    return method, prices[method][1], rate
