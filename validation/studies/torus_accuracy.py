"""The accuracy of closed-form solutions for random Kowalewski and Goryachev-Chaplygin tops.

    python -m validation.studies.torus_accuracy [kowalewski|goryachev_chaplygin] [--tops 10000]

Random tops are generated as in validation/benchmarks/kowalewski_speed.py. Here tau denotes the
natural unit of time of the top. The reference solutions are computed by the Taylor method in
30-digit arithmetic. For each top, the error is measured at one random time that differs from the
initial time by 0.1 to `--longest` times tau. For the first `--late` tops, the error is also
measured at a random time from 1e4 to 1e6 tau. The conditioning is the largest change of a state if
the initial state is perturbed by one rounding error in each of three random directions. The drift
of the conserved quantities is measured up to 1e6 times the natural unit of time tau.

To test consistency, the closed form of the first `--restarted` tops is also computed from a later
state of the same motion. The two closed forms are compared at a late time, 1e6 times the natural
unit of time tau. The difference between the two solutions is divided by the effect of one rounding
error, because rounding errors change the frequencies of the motion.

Some algorithms rest on numerical evidence rather than proof, as the source files of the closed
forms explain. With `--plans 1000000`, a million tops are tested. The closed form of each top is
then compared with the Taylor method at one random time, 1 to 10 tau before or after the initial
time. The certificate of a closed form is the largest error found in checks near the initial time.
"""

import argparse
from collections import Counter
from dataclasses import dataclass, field

import kreisel as kr
import numpy as np

from ..benchmarks.kowalewski_speed import draw_top

KINDS = {"kowalewski": (2, 2e-14), "goryachev_chaplygin": (4, 5e-14)}
UNIT_ROUNDING = 2.0**-53
NUDGE = 1e-10  # relative size of the perturbations that measure the conditioning
LATE = 1e6  # latest time [tau]
INTEGRALS = 5  # number of times at which the integrals are compared
LARGE_CERTIFICATES = (1e-14, 1e-13, 1e-12, 1e-11)
LARGE_ERRORS = (1e-13, 1e-12, 1e-11, 1e-10)


def differ(one, other, scale):
    """Return the largest difference between two paths, in attitude or in scaled momentum."""
    p, q = one.q, other.q
    distance = np.minimum(np.linalg.norm(p - q, axis=1), np.linalg.norm(p + q, axis=1))
    angles = 4.0 * np.arcsin(np.minimum(distance / 2.0, 1.0))
    return float(np.max(np.maximum(angles, np.linalg.norm(one.m - other.m, axis=1) / scale)))


def largest_momentum(scene):
    """Return an upper bound on the momentum for the energy of a scene."""
    start = kr.exact(scene)([0.0])
    lever = scene.body.mass * abs(scene.gravity) * np.linalg.norm(scene.body.com)
    return float(np.sqrt(2.0 * max(scene.body.inertia) * (abs(start.energy[0]) + 3.0 * lever)))


def nudge(scene, rng, scale):
    """Return the scene with a random perturbation of its initial state."""
    turn = np.array([1.0, *(0.5 * NUDGE * rng.normal(size=3))])
    w, x, y, z = scene.attitude
    matrix = np.array([[w, -x, -y, -z], [x, w, -z, y], [y, z, w, -x], [z, -y, x, w]])
    attitude, momentum = (
        matrix @ turn,
        np.array(scene.momentum) + NUDGE * scale * rng.normal(size=3),
    )
    if scene.momentum[2] == 0.0:
        momentum[2] = 0.0
    return scene.replace(attitude=tuple(attitude / np.linalg.norm(attitude)), momentum=momentum)


def condition(scene, t, rng, scale, solve):
    """Return the effect of one rounding error in the initial state on the state at time `t`."""
    path, most = solve(scene, [t]), 0.0
    for _ in range(3):
        change = differ(solve(nudge(scene, rng, scale), [t]), path, scale)
        most = max(most, change / NUDGE * UNIT_ROUNDING)
    return most


def solve_with_30_digits(scene, t):
    return kr.solve(scene, t, digits=30)


def compare_with_series(scene, top, t, rng, scale, limit):
    """Return the error of the closed form at `t` and, if it is large, the effect of rounding."""
    error = differ(top([t]), solve_with_30_digits(scene, [t]), scale)
    return error, condition(scene, t, rng, scale, solve_with_30_digits) if error > limit else 0.0


def drift_of_integrals(top, tau, rng, scale):
    """Return the largest relative drift of the three conserved quantities."""
    t = rng.choice([-1, 1], INTEGRALS) * 10.0 ** rng.uniform(0, np.log10(LATE), INTEGRALS) * tau
    path = top(np.sort(np.concatenate([[0.0], t])))
    body, zero = top.scene.body, np.searchsorted(np.sort(t), 0.0)
    unit = scale / max(body.inertia)
    is_kowalewski = max(body.inertia) < 3 * min(body.inertia)
    third = path.kowalewski if is_kowalewski else path.goryachev_chaplygin
    power = 4 if is_kowalewski else 3

    def apart(values, size):
        return float(np.max(np.abs(values - values[zero]))) / size

    return (
        apart(path.energy, scale * unit),
        apart(path.m[:, 2], scale),
        apart(third, unit**power),
    )


def compare_restarted(scene, top, tau, rng, scale):
    """Return the difference between closed-form solutions computed from two states of a motion.

    The difference between the two solutions is divided by the effect of one rounding error in the
    initial state. Returns None if kr.exact does not accept the second state as an initial state.
    """
    start_time = float(rng.uniform(1.0, 20.0) * tau)
    begin = solve_with_30_digits(scene, [start_time])
    momentum = (*begin.m[0, :2], scene.momentum[2])
    later_scene = scene.replace(attitude=tuple(begin.q[0]), momentum=momentum)
    late = LATE * tau * float(rng.choice([-1, 1]))
    try:
        other = kr.exact(later_scene)
        sensitive = condition(later_scene, late, rng, scale, lambda s, t: kr.exact(s)(t))
    except ValueError:
        return None
    return differ(top([late + start_time]), other([late]), scale) / (1e-15 + sensitive)


def describe(title, values, *limits):
    """Print the median, the 99 % quantile and the maximum of `values`."""
    values = np.array(values)
    fractions = "".join(f", {np.mean(values <= x):.3%} within {x:.0e}" for x in limits)
    print(
        f"{title}: median {np.median(values):.1e}, 99 % {np.quantile(values, 0.99):.1e}, "
        f"worst {np.max(values):.1e}{fractions} ({len(values)} tops)",
        flush=True,
    )


@dataclass
class Findings:
    """The results for all tops of one kind, and a list of tops with large errors."""

    certificates: list = field(default_factory=list)
    errors: list = field(default_factory=list)
    excess: list = field(default_factory=list)
    integrals: list = field(default_factory=list)
    restarted: list = field(default_factory=list)
    late: list = field(default_factory=list)


def examine(number, scene, top, tau, options, limit, rng, findings):
    """Compute the errors of the closed form for one top, and append them to `findings`."""
    scale = largest_momentum(scene)
    findings.certificates.append(top.certificate)
    t = float(rng.choice([-1, 1]) * 10.0 ** rng.uniform(-1, np.log10(options.longest)) * tau)
    error, sensitive = compare_with_series(scene, top, t, rng, scale, limit)
    findings.errors.append(error)
    if error > limit:
        findings.excess.append((error, sensitive, top.certificate, t / tau, number))
    findings.integrals.append(drift_of_integrals(top, tau, rng, scale))
    if number < options.restarted:
        findings.restarted.append(compare_restarted(scene, top, tau, rng, scale))
    if number < options.late:
        t = float(rng.choice([-1, 1]) * 10.0 ** rng.uniform(4, 6) * tau)
        findings.late.append(compare_with_series(scene, top, t, rng, scale, np.inf)[0])


def print_findings(findings, options, limit):
    """Print the distributions of errors and certificates, and list the tops with large errors."""
    describe("certificate", findings.certificates)
    describe(f"error up to {options.longest:g} tau", findings.errors, limit, 10 * limit)
    for error, sensitive, certificate, t, number in sorted(findings.excess, reverse=True)[:20]:
        print(
            f"  top {number} at {t:.3g} tau: error {error:.1e}, conditioning {sensitive:.1e}, "
            f"certificate {certificate:.1e}, ratio {error / sensitive:.2g}"
        )
    names = ("energy", "vertical momentum", "third integral")
    for name, values in zip(names, np.transpose(findings.integrals), strict=True):
        describe(f"{name} up to {LATE:g} tau", values)
    ratios = [x for x in findings.restarted if x is not None]
    if ratios:
        describe(f"second plan at {LATE:g} tau, over the conditioning", ratios, 1.0, 10.0)
    print(f"  {len(findings.restarted) - len(ratios)} second plans refused")
    if findings.late:
        describe(f"error at 1e4 to {LATE:g} tau", findings.late, limit)


def reason_of(refusal):
    """Return the reason why kr.exact rejects a scene."""
    return str(refusal).split(": ")[1].split("; ")[0]


def count_above(values, limits):
    return ", ".join(f"{np.sum(np.array(values) > x)} above {x:.0e}" for x in limits)


def plan_tops(kind, options):
    """Compute closed forms for many random tops of one kind, and print the errors."""
    rng, refusals, certificates, rows = np.random.default_rng(options.seed), Counter(), [], []
    for number in range(options.plans):
        scene, tau = draw_top(rng, KINDS[kind][0])
        t = float(rng.choice([-1, 1]) * rng.uniform(1.0, 10.0) * tau)
        try:
            top = kr.exact(scene)
        except ValueError as refusal:
            refusals[reason_of(refusal)] += 1
            continue
        certificates.append(top.certificate)
        size = float(np.linalg.norm(scene.momentum)) + max(scene.body.inertia) / tau
        error = differ(top([t]), kr.solve(scene, [t], method="taylor"), size)
        rows.append((error, top.certificate, t / tau, number))
    print(f"{kind}: {options.plans} tops, {sum(refusals.values())} refused: {dict(refusals)}")
    errors = [row[0] for row in rows]
    describe("certificate", certificates)
    print(f"  {count_above(certificates, LARGE_CERTIFICATES)}")
    describe("difference from the Taylor series of 16 digits at 1 to 10 tau", errors)
    print(f"  {count_above(errors, LARGE_ERRORS)}")
    for error, certificate, t, number in sorted(rows, reverse=True)[:10]:
        print(
            f"  top {number} at {t:.3g} tau: difference {error:.1e}, certificate {certificate:.1e}"
        )


def measure(kind, options):
    """Run the study for random tops of one kind, and print the errors."""
    ratio, limit = KINDS[kind]
    rng, refusals, findings = np.random.default_rng(options.seed), Counter(), Findings()
    for number in range(options.tops):
        scene, tau = draw_top(rng, ratio)
        try:
            top = kr.exact(scene)
        except ValueError as refusal:
            refusals[reason_of(refusal)] += 1
            continue
        examine(number, scene, top, tau, options, limit, rng, findings)
    print(f"{kind}: {options.tops} tops, {sum(refusals.values())} refused: {dict(refusals)}")
    print_findings(findings, options, limit)


def main(argv=None):
    parser = argparse.ArgumentParser(
        prog="python -m validation.studies.torus_accuracy", description=__doc__.split("\n")[0]
    )
    parser.add_argument("kind", nargs="?", choices=list(KINDS))
    parser.add_argument("--tops", type=int, default=10000)
    parser.add_argument("--longest", type=float, default=1000.0)
    parser.add_argument("--restarted", type=int, default=1000)
    parser.add_argument("--late", type=int, default=0)
    parser.add_argument("--plans", type=int, default=0)
    parser.add_argument("--seed", type=int, default=7)
    options = parser.parse_args(argv)
    for kind in [options.kind] if options.kind else KINDS:
        (plan_tops if options.plans else measure)(kind, options)


if __name__ == "__main__":
    main()
