"""Reference states for tests/c/test_goryachev_chaplygin.c, by heyoka in 128-bit arithmetic.

    python -m validation.benchmarks.goryachev_chaplygin_truth > tests/c/goryachev_chaplygin_truth.h

The program runs for some minutes.
"""

import argparse
import sys
from textwrap import fill

import mpmath as mp
import numpy as np

from .kowalewski_truth import HEADER, Top, draw_body, follow, integrator

TOPS, SEED = 30, 41
LATE = {24: 300.0, 25: -300.0, 26: 600.0}


def draw(number, rng):
    """Draw a top whose moments are exactly 4 : 4 : 1 and whose momentum is horizontal.

    The order of the axes, the sign of gravity and the direction of time vary. The centre of mass
    lies on one of the two equal axes or between them.
    """
    inertia, unit, com, gravity, attitude = draw_body(4, number, rng)
    rate = np.sqrt(abs(gravity) * np.linalg.norm(com) / (4 * unit))
    momentum = rng.normal(size=3) * 4 * unit * rate * 10.0 ** rng.uniform(-1, 1)
    momentum[2] = 0.0
    time = LATE.get(number, 10.0 ** rng.uniform(0, 2) * rng.choice([-1, 1]))
    time = round(time / rate * 2**20) / 2**20
    return Top(
        *(tuple(map(float, x)) for x in (inertia, com)),
        gravity,
        tuple(map(float, attitude)),
        tuple(map(float, momentum)),
        time,
    )


def format_row(numbers):
    return "{" + ", ".join(f"{float(x):.17g}" for x in numbers) + "}"


def format_top(top, attitude, momentum):
    """Return the C source lines of a top and its state."""
    rows = [format_row(x) for x in (top.inertia, top.com, top.attitude, top.momentum)]
    line = (
        f"{{{rows[0]}, {rows[1]}, {top.gravity:.17g}, {rows[2]}, {rows[3]}, {top.time:.17g}, "
        f"{format_row(attitude)}, {format_row(momentum)}}},"
    )
    return fill(line, 100, initial_indent=" " * 4, subsequent_indent=" " * 5)


def main(words=None):
    argparse.ArgumentParser(
        prog="python -m validation.benchmarks.goryachev_chaplygin_truth",
        description=__doc__.splitlines()[0],
    ).parse_args(words)
    mp.mp.dps = 40
    rng, move, lines = np.random.default_rng(SEED), integrator(), []
    for number in range(TOPS):
        top = draw(number, rng)
        lines.append(format_top(top, *follow(move, top)))
        print(number, file=sys.stderr, flush=True)
    header = HEADER.replace("kowalewski", "goryachev_chaplygin")
    header = header.replace("Kowalewski", "Goryachev-Chaplygin")
    header = header.replace("KOWALEWSKI", "GORYACHEV_CHAPLYGIN")
    print(header.replace("ROWS", "\n".join(lines)), end="")


if __name__ == "__main__":
    main()
