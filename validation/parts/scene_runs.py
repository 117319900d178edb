"""Runs of all methods on one scene, with their errors and run times."""

import math
from dataclasses import asdict, dataclass, field
from functools import partial
from statistics import median

import kreisel as kr
import numpy as np

from ..competitors import single_runs, timing
from ..competitors.single_runs import Setting
from ..references import reference
from ..references.problems import attitude_error
from .tasks import Task

TIGHTER = range(2, 17)  # steps are turn / 2 ** k for these k
TOLERANCES = [float(f"1e-{k}") for k in range(2, 16)]
QUICK = ((6, 8, 10), [1e-4, 1e-8, 1e-12, 1e-14])
CHAOS = 1e-6  # an error below this value that no longer decreases is due to rounding [rad]
LOOKS = 100  # approximate number of states at which the energy is evaluated


@dataclass
class Measurement:
    """The results of one method for one scene and one step size or tolerance."""

    scene: str
    t: float
    method: str
    peer: bool
    step: float | None = None
    tol: float | None = None
    attitude_error: float | None = None
    energy_error: float | None = None
    steps: int | None = None
    evaluations: int | None = None
    setup_seconds: float | None = None
    failure: str = ""
    about: float | None = None  # approximate time of a run [s]
    samples: list = field(default_factory=list)  # times of a run, one per round [s]

    @property
    def setting(self):
        return Setting(self.step, self.tol)

    @property
    def key(self):
        return f"{self.method} {self.step} {self.tol}"

    @property
    def seconds(self):
        """The shortest run time [s], which is the least affected by other programs."""
        return min(self.samples, default=self.about)

    @property
    def spread(self):
        return timing.relative_spread(self.samples) if self.samples else None

    def summarize(self):
        """Return the numbers of the run for a table, with those of its times."""
        numbers = asdict(self) | {
            "seconds": self.seconds,
            "seconds_median": median(self.samples) if self.samples else self.about,
            "seconds_spread": self.spread,
            "rounds": len(self.samples),
        }
        numbers = {key: numbers[key] for key in numbers if key not in ("samples", "about", "peer")}
        return {key: f"{x:.6g}" if isinstance(x, float) else x for key, x in numbers.items()}


def turn_length(problem):
    """Return a power of two close to the time [T] of one turn, for exact divisions into steps."""
    return 2.0 ** round(math.log2(2 * math.pi / problem.rate))


def energy_times(end, step):
    """Return equally spaced times for evaluating the energy, at least as far apart as the steps."""
    every = max(2.0 ** np.floor(np.log2(end / LOOKS)), step or 0.0)
    return every * np.arange(int(end / every) + 1)


class SceneRuns:
    """A scene with its reference solution and the runs of all methods."""

    def __init__(self, problem, end, truth, size):
        self.problem, self.end, self.size, self.truth = problem, end, size, truth
        self.contenders = {
            contender.name: contender
            for contender in (*single_runs.list_contenders(problem), *single_runs.PEERS)
        }
        self.runs = {}

    def run(self, row):
        if row.key not in self.runs:
            contender = self.contenders[row.method]
            self.runs[row.key] = contender.make(self.problem, self.end, row.setting)
        return self.runs[row.key]

    def measure_errors(self, contender, setting):
        """Measure the errors of one run, and estimate its run time."""
        row = Measurement(
            self.problem.name, self.end, contender.name, contender.peer, setting.step, setting.tol
        )
        try:
            run = self.run(row)
            q, m = run.record(energy_times(self.end, setting.step))
            row.about = min(timing.time_once(run.solve) for _ in range(2))
            row.attitude_error = attitude_error(run.attitude(), self.truth()["attitude"])
            row.energy_error = self.problem.energy_error(q, m)
            row.steps, row.evaluations, row.setup_seconds = run.steps, run.evaluations, run.setup
        except (kr.Error, ValueError, ArithmeticError) as error:
            row.failure = str(error)
        return row

    def list_settings(self, contender):
        powers, tolerances = QUICK if self.size.quick else (TIGHTER, TOLERANCES)
        if not contender.steered:
            return [Setting()]
        if contender.steered == "step":
            turn = turn_length(self.problem)
            return [Setting(step=turn / 2.0**k) for k in powers]
        tightest = contender.tightest or 0.0
        settings = [Setting(tol=tol) for tol in tolerances if tol > tightest]
        return [*settings, Setting(tol=tightest)] if tightest else settings

    def explore(self, contender):
        """Run a method with increasing accuracy, and return the errors."""
        rows = []
        for setting in self.list_settings(contender):
            rows.append(self.measure_errors(contender, setting))
            if is_enough(rows, self.size.longest / contender.cost):
                break
        return [asdict(row) for row in rows]

    def measure_times(self, rows):
        """Repeat all successful runs in turn, round after round, and return the run times [s]."""
        return {
            row.key: timing.time_sample(self.run(row).solve, row.about)
            for row in rows
            if not row.failure
        }


def is_enough(rows, longest):
    """Return True if more accurate runs would take too long or would not reduce the error."""
    errors = [row.attitude_error for row in rows if not row.failure]
    if not errors:
        return False
    slow = (rows[-1].evaluations or rows[-1].steps or 0) > longest
    at_the_floor = min(errors) < CHAOS and len(errors) - 1 - int(np.argmin(errors)) > 2
    return slow or at_the_floor


def make_truth_task(problem, end):
    """Return a task that computes the reference solution of a scene."""
    return Task(truth_key(problem), partial(reference.truth_of, problem, end), 0.2)


def truth_key(problem):
    return f"truth/{problem.name}"


def list_tasks(problem, end, size, store):
    """Yield all tasks for a scene: the reference solution, the errors and the run times."""
    yield make_truth_task(problem, end)
    scene_runs = SceneRuns(problem, end, lambda: store.known[truth_key(problem)], size)
    for contender in scene_runs.contenders.values():
        key = f"runs/{problem.name}/{contender.name}"
        yield Task(key, partial(scene_runs.explore, contender), 0.1 if size.quick else 0.6)
    for i in range(size.rounds):
        yield Task(
            f"times/{problem.name}/{i}",
            lambda: scene_runs.measure_times(load_runs(store, problem.name)),
            0.1 if size.quick else 1.85,
        )
    yield Task(None, scene_runs.runs.clear)


def load_runs(store, scene):
    return [Measurement(**row) for rows in store.under(f"runs/{scene}/") for row in rows]


def load_measurements(store, scene):
    """Return the errors and the run times that are stored for a scene."""
    rounds, rows = store.under(f"times/{scene}/"), load_runs(store, scene)
    for row in rows:
        row.samples = [times[row.key] for times in rounds if row.key in times]
    return rows


def group_by_method(rows, scene):
    """Return the measurements for one scene, grouped by method."""
    groups = {}
    for row in rows:
        if row.scene == scene:
            groups.setdefault(row.method, []).append(row)
    return groups
