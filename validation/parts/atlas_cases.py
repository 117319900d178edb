"""Test cases of the stability atlas: stiff tops, extreme parameters, and very large or small steps.

The length of an integration is measured in turns of the top. One turn takes 2 pi divided by the
rate of the case. The default rate is the larger of the initial angular velocity and the pendulum
frequency.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from math import cos, pi, sin, tan

import kreisel as kr

from .verdicts import RESOLVED

UPRIGHT, HANGING = (1.0, 0.0, 0.0, 0.0), (0.0, 1.0, 0.0, 0.0)


@dataclass(frozen=True)
class Case:
    family: str
    name: str
    scene: Callable  # a function that makes the scene, so that invalid scenes can be reported too
    turns: float = 20.0
    steps: float = 64.0  # steps per turn
    rate: float | None = None  # rate that defines a turn [T^-1]
    begin: bool = False  # True if the step is also the first step of adaptive methods
    most: int = 100_000  # largest number of steps of an adaptive method
    # True if the run is so long that the reference is computed by quadrature
    closed: bool = False

    @property
    def key(self):
        return f"atlas/{self.family}/{self.name}"


def tilt_attitude(angle):
    """Return an attitude that is tilted by an angle about the horizontal axis e1."""
    return cos(angle / 2), sin(angle / 2), 0.0, 0.0


def lagrange(i1=1.0, i3=0.5, mass=1.0, height=1.0):
    return kr.Body.symmetric(mass, i1, i3, height, unphysical=True)


def general(moments=(1.0, 0.8, 0.5), com=(0.3, -0.2, 0.6)):
    return kr.Body(1.0, moments, com, unphysical=True)


def scene_factory(body, tilt=0.5, **start):
    """Return a function that creates the scene of a test case."""
    words = {"attitude": tilt_attitude(tilt), "gravity": 1} | start
    return lambda: kr.Scene(body(), **words)


SPUN = {"body_velocity": (0.5, 0.2, 3.0)}


def spin_cases():
    for power in range(7):
        yield Case(
            "spin",
            f"Lagrange, spin 1e{power}",
            scene_factory(lagrange, body_velocity=(0.1, 0.05, 10.0**power)),
        )
    for power in (2, 4, 6):
        yield Case(
            "spin",
            f"general, spin 1e{power}",
            scene_factory(general, body_velocity=(0.1, 0.05, 10.0**power)),
        )


def shape_cases():
    needle = partial(lagrange, 1.0, 1e-8)
    yield Case(
        "shape", "needle, I3/I1 = 1e-8", scene_factory(needle, body_momentum=(0.3, 0.1, 1e-8))
    )
    yield Case("shape", "needle, spin 1e3", scene_factory(needle, body_momentum=(0.3, 0.1, 1e-5)))
    yield Case("shape", "disc, I3 = 2 I1", scene_factory(partial(lagrange, 0.5, 1.0), **SPUN))
    yield Case(
        "shape",
        "flat plate, I3 = I1 + I2",
        scene_factory(partial(general, (0.3, 0.7, 1.0), (0.2, 0.4, 0.0)), **SPUN),
    )
    yield Case(
        "shape",
        "nearly a sphere, symmetric",
        scene_factory(partial(lagrange, 1.0, 1.0 + 1e-10), **SPUN),
    )
    yield Case(
        "shape",
        "nearly a sphere, general",
        scene_factory(partial(general, (1.0, 1.0 + 1e-12, 1.0 - 1e-12)), **SPUN),
    )
    yield Case("shape", "sphere", scene_factory(partial(lagrange, 1.0, 1.0, 1.0, 0.5), **SPUN))
    yield Case("shape", "rod, I3 = 0", scene_factory(partial(lagrange, 1.0, 0.0), **SPUN))
    yield Case(
        "shape", "no body, I3 > I1 + I2", scene_factory(partial(general, (0.3, 0.6, 1.0)), **SPUN)
    )


def sleeping_cases():
    for name, part in (
        ("far below", 0.5),
        ("just below", 0.999),
        ("at", 1.0),
        ("just above", 1.001),
        ("far above", 2.0),
    ):
        yield Case(
            "sleeping",
            f"{name} critical spin",
            scene_factory(lagrange, 0.01, body_momentum=(0.0, 0.0, 2.0 * part)),
        )
    yield Case(
        "sleeping",
        "far below, perfectly upright",
        scene_factory(lagrange, 0.0, body_momentum=(0.0, 0.0, 1.0)),
    )


def separatrix_cases():
    for name, push in (("1e-3", 1e-3), ("1e-8", 1e-8), ("none", 0.0)):
        yield Case(
            "separatrix",
            f"Dzhanibekov, push {name}",
            scene_factory(general, body_velocity=(push, 3.0, 0.0), gravity=0.0),
        )
    # Between two upright positions the lowest point is u = c^2 / 2 - 1, where
    # m = c (e3 + a) / (1 + u); here c = 1.
    heavy = scene_factory(lagrange, 2 * pi / 3, momentum=(0.0, -(3.0**0.5), 1.0))
    yield Case("separatrix", "heavy top, upright to upright", heavy, turns=4)
    yield Case(
        "separatrix",
        "pendulum, up from below",
        scene_factory(lagrange, attitude=HANGING, velocity=(2.0, 0.0, 0.0)),
        turns=4,
    )


def pole_cases():
    spin = {"body_velocity": (0.0, 0.0, 5.0)}
    yield Case("poles", "upright, spinning", scene_factory(lagrange, 0.0, **spin))
    yield Case(
        "poles", "upright, at rest", scene_factory(lagrange, 0.0, momentum=(0.0, 0.0, 0.0)), turns=4
    )
    yield Case(
        "poles",
        "hanging, at rest",
        scene_factory(lagrange, attitude=HANGING, momentum=(0.0, 0.0, 0.0)),
    )
    yield Case("poles", "hanging, spinning", scene_factory(lagrange, attitude=HANGING, **spin))
    yield Case("poles", "tilt 1e-8", scene_factory(lagrange, 1e-8, **spin))
    yield Case("poles", "tilt 1e-160", scene_factory(lagrange, 1e-160, **spin))
    yield Case(
        "poles",
        "through the upper pole",
        scene_factory(lagrange, 0.0, body_velocity=(1.0, 0.0, 0.0)),
        turns=10,
    )
    yield Case(
        "poles",
        "general, com upright",
        scene_factory(partial(general, com=(0.0, 0.0, 0.6)), 0.0, body_velocity=(0.1, 0.0, 4.0)),
    )
    yield Case(
        "poles", "attitude -1", scene_factory(lagrange, attitude=(-1.0, 0.0, 0.0, 0.0), **SPUN)
    )
    yield Case(
        "poles",
        "attitude with w = 0",
        scene_factory(lagrange, attitude=(0.0, 0.6, 0.8, 0.0), **SPUN),
    )


def planar_cases():
    yield Case("c = 0", "pendulum, let go", scene_factory(lagrange, 2.5, momentum=(0.0, 0.0, 0.0)))
    yield Case(
        "c = 0", "pendulum, over the top", scene_factory(lagrange, 0.5, velocity=(3.0, 0.0, 0.0))
    )
    yield Case(
        "c = 0",
        "spherical pendulum",
        scene_factory(lagrange, 1.0, momentum=(0.5, 0.8 * cos(1.0), 0.8 * sin(1.0))),
    )
    yield Case(
        "c = 0", "no vertical momentum", scene_factory(lagrange, 1.0, momentum=(0.5, 1.0, 0.0))
    )
    planar_body = partial(general, com=(0.0, 0.0, 0.6))
    yield Case(
        "c = 0",
        "general, planar",
        scene_factory(planar_body, 0.5, velocity=(2.0, 0.0, 0.0)),
        turns=10,
    )


def gravity_cases():
    for name, body in (("Lagrange", lagrange), ("general", general)):
        for g in (0.0, 1e-12, 1e12, -1.0):
            yield Case(
                "gravity", f"{name}, g = {g:g}", scene_factory(body, gravity=g, **SPUN), turns=10
            )
    centred = partial(general, com=(0.0, 0.0, 0.0))
    yield Case("gravity", "held at the centre of mass", scene_factory(centred, **SPUN), turns=10)


def step_cases():
    for name, body in (("Lagrange", lagrange), ("general", general)):
        for number in (0.25, 0.5, 1, 2, 4, 8, 16, 64, 256, 1024, 1e4, 1e5):
            yield Case(
                "steps",
                f"{name}, {number:g} a turn",
                scene_factory(body, **SPUN),
                2 if number > 2e3 else 8,
                number,
                begin=True,
            )


def antipodal_cases():
    """Yield test cases in which the axis is nearly reversed in one step.

    The Bobenko-Suris map rotates the axis by 2 atan(h |w| / 2) per step. The rotation angle per
    step is less than half a turn. The axis therefore rotates by pi - gap in each step if h |w| / 2
    = cot(gap / 2). All methods except the Bobenko-Suris map rotate the axis of the top by the angle
    h |w| in each step.
    """
    momentum = (0.8, 0.6 * cos(1.0), 0.6 * sin(1.0))  # without spin, the rate is 1
    light = scene_factory(lagrange, 1.0, momentum=momentum, gravity=1e-3)
    for gap in (1.0, 1e-1, 1e-2, 1e-4, 1e-8):
        turns = 1 / tan(gap / 2) / pi
        yield Case(
            "antipodal",
            f"Bobenko-Suris to {gap:g} rad from opposite",
            light,
            8 * turns,
            1 / turns,
            closed=gap < 0.1,
        )
    for name, number in (
        ("half a turn", 2.0),
        ("half a turn - 1e-4 rad", 2 / (1 - 1e-4 / pi)),
        ("half a turn - 1e-9 rad", 2 / (1 - 1e-9 / pi)),
        ("a whole turn", 1.0),
    ):
        yield Case("antipodal", f"{name} a step", light, 8 / number, number)
    yield Case(
        "antipodal",
        "half a turn a step, no gravity",
        scene_factory(lagrange, 1.0, momentum=momentum, gravity=0.0),
        4,
        2.0,
    )


def long_cases():
    calm = partial(general, (1.0, 0.8, 0.5), (0.0, 0.0, 0.3))
    for turns in (200, 1000):
        yield Case("long", f"Lagrange, {turns} turns", scene_factory(lagrange, **SPUN), turns)
        yield Case(
            "long",
            f"general, {turns} turns",
            scene_factory(calm, body_velocity=(0.1, 0.2, 6.0)),
            turns,
        )
    slow, rate = {"body_velocity": (0.01, 0.005, 0.04)}, 0.04
    for name, scene in (
        ("Lagrange", scene_factory(lagrange, gravity=4e-4, **slow)),
        ("free body", scene_factory(general, gravity=0.0, **slow)),
    ):
        yield Case(
            "long",
            f"{name}, to t = 1e6",
            scene,
            1e6 * rate / (2 * pi),
            RESOLVED,
            rate,
            closed=True,
            most=2_000_000,
        )
    # A time at which doubles cannot resolve the attitude.
    yield Case(
        "long", "Lagrange, 2^54 rad", scene_factory(lagrange, **SPUN), 2**54 / (2 * pi), closed=True
    )


def si_cases():
    """Yield test cases in SI units: a levitated particle, a toy gyroscope, and the Earth."""
    nano, earth = (
        partial(lagrange, 1.2e-33, 1e-33, 1e-18, 1e-9),
        partial(lagrange, 8.008e37, 8.034e37, 5.97e24, 1e3),
    )
    yield Case(
        "SI",
        "nanoparticle, 1e9 rad/s",
        scene_factory(nano, body_velocity=(1e6, 0.0, 1e9), gravity=9.81),
    )
    yield Case(
        "SI", "nanoparticle, at rest", scene_factory(nano, momentum=(0.0, 0.0, 0.0), gravity=9.81)
    )
    toy = partial(lagrange, 3e-4, 1e-4, 0.1, 0.04)
    yield Case(
        "SI",
        "gyroscope, 300 rad/s",
        scene_factory(toy, body_velocity=(0.0, 0.0, 300.0), gravity=9.81),
    )
    yield Case(
        "SI",
        "planet",
        scene_factory(earth, 0.41, body_velocity=(1e-8, 0.0, 7.292e-5), gravity=5.9e-3),
    )


def stiff_cases():
    """Yield test cases in which the top spins 1e4 times faster than it precesses.

    The step size resolves the precession but not the spin.
    """
    needle = scene_factory(partial(lagrange, 1.0, 1e-4), body_momentum=(0.2, 0.1, 1.0))
    fast = scene_factory(lagrange, body_velocity=(0.0, 0.0, 1e2 * 2.0**0.5))
    for number in (16, 64, 256):
        yield Case("stiff", f"needle, {number} a turn of precession", needle, 1, number, rate=1.0)
        yield Case(
            "stiff",
            f"fast top, {number} a turn of precession",
            fast,
            0.25,
            number,
            rate=0.02 / 2.0**0.5,
        )


def damping_cases():
    """Yield test cases with damping.

    Strong damping makes the equations of motion stiff.
    """
    for damping in (0.1, 10.0, 1e3, 1e5, 1e7, 1e9):
        yield Case(
            "damping",
            f"Lagrange, damping {damping:g}",
            scene_factory(lagrange, damping=damping, **SPUN),
        )
    for name, damping in (("two axes", (0.0, 1e4, 1e4)), ("all axes", (1e2, 2e3, 1e4))):
        yield Case(
            "damping",
            f"general, {name} damped by up to 1e4",
            scene_factory(general, damping=damping, **SPUN),
        )
    for damping in (1e3, 1e6, 1e9):  # the fall takes about `damping` units of time
        yield Case(
            "damping",
            f"Lagrange falls from rest, damping {damping:g}",
            scene_factory(lagrange, momentum=(0.0, 0.0, 0.0), damping=damping),
            turns=0.5,
            rate=1 / damping,
        )
    yield Case(
        "damping",
        "free body, damping 1e9",
        scene_factory(general, gravity=0.0, damping=1e9, **SPUN),
    )


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
    """Yield all test cases, or only the first two of each family if `quick` is true."""
    for list_family, _ in FAMILIES.values():
        cases = list(list_family())
        yield from cases[:2] if quick else cases
