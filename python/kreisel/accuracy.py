"""How far a path has gone astray: its attitude against one that is more exact."""
from __future__ import annotations

import numpy as np

from .methods import ELSE, EXACT, methods
from .path import Path
from .solve import solve


def estimate(path: Path) -> float:
    """The largest attitude error of the states [rad], by a second run: see Path.error."""
    if not path.digits and path.method != EXACT and methods[EXACT].suits(path.scene):
        return apart(path, solve(path.scene, path.t, EXACT))
    error = apart(path, solve(path.scene, path.t, ELSE, digits=30 if path.digits == 20 else 20))
    return error * 2.0**-34 if path.digits == 30 else error


def apart(a: Path, b: Path) -> float:
    """The largest angle between the attitudes of two paths, low words included: their difference loses no digit."""
    dot = (a.q * b.q).sum(axis=1)
    sign = np.where(dot < 0.0, -1.0, 1.0)[:, None]
    d = (sign * b.q - a.q) + (sign * b.q_low - a.q_low)
    vec = a.q[:, :1] * d[:, 1:] - d[:, :1] * a.q[:, 1:] - np.cross(a.q[:, 1:], d[:, 1:])        # of a* (b - a)
    return float(2.0 * np.arctan2(np.sqrt((vec**2).sum(axis=1)), np.abs(dot)).max())
