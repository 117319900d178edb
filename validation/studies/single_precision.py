"""Times of Taylor steps whose last coefficients are in single precision.

Conclusion: single precision is not worth using. With AVX-512, the time of a step of one top is
determined by the dependence of coefficients on each other, not by the number of products. Two
groups of lanes that share a tail gain 1.2 to 1.5, but each thread then has twice as many tops in
its lanes. See "Measured and left out" in docs/theory/taylor.md.

    python -m validation.studies.single_precision

The numbers of coefficients in doubles are the smallest for which the errors of random tops do not
grow. Each ratio is the median of many rounds, in which both steps alternate.
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
