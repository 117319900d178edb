"""Write the files of the suite: `python suite/make.py` in the top folder of the source tree.

The states come from Taylor series in decimal arithmetic, which share no code with kreisel. The
energies, the growth of errors and the readings of instruments are computed by kreisel.
"""

import json
import sys
from decimal import Decimal, localcontext
from pathlib import Path

import kreisel as kr
import numpy as np
from kreisel._score.suite import load_cases

FOLDER = Path(__file__).parent
sys.path.insert(0, str(FOLDER.parent))

from validation.references import series  # noqa: E402

DIGITS, ROUNDING = 30, 2.0**-53
NAMES = ["t", *("qw", "qx", "qy", "qz"), *("wx", "wy", "wz"), *("Lx", "Ly", "Lz")]
NODES, WEIGHTS = np.polynomial.legendre.leggauss(24)


def compute_states(case):
    """Return attitude, angular velocity in the body, and momentum at the times, as decimals."""
    scene, body = case.scene, case.scene.body
    names = ("momentum", "attitude", "gravity", "damping", "turning", "shaking", "friction")
    words = {name: getattr(scene, name) for name in names}
    words["body"] = {name: getattr(body, name) for name in ("mass", "inertia", "com", "rotor")}
    motion, impulses, states = series.Series(words), [*case.impulses], []
    inverse, rotor = series.invert(series.to_matrix([*body.inertia])), [*map(Decimal, body.rotor)]
    for t in case.times.tolist():
        while impulses and impulses[0][0] < t:
            when, *impulse = impulses.pop(0)
            change = series.turn(series.conjugate(motion.to(when)[0]), series.to_decimals(impulse))
            motion.m = [a + b for a, b in zip(motion.m, change, strict=True)]
        q, m = motion.to(t)
        own = [a - b for a, b in zip(motion.m, rotor, strict=True)]
        support = series.turn(series.conjugate(q), series.to_decimals(scene.turning))
        w = [series.dot(row, own) - u for row, u in zip(inverse, support, strict=True)]
        states.append((q, w, m))
    return states


def round_vectors(vectors):
    """Return vectors rounded to 30 digits of the largest component, as texts."""
    last = Decimal(1).scaleb(max(abs(x) for v in vectors for x in v).adjusted() + 1 - DIGITS)
    return [[str(x.quantize(last) + 0) for x in vector] for vector in vectors]


def compute_growth(case, pieces):
    """Return the attitude errors [rad] that one rounding of the initial state can cause."""
    sizes = np.array([2.0, 2.0, 2.0, *np.abs(case.scene.momentum)]) * ROUNDING
    chain, growth = np.eye(6), []
    ends = [*(t for t, *_ in case.impulses), case.end]
    for path, end in zip(pieces, ends, strict=True):
        times = np.array([*path.t, end]) - path.start_time
        tangents = kr.solve(path.scene, times, tangents="start").tangents @ chain
        growth += [*(np.sqrt((tangents[:-1, :3] ** 2).sum(axis=1)) @ sizes)]
        chain = tangents[-1]
    return np.array([float(f"{x:.2g}") for x in growth])


def list_columns(case, pieces):
    """Return the columns beside the states: the energy, growth of errors, and instruments."""
    columns = {"energy": np.concatenate([path.energy for path in pieces])}
    columns["growth"] = compute_growth(case, pieces)
    if case.wheel:
        columns["wheel_rate"] = pieces[0].wheel_rate
    if case.point is None:
        return columns
    path, times = pieces[0], case.times[:, None]
    half, middle = np.diff(times, axis=0) / 2, (times[1:] + times[:-1]) / 2
    if case.has_integrals:
        path = kr.solve(case.scene, (middle + half * NODES).ravel(), "taylor", digits=20)
    readings = {"gyro": path.inertial_velocity, "force": path.specific_force(case.point)}
    for name, values in readings.items():
        if case.has_integrals:
            sums = np.einsum("i,nik->nk", WEIGHTS, values.reshape(len(half), -1, 3)) * half
            name, values = f"{name}_integral", np.vstack([np.zeros(3), sums])
        columns |= {f"{name}_{axis}": values[:, i] for i, axis in enumerate("xyz")}
    return columns


def describe_parameters(case):
    """Return the parameters of a case by name; those that are absent are zero."""
    scene, body = case.scene, case.scene.body
    inertia = np.array(body.inertia)
    if case.wheel:
        inertia = inertia + case.wheel["inertia"] * np.square(case.wheel["axis"])
    parameters = {
        "mass": body.mass,
        "inertia": inertia.tolist(),
        "center_of_mass": body.com,
        "gravity": scene.gravity,
        "rotor_momentum": () if case.wheel else body.rotor,
        "wheel": case.wheel,
        "damping": scene.damping[0],
        "dry_friction": scene.friction,
        "support_turning": scene.turning,
        "support_shaking": scene.shaking,
        "instrument_point": case.point,
        "impulses": case.impulses,
    }
    first = ("mass", "inertia", "center_of_mass", "gravity")
    return {k: x for k, x in parameters.items() if k in first or np.any(x)}


def list_conserved(case, path):
    """Return the conserved quantities of a case by name."""
    scene, body = case.scene, case.scene.body
    if any(scene.damping) or scene.friction or case.impulses:
        return {}
    kept = {} if scene.shaking[0] else {"energy": path.energy[0]}
    if not any(scene.turning):
        kept |= {"vertical_momentum": path.m[0, 2]} if any(body.com) else {"momentum": path.m[0]}
    w, p = path.body_velocity[0], path.body_vertical[0]
    c = body.mass * scene.gravity * body.com[0] / body.moments[2]
    if body.kind == "lagrange":
        kept["axial_momentum"] = path.axial_momentum[0]
    elif body.kind == "kowalewski":
        kept["kowalewski"] = abs(complex(*w[:2]) ** 2 - c * complex(*p[:2])) ** 2
    elif body.kind == "goryachev_chaplygin":
        kept["goryachev_chaplygin"] = w[2] * (w[0] ** 2 + w[1] ** 2) - c * w[0] * p[2]
    return {name: (np.asarray(value) + 0.0).tolist() for name, value in kept.items()}


def make_document(case):
    """Return the content of the JSON file of a case."""
    pieces, scene = case.solve(case.times), case.scene
    with localcontext() as context:
        context.prec = 2 * DIGITS
        parts = [round_vectors(vectors) for vectors in zip(*compute_states(case), strict=True)]
    exact = [[*q, *w, *m] for q, w, m in zip(*parts, strict=True)]
    others = list_columns(case, pieces)
    rest = zip(*((column + 0.0).tolist() for column in others.values()), strict=True)
    rows = zip(case.times.tolist(), exact, rest, strict=True)
    states = [[t, *map(float, row), *more] for t, row, more in rows]
    return {
        "name": case.name,
        "description": case.text,
        "parameters": describe_parameters(case),
        "initial": {
            "attitude": scene.attitude,
            "angular_velocity": states[0][5:8],
            "angular_momentum": scene.momentum,
        },
        "conserved": list_conserved(case, pieces[0]),
        "levels": {"engine": case.engine, "science": case.science},
        "columns": [*NAMES, *others],
        "states": states,
        "exact_states": exact,
    }


def write_files(document, folder):
    """Write the JSON file, with one line for each state, and the CSV file of a case."""
    entries = []
    for name, value in document.items():
        text = json.dumps(value)
        if name.endswith("states"):
            text = "[\n" + ",\n".join(map(json.dumps, value)) + "\n]"
        entries.append(f'"{name}": {text}')
    file = folder / f"{document['name']}.json"
    file.write_text("{\n" + ",\n".join(entries) + "\n}\n")
    rows = [document["columns"], *document["states"]]
    file.with_suffix(".csv").write_text("".join(",".join(map(str, row)) + "\n" for row in rows))


if __name__ == "__main__":
    for one in load_cases().values():
        write_files(make_document(one), FOLDER)
