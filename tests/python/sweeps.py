"""Helper functions for the tests of sweeps and files."""

import hashlib
import io
import os
import signal
import sys
import warnings
from pathlib import Path

import kreisel as kr
import numpy as np
import pyarrow.parquet as parquet

TOP = kr.scenes.asymmetric
LOW = kr.events.nutation(direction=1)
SOURCE = kr.Source.grid(TOP, spin=np.linspace(0, 9, 6), gravity=np.linspace(-1, 1, 5))
# Some of these tops fail, and some have a closed form.
REDUCED = {"t": [1.0, 4.0], "reduce": {"nutation": ("min", "max"), "apex": "mean"}}
REDUCED |= {"max_steps": 14, "part_size": 7}
PARTS = 5

# If a cluster starts slowly, the sockets that probe for the cluster stay open.
SOCKETS_LEFT = "ignore:Exception ignored in. .socket:pytest.PytestUnraisableExceptionWarning"


def run_sweep(folder, words=REDUCED, source=SOURCE, **more):
    return kr.sweep(source, folder=folder, **{**words, **more})


def hash_rows(folder):
    """Return a hash of all rows in the files of a sweep.

    The hash does not depend on how the rows are divided among files.
    """
    files = sorted(Path(folder).glob("*.parquet"), reverse=True)
    tables = [parquet.read_table(file, partitioning=None) for file in files]
    rows = sorted(
        tuple(map(hex_doubles, row.values())) for table in tables for row in table.to_pylist()
    )
    return hashlib.sha256(repr(rows).encode()).hexdigest()


def hex_doubles(value):
    """Convert the doubles in `value` to hexadecimal notation, which is exact."""
    if isinstance(value, list):
        return tuple(map(hex_doubles, value))
    return value.hex() if isinstance(value, float) else value


def flip_bit(data, position):
    """Return `data` with one bit flipped."""
    changed = bytearray(data)
    changed[position // 8] ^= 1 << position % 8
    return bytes(changed)


def make_replace(number, act):
    """Return a substitute of os.replace that calls `act` before the file of a part is complete."""
    replace = os.replace

    def act_and_replace(old, new):
        if Path(new).name == f"part-{number:06}.parquet":
            act()
        replace(old, new)

    return act_and_replace


def kill_worker_once(flag):
    """Let the worker process that first completes part 2 be killed; `flag` is a file."""

    def kill():
        if not os.path.exists(flag):
            Path(flag).touch()
            os.kill(os.getpid(), signal.SIGKILL)

    os.replace = make_replace(2, kill)


def fork(call):
    """Make a call in a child process, and return the exit code: 0, 1, or the number of an error."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # the other threads hold no locks
        child = os.fork()
    if not child:
        code = 1
        try:
            sys.stdout = sys.stderr = io.StringIO()
            call()
            code = 0
        except OSError as error:
            code = error.errno
        except kr.Interrupted as interruption:
            code = 200 + len(interruption.result.missing)
        finally:
            os._exit(code)
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
