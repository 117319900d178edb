"""Turning points of the apex, computed from the roots of a cubic polynomial."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from .._core import exact_turning, statuses
from .._utils.validation import Array, freeze_array
from .environment import list_disturbances
from .scene import Scene


@dataclass(frozen=True, eq=False)
class TurningPoints:
    """Turning points of the apex in n motions. All fields except `rows` are arrays of shape (n,).

    least, greatest      least and greatest nutation [rad]
    t_least, t_greatest  first times at which they occur [T]
    critical_spin        spin above which an upright top is a sleeping top [rad/T]; a rotor along
                         the apex reduces it
    motion_type          the type of motion, as text
    rows                 (n, 10) rows of the core: the numbers above, and coefficients of the
                         potential
    """

    least: Array
    greatest: Array
    t_least: Array
    t_greatest: Array
    critical_spin: Array
    motion_type: npt.NDArray[np.str_]
    rows: Array


def build_turning_points_from_rows(rows: Array, motion_type: npt.NDArray[np.str_]) -> TurningPoints:
    """Build the turning points from the array computed by the C library."""
    least, greatest, t_least, t_greatest, spin = (freeze_array(x.copy()) for x in rows.T[:5])
    motion_type.flags.writeable = False
    return TurningPoints(least, greatest, t_least, t_greatest, spin, motion_type, rows)


def compute_turning_points(scene: Scene) -> TurningPoints:
    """Compute the turning points of the motion of a scene; raise ValueError if there are none."""
    status, row, motion_type = exact_turning(scene._block)
    if status != "OK":
        raise ValueError(explain_no_turning_points(status, scene))
    return build_turning_points_from_rows(row[None], np.array([motion_type]))


def explain_no_turning_points(status: str, scene: Scene) -> str:
    """Explain why the turning points of a motion are not defined."""
    if status != "ERR_METHOD":
        return f"{statuses[status][1]}: {scene!r}"
    description = (
        "a damped top" if scene._has_damping else f"this one, of kind {scene.body.kind!r},"
    )
    description += " with a rotor" if any(scene.body.rotor) else ""
    description += "".join(
        [f" with {name}" for name in list_disturbances(scene) if name != "damping"]
    )
    return (
        "turning points exist for a Lagrange top, and for a body that is symmetric about its apex "
        f"and free of torque; the nutation of {description} is not periodic"
    )
