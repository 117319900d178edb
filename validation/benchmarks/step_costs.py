"""The cost of a step, compared with heyoka at its tightest tolerance, and the cost of recording.

    python -m validation.benchmarks.step_costs [scene ...] [--rounds 25]

A step of heyoka covers much more time than a step of kreisel. The ratio shows the overhead of the
methods and of the driver. The comparison does not show which program is better.
"""

import argparse
import os
import shutil
import subprocess
import tempfile
from pathlib import Path
from statistics import median, quantiles

import kreisel as kr

from ..competitors import timing
from ..competitors.single_runs import EPS, HeyokaRun, Setting, list_contenders
from ..references.problems import load_problem

STEP, STEPS = 2.0**-10, 100_000
HERE = Path(__file__).parent
ROOT = HERE.parents[1]
HEYOKA = {"heyoka": {}, "heyoka, fast math": {"fast_math": True}}


def make_solve(problem, method, **words):
    scene = problem.to_scene()
    return lambda: kr.solve(scene, t=STEPS * STEP, method=method, step=STEP, **words)


def time_calls(calls, rounds):
    """Return the duration of each call in each round [s]."""
    for call in calls.values():
        call()
    about = [timing.time_once(call) for call in calls.values()]
    samples, _ = timing.time_in_turn(calls.values(), about, rounds)
    return dict(zip(calls, samples, strict=True))


def format_spread(values, form):
    low, _, high = quantiles(values, n=4, method="inclusive")
    return f"{median(values):{form}} ({low:{form}} .. {high:{form}})"


def print_steps(scene, rounds):
    """Print the median cost of a step, and the median ratio of heyoka's step cost to this cost."""
    problem = load_problem(scene)
    heyokas = {
        name: HeyokaRun(problem, STEPS * STEP, Setting(tol=EPS), **options)
        for name, options in HEYOKA.items()
    }
    methods = [who.name for who in list_contenders(problem) if who.steered == "step"]
    times = time_calls(
        {
            **{name: run.solve for name, run in heyokas.items()},
            **{name: make_solve(problem, name) for name in methods},
        },
        rounds,
    )
    per_step = {name: [s / heyokas[name].steps for s in times[name]] for name in heyokas}
    best = min(heyokas, key=lambda name: median(per_step[name]))
    print(f"\n{scene}: a step of heyoka at tolerance {EPS:.1e}")
    for name in heyokas:
        print(f"  {name:20} {format_spread([1e9 * s for s in per_step[name]], '.0f')} ns")
    print(f"{'':22}a step of kreisel with driver and Python call, and the ratio of {best} to it")
    for name in methods:
        own = [s / STEPS for s in times[name]]
        ratios = [a / b for a, b in zip(per_step[best], own, strict=True)]
        cost, ratio = format_spread([1e9 * s for s in own], ".1f"), format_spread(ratios, ".1f")
        print(f"  {name:20} {cost} ns   x {ratio}")


def print_recording(scene, rounds):
    """Print the ratio of the times of runs that record all steps and no steps, in Python."""
    problem = load_problem(scene)
    print(f"\n{scene}: time with {STEPS} states over time with none, from Python, in new memory")
    for who in list_contenders(problem):
        if who.steered == "step":
            times = time_calls(
                {
                    "none": make_solve(problem, who.name),
                    "all": make_solve(problem, who.name, every=1),
                },
                rounds,
            )
            ratios = [a / b for a, b in zip(times["all"], times["none"], strict=True)]
            print(f"  {who.name:20} {format_spread(ratios, '.3f')}")


def print_recording_in_c(rounds):
    """Print the ratio of the times of runs that record all steps and no steps, in C."""
    if not (shutil.which("cmake") and shutil.which("cc")):
        print("\nrecording in C needs cmake and cc")
        return
    with tempfile.TemporaryDirectory() as folder:
        program = build_program(folder)
        print(
            f"\nthesis: time with {STEPS} states over time with none, from C, in reused memory",
            flush=True,
        )
        subprocess.run([program, str(STEPS), str(STEP), str(rounds)], check=True)


def build_program(folder):
    """Build the static library and record.c in a folder, and return the path of the program."""
    quiet = {"check": True, "stdout": subprocess.DEVNULL}
    options = ["-DKREISEL_TESTS=OFF", "-DCMAKE_BUILD_TYPE=Release"]
    subprocess.run(["cmake", "-S", ROOT, "-B", folder, *options], **quiet)
    target = ["--target", "kreisel_static", "-j", str(os.cpu_count())]
    subprocess.run(["cmake", "--build", folder, *target], **quiet)
    source, library, program = HERE / "record.c", f"{folder}/libkreisel.a", f"{folder}/record"
    compiler = ["cc", "-O2", f"-I{ROOT}/csrc"]
    subprocess.run([*compiler, source, library, "-lm", "-o", program], **quiet)
    return program


def main(argv=None):
    parser = argparse.ArgumentParser(
        prog="python -m validation.benchmarks.step_costs", description=__doc__.splitlines()[0]
    )
    parser.add_argument("scenes", nargs="*", default=["thesis", "asymmetric"])
    parser.add_argument("--rounds", type=int, default=25)
    args = parser.parse_args(argv)
    print(f"medians of {args.rounds} rounds (quartiles); kreisel: {STEPS} steps of {STEP:g}")
    for scene in args.scenes:
        print_steps(scene, args.rounds)
    print_recording("thesis", args.rounds)
    print_recording_in_c(args.rounds)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
