"""The cost and the accuracy of sections, starts and frequencies.

    python -m validation.benchmarks.section_speed [time frequencies layer]

`time` computes sections of 100 asymmetric tops with 500 crossings, in one thread and in two
threads. All tops have the same energy and vertical momentum. The cost of the sections is compared
with the costs of runs without events and of event searches for individual tops. `time` also
measures the time to draw a million starts. `frequencies` compares the frequencies of random
Lagrange tops with the closed form. `layer` compares swings along the separatrix with Melnikov's
integral. `must` is the required result.
"""

import argparse
from functools import partial

import kreisel as kr

from ..competitors import timing
from ..parts import chaos, frequency_data
from .ensemble_speed import print_grade

BODY = kr.Body(1.0, (2.0, 1.6, 1.1), (0.3, 0.1, 0.7), unphysical=True)
TOPS, CROSSINGS, ROUNDS = 100, 500, 7
LOW = kr.events.nutation(direction=1, max_count=CROSSINGS, terminal=True)


def best_time(function):
    return min(timing.time_once(function) for _ in range(ROUNDS))


def time():
    tops = kr.starts(BODY, energy=2.0, vertical=1.0, n=TOPS)
    cut = {n: best_time(partial(kr.section, tops, n=CROSSINGS, threads=n)) for n in (1, 2)}
    section = kr.section(tops, n=CROSSINGS).check()
    end = float(section.t.max())
    alone = best_time(partial(kr.solve, tops, end, "taylor", events=[LOW], threads=2))
    bare = best_time(partial(kr.solve, tops, end, "taylor", threads=2))
    print(f"{TOPS} tops by {CROSSINGS} crossings, {section.steps.sum()} steps, to t = {end:.0f}")
    print_grade("a section in two threads", cut[2], 0.2, unit=" s", at_most=True)
    print(f"in one thread {cut[1]:.3f} s; top by top {alone:.3f} s; without events {bare:.3f} s")
    many = partial(kr.starts, BODY, energy=2.0, vertical=1.0, n=10**6)
    print(f"a million starts {timing.time_once(many):.2f} s")


def frequencies():
    print_grade(
        "frequencies off the closed form's",
        frequency_data.largest_frequency_error(200),
        1e-12,
        at_most=True,
    )


def layer():
    for row in chaos.measure_layer(2000):
        off, ratio = row["kick"] / row["melnikov"] - 1.0, row["half_width"] / row["predicted"]
        print(
            f"e = {row['e']:.0e}: swings differ by {off:+.1e} from Melnikov, "
            f"layer {ratio:.2f} of Chirikov's"
        )


ALL = {"time": time, "frequencies": frequencies, "layer": layer}


def main(words=None):
    parser = argparse.ArgumentParser(
        prog="python -m validation.benchmarks.section_speed",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("what", nargs="*", help=f"figures among {', '.join(ALL)} (default: all)")
    for name in parser.parse_args(words).what or ALL:
        ALL[name]()


if __name__ == "__main__":
    main()
