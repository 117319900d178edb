"""Method and step chosen for the user: the cheapest geometric method that keeps the attitude error
below what is asked for.

A method of order p errs by about g w t (c h r)^p, where the rate r and the weight w come from the
integrals of motion and the constants c were measured; g is how much more than a regular motion this
one magnifies small changes, as it does near an unstable equilibrium. With that the cheapest method
and its step h are guessed, and refined until the run is near enough to a reference.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from .._core import Work, values
from .._ground.arguments import Array, positive
from .._ground.names import MethodName
from .._model.scene import Scene
from .._recording.path import Path, Stats, good, path_of, stopped
from .._recording.reference import (
    CLOSED_FORM,
    LONGER_SERIES,
    ROUNDING,
    ROUNDINGS,
    SERIES,
    closed_form_holds,
    grown_roundings,
)
from .._recording.rows import rows
from .._request.methods import methods
from .._request.plan import Choice
from .._request.request import Progress, Request
from ..quaternion import attitude_error

Told = Progress | Work | None  # who is told of progress, or may stop the work
# The constants c, and the price of a step in kicks and drifts
_Constants = dict[MethodName, tuple[float, float]]
_SYMMETRIC: _Constants = {
    "takahashi_imada4": (0.165, 1.25),
    "blanes_moan6": (0.04, 15.0),
    "kahan_li8": (0.122, 17.0),
}
_GENERAL: _Constants = {"takahashi_imada4": (0.10, 3.2), "kahan_li8": (0.10, 17.0)}

_SHORTER = 1.05  # a step too short costs less than one more run
_AIM = 0.4  # a refined run aims at this part of the target, and
_ENOUGH = 0.8  # one is good enough with an error below this: a larger one may lie between two looks
_TOO_LARGE = {"ERR_STEP_SIZE", "ERR_CONVERGENCE"}  # what steps are, at the start or on the way
_UNLIKE = 0.1  # the error of a run further off tells nothing of a finer one's [rad]
_LOOKS = 128  # at the error on the way, or
_EACH_RADIAN = 4  # while the top turns by one where these are more,
_MOST_LOOKS = 1 << 13  # but no more, nor at more of the times that were asked for
_FEW = 32  # steps are looked into, too: between their ends they may err by more
_REGULAR = 30.0  # times the angle turned: by no more a regular motion magnifies a small change
_BUDGET = 64  # times the steps first thought of may be taken in all
_STALLS = (
    3  # so often a finer run may be no better by half; then half the step makes other roundings
)


class _Search:
    """Runs of one method, each compared with the reference where it is looked at."""

    def __init__(
        self,
        scene: Scene,
        times: Array,
        target: float,
        max_steps: int,
        progress: Told,
    ) -> None:
        self.scene, self.times, self.target = scene, times, target
        self.max_steps, self.progress = max_steps, progress
        self.end = float(times[-1])
        self.spent, self.cost = Stats(0, 0, 0, 0), 0  # in all, and of the last run
        self.rate, self.weight = _rates(scene)
        self.angle = self.rate * abs(self.end)
        self.asked = times[:: max(1, -(-times.size // _MOST_LOOKS))]
        _, steps = self.guess(1.0)
        looks = self.looks(math.ceil(steps))
        came, grown = grown_roundings(scene, looks, max_steps=max_steps, progress=progress)
        good(scene, replace(SERIES, max_steps=max_steps), came)
        self.conditioning = ROUNDING * grown
        self.request = self.reference()
        more = grown / (_REGULAR * (1.0 + self.angle))  # than a regular motion
        self.method, steps = self.guess(min(max(1.0, more), 1.0 / ROUNDING))
        self.order, self.first = methods[self.method].order, math.ceil(steps)
        self.budget = _BUDGET * max(self.first, _LOOKS, math.ceil(self.angle))

    def guess(self, grown: float) -> tuple[MethodName, float]:
        """The cheapest method, and how many steps it will take."""
        prices, t = {}, abs(self.end)
        for name, (c, price) in _constants(self.scene).items():
            part = self.weight * t * grown / self.target
            steps = _SHORTER * c * self.rate * t * part ** (1.0 / methods[name].order)
            prices[name] = price * max(1.0, steps), steps
        method = min(prices, key=lambda name: prices[name][0])
        return method, max(1.0, prices[method][1])

    def looks(self, steps: int) -> Array:
        """The times at which the error of so many steps is looked at: ends of steps, so that they
        cost nothing, inside the steps where these are few, and times that were asked for."""
        often = min(max(_LOOKS, _EACH_RADIAN * self.angle), _MOST_LOOKS)
        each = max(1, math.ceil(steps / often))
        ends = np.append(np.arange(each, steps, each), steps)
        parts = min(3, math.ceil(_FEW / steps))
        inside = [ends - part / parts for part in range(parts)]
        return self.merged(self.end * np.concatenate(inside) / steps, self.asked)

    def merged(self, a: Array, b: Array) -> Array:
        """All times of both, in the order in which the motion meets them."""
        return math.copysign(1.0, self.end) * np.unique(np.abs(np.concatenate([a, b])))

    def reference(self) -> Request:
        """What to compare with: the closed form, where the error allowed is far above its
        roundings."""
        near = ROUNDINGS * self.conditioning <= self.target
        return CLOSED_FORM if near and closed_form_holds(self.scene) else LONGER_SERIES

    def run(self, steps: int) -> tuple[Array, float] | None:
        """The states of so many steps at the times that were asked for, and the largest attitude
        error on the way; None where the steps are too large for the method."""
        looks = self.looks(steps)
        all_times = self.merged(looks, self.times)
        before = self.spent.evaluations
        states = self.states(Request(methods[self.method], abs(self.end / steps)), all_times)
        self.cost = self.spent.evaluations - before
        if states is None:
            return None
        truth = self.states(self.request, looks)
        assert truth is not None
        seen, asked = (np.searchsorted(np.abs(all_times), np.abs(t)) for t in (looks, self.times))
        return states[asked], float(attitude_error(states[seen, 1:5], truth[:, 1:5]).max())

    def states(self, request: Request, times: Array) -> Array | None:
        limited = replace(request, max_steps=self.max_steps)
        came = rows(self.scene, limited, times, self.progress)
        status, states, _, counts, _ = came
        self.spent = Stats(*(a + b for a, b in zip(self.spent, counts, strict=True)))
        if status in _TOO_LARGE:
            return None
        if status != "OK":
            path = replace(path_of(self.scene, limited, came), stats=self.spent)
            way = f"{request.method.name} got to t = {states[-1, 0]:g} of {self.end:g}"
            raise stopped(status, path, way)
        return states

    def finer(self, steps: int, error: float) -> int:
        """Steps with which the error should be small enough."""
        more = (error / (_AIM * self.target)) ** (1.0 / self.order)
        more = min(4.0, max(1.1, more)) if error < _UNLIKE else 4.0
        return math.ceil(steps * more)

    def refusal(self, why: str) -> ValueError:
        return ValueError(
            f"error = {self.target!r} cannot be met at t = {self.end!r}: {why}; one rounding "
            "(2**-53) of the state, in the top's own units, moves the attitude by about "
            f"{self.conditioning:.1e} rad. Ask for a larger error or a shorter time"
        )


def checked_error(error: float | None, others: Mapping[str, object]) -> float:
    """The error allowed, where no other word steers the choice."""
    if error is None:
        raise ValueError(
            "method='geometric' chooses its step: give the error allowed [rad], as in error=1e-6"
        )
    given = [name for name, value in others.items() if value is not None]
    if given:
        raise ValueError(f"method='geometric' chooses its steps: leave {' and '.join(given)} out")
    target = positive("error", error)
    if target > 0.1:
        raise ValueError(
            f"error must be at most 0.1 rad, not {target!r}: beyond it two runs cannot be compared"
        )
    return target


def no_error(method: object) -> ValueError:
    """The refusal of an error allowed, where another method was asked for."""
    return ValueError(
        f"error is for method='geometric', which chooses its step; {method!r} takes step or tol"
    )


def best(
    scene: Scene,
    times: Array,
    target: float,
    max_steps: int,
    progress: Told = None,
) -> Path:
    """The path at these times, with an attitude error below the target on all of [0, t]; progress
    is told of each run in turn."""
    search = _Search(scene, times, target, max_steps, progress)
    if search.conditioning > target:
        raise search.refusal("the data do not hold so much")
    steps, taken, least, stalls = search.first, 0, math.inf, 0
    while stalls < _STALLS:
        taken += steps
        if taken > search.budget:
            raise search.refusal(f"a search may take {search.budget} steps, which did not suffice")
        run = search.run(steps)
        if run and run[1] <= _ENOUGH * target:
            return _path(search, *run, steps)
        error = run[1] if run else math.inf
        stalled = 0.5 * least < error < _UNLIKE
        stalls += stalled
        least, steps = min(least, error), 2 * steps if stalled else search.finer(steps, error)
    raise search.refusal(
        f"the roundings of a run come to {least:.1e} rad, and finer steps add more"
    )


def _path(search: _Search, states: Array, error: float, steps: int) -> Path:
    choice = Choice(
        method=search.method,
        step=search.end / steps,
        order=search.order,
        target=search.target,
        error=error,
        conditioning=search.conditioning,
        run=search.cost,
        trials=search.spent.evaluations - search.cost,
        budget=search.budget,
    )
    method, step, spent = search.method, choice.step, search.spent
    return Path(search.scene, states, method, step, None, spent, _choice=choice)


def _constants(scene: Scene) -> _Constants:
    return _SYMMETRIC if scene.body.is_symmetric else _GENERAL


def _rates(scene: Scene) -> tuple[float, float]:
    """How fast the top turns, and the weight of a method's error."""
    body = scene.body
    lever = body.mass * abs(scene.gravity) * math.hypot(*body.com)
    kinetic, potential = (
        float(values(name, scene._block, scene._start)[0]) for name in ("kinetic", "potential")
    )
    moment = sorted(body.moments)[1 if body.is_symmetric else 2]
    above = max(0.0, potential + lever)  # of a top that hangs, but for roundings nothing
    if body.is_symmetric:  # a drift is exact, so all error comes with the torque
        rate = math.sqrt((math.hypot(*scene.momentum) / moment) ** 2 + 2.0 * above / moment)
        return rate, lever / moment / rate if rate else 0.0
    rate = math.sqrt(2.0 * (kinetic + above) / moment)
    return rate, rate
