"""The peak performance of one core, for comparison with the performance of programs."""

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
    """Return the highest rate of fused multiply-adds on one core [1/s], counting two per operation.

    Returns None if no C compiler is available.
    """
    compiler = shutil.which(os.environ.get("CC", "gcc")) or shutil.which("cc")
    if compiler is None:
        return None
    with tempfile.TemporaryDirectory() as folder:
        program = Path(folder) / "peak"
        try:
            subprocess.run([compiler, *FLAGS, SOURCE, "-o", program], check=True)
            made = subprocess.run([program], capture_output=True, text=True, check=True)
        except (OSError, subprocess.CalledProcessError):
            return None
    return float(made.stdout.split()[0])


def count_operations(path):
    """Return the number of floating-point operations in all products of Taylor series along a path.

    The n-th coefficient of a product of two series is a sum of about n products. Each product takes
    a fused multiply-add, which counts as two operations. All other operations are ignored.
    """
    order = path.plan.order
    return 2 * PRODUCTS * path.stats.steps * order * (order + 1) // 2
