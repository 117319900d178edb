"""Bodies: mass, inertia and centre of mass as their user describes them; the principal axes follow."""
from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Self

import numpy as np

from . import _core, check, errors
from .check import Array, Quaternion, Vector, VectorLike


@dataclass(frozen=True, init=False)
class Body:
    """A rigid body that turns about the origin of the frame in which it is described.

    mass     [M], positive
    inertia  about the origin [M L^2]: three moments along the axes of the frame, or a symmetric 3x3 matrix
    com      centre of mass [L]

    Its principal moments must be positive, none larger than the other two together (with a relative slack of 1e-12:
    plates and rods are bodies). Raises TypeError for what is not a number and ValueError for what is not a body.
    """

    mass: float
    inertia: Vector | tuple[Vector, Vector, Vector]
    com: Vector
    _block: tuple[float, ...] = field(init=False, repr=False, compare=False)    # kr_body: mass, moments, com, axes

    def __init__(self, mass: float, inertia: Any, com: VectorLike) -> None:
        tensor = _tensor("inertia", inertia)
        described = check.positive("mass", mass), _described(tensor), check.vector("com", com)
        status, block = _core.body_from_tensor(described[0], tensor, described[2])
        if status != "OK":
            raise errors.refusal(status, _violation(tensor))
        for name, value in zip(("mass", "inertia", "com", "_block"), (*described, tuple(block.tolist()))):
            object.__setattr__(self, name, value)

    @classmethod
    def cuboid(cls, half: VectorLike, pivot: VectorLike, density: float = 1.0) -> Self:
        """A homogeneous cuboid with edges along the axes: half their lengths [L], and its density [M L^-3].

        pivot  the fixed point, seen from the centre [L]; it may lie outside
        """
        a, b, c = (check.positive("half", x) for x in check.vector("half", half))
        mass = check.positive("mass of the cuboid", 8.0 * check.positive("density", density) * a * b * c)
        third = mass / 3.0
        xx, yy, zz = third * a * a, third * b * b, third * c * c
        return cls.from_com(mass, (yy + zz, zz + xx, xx + yy), (0.0, 0.0, 0.0), pivot)

    @classmethod
    def symmetric(cls, mass: float, i1: float, i3: float, height: float) -> Self:
        """A Lagrange top: moments i1, i1, i3 at the fixed point [M L^2], centre of mass at (0, 0, height) [L]."""
        one, three = check.number("i1", i1), check.number("i3", i3)
        return cls(mass, (one, one, three), (0.0, 0.0, check.number("height", height)))

    @classmethod
    def from_com(cls, mass: float, inertia_about_com: Any, com: VectorLike, pivot: VectorLike) -> Self:
        """A body whose inertia [M L^2] is known about its centre of mass; com and the fixed point seen from anywhere [L].

        Steiner's theorem (Bodack 2008, 2.14): J = J_com + mass (|a|^2 1 - a a^t), a = com - pivot.
        """
        tensor = _tensor("inertia_about_com", inertia_about_com)
        a = np.subtract(check.vector("com", com), check.vector("pivot", pivot))
        with np.errstate(over="ignore", invalid="ignore"):
            products = check.positive("mass", mass) * np.outer(a, a)
            xx, yy, zz = products.diagonal()
            np.fill_diagonal(products, 0.0)
            return cls(mass, tensor + (np.diag((yy + zz, zz + xx, xx + yy)) - products), a)

    @property
    def moments(self) -> Vector:
        """The principal moments at the fixed point [M L^2], along N, B, T."""
        _, i1, i2, i3, *_ = self._block
        return i1, i2, i3

    @property
    def axes(self) -> Quaternion:
        """The rotation (w, x, y, z) from the principal axes N, B, T to the frame in which the body was described.

        A diagonal inertia is its own principal frame; else the principal axes nearest the described ones are taken,
        right-handed, T along the symmetry axis of a Lagrange top.
        """
        *_, w, x, y, z = self._block
        return w, x, y, z

    @property
    def principal_com(self) -> Vector:
        """The centre of mass along N, B, T [L]."""
        x, y, z = self._block[4:7]
        return x, y, z

    @property
    def kind(self) -> str:
        """'euler', 'lagrange', 'kowalewski', 'goryachev_chaplygin' or 'general', up to 1e-12 relative."""
        return _core.body_kind(self._block, _core.KIND_RTOL)


def _tensor(name: str, value: Any) -> Array:
    what = "3 moments or a symmetric 3x3 matrix"
    given = check.array(name, value, what)
    if given.shape not in ((3,), (3, 3)):
        raise ValueError(f"{name} must be {what}, not {value!r}")
    tensor = np.diag(given) if given.ndim == 1 else given
    with np.errstate(over="ignore"):
        skew = np.abs(tensor - tensor.T).max()
    if skew > _core.KIND_RTOL * np.abs(tensor).max():
        raise ValueError(f"{name} must be {what}, not {value!r}")
    return tensor


def _described(tensor: Array) -> Any:
    """Three moments where that is all, else three rows."""
    diagonal = tensor.diagonal()
    return tuple(diagonal.tolist()) if (tensor == np.diag(diagonal)).all() else tuple(map(tuple, tensor.tolist()))


def _violation(tensor: Array) -> str:
    """Which of the principal moments is not what it must be."""
    diagonal = (tensor == np.diag(tensor.diagonal())).all()
    moments = (tensor.diagonal() if diagonal else np.linalg.eigvalsh(tensor)).tolist()
    least, middle, largest = sorted(moments)
    wrong = f"{least!r} is not positive" if not least > 0.0 else f"{largest!r} > {least!r} + {middle!r}"
    return f"{wrong} in {moments}"
