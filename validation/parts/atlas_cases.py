"""Test cases of the stability atlas: stiff tops, extreme parameters, and very large or small steps.

The length of an integration is measured in turns of the top. One turn takes 2 pi divided by the
rate of the case. The default rate is the larger of the initial angular velocity and the pendulum
frequency.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import cos, pi, sin, tan

import kreisel as kr

from .verdicts import RESOLVED

HANGING = (0.0, 1.0, 0.0, 0.0)
SPUN = {"body_velocity": (0.5, 0.2, 3.0)}
FAST = {"body_velocity": (0.0, 0.0, 5.0)}
SLOW = {"body_velocity": (0.01, 0.005, 0.04)}
REST = {"momentum": (0.0, 0.0, 0.0)}
SLANTED = (0.8, 0.6 * cos(1.0), 0.6 * sin(1.0))  # a momentum without spin at a tilt of 1 rad


@dataclass(frozen=True)
class Case:
    name: str
    scene: Callable  # a function that makes the scene, so that invalid scenes can be reported too
    turns: float = 20.0
    steps: float = 64.0  # steps per turn
    rate: float | None = None  # rate that defines a turn [T^-1]
    begin: bool = False  # True if the step is also the first step of adaptive methods
    most: int = 100_000  # largest number of steps of an adaptive method
    # True if the run is so long that the reference is computed by quadrature
    closed: bool = False
    family: str = ""

    @property
    def key(self):
        return f"atlas/{self.family}/{self.name}"


def symmetric(i1=1.0, i3=0.5, mass=1.0, height=1.0):
    return mass, (i1, i1, i3), (0.0, 0.0, height)


def general(moments=(1.0, 0.8, 0.5), com=(0.3, -0.2, 0.6)):
    return 1.0, moments, com


LAGRANGE, GENERAL = symmetric(), general()
BOTH = {"Lagrange": LAGRANGE, "general": GENERAL}


def start(body=LAGRANGE, tilt=0.5, **words):
    """Return a function that makes a scene, by default tilted about the horizontal axis e1."""
    words = {"attitude": (cos(tilt / 2), sin(tilt / 2), 0.0, 0.0), "gravity": 1} | words
    return lambda: kr.Scene(kr.Body(*body, unphysical=True), **words)


def spin_cases():
    for kind, powers in (("Lagrange", range(7)), ("general", (2, 4, 6))):
        for power in powers:
            scene = start(BOTH[kind], body_velocity=(0.1, 0.05, 10.0**power))
            yield Case(f"{kind}, spin 1e{power}", scene)


def shape_cases():
    needle, nearly = symmetric(1.0, 1e-8), (1.0, 1.0 + 1e-12, 1.0 - 1e-12)
    plate = general((0.3, 0.7, 1.0), (0.2, 0.4, 0.0))
    yield Case("needle, I3/I1 = 1e-8", start(needle, body_momentum=(0.3, 0.1, 1e-8)))
    yield Case("needle, spin 1e3", start(needle, body_momentum=(0.3, 0.1, 1e-5)))
    yield Case("disc, I3 = 2 I1", start(symmetric(0.5, 1.0), **SPUN))
    yield Case("flat plate, I3 = I1 + I2", start(plate, **SPUN))
    yield Case("nearly a sphere, symmetric", start(symmetric(1.0, 1.0 + 1e-10), **SPUN))
    yield Case("nearly a sphere, general", start(general(nearly), **SPUN))
    yield Case("sphere", start(symmetric(1.0, 1.0, 1.0, 0.5), **SPUN))
    yield Case("rod, I3 = 0", start(symmetric(1.0, 0.0), **SPUN))
    yield Case("no body, I3 > I1 + I2", start(general((0.3, 0.6, 1.0)), **SPUN))


def sleeping_cases():
    parts = {
        "far below": 0.5,
        "just below": 0.999,
        "at": 1.0,
        "just above": 1.001,
        "far above": 2.0,
    }
    for name, part in parts.items():
        scene = start(tilt=0.01, body_momentum=(0.0, 0.0, 2.0 * part))
        yield Case(f"{name} critical spin", scene)
    yield Case("far below, perfectly upright", start(tilt=0.0, body_momentum=(0.0, 0.0, 1.0)))


def separatrix_cases():
    for name, push in (("1e-3", 1e-3), ("1e-8", 1e-8), ("none", 0.0)):
        scene = start(GENERAL, body_velocity=(push, 3.0, 0.0), gravity=0.0)
        yield Case(f"Dzhanibekov, push {name}", scene)
    # Between two upright positions the lowest point is u = c^2 / 2 - 1, where
    # m = c (e3 + a) / (1 + u); here c = 1.
    heavy = start(tilt=2 * pi / 3, momentum=(0.0, -(3.0**0.5), 1.0))
    yield Case("heavy top, upright to upright", heavy, turns=4)
    pendulum = start(attitude=HANGING, velocity=(2.0, 0.0, 0.0))
    yield Case("pendulum, up from below", pendulum, turns=4)


def pole_cases():
    yield Case("upright, spinning", start(tilt=0.0, **FAST))
    yield Case("upright, at rest", start(tilt=0.0, **REST), turns=4)
    yield Case("hanging, at rest", start(attitude=HANGING, **REST))
    yield Case("hanging, spinning", start(attitude=HANGING, **FAST))
    yield Case("tilt 1e-8", start(tilt=1e-8, **FAST))
    yield Case("tilt 1e-160", start(tilt=1e-160, **FAST))
    through = start(tilt=0.0, body_velocity=(1.0, 0.0, 0.0))
    yield Case("through the upper pole", through, turns=10)
    upright = general(com=(0.0, 0.0, 0.6))
    yield Case("general, com upright", start(upright, 0.0, body_velocity=(0.1, 0.0, 4.0)))
    yield Case("attitude -1", start(attitude=(-1.0, 0.0, 0.0, 0.0), **SPUN))
    yield Case("attitude with w = 0", start(attitude=(0.0, 0.6, 0.8, 0.0), **SPUN))


def planar_cases():
    yield Case("pendulum, let go", start(tilt=2.5, **REST))
    yield Case("pendulum, over the top", start(velocity=(3.0, 0.0, 0.0)))
    spherical = (0.5, 0.8 * cos(1.0), 0.8 * sin(1.0))
    yield Case("spherical pendulum", start(tilt=1.0, momentum=spherical))
    yield Case("no vertical momentum", start(tilt=1.0, momentum=(0.5, 1.0, 0.0)))
    planar = start(general(com=(0.0, 0.0, 0.6)), velocity=(2.0, 0.0, 0.0))
    yield Case("general, planar", planar, turns=10)


def gravity_cases():
    for name, body in BOTH.items():
        for g in (0.0, 1e-12, 1e12, -1.0):
            yield Case(f"{name}, g = {g:g}", start(body, gravity=g, **SPUN), turns=10)
    centred = general(com=(0.0, 0.0, 0.0))
    yield Case("held at the centre of mass", start(centred, **SPUN), turns=10)


def step_cases():
    for name, body in BOTH.items():
        for number in (0.25, 0.5, 1, 2, 4, 8, 16, 64, 256, 1024, 1e4, 1e5):
            turns, scene = 2 if number > 2e3 else 8, start(body, **SPUN)
            yield Case(f"{name}, {number:g} a turn", scene, turns, number, begin=True)


def antipodal_cases():
    """Yield test cases in which the axis is nearly reversed in one step.

    The Bobenko-Suris map rotates the axis by 2 atan(h |w| / 2) per step. The rotation angle per
    step is less than half a turn. The axis therefore rotates by pi - gap in each step if h |w| / 2
    = cot(gap / 2). All methods except the Bobenko-Suris map rotate the axis of the top by the angle
    h |w| in each step.
    """
    light = start(tilt=1.0, momentum=SLANTED, gravity=1e-3)  # the rate is 1
    for gap in (1.0, 1e-1, 1e-2, 1e-4, 1e-8):
        turns, name = 1 / tan(gap / 2) / pi, f"Bobenko-Suris to {gap:g} rad from opposite"
        yield Case(name, light, 8 * turns, 1 / turns, closed=gap < 0.1)
    for name, number in (
        ("half a turn", 2.0),
        ("half a turn - 1e-4 rad", 2 / (1 - 1e-4 / pi)),
        ("half a turn - 1e-9 rad", 2 / (1 - 1e-9 / pi)),
        ("a whole turn", 1.0),
    ):
        yield Case(f"{name} a step", light, 8 / number, number)
    free = start(tilt=1.0, momentum=SLANTED, gravity=0.0)
    yield Case("half a turn a step, no gravity", free, 4, 2.0)


def long_cases():
    calm = start(general(com=(0.0, 0.0, 0.3)), body_velocity=(0.1, 0.2, 6.0))
    for turns in (200, 1000):
        yield Case(f"Lagrange, {turns} turns", start(**SPUN), turns)
        yield Case(f"general, {turns} turns", calm, turns)
    rate = 0.04
    words = {"rate": rate, "closed": True, "most": 2_000_000}
    for name, body, gravity in (("Lagrange", LAGRANGE, 4e-4), ("free body", GENERAL, 0.0)):
        scene, turns = start(body, gravity=gravity, **SLOW), 1e6 * rate / (2 * pi)
        yield Case(f"{name}, to t = 1e6", scene, turns, RESOLVED, **words)
    # A time at which doubles cannot resolve the attitude.
    yield Case("Lagrange, 2^54 rad", start(**SPUN), 2**54 / (2 * pi), closed=True)


def si_cases():
    """Yield test cases in SI units: a levitated particle, a toy gyroscope, and the Earth."""
    nano, toy = symmetric(1.2e-33, 1e-33, 1e-18, 1e-9), symmetric(3e-4, 1e-4, 0.1, 0.04)
    earth = symmetric(8.008e37, 8.034e37, 5.97e24, 1e3)
    fast, slow = (1e6, 0.0, 1e9), (1e-8, 0.0, 7.292e-5)
    yield Case("nanoparticle, 1e9 rad/s", start(nano, body_velocity=fast, gravity=9.81))
    yield Case("nanoparticle, at rest", start(nano, **REST, gravity=9.81))
    yield Case("gyroscope, 300 rad/s", start(toy, body_velocity=(0.0, 0.0, 300.0), gravity=9.81))
    yield Case("planet", start(earth, 0.41, body_velocity=slow, gravity=5.9e-3))


def stiff_cases():
    """Yield test cases in which the top spins 1e4 times faster than it precesses."""
    needle = start(symmetric(1.0, 1e-4), body_momentum=(0.2, 0.1, 1.0))
    fast = start(body_velocity=(0.0, 0.0, 1e2 * 2.0**0.5))
    for number in (16, 64, 256):
        yield Case(f"needle, {number} a turn of precession", needle, 1, number, 1.0)
        yield Case(f"fast top, {number} a turn of precession", fast, 0.25, number, 0.02 / 2.0**0.5)


def damping_cases():
    """Yield test cases with damping."""
    for damping in (0.1, 10.0, 1e3, 1e5, 1e7, 1e9):
        yield Case(f"Lagrange, damping {damping:g}", start(damping=damping, **SPUN))
    for name, damping in (("two axes", (0.0, 1e4, 1e4)), ("all axes", (1e2, 2e3, 1e4))):
        scene = start(GENERAL, damping=damping, **SPUN)
        yield Case(f"general, {name} damped by up to 1e4", scene)
    for damping in (1e3, 1e6, 1e9):  # the fall takes about `damping` units of time
        scene = start(**REST, damping=damping)
        name = f"Lagrange falls from rest, damping {damping:g}"
        yield Case(name, scene, turns=0.5, rate=1 / damping)
    yield Case("free body, damping 1e9", start(GENERAL, gravity=0.0, damping=1e9, **SPUN))


FAMILIES = {
    "spin": (spin_cases, "spins from 1 to 1e6, for 20 turns"),
    "shape": (shape_cases, "needle, disc, plate, and almost a sphere"),
    "sleeping": (
        sleeping_cases,
        "sleeping tops below, at and above the critical spin m3 = 2 sqrt(M g a I1), tilted by 0.01",
    ),
    "separatrix": (
        separatrix_cases,
        "motions that approach an unstable equilibrium, exactly or almost",
    ),
    "poles": (pole_cases, "starts at and near the vertical, where coordinates are singular"),
    "c = 0": (planar_cases, "no axial momentum, and planar motion"),
    "gravity": (gravity_cases, "zero, tiny, huge and inverted gravity"),
    "steps": (
        step_cases,
        "steps from far too large to far too small; for adaptive methods the first step",
    ),
    "antipodal": (antipodal_cases, "steps that turn the axis to nearly the opposite side"),
    "long": (long_cases, "many turns"),
    "SI": (si_cases, "bodies in SI units"),
    "stiff": (
        stiff_cases,
        "a spin of 1e4 times the precession, with steps that resolve only the precession",
    ),
    "damping": (
        damping_cases,
        "damping from weak to so strong that the top creeps; only taylor damps, and explicit "
        "integrators are left out where their steps would follow the damping",
    ),
}


def list_cases(quick=False):
    """Yield all test cases, or only the first of each family if `quick` is true."""
    for family, (list_family, _) in FAMILIES.items():
        cases = [replace(case, family=family) for case in list_family()]
        yield from cases[:1] if quick else cases
