"""Turning points of the apex of a closed form: the roots of its cubic."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from .._core import exact_turning, statuses
from .._utils.validation import Array, read_only
from .scene import Scene


@dataclass(frozen=True, eq=False)
class TurningPoints:
    """Turning points of n scenes; each field is an array (n,).

    Least and greatest nutation [rad], the first times at which they occur [T], the critical spin
    [T^-1], the type of motion, and the coefficients of the potential.
    """

    least: Array
    greatest: Array
    t_least: Array
    t_greatest: Array
    critical_spin: Array
    motion_type: npt.NDArray[np.str_]
    rows: Array


def turning_points_from_rows(rows: Array, motion_type: npt.NDArray[np.str_]) -> TurningPoints:
    """Build the turning points from the rows of the core and the types of motion."""
    least, greatest, t_least, t_greatest, spin = (read_only(x.copy()) for x in rows.T[:5])
    motion_type.flags.writeable = False
    return TurningPoints(least, greatest, t_least, t_greatest, spin, motion_type, rows)


def compute_turning_points(scene: Scene) -> TurningPoints:
    """Compute the turning points of one scene; raise ValueError if it has none."""
    status, row, motion_type = exact_turning(scene._block)
    if status != "OK":
        raise ValueError(explain_no_turning_points(status, scene))
    return turning_points_from_rows(row[None], np.array([motion_type]))


def explain_no_turning_points(status: str, scene: Scene) -> str:
    """Explain why a scene has no turning points, from the core's status."""
    if status != "ERR_METHOD":
        return f"{statuses[status][1]}: {scene!r}"
    what = "a damped top" if scene._is_damped else f"this one, of kind {scene.body.kind!r},"
    return (
        "turning points exist for a Lagrange top, and for a body that is symmetric about its apex "
        f"and free of torque; the nutation of {what} is not periodic"
    )
