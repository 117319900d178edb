"""Bodies: mass, inertia and centre of mass as their user describes them; the principal axes
follow."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import combinations
from struct import unpack
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from .._core import KIND_RTOL, body_from_tensor, body_kind
from .._ground.arguments import Array, Quaternion, Vector, array, number, positive, vector
from .._ground.refusals import refusal
from .toml import a_table, made


@dataclass(frozen=True, init=False)
class Body:
    """A rigid body that turns about the origin of the frame in which it is described.

    mass     [M], positive
    inertia  about the origin [M L^2]: three moments along the axes of the frame, or a symmetric 3x3
             matrix
    com      centre of mass [L]

    Its principal moments must be positive, none larger than the other two together (with a
    relative slack of 1e-12: plates and rods are bodies). Raises TypeError for what is not a number
    and ValueError for what is not a body.
    """

    # The core has makers too, with the same bits; but it keeps principal axes alone, and a Body
    # also keeps the inertia as its user described it, hence they are made here.

    mass: float
    inertia: Vector | tuple[Vector, Vector, Vector]
    com: Vector
    # kr_body: mass, moments, com, axes
    _block: bytes = field(init=False, repr=False, compare=False)

    def __init__(self, mass: float, inertia: ArrayLike, com: ArrayLike) -> None:
        tensor = _tensor("inertia", inertia)
        described = positive("mass", mass), _described(tensor), vector("com", com)
        status, block = body_from_tensor(described[0], tensor, described[2])
        if status != "OK":
            raise refusal(status, _violation(tensor))
        self.__dict__["mass"], self.__dict__["inertia"], self.__dict__["com"] = described
        self.__dict__["_block"] = block

    @classmethod
    def cuboid(cls, half: ArrayLike, pivot: ArrayLike, density: float = 1.0) -> Self:
        """A homogeneous cuboid: half its edges, along the axes [L], and its density [M L^-3].

        pivot  the fixed point, seen from the centre [L]; it may lie outside
        """
        a, b, c = (positive("half", x) for x in vector("half", half))
        mass = positive("mass of the cuboid", 8.0 * positive("density", density) * a * b * c)
        third = mass / 3.0
        xx, yy, zz = third * a * a, third * b * b, third * c * c
        return cls.from_com(mass, (yy + zz, zz + xx, xx + yy), (0.0, 0.0, 0.0), pivot)

    @classmethod
    def symmetric(cls, mass: float, i1: float, i3: float, height: float) -> Self:
        """A Lagrange top: moments i1, i1, i3 at the fixed point [M L^2], centre of mass at
        (0, 0, height) [L]."""
        one, three = number("i1", i1), number("i3", i3)
        return cls(mass, (one, one, three), (0.0, 0.0, number("height", height)))

    @classmethod
    def from_com(
        cls, mass: float, inertia_about_com: ArrayLike, com: ArrayLike, pivot: ArrayLike
    ) -> Self:
        """A body whose inertia [M L^2] is known about its centre of mass; com and pivot, the fixed
        point, are seen from anywhere [L].

        Steiner's theorem (Bodack 2008, 2.14): J = J_com + mass (|a|^2 1 - a a^t), a = com - pivot.
        """
        tensor = _tensor("inertia_about_com", inertia_about_com)
        a = np.subtract(vector("com", com), vector("pivot", pivot))
        with np.errstate(over="ignore", invalid="ignore"):
            products = positive("mass", mass) * np.outer(a, a)
            xx, yy, zz = products.diagonal()
            np.fill_diagonal(products, 0.0)
            return cls(mass, tensor + (np.diag((yy + zz, zz + xx, xx + yy)) - products), a)

    @property
    def moments(self) -> Vector:
        """The principal moments at the fixed point [M L^2], along N, B, T."""
        _, i1, i2, i3, *_ = unpack("11d", self._block)
        return i1, i2, i3

    @property
    def axes(self) -> Quaternion:
        """The rotation (w, x, y, z) from the principal axes N, B, T to the frame in which the body
        was described.

        A diagonal inertia is its own principal frame; else the principal axes nearest the described
        ones are taken, right-handed, T along the symmetry axis of a Lagrange top.
        """
        *_, w, x, y, z = unpack("11d", self._block)
        return w, x, y, z

    @property
    def principal_com(self) -> Vector:
        """The centre of mass along N, B, T [L]."""
        _, _, _, _, x, y, z, *_ = unpack("11d", self._block)
        return x, y, z

    @property
    def kind(self) -> str:
        """'euler', 'lagrange', 'kowalewski', 'goryachev_chaplygin' or 'general', up to 1e-12
        relative."""
        return body_kind(self._block, KIND_RTOL)

    @property
    def is_symmetric(self) -> bool:
        """Whether two of the principal moments are equal, up to 1e-12 relative."""
        return any(abs(a - b) <= KIND_RTOL * max(a, b) for a, b in combinations(self.moments, 2))


_MAKERS: dict[str, Callable[..., Body]] = {
    name: getattr(Body, name) for name, of in vars(Body).items() if isinstance(of, classmethod)
}


def body_of(table: object) -> Body:
    """The body of a TOML table: the words of Body, or one table with those of a maker."""
    words = a_table("body", table)
    if not _MAKERS.keys() & words.keys():
        return made(Body, "[body]", words, others=_MAKERS)
    if len(words) > 1:
        raise ValueError(f"[body] must be described in one way, not by {', '.join(words)}")
    ((name, value),) = words.items()
    return made(_MAKERS[name], f"[body] {name}", a_table(name, value))


def _tensor(name: str, value: object) -> Array:
    what = "3 moments or a symmetric 3x3 matrix"
    given = array(name, value, what)
    if given.shape not in ((3,), (3, 3)):
        raise ValueError(f"{name} must be {what}, not {value!r}")
    tensor = np.diag(given) if given.ndim == 1 else given
    with np.errstate(over="ignore"):
        skew = np.abs(tensor - tensor.T).max()
    if skew > KIND_RTOL * np.abs(tensor).max():
        raise ValueError(f"{name} must be {what}, not {value!r}")
    return tensor


def _described(tensor: Array) -> Vector | tuple[Vector, Vector, Vector]:
    """Three moments where that is all, else three rows."""
    diagonal = tensor.diagonal()
    if (tensor == np.diag(diagonal)).all():
        i1, i2, i3 = diagonal.tolist()
        return i1, i2, i3
    (a, b, c), (d, e, f), (g, h, i) = tensor.tolist()
    return (a, b, c), (d, e, f), (g, h, i)


def _violation(tensor: Array) -> str:
    """Which of the principal moments is not what it must be."""
    diagonal = (tensor == np.diag(tensor.diagonal())).all()
    moments = (tensor.diagonal() if diagonal else np.linalg.eigvalsh(tensor)).tolist()
    least, middle, largest = sorted(moments)
    wrong = (
        f"{least!r} is not positive" if not least > 0.0 else f"{largest!r} > {least!r} + {middle!r}"
    )
    return f"{wrong} in {moments}"
