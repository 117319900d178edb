"""The Taylor method with a kernel, a tolerance and numbers of terms that users cannot choose: taylor_kernels.c, compiled here."""

import ctypes
import os
import subprocess
import tempfile
from pathlib import Path

import numpy as np

HERE = Path(__file__).parent
CSRC = HERE.parents[1] / "csrc"
CORE = sorted(
    file for file in CSRC.rglob("*.c") if file.parent.name != "gsl" and file.name != "wasm.c"
)
PER_SET = [
    *sorted(CSRC.glob("taylor/kernel*.c")),
    *(CSRC / "exact" / name for name in ("states.c", "closed_form.c", "map.c")),
]
SETS = {
    "avx2": ["-mavx2", "-mfma"],
    "avx512": ["-mavx2", "-mfma", "-mavx512f", "-mavx512vl", "-mavx512dq"],
}


def compiled(folder, terms, plain):
    """The library with all instruction sets; with the portable kernel alone; with other numbers of terms (head and last for 20
    digits, for 30) with the widest alone."""
    cc = os.environ.get("CC", "gcc")
    flags = [cc, "-std=c99", "-O3", "-fPIC", "-ffp-contract=off", "-fno-tree-vectorize"]
    terms = [
        f"-D{name}={n}"
        for name, n in zip(("KR_HEAD_20", "KR_LAST_20", "KR_HEAD_30", "KR_LAST_30"), terms or ())
    ]
    objects = []
    for name, options in ({} if terms or plain else SETS).items():
        for file in PER_SET:
            objects.append(folder / f"{file.stem}_{name}.o")
            subprocess.run(
                [*flags, *options, f"-DKR_ISA={name}", f"-I{CSRC}", "-c", file, "-o", objects[-1]],
                check=True,
            )
    options = [*SETS["avx512"], *terms] if terms else ["-DKR_PLAIN"] if plain else ["-DKR_X86"]
    library = folder / "kernels.so"
    subprocess.run(
        [
            *flags,
            *options,
            f"-I{CSRC}",
            "-shared",
            *CORE,
            HERE / "taylor_kernels.c",
            *objects,
            "-lm",
            "-o",
            library,
        ],
        check=True,
    )
    return ctypes.CDLL(str(library))


class Kernels:
    def __init__(self, terms=None, plain=False):
        self.folder = tempfile.TemporaryDirectory()
        self.library = compiled(Path(self.folder.name), terms, plain)
        self.library.kr_bench_isa.restype = ctypes.c_char_p
        self.sets = []
        while name := self.library.kr_bench_isa(len(self.sets)):
            self.sets.append(name.decode())
        self.orders = []
        while order := self.library.kr_bench_order(len(self.orders)):
            self.orders.append(order)

    def run(self, scene, which, kernel, log2_tol, t, steps=None):
        """A call that solves and returns the state at t, and what it leaves out; `steps` gets how many it took."""
        scene, out, steps = (
            np.array(scene),
            np.zeros((2, 8)),
            ctypes.c_int64() if steps is None else steps,
        )
        arguments = (
            ctypes.c_void_p(scene.ctypes.data),
            which,
            kernel,
            ctypes.c_double(log2_tol),
            ctypes.c_double(t),
            ctypes.c_void_p(out.ctypes.data),
            ctypes.byref(steps),
        )

        def run(keep=scene):
            if self.library.kr_bench_run(*arguments):
                raise RuntimeError("the run failed")
            return out

        return run
