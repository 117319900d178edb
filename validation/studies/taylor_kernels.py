"""Access to orders and tolerances of the Taylor method that users cannot select."""

import ctypes
import tempfile
from pathlib import Path

import numpy as np

from ..benchmarks.compiling import ISAS, compile_core

SOURCE = Path(__file__).with_suffix(".c")
TERMS = ("KR_HEAD_20", "KR_LAST_20", "KR_HEAD_30", "KR_LAST_30")


def compile_library(folder, terms):
    """Compile the C library together with taylor_kernels.c, and load the result.

    By default, code for all instruction sets is compiled. If `terms` is given, only AVX-512 code
    with the specified numbers of terms is compiled.
    """
    if terms:
        defined = (f"-D{name}={n}" for name, n in zip(TERMS, terms, strict=True))
        return compile_core(folder, SOURCE, {}, (*ISAS["avx512"], *defined))
    return compile_core(folder, SOURCE)


def read_list(get_number):
    """Return the values of `get_number(i)` for i = 0, 1, 2, ... before the first false value."""
    numbers = []
    while number := get_number(len(numbers)):
        numbers.append(number)
    return numbers


class TaylorKernels:
    def __init__(self, terms=None):
        self.folder = tempfile.TemporaryDirectory()
        self.library = compile_library(self.folder.name, terms)
        self.library.kr_bench_isa.restype = ctypes.c_char_p
        self.isas = [name.decode() for name in read_list(self.library.kr_bench_isa)]
        self.orders = read_list(self.library.kr_bench_order)

    def run(self, block, isa, kernel, log2_tol, t, steps=None):
        """Return a function that integrates to `t` and returns the high and low parts of the state.

        The number of steps is stored in `steps`.
        """
        out = np.zeros((2, 8))
        arguments = (
            ctypes.c_char_p(block),
            isa,
            kernel,
            ctypes.c_double(log2_tol),
            ctypes.c_double(t),
            ctypes.c_void_p(out.ctypes.data),
            ctypes.byref(ctypes.c_int64() if steps is None else steps),
        )

        def run():
            if self.library.kr_bench_run(*arguments):
                raise RuntimeError("the run failed")
            return out

        return run
