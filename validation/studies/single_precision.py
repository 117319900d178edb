"""Run times of Taylor steps in which the last coefficients are computed in single precision.

Conclusion: single precision is not worth using. With AVX-512, a step of one top is limited by
latency, because each coefficient depends on the previous ones. A kernel that integrates twice as
many tops, with the last coefficients in single precision, is faster by a factor of 1.2 to 1.5.
However, a thread must then integrate twice as many tops at once. See "Measured and left out" in
docs/theory/taylor.md.

    python -m validation.studies.single_precision

The smallest number of double-precision coefficients is used that does not increase the errors of
random tops. Both kernels are timed alternately, and each ratio is a median over many rounds.
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
