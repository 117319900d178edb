"""The peak performance of one core of this processor, for comparison with that of a program."""

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
    """Return the largest rate of fused multiply-adds of one core [1/s], each counted as two.

    Returns None without a C compiler.
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
    """Return the floating-point operations in the products of the series of a path.

    A term of order n has n products of coefficients for each product of two series. Each product
    takes a fused multiply-add, which counts as two operations. All other operations are left out.
    """
    order = path.plan.order
    return 2 * PRODUCTS * path.stats.steps * order * (order + 1) // 2
