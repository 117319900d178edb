"""The closed form of Goryachev-Chaplygin tops: refusals, errors and times for random tops.

    python -m validation.benchmarks.goryachev_chaplygin_speed [--tops 10000] [--checked 2000]

The moments are exactly 4 : 4 : 1, and the momenta are horizontal. All other values are drawn as in
validation/benchmarks/kowalewski_speed.py, and the same quantities are measured.
"""

from .kowalewski_speed import draw_top, run


def draw(rng):
    """Return a random Goryachev-Chaplygin top and its unit of time."""
    return draw_top(rng, 4)


def main(argv=None):
    run("goryachev_chaplygin_speed", __doc__.split("\n")[0], draw, argv)


if __name__ == "__main__":
    main()
