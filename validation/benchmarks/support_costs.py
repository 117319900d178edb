"""The cost of rotors, moving supports, friction and damping per integration step.

    python -m validation.benchmarks.support_costs [kind ...] [--rounds 41] [--digits 16 30]

Each effect is switched on and off alternately, and the program prints the median ratio of the two
run times. The program also times ensembles of tops on one thread. Ensembles of tops without support
motion, friction or damping use SIMD instructions. For all ensembles, the cost relative to that of a
single top with none of these effects is also printed.
"""

import argparse
import time
from dataclasses import replace
from statistics import median

import kreisel as kr
import numpy as np

MEMBERS = 32
SPAN = {16: 400.0, 20: 100.0, 30: 20.0}  # time of a path [T]
START = {"momentum": (0.4, -0.5, 0.9), "attitude": (0.5, 0.5, -0.5, 0.5), "gravity": 1}
BODIES = {
    "asymmetric": kr.Body(1.0, (1.0, 1.3, 0.8), (0.2, -0.1, 0.5), unphysical=True),
    "symmetric": kr.Body.symmetric(1.0, 1.0, 0.6, 0.5, unphysical=True),
    "kowalewski": kr.Body(1.0, (1.0, 1.0, 0.5), (0.5, 0.0, 0.0), unphysical=True),
}
WORDS = {
    "turning": {"turning": (0.1, 0.2, 0.3)},
    "shaking": {"shaking": (0.01, 20.0, 0.3)},
    "turning and shaking": {"turning": (0.1, 0.2, 0.3), "shaking": (0.01, 20.0, 0.3)},
    "friction": {"friction": 1e-6},
    "damping": {"damping": 1e-4},
}


def make_scenes(kind):
    """Return a simple scene, and variants of it with one or two additional effects each."""
    body = BODIES[kind]
    plain = kr.Scene(body, **START)
    rotor = plain.replace(body=replace(body, rotor=(0.1, 0.05, -0.08)))
    return plain, {"rotor": rotor, **{name: plain.replace(**WORDS[name]) for name in WORDS}}


def make_ensemble(scene):
    """Return an ensemble of tops with slightly different initial momenta."""
    momentum = np.array(scene.momentum) + np.linspace(0.0, 1e-3, MEMBERS)[:, None]
    return scene.vary(momentum=momentum)


def time_single(scene, digits, share):
    """Return the run time [s] per step for a single top."""
    begin = time.perf_counter()
    path = kr.solve(scene, share * SPAN[digits], "taylor", digits=digits)
    return (time.perf_counter() - begin) / path.stats.steps


def time_members(tops, digits, share):
    """Return the run time [s] per step of one top in an ensemble."""
    begin = time.perf_counter()
    paths = kr.solve(tops, share * SPAN[digits], "taylor", digits=digits, threads=1)
    return (time.perf_counter() - begin) / paths.steps.sum()


def find_ratios(measure, plain, others, rounds):
    """Return the relative cost of each scene, and the median run time of the scene `plain`."""
    bases, ratios = [], {name: [] for name in others}
    for _ in range(rounds):
        for name, other in others.items():
            base = measure(plain)
            ratios[name].append(measure(other) / base)
            bases.append(base)
    return {name: median(samples) for name, samples in ratios.items()}, median(bases)


def print_kind(kind, digits, rounds, share=1.0):
    """Print the cost of each optional effect, such as friction, for one kind of body."""
    plain, others = make_scenes(kind)
    single, base = find_ratios(
        lambda scene: time_single(scene, digits, share), plain, others, rounds
    )
    members = {name: make_ensemble(scene) for name, scene in others.items()}
    several, lanes = find_ratios(
        lambda tops: time_members(tops, digits, share / 4), make_ensemble(plain), members, rounds
    )
    print(f"\n{kind}, {digits} digits: a plain step takes {1e9 * base:.0f} ns, ", end="")
    print(f"{1e9 * lanes:.0f} ns in an ensemble")
    print(f"  {'':20} one top  ensemble over plain ensemble  ... over one plain top")
    for name in others:
        alone = several[name] * lanes / base
        print(f"  {name:20} {single[name]:7.2f}  {several[name]:28.2f}  {alone:22.2f}")


def main(argv=None):
    parser = argparse.ArgumentParser(
        prog="python -m validation.benchmarks.support_costs", description=__doc__.splitlines()[0]
    )
    parser.add_argument("kinds", nargs="*", default=list(BODIES), help=", ".join(BODIES))
    parser.add_argument("--digits", type=int, nargs="*", default=[16, 30], choices=SPAN)
    parser.add_argument("--rounds", type=int, default=41)
    parser.add_argument("--share", type=float, default=1.0, help="of the usual length of a path")
    args = parser.parse_args(argv)
    if unknown := set(args.kinds) - set(BODIES):
        parser.error(f"no such body: {', '.join(sorted(unknown))}")
    for kind in args.kinds:
        for digits in args.digits:
            print_kind(kind, digits, args.rounds, args.share)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
