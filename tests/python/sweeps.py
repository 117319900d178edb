"""Helper functions for the tests of sweeps."""

import hashlib
import os
import subprocess
import sys
from pathlib import Path

import kreisel as kr
import numpy as np
import pyarrow.parquet as parquet

HERE = Path(__file__).parent
TOP = kr.scenes.asymmetric
LOW = kr.events.nutation(direction=1)
SOURCE = kr.Source.grid(TOP, spin=np.linspace(0, 9, 12), gravity=np.linspace(-1, 1, 25))
# Some of these tops fail, and some have a closed form.
REDUCED = {"t": [1.0, 4.0], "reduce": {"nutation": ("min", "max"), "apex": "mean"}}
REDUCED |= {"max_steps": 14, "part_size": 64}
WATCHED = {"t": [0.5, 4.0], "method": "taylor", "events": [LOW], "max_steps": 14, "part_size": 64}
PARTS = 5

# If a cluster starts slowly, the sockets that probe for the cluster stay open.
SOCKETS_LEFT = "ignore:Exception ignored in. .socket:pytest.PytestUnraisableExceptionWarning"


def run_sweep(folder, words=REDUCED, source=SOURCE, **more):
    return kr.sweep(source, folder=folder, **words, **more)


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


def start_python(code, *words, **more):
    """Start a Python process that runs `code` and can import the modules of the tests."""
    from toolbox import HEEDING  # toolbox imports pytest, which started processes do not need

    repo = str(HERE.parent / "repo")
    path = os.pathsep.join([str(HERE), repo, os.environ.get("PYTHONPATH", "")])
    return subprocess.Popen(
        [sys.executable, "-W", "error", "-c", HEEDING + code, *map(str, words)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": path},
        **more,
    )
