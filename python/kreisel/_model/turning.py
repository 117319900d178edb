"""Turning points of the apex of a closed form: the roots of its cubic."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from .._core import exact_turning, statuses
from .._ground.arguments import Array, frozen
from .scene import Scene


@dataclass(frozen=True, eq=False)
class Turnings:
    """Turning points of n scenes; each field is an array (n,).

    Least and greatest nutation [rad], the first times at which they occur [T], the critical spin
    [T^-1], the type of motion, and the coefficients of the potential.
    """

    least: Array
    greatest: Array
    t_least: Array
    t_greatest: Array
    critical_spin: Array
    course: npt.NDArray[np.str_]
    rows: Array


def turnings(rows: Array, course: npt.NDArray[np.str_]) -> Turnings:
    """Build the turning points from the rows of the core and the types of motion."""
    least, greatest, t_least, t_greatest, spin = (frozen(x.copy()) for x in rows.T[:5])
    course.flags.writeable = False
    return Turnings(least, greatest, t_least, t_greatest, spin, course, rows)


def turning(scene: Scene) -> Turnings:
    """Compute the turning points of one scene; raise ValueError if it has none."""
    status, row, course = exact_turning(scene._block)
    if status != "OK":
        raise ValueError(no_turning(status, scene))
    return turnings(row[None], np.array([course]))


def no_turning(status: str, scene: Scene) -> str:
    """Explain why a scene has no turning points, from the core's status."""
    if status != "ERR_METHOD":
        return f"{statuses[status][1]}: {scene!r}"
    what = "a damped top" if scene._is_damped else f"this one, of kind {scene.body.kind!r},"
    return (
        "turning points are those of a Lagrange top, or of a body that is symmetric about its apex "
        f"and free of torque; the apex of {what} has none that come again"
    )
