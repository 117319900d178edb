"""The computations for a report, their number and size, and how long they take.

All tasks always run. Their size does not depend on the speed of the machine.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import inf

from ..competitors import timing
from ..competitors.single_runs import EPS, HeyokaRun, ScipyRun, Setting
from ..references.problems import SHORT, load_problem


@dataclass(frozen=True)
class Size:
    name: str
    longest: float  # after a run with more evaluations than this, no tighter setting is tried
    rounds: int  # number of timing rounds
    members: int  # scale of the numbers of tops and of starts

    @property
    def quick(self):
        return self.name == "quick"


SIZES = {
    "quick": Size("quick", inf, 2, 8),
    "default": Size("default", 2**19, 7, 200),
    "full": Size("full", 2**23, 15, 1000),
}


@dataclass(frozen=True)
class Task:
    """A computation for the report, with its expected duration."""

    key: str | None  # key under which the result is stored, or None if it is not stored
    make: Callable
    weight: float = 0.0  # duration on a machine that needs `TYPICAL` for `compile_and_run` [s]


TYPICAL = 0.45  # [s]


def compile_and_run():
    """Compile and run integrations as they are typical for a report."""
    problem = load_problem("thesis")
    HeyokaRun(problem, SHORT, Setting(tol=EPS)).solve()
    ScipyRun(problem, SHORT, Setting(tol=1e-13)).solve()


def estimate_minutes(tasks, store):
    """Return how many minutes the tasks without a stored result will take on this machine."""
    seconds = sum(task.weight for task in tasks if task.key not in store.known)
    fastest = min(timing.time_once(compile_and_run) for _ in range(3))  # the first one loads files
    return max(1, round(seconds * fastest / TYPICAL / 60))


def run_tasks(tasks, store, bar):
    """Run all tasks without a stored result."""
    task_bar = bar.add_task("", total=sum(task.weight for task in tasks))
    for task in tasks:
        bar.update(task_bar, description=task.key)
        if task.key is None:
            task.make()
        elif task.key not in store.known:
            store.put(task.key, task.make())
        bar.advance(task_bar, task.weight)
    bar.update(task_bar, description="done")
