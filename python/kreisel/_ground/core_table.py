"""The table of quantities, until the core gives it."""

from __future__ import annotations

from typing import TypedDict

import numpy as np

import kreisel._core as _core
from .arguments import Array


class Row(TypedDict):
    name: str
    doubles: int
    turns: bool
    dimension: str
    text: str
    in_events: bool


_TABLE = """
q|4|1|1|attitude (w, x, y, z), a unit quaternion from the frame in which the body was described to space|1
m|3|1|M L^2 T^-1|angular momentum about the fixed point|1
velocity|3|1|T^-1|angular velocity|0
torque|3|1|M L^2 T^-2|torque of gravity about the fixed point, dm/dt|0
frame|9|1|1|the principal axes: frame[:, 0], [:, 1], [:, 2] are the unit vectors N, B, T|0
apex|3|1|1|unit vectors from the fixed point to the centre of mass; along T if they are the same point|1
body_velocity|3|0|T^-1|angular velocity, seen from the frame in which the body was described|1
body_momentum|3|0|M L^2 T^-1|angular momentum, seen from the frame in which the body was described|1
body_vertical|3|0|1|the vertical e3, seen from the frame in which the body was described|1
spin|1|0|T^-1|angular velocity about the apex|1
nutation|1|0|rad|angle of the apex with the vertical e3, 0 upright, pi hanging; accurate at both|0
kinetic|1|0|M L^2 T^-2|kinetic energy|0
potential|1|0|M L^2 T^-2|potential energy, zero with the centre of mass level with the fixed point|0
energy|1|0|M L^2 T^-2|kinetic + potential|0
vertical_momentum|1|0|M L^2 T^-1|<m, e3>, constant for every top|0
axial_momentum|1|0|M L^2 T^-1|<m, apex>, constant for a Lagrange top|0
kowalewski|1|0|T^-4|the fourth integral K of a Kowalewski top (Bodack 2008, 5.1); NaN for other bodies|0
goryachev_chaplygin|1|0|T^-3|the integral G of a Goryachev-Chaplygin top (Bodack 2008, 5.2); constant only while <m, e3> = 0; NaN for other bodies|0
""".strip()
quantities: list[Row] = [
    {
        "name": n,
        "doubles": int(d),
        "turns": t == "1",
        "dimension": u,
        "text": x,
        "in_events": e == "1",
    }
    for n, d, t, u, x, e in (line.split("|") for line in _TABLE.splitlines())
]
components = {
    name.replace("vertical", "body_vertical"): i for i, name in enumerate(_core.quantities)
}
flags = {
    name: getattr(_core, name) for name in dir(_core) if name.isupper() and name != "KIND_RTOL"
}


def values(name: str, scene, states: Array) -> Array:
    if name in ("q", "m"):
        return np.ascontiguousarray(states[:, 1:5] if name == "q" else states[:, 5:8])
    if name == "energy":
        return _core.kinetic(scene, states) + _core.potential(scene, states)
    if name == "spin":
        return _core.terms_value(scene, states, [(1.0, components["spin"], 0)])
    if name.startswith("body_"):
        return np.stack(
            [
                _core.terms_value(scene, states, [(1.0, components[f"{name}_{i}"], 0)])
                for i in "xyz"
            ],
            -1,
        )
    return getattr(_core, name.removesuffix("_momentum"))(scene, states)
