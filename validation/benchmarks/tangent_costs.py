"""The additional run time for tangents.

    python -m validation.benchmarks.tangent_costs [scalar outputs ensemble heyoka rate]

scalar    a path with one tangent, with six and with fourteen, over the path alone
outputs   the time of one of 1,000 states with 13 tangents, without that of the steps, and the time
          of the derivatives of two quantities at these states
ensemble  the indicators of chaos over the paths alone, for several gravities, on one thread
heyoka    heyoka's var_ode_sys of first order against six tangents: the path with its derivative by
          the start, at heyoka's tightest tolerance, and both errors
rate      tops per second to t = 1000 for kreisel.megno on two threads, of the asymmetric scene

All calls run alternately in one process. Each time is the shortest of several rounds.
"""

from __future__ import annotations

import argparse
import time

import heyoka as hy
import kreisel as kr
import numpy as np
from kreisel._core import start

from ..references import equations
from ..references.problems import load_problem

SCENES = ("thesis", "kowalewski", "asymmetric")
BY = {"alone": 0, "one": 8, "six": 1, "fourteen": 31}
ROUNDS = 25


def least_times(*calls, rounds=ROUNDS):
    """Return the shortest time of each call over interleaved rounds [s]."""
    times = np.full((rounds, len(calls)), np.inf)
    for spent in times:
        for i, call in enumerate(calls):
            begun = time.perf_counter()
            call()
            spent[i] = time.perf_counter() - begun
    return times.min(axis=0)


def make_run(scene, t, bits):
    """Return a call that integrates a top to `t`, with the tangents that `bits` selects."""

    def call():
        _, top = start(scene._block, "taylor", 0.0, 0.0, 0, 0, False, False, [], bits)
        top.record(np.array([t]), False)

    return call


def scalar():
    for name in SCENES:
        scene = getattr(kr.scenes, name)
        times = least_times(*(make_run(scene, 100.0, bits) for bits in BY.values()))
        ratios = ", ".join(
            f"{word} {spent / times[0]:.2f}" for word, spent in zip(BY, times, strict=True)
        )
        print(f"{name}: {ratios}", flush=True)


def outputs():
    by = ("start", "moments", "com", "gravity")
    for name in SCENES:
        scene, t = getattr(kr.scenes, name), np.linspace(0.0, 10.0, 1001)
        path = kr.solve(scene, t, tangents=by)
        many, ends, apex, velocity = least_times(
            lambda scene=scene, t=t: kr.solve(scene, t, tangents=by),
            lambda scene=scene, t=t: kr.solve(scene, t[[0, -1]], tangents=by),
            lambda path=path: path.derivative("apex"),
            lambda path=path: path.derivative("body_velocity"),
        )
        print(
            f"{name}: {(many - ends) * 1e3:.2f} us for an output, {ends * 1e3:.2f} ms for the "
            f"steps; 1001 derivatives of apex {apex * 1e3:.2f} ms, of body_velocity "
            f"{velocity * 1e3:.2f} ms",
            flush=True,
        )


def ensemble():
    for name in SCENES:
        tops = getattr(kr.scenes, name).vary(gravity=1.0 + 0.01 * np.linspace(-1.0, 1.0, 256))
        plain, level, grown = least_times(
            lambda tops=tops: kr.solve(tops, [100.0], "taylor", threads=1),
            lambda tops=tops: kr.solve(tops, [100.0], "taylor", want=["nutation"], threads=1),
            lambda tops=tops: kr.megno(tops, [100.0], threads=1),
            rounds=5,
        )
        print(
            f"{name}: {grown / plain:.2f} times the paths, {grown / level:.2f} times those without "
            "heading"
        )


def attitude_derivative(path, inertia):
    """Return the derivative of the attitude with respect to the initial body velocity, (4, 3)."""
    turns = np.stack([kr.quaternion.turn(path.q[0], axis) for axis in np.eye(3)], axis=1)
    theta = path.tangents[-1][:3, 3:6] @ (turns * inertia)
    return np.stack(
        [kr.quaternion.multiply(path.q[-1], (0.0, *(column / 2.0))) for column in theta.T], axis=1
    )


def heyoka():
    for name in SCENES:
        problem = load_problem(name)
        scene, end = problem.to_scene(), 30.0
        system, begin = equations.build_system(problem)
        varied = hy.var_ode_sys(system, hy.var_args.vars, order=1)
        top = hy.taylor_adaptive(varied, begin, tol=2.0**-52, compact_mode=True)
        fresh = top.state.copy()

        def theirs(top=top, fresh=fresh, end=end):
            top.time, top.state[:] = 0.0, fresh
            top.propagate_until(end)

        def ours(scene=scene, end=end):
            return kr.solve(scene, [0.0, end], "taylor", tangents="start")

        inertia = np.array(problem.inertia)
        true = attitude_derivative(
            kr.solve(scene, [0.0, end], digits=30, tangents="start"), inertia
        )
        spent = least_times(theirs, ours)
        theirs()
        slices = top.get_vslice(order=1)
        derivative = top.state[slices].reshape(7, 7)[:4, 4:]
        errors = []
        for found in (derivative, attitude_derivative(ours(), inertia)):
            sign = np.sign((found * true).sum())
            errors.append(np.abs(sign * found - true).max() / np.abs(true).max())
        print(
            f"{name}: heyoka {spent[0] * 1e6:.0f} us, error {errors[0]:.1e}; kreisel "
            f"{spent[1] * 1e6:.0f} us, error {errors[1]:.1e}; {spent[0] / spent[1]:.2f} times",
            flush=True,
        )


def rate():
    for tol in (None, 1e-9, 1e-6, 1e-5):
        tops = kr.scenes.asymmetric.vary(gravity=1.0 + 0.01 * np.linspace(-1.0, 1.0, 512))
        (spent,) = least_times(
            lambda tops=tops, tol=tol: kr.megno(tops, [1000.0], tol=tol, threads=2), rounds=3
        )
        print(f"tol {tol}: {len(tops) / spent:.0f} tops per second to t = 1000, on two threads")


PARTS = {"scalar": scalar, "outputs": outputs, "ensemble": ensemble, "heyoka": heyoka, "rate": rate}


def main(argv=None):
    parser = argparse.ArgumentParser(
        prog="python -m validation.benchmarks.tangent_costs",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("part", nargs="*", choices=[*PARTS, []], default=[])
    for part in parser.parse_args(argv).part or PARTS:
        print(part)
        PARTS[part]()


if __name__ == "__main__":
    main()
