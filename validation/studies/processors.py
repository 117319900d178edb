"""The cost of a step of the Taylor series on other processors.

Conclusion: the library contains kernels for AVX2 and AVX-512, and its baseline kernels for 20 and
30 digits are optimized for size.

    python -m validation.studies.processors

An older processor is simulated by using only its instruction sets. The last row shows the cost of
optimizing the baseline kernels for size. The result is the shortest processor time of all rounds.
The output is the table of README.md.
"""

import argparse
from ctypes import c_int64
from time import process_time

from ..competitors import compiled_core, machine
from ..references.problems import load_problem
from .taylor_kernels import TaylorKernels

ROUNDS, T = 30, 100.0
WHAT = {"1e-6": (-20, 1), "16 digits": (-53, 4), "20 digits": (-70, 5), "30 digits": (-100, 6)}
NAMES = {
    "avx512": "AVX-512",
    "avx2": "AVX2 and fma",
    "base": "every x86_64 (SSE2)",
    "plain": "C without vectors",
    "fast": "every x86_64, fast before small",
}


def list_libraries():
    """Yield the name, the library and the index of the kernels, for each row."""
    all_here = TaylorKernels()
    yield from ((name, all_here, isa) for isa, name in enumerate(all_here.isas))
    yield "plain", TaylorKernels(plain=True), 0
    yield "fast", TaylorKernels(alone=True), 0


def time_call(call, least=2e-3):
    """Return the processor time of a call, repeated for at least `least` seconds."""
    number, begin = 0, process_time()
    while (spent := process_time() - begin) < least:
        call()
        number += 1
    return spent / number


def main(argv=None):
    argparse.ArgumentParser(
        prog="python -m validation.studies.processors", description=__doc__.splitlines()[0]
    ).parse_args(argv)
    scene = compiled_core.scene_bytes(load_problem("asymmetric").to_scene())
    rows, calls, steps = list(list_libraries()), [], []
    for _, kernels, isa in rows:
        for log2_tol, kernel in WHAT.values():
            taken = c_int64()
            call = kernels.run(scene, isa, kernel, log2_tol, T, taken)
            call()
            calls.append(call)
            steps.append(taken.value)
    rounds = [[time_call(call) for call in calls] for _ in range(ROUNDS)]
    each = iter([1e6 * min(s) / n for *s, n in zip(*rounds, steps, strict=True)])
    print(f"{machine.processor_name()}\n\n| kernels for | {' | '.join(WHAT)} |")
    print("| --- |" + " ---: |" * len(WHAT))
    for name, _, _ in rows:
        print(f"| {NAMES[name]} | {' | '.join(f'{next(each):.2f}' for _ in WHAT)} |")


if __name__ == "__main__":
    main()
