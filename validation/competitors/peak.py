"""Measurement of the peak floating-point performance of one processor core."""

import os
import shutil
import subprocess
import tempfile
from functools import cache
from pathlib import Path

SOURCE = Path(__file__).with_suffix(".c")
FLAGS = ("-std=c99", "-O3", "-march=native", "-ffp-contract=fast")
PRODUCTS = 21  # products of series in each term: 12 for the attitude, 6 for P, 3 for W


@cache
def measure_peak():
    """Return the peak rate [1/s] of floating-point operations on one core.

    A fused multiply-add counts as two operations. Returns None if no C compiler is available, or if
    the program fails.
    """
    compiler = shutil.which(os.environ.get("CC", "gcc")) or shutil.which("cc")
    if compiler is None:
        return None
    with tempfile.TemporaryDirectory() as folder:
        program = Path(folder) / "peak"
        try:
            subprocess.run([compiler, *FLAGS, SOURCE, "-o", program], check=True)
            result = subprocess.run([program], capture_output=True, text=True, check=True)
        except (OSError, subprocess.CalledProcessError):
            return None
    return float(result.stdout.split()[0])


def count_operations(path):
    """Return how many floating-point operations the products of Taylor series in a run require."""
    order = path.plan.order
    return 2 * PRODUCTS * path.stats.steps * order * (order + 1) // 2
