"""The command line of the adaptors in Python: a case of the suite in, the engine's motion out."""

import argparse
import json
import sys
from itertools import islice

import numpy as np


def turn(q, v):
    """Return q v q* for a quaternion (w, x, y, z)."""
    s = 2 * np.cross(q[1:], v)
    return v + q[0] * s + np.cross(q[1:], s)


def write_motion(simulate, variants=("default",)):
    """Print the motion that an engine computes for a free body of the suite as CSV.

    `simulate(mass, moments, q, w, step, variant)` yields the attitude (w, x, y, z) and the angular
    velocity in space at the start and after each step.
    """
    parser = argparse.ArgumentParser(description=sys.modules["__main__"].__doc__)
    parser.add_argument("case", help="a file of the suite, such as suite/tumble.json")
    parser.add_argument("--step", type=float, default=1 / 60, help="seconds; default 1/60")
    parser.add_argument("--variant", choices=variants, default=variants[0])
    options = parser.parse_args()
    with open(options.case, encoding="utf-8") as file:
        case = json.load(file)
    given = case["parameters"]
    if given.get("gravity") or given.keys() - {"mass", "inertia", "center_of_mass", "gravity"}:
        parser.error(f"{case['name']} is not a free body")
    if np.ndim(given["inertia"]) != 1:
        parser.error(f"{case['name']} has no principal axes along those of the body")
    q = np.array(case["initial"]["attitude"])
    w = turn(q / np.linalg.norm(q), np.array(case["initial"]["angular_velocity"]))
    motion = simulate(given["mass"], given["inertia"], q, w, options.step, options.variant)
    count = round(case["states"][-1][0] / options.step)
    print("t,qw,qx,qy,qz,wx,wy,wz")
    for i, (q, w) in enumerate(islice(motion, count + 1)):
        q = np.array(q, dtype=float)
        body = turn(q * [1, -1, -1, -1] / np.linalg.norm(q), np.array(w, dtype=float))
        print(i * options.step, *q, *body, sep=",")
