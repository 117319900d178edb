"""The computations for a report, and limits on their run time.

The total run time is limited to seconds ("quick") or minutes ("default"), or is unlimited ("full").
"""

from collections.abc import Callable
from dataclasses import dataclass
from time import perf_counter


@dataclass(frozen=True)
class Budget:
    name: str
    seconds: float  # total time
    longest: float  # after a run longer than this, no tighter setting is tried [s]
    rounds: int  # number of timing rounds
    least_rounds: int
    members: int  # scale of the numbers of tops and of starts

    @property
    def quick(self):
        return self.name == "quick"


BUDGETS = {
    "quick": Budget("quick", 20, 0.01, 2, 1, 24),
    "default": Budget("default", 280, 0.03, 7, 2, 200),
    "full": Budget("full", 1e9, 0.5, 15, 15, 1000),
}


@dataclass(frozen=True)
class Task:
    """A computation for the report, with its expected duration."""

    key: str | None  # key under which the result is stored, or None if it is not stored
    make: Callable
    weight: float = 0.0  # expected duration [s]
    until: float | None = None  # fraction of the budget after which the task is skipped, or None


class Clock:
    """A timer that counts the computations that are skipped for lack of time."""

    def __init__(self, budget):
        self.begin, self.budget, self.missed = perf_counter(), budget, 0

    def is_late(self, task):
        elapsed = perf_counter() - self.begin
        late = task.until is not None and elapsed > task.until * self.budget.seconds
        self.missed += late
        return late

    def describe_missing(self):
        """Return a message about skipped tasks, or an empty string."""
        number = "1 finding" if self.missed == 1 else f"{self.missed} findings"
        return f"{number} skipped for lack of time; run again to add them" if self.missed else ""


def run_tasks(tasks, store, budget, bar):
    """Run all tasks without a stored result; return a message on skips or an interruption."""
    clock = Clock(budget)
    task_bar = bar.add_task("", total=sum(task.weight for task in tasks))
    try:
        for task in tasks:
            bar.update(task_bar, description=task.key)
            if task.key is None:
                task.make()
            elif task.key not in store.known and not clock.is_late(task):
                store.put(task.key, task.make())
            bar.advance(task_bar, task.weight)
    except KeyboardInterrupt:
        return "interrupted; run again to continue"
    bar.update(task_bar, description="done")
    return clock.describe_missing()
