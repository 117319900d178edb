"""Units of the parameters that can vary between the tops of an ensemble."""

_UNITS = {  # of parameters of scenes, and of constructors of kreisel.Body
    **dict.fromkeys(["radius", "height", "half", "length", "inner", "outer", "pivot"], "L"),
    **dict.fromkeys(["i1", "i3", "inertia_about_com"], "M L^2"),
    "density": "M L^-3",
    "mass": "M",
    "inertia": "M L^2",
    "com": "L",
    "rotor": "M L^2 T^-1",
    "momentum": "M L^2 T^-1",
    "velocity": "T^-1",
    "body_momentum": "M L^2 T^-1",
    "body_velocity": "T^-1",
    "spin": "rad T^-1",
    "tilt": "rad",
    "precession": "rad T^-1",
    "angles": "rad",
    "rates": "rad T^-1",
    "gravity": "L T^-2",
    "damping": "M L^2 T^-1",
    "turning": "T^-1",
    "friction": "M L^2 T^-2",
}
_SHAKING_UNITS = "L", "T^-1", "rad"


def get_parameter_unit(name: str, degrees: bool, component: int | None = None) -> str:
    """Return the dimension [M L T] of a parameter, with 'rad' or 'deg' as the unit of angles.

    The three components of `shaking` have different dimensions; without `component`, all three are
    listed.
    """
    if name == "shaking":
        return ", ".join(_SHAKING_UNITS) if component is None else _SHAKING_UNITS[component]
    unit = _UNITS.get(name, "")
    return unit.replace("rad", "deg") if degrees else unit
