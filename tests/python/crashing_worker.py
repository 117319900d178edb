"""Worker processes that are killed during a sweep.

The module is separate from the tests, because worker processes must import it quickly.
"""

import os
import signal
from pathlib import Path

from kreisel._sweep import runner
from kreisel._sweep.store import SweepStore


def kill_once(flag, moment):
    def end(*_):
        if not os.path.exists(flag):
            Path(flag).touch()
            os.kill(os.getpid(), signal.SIGKILL)

    write, compute = SweepStore.write_part, runner.compute_sweep_part

    def first_write(self, i, part):
        if i == 2:
            end()
        return write(self, i, part)

    def first_compute(store, tops, threads, _):
        return compute(
            store, tops, threads, end if tops == store.plan.list_tops_of_part(2) else None
        )

    if moment == "moves":
        runner.compute_sweep_part = first_compute
    else:
        SweepStore.write_part = first_write
