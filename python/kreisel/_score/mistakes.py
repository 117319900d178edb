"""Common mistakes of programs that rotate bodies, and the motion that each of them causes.

With the inertia J about the fixed point, the momentum h of rotors, the damping D, the angular
velocity W in the body and the torque T of gravity in the body, the equations are

    J W' = (J W + h) x W + T - D W,    q' = q W / 2.

A program may also solve them in space, with the rotated inertia. A wrong motion solves equations
with one mistake, or is the true motion of a scene with one mistake. A relabelling maps the
attitudes in a file to those that may have been meant.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from .._results.results import Error
from .._utils.arguments import Array
from ..quaternion import conjugate, multiply
from .suite import Case, join

_DEGREE = np.pi / 180.0
_ANGLE_PER_STEP = 0.15  # of the fourth-order method that solves wrong equations [rad]


# Relabellings that bring the first attitude to the true one.
ALIGNED = "other axes of the body", "other axes of space"


class Motion(NamedTuple):
    """The attitudes (n, 4) of a program with the mistake `name`, or '' without a mistake."""

    name: str
    q: Array


def _multiply(a: Array, b: Array) -> Array:
    return np.stack(multiply(tuple(a.T), tuple(b.T)), axis=-1)


def _list_reflections() -> list[Array]:
    """Return the matrices that reverse one axis, or exchange two."""
    units = np.eye(3)
    reversals = [np.diag(1.0 - 2.0 * row) for row in units]
    return [*reversals, *(units[order] for order in ([1, 0, 2], [0, 2, 1], [2, 1, 0]))]


def list_relabellings(q: Array, true: Array) -> Iterator[Motion]:
    """Return the attitudes `q` of a file as they may have been meant.

    `true` is the true attitude of the first row.
    """
    yield Motion("", q)
    inverse, last = np.array([1.0, -1.0, -1.0, -1.0]), q[:, [3, 0, 1, 2]]
    yield Motion("inverse attitude", q * inverse)
    yield Motion("scalar last read as scalar first", last)
    yield Motion("scalar last read as scalar first and inverse attitude", last * inverse)
    yield Motion("scalar first read as scalar last", q[:, [1, 2, 3, 0]])
    for matrix in _list_reflections():
        yield Motion("left-handed axes", np.column_stack([q[:, 0], -q[:, 1:] @ matrix]))
    yield Motion("y up instead of z", np.column_stack([q[:, 0], q[:, 1], -q[:, 3], q[:, 2]]))
    first = np.array(conjugate(tuple(q[0])))
    yield Motion(ALIGNED[0], _multiply(q, _multiply(first[None], true[None])))
    yield Motion(ALIGNED[1], _multiply(_multiply(true[None], first[None]), q))


def list_wrong_motions(case: Case, times: Array, spin: float) -> Iterator[Motion]:
    """Return wrong motions at ascending times, for angular velocities of up to about `spin`."""
    scene = case.scene
    for name, change in _list_changes(case):
        with suppress(ValueError, Error):  # a change that the scene does not allow
            wrong = replace(case, scene=scene.replace(**change()))
            yield Motion(name, join(wrong.solve(times), "q"))
    if case.impulses:
        yield Motion("no impulses", join(replace(case, impulses=()).solve(times), "q"))
    others = (*scene.turning, scene.shaking[0], scene.friction, scene.gradient, *case.impulses)
    if not any(map(np.any, others)):
        for equations in _WRONG_EQUATIONS:
            with suppress(ValueError), np.errstate(all="ignore"):  # of wheels in massless frames
                q = _solve_wrong_equations(case, times, spin, equations)
                yield Motion(equations.name, q)


def _list_changes(case: Case) -> Iterator[tuple[str, Callable[[], dict[str, Any]]]]:
    """Yield mistakes with functions that return the parameters that each of them changes."""
    scene, body = case.scene, case.scene.body
    start = join(case.solve(np.zeros(1)), "body_velocity")[0]

    def change_body(**words: Any) -> dict[str, Any]:
        return {"body": replace(body, unphysical=True, **words), "body_velocity": start}

    yield "radians read as degrees", lambda: {"body_velocity": start * _DEGREE}
    yield "degrees read as radians", lambda: {"body_velocity": start / _DEGREE}
    yield "first angular velocity taken in space", lambda: {"velocity": start}
    if any(body.com):
        steiner = body.mass * (
            np.eye(3) * np.dot(body.com, body.com) - np.outer(body.com, body.com)
        )
        yield "no gravity", lambda: {"gravity": 0.0}
        yield "gravity upwards", lambda: {"gravity": -scene.gravity}
        yield (
            "inertia about the centre of mass",
            lambda: change_body(inertia=body._tensors - steiner),
        )
    if any(body.rotor):
        yield "no rotor", lambda: change_body(rotor=(0.0,) * 3)
        yield "wrong sign of the rotor", lambda: change_body(rotor=[-x for x in body.rotor])
    if any(scene.damping):
        yield "no damping", lambda: {"damping": 0.0}
        yield "damping as a rate", lambda: {"damping": np.multiply(scene.damping, body.moments)}
    if scene.friction:
        yield "no friction", lambda: {"friction": 0.0}
    if any(scene.turning):
        yield "support at rest", lambda: {"turning": (0.0,) * 3, "body_velocity": start}
    if scene.shaking[0]:
        yield "support does not shake", lambda: {"shaking": (0.0,) * 3}


_RIGHT, _NONE, _INVERSE = "body to space", "none", "space to body"


class _WrongEquations(NamedTuple):
    """Wrong equations of motion in space, where the torque is along the axes of space.

    inertia  the rotation that brings the inertia into space
    factor   of the gyroscopic term, or None if the momentum is integrated
    torque   a rotation of the torque
    """

    name: str
    inertia: str
    factor: float | None
    torque: str = _NONE


_WRONG_EQUATIONS = [
    _WrongEquations("no gyroscopic term", _RIGHT, 0.0),
    _WrongEquations("wrong sign of the gyroscopic term", _RIGHT, -1.0),
    _WrongEquations("angular velocity of the body used in space", _NONE, 1.0, _INVERSE),
    _WrongEquations("inertia not rotated into space", _NONE, 1.0),
    _WrongEquations("inertia not rotated into space", _NONE, None),
    _WrongEquations("inertia rotated by the inverse", _INVERSE, 1.0),
    _WrongEquations("inertia rotated by the inverse", _INVERSE, None),
    _WrongEquations("torque of space used in the body", _RIGHT, 1.0, _RIGHT),
]


def _rotate(q: Array) -> Array:
    """Return the matrix of the rotation by a quaternion of any norm."""
    w, x, y, z = q / np.sqrt(q @ q)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    matrix: Array = np.eye(3) + 2.0 * (w * cross + cross @ cross)
    return matrix


def _cross(a: Array, b: Array) -> Array:
    """Return the cross product of two vectors, faster than NumPy."""
    x, y, z = a.tolist()
    u, v, w = b.tolist()
    return np.array([y * w - z * v, z * u - x * w, x * v - y * u])


def _solve_wrong_equations(
    case: Case, times: Array, spin: float, equations: _WrongEquations
) -> Array:
    """Return the attitudes that wrong equations give, by the classical Runge-Kutta method.

    The vector v is the angular velocity or the momentum in space.
    """
    _, frame, factor, torque = equations
    scene, body = case.scene, case.scene.body
    tensor, inverse = body._tensors, np.linalg.inv(body._tensors)
    lever, rotor = body.mass * scene.gravity * np.array(body.com), np.array(body.rotor)
    axes = _rotate(np.array(body.axes))
    damping = axes @ np.diag(scene.damping) @ axes.T
    q, v = np.array(scene.attitude), np.array(scene.momentum)
    if factor is not None:
        r = _rotate(q)
        v = r @ inverse @ (r.T @ v - rotor)

    def rates(q: Array, v: Array) -> tuple[Array, Array]:
        r = _rotate(q)
        rotations = {_RIGHT: r, _NONE: np.eye(3), _INVERSE: r.T}
        a, h = rotations[frame], r @ rotor
        w = v if factor is not None else a @ (inverse @ (a.T @ (v - h)))
        change = rotations[torque] @ (r @ (_cross(r[2], lever) - damping @ (r.T @ w)))
        if factor is not None:
            gyroscopic = factor * _cross(a @ (tensor @ (a.T @ w)) + h, w)
            change = a @ (inverse @ (a.T @ (change + gyroscopic)))
        return 0.5 * np.array(multiply((0.0, *w.tolist()), tuple(q.tolist()))), change

    attitudes, t = [], 0.0
    for end in times.tolist():
        n = int(np.ceil((end - t) * spin / _ANGLE_PER_STEP))
        h = (end - t) / max(n, 1)
        for _ in range(n):
            a, f = rates(q, v)
            b, g = rates(q + 0.5 * h * a, v + 0.5 * h * f)
            c, e = rates(q + 0.5 * h * b, v + 0.5 * h * g)
            d, s = rates(q + h * c, v + h * e)
            q, v = q + h / 6.0 * (a + 2.0 * (b + c) + d), v + h / 6.0 * (f + 2.0 * (g + e) + s)
        attitudes.append(q)
        t = end
    return np.array(attitudes)
