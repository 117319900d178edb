"""Computation of the path of a fitted motion."""

from __future__ import annotations

import numpy as np

from .._results.path import Path
from .._solve.solve import solve
from .._utils.validation import Array
from .parameters import FitPoint, FreeParameters


def solve_fitted_motion(
    parameters: FreeParameters, pieces: tuple[tuple[float, FitPoint], ...], t: Array
) -> Path:
    """Return the path at increasing times; each state is computed from the start of its segment."""
    scene = parameters.to_scene(next(point for begin, point in pieces if begin == 0.0))
    begins = np.array([begin for begin, _ in pieces])
    owner = np.maximum(np.searchsorted(begins, t, side="right") - 1, 0)
    states, steps = [], []
    path = solve(scene, np.empty(0), "taylor")
    for k, (begin, point) in enumerate(pieces):
        times = t[owner == k] - begin
        for part in (times[times < 0.0][::-1], times[times >= 0.0]):
            if len(part):
                path = solve(parameters.to_scene(point, begin), part, "taylor")
                rows = path.states if part[0] >= 0.0 else path.states[::-1]
                shifted = rows.copy()
                shifted[:, 0] += begin
                states.append(shifted)
                steps.append(path.stats)
    if len(states) == 1 and len(pieces) == 1 and path.t[0] >= 0.0:
        return path
    all_states = np.ascontiguousarray(np.concatenate(states))
    return Path(scene, all_states, steps[-1], path._options)
