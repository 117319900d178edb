"""Workers of a sweep that are killed while they compute a part.

Kept apart from the tests so that worker processes import it quickly.
"""

import os
import signal
from pathlib import Path

from kreisel._sweep import runner
from kreisel._sweep.store import SweepStore


def killed_once(flag, moment):
    """Kill the worker of part 2 once, while it computes the part or before it stores it."""

    def end(*_):
        if not os.path.exists(flag):
            Path(flag).touch()
            os.kill(os.getpid(), signal.SIGKILL)

    put, moved = SweepStore.put, runner.compute_part

    def first_put(self, i, rows):
        if i == 2:
            end()
        return put(self, i, rows)

    def first_moved(folder, i, threads, _):
        return moved(folder, i, threads, end if i == 2 else None)

    if moment == "moves":
        runner.compute_part = first_moved
    else:
        SweepStore.put = first_put
