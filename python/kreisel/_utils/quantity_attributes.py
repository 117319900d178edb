"""Names of methods and quantities for type checkers.

Generated from tables in csrc by `.ci/names > python/kreisel/_utils/quantity_attributes.py`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal, Never

if TYPE_CHECKING:
    from .arguments import Array

# fmt: off
MethodName = Literal[
    "auto", "exact", "bobenko_suris", "bobenko_suris2", "bobenko_suris4", "strang",
    "takahashi_imada4", "suzuki4", "blanes_moan6", "kahan_li6", "kahan_li8", "veselov2", "veselov4",
    "hirota_kimura", "implicit_midpoint", "rk4", "extrap", "taylor", "extrap_kirchhoff",
    "gsl_rk8pd", "gsl_bsimp",
]
QuantityName = Literal[
    "t", "q", "m", "velocity", "torque", "frame", "apex", "body_velocity", "body_momentum",
    "body_vertical", "spin", "precession_angle", "nutation", "spin_angle", "kinetic", "potential",
    "energy", "vertical_momentum", "axial_momentum", "kowalewski", "goryachev_chaplygin",
    "body_acceleration", "inertial_velocity", "pivot_force", "wheel_rate", "second_wheel_rate",
    "third_wheel_rate", "q_low", "m_low",
]


class Quantity:
    """A read-only attribute with the values of a quantity."""

    if TYPE_CHECKING:

        def __get__(self, path: object, kind: object = None) -> Array: ...
        def __set__(self, path: object, value: Never) -> None: ...


class QuantityAttributes:
    """The quantities of a path except t, generated from csrc/quantities.def."""

    if TYPE_CHECKING:
        q = m = velocity = torque = frame = apex = body_velocity = Quantity()
        body_momentum = body_vertical = spin = precession_angle = Quantity()
        nutation = spin_angle = kinetic = potential = energy = Quantity()
        vertical_momentum = axial_momentum = kowalewski = Quantity()
        goryachev_chaplygin = body_acceleration = Quantity()
        inertial_velocity = pivot_force = wheel_rate = Quantity()
        second_wheel_rate = third_wheel_rate = Quantity()
