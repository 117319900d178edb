"""The table of true states in tests/truths.json, by which the tests in every language judge.

    python -m validation.references.truths

completes the rows that have no results, and stores each of them at once. To add a row, write its
name, its family, its scene (the arguments of kr.Scene and kr.Body), the time t and its maker, which
is one of MAKERS. The program adds the attitude q and the momentum m at this time, and a
certificate: the largest difference from a second computation. All computations take the numbers of
a scene as exact.
"""

import argparse
import json
import math
from decimal import Decimal, localcontext
from pathlib import Path

import mpmath as mp

from . import radau
from .problems import Problem
from .quadrature import Euler, Lagrange
from .series import DIGITS, Series, conjugate, multiply, to_decimals, turn

FILE = Path(__file__).parents[2] / "tests/truths.json"
LENGTH = 36  # number of digits of q and m
NONE = (0.0, 0.0, 0.0)


# Makers: functions of a scene and a time that return q, m and the certificate

MASS, TIME = Decimal("1.3"), Decimal("1.6")  # other units
HEADING = [Decimal("0.8"), Decimal(0), Decimal(0), Decimal("0.6")]


def find_difference(one, other):
    """Return the largest difference of the attitudes, or of the momenta relative to their size."""
    size = max(map(abs, one[1])) or 1
    turns, pushes = (
        [abs(a - b) for a, b in zip(*pair, strict=True)] for pair in zip(one, other, strict=True)
    )
    return float(max(*turns, *(x / size for x in pushes)))


def solve_by_series(scene, t):
    """Solve by Taylor series; the second computation has other units, heading, digits and steps."""
    state = Series(scene).to(t)
    with localcontext() as context:
        context.prec = 2 * DIGITS
        (t,) = to_decimals([t])
        q, m = Series(change_units(scene), DIGITS + 6).to(t * TIME)
        back = conjugate(HEADING)
        again = multiply(back, q), [x * TIME / MASS for x in turn(back, m)]
        return *state, find_difference(state, again)


def change_units(scene):
    """Return a scene in other units of mass and time, turned about the vertical."""
    powers = {  # of the units of mass and time
        "mass": (1, 0),
        "inertia": (1, 0),
        "rotor": (1, -1),
        "momentum": (1, -1),
        "gravity": (0, -2),
        "damping": (1, -1),
        "turning": (0, -1),
        "friction": (1, -2),
        "gradient": (0, -2),
    }

    def scale(name, value):
        if isinstance(value, list):
            return [scale(name, x) for x in value]
        mass, time = powers.get(name, (0, 0))
        return Decimal(value) * MASS**mass * TIME**time

    body = {name: scale(name, x) for name, x in scene["body"].items() if name != "unphysical"}
    changed = {name: scale(name, x) for name, x in scene.items() if name != "body"}
    for name in {"momentum", "turning"} & changed.keys():
        changed[name] = turn(HEADING, changed[name])
    changed["attitude"] = multiply(HEADING, changed["attitude"])
    if "shaking" in changed:
        changed["shaking"][1] /= TIME
    return {**changed, "body": body}


def solve_by_quadrature(scene, t):
    """Solve a closed form by quadrature; the second computation has fewer digits."""
    body, q, m = scene["body"], scene["attitude"], scene["momentum"]
    lever = body["com"][2] * scene["gravity"]
    least = min((abs(x) for x in m if x), default=1.0) / max(1e-300, *map(abs, m))
    more = -int(5 * math.log10(least)) if not lever and least < 1e-12 else 0
    states = []
    for digits in (100 + more, 75 + more):
        if lever:
            top = Lagrange(body["inertia"][0], body["inertia"][2], lever, q, m, digits)
        else:
            top = Euler(body["inertia"], q, m, digits)
        states.append([[Decimal(mp.nstr(x, digits)) for x in part] for part in top(t)])
    return *states[0], find_difference(*states)


def solve_by_radau(scene, t):
    """Solve by Radau's method; the second computation has longer steps."""
    body, (amplitude, rate, phase) = scene["body"], scene.get("shaking", NONE)
    lever = [body["mass"] * scene["gravity"] * x for x in body["com"]]
    start = scene["attitude"], scene["momentum"], scene.get("damping", NONE)
    effects = {
        "rotor": body.get("rotor", NONE),
        "turning": scene.get("turning", NONE),
        "shaking": (amplitude / scene["gravity"], rate, phase),
    }
    states = []
    for tol in (radau.FINER_TOL, radau.TOL):
        numbers = radau.integrate(Problem("", body["inertia"], lever, *start), [t], tol, **effects)
        q, m = ([Decimal(float(x)) + Decimal(float(x - float(x))) for x in y[0]] for y in numbers)
        states.append((q, turn(q, m)))
    return *states[0], find_difference(*states)


MAKERS = {"series": solve_by_series, "quadrature": solve_by_quadrature, "radau": solve_by_radau}


def compute_row(row):
    """Return the row with its results."""
    q, m, certificate = MAKERS[row["maker"]](row["scene"], row["t"])
    with localcontext() as context:
        context.prec = LENGTH
        results = {"q": [str(+x) for x in q], "m": [str(+x) for x in m]}
    return {**row, **results, "certificate": float(f"{max(certificate, 1e-99):.1e}")}


def load_table():
    return json.loads(FILE.read_text())


def store_table(rows):
    lines = [json.dumps(row, separators=(",", ":")) for row in rows]
    FILE.write_text("[\n" + ",\n".join(lines) + "\n]\n")


def main(argv=None):
    argparse.ArgumentParser(
        prog="python -m validation.references.truths", description=__doc__.splitlines()[0]
    ).parse_args(argv)
    rows = load_table()
    for i, row in enumerate(rows):
        if "q" not in row:
            rows[i] = compute_row(row)
            store_table(rows)
            print(f"{row['name']}: {rows[i]['certificate']:.0e}", flush=True)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
