"""What the closed form costs beside heyoka's steps and dense output, interleaved: `python -m validation.bench_exact`.

Ours is timed in C, by bench_exact.c; heyoka in its own loops, so that what Python adds to a call is lost in them.
"""
import argparse
import ctypes
import shutil
import subprocess
import tempfile
import time
from pathlib import Path
from statistics import median

import heyoka as hy
import numpy as np

import kreisel as kr

from . import equations, exact_cases
from .scenes import Problem

CSRC = Path(__file__).parent.parent / "csrc"
FLAGS = "-std=c99 -O3 -ffp-contract=off -fno-tree-slp-vectorize -fno-math-errno -fPIC -shared".split()
END, OUTPUTS, BATCH = 600.0, 60001, 4096
SCENES = {"thesis": "the thesis' top", "tilted": "tilted", "upside down": "upside down", "free": "free"}


def library():
    """The core, and the loops that time it."""
    compiler = shutil.which("gcc") or exit("needs gcc")
    apart = {"states.c", "wasm.c"}      # that is built by the other file; and for the page
    folders = [CSRC / folder for folder in ("", "methods", "exact", "taylor")]
    plain = [file for folder in folders for file in folder.glob("*.c") if file.name not in apart]
    with tempfile.TemporaryDirectory() as folder:
        made = Path(folder) / "bench_exact.so"
        objects = [Path(folder) / f"{i}.o" for i in range(len(plain))]
        common = [compiler, *FLAGS[:-1], f"-I{CSRC}"]
        for source, to in zip(plain, objects):
            subprocess.run([*common, "-fno-tree-vectorize", "-c", source, "-o", to], check=True)
        subprocess.run([*common, "-shared", Path(__file__).with_suffix(".c"), *objects, "-lm", "-o", made], check=True)
        core = ctypes.CDLL(made)
    for name in ("plan", "plan_and_state", "states", "batch", "map_state"):
        getattr(core, f"bench_{name}").restype = ctypes.c_double
    return core


class Ours:
    def __init__(self, core, scene):
        self.core = core
        self.block = np.array(scene._block)
        self.scene = self.block.ctypes.data_as(ctypes.c_void_p)
        self.t = np.random.default_rng(1).uniform(0, END, BATCH)
        self.out = np.empty((BATCH, 8))
        self.arrays = ctypes.c_int(BATCH), *(a.ctypes.data_as(ctypes.c_void_p) for a in (self.t, self.out))

    def plan(self):
        return self.core.bench_plan(self.scene, 200)

    def plan_and_state(self):
        return self.core.bench_plan_and_state(self.scene, ctypes.c_double(END), 200)

    def state(self):
        return self.core.bench_states(self.scene, *self.arrays)

    def batch(self, width):
        return self.core.bench_batch(self.scene, width, *self.arrays)

    def map_state(self):
        return self.core.bench_map_state(self.scene, ctypes.c_double(0.01), BATCH)

    def same_bits(self):
        """Of single states and of every width that there is."""
        def bits(call, *words):
            return self.out.tobytes() if call(*words) > 0 else None
        return len({bits(self.state), *(bits(self.batch, width) for width in (2, 4, 8))} - {None}) == 1


class Heyoka:
    def __init__(self, problem):
        system, self.start = equations.system(problem)
        self.top = hy.taylor_adaptive(system, self.start)
        self.grid = np.linspace(0, END, OUTPUTS)

    def again(self):
        self.top.time, self.top.state[:] = 0.0, self.start

    def steps(self):
        self.again()
        begin = time.perf_counter()
        self.top.propagate_until(END)
        return time.perf_counter() - begin

    def outputs(self):
        """Seconds a state of dense output, its steps included."""
        self.again()
        begin = time.perf_counter()
        self.top.propagate_grid(self.grid)
        return (time.perf_counter() - begin) / OUTPUTS


def bench(core, name, rounds):
    case = {**exact_cases.LAGRANGE, **exact_cases.EULER}[SCENES[name]]
    scene = exact_cases.scene(kr, case)
    inertia, lever = ((case[0], case[0], case[1]), case[2]) if len(case) == 5 else (case[0], 0.0)
    problem = Problem(name, inertia, (0.0, 0.0, lever), scene.attitude, scene.momentum)
    ours, heyoka = Ours(core, scene), Heyoka(problem)
    calls = {"heyoka, to t = 600": heyoka.steps, "heyoka, a state of 60001": heyoka.outputs,
             "set-up": ours.plan, "set-up and a state": ours.plan_and_state, "a state": ours.state,
             **{f"a state, {width} at once": lambda width=width: ours.batch(width) for width in (2, 4, 8)}}
    if len(case) == 5:
        calls["a state of the map"] = ours.map_state
    seconds = {word: [] for word in calls}
    for _ in range(rounds):
        for word, call in calls.items():
            seconds[word].append(call())
    print(f"\n{name}: medians of {rounds} rounds; same bits at every width: {ours.same_bits()}")
    for word, found in seconds.items():
        peer = "heyoka, to t = 600" if word.startswith("set-up") else "heyoka, a state of 60001"
        if median(found) < 0:
            print(f"  {word:26} not on this processor")
            continue
        ratio = median(a / b for a, b in zip(seconds[peer], found))
        print(f"  {word:26} {1e9 * median(found):12.1f} ns" + ("" if word.startswith("heyoka") else f"   {ratio:8.1f} x faster"))
    top = kr.exact(scene)
    times = np.linspace(0, END, OUTPUTS)
    for word, call, each in (("from Python: set-up", lambda: kr.exact(scene), 1), ("from Python: a state", lambda: top(END), 1),
                             ("from Python: of 60001", lambda: top(times), OUTPUTS)):
        took = []
        for _ in range(rounds):
            begin = time.perf_counter()
            call()
            took.append((time.perf_counter() - begin) / each)
        print(f"  {word:26} {1e9 * median(took):12.1f} ns")


def main(argv=None):
    parser = argparse.ArgumentParser(prog="python -m validation.bench_exact", description=__doc__)
    parser.add_argument("scenes", nargs="*", default=list(SCENES), metavar="scene", help=", ".join(SCENES))
    parser.add_argument("--rounds", type=int, default=41)
    chosen = parser.parse_args(argv)
    core = library()
    for name in chosen.scenes:
        bench(core, name, chosen.rounds)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
