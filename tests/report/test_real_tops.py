"""Tests of random tops with rotors, damping, friction and moving supports in 128 bits.

Each top has a random type of body, which is described in rotated or permuted axes. A rotor,
damping, friction, a turning support and a shaken support each occur with probability 1/2. If a top
is damped, the damping is strong with probability 1/4. Times may be negative, unless the damping is
strong. The reference is computed by heyoka in 128-bit arithmetic; it shares no code with kreisel
and uses only the attributes of the scene.

Errors in the attitude are rotation angles [rad]. Errors in the momentum are divided by the largest
moment of inertia times the rotation rate of the top. No error may exceed 10 times the conditioning,
the largest change of the state, to first order, if each number of the scene is rounded once. For 20
and 30 digits, the limit is smaller in proportion to the rounding errors of 1e-20 and 1e-30.
"""

import kreisel as kr
import numpy as np
import pytest

from validation.references.support_equations import (
    SupportIntegrator,
    find_attitude_error,
    find_momentum_error,
)

TOPS = 24
WORDS = ("rotor", "damping", "turning", "shaking", "friction")
KINDS = ("general", "lagrange", "oblique", "free", "free axial", "spherical", "kowalewski", "gc")
ROUNDING = 2.0**-53
UNIT = {16: ROUNDING, 20: 1e-20, 30: 1e-30}
LIMIT = 10.0
# Times of strong damping are at most this over the damping. If some axes are damped too weakly for
# the slow manifold, the rounding errors of more steps would exceed the limit.
MOST_DECAY = 2e3
# Backward times are at most this over the rate of damping, beyond which the top turns so fast that
# the reference would need minutes.
MOST_DRIVE = 6.0
MOST_GROWTH = 1e6  # tops whose conditioning is larger are chaotic, and are not compared


def draw_body(rng, kind, has_rotor):
    """Draw a random body of the given kind, described in permuted or rotated axes."""
    densities, com = rng.uniform(0.1, 1.5, 3), rng.normal(size=3) * 0.4
    if kind in ("lagrange", "oblique", "free axial"):
        densities[1] = densities[0]
    moments = densities.sum() - densities
    if kind in ("lagrange", "kowalewski", "gc"):
        com[:] = (0.0, 0.0, com[2]) if kind == "lagrange" else (com[0], com[1], 0.0)
    if kind.startswith("free"):
        com[:] = 0.0
    ratio = {"spherical": 1.0, "kowalewski": 2.0, "gc": 4.0}.get(kind)
    if ratio:
        moments[:] = np.array((ratio, ratio, 1.0)) * moments[0] / ratio
    rotor = rng.normal(size=3) * 0.5 * has_rotor
    if has_rotor and rng.random() < 0.5:
        rotor[:2] = 0.0
    order = rng.permutation(3)
    body = kr.Body(
        rng.uniform(0.5, 2.0), moments[order], com[order], rotor=rotor[order], unphysical=True
    )
    if rng.random() < 0.5:
        q = rng.normal(size=4)
        body = body.turn(q / np.linalg.norm(q))
    return body


def draw_damping(rng):
    """Return random damping coefficients for the three axes.

    With probability 1/4, the damping is strong about some of the axes.
    """
    if rng.random() < 0.25:
        strong = 10.0 ** rng.uniform(1.0, 4.0, 3) * (rng.random(3) < 0.8)
        return strong if rng.random() < 0.7 else (strong.max(),) * 3
    return rng.uniform(0.0, 0.3, 3) if rng.random() < 0.8 else (0.1,) * 3


def draw_top(rng):
    """Return a random scene and a random time."""
    has = {word: rng.random() < 0.5 for word in WORDS}
    kind = KINDS[rng.integers(len(KINDS))]
    body = draw_body(rng, kind, has["rotor"])
    q, rate = rng.normal(size=4), 10.0 ** rng.uniform(-1.0, 0.7)
    words = {"gravity": rng.normal() * 2.0 if rng.random() < 0.9 else 0.0}
    if has["damping"]:
        words["damping"] = draw_damping(rng)
    if has["turning"]:
        turning = rng.normal(size=3) * 0.7
        words["turning"] = turning if rng.random() < 0.6 else (0.0, 0.0, turning[2])
    if has["shaking"]:
        words["shaking"] = rng.normal() * 0.1, 10.0 ** rng.uniform(-1.0, 1.3), rng.uniform(-4, 4)
    if has["friction"]:
        words["friction"] = 10.0 ** rng.uniform(-3.0, 0.0)
    velocity = rng.normal(size=3) * rate
    scene = kr.Scene(body, body_velocity=velocity, attitude=q / np.linalg.norm(q), **words)
    t = 10.0 ** rng.uniform(-1.0, 0.8) * (1.0 if rng.random() < 0.6 else -1.0)
    fastest = max(np.array(scene.damping) / scene.body.moments)
    if t < 0.0 and fastest > 0.0:  # damping drives the top backward in time
        t = float(max(t, -MOST_DRIVE / fastest))
    strongest = max(scene.damping)
    if strongest > 1.0:  # the reference takes steps as short as the damping requires
        t = min(abs(t), MOST_DECAY / strongest)
    return scene, t


def read_numbers(scene):
    """Return the numbers that define a scene, by the names of the tangents to them."""
    body = scene.body
    numbers = {
        "start": (2.0, 2.0, 2.0, *scene.momentum),  # a unit quaternion rotates by twice its change
        "moments": body.moments,
        "com": body.principal_com,
        "gravity": (scene.gravity,),
        "mass": (body.mass,),
        "damping": scene.damping,
        "rotor": body.principal_rotor,
        "turning": scene.turning,
        "shaking": scene.shaking if scene.shaking[0] else (),
        "friction": (scene.friction,),
    }
    return {name: np.abs(values) for name, values in numbers.items() if any(values)}


class Top:
    """A random top, its reference (attitude, momentum), and the effect of rounding on it."""

    def __init__(self, index, truth):
        self.scene, self.t = draw_top(np.random.default_rng((1, index)))
        self.end = truth(self.scene, self.t)
        numbers = read_numbers(self.scene)
        path = kr.solve(self.scene, np.linspace(0.0, self.t, 33), "taylor", tangents=tuple(numbers))
        speeds = np.linalg.norm(path.body_velocity, axis=1)
        self.scale = max(self.scene.body.moments) * max(*speeds, 1e-3)
        sizes = np.concatenate([*numbers.values()])
        momenta = np.linalg.norm(path.tangents[-1, 3:], axis=0) @ sizes
        self.conditioning = max(path.conditioning[-1], ROUNDING * momenta / self.scale, ROUNDING)

    def check(self, path):
        """Check that the error of the last state is at most 10 times the effect of rounding."""
        error = max(
            find_attitude_error(path, self.end[0]),
            find_momentum_error(path, self.end[1]) / self.scale,
        )
        assert error <= LIMIT * self.conditioning * UNIT[path.digits or 16] / UNIT[16]


@pytest.fixture(scope="module")
def regular_tops():
    truth = SupportIntegrator()
    tops = [Top(index, truth) for index in range(TOPS)]
    return [top for top in tops if top.conditioning <= MOST_GROWTH * ROUNDING]


@pytest.mark.parametrize("digits", UNIT)
def test_random_tops_are_accurate_to_every_number_of_digits(digits, regular_tops):
    for top in regular_tops:
        top.check(kr.solve(top.scene, [top.t], "taylor", digits=digits))


def test_closed_forms_of_random_tops_are_accurate(regular_tops):
    for top in regular_tops:
        if kr.methods["exact"].suits(top.scene):
            top.check(kr.solve(top.scene, [top.t], "exact"))


def test_resumed_runs_of_random_tops_are_accurate(regular_tops):
    for top in regular_tops:
        run = kr.start(top.scene, back=top.t < 0.0)
        run.to([0.3 * top.t])
        top.check(kr.resume(run.checkpoint).to([top.t]))


def test_ensembles_of_random_tops_are_accurate(regular_tops):
    many = kr.Ensemble.of([top.scene for top in regular_tops])
    paths = kr.solve(many, np.array([[top.t] for top in regular_tops]))
    assert not any(paths.status)
    for top, path in zip(regular_tops, paths, strict=True):
        top.check(path)
