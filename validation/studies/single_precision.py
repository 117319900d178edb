"""Run times of the Taylor method with the last coefficients in single precision.

Conclusion: single precision is not worth using. With AVX-512, the run time of a step is determined
by latency, because each coefficient depends on the previous ones. For many tops, single precision
is 1.2 to 1.5 times faster, but only if each thread integrates twice as many tops at a time as in
double precision. See "Measured and left out" in docs/theory/taylor.md.

    python -m validation.studies.single_precision

As many coefficients as possible are computed in single precision without increasing the error. Runs
with and without single-precision coefficients are timed alternately, and the ratios are medians
over many rounds.
"""

import subprocess
import tempfile
from pathlib import Path

from ..benchmarks.compiling import CSRC, FLAGS, ISAS, find_compiler

SOURCE = Path(__file__).with_suffix(".c")


def main():
    with tempfile.TemporaryDirectory() as folder:
        for isa, options in ISAS.items():
            program = Path(folder) / isa
            command = [find_compiler(), *FLAGS, *options, f"-I{CSRC}", SOURCE, "-lm", "-o", program]
            subprocess.run(command, check=True)
            print(isa, flush=True)
            if subprocess.run([program]).returncode:
                print("  this processor has no such instructions")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
