"""Test problems from the literature, with comparisons of published and computed results.

The file problems.json contains the published numbers, and reference values that were computed with
30 digits and rounded to 17.
"""

import json
from dataclasses import dataclass, field
from functools import partial
from math import cos, sin

import kreisel as kr
import numpy as np

from ..competitors import single_runs, timing
from ..competitors.single_runs import Setting
from ..references.problems import PROBLEMS, attitude_error, problem_of_scene
from .part import Part, write_csv
from .tasks import Task

COLUMNS = (
    "problem",
    "by",
    "setting",
    "t",
    "attitude_error",
    "velocity_error",
    "energy_error",
    "seconds",
    "failure",
)
TOLERANCES = (1e-9, 1e-13)


@dataclass(frozen=True)
class PublishedProblem:
    """A test problem from the literature, with its published results."""

    name: str
    scene: kr.Scene
    end: float  # final time of the attitude
    energy_end: float  # final time of the energy
    steps: tuple
    reference: dict  # at `end`
    literature: list = field(default_factory=list)  # published results

    @property
    def entry(self):
        return json.loads(PROBLEMS.read_text())["published"][self.name]


def load_bruels_cardona(entry):
    body = kr.Body(entry["mass"], entry["inertia_about_fixed_point"], entry["com"])
    scene = kr.Scene(body, body_velocity=entry["w0"], attitude=entry["q0"], gravity=entry["g"])
    true = entry["reference"]["2"]["w_space"][1]
    literature = [
        {
            "by": name.split()[0],
            "setting": name.split()[1],
            "t": 2.0,
            "velocity_error": abs(value - true),
        }
        for name, value in entry["published_w_space_y_at_2"].items()
    ]
    return PublishedProblem(
        "bruels_cardona_heavy_top",
        scene,
        2.0,
        2.0,
        (1e-3, 1e-4),
        entry["reference"]["2"],
        literature,
    )


def load_gni(entry):
    scene = kr.Scene(
        kr.Body(1.0, entry["inertia"], (0.0, 0.0, entry["mgl"]), unphysical=True),
        body_momentum=entry["L0"],
        attitude=entry["q0"],
        gravity=1,
    )
    steps = {float(h): error for h, error in entry["table"].items() if h != "what"}
    literature = [
        {
            "by": "Suzuki's composition of order 4",
            "setting": f"step {h:g}",
            "t": 1000.0,
            "energy_error": error,
        }
        for h, error in steps.items()
    ]
    return PublishedProblem(
        "gni_asymmetric_heavy_top",
        scene,
        100.0,
        1000.0,
        tuple(steps),
        entry["reference"]["100"],
        literature,
    )


def load_simo_wong(entry):
    scene = kr.Scene(
        kr.Body.symmetric(1.0, *entry["inertia"][1:], entry["mgl"], unphysical=True),
        body_velocity=entry["w0"],
        attitude=(cos(0.025), sin(0.025), 0.0, 0.0),
        gravity=1,
    )
    literature = [{"by": "Simo and Wong", "setting": "step 0.009", "t": 10.0, "energy_error": 1e-3}]
    return PublishedProblem(
        "simo_wong_fast_top", scene, 10.0, 10.0, (0.009,), entry["reference"]["10"], literature
    )


def load_problems():
    entries = json.loads(PROBLEMS.read_text())["published"]
    return [
        make_problem(entries[name])
        for name, make_problem in (
            ("bruels_cardona_heavy_top", load_bruels_cardona),
            ("gni_asymmetric_heavy_top", load_gni),
            ("simo_wong_fast_top", load_simo_wong),
        )
    ]


def list_settings(contender, steps, quick):
    if contender.steered == "step":
        return [Setting(step=h) for h in (steps[:1] if quick else steps)]
    if contender.steered == "tol":
        return [Setting(tol=tol) for tol in TOLERANCES[: 1 if quick else 2]]
    return [Setting()]


def energy_times(problem, setting):
    """Return about a thousand multiples of the step size at which to evaluate the energy."""
    step = setting.step or problem.energy_end / 1000
    count = int(problem.energy_end / step + 1e-9)
    return step * np.arange(0, count + 1, max(1, count // 1000))


def measure_run(case, problem, contender, setting):
    row = {
        "problem": case.name,
        "by": contender.name,
        "setting": str(setting),
        "t": case.end,
    }
    try:
        short = contender.make(problem, case.end, setting)
        q, m = short.record(np.array([0.0, case.end]))
        row["attitude_error"] = attitude_error(q[-1], case.reference["q"])
        row["seconds"] = min(timing.time_once(short.solve) for _ in range(3))
        if "w_space" in case.reference:
            end = kr.Scene(case.scene.body, m[-1], q[-1] / np.linalg.norm(q[-1]), gravity=1)
            row["velocity_error"] = abs(initial_velocity(end)[1] - case.reference["w_space"][1])
        long = contender.make(problem, case.energy_end, setting)
        row["energy_error"] = relative_energy_error(
            problem, *long.record(energy_times(case, setting))
        )
    except (kr.Error, ValueError, ArithmeticError) as error:
        row["failure"] = str(error)
    return row


def initial_velocity(scene):
    """Return the initial angular velocity of a scene in the space frame."""
    return kr.solve(scene, [0.0], "rk4", step=1.0).velocity[0]


def relative_energy_error(problem, q, m):
    """Return the error measure max |H - H0| / |H0| that is used in the literature."""
    energies = np.sum(problem.energies(q, m), axis=0)
    return float(abs(energies / energies[0] - 1).max())


def measure_problem(case, quick=False):
    problem = problem_of_scene(case.name, case.scene)
    rows = [
        {"problem": case.name} | row | {"by": f"{row['by']} (published)"} for row in case.literature
    ]
    for contender in (*single_runs.list_contenders(problem), *(() if quick else single_runs.PEERS)):
        rows += [
            measure_run(case, problem, contender, setting)
            for setting in list_settings(contender, case.steps, quick)
        ]
    return rows


def list_tasks(_, size, store):
    for case in load_problems():
        measure = partial(measure_problem, case, size.quick)
        yield Task(f"published/{case.name}", measure, 0.3 if size.quick else 4.0)


def load_findings(_, store):
    return [row for rows in store.under("published/") for row in rows]


def build_context(rows):
    return {"problems": [problem_context(each, own) for each, own in group_by_problem(rows)]}


def group_by_problem(rows):
    for problem in load_problems():
        own = [row for row in rows if row["problem"] == problem.name]
        if own:
            yield problem, own


def problem_context(problem, rows):
    return {
        "name": problem.name,
        "source": problem.entry["source"],
        "end": problem.end,
        "energy_end": problem.energy_end,
        "others": problem.entry["others_measured"],
        "rows": rows,
        "velocity": any("velocity_error" in row for row in rows),
    }


def conclude(rows):
    comparisons = [
        words for _, own in group_by_problem(rows) if (words := compare_with_literature(own))
    ]
    return "; ".join(comparisons) + "." if comparisons else ""


def compare_with_literature(rows):
    """Compare the energy errors of kreisel with published errors."""
    complete_rows = [row for row in rows if row.get("energy_error") is not None]
    literature = [row for row in complete_rows if "published" in row["by"]]
    settings = {row["setting"] for row in literature}
    ours = [row for row in complete_rows if row not in literature and row["setting"] in settings]
    if not ours:
        return ""
    best = min(ours, key=lambda row: row["energy_error"])
    theirs = min(row["energy_error"] for row in literature if row["setting"] == best["setting"])
    return (
        f"{best['problem']}: {best['by']} with {best['setting']} has an energy "
        f"error of {best['energy_error']:.0e}, the published method with the same step "
        f"{theirs:.0e}"
    )


PART = Part(
    "published",
    "Published problems",
    "Published problems",
    list_tasks,
    load_findings,
    build_context,
    conclude,
    list_files=lambda rows, metadata: [("published.csv", write_csv(COLUMNS, rows))],
    list_methods=lambda rows: {row["by"] for row in rows},
)
