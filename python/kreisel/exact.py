"""kreisel.exact: the closed form of a scene, and of the Bobenko-Suris map; any state at once."""
from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Literal, overload

import numpy as np

from . import _core, check
from .check import Array
from .methods import EXACT, fitting, methods
from .path import Path
from .states import Stats
from .scene import Scene
from .times import refuse_endless

_MAP = "bobenko_suris"
_COUNTABLE = 2.0**53
_NO_STEPS = Stats(0, 0, 0, 0)


@dataclass(frozen=True)
class _Rates:
    """period      of the nutation: from one lowest height of the axis to the next; inf if it keeps its height [T]
    precession  mean rate of the axis about the vertical [T^-1]; without torque about the angular momentum
    spin        mean rate of the body about its axis [T^-1]: of Euler's angles, hence beside the precession

    The axis is that of symmetry; of a free body without one that which circulates, on the momentum's side. A top that
    passes a pole precesses there by half a turn either way, which counts as none.
    """

    scene: Scene
    period: float
    precession: float
    spin: float
    _plan: Array = field(repr=False, compare=False)


@dataclass(frozen=True)
class Exact(_Rates):
    """The motion of a scene in closed form; call it with a time or an array of times for a kreisel.Path.

    As exact at t = 1e6 as at 1, and as cheap; times may be in any order and of either sign.
    """

    def __call__(self, t: float | Any) -> Path:
        times = check.array("t", t, "a number or a list of times")
        if times.ndim > 1:
            raise ValueError(f"t must be a number or a list of times, not an array of shape {times.shape}")
        refuse_endless(self.scene, float(np.abs(times).max(initial=0.0)), None)
        return Path(self.scene, _core.exact_states(self._plan, times), EXACT, None, None, _NO_STEPS)


@dataclass(frozen=True)
class ExactMap(_Rates):
    """The states of bobenko_suris with this step in closed form; call it with a whole number or an array of them.

    Its period, precession and spin are the map's own: beside those of the motion they tell the error of the method.
    """

    step: float

    def __call__(self, k: int | Any) -> Path:
        numbers = check.array("k", k, "a whole number or a list of them")
        if numbers.ndim > 1:
            raise ValueError(f"k must be a whole number or a list of them, not an array of shape {numbers.shape}")
        if not (np.rint(numbers) == numbers).all() or np.abs(numbers).max(initial=0.0) >= _COUNTABLE:
            raise ValueError(f"k must be whole and below 2**53, not {k!r}")
        states = _core.exact_map_states(self._plan, numbers.astype(np.int64))
        return Path(self.scene, states, _MAP, self.step, None, _NO_STEPS)


@overload
def exact(scene: Scene) -> Exact: ...
@overload
def exact(scene: Scene, *, map: Literal["bobenko_suris"], step: float) -> ExactMap: ...
def exact(scene: Scene, *, map: str | None = None, step: float | None = None) -> Exact | ExactMap:
    """The closed form of a scene: of a Lagrange top, a spherical body, and any body on which no torque acts.

    map   "bobenko_suris": that of the integrable map instead, for Lagrange tops
    step  the map's, of either sign [T]

    Raises ValueError, with the reason, for a scene without closed form.
    """
    check.kind("scene", scene, Scene)
    if map is not None:
        return _exact_map(scene, map, step)
    if step is not None:
        raise ValueError('step is for map="bobenko_suris"; the motion itself has none')
    if not methods[EXACT].suits(scene):
        raise ValueError(
            f"no closed form is known for this body of kind {scene.body.kind!r} under gravity: it is for {methods[EXACT].tops}"
        )
    status, plan = _core.exact_plan(scene._block)
    if status != "OK":
        raise ValueError(f"{_core.statuses[status][1]}: {scene!r}")
    return Exact(scene, *_rates(plan), plan)


def _exact_map(scene: Scene, map: str, step: float | None) -> ExactMap:
    if map != _MAP:
        raise ValueError(f"the map with a closed form is {_MAP!r}, not {map!r}")
    h = check.number("step", step)
    if h == 0.0:
        raise ValueError("step must not be zero")
    fitting(_MAP, scene)
    status, plan = _core.exact_map_plan(scene._block, h)
    if status == "ERR_STEP_SIZE":
        raise ValueError(f"the map has no closed form at the step {h!r} from this start: 1 + step^2 U / (4 I1) must be "
                         "positive, U the sum of the potential energies before and after a step, and the start not "
                         "within k'^2 = 1e-26 of a separatrix; take another step")
    if status != "OK":
        raise ValueError(f"{_core.statuses[status][1]}: step {h!r}, {scene!r}")
    return ExactMap(scene, *_rates(plan), plan, h)


def _rates(plan: Array) -> tuple[float, float, float]:
    """The first three numbers of kr_exact, with which kr_exact_map begins."""
    return float(plan[0]), float(plan[1]), float(plan[2])
