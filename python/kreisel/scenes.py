"""Named example scenes, each of which is described in the dictionary `about`.

The scenes defined first, from `thesis` to `strong_gravity`, are used in the report on the accuracy
of the methods. They are given in principal axes with mass and gravity 1, so that com equals the
lever mass * gravity * com. The reference solutions in validation/references/reference.jsonl start
from these numbers, bitwise.
"""

from __future__ import annotations

from ._model.body import Body
from ._model.scene import Scene
from ._utils.arguments import Quaternion, Vector, short_repr, unknown_name_message

about = {
    "thesis": "the Lagrange top of Bodack 2008, chapter 6, released upright: the apex nutates in "
    "loops",
    "kowalewski": "Kowalewski's integrable top: path.kowalewski is constant although the apex "
    "looks chaotic",
    "goryachev_chaplygin": "integrable only without vertical momentum: path.goryachev_chaplygin "
    "is constant",
    "asymmetric": "chaotic: a rounding error of the start grows to 6e-9 rad by t = 100",
    "asymmetric_regular": "asymmetric but regular, because it spins fast",
    "fast": "fast and upright, with quick nutation of small amplitude; difficult for fixed-step "
    "methods",
    "strong_gravity": "slow under strong gravity: bobenko_suris fails at steps that suffice for "
    "other scenes",
    "sleeping": "fast enough to stand in spite of a small push: m3^2 > 4 M g a I1",
    "steady_precession": "momentum and tilt match: the apex moves on a horizontal circle, "
    "without nutation",
    "cusps": "released with spin alone: the apex falls, and returns to rest in cusps at its "
    "initial height",
    "dzhanibekov": "without gravity, spinning about the intermediate axis: it flips over "
    "periodically",
    "satellite": "on a circular orbit of the period 2 pi: the gravity gradient holds it upright",
    "tumbler": "a satellite of the same shape that tumbles chaotically, as Hyperion does",
}

_THESIS = (7.918933333333336, 7.918933333333336, 2.1845333333333343)
_UPRIGHT = (1.0, 0.0, 0.0, 0.0)


def _in_principal_axes(
    moments: Vector, lever: Vector, momentum: Vector, attitude: Quaternion = _UPRIGHT
) -> Scene:
    return Scene(Body(1.0, moments, lever, unphysical=True), momentum, attitude, gravity=1.0)


thesis = _in_principal_axes(_THESIS, (0.0, 0.0, 5.120000000000001), (0.172, -1.862, 1.46))
kowalewski = _in_principal_axes(
    (4.618802153517006, 9.237604307034012, 9.237604307034012),
    (0.0, 0.0, 3.4641016151377544),
    (0.172, -1.862, 1.46),
)
goryachev_chaplygin = _in_principal_axes(
    (7.055336829505575, 28.2213473180223, 28.2213473180223),
    (0.0, 0.0, 5.291502622129181),
    (0.172, -1.862, 0.0),
)
asymmetric = _in_principal_axes(
    (1.3023470384399705, 5.756687128667914, 6.124965832892115),
    (-3.933540328371885, -0.07925610875679233, 0.06212048210304635),
    (0.172, -1.862, 1.46),
    (0.07294772052196692, 0.7317159160391046, -0.05289520205738767, -0.6756275200767143),
)
asymmetric_regular = _in_principal_axes(
    (5.9392000000000005, 5.5808, 1.2799999999999996), (0.0, 0.0, 3.84), (1.0, -2.0, 10.0)
)
fast = _in_principal_axes(_THESIS, (0.0, 0.0, 5.120000000000001), (0.5, 0.0, 200.0))
strong_gravity = _in_principal_axes(_THESIS, (0.0, 0.0, 51.20000000000001), (5.0, 0.0, 0.0))

_symmetric = Body.symmetric(mass=1.0, i1=1.0, i3=0.5, height=1.0, unphysical=True)
_tilted = (0.8**0.5, 0.2**0.5, 0.0, 0.0)  # about e1, by the angle whose cosine is 0.6

sleeping = Scene(_symmetric, momentum=(0.02, 0.0, 3.0), gravity=1.0)
# Steady precession at the rate W satisfies I1 W^2 cos(tilt) - m3 W + M g a = 0. For W = 1, the
# momentum is m3 = 1.6 along the axis and I1 W sin(tilt) = 0.8 across it.
steady_precession = Scene(_symmetric, body_momentum=(0.0, 0.8, 1.6), attitude=_tilted, gravity=1.0)
cusps = Scene(_symmetric, body_momentum=(0.0, 0.0, 3.0), attitude=_tilted, gravity=1.0)
dzhanibekov = Scene(
    Body.cuboid(half=(1.0, 0.6, 0.2), pivot=(0.0, 0.0, 0.0)),
    body_velocity=(0.001, 3.0, 0.0),
    gravity=0.0,
)
# The axes e1, e2, e3 turn once in 2 pi: along the orbit, along its angular momentum, and up.
_satellite = Body(1.0, (0.9, 1.0, 0.4), (0.0, 0.0, 0.0))
satellite = Scene(
    _satellite,
    attitude=(180 / 181, 0.0, 19 / 181, 0.0),  # 12 degrees forward
    velocity=(0.02, 0.0, 0.02),
    gradient=3.0,
    turning=(0.0, 1.0, 0.0),
)
tumbler = satellite.replace(attitude=(0.6, 0.0, 0.8, 0.0), velocity=(0.3, 0.2, 0.4))


def get_scene(name: str) -> Scene:
    """Return the scene called `name`.

    Raises KeyError for an unknown name, and TypeError if `name` is not a str.
    """
    if not isinstance(name, str):
        raise TypeError(f"name must be a string, not {short_repr(name)}")
    if name not in about:
        raise KeyError(unknown_name_message("scene", name, about))
    scene: Scene = globals()[name]
    return scene


def name_of(scene: Scene) -> str:
    """Return the name of a scene in this module, or '' for any other scene."""
    return next((name for name in about if get_scene(name) == scene), "")


def __dir__() -> list[str]:
    """List the names of the scenes and functions in this module."""
    return sorted([*about, "about", "get_scene", "name_of"])
