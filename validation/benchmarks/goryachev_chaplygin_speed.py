"""The closed form of Goryachev-Chaplygin tops: refusals, errors and times for random tops.

    python -m validation.benchmarks.goryachev_chaplygin_speed [--tops 10000] [--checked 2000]

The moments are exactly 4 : 4 : 1, with the axes in any order, and the momenta are horizontal.
All other values are drawn as in validation/benchmarks/kowalewski_speed.py, and the same quantities
are measured.
"""

import kreisel as kr
import numpy as np

from .kowalewski_speed import CYCLES, run


def draw(rng):
    """Return a random scene and its unit of time."""
    unit, odd = 2.0 ** rng.integers(-3, 4), CYCLES[rng.integers(3)]
    inertia, com = np.empty(3), np.zeros(3)
    inertia[list(odd)] = 4 * unit, 4 * unit, unit
    com[odd[rng.integers(2)]] = rng.choice([-1, 1]) * 2.0 ** rng.uniform(-2, 2)
    gravity = float(rng.choice([1.0, 9.81, -2.5]))
    tau = float(np.sqrt(4 * unit / (abs(gravity) * np.abs(com).max())))
    attitude = rng.normal(size=4)
    momentum = rng.normal(size=3) * 4 * unit / tau * 10.0 ** rng.uniform(-1, 1)
    momentum[2] = 0.0
    body = kr.Body(1.0, tuple(inertia), tuple(com), unphysical=True)
    attitude /= np.linalg.norm(attitude)
    return kr.Scene(body, momentum=tuple(momentum), attitude=tuple(attitude), gravity=gravity), tau


def main(argv=None):
    run("goryachev_chaplygin_speed", __doc__.split("\n")[0], draw, argv)


if __name__ == "__main__":
    main()
