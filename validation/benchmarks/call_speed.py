"""Calls for one top in Python, compared with heyoka's integrator at equal error.

    python -m validation.benchmarks.call_speed [SCENE ...] [--rounds 61]

The measurements are those of the part `calls` of the report. A ratio is the time of heyoka divided
by the time of kreisel: the median of the rounds, and the ratio of the least times. The program also
prints the number of runs after which heyoka's faster runs have made up for its compile time. The
share is that of the peak of a core. validation.studies.taylor_kernel_study prints it for the
kernels alone.
"""

import argparse

from ..competitors import machine
from ..parts import calls


def print_scene(name, rounds):
    """Print the times of one scene."""
    scene = calls.measure_scene(name, rounds)
    for band in scene["bands"]:
        row = calls.format_band(scene, band)
        print(
            f"{name} to {row['end']}, {row['error']}: heyoka/solve (least), heyoka/run (least) "
            f"{', '.join(row['ratios'])};  solve, run, heyoka {', '.join(row['times'])} us;  "
            f"DOP853 with cfunc {row['function']} ms;  {row['share']} of the peak"
        )
        print(
            f"    heyoka compiles for {row['compiling']} s; runs until this is paid: {row['paid']}",
            flush=True,
        )


def main(argv=None):
    parser = argparse.ArgumentParser(
        prog="python -m validation.benchmarks.call_speed", description=__doc__.splitlines()[0]
    )
    parser.add_argument("scenes", nargs="*", choices=[*calls.ENDS, []], help="default: all")
    parser.add_argument("--rounds", type=int, default=61)
    options = parser.parse_args(argv)
    print(f"on {machine.processor_name()}, {machine.describe_cores()}")
    for name in options.scenes or calls.ENDS:
        print_scene(name, options.rounds)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
