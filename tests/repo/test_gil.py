"""A test that the extension counts references only while it holds the GIL."""

import shlex
import shutil
import sys
import sysconfig

from toolbox import CSRC, FAST_CXX, ROOT, install_library, need, run

FILES = ("ensemble_results", "events")
# Tests of other processes, which import the installed package.
LEFT_OUT = ("ctrl_c_stops", "executor")
# Makes Python import the package in the folder that its first argument names.
PROGRAM = """
import sys
sys.meta_path = [f for f in sys.meta_path if 'Scikit' not in type(f).__name__]
sys.path.insert(0, sys.argv[1])
import kreisel, pytest
assert kreisel.__file__.startswith(sys.argv[1])
sys.exit(pytest.main(sys.argv[2:]))
"""


def test_references_are_counted_only_with_the_gil(tmp_path):
    """Run tests of threads with an extension in which pybind11 checks that the GIL is held."""
    need("cmake", "gcc", "g++")
    binaries = shutil.ignore_patterns("*.so", "__pycache__")
    package = shutil.copytree(ROOT / "python/kreisel", tmp_path / "kreisel", ignore=binaries)
    extension = package / f"_core{sysconfig.get_config_var('EXT_SUFFIX')}"
    flags = shlex.split(run(sys.executable, "-m", "pybind11", "--includes"))
    flags += [f"-I{CSRC}", "-std=c++17", "-O0", "-fPIC", "-fvisibility=hidden"]
    binding = tmp_path / "binding.o"
    run(FAST_CXX, *flags, "-c", ROOT / "python/_core.cpp", "-o", binding)
    library = install_library() / "lib/libkreisel.a"
    run(FAST_CXX, "-shared", binding, library, "-o", extension)
    assert b"PyGILState_Check" in extension.read_bytes()
    words = ["-q", "-x", "-p", "no:cacheprovider", "-k", "not " + " and not ".join(LEFT_OUT)]
    files = [ROOT / f"tests/python/test_{name}.py" for name in FILES]
    run(sys.executable, "-c", PROGRAM, tmp_path, *words, *files)
