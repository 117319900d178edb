"""Times of Taylor steps that compute the last coefficients in single precision.

Conclusion: single precision is not worth using. With AVX-512, a step of one top is limited by
latency, since each coefficient depends on the previous ones, and not by the number of
multiplications. Two groups of lanes that share the single-precision coefficients are faster by a
factor of 1.2 to 1.5. However, each thread then needs twice as many tops in its lanes. See "Measured
and left out" in docs/theory/taylor.md.

    python -m validation.studies.single_precision

The number of coefficients in double precision is the smallest for which the errors of random tops
do not increase. Both kinds of step are timed alternately, and each ratio is a median over many
rounds.
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
