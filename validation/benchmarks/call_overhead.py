"""The overhead of kr.solve over the C library, and the time needed to create a scene.

    python -m validation.benchmarks.call_overhead [--beside OTHER_PYTHON] [--rounds 15]

The overhead is defined as the run time of kr.solve minus the run time of the same computation in C.
Each function call is timed in a separate process. With --beside, a second version of kreisel is
timed as well. Each call is repeated 25 times per round, and the shortest time is used. The program
prints the median over all rounds in microseconds.
"""

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path
from statistics import median

import kreisel as kr

from ..competitors import compiled_core

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
ROW = [0.01 * k for k in range(1, 11)]
MUST, STRETCH, SCENE_MUST = 3.0, 2.0, 6.0  # bounds [us]
SOLVES = {  # values: scene, method, step, times for the core, and arguments of the call
    "solve exact, [t]": ("thesis", "exact", 0.0, [1.0], "thesis, [1.0]"),
    "solve exact, t": ("thesis", "exact", 0.0, [0.0, 1.0], "thesis, 1.0"),
    "solve exact, a list": ("thesis", "exact", 0.0, ROW, "thesis, ROW"),
    "solve taylor, [t]": ("asymmetric", "taylor", 0.0, [0.01], "asymmetric, [0.01]"),
    "solve taylor, t": ("asymmetric", "taylor", 0.0, [0.0, 0.01], "asymmetric, 0.01"),
    "solve taylor, a list": ("asymmetric", "taylor", 0.0, ROW, "asymmetric, ROW"),
    "solve strang, [t]": ("thesis", "strang", 0.01, [0.01], "thesis, [.01], 'strang', step=.01"),
    "solve strang, t": ("thesis", "strang", 0.01, [0.0, 0.01], "thesis, .01, 'strang', step=.01"),
    "solve strang, a list": ("thesis", "strang", 0.01, ROW, "thesis, ROW, 'strang', step=.01"),
}
OTHERS = {
    "Scene(momentum=)": "kr.Scene(body, momentum=(.172, -1.862, 1.46))",
    "Scene(momentum=, attitude=, gravity=)": "kr.Scene(body, ARRAY, (1.0, 0.0, 0.0, 0.0), 1.0)",
    "Scene(body_velocity=)": "kr.Scene(body, body_velocity=(.172, -1.862, 1.46))",
    "scene.replace(gravity=)": "thesis.replace(gravity=2.0)",
    "kr.exact(scene)(t)": "kr.exact(thesis)(1.0)",
    "exact(t)": "known(1.0)",
    "start, and one state": "kr.start(thesis, 'strang', step=.01).to([.01])",
    "run.to of a run used again": "run.to([run.t])",
    "run.reset of a run used again": "run.reset((.172, -1.862, 1.46), (1.0, 0.0, 0.0, 0.0))",
    "stream of one path": "next(kr.stream(thesis, ROW, 'strang', step=.01))",
    "solve, want=nutation": "kr.solve(thesis, ROW, want=('nutation',))",
    "plan": "kr.plan(thesis)",
    "plan of an asymmetric top": "kr.plan(asymmetric)",
}
TIMED = """
import sys, timeit
import numpy as np, kreisel as kr
thesis, asymmetric, body = kr.scenes.thesis, kr.scenes.asymmetric, kr.scenes.thesis.body
known, ROW, ARRAY = kr.exact(thesis), {row}, np.array((.172, -1.862, 1.46))
run = kr.start(thesis, 'strang', step=.01)
timer = timeit.Timer(lambda: {call})
number = max(1, timer.autorange()[0] // 20)
print(1e6 * min(timer.repeat(25, number)) / number)
"""


def time_core(folder):
    """Return the run time [us] of the C library for each benchmark of kr.solve."""
    library = ROOT / "build/venv/libkreisel.a"
    program = Path(folder) / "calls"
    source = HERE / "call_overhead.c"
    subprocess.run(
        ["cc", "-O2", f"-I{ROOT}/csrc", source, library, "-lm", *gsl_flags(), "-o", program],
        check=True,
    )
    seconds = {}
    for name, (scene, method, step, times, _) in SOLVES.items():
        block = compiled_core.scene_bytes(getattr(kr.scenes, scene)).hex()
        words = [str(program), method, str(step), block, *map(str, times)]
        seconds[name] = float(subprocess.run(words, capture_output=True, text=True).stdout) / 1e3
    return seconds


def gsl_flags():
    """Return the linker flags for GSL if the library was built with GSL."""
    if "gsl_bsimp" not in kr.methods:
        return []
    result = subprocess.run(["pkg-config", "--libs", "gsl"], capture_output=True, text=True)
    return result.stdout.split()


def time_call(interpreter, call, folder):
    """Return the run time [us] of a function call, measured in a separate process."""
    code = TIMED.format(call=call, row=ROW)
    result = subprocess.run([interpreter, "-c", code], cwd=folder, capture_output=True, text=True)
    if result.returncode:
        raise SystemExit(result.stderr)
    return float(result.stdout)


def main(argv=None):
    parser = argparse.ArgumentParser(
        prog="python -m validation.benchmarks.call_overhead", description=__doc__.splitlines()[0]
    )
    parser.add_argument("--beside", help="interpreter of another kreisel to compare with")
    parser.add_argument("--rounds", type=int, default=15)
    words = parser.parse_args(argv)
    interpreters = [sys.executable, *([words.beside] if words.beside else [])]
    calls = {name: f"kr.solve({case[-1]})" for name, case in SOLVES.items()} | OTHERS
    with tempfile.TemporaryDirectory() as folder:
        own = time_core(folder)
        print(f"{'':40}{'core':>8}{'call':>8}{'share':>8}{'other':>8}{'share':>8}")
        for name, call in calls.items():
            samples = [[] for _ in interpreters]
            for _ in range(words.rounds):
                for interpreter, times in zip(interpreters, samples, strict=True):
                    times.append(time_call(interpreter, call, folder))
            print(format_row(name, own.get(name), [median(times) for times in samples]))


def format_row(name, own, calls):
    """Format one row of the table of run times."""
    shares = [None if own is None else call - own for call in calls]
    cells = [own, *(cell for pair in zip(calls, shares, strict=True) for cell in pair)]
    text = "".join(" " * 8 if cell is None else f"{cell:8.2f}" for cell in cells)
    verdict = ""
    if own is not None:
        verdict = "PASS" if shares[0] <= MUST else "MISSED"
        verdict += ", stretch" if shares[0] <= STRETCH else ""
    elif name.startswith(("Scene", "scene")):
        verdict = "PASS" if calls[0] <= SCENE_MUST else "MISSED"
    return f"{name:40}{text}  {verdict}"


if __name__ == "__main__":
    raise SystemExit(main())
