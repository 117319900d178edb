"""The cost of the closed form, compared with heyoka's steps and dense output.

    python -m validation.benchmarks.closed_form_speed [scene ...] [--rounds 41]

kreisel is timed in C by closed_form_speed.c, and heyoka in its own loops, so that the overhead of
Python is negligible. The runs of both programs are interleaved, and the shortest time of all rounds
is used. Other load on the machine slows heyoka most, because its runs are longer.
"""

import argparse
import ctypes
import tempfile
import time
from functools import partial
from pathlib import Path

import heyoka as hy
import kreisel as kr
import numpy as np

from ..competitors import compiled_core
from ..references import equations, exact_cases
from .compiling import compile_core

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
}  # required and desired speedup


def compile_library():
    """Compile the core for all its instruction sets, together with the timed loops."""
    with tempfile.TemporaryDirectory() as folder:
        loops = compile_core(folder, Path(__file__).with_suffix(".c"))
    for name in ("closed_form", "closed_form_and_state", "states", "batch", "map_state"):
        getattr(loops, f"bench_{name}").restype = ctypes.c_double
    loops.bench_isa.restype = ctypes.c_char_p
    return loops


def list_isas(loops):
    """Return {name: index} of the instruction sets that this machine supports."""
    found, i = {}, 0
    while (name := loops.bench_isa(i)) is not None:
        found |= {name.decode(): i} if name else {}
        i += 1
    return found


class KreiselTimer:
    def __init__(self, loops, scene):
        self.loops, self.scene = loops, ctypes.c_char_p(compiled_core.scene_bytes(scene))
        self.t = np.random.default_rng(1).uniform(0, END, STREAM)
        self.out = np.empty((STREAM, 8))
        self.arrays = tuple(a.ctypes.data_as(ctypes.c_void_p) for a in (self.t, self.out))

    def time_setup(self):
        return self.loops.bench_closed_form(self.scene, 200)

    def time_setup_and_state(self):
        return self.loops.bench_closed_form_and_state(self.scene, ctypes.c_double(END), 200)

    def time_state(self, isa=AS_CALLED):
        return self.loops.bench_states(self.scene, isa, BATCH, *self.arrays)

    def time_batch(self, isa=AS_CALLED, width=BATCH, n=BATCH):
        return self.loops.bench_batch(self.scene, isa, width, n, *self.arrays)

    def time_map_state(self):
        return self.loops.bench_map_state(self.scene, ctypes.c_double(0.01), BATCH)

    def has_equal_bits(self):
        """Return True if single states and batches are bitwise equal for every instruction set."""

        def bits(call, isa):
            assert call(isa) > 0
            return self.out[:BATCH].tobytes()

        calls = (self.time_state, self.time_batch)
        return (
            len({bits(call, isa) for isa in list_isas(self.loops).values() for call in calls}) == 1
        )


class HeyokaTimer:
    def __init__(self, problem):
        system, self.start = equations.build_system(problem)
        self.top = hy.taylor_adaptive(system, self.start)
        self.grid = np.linspace(0, END, OUTPUTS)

    def reset(self):
        self.top.time, self.top.state[:] = 0.0, self.start

    def time_steps(self):
        self.reset()
        begin = time.perf_counter()
        self.top.propagate_until(END)
        return time.perf_counter() - begin

    def time_outputs(self):
        """Return the seconds per state of heyoka's dense output, including its steps."""
        self.reset()
        begin = time.perf_counter()
        self.top.propagate_grid(self.grid)
        return (time.perf_counter() - begin) / OUTPUTS


def make_calls(loops, scene, heyoka, is_lagrange):
    ours = KreiselTimer(loops, scene)
    calls = {
        TO_END: heyoka.time_steps,
        A_STATE: heyoka.time_outputs,
        "set-up": ours.time_setup,
        "set-up and a state": ours.time_setup_and_state,
        "a state": ours.time_state,
        "a state of 8": partial(ours.time_batch, width=8),
        "a state of 4096": ours.time_batch,
        f"a state of {STREAM}": partial(ours.time_batch, width=STREAM, n=STREAM),
    }
    for name, isa in list_isas(loops).items():
        calls |= {
            f"a state, {name}": partial(ours.time_state, isa),
            f"a state of 4096, {name}": partial(ours.time_batch, isa),
        }
    return ours, calls | (
        {"a state of the Bobenko-Suris map": ours.time_map_state} if is_lagrange else {}
    )


def print_scene(loops, name, rounds):
    case = {**exact_cases.LAGRANGE, **exact_cases.EULER}[SCENES[name]]
    scene, heyoka = exact_cases.case_scene(case), HeyokaTimer(exact_cases.case_problem(name, case))
    ours, calls = make_calls(loops, scene, heyoka, exact_cases.is_lagrange(case))
    seconds = run_rounds(calls, rounds)
    same = ours.has_equal_bits()
    print(f"\n{name}: best of {rounds} rounds; bitwise equal on every instruction set: {same}")
    for word, found in seconds.items():
        ratio = min(seconds[TO_END if word.startswith("set-up") else A_STATE]) / min(found)
        print_row(word, found, None if word.startswith("heyoka") else ratio)
    print_python_times(scene, rounds)


def run_rounds(calls, rounds):
    seconds = {word: [] for word in calls}
    for _ in range(rounds):
        for word, call in calls.items():
            seconds[word].append(call())
    return seconds


def print_row(word, found, ratio=None):
    text = f"  {word:28} {1e9 * min(found):12.1f} ns"
    if ratio is not None:
        text += f"   {ratio:8.1f} x faster"
    if ratio is not None and word in TARGETS:
        must, stretch = TARGETS[word]
        grade = "MISSED" if ratio < must else "PASS" if ratio < stretch else "PASS, stretch"
        text += f"   must {must} stretch {stretch}: {grade}"
    print(text, flush=True)


def time_call(call, each, rounds):
    took = []
    for _ in range(rounds):
        begin = time.perf_counter()
        call()
        took.append((time.perf_counter() - begin) / each)
    return took


def print_python_times(scene, rounds):
    top, times, some = kr.exact(scene), np.linspace(0, END, OUTPUTS), range(100)
    tops = [
        scene.replace(momentum=m)
        for m in np.random.default_rng(2).normal(scene.momentum, 0.1, (TOPS, 3))
    ]
    many = kr.exact(tops)
    print_row(
        "from Python: set-up", time_call(lambda: [kr.exact(scene) for _ in some], len(some), rounds)
    )
    print_row(
        "from Python: a state", time_call(lambda: [top(END) for _ in some], len(some), rounds)
    )
    print_row(f"from Python: of {OUTPUTS}", time_call(lambda: top(times), OUTPUTS, rounds))
    print_row(f"from Python: set-up of {TOPS}", time_call(lambda: kr.exact(tops), TOPS, rounds))
    print_row(f"from Python: a state of {TOPS}", time_call(lambda: many(END), TOPS, rounds))


def main(argv=None):
    parser = argparse.ArgumentParser(
        prog="python -m validation.benchmarks.closed_form_speed",
        description=__doc__.splitlines()[0],
    )
    parser.add_argument(
        "scenes", nargs="*", default=list(SCENES), metavar="scene", help=", ".join(SCENES)
    )
    parser.add_argument("--rounds", type=int, default=41)
    chosen = parser.parse_args(argv)
    loops = compile_library()
    for name in chosen.scenes:
        print_scene(loops, name, chosen.rounds)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
