"""Run all adaptors on four cases of the suite, and print their errors as JSON Lines.

The errors are those of the last state of the suite. kreisel is not needed.
"""

import csv
import datetime
import importlib.metadata
import json
import platform
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from case import turn

HERE = Path(__file__).resolve().parent
SUITE = HERE.parents[1] / "suite"
CASES = [("flip", 1 / 60), ("tumble", 1 / 60), ("fast", 1 / 60), ("tumble", 1 / 1000)]
UNBOUNDED = 10  # angular velocity relative to the first one
ENGINES = [  # name, program, package, precision, variants
    ("Box3D", "spin_box3d.py", "robox3d", "float", ["default"]),
    ("Bullet", "spin_pybullet.py", "pybullet", "double", ["default", "maximal"]),
    ("DART", "spin_dart.py", "dartpy", "double", ["default"]),
    ("Drake", "spin_drake.py", "drake", "double", ["discrete", "continuous", "accurate"]),
    ("Jolt", "spin_jolt.mjs", "jolt-physics", "float", ["default", "gyroscopic"]),
    ("MuJoCo", "spin_mujoco.py", "mujoco", "double", ["Euler", "implicit", "implicitfast", "RK4"]),
    ("Rapier", "spin_rapier.mjs", "@dimforge/rapier3d-compat", "float", ["default"]),
]


def find_version(program, package):
    if program.endswith(".py"):
        return importlib.metadata.version(package)
    return json.loads((HERE / f"node_modules/{package}/package.json").read_text())["version"]


def run_adaptor(program, case, step, variant):
    """Return the last row of the motion: the time, the attitude and the angular velocity."""
    file = SUITE / f"{case}.json"
    if program.endswith(".py"):
        words = [sys.executable, HERE / program, file, "--step", repr(step), "--variant", variant]
    else:
        words = ["node", HERE / program, file, repr(step), variant]
    with tempfile.TemporaryDirectory() as folder:  # for MuJoCo's log
        output = subprocess.run(
            words, check=True, capture_output=True, text=True, cwd=folder
        ).stdout
    return [float(number) for number in list(csv.reader(output.splitlines()))[-1]]


def measure(case, row):
    """Return the errors of the attitude [rad], energy and momentum in the last row of a motion."""
    case = json.loads((SUITE / f"{case}.json").read_text())
    truth = dict(zip(case["columns"], case["states"][-1], strict=True))
    moments, q, w = np.array(case["parameters"]["inertia"]), np.array(row[1:5]), np.array(row[5:])
    is_bounded = np.all(np.abs(w) < UNBOUNDED * np.linalg.norm(case["initial"]["angular_velocity"]))
    if not is_bounded or not np.isfinite(q).all() or abs(row[0] - truth["t"]) > 1e-6:
        return {"failure": "the angular velocity grew without bound"}
    true = np.array([truth[f"q{i}"] for i in "wxyz"])
    q /= np.linalg.norm(q)
    q *= np.sign(q @ true)
    size = np.linalg.norm(case["conserved"]["momentum"])
    momentum = turn(q, moments * w)
    direction = momentum @ case["conserved"]["momentum"] / size / np.linalg.norm(momentum)
    return {
        "attitude": 4 * float(np.arcsin(min(np.linalg.norm(q - true) / 2, 1))),
        "energy": float(w @ (moments * w) / 2 / case["conserved"]["energy"] - 1),
        "momentum": float(np.linalg.norm(momentum) / size - 1),
        "direction": float(np.arccos(min(direction, 1))),
    }


def main():
    rows = []
    for name, program, package, precision, variants in ENGINES:
        engine = {"engine": name, "version": find_version(program, package), "precision": precision}
        for variant in variants:
            for case, step in CASES:
                errors = measure(case, run_adaptor(program, case, step, variant))
                rows.append(engine | {"variant": variant, "case": case, "step": step} | errors)
                print(rows[-1], file=sys.stderr)
    head = {"date": datetime.date.today().isoformat(), "machine": platform.machine()}
    for line in [head, *rows]:
        print(json.dumps(line))


if __name__ == "__main__":
    main()
