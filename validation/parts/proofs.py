"""Estimated errors of paths beside proved ones, for random scenes of all families."""

from functools import partial
from math import tau
from statistics import median

import kreisel as kr
import numpy as np

from .part import write_csv
from .tasks import Task

SEED, MEMBERS, FEW = 59, 26, 1  # numbers of scenes of each family in a full and in a quick report
TURNS = 2.0
SECONDS = 0.4  # run time of one scene
SETTINGS = {
    "default": {},
    "taylor": {"method": "taylor"},
    "exact": {"method": "exact"},
    "20 digits": {"digits": 20},
    "30 digits": {"digits": 30},
}
FAMILIES = (
    *("free", "lagrange", "general", "rotor", "damping", "turning", "shaking", "gradient", "fast"),
    *("matrix", "wheel"),  # whose principal axes kreisel.solve rounds to 16 digits
)
MATRICES = FAMILIES[-2:]


def draw_scene(family, random):
    """Draw a scene of one family; rates are of the order of one."""
    a, b = random.uniform(0.5, 1.0, 2)
    moments = np.array([a, b, random.uniform(abs(a - b) + 0.05, a + b)])
    com, words, speed = random.normal(0.0, 0.5, 3), {"gravity": random.choice([1.0, -1.0])}, 1.0
    if family == "free":
        com = np.zeros(3)
    if family in ("lagrange", "fast"):
        moments[0], com[:2] = moments[1], 0.0
        moments[2] = min(moments[2], 1.9 * moments[1])
        speed = 30.0 if family == "fast" else 1.0
    body = kr.Body(1.0, moments, com, unphysical=True)
    if family == "rotor":
        body = kr.Body(1.0, moments, com, unphysical=True, rotor=random.normal(size=3))
    if family in MATRICES:
        body = body.turn(draw_attitude(random))
    if family == "wheel":
        axis = random.normal(size=3)
        body = body.with_wheel(inertia=0.2 * moments.min(), axis=axis, rate=random.normal(0.0, 5.0))
    words |= {
        "damping": {"damping": random.uniform(0.0, 0.05, 3)},
        "turning": {"turning": random.normal(0.0, 0.3, 3)},
        "shaking": {
            "shaking": (random.uniform(0.05, 0.3), random.uniform(1, 4), random.uniform(0, 6))
        },
        "gradient": {"gradient": random.normal(), "turning": random.normal(0.0, 0.3, 3)},
    }.get(family, {})
    velocity = speed * random.normal(size=3)
    return kr.Scene(body, attitude=draw_attitude(random), body_velocity=velocity, **words)


def draw_attitude(random):
    q = random.normal(size=4)
    return q / np.linalg.norm(q)


def measure_scene(family, member, turns=TURNS):
    """Return the estimated and the proved errors of the paths of a scene."""
    scene = draw_scene(family, np.random.default_rng([SEED, FAMILIES.index(family), member]))
    end, rows = turns * tau / scene._rotation_rate, []
    enclosure = kr.enclose(scene, [end])
    for name, words in SETTINGS.items():
        if name == "exact" and not kr.methods["exact"].suits(scene):
            continue
        path = kr.solve(scene, [end], **words)
        proof = enclosure.compare(path)
        row = {"family": family, "member": member, "setting": name, "estimate": path.error}
        rows.append(row | {"least": float(proof.least[0]), "most": proof.error})
    return rows


def list_tasks(_, size, store):
    for family in FAMILIES:
        for member in range(FEW if size.quick else MEMBERS):
            yield Task(f"proofs/{family}/{member}", partial(measure_scene, family, member), SECONDS)


def load_findings(_, store):
    return [row for rows in store.under("proofs/") for row in rows]


def build_context(rows):
    groups = {}
    for row in rows:
        is_matrix = row["family"] in MATRICES
        groups.setdefault((is_matrix, row["setting"]), []).append(row)
    table = []
    for (is_matrix, setting), own in sorted(groups.items()):
        ratios = [row["estimate"] / row["most"] for row in own if row["most"] > 0.0]
        below = sum(row["least"] > 1.001 * row["estimate"] for row in own)
        numbers = {"paths": len(own), "below": below, "ratios": (min(ratios), median(ratios))}
        worst = max(row["most"] for row in own)
        table.append({"is_matrix": is_matrix, "setting": setting, **numbers, "worst": worst})
    return {"table": table, "turns": TURNS}


def list_files(rows, metadata):
    yield "proofs.csv", write_csv(rows)
