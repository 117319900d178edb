"""What sections, starts and frequencies cost, and how exact they are: python -m
validation.bench.sections [time frequencies layer]

`time`: sections of 100 asymmetric tops of one energy and vertical momentum by 500 crossings, in one
thread and in two, beside the way there with events looked for top by top and without any; and a
million starts. `frequencies`: by how much those of random Lagrange tops are off the closed form's.
`layer`: swings along the separatrix beside Melnikov's integral. `must` is what was promised.
"""

import argparse
from functools import partial

import kreisel as kr

from ..parts import chaos, cuts
from ..peers import measure
from .ensemble import graded

BODY = kr.Body(1.0, (2.0, 1.6, 1.1), (0.3, 0.1, 0.7), made_up=True)
TOPS, CROSSINGS, ROUNDS = 100, 500, 7
LOW = kr.events.nutation(direction=1, max_count=CROSSINGS, terminal=True)


def best(function):
    return min(measure.once(function) for _ in range(ROUNDS))


def time():
    tops = kr.starts(BODY, energy=2.0, vertical=1.0, n=TOPS)
    cut = {n: best(partial(kr.section, tops, n=CROSSINGS, threads=n)) for n in (1, 2)}
    section = kr.section(tops, n=CROSSINGS).check()
    end = float(section.t.max())
    alone = best(partial(kr.solve, tops, end, "taylor", events=[LOW], threads=2))
    bare = best(partial(kr.solve, tops, end, "taylor", threads=2))
    print(f"{TOPS} tops by {CROSSINGS} crossings, {section.steps.sum()} steps, to t = {end:.0f}")
    graded("a section in two threads", cut[2], 0.2, unit=" s", at_most=True)
    print(f"in one thread {cut[1]:.3f} s; top by top {alone:.3f} s; without events {bare:.3f} s")
    many = partial(kr.starts, BODY, energy=2.0, vertical=1.0, n=10**6)
    print(f"a million starts {measure.once(many):.2f} s")


def frequencies():
    graded("frequencies off the closed form's", cuts.off_closed_form(200), 1e-12, at_most=True)


def layer():
    for row in chaos.layer(2000):
        off, ratio = row["kick"] / row["melnikov"] - 1.0, row["half_width"] / row["predicted"]
        print(
            f"e = {row['e']:.0e}: swings {off:+.1e} off Melnikov, layer {ratio:.2f} of Chirikov's"
        )


ALL = {"time": time, "frequencies": frequencies, "layer": layer}


def main(words=None):
    parser = argparse.ArgumentParser(
        prog="python -m validation.bench.sections",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("what", nargs="*", help=f"of {', '.join(ALL)} (default: all)")
    for name in parser.parse_args(words).what or ALL:
        ALL[name]()


if __name__ == "__main__":
    main()
