"""Steady rotations: motions with a constant angular velocity in the body, and their stability.

With the momentum M = J W + h, the vertical P, the angular velocity S of a turning support, and
a = com, all along the principal axes, the equations of motion are

    M' = M x W + mass g P x a + k P x J P,   P' = P x (W - S),   S' = S x (W - S).

A body rotates steadily about the vertical, W = rate P, if for some number l

    (l + s J) P = mass g a - rate h,   s = rate^2 - k,   |P| = 1.

In the components c of the right-hand side, the sum of c_i^2 / (l + s J_i)^2 is 1. Between two poles
this sum is convex in l, so it is 1 at most twice; beyond the outer poles it is 1 once. If c_i = 0,
l = -s J_i is a further solution. For a heavy body the axes P form the cone of Staude.

A steady rotation with the angular velocity W is stable if the energy minus <W, M> has a minimum or,
for a free body, an extremum among the motions with the same conserved momenta.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
from numpy.typing import ArrayLike

from .. import quaternion
from .._core import KIND_RTOL
from .._model.body import Body
from .._model.parameters import resolve_gravity
from .._model.scene import Scene
from .._model.starts import compute_rotations_to_vertical
from .._utils.arguments import (
    Array,
    ReadOnlyArrays,
    as_finite_array,
    as_float,
    as_three_floats,
    as_unit_name,
    freeze_arrays,
    short_repr,
    validate_type,
)
from .._utils.html import format_picture_as_html

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_LARGEST = 1e75  # numbers below this have fourth powers
_HALVINGS = 200  # of intervals between poles; the last ones no longer change them
_NEGLIGIBLE = 1e-15  # relative size of a component that is a rounding error
_GROWING = 1e-6  # relative size of an exponent beyond its rounding error


@dataclass(frozen=True, eq=False, repr=False)
class Steady(ReadOnlyArrays):
    """The result of kreisel.steady: n steady rotations. Arrays are read-only.

    scene      the rotations as n tops, each of which starts with its rotation
    rate       (n,) angular velocity about the axis [rad/T]
    axis       (n, 3) unit vectors along the angular velocity, in the frame of the body
    exponents  (n, k) exponents of small deviations that keep the conserved momenta [T^-1]: two for
               a free body, four for a heavy body, six on a turning support
    stability  (n,) "stable" if the integrals of motion prove it, "linear" if all exponents are
               imaginary but the energy has no extremum, and "unstable" if an exponent has a
               positive real part
    """

    scene: Scene
    rate: Array
    axis: Array
    exponents: npt.NDArray[np.complex128]
    stability: npt.NDArray[np.str_]

    def __post_init__(self) -> None:
        freeze_arrays(self)

    def __len__(self) -> int:
        return len(self.rate)

    def __repr__(self) -> str:
        counts = [f"{(self.stability == kind).sum()} {kind}" for kind in _KINDS]
        return f"<kreisel.Steady: {len(self)} rotations, {', '.join(counts)}>"

    @property
    def energy(self) -> Array:
        """(n,) energies, as path.energy [M L^2 T^-2]."""
        return self._compute("energy")

    @property
    def vertical_momentum(self) -> Array:
        """(n,) vertical momenta <m, e3> [M L^2 T^-1]."""
        return self._compute("vertical_momentum")

    @property
    def axial_momentum(self) -> Array:
        """(n,) axial momenta <m, apex> [M L^2 T^-1]."""
        return self._compute("axial_momentum")

    def _compute(self, name: str) -> Array:
        values: Array = self.scene._core_scenes.values(name)
        return values.reshape(len(self))

    def plot(self, *, axes: Axes | None = None, time_unit: str = "T") -> Axes:
        """Plot the energy over the vertical momentum, coloured by stability; return the axes.

        Raises ImportError if matplotlib is not installed.
        """
        from .._plot.charts import draw_steady_rotations

        return draw_steady_rotations(self, axes, as_unit_name("time_unit", time_unit))

    def _repr_html_(self) -> str | None:
        return format_picture_as_html(self.plot, repr(self))


_KINDS = "stable", "linear", "unstable"


@np.errstate(all="ignore")
def steady(
    body: Body,
    rate: ArrayLike | None = None,
    *,
    gravity: float | None = None,
    gradient: float = 0.0,
    turning: ArrayLike | None = None,
) -> Steady:
    """Return the steady rotations of a body, with their stability.

    A heavy body rotates steadily about the vertical, and a free body or gyrostat about an axis in
    the body. With `turning`, the rotations are the equilibria relative to the support, as of a
    satellite on a circular orbit.

    rate      angular velocity about the axis, a number or an array [rad/T]. Each rate has up to six
              rotations. Not given with `turning`
    gravity   as in kreisel.Scene
    gradient  as in kreisel.Scene
    turning   horizontal angular velocity of the support, for a body without rotors whose centre of
              mass is at the fixed point [rad/T]

    The momenta of wheels on free axles are determined by a start: `body` is then `scene.body`. If
    moments are equal, one of many equivalent rotations is returned.

    >>> import kreisel as kr
    >>> brick = kr.Body(1, (1, 2, 2.5), (0, 0, 0))
    >>> found = kr.steady(brick, 3.0)
    >>> for axis, stability in zip(found.axis.tolist(), found.stability):
    ...     print(axis, stability)
    [1.0, 0.0, 0.0] stable
    [0.0, 1.0, 0.0] unstable
    [0.0, 0.0, 1.0] stable

    Raises ValueError if the body has wheels without a start, and for a rate that is not finite.
    """
    if validate_type("body", body, Body).shape:
        raise TypeError("steady needs one body, not an array of them")
    if any(wheel[4] for wheel in body.wheels):
        raise ValueError("the start determines the momenta of free wheels: use scene.body")
    g = as_float("gravity", resolve_gravity(gravity, body))
    k = as_float("gradient", gradient)
    moments, rotor = np.array(body.moments), np.array(body.principal_rotor)
    lever = body.mass * g * np.array(body.principal_com)
    words: dict[str, Any] = {"gravity": g} | ({"gradient": k} if k else {})
    if turning is None:
        if rate is None:
            raise TypeError("rate is missing: give the angular velocity about the axis")
        rates = np.atleast_1d(as_finite_array("rate", rate, "a number or an array of numbers"))
        if rates.ndim > 1:
            raise ValueError(f"rate must be a number or a sequence, not {short_repr(rate)}")
        speed, size = float(np.abs(rates).max(initial=0.0)), float(moments.max())
        sizes = speed * size, speed * float(np.abs(rotor).max()), abs(k) * size, *np.abs(lever)
        if not max(sizes) < _LARGEST or not speed < _LARGEST:
            raise ValueError("rate, gravity or gradient is too large for this body")
        is_free = not lever.any() and not k
        found = [(w, P) for w in rates for P in _find_axes(moments, lever, rotor, w, k)]
        verticals = np.array([P for _, P in found]).reshape(-1, 3)
        speeds = np.array([w for w, _ in found])
        supports = speeds[:, None] * verticals
    else:
        is_free = False
        words["turning"] = as_three_floats("turning", turning)
        verticals, supports = _find_equilibria(body, rate, np.array(words["turning"]))
        speeds = np.linalg.norm(supports, axis=1)
    rows = [
        _linearize(moments, lever, rotor, k, P, S, turning is not None, is_free)
        for P, S in zip(verticals, supports, strict=True)
    ]
    kinds, exponents = ([row[i] for row in rows] for i in (0, 1))
    if body.kind == "lagrange":  # whose axial momentum is a further integral
        kinds = [_use_axial_momentum(*row) for row in rows]
    width = 6 if turning is not None else 2 if is_free else 4
    speeds = np.linalg.norm(supports, axis=1)
    axes = np.where(speeds[:, None] > 0.0, supports, verticals)
    axes = axes / np.linalg.norm(axes, axis=1, keepdims=True)
    frame = np.array([quaternion.turn(body.axes, (x, y, z)) for x, y, z in np.eye(3).tolist()])
    q = compute_rotations_to_vertical(verticals @ frame)
    velocities = supports @ frame
    if turning is not None:
        x, y, _ = quaternion.turn(tuple(q.T), tuple(velocities.T))
        angle = 0.5 * (np.arctan2(words["turning"][1], words["turning"][0]) - np.arctan2(y, x))
        zeros = np.zeros_like(angle)
        heading = np.cos(angle), zeros, zeros, np.sin(angle)
        q = np.stack(quaternion.multiply(heading, tuple(q.T)), axis=-1)
        velocities = np.zeros_like(velocities)
    scene = Scene(body, attitude=q, body_velocity=velocities, **words)
    return Steady(
        scene._note_varying_parameters([]),
        speeds,
        axes @ frame,
        np.array(exponents, np.complex128).reshape(-1, width),
        np.array(kinds, dtype=np.str_),
    )


def _find_axes(J: Array, lever: Array, rotor: Array, rate: float, k: float) -> list[Array]:
    """Return the unit vectors P along the principal axes with (l + s J) P = lever - rate * rotor.

    Components of the right-hand side that are rounding errors count as zero. In a plane of equal
    moments, axes are chosen for which one component is zero.
    """
    s, c, basis = rate * rate - k, lever - rate * rotor, np.eye(3)
    poles, given = -s * J, c
    c = np.where(np.abs(c) <= _NEGLIGIBLE * max(np.abs(c).max(), np.abs(poles).max()), 0.0, c)
    for i, j in itertools.combinations(range(3), 2):
        if abs(poles[i] - poles[j]) <= KIND_RTOL * np.abs(poles).max():
            poles[j] = poles[i]
            if c[j]:
                turn, length = np.eye(3), np.hypot(c[i], c[j])
                turn[i, i] = turn[j, j] = c[i] / length
                turn[i, j], turn[j, i] = c[j] / length, -c[j] / length
                basis, c = turn @ basis, np.where(np.arange(3) == j, 0.0, turn @ c)
    is_active, found = c != 0.0, []
    for root in _find_roots(poles[is_active], c[is_active]):
        P = np.zeros(3)
        P[is_active] = c[is_active] / (root - poles[is_active])
        found.append((root, P))
    for pole in set(poles[~is_active].tolist()) - set(poles[is_active].tolist()):
        P = np.zeros(3)
        P[is_active] = c[is_active] / (pole - poles[is_active])
        free, rest = np.flatnonzero(~is_active & (poles == pole)), 1.0 - P @ P
        is_double = len(free) == 1 and given.any()  # else one of many equivalent rotations
        for sign in (1.0, -1.0)[: 1 + is_double]:
            if rest > 0.0:
                P = np.where(np.arange(3) == free[0], sign * np.sqrt(rest), P)
                found.append((pole, P))
    axes = []
    for root, P in sorted(found, key=lambda pair: -pair[0]):
        for _ in range(2):  # Newton's method removes the rounding error of l near a pole
            gaps = root - poles
            matrix = np.block([[np.diag(gaps), P[:, None]], [2.0 * P, 0.0]])
            rest = np.array([*(gaps * P - basis @ given), P @ P - 1.0])
            step = np.linalg.lstsq(matrix, rest)[0]
            P, root = P - step[:3], root - step[3]
        axes.append(P / np.linalg.norm(P) @ basis)
    return axes


def _find_roots(poles: Array, c: Array) -> list[float]:
    """Return the numbers l at which the sum of c_i^2 / (l - pole_i)^2 is 1."""
    if not len(c):
        return []

    def f(x: float) -> float:
        return float((c / (x - poles)) @ (c / (x - poles))) - 1.0

    def slope(x: float) -> float:
        return float((c**2 / (x - poles) ** 3).sum())

    def bisect(function: Callable[[float], float], positive: float, negative: float) -> float:
        for _ in range(_HALVINGS):
            middle = 0.5 * (positive + negative)
            if function(middle) > 0.0:
                positive = middle
            else:
                negative = middle
        return negative

    ends, reach = np.sort(poles).tolist(), float(np.linalg.norm(c)) * (1.0 + 1e-15)
    roots = [bisect(f, ends[0], ends[0] - reach), bisect(f, ends[-1], ends[-1] + reach)]
    for left, right in itertools.pairwise(ends):
        lowest = bisect(slope, left, right)
        if f(lowest) < 0.0:
            roots += [bisect(f, left, lowest), bisect(f, right, lowest)]
    return roots


def _find_equilibria(body: Body, rate: object, turning: Array) -> tuple[Array, Array]:
    """Return the verticals P and the velocities S of a support along principal axes of the body."""
    if rate is not None:
        raise TypeError("give either rate or turning, not both")
    if any(body.com) or any(body.rotor):
        what = "rotors" if any(body.rotor) else "a centre of mass away from the fixed point"
        raise ValueError(f"steady with turning does not support a body with {what}")
    if turning[2] != 0.0 or not turning.any():
        raise ValueError("turning must be horizontal and not zero, as that of an orbit")
    axes = np.concatenate((np.eye(3), -np.eye(3)))
    pairs = [(P, N) for P in axes for N in axes if P @ N == 0.0]
    verticals, normals = np.moveaxis(np.array(pairs), 1, 0)
    return verticals, normals * np.linalg.norm(turning)


def _linearize(
    J: Array, lever: Array, h: Array, k: float, P: Array, S: Array, turns: bool, is_free: bool
) -> tuple[str, Any]:
    """Return the stability of a steady rotation and the exponents of small deviations.

    Deviations are those of M, and a rotation vector t of the body on a turning support, with
    dP = P x t and dS = S x t, or else dP. The second variation of

        (M - h) J^-1 (M - h) / 2 - <S, M> + <lever, P> + k <P, J P> / 2

    decides on the stability among deviations that do not change |P| and <M, P>, nor M of a free
    body.
    """
    M, W = J * S + h, S
    by_momentum = _cross(M) / J - _cross(W)
    by_vertical = -_cross(lever) + k * (_cross(P) * J - _cross(J * P))
    if is_free:
        matrix = by_momentum
    elif turns:
        by_turn = by_vertical @ _cross(P)
        matrix = np.block([[by_momentum, by_turn], [np.diag(1.0 / J), -_cross(S)]])
    else:
        matrix = np.block([[by_momentum, by_vertical], [_cross(P) / J, -_cross(W)]])
    values: Any = np.linalg.eigvals(matrix)
    conserved = 0 if turns else 1 if is_free else 2
    values = values[np.argsort(np.abs(values), kind="stable")][conserved:]
    values[np.abs(values) <= _GROWING * np.abs(values).max()] = 0.0
    potential = _bend(lever, P) + k * (_bend(J * P, P) + (_cross(P).T * J) @ _cross(P))
    mixed = -_cross(S)
    hessian = np.block([[np.diag(1.0 / J), mixed], [mixed.T, potential - _bend(M, S)]])
    if is_free:
        hessian, fixed = np.diag(1.0 / J) - (W @ M) / max(float(M @ M), 1e-300) * np.eye(3), M[None]
    elif turns:
        fixed = np.zeros((0, 6))
    else:
        fixed = np.array([[*P, *np.cross(M, P)], [0.0, 0.0, 0.0, *P]])
    kept = np.linalg.svd(fixed)[2][len(fixed) :]
    levels = np.linalg.eigvalsh(kept @ hessian @ kept.T)
    kind = "linear"
    if levels.min() > 0.0 or (is_free and levels.max() < 0.0):
        kind = "stable"
    elif values.real.max() > _GROWING * np.abs(values).max():
        kind = "unstable"
    return kind, values[np.lexsort((values.imag, values.real))]


def _use_axial_momentum(kind: str, exponents: Any) -> str:
    """Return "stable" for a rotation of a Lagrange top with different imaginary exponents."""
    rates = np.sort(exponents.imag)
    is_distinct = np.diff(rates[-2:]).min() > _GROWING * rates[-1]
    return "stable" if kind == "linear" and is_distinct else kind


def _cross(v: Array) -> Array:
    """Return the matrix that maps w to v x w."""
    x, y, z = v
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def _bend(c: Array, v: Array) -> Array:
    """Return the matrix B for which <c, v> changes by <t, B t> / 2 in the second order of t.

    The vector v, seen from a body that turns by t, changes by v x t + (v x t) x t / 2.
    """
    outer = np.outer(c, v)
    return 0.5 * (outer + outer.T) - (c @ v) * np.eye(3)
