"""The truths: heyoka in 128 bit, kept in truth.json by `python -m validation.truth`.

Each is computed twice, in two forms of the equations at two tolerances; how far they part says how far to trust it. Beside
it stands its conditioning: how far the attitude moves when the momentum moves by one rounding of a double, which no method
that works in doubles can be expected to beat.
"""
import argparse
import json
from dataclasses import replace
from pathlib import Path

import heyoka as hy
import mpmath as mp

from . import equations
from .scenes import HORIZONS, SHORT, load

FILE = Path(__file__).with_name("truth.json")
DIGITS = 40
TOLERANCE = "1e-33"


def integrator(problem, tol=TOLERANCE, form="velocity"):
    """A function of a start and of times: attitude and angular momentum in the body there, as mpmath numbers."""
    system, start = equations.system(problem, hy.real128, form)
    top = hy.taylor_adaptive(system, start, tol=hy.real128(tol), fp_type=hy.real128)

    def at(t):
        outcome = top.propagate_until(hy.real128(t))[0]
        if outcome != hy.taylor_outcome.time_limit:
            raise RuntimeError(f"heyoka stopped on {problem.name} before t = {t}: {outcome}")
        with mp.workdps(DIGITS):
            state = [mp.mpf(str(x)) for x in top.state]
            unit = problem.inertia if form == "velocity" else (1, 1, 1)
            return state[:4] + [x * mp.mpf(u) for x, u in zip(state[4:], unit)]

    def integrate(start, times):
        top.time = hy.real128(0)
        top.state[:] = equations.in_precision(start, hy.real128)
        return [at(t) for t in times]
    return integrate


def angle(p, q):
    """Angle of the rotation between two attitudes [rad], in many digits."""
    with mp.workdps(DIGITS):
        turn = equations.product([p[0]] + [-x for x in p[1:4]], q[:4])
        return float(2 * mp.atan2(mp.sqrt(sum(x * x for x in turn[1:])), abs(turn[0])))


def energy(problem, state):
    w, x, y, z = state[:4]
    up = [2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z]
    kinetic = sum(m * m / mp.mpf(J) for m, J in zip(state[4:], problem.inertia)) / 2
    return kinetic + sum(u * mp.mpf(c) for u, c in zip(up, problem.lever))


def energy_error(problem, state):
    with mp.workdps(DIGITS):
        return float(abs(1 - energy(problem, state) / energy(problem, equations.start(problem, "momentum"))))


def nudged(problem):
    """The same top with one component of its momentum moved by half an ulp or a little more, for each component."""
    for i in range(3):
        momentum = [mp.mpf(x) * (1 + (j == i) * mp.mpf(2) ** -53) for j, x in enumerate(problem.momentum)]
        yield replace(problem, momentum=momentum)


def compute(problem, times):
    """Truth by time, with what shows how good it is."""
    integrate = integrator(problem)
    states = integrate(equations.start(problem), times)
    again = integrator(problem, "1e-31", "momentum")(equations.start(problem, "momentum"), times)
    with mp.workdps(DIGITS):
        moved = [integrate(equations.start(near), times) for near in nudged(problem)]
    return {f"{t:g}": {
        "attitude": [mp.nstr(x, 34) for x in state[:4]],
        "body_momentum": [mp.nstr(x, 34) for x in state[4:]],
        "agreement": angle(state, again[i]),
        "energy_error": energy_error(problem, state),
        "conditioning": sum(angle(state, near[i]) for near in moved),
    } for i, (t, state) in enumerate(zip(times, states))}


def stored(name, t):
    """The truth of a scene at a time that truth.json holds."""
    return json.loads(FILE.read_text())["truths"][name][f"{t:g}"]


def main(argv=None):
    argparse.ArgumentParser(prog="python -m validation.truth", description=__doc__).parse_args(argv)
    truths = {name: compute(load(name), [SHORT, end]) for name, end in HORIZONS.items()}
    about = {
        "command": "python -m validation.truth",
        "by": f"heyoka {hy.__version__}, real128, tolerance {TOLERANCE}",
        "attitude": "principal axes -> space, scalar first",
        "body_momentum": "along the principal axes",
        "agreement": "angle [rad] to the same run at tolerance 1e-31 on equations for the momentum",
        "energy_error": "relative, at this time",
        "conditioning": "angle [rad] by which roundings (2^-53) of the components of the momentum move it",
    }
    FILE.write_text(json.dumps({**about, "truths": truths}, indent=1) + "\n")
    for name, states in truths.items():
        for t, truth in states.items():
            print(f"{name:12} t = {t:>4}  two ways agree to {truth['agreement']:.0e} rad, energy to "
                  f"{truth['energy_error']:.0e}; one rounding of the data moves it by {truth['conditioning']:.0e} rad")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
