"""What the closed form costs beside heyoka's steps and dense output, interleaved: `python -m validation.bench.exact`.

Ours is timed in C, by exact.c; heyoka in its own loops, so that what Python adds to a call is lost in them. The
best of all rounds counts, of both: what else the machine does falls on the longer of the two, which is heyoka's.
"""

import argparse
import ctypes
import shutil
import subprocess
import tempfile
import time
from pathlib import Path

import heyoka as hy
import kreisel as kr
import numpy as np

from ..truth import equations, exact_cases
from ..truth.problems import Problem
from .taylor_kernels import CORE, CSRC, PER_SET, SETS

FLAGS = "-std=c99 -O3 -ffp-contract=off -fno-tree-vectorize -fno-tree-slp-vectorize -fno-math-errno -fPIC".split()
END, OUTPUTS, BATCH, STREAM, TOPS = 600.0, 60001, 4096, 100_000, 1000
SCENES = {
    "thesis": "the thesis' top",
    "tilted": "tilted",
    "upside down": "upside down",
    "free": "free",
}
AS_CALLED = -1
TO_END, A_STATE = "heyoka, to t = 600", "heyoka, a state of 60001"
TARGETS = {
    "set-up and a state": (800, 1500),
    "a state": (2, 3),
    "a state of 4096": (10, 20),
    f"a state of {STREAM}": (10, 20),
}  # times faster: must, stretch


def library(compiler="gcc"):
    """The core with all its instruction sets, and the loops that time it."""
    compiler = shutil.which(compiler) or exit(f"needs {compiler}")
    jobs = [(file, ["-DKR_X86"]) for file in [*CORE, Path(__file__).with_suffix(".c")]]
    jobs += [
        (file, [*options, f"-DKR_ISA={name}"]) for name, options in SETS.items() for file in PER_SET
    ]
    with tempfile.TemporaryDirectory() as folder:
        made = Path(folder) / "bench_exact.so"
        objects = [Path(folder) / f"{i}.o" for i in range(len(jobs))]
        for (source, options), to in zip(jobs, objects):
            loops = ["-ftree-vectorize"] if source.name == "states.c" else []
            subprocess.run(
                [compiler, *FLAGS, *loops, *options, f"-I{CSRC}", "-c", source, "-o", to],
                check=True,
            )
        subprocess.run([compiler, "-shared", *objects, "-lm", "-o", made], check=True)
        core = ctypes.CDLL(made)
    for name in ("plan", "plan_and_state", "states", "batch", "map_state"):
        getattr(core, f"bench_{name}").restype = ctypes.c_double
    core.bench_isa.restype = ctypes.c_char_p
    return core


def sets(core):
    """The number of each instruction set that runs here, by name."""
    found, i = {}, 0
    while (name := core.bench_isa(i)) is not None:
        found |= {name.decode(): i} if name else {}
        i += 1
    return found


class Ours:
    def __init__(self, core, scene):
        self.core = core
        self.block = np.frombuffer(scene._block)
        self.scene = self.block.ctypes.data_as(ctypes.c_void_p)
        self.t = np.random.default_rng(1).uniform(0, END, STREAM)
        self.out = np.empty((STREAM, 8))
        self.arrays = tuple(a.ctypes.data_as(ctypes.c_void_p) for a in (self.t, self.out))

    def plan(self):
        return self.core.bench_plan(self.scene, 200)

    def plan_and_state(self):
        return self.core.bench_plan_and_state(self.scene, ctypes.c_double(END), 200)

    def state(self, by=AS_CALLED):
        return self.core.bench_states(self.scene, by, BATCH, *self.arrays)

    def batch(self, by=AS_CALLED, width=BATCH, n=BATCH):
        return self.core.bench_batch(self.scene, by, width, n, *self.arrays)

    def map_state(self):
        return self.core.bench_map_state(self.scene, ctypes.c_double(0.01), BATCH)

    def same_bits(self):
        """Of single states and batches of every instruction set."""

        def bits(call, by):
            assert call(by) > 0
            return self.out[:BATCH].tobytes()

        return (
            len(
                {
                    bits(call, by)
                    for by in sets(self.core).values()
                    for call in (self.state, self.batch)
                }
            )
            == 1
        )


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
    calls = {
        TO_END: heyoka.steps,
        A_STATE: heyoka.outputs,
        "set-up": ours.plan,
        "set-up and a state": ours.plan_and_state,
        "a state": ours.state,
        "a state of 8": lambda: ours.batch(width=8),
        "a state of 4096": ours.batch,
        f"a state of {STREAM}": lambda: ours.batch(width=STREAM, n=STREAM),
    }
    for set_name, by in sets(core).items():
        calls |= {
            f"a state, {set_name}": lambda by=by: ours.state(by),
            f"a state of 4096, {set_name}": lambda by=by: ours.batch(by),
        }
    if len(case) == 5:
        calls["a state of the map"] = ours.map_state
    seconds = interleaved(calls, rounds)
    print(
        f"\n{name}: best of {rounds} rounds; same bits from every instruction set: {ours.same_bits()}"
    )
    for word, found in seconds.items():
        ratio = min(seconds[TO_END if word.startswith("set-up") else A_STATE]) / min(found)
        line(word, found, None if word.startswith("heyoka") else ratio)
    from_python(scene, rounds)


def interleaved(calls, rounds):
    seconds = {word: [] for word in calls}
    for _ in range(rounds):
        for word, call in calls.items():
            seconds[word].append(call())
    return seconds


def line(word, found, ratio=None):
    text = f"  {word:28} {1e9 * min(found):12.1f} ns"
    if ratio is not None:
        text += f"   {ratio:8.1f} x faster"
    if ratio is not None and word in TARGETS:
        must, stretch = TARGETS[word]
        grade = "MISSED" if ratio < must else "PASS" if ratio < stretch else "PASS, stretch"
        text += f"   must {must} stretch {stretch}: {grade}"
    print(text, flush=True)


def timed(call, each, rounds):
    took = []
    for _ in range(rounds):
        begin = time.perf_counter()
        call()
        took.append((time.perf_counter() - begin) / each)
    return took


def from_python(scene, rounds):
    top, times, some = kr.exact(scene), np.linspace(0, END, OUTPUTS), range(100)
    tops = [
        scene.replace(momentum=m)
        for m in np.random.default_rng(2).normal(scene.momentum, 0.1, (TOPS, 3))
    ]
    many = kr.exact(tops)
    line("from Python: set-up", timed(lambda: [kr.exact(scene) for _ in some], len(some), rounds))
    line("from Python: a state", timed(lambda: [top(END) for _ in some], len(some), rounds))
    line(f"from Python: of {OUTPUTS}", timed(lambda: top(times), OUTPUTS, rounds))
    line(f"from Python: set-up of {TOPS}", timed(lambda: kr.exact(tops), TOPS, rounds))
    line(f"from Python: a state of {TOPS}", timed(lambda: many(END), TOPS, rounds))


def main(argv=None):
    parser = argparse.ArgumentParser(prog="python -m validation.bench.exact", description=__doc__)
    parser.add_argument(
        "scenes", nargs="*", default=list(SCENES), metavar="scene", help=", ".join(SCENES)
    )
    parser.add_argument("--rounds", type=int, default=41)
    chosen = parser.parse_args(argv)
    core = library()
    for name in chosen.scenes:
        bench(core, name, chosen.rounds)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
