"""Helpers for tests in which worker processes are killed during a sweep.

The module is separate from the tests, because worker processes must import it quickly.
"""

import os
import signal
from pathlib import Path

from kreisel._sweep import runner
from kreisel._sweep.store import SweepStore

WRITE, COMPUTE = SweepStore.write_part, runner.compute_sweep_part


def kill_once(flag, moment):
    def end(*_):
        if not os.path.exists(flag):
            Path(flag).touch()
            os.kill(os.getpid(), signal.SIGKILL)

    def first_write(self, i, part):
        if i == 2:
            end()
        return WRITE(self, i, part)

    def first_compute(store, tops, threads, _):
        return COMPUTE(
            store, tops, threads, end if tops == store.plan.list_tops_of_part(2) else None
        )

    runner.compute_sweep_part = first_compute if moment == "moves" else COMPUTE
    SweepStore.write_part = first_write if moment == "writes" else WRITE
