"""Compilation of the C library together with additional code for benchmarks.

A benchmark can add a source file to the library, and choose the instruction sets and the values of
macros, such as the number of Taylor coefficients.
"""

import ctypes
import os
import shutil
import subprocess
from pathlib import Path

CSRC = Path(__file__).parents[2] / "csrc"
FLAGS = (
    *("-std=c99", "-O3", "-fPIC", "-ffp-contract=off", "-fno-math-errno"),
    *("-fno-tree-vectorize", "-fno-tree-slp-vectorize"),
)
OF_LOOPS = "batch_eval.c"  # this file is compiled with automatic vectorization
AVX2 = ("-mavx2", "-mfma", "-falign-functions=64")
CLOSED_FORMS = ("closed_form.c", "goryachev_chaplygin.c", "kowalewski.c", "map.c")
SMALL = dict.fromkeys((*CLOSED_FORMS, "batch_setup.c"), ("-Os", "-fno-inline-functions"))
SMALL |= dict.fromkeys(
    ("kernel_dd.c", "kernel_tangent_batch_dd.c", "kernel_tangents_dd.c"), ("-O2",)
)
ISAS = {"avx2": AVX2, "avx512": (*AVX2, "-mavx512f", "-mavx512vl", "-mavx512dq")}


def core_files():
    """Return the C source files of the library, without those for GSL and for WebAssembly."""
    files = sorted(CSRC.rglob("*.c"))
    return [file for file in files if file.parent.name != "gsl" and file.name != "wasm.c"]


def isa_files():
    """Return the source files that are compiled once for each instruction set."""
    exact = [CSRC / "exact" / name for name in ("batch_eval.c", "batch_setup.c", *CLOSED_FORMS)]
    return [*sorted(CSRC.glob("*/kernel*.c")), *exact]


def size_options(file, options):
    """Return additional compiler options for `file` in a build for the baseline instruction set.

    Some files of the baseline code are optimized less, mostly for size, if the library also
    contains code for newer instruction sets.
    """
    return SMALL.get(file.name, ()) if "-DKR_WITH_AVX2" in options else ()


def find_compiler():
    return shutil.which(os.environ.get("CC", "gcc")) or exit("needs gcc, or another compiler as CC")


def compile_core(folder, source, isas=ISAS, options=("-DKR_WITH_AVX2", "-DKR_WITH_AVX512")):
    """Compile the C library and the file `source` into a shared library, and load the result."""
    jobs = [(file, (*options, *size_options(file, options))) for file in (*core_files(), source)]
    jobs += [(file, (*isas[isa], f"-DKR_ISA={isa}")) for isa in isas for file in isa_files()]
    objects = [Path(folder) / f"{i}.o" for i in range(len(jobs))]
    for (file, more), object_file in zip(jobs, objects, strict=True):
        loops = ["-ftree-vectorize"] if file.name == OF_LOOPS else []
        command = [
            find_compiler(),
            *FLAGS,
            *loops,
            *more,
            f"-I{CSRC}",
            "-c",
            file,
            "-o",
            object_file,
        ]
        subprocess.run(command, check=True)
    library = Path(folder) / "core.so"
    subprocess.run([find_compiler(), "-shared", *objects, "-lm", "-o", library], check=True)
    return ctypes.CDLL(str(library))
