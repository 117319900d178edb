"""Try an installed kreisel as its user would: python -I .ci/wheel.py, from another folder."""

import importlib.metadata
import sys
import sysconfig
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import kreisel as kr
import numpy as np

END_TIME = 20.0


def solve_top(i):
    """Return the last attitude of a top whose momentum depends on `i`."""
    scene = kr.scenes.thesis.replace(momentum=(0.1 * i, 0.2, 3.0))
    return kr.solve(scene, [END_TIME], method="taylor").q[-1]


def processor_flags():
    """Return the features of the processor, as Linux lists them."""
    file = Path("/proc/cpuinfo")
    return file.read_text().split() if file.exists() else []


def check_licences():
    """Check that the wheel contains the licences that it names, and a bill of materials."""
    files = importlib.metadata.files("kreisel")
    assert any(file.match("sboms/kreisel.cdx.json") for file in files)
    licences = importlib.metadata.metadata("kreisel").get_all("License-File")
    assert any(name.endswith("pybind11.txt") for name in licences), "a licence is missing"
    for name in licences:
        (text,) = [file.read_text() for file in files if file.match(f"*.dist-info/licenses/{name}")]
        assert len(text) > 1000, name


def main():
    assert "site-packages" in kr.__file__, kr.__file__
    assert not [name for name in kr.methods if name.startswith("gsl")], "with GSL it would be GPL"
    path = kr.solve(kr.scenes.thesis, t=1, method="bobenko_suris", step=0.01)
    assert path.t[-1] == 1 and abs((path.q[-1] ** 2).sum() - 1) < 1e-14
    assert len(kr.view(kr.scenes.thesis, open=False).html) > 500_000, "the wheel lacks the viewer"
    assert kr.score({"t": [0.0], "q": [(1, 0, 0, 0)]}, "tumble").is_within  # the cases are there
    check_licences()
    alone = [solve_top(i) for i in range(16)]
    if sys.platform != "emscripten":  # Pyodide has no threads
        with ThreadPoolExecutor(8) as threads:
            results = list(threads.map(solve_top, list(range(16)) * 4))
        assert np.array_equal(results, alone * 4), "threads give different results"
    tops = kr.scenes.thesis.vary(gravity=np.linspace(0.9, 1.1, 100))
    assert kr.solve(tops, END_TIME, threads=4).q.shape == (100, 2, 4)
    kernel = kr.plan(kr.scenes.asymmetric, method="taylor").kernel
    has_vectors = "avx2" in processor_flags()
    assert kernel != "base" or not has_vectors, "the processor's vectors are not used"
    free = bool(sysconfig.get_config_var("Py_GIL_DISABLED"))
    assert not (free and sys._is_gil_enabled()), "kreisel has switched the GIL on"
    python = sys.version.split()[0] + ("t" if free else "")
    print(f"the wheel works: Python {python} on {sysconfig.get_platform()}, kernel {kernel}")


main()
