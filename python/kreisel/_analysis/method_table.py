"""The table of methods, with the measured cost of a step relative to a step of `rk4`."""

from __future__ import annotations

import time

from .._model.scene import Scene
from .._options.methods import Method, Methods
from .._solve.solve import solve
from ..scenes import asymmetric, dzhanibekov, thesis

_STEPS, _STEP, _TOL = 4000, 0.02, 1e-10
_ROUNDS = 9
_PEER = "rk4"
_COLUMNS = (
    "| method | order | a step costs: Lagrange | asymmetric | free | keeps to rounding | for "
    "| reference |"
)
_PAGE = """# Methods

Made by `kreisel methods --markdown > METHODS.md`, from the table in the core. What a step costs is
in steps of {peer} on the same top in the same run (each the least of some rounds; here one was
{nanoseconds:.0f} ns on the first top). It is a Lagrange top, an asymmetric one, and one held at
its centre of mass; empty: not for this top, or without steps. An adaptive method steps at a
tolerance of {tol:g}, and so as far as that lets it. `kreisel methods NAME` says more.

{table}
"""


def format_methods_page(methods: Methods) -> str:
    """Return the text of METHODS.md."""
    costs = _measure_costs(methods)
    return _PAGE.format(
        peer=_PEER, nanoseconds=1e9 * costs[_PEER][0], tol=_TOL, table=_format_rows(methods, costs)
    )


def _format_rows(methods: Methods, costs: dict[str, list[float]]) -> str:
    lines = [_COLUMNS, "| --- | ---: | ---: | ---: | ---: | --- | --- | --- |"]
    for method in methods.values():
        cells = [method.name, str(method.order) if method.order else "varies"]
        cells += [
            _format_ratio(cost / peer) if cost else ""
            for cost, peer in zip(costs[method.name], costs[_PEER], strict=True)
        ]
        lines.append(
            "| " + " | ".join([*cells, method.conserves, method.tops, method.reference]) + " |"
        )
    return "\n".join(lines)


def _format_ratio(ratio: float) -> str:
    return f"{ratio:.2f}" if ratio < 1 else f"{ratio:.1f}" if ratio < 10 else f"{ratio:.0f}"


def _measure_costs(methods: Methods) -> dict[str, list[float]]:
    """Measure the run time per step [s] of each method on each of three tops."""
    tops = [thesis, asymmetric.replace(attitude=thesis.attitude), dzhanibekov]
    timed = [(method, top) for method in methods.values() for top in tops]
    samples = [[_measure_cost(method, top) for method, top in timed] for _ in range(_ROUNDS)]
    costs = iter([min(sample) for sample in zip(*samples, strict=True)])
    return {name: [next(costs) for _ in tops] for name in methods}


def _measure_cost(method: Method, top: Scene) -> float:
    """Measure the run time per step [s]; return 0 if the method does not apply or has no steps."""
    if method.exact or not method.applies_to(top.body):
        return 0.0
    begin = time.perf_counter()
    if method.adaptive:
        path = solve(top, 20.0, method.name, tol=_TOL)
    else:
        path = solve(top, _STEPS * _STEP, method.name, step=_STEP)
    return (time.perf_counter() - begin) / max(1, path.stats.steps)
