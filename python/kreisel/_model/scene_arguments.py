"""Validation of the constructor arguments of a scene.

The C library validates arguments that consist of plain numbers. If any argument is invalid or of
another type, all arguments are validated one by one in Python.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from numpy.typing import ArrayLike

from .._core import scene
from .._utils.errors import make_exception_from_status
from .._utils.validation import Quaternion, Vector, as_three_floats
from ..quaternion import unit
from .body import Body
from .environment import EnvironmentArguments
from .momentum import compute_angular_momentum

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation

# momentum, attitude, gravity, damping, turning, shaking, friction, and the bytes of a kr_scene
SceneData = tuple[Vector, Quaternion, float, Vector, Vector, Vector, float, bytes]


def validate_scene_arguments_in_core(
    body: Body,
    arguments: dict[str, ArrayLike],
    attitude: ArrayLike | Rotation | None,
    environment: tuple[object, object, object, object, object],
) -> SceneData | None:
    """Return scene data validated by the C library, or None if Python must do the validation."""
    if len(arguments) != 1:
        return None
    ((name, value),) = arguments.items()
    g, d, u, s, f = environment
    data = scene(body._block, value, attitude, g, d, u, s, f)
    if isinstance(data, tuple) and name != "momentum":
        v, q, environment_values = data[0], data[1], data[2:7]
        data = scene(
            body._block,
            _convert_velocity_to_momentum(body, name, q, v, environment_values[2]),
            q,
            *environment_values,
        )
    return data if isinstance(data, tuple) else None


def validate_scene_arguments(
    body: Body,
    arguments: dict[str, ArrayLike],
    attitude: ArrayLike | Rotation | None,
    attitude_xyzw: ArrayLike | None,
    environment: EnvironmentArguments,
) -> SceneData:
    """Validate the arguments of a scene one by one."""
    environment_values = environment.validate_single_top_environment(body)
    if attitude_xyzw is not None:
        if attitude is not None:
            raise ValueError("give either attitude or attitude_xyzw, not both")
        q = unit("attitude_xyzw", attitude_xyzw, last=True)
    else:
        q = (1.0, 0.0, 0.0, 0.0) if attitude is None else unit("attitude", attitude)
    if len(arguments) != 1:
        raise ValueError(
            "give exactly one of momentum, velocity, body_momentum, body_velocity, not "
            + (" and ".join(arguments) or "none")
        )
    ((name, value),) = arguments.items()
    m = _convert_velocity_to_momentum(
        body, name, q, as_three_floats(name, value), environment_values[2]
    )
    data = scene(body._block, m, q, *environment_values)
    if not isinstance(data, tuple):
        raise make_exception_from_status(
            data or "ERR_ARGUMENT", f"momentum {m}, attitude {q}, gravity {environment_values[0]!r}"
        )
    return data


def _convert_velocity_to_momentum(
    body: Body, name: str, q: Quaternion, value: Vector, turning: Vector
) -> Vector:
    """Return the angular momentum of a top, given the `value` of the initial condition `name`."""
    rotor = _replace_zeros_by_negative_zeros(body.principal_rotor) if any(body.rotor) else None
    moving = _replace_zeros_by_negative_zeros(turning) if any(turning) else None
    return compute_angular_momentum(name, body.moments, body.axes, q, value, rotor, moving)


def _replace_zeros_by_negative_zeros(vector: Vector) -> Vector:
    """Return the vector with zero components replaced by -0.0."""
    x, y, z = vector
    return x or -0.0, y or -0.0, z or -0.0
