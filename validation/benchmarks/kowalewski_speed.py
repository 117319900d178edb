"""The closed form of Kowalewski tops: refusals, errors and times for random tops.

    python -m validation.benchmarks.kowalewski_speed [--tops 10000] [--checked 2000] [--late 4]

The moments are exactly 2 : 2 : 1, with the axes in any order. Angular velocities are 0.1 to 10 in
the top's internal units. The centre of mass lies in the plane of the two axes with equal moments,
and gravity has either sign. The reference is kreisel's Taylor series with 30 digits. The first
`--checked` tops are compared with the reference at a time of 1 to 1000 units of either sign. The
first `--late` tops are compared at 1e6 units, which takes a minute for each top.
"""

import argparse
import time
from collections import Counter
from itertools import permutations

import kreisel as kr
import numpy as np

LIMITS = (2e-14, 5e-14)
ORDERS = tuple(permutations(range(3)))


def draw_top(rng, ratio):
    """Return a random scene with moments ratio : ratio : 1, and its unit of time."""
    unit, order = 2.0 ** rng.integers(-3, 4), list(ORDERS[rng.integers(6)])
    inertia, com = np.empty(3), np.zeros(3)
    inertia[order] = ratio * unit, ratio * unit, unit
    across = rng.normal(size=2) if rng.random() < 0.25 else np.eye(2)[rng.integers(2)]
    com[order[:2]] = across * rng.choice([-1, 1]) * 2.0 ** rng.uniform(-2, 2)
    gravity = float(rng.choice([1.0, 9.81, -2.5]))
    reference = unit if ratio == 2 else ratio * unit
    tau = float(np.sqrt(reference / (abs(gravity) * np.linalg.norm(com))))
    attitude = rng.normal(size=4)
    momentum = rng.normal(size=3) * ratio * unit / tau * 10.0 ** rng.uniform(-1, 1)
    if ratio == 4:
        momentum[2] = 0.0
    body = kr.Body(1.0, tuple(inertia), tuple(com), unphysical=True)
    attitude /= np.linalg.norm(attitude)
    return kr.Scene(body, momentum=tuple(momentum), attitude=tuple(attitude), gravity=gravity), tau


def draw(rng):
    """Return a random Kowalewski top and its unit of time."""
    return draw_top(rng, 2)


def miss(scene, top, t):
    """Return the attitude error [rad] and the relative momentum error of the closed form at `t`."""
    truth, got = kr.solve(scene, [t], digits=30), top([t])
    p, q = truth.q[0], got.q[0]
    near = min(np.linalg.norm(p - q), np.linalg.norm(p + q))
    return 4 * np.arcsin(near / 2), float(
        np.linalg.norm(got.m[0] - truth.m[0]) / np.linalg.norm(truth.m[0])
    )


def say(title, values):
    print(
        f"{title}: median {np.median(values):.1e}, 99 % {np.quantile(values, 0.99):.1e}, "
        f"worst {np.max(values):.1e}"
    )


def measure(draw, tops, checked, late, seed):
    """Print refusals, errors and times of random tops that `draw` returns."""
    rng, refused, found = np.random.default_rng(seed), Counter(), []
    planned, certificates, states, batches = [], [], [], []
    for number in range(tops):
        scene, tau = draw(rng)
        begin = time.process_time()
        try:
            top = kr.exact(scene)
        except ValueError as error:
            refused[str(error).split(": ")[1]] += 1
            continue
        planned.append(time.process_time() - begin)
        certificates.append(top.certificate)
        if number < checked:
            units = 1e6 if number < late else 10.0 ** rng.uniform(0, 3)
            t = float(rng.choice([-1, 1]) * units * tau)
            found.append((*miss(scene, top, t), top.certificate, units))
        if number % 100 == 0:
            batches.append(time_of_a_state(top, tau))
            states.append(time_of_a_state(top, tau, 1))
    print(f"{tops} tops, {sum(refused.values())} refused: {dict(refused)}")
    say("certificate", certificates)
    errors = np.array(found)
    if len(errors):
        say(f"attitude of {len(errors)} tops [rad]", errors[:, 0])
        say("momentum", errors[:, 1])
        within = ", ".join(f"{np.mean(errors[:, 0] <= x):.2%} within {x:.0e}" for x in LIMITS)
        print(f"attitude: {within}")
        say("attitude error over 1e-15 + certificate", errors[:, 0] / (1e-15 + errors[:, 2]))
        for row in errors[errors[:, 3] >= 1e6]:
            print(f"  at 1e6 units: {row[0]:.1e} rad, certificate {row[2]:.1e}")
    print(
        f"a plan: median {np.median(planned) * 1e6:.0f} us, 99 % "
        f"{np.quantile(planned, 0.99) * 1e6:.0f} us of processor time"
    )
    print(
        f"a state of 2000 at once: median {np.median(batches) * 1e9:.0f} ns; "
        f"one alone, with the call from Python: {np.median(states) * 1e9:.0f} ns"
    )


def time_of_a_state(top, tau, at_once=2000):
    """Return the processor time per state [s], if `at_once` states are computed per call."""
    t, calls = np.linspace(0.0, 1e4 * tau, at_once), max(1, 200 // at_once)
    times = []
    for _ in range(3):
        begin = time.process_time()
        for _ in range(calls):
            top(t)
        times.append((time.process_time() - begin) / calls / at_once)
    return min(times)


def run(name, description, draw, argv):
    """Measure tops that `draw` returns, with the options of a command line."""
    parser = argparse.ArgumentParser(
        prog=f"python -m validation.benchmarks.{name}", description=description
    )
    parser.add_argument("--tops", type=int, default=10000)
    parser.add_argument("--checked", type=int, default=2000)
    parser.add_argument("--late", type=int, default=4)
    parser.add_argument("--seed", type=int, default=1)
    chosen = parser.parse_args(argv)
    measure(draw, chosen.tops, chosen.checked, chosen.late, chosen.seed)


def main(argv=None):
    run("kowalewski_speed", __doc__.split("\n")[0], draw, argv)


if __name__ == "__main__":
    main()
