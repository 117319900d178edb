"""Test problems from the literature, with comparisons of published and computed results."""

from dataclasses import dataclass
from decimal import Decimal
from functools import partial

import kreisel as kr
import numpy as np

from ..competitors import single_runs, timing
from ..competitors.single_runs import Setting
from ..references.problems import TABLES, attitude_error, problem_of_scene
from .part import write_csv
from .tasks import Task

TOLERANCES = (1e-9, 1e-13)


@dataclass(frozen=True)
class PublishedProblem:
    """A test problem from the literature, with its published results."""

    name: str
    body: list  # mass, moments of inertia about the fixed point, and centre of mass
    start: dict
    source: str
    others: str  # measurements on other machines, in words
    end: float  # final time of the attitude
    energy_end: float  # final time of the energy
    steps: list
    attitude: list  # reference at `end`
    literature: list  # published results
    velocity_2: float | None = None  # reference of the second component of the velocity in space

    @property
    def scene(self):
        return kr.Scene(kr.Body(*self.body, unphysical=True), **self.start)

    def list_published_rows(self):
        for row in self.literature:
            by = {"problem": self.name, "by": f"{row['by']} (published)", "t": self.energy_end}
            if "velocity_2" in row:
                row = row | {"velocity_error": abs(row["velocity_2"] - self.velocity_2)}
            yield {key: row[key] for key in row if key != "velocity_2"} | by


def measure_distance_to_uniform_rotation(path, _):
    """Return the largest angle to the rotation with the initial velocity, which has no torque."""
    t, w = np.linspace(0.0, path.t[-1], 201), path.body_velocity[0]
    rate = np.linalg.norm(w)
    uniform = np.column_stack([np.cos(rate * t / 2), np.outer(np.sin(rate * t / 2), w / rate)])
    return [kr.attitude_error(path(t).q, uniform).max()]


# The quantities of published numbers, as functions of the path to the time and of kr.exact(scene).
QUANTITIES = {
    "angular velocity [rad/s]": lambda path, top: path.body_velocity[-1],
    "angular velocity [deg/s]": lambda path, top: np.degrees(path.body_velocity[-1]),
    "angle to the uniform rotation [rad]": measure_distance_to_uniform_rotation,
    "period of precession [s]": lambda path, top: [2 * np.pi / top.precession_rate],
    "spin [rpm], force of the support [N]": lambda path, top: (
        [path.spin[-1] * 30 / np.pi, path.pivot_force[-1, 2]]
    ),
    "half the range of nutation [deg], precession [deg/s]": lambda path, top: np.degrees(
        [top.greatest_nutation / 2, top.precession_rate]
    ),
}


def compare_number(entry):
    """Return a row with printed and computed numbers, and the largest difference in last digits."""
    scene = kr.Scene.from_toml(entry["scene"] + "\n")
    path, top = kr.solve(scene, entry.get("t", 0.0)), kr.exact(scene)
    numbers = [float(x) for x in QUANTITIES[entry["quantity"]](path, top)]
    last = [Decimal(text).as_tuple().exponent for text in entry["printed"]]
    computed = [f"{x:.{max(0, 2 - e)}f}" for x, e in zip(numbers, last, strict=True)]
    rows = zip(numbers, entry["printed"], last, strict=True)
    return {
        "case": entry["case"],
        "quantity": entry["quantity"],
        "printed": ", ".join(entry["printed"]),
        "computed": ", ".join(computed),
        "units": max(abs(x - float(text)) / 10.0**e for x, text, e in rows),
    }


def load_problems():
    return [PublishedProblem(name, **entry) for name, entry in TABLES["published"].items()]


def list_settings(contender, steps, quick):
    if contender.steered == "step":
        return [Setting(step=h) for h in (steps[:1] if quick else steps)]
    if contender.steered == "tol":
        return [Setting(tol=tol) for tol in TOLERANCES[: 1 if quick else 2]]
    return [Setting()]


def energy_times(case, setting):
    """Return about a thousand multiples of the step size at which to evaluate the energy."""
    step = setting.step or case.energy_end / 1000
    count = int(case.energy_end / step + 1e-9)
    return step * np.arange(0, count + 1, max(1, count // 1000))


def measure_run(case, problem, contender, setting):
    row = {"problem": case.name, "by": contender.name, "setting": str(setting), "t": case.end}
    try:
        short = contender.make(problem, case.end, setting)
        q, m = short.record(np.array([0.0, case.end]))
        row["attitude_error"] = attitude_error(q[-1], case.attitude)
        row["seconds"] = min(timing.time_once(short.solve) for _ in range(3))
        if case.velocity_2 is not None:
            end = kr.Scene(case.scene.body, m[-1], q[-1] / np.linalg.norm(q[-1]), gravity=1)
            velocity = kr.solve(end, [0.0], "rk4", step=1.0).velocity[0]
            row["velocity_error"] = abs(velocity[1] - case.velocity_2)
        long = contender.make(problem, case.energy_end, setting)
        states = long.record(energy_times(case, setting))
        energies = np.sum(problem.energies(*states), axis=0)
        # the measure of the literature, max |H - H0| / |H0|
        row["energy_error"] = float(abs(energies / energies[0] - 1).max())
    except (kr.Error, ValueError, ArithmeticError) as error:
        row["failure"] = str(error)
    return row


def measure_problem(case, quick=False):
    problem = problem_of_scene(case.name, case.scene)
    peers = () if quick else single_runs.PEERS
    return list(case.list_published_rows()) + [
        measure_run(case, problem, contender, setting)
        for contender in (*single_runs.list_contenders(problem), *peers)
        for setting in list_settings(contender, case.steps, quick)
    ]


def list_tasks(_, size, store):
    for case in load_problems():
        measure = partial(measure_problem, case, size.quick)
        yield Task(f"published/{case.name}", measure, 0.3 if size.quick else 4.0)
    yield Task("numbers/published", partial(list, map(compare_number, TABLES["numbers"])))


def load_findings(_, store):
    rows = [row for rows in store.under("published/") for row in rows]
    return {"runs": rows, "numbers": [row for rows in store.under("numbers/") for row in rows]}


def build_context(findings):
    rows, problems = findings["runs"], []
    for case in load_problems():
        own = [row for row in rows if row["problem"] == case.name]
        if own:
            has_velocity = any("velocity_error" in row for row in own)
            problems.append((case, own, has_velocity, compare_with_literature(own)))
    return {"problems": problems, "numbers": findings["numbers"]}


def compare_with_literature(rows):
    """Return kreisel's best row at a published setting, and the published energy error, or None."""
    complete = [row for row in rows if row.get("energy_error") is not None]
    literature = [row for row in complete if "published" in row["by"]]
    settings = {row["setting"] for row in literature}
    ours = [row for row in complete if row not in literature and row["setting"] in settings]
    if not ours:
        return None
    best = min(ours, key=lambda row: row["energy_error"])
    same = [row["energy_error"] for row in literature if row["setting"] == best["setting"]]
    return best, min(same)


def list_files(findings, metadata):
    yield "published.csv", write_csv(findings["runs"])
    yield "published_numbers.csv", write_csv(findings["numbers"])


def list_methods(findings):
    return {row["by"] for row in findings["runs"]}
