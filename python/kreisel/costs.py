"""The table of methods, with the cost of a step as measured when it is made."""
from __future__ import annotations

import time
from statistics import median

from . import scenes
from .body import Body
from .methods import Method, Methods
from .scene import Scene
from .solve import solve

_STEPS, _STEP, _TOL = 4000, 0.02, 1e-10
_ROUNDS = 5
_COLUMNS = "| method | order | ns a step: Lagrange | asymmetric | free | keeps to rounding | for | reference |"


def table(methods: Methods) -> str:
    """Rows in Markdown. Costs are medians, the methods taking turns; of an adaptive one, at a tolerance of 1e-10."""
    tops = [scenes.thesis, scenes.asymmetric.replace(attitude=scenes.thesis.attitude), _free()]
    timed = [(method, top) for method in methods.values() for top in tops]
    samples = [[_cost(method, top) for method, top in timed] for _ in range(_ROUNDS)]
    costs = iter([median(sample) for sample in zip(*samples)])
    lines = [_COLUMNS, "| --- | ---: | ---: | ---: | ---: | --- | --- | --- |"]
    for method in methods.values():
        cells = [method.name, str(method.order) if method.order else "varies"]
        cells += [f"{1e9 * cost:.0f}" if (cost := next(costs)) else "" for _ in tops]
        lines.append("| " + " | ".join([*cells, method.conserves, method.tops, method.reference]) + " |")
    return "\n".join(lines)


def _free() -> Scene:
    return Scene(Body(1.0, (1.0, 2.0, 2.5), (0.0, 0.0, 0.0)), momentum=(0.5, 1.0, 1.5))


def _cost(method: Method, top: Scene) -> float:
    """Seconds a step; 0 where the method does not apply."""
    if not method.applies_to(top.body):
        return 0.0
    begin = time.perf_counter()
    if method.adaptive:
        path = solve(top, 20.0, method.name, tol=_TOL)
    else:
        path = solve(top, _STEPS * _STEP, method.name, step=_STEP)
    return (time.perf_counter() - begin) / max(1, path.stats.steps)
