"""Constructors of ensembles from Euler angles or from the spin of symmetric tops.

The results are bitwise equal to those of the constructors for a single scene.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from .._core import values
from .._utils.validation import Array, as_bool
from ..quaternion import conjugate, multiply
from .bodies import Bodies
from .body import Body
from .broadcasting import (
    BatchParameter,
    compute_vectors_in_blocks,
    split_components,
    stack_components,
    validate_parameter,
)
from .ensemble_data import (
    EnsembleBase,
    S,
    compute_common_top_shape,
    compute_start_momenta,
    make_invalid_member_error,
    validate_body_type,
)
from .environment import EnvironmentArguments, validate_ensemble_environment, validate_gravities
from .euler_angles import (
    cos,
    find_symmetry_moments,
    find_symmetry_moments_of_body,
    is_steady_precession_requested,
    quaternion_from_euler,
    refuse_rotor_in_steady_precession,
    solve_steady_precession,
    validate_tilt_angle,
    velocity_from_euler,
)

Components = tuple[Array, Array, Array]


class EnsembleConstructors(EnsembleBase[S]):
    """Constructors of kr.Ensemble from Euler angles and rates."""

    @classmethod
    def from_euler(
        cls,
        body: Body | Bodies,
        angles: ArrayLike,
        rates: ArrayLike = (0.0, 0.0, 0.0),
        *,
        degrees: bool = False,
        gravity: ArrayLike | None = None,
        damping: ArrayLike | None = None,
        turning: ArrayLike | None = None,
        shaking: ArrayLike | None = None,
        friction: ArrayLike | None = None,
    ) -> Self:
        """Build an array of tops from z-x-z Euler angles and their rates (see Scene.from_euler).

        `angles` [rad] and `rates` [rad/T] have the shape (..., 3): precession, nutation and spin.
        `degrees` applies to all tops. The arguments from `gravity` to `friction` have the same
        meaning as in the constructor of Ensemble.

        >>> import kreisel as kr
        >>> body = kr.Body.cone(radius=1, height=2, pivot=(0, 0, 0), mass=1)
        >>> kr.Ensemble.from_euler(body, [(0, 1, 0), (0, 2, 0)], rates=(0, 0, 5), gravity=1).shape
        (2,)
        """
        bodies, in_degrees = validate_body_type(body), as_bool("degrees", degrees)
        parameters = [
            validate_parameter("angles", angles, (3,), degrees=in_degrees),
            validate_parameter("rates", rates, (3,), degrees=in_degrees),
        ]
        angle_components, rate_components = (
            split_vector_components(each.radians) for each in parameters
        )
        environment = EnvironmentArguments(gravity, damping, turning, shaking, friction)
        return cls._build_from_euler_angles(
            bodies,
            parameters,
            angle_components,
            rate_components,
            environment.mark_as_degrees() if in_degrees else environment,
            partial(cls._one.from_euler, degrees=in_degrees),
        )

    @classmethod
    def _build_from_euler_angles(
        cls,
        body: Body | Bodies,
        parameters: list[BatchParameter],
        angles: Components,
        rates: Components,
        environment: EnvironmentArguments,
        one: Callable[..., S],
    ) -> Self:
        """Build tops whose Euler angles and rates have already been computed.

        Raises the same exception as the constructor `one` would for the first invalid member.
        """
        environment_parameters, columns = validate_ensemble_environment(environment, body)
        compute_common_top_shape(body, [*parameters, *environment_parameters])
        attitudes, frame_attitudes = (
            stack_components(*quaternion_from_euler(angles)),
            cls._compute_euler_frame_attitudes(body),
        )
        shape = np.broadcast_shapes(attitudes.shape[:-1], frame_attitudes.shape[:-1])
        q = compute_vectors_in_blocks(
            lambda a, b: multiply(a, conjugate(b)), shape, 4, attitudes, frame_attitudes
        )
        with np.errstate(all="ignore"):
            start = BatchParameter(
                "velocity", stack_components(*velocity_from_euler(angles, rates)), (3,)
            )
        columns["momentum"] = compute_start_momenta(body, start, q, columns["turning"])
        columns["attitude"] = q
        return cls.__new__(cls)._store_ensemble_columns(
            body, [*parameters, *environment_parameters], columns, one
        )

    @classmethod
    def _compute_euler_frame_attitudes(cls, body: Body | Bodies) -> Array:
        """Return the quaternions for the Euler angles of bodies aligned with the space frame."""
        names = "precession_angle", "nutation", "spin_angle"
        if isinstance(body, Body):
            one = cls._one(body, momentum=(0.0, 0.0, 0.0), gravity=0.0)
            angles = [values(name, one._block, one._start_state)[0] for name in names]
        else:
            ensemble = cls(body, momentum=(0.0, 0.0, 0.0), gravity=0.0)
            angles = [ensemble._core_scenes.values(name).reshape(ensemble.shape) for name in names]
        return stack_components(*quaternion_from_euler((angles[0], angles[1], angles[2])))

    @classmethod
    def spinning(
        cls,
        body: Body | Bodies,
        spin: ArrayLike,
        tilt: ArrayLike = 0.0,
        precession: ArrayLike | None = None,
        *,
        steady: bool = False,
        fast: bool = False,
        degrees: bool = False,
        gravity: ArrayLike | None = None,
        damping: ArrayLike | None = None,
        turning: ArrayLike | None = None,
        shaking: ArrayLike | None = None,
        friction: ArrayLike | None = None,
    ) -> Self:
        """Build an array of symmetric tops that spin about their axes (see Scene.spinning).

        `spin`, `tilt` and `precession` are numbers or arrays. The arguments `gravity` to `friction`
        have the same meaning as in Ensemble. `steady`, `fast` and `degrees` apply to all tops.

        >>> import kreisel as kr
        >>> body = kr.Body.cone(radius=1, height=2, pivot=(0, 0, 0), mass=1)
        >>> tops = kr.Ensemble.spinning(body, spin=[[20], [40]], tilt=[0.1, 0.2], gravity=1)
        >>> tops.shape, tops.axes
        ((2, 2), ('spin', 'tilt'))
        """
        bodies, in_degrees = validate_body_type(body), as_bool("degrees", degrees)
        one: Any = partial(cls._one.spinning, degrees=in_degrees)
        parameters = [
            validate_parameter("spin", spin, degrees=in_degrees),
            validate_tilts(tilt, in_degrees),
        ]
        rate, angle = (each.radians for each in parameters)
        find_symmetry_moments_of_bodies(bodies)
        environment = EnvironmentArguments(gravity, damping, turning, shaking, friction)
        environment = environment.mark_as_degrees() if in_degrees else environment
        if is_steady_precession_requested(steady, fast, precession, environment):
            one = partial(one, steady=True, fast=fast)
            precession_rate = compute_steady_precession_rates(
                bodies, [*parameters, validate_gravities(gravity, bodies)], fast, one
            )
        else:
            initial = 0.0 if precession is None else precession
            parameters.append(validate_parameter("precession", initial, degrees=in_degrees))
            precession_rate = parameters[-1].radians
        compute_common_top_shape(bodies, parameters)
        nothing = np.zeros(())
        with np.errstate(all="ignore"):
            rates = precession_rate, nothing, rate - precession_rate * cos(angle)
        return cls._build_from_euler_angles(
            bodies, parameters, (nothing, angle, nothing), rates, environment, one
        )


def split_vector_components(vector: Array) -> Components:
    """Split vectors into their three components."""
    x, y, z = split_components(vector)
    return x, y, z


def validate_tilts(tilts: ArrayLike, degrees: bool) -> BatchParameter:
    """Validate the parameter `tilt`; raise ValueError for angles outside [0, pi]."""
    parameter = validate_parameter("tilt", tilts, degrees=degrees)
    angle = parameter.radians
    bad = ~((angle >= 0.0) & (angle <= math.pi))
    if bad.any():
        parameter.raise_error_of_first_bad_value(
            bad, lambda _, one: validate_tilt_angle(one, parameter.degrees)
        )
    return parameter


def find_symmetry_moments_of_bodies(body: Body | Bodies) -> tuple[Array, Array]:
    """Return the transverse and axial moments of inertia of symmetric bodies.

    Raises ValueError with the index of the first body that is not symmetric about its apex.
    """
    i1, i3, is_symmetric = find_symmetry_moments(
        np.asarray(body.moments), np.asarray(body.principal_com)
    )
    if not is_symmetric.all():
        index = tuple(map(int, np.unravel_index(int(is_symmetric.argmin()), is_symmetric.shape)))
        try:
            find_symmetry_moments_of_body(body if isinstance(body, Body) else body[index])
        except ValueError as error:
            raise ValueError(f"body{list(index)}: {error}" if index else str(error)) from None
    return i1, i3


def compute_steady_precession_rates(
    body: Body | Bodies,
    parameters: Sequence[BatchParameter],
    fast: bool,
    one: Callable[..., object],
) -> Array:
    """Compute the rates of steady precession of several tops.

    Raises ValueError with the index of the first member for which no steady precession exists.
    """
    refuse_rotor_in_steady_precession(body)
    shape = compute_common_top_shape(body, parameters)
    rate, angle, gravity = (each.radians for each in parameters)
    i1, i3 = find_symmetry_moments_of_bodies(body)
    x, y, z = split_components(np.asarray(body.com))
    with np.errstate(all="ignore"):
        lever = np.hypot(np.hypot(x, y), z) if isinstance(body, Bodies) else math.hypot(x, y, z)
        torque = np.asarray(body.mass) * gravity * lever
    rates, exists = solve_steady_precession(i1, i3, torque, rate, angle, fast)
    exists = np.broadcast_to(exists, shape)
    if not exists.all():
        index = tuple(map(int, np.unravel_index(int(exists.argmin()), shape)))
        raise make_invalid_member_error(body, parameters, one, shape, index)
    return rates
