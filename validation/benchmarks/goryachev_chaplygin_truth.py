"""Reference states by heyoka in 128-bit arithmetic for tests/c/test_torus_forms.c.

    python -m validation.benchmarks.goryachev_chaplygin_truth > tests/c/goryachev_chaplygin_truth.h

The program takes a few minutes.
"""

import argparse

import mpmath as mp
import numpy as np

from .kowalewski_truth import HEADER, compute_rows, draw_body, make_top

TOPS, SEED = 30, 41
LATE = {24: 300.0, 25: -300.0, 26: 600.0}


def draw(number, rng):
    """Draw a random Goryachev-Chaplygin top.

    The tops differ in the order of the axes, the sign of gravity and the direction of time. The
    centre of mass lies in the plane of the two principal axes with equal moments of inertia.
    """
    inertia, unit, com, gravity, attitude = draw_body(4, number, rng)
    rate = np.sqrt(abs(gravity) * np.linalg.norm(com) / (4 * unit))
    momentum = rng.normal(size=3) * 4 * unit * rate * 10.0 ** rng.uniform(-1, 1)
    momentum[2] = 0.0
    time = LATE.get(number, 10.0 ** rng.uniform(0, 2) * rng.choice([-1, 1]))
    return make_top(inertia, com, gravity, attitude, momentum, time / rate)


def main(words=None):
    argparse.ArgumentParser(
        prog="python -m validation.benchmarks.goryachev_chaplygin_truth",
        description=__doc__.splitlines()[0],
    ).parse_args(words)
    mp.mp.dps = 40
    header = HEADER.replace("kowalewski", "goryachev_chaplygin")
    header = header.replace("Kowalewski", "Goryachev-Chaplygin")
    header = header.replace("KOWALEWSKI", "GORYACHEV_CHAPLYGIN")
    print(header.replace("ROWS", "\n".join(compute_rows(draw, TOPS, SEED))), end="")


if __name__ == "__main__":
    main()
