"""The accuracy of solutions for random tops with rotors, damping, friction and moving supports.

    python -m validation.studies.real_tops [--tops 2000] [--seed 1]

Each top has a random type of body, which is described in rotated or permuted axes. A rotor,
damping, friction, a turning support and a shaken support each occur with probability 1/2. If a top
is damped, the damping is strong with probability 1/4. Times may be negative, unless the damping is
strong. The reference is computed by heyoka in 128-bit arithmetic
(validation/references/support_equations.py). The reference shares no code with kreisel; it uses
only the attributes of the scene. The motion of every top is computed with 16, 20 and 30 digits, in
an ensemble, and by a run that is saved and resumed. If the motion has a closed-form solution, this
solution is tested as well.

The conditioning of a state is its largest change, to first order, when each parameter and initial
value of the scene is rounded once. The conditioning is the larger of `path.conditioning`, which
refers to the attitude, and the analogous value for the momentum. As a check, the reference is
recomputed with each parameter and initial value multiplied at random by 1 + 2^-30 or 1 - 2^-30. The
resulting change of the reference state, rescaled to perturbations of relative size 2^-53, must not
exceed the predicted change.

Errors in the attitude are rotation angles [rad]. Errors in the momentum are divided by the largest
moment of inertia times the rotation rate of the top. No error should exceed 10 times the
conditioning of the state, the effect of rounding the input. For solutions with 20 and 30 digits,
the largest allowed error is reduced in proportion to the rounding errors of 1e-20 and 1e-30.
"""

import argparse
import math
from collections import Counter
from dataclasses import dataclass, field

import kreisel as kr
import numpy as np
from kreisel._results.tangent_data import collect_scene_numbers

from ..references.support_equations import (
    SupportIntegrator,
    find_attitude_error,
    find_momentum_error,
)

WORDS = ("rotor", "damping", "turning", "shaking", "friction")
KINDS = ("general", "lagrange", "oblique", "free", "free axial", "spherical", "kowalewski", "gc")
UNIT = {16: 2.0**-53, 20: 1e-20, 30: 1e-30}
NUDGE = 2.0**-30
NUDGES = 4
LIMIT = 10.0
GROUP = 25  # tops of an ensemble
# Times of strong damping are at most this over the damping. If some axes are damped too weakly for
# the slow manifold, the rounding errors of more steps would exceed the limit.
MOST_DECAY = 2e3
# Backward times are at most this over the rate of damping, beyond which the top turns so fast that
# the reference would need minutes.
MOST_DRIVE = 6.0
MOST_GROWTH = 1e6  # tops whose conditioning is larger are chaotic, and are counted only


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
    """Return a random scene, the names of its nonzero parameters, and a random time."""
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
    labels = [kind, *[word for word in WORDS if has[word]]]
    fastest = max(np.array(scene.damping) / scene.body.moments)
    if t < 0.0 and fastest > 0.0:  # damping drives the top backward in time
        t = float(max(t, -MOST_DRIVE / fastest))
    strongest = max(scene.damping)
    if strongest > 1.0:  # the reference takes steps as short as the damping requires
        t = min(abs(t), MOST_DECAY / strongest)
        labels.append("strong damping")
    return scene, tuple(labels), t


@dataclass
class Nudged:
    """A scene with every number multiplied at random by 1 + `NUDGE` or 1 - `NUDGE`."""

    scene: kr.Scene
    rng: np.random.Generator
    body: object = field(init=False)

    def __post_init__(self):
        scene, body = self.scene, self.scene.body
        for name in ("attitude", "momentum", "damping", "turning", "shaking"):
            setattr(self, name, self._nudge(getattr(scene, name)))
        self.gravity, self.friction = (self._nudge([x])[0] for x in (scene.gravity, scene.friction))
        self.body = argparse.Namespace(
            mass=self._nudge([body.mass])[0], axes=self._nudge(body.axes)
        )
        for name in ("moments", "principal_com", "principal_rotor"):
            setattr(self.body, name, self._nudge(getattr(body, name)))

    def _nudge(self, numbers):
        return np.array(numbers) * (1.0 + NUDGE * self.rng.choice((-1.0, 1.0), len(numbers)))


def differ(one, other, scale):
    """Return the larger of the differences in attitude and scaled momentum of two states (q, m)."""
    p, q, difference = one[0], other[0], one[1] - other[1]
    square = min(abs(float((p - q) @ (p - q))), abs(float((p + q) @ (p + q))))
    return max(2.0 * math.sqrt(square), math.sqrt(abs(float(difference @ difference))) / scale)


def bound_conditioning(scene, t, scale):
    """Return the largest change of the state if every parameter and initial value is rounded."""
    numbers = collect_scene_numbers(scene)
    parameters = tuple(name for name, values in numbers.items() if any(values))
    path = kr.solve(scene, [t], "taylor", tangents=parameters)
    sizes = np.abs([number for name in parameters for number in numbers[name]])
    momenta = np.sqrt((path.tangents[0, 3:] ** 2).sum(axis=0)) / scale
    return max(path.conditioning[0], 2.0**-53 * momenta @ sizes, 2.0**-53)


def measure_change(truth, scene, t, end, scale, rng):
    """Return the largest change of the reference state for relative input errors of 2^-53."""
    most = max(differ(truth(Nudged(scene, rng), t), end, scale) for _ in range(NUDGES))
    return most / NUDGE * 2.0**-53


@dataclass
class Top:
    """A top, its reference state at the time `t`, and the effect of rounding on this state."""

    index: int
    scene: kr.Scene
    t: float
    end: tuple
    scale: float
    conditioning: float

    def ratio(self, path, digits=16):
        """Return the error of the last state of a path, relative to the effect of rounding."""
        error = max(
            find_attitude_error(path, self.end[0]),
            find_momentum_error(path, self.end[1]) / self.scale,
        )
        return error / (self.conditioning * UNIT[digits] / UNIT[16])


@dataclass
class Tally:
    """Counts of results, and the largest errors relative to the effect of rounding the input."""

    counts: Counter = field(default_factory=Counter)
    worst: dict = field(default_factory=dict)
    faults: list = field(default_factory=list)
    changes: list = field(default_factory=list)  # of the reference, over the conditioning

    def add(self, way, ratio, top):
        self.counts[way] += 1
        if not ratio <= self.worst.get(way, (0.0,))[0]:
            self.worst[way] = ratio, top.index
        if not ratio <= LIMIT:
            self.fail(way, f"{ratio:.3g} times the conditioning", top)

    def fail(self, way, reason, top):
        self.faults.append(f"{way}, top {top.index}: {reason}, t = {top.t!r}, {top.scene!r}")


def resume_midway(scene, t):
    """Return the path of a run that is saved and resumed before its end."""
    run = kr.start(scene, back=t < 0.0)
    run.to([0.3 * t])
    return kr.resume(run.checkpoint).to([t])


def check_top(top, tally):
    """Compute a state of one top in several ways, and compare all results with the reference."""
    scene, t = top.scene, top.t
    ways = {"16 digits": lambda: kr.solve(scene, [t], "taylor")}
    ways["resumed"] = lambda: resume_midway(scene, t)
    if kr.methods["exact"].suits(scene):
        ways["exact"] = lambda: kr.solve(scene, [t], "exact")
    for digits in (20, 30):
        ways[f"{digits} digits"] = lambda d=digits: kr.solve(scene, [t], "taylor", digits=d)
    for way, solve in ways.items():
        try:
            path = solve()
        except kr.Error as error:
            tally.fail(way, error.status, top)
            continue
        tally.add(way, top.ratio(path, path.digits or 16), top)


def check_refusal(scene, t, index, tally):
    """Check that kr.solve raises an error if the past motion of a top is not unique."""
    try:
        kr.solve(scene, [t])
    except kr.Error as error:
        if error.status == "ERR_STOPPED":
            tally.counts["no unique past"] += 1
            return
    tally.fail("no unique past", "not refused", Top(index, scene, t, (), 1.0, 1.0))


def check_ensemble(tops, tally):
    """Compare the states of all members of an ensemble with their reference states."""
    many = kr.Ensemble.of([top.scene for top in tops])
    paths = kr.solve(many, np.array([[top.t] for top in tops]))
    for i, top in enumerate(tops):
        if paths.status[i]:
            tally.fail("ensemble", "failed", top)
        else:
            tally.add("ensemble", top.ratio(paths[i]), top)


def run(count, seed):
    """Check `count` random tops, and return a tally of the results and of the largest errors."""
    truth, tally, group = SupportIntegrator(), Tally(), []
    for index in range(count):
        rng = np.random.default_rng((seed, index))
        scene, labels, t = draw_top(rng)
        tally.counts.update(labels)
        end = truth(scene, t)
        if end is None:
            check_refusal(scene, t, index, tally)
            continue
        scale = max(scene.body.moments) * max(scene._rotation_rate, 1e-3)
        change = measure_change(truth, scene, t, end, scale, rng)
        if change > MOST_GROWTH * 2.0**-53:
            tally.counts["chaotic"] += 1
            continue
        top = Top(index, scene, t, end, scale, bound_conditioning(scene, t, scale))
        tally.changes.append(change / top.conditioning)
        if not change <= top.conditioning:
            tally.fail("conditioning", f"the reference changes by {change:.3g}", top)
        check_top(top, tally)
        group.append(top)
        if len(group) == GROUP:
            check_ensemble(group, tally)
            group = []
    if group:
        check_ensemble(group, tally)
    return tally


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--tops", type=int, default=2000)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    tally = run(arguments.tops, arguments.seed)
    for name, count in sorted(tally.counts.items()):
        ratio, index = tally.worst.get(name, (None, None))
        worst = "" if ratio is None else f"  worst {ratio:.3g} times the conditioning, top {index}"
        print(f"{name:<28}{count:>6}{worst}")
    if tally.changes:
        least, middle, most = np.quantile(tally.changes, (0.0, 0.5, 1.0))
        print(f"change of the reference / conditioning: {least:.2g}, {middle:.2g}, {most:.2g}")
    print(*tally.faults, sep="\n")
    print(f"{len(tally.faults)} faults")
    return 1 if tally.faults else 0


if __name__ == "__main__":
    raise SystemExit(main())
