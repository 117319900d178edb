"""Accuracy tests of the main public functions on random tops, against 20-digit solutions.

    python -m validation.benchmarks.agreement --tops 2000 --seed 1

The tests cover kr.solve, ensembles, kr.stream, and saved and resumed runs. The tests also cover
events, sections, tangents and Lyapunov exponents. All functions are tested with the default
precision. The reference solutions are computed by the Taylor method in 20-digit arithmetic. Each
attitude error must not exceed a constant plus a small multiple of its sensitivity to rounding (the
conditioning). The conditioning bounds the change in attitude when each initial value and parameter
is perturbed by one rounding error. The program prints one line for each type of top and for each
error that is too large. The program exits with status 1 if any results disagree.
"""

import argparse
import math
import sys
import tempfile
import warnings
from collections import Counter
from pathlib import Path

import kreisel as kr
import numpy as np

SLACK, FLOOR = 10.0, 5e-14
UNRESOLVED = 1e-5  # tops with a larger allowed angle are skipped [rad]
DATA = ("start", "moments", "com", "gravity", "mass", "damping")


def random_attitude(rng):
    q = rng.normal(size=4)
    return q / np.linalg.norm(q)


def random_moments(rng):
    a, b, c = rng.uniform(0.2, 2.0, 3)
    return np.array([b + c, c + a, a + b])


def permute(rng, *vectors):
    """Apply the same random permutation of the axes to all vectors."""
    order = rng.permutation(3)
    return [np.asarray(v)[order] for v in vectors]


def make_body(moments, com):
    return kr.Body(1.0, moments, com, unphysical=True)


def make_scene(rng, body, **parameters):
    start = {"momentum": rng.normal(size=3) * 2, "attitude": random_attitude(rng)}
    return kr.Scene(body, **start | {"gravity": 1} | parameters)


def general_damped(rng):
    body = make_body(random_moments(rng), rng.normal(size=3))
    return make_scene(rng, body, damping=rng.uniform(0, 0.4, 3))


def symmetric_damped(rng):
    i1, i3 = rng.uniform(1, 2), rng.uniform(0.3, 1.9)
    moments, com = permute(rng, np.array([i1, i1, i3]), np.array([0, 0, rng.uniform(0.2, 1)]))
    return make_scene(rng, make_body(moments, com), damping=rng.uniform(0, 0.4, 3))


def sphere_damped(rng):
    body = make_body(np.full(3, rng.uniform(0.5, 2)), rng.normal(size=3))
    return make_scene(rng, body, damping=rng.uniform(0, 0.4, 3) * (rng.random(3) < 0.7))


def sleeping(rng):
    body = kr.Body.symmetric(1, rng.uniform(1, 2), rng.uniform(0.3, 1.9), 1, unphysical=True)
    spin = math.copysign(10 ** rng.uniform(1.2, 2.7), rng.normal())
    return kr.Scene(body, body_velocity=(0, 0, spin), gravity=1)


def free_about_an_axis(rng):
    body = make_body(random_moments(rng), np.zeros(3))
    velocity = np.zeros(3)
    velocity[rng.integers(3)] = rng.uniform(0.5, 20)
    attitude = (1, 0, 0, 0) if rng.random() < 0.5 else random_attitude(rng)
    return kr.Scene(body, body_velocity=velocity, attitude=attitude, gravity=0.0)


def steady_precession(rng):
    body = kr.Body.symmetric(1, rng.uniform(1, 2), rng.uniform(0.3, 1.9), 1, unphysical=True)
    spin, tilt = rng.uniform(10, 30), rng.uniform(0.2, 1.4)
    return kr.Scene.spinning(
        body, spin, tilt, steady=True, fast=bool(rng.random() < 0.3), gravity=1
    )


def lagrange_in_rotated_axes(rng):
    body = kr.Body.symmetric(1, rng.uniform(1, 2), rng.uniform(0.3, 1.9), 1, unphysical=True)
    return make_scene(rng, body.turn(random_attitude(rng)))


def euler_near_middle_axis(rng):
    lean = 10.0 ** rng.uniform(-20, -1)
    moments, momentum = permute(rng, np.sort(random_moments(rng)), np.array([lean, 1.5, 0.0]))
    body = make_body(moments, np.zeros(3))
    return kr.Scene(body, body_momentum=momentum, attitude=random_attitude(rng), gravity=0.0)


def kowalewski(rng):
    moments, com = permute(rng, np.array([2.0, 2.0, 1.0]), np.array([rng.choice([-1, 1]), 0, 0]))
    return make_scene(rng, make_body(moments, com), gravity=rng.choice([1.0, -2.5]))


def goryachev_chaplygin(rng):
    moments, com = permute(rng, np.array([4.0, 4.0, 1.0]), np.array([0.5, 0, 0]))
    momentum = np.append(rng.normal(size=2) * 2, 0.0)
    return make_scene(rng, make_body(moments, com), momentum=momentum)


def general_in_rotated_axes(rng):
    body = make_body(random_moments(rng), rng.normal(size=3)).turn(random_attitude(rng))
    return make_scene(rng, body, gravity=rng.choice([1.0, -1.0, 9.81]))


def nearly_upright(rng):
    """Draw a nearly upright top whose centre of mass lies on a random principal axis."""
    k = rng.integers(3)
    moments, com = random_moments(rng), 0.5 * np.eye(3)[k]
    # turns the axis of the centre of mass to the vertical
    turn = np.array([(1, -1, -1, -1), (1, 1, 1, 1), (2, 0, 0, 0)][k]) / 2
    tilt = 10.0 ** rng.uniform(-16, -4) / 2
    attitude = kr.quaternion.multiply((math.cos(tilt), math.sin(tilt), 0, 0), turn)
    spin = com * 2 * rng.uniform(0, 9)
    return kr.Scene(make_body(moments, com), body_velocity=spin, attitude=attitude, gravity=1)


FAMILIES = [
    general_damped,
    symmetric_damped,
    sphere_damped,
    sleeping,
    free_about_an_axis,
    steady_precession,
    lagrange_in_rotated_axes,
    euler_near_middle_axis,
    kowalewski,
    goryachev_chaplygin,
    general_in_rotated_axes,
    nearly_upright,
]
REGULAR = {"sleeping", "steady_precession", "lagrange_in_rotated_axes", "kowalewski"}


class Reference:
    """The 20-digit reference path of a scene, and the attitude error allowed at each time."""

    def __init__(self, scene, times):
        self.scene, self.t = scene, times
        self.path = kr.solve(scene, times, digits=20, tangents=DATA)
        self.allowed = FLOOR + SLACK * self.path.conditioning

    def deviation(self, q):
        return float((kr.attitude_error(q, self.path.q) / self.allowed).max())


def check_solve(reference):
    scene, t = reference.scene, reference.t
    yield "solve", reference.deviation(kr.solve(scene, t).q)
    yield "taylor", reference.deviation(kr.solve(scene, t, "taylor").q)
    pieces = kr.stream(scene, list(t), chunk=3)
    yield "stream", reference.deviation(np.concatenate([piece.q for piece in pieces]))


def check_resume(reference, folder):
    run = kr.start(reference.scene, back=bool(reference.t[-1] < 0))
    half = len(reference.t) // 2
    first = run.to(reference.t[:half]).q
    run.save(folder / "run.kreisel")
    rest = kr.resume(folder / "run.kreisel").to(reference.t[half:]).q
    yield "resume", reference.deviation(np.concatenate([first, rest]))


def check_tangents(reference):
    path = kr.solve(reference.scene, reference.t, tangents=DATA)
    yield "tangents: path", reference.deviation(path.q)
    truth = reference.path.tangents
    scale = np.abs(truth).max(axis=(1, 2), keepdims=True)
    relative = np.abs(path.tangents - truth).max(axis=(1, 2)) / scale[:, 0, 0]
    limits = 1e-12 + reference.allowed * np.maximum(1.0, scale[:, 0, 0])
    yield "tangents", float((relative / limits).max())


def check_events(reference):
    scene, end = reference.scene, float(reference.t[-1])
    events = [kr.events.nutation(), kr.events.plane((1.0, 0.3, 0.2))]
    found = kr.solve(scene, end, events=events).events
    truth = kr.solve(scene, end, events=events, digits=20).events
    rate = max(1.0, float(np.abs(np.linalg.norm(kr.solve(scene, [0.0]).velocity))))
    # The smaller the range of the height, the more one rounding of the height moves its extrema.
    limit = 100 * reference.allowed.max() + (1e-12 + 1e-15 / apex_range(scene)) / rate
    if len(found.t) == len(truth.t):
        yield "events", float(np.abs(found.t - truth.t).max(initial=0.0)) / limit
        return
    # If the height barely reaches an extremum, rounding decides whether an event is found.
    extra = [t for t in found.t if np.abs(truth.t - t).min(initial=np.inf) > 1e-3]
    missing = [t for t in truth.t if np.abs(found.t - t).min(initial=np.inf) > 1e-3]
    yield "events: number", 2.0 if (extra or missing) and is_generic(scene) else 0.0


def apex_range(scene):
    """Return the range of the apex heights along a path, or 1e-16 if it is smaller."""
    path = kr.solve(scene, np.linspace(0, 3, 50), digits=20)
    return max(float(np.ptp(path.apex[:, 2])), 1e-16)


def is_generic(scene):
    """Return False if the height of the apex varies so little that rounding errors dominate."""
    return apex_range(scene) > 1e-8


def check_section(reference):
    scene = reference.scene
    if not is_generic(scene) or any(scene.damping):
        return
    section = kr.section(scene, n=3)
    if section.count[()] < 3:
        return
    truth = kr.solve(scene, section.t, digits=20, tangents=DATA)
    low = kr.solve(
        scene, float(section.t[-1]) * 1.01 + 0.1, events=kr.events.nutation(direction=1), digits=20
    ).events
    error = kr.attitude_error(section.q, truth.q) / (FLOOR + SLACK * truth.conditioning)
    yield "section: states", float(error.max())
    limit = 1e-11 + 1e3 * float(truth.conditioning.max())
    yield "section: times", float(np.abs(section.t - low.t[: len(section.t)]).max()) / limit


def check_growth(reference, family):
    scene, end = reference.scene, float(reference.t[-1])
    if any(scene.damping):
        return
    indicator = kr.lyapunov(scene, end)
    size = np.linalg.norm(scene.momentum) + math.sqrt(
        max(scene.body.moments)
        * scene.body.mass
        * abs(scene.gravity)
        * float(np.linalg.norm(scene.body.com))
    )
    unit = np.array([1.0] * 3 + [1.0 / size] * 3)
    start = reference.path.tangents[-1][:, :6] * unit[:, None] / unit[None, :]
    growth = float(indicator.value) * abs(end)
    yield "growth: bound", growth / (math.log(np.linalg.norm(start)) + math.log(100.0))
    if family in REGULAR:
        rate = float(np.linalg.norm(kr.solve(scene, [0.0]).velocity[0])) + 1.0
        yield "growth: regular", growth / (math.log(10.0 + 10.0 * rate * abs(end)) + 3.0)


def check_top(family, scene, times, folder):
    """Return the largest error of each check over the allowed one, or {} if unresolved."""
    reference = Reference(scene, times)
    if reference.allowed.max() > UNRESOLVED:
        return {}
    errors = {}
    checks = (
        check_solve(reference),
        check_resume(reference, folder),
        check_tangents(reference),
        check_events(reference),
        check_section(reference),
        check_growth(reference, family),
    )
    for check in checks:
        errors.update(check)
    return errors


def check_ensemble(scenes, times):
    paths = kr.solve(kr.Ensemble.of(scenes), np.array(times))
    reductions = reduce_last(kr.Ensemble.of(scenes), np.array(times))
    for i, scene in enumerate(scenes):
        reference = Reference(scene, times[i])
        if reference.allowed.max() > UNRESOLVED:
            continue
        yield i, "ensemble", reference.deviation(paths.q[i])
        last = np.abs(reductions[i] - reference.path.body_velocity[-1]).max()
        rate = np.abs(reference.path.body_velocity[-1]).max() + 1.0
        yield i, "reduce", float(last / rate / (10 * reference.allowed[-1]))


def reduce_last(tops, times):
    rows = kr.reduce(tops, times, {"body_velocity": "last"})
    return np.asarray(rows["body_velocity"]["last"])


def main(argv=None):
    parser = argparse.ArgumentParser(
        prog="python -m validation.benchmarks.agreement", description=__doc__.splitlines()[0]
    )
    parser.add_argument("--tops", type=int, default=2000)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args(argv)
    warnings.simplefilter("ignore")
    bad = 0
    with tempfile.TemporaryDirectory() as name:
        for k, family in enumerate(FAMILIES):
            n = -(-(options.tops - k) // len(FAMILIES))
            bad += check_family(family, n, options.seed, k, Path(name))
    print(f"{bad} disagreements")
    return 1 if bad else 0


def check_family(family, n, seed, k, folder):
    rngs = [np.random.default_rng([seed, k, i]) for i in range(n)]
    scenes = [family(rng) for rng in rngs]
    times = [
        np.linspace(0, 1, 7)[1:] * rng.choice([-1, 1]) * 10 ** rng.uniform(-1, 1.3) for rng in rngs
    ]
    if family.__name__.endswith("damped"):  # damped tops speed up if integrated backwards
        times = [np.where(t < 0, t / 4, t) for t in times]
    worst = Counter()
    bad = 0
    rows = [(i, check_top(family.__name__, scenes[i], times[i], folder)) for i in range(n)]
    for i, verb, ratio in check_ensemble(scenes, times):
        rows.append((i, {verb: ratio}))
    unresolved = sum(not errors for _, errors in rows)
    for i, errors in rows:
        for verb, ratio in errors.items():
            worst[verb] = max(worst[verb], ratio)
            if not ratio <= 1.0:
                bad += 1
                print(f"  {family.__name__} {i}, t to {times[i][-1]:.3g}: {verb} {ratio:.3g}")
    ratios = ", ".join(f"{verb} {ratio:.2g}" for verb, ratio in worst.items())
    print(f"{family.__name__:25} {n} tops, {unresolved} unresolved; worst ratios: {ratios}")
    return bad


if __name__ == "__main__":
    sys.exit(main())
