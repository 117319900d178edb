"""Names of methods and quantities for type checkers.

Generated from tables in csrc by `.ci/names > python/kreisel/_utils/quantity_attributes.py`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from .arguments import Array

MethodName = Literal[
    "auto",
    "exact",
    "bobenko_suris",
    "bobenko_suris2",
    "bobenko_suris4",
    "strang",
    "takahashi_imada4",
    "suzuki4",
    "blanes_moan6",
    "kahan_li6",
    "kahan_li8",
    "veselov2",
    "veselov4",
    "hirota_kimura",
    "implicit_midpoint",
    "rk4",
    "extrap",
    "taylor",
    "extrap_kirchhoff",
    "gsl_rk8pd",
    "gsl_bsimp",
]
QuantityName = Literal[
    "t",
    "q",
    "m",
    "velocity",
    "torque",
    "frame",
    "apex",
    "body_velocity",
    "body_momentum",
    "body_vertical",
    "spin",
    "precession_angle",
    "nutation",
    "spin_angle",
    "kinetic",
    "potential",
    "energy",
    "vertical_momentum",
    "axial_momentum",
    "kowalewski",
    "goryachev_chaplygin",
    "body_acceleration",
    "inertial_velocity",
    "q_low",
    "m_low",
]


class QuantityAttributes:
    """The quantities of a path except t, q and m, generated from csrc/quantities.def."""

    if TYPE_CHECKING:

        @property
        def velocity(self) -> Array: ...

        @property
        def torque(self) -> Array: ...

        @property
        def frame(self) -> Array: ...

        @property
        def apex(self) -> Array: ...

        @property
        def body_velocity(self) -> Array: ...

        @property
        def body_momentum(self) -> Array: ...

        @property
        def body_vertical(self) -> Array: ...

        @property
        def spin(self) -> Array: ...

        @property
        def precession_angle(self) -> Array: ...

        @property
        def nutation(self) -> Array: ...

        @property
        def spin_angle(self) -> Array: ...

        @property
        def kinetic(self) -> Array: ...

        @property
        def potential(self) -> Array: ...

        @property
        def energy(self) -> Array: ...

        @property
        def vertical_momentum(self) -> Array: ...

        @property
        def axial_momentum(self) -> Array: ...

        @property
        def kowalewski(self) -> Array: ...

        @property
        def goryachev_chaplygin(self) -> Array: ...

        @property
        def body_acceleration(self) -> Array: ...

        @property
        def inertial_velocity(self) -> Array: ...
