"""How much is done: a quick look, the default of a few minutes, or all; and the tasks that it is made of."""

from collections.abc import Callable
from dataclasses import dataclass
from time import perf_counter


@dataclass(frozen=True)
class Plan:
    name: str
    seconds: float  # a task may say after which part of it it is left out
    longest: float  # a method is not steered tighter once a run takes longer than this [s]
    rounds: int  # of the timing
    least_rounds: int
    members: int  # of each ensemble

    @property
    def quick(self):
        return self.name == "quick"


PLANS = {
    "quick": Plan("quick", 20, 0.01, 2, 1, 24),
    "default": Plan("default", 280, 0.03, 7, 2, 200),
    "full": Plan("full", 1e9, 0.5, 15, 15, 1000),
}


@dataclass(frozen=True)
class Task:
    """One finding: the key under which it is kept (None: nothing is), how to make it, about how long that takes [s], and
    the part of the plan's time after which it is left out (None: never)."""

    key: str
    make: Callable
    weight: float = 0.0
    until: float = None


def work_through(tasks, store, plan, bar):
    """Make what is not known yet, in order; what happened if that was not all."""
    begin, left_out = perf_counter(), 0
    task_bar = bar.add_task("", total=sum(task.weight for task in tasks))
    try:
        for task in tasks:
            wanted = task.key is None or task.key not in store.known
            late = (
                wanted
                and task.until is not None
                and perf_counter() - begin > task.until * plan.seconds
            )
            bar.update(task_bar, description=task.key)
            if task.key is None:
                task.make()
            elif wanted and not late:
                store.put(task.key, task.make())
            left_out += late
            bar.advance(task_bar, task.weight)
    except KeyboardInterrupt:
        return "interrupted: what is missing comes with the next run"
    bar.update(task_bar, description="done")
    number = "1 finding" if left_out == 1 else f"{left_out} findings"
    return f"{number} left for the next run, for want of time" if left_out else ""
