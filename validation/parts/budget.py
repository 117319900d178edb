"""How much time a report may take: that of a quick look, the default of a few minutes, or all; and
the tasks that it is spent on."""

from collections.abc import Callable
from dataclasses import dataclass
from time import perf_counter


@dataclass(frozen=True)
class Budget:
    name: str
    seconds: float  # a task may say after which share of it it is left out
    longest: float  # a method is not steered tighter once a run takes longer than this [s]
    rounds: int  # of the timing
    least_rounds: int
    members: int  # of each ensemble

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
    """One finding to make. Where `key` is None nothing is kept of it."""

    key: str | None  # under which the store keeps it
    make: Callable
    weight: float = 0.0  # about how long it takes [s]
    until: float | None = None  # the share of the budget after which it is left out; None: never


class Clock:
    """Says which tasks come too late for the budget, and counts them."""

    def __init__(self, budget):
        self.begin, self.budget, self.missed = perf_counter(), budget, 0

    def is_late(self, task):
        elapsed = perf_counter() - self.begin
        late = task.until is not None and elapsed > task.until * self.budget.seconds
        self.missed += late
        return late

    def describe_missing(self):
        """Words what was left out; empty where nothing was."""
        number = "1 finding" if self.missed == 1 else f"{self.missed} findings"
        return f"{number} left for the next run, for want of time" if self.missed else ""


def run_tasks(tasks, store, budget, bar):
    """Makes what is not known yet, in order; says what happened if that was not all."""
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
        return "interrupted: what is missing comes with the next run"
    bar.update(task_bar, description="done")
    return clock.describe_missing()
