"""A report on branches of the code that no test executes.

Usage: `python -m validation.mutation.coverage core|package`.

core     csrc, by the tests in C and some in Python that need no browser; code compiled for several
         orders and instruction sets counts once, and lines with a comment "untaken: reason" do not
         count
package  python/kreisel, by most tests in Python and in a browser
"""

import argparse
import os
import shutil
import subprocess
import sys
from pathlib import Path

from .sandbox import copy_tree, make_environment

ROOT = Path(__file__).parents[2]
WITHOUT_BROWSER = ("tests/python", "tests/report/test_references.py", "tests/report/test_errata.py")
OF_PACKAGE = ("tests/python", "tests/report", "tests/viewer")

C_FLAGS = "--coverage -fprofile-update=atomic -O0 -w -DKR_ROLLED -Dalways_inline=noinline"
UNTAKEN = r".*/\* untaken: \w.*"
FUZZ = ("1", "10000")  # the seed and the number of rounds
ON_ALL_PROCESSORS = ("--numprocesses", "auto", "--dist", "worksteal")


def make_parser():
    parser = argparse.ArgumentParser(
        prog="python -m validation.mutation.coverage", description=__doc__
    )
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.add_argument("side", choices=SIDES)
    default = f"core: {' '.join(WITHOUT_BROWSER)}; package: {' '.join(OF_PACKAGE)}"
    parser.add_argument("tests", nargs="*", help=f"Python tests to run (default: {default})")
    return parser


def main(argv=None):
    options = make_parser().parse_args(argv)
    return SIDES[options.side](options.tests)


def run_command(*command, **options):
    """Run a program without capturing its output, and return its exit status."""
    return subprocess.run([str(word) for word in command], **options).returncode


def measure_core(tests):
    tree = copy_tree(ROOT, ROOT / "build/coverage")
    objects = tree / "objects"
    build_with_counters(tree, objects)
    (extension,) = objects.glob("_core*.so")
    shutil.copy(extension, tree / "python/kreisel")
    quiet = {"stdout": subprocess.DEVNULL}
    jobs = str(len(os.sched_getaffinity(0)))
    ctest = ("ctest", "--test-dir", objects, "--parallel", jobs)
    run_command(*ctest, "--exclude-regex", "^fuzz$", **quiet)
    run_command(objects / "fuzz", *FUZZ, **quiet)  # takes about a minute
    options = {"cwd": tree, "env": make_environment(tree)}
    words = ("-q", "-p", "no:cacheprovider", "--no-header", "--tb=no", "-rfE", *ON_ALL_PROCESSORS)
    run_command(sys.executable, "-m", "pytest", *words, *(tests or WITHOUT_BROWSER), **options)
    return report_branches(tree, objects)


def build_with_counters(tree, objects):
    """Compile the C library with branch counters.

    The library is compiled without optimization, because optimization would merge the branches to
    be counted. The counters are atomic, because some tests use several threads.
    """
    cmake = [sys.executable, "-m", "pybind11", "--cmakedir"]
    pybind11 = subprocess.run(cmake, capture_output=True, text=True, check=True).stdout.strip()
    gsl = run_command("pkg-config", "--exists", "gsl") == 0
    options = [
        *("-DKREISEL_PYTHON=ON", "-DCMAKE_BUILD_TYPE=Debug", f"-DCMAKE_C_FLAGS={C_FLAGS}"),
        *("-DCMAKE_MODULE_LINKER_FLAGS=--coverage", f"-Dpybind11_DIR={pybind11}"),
        *(f"-DPython_EXECUTABLE={sys.executable}", f"-DKREISEL_GSL={'ON' if gsl else 'OFF'}"),
        # the race detector adds branches, and reports the counters as races
        "-DKREISEL_FINDS_RACES=OFF",
    ]
    quiet = {"check": True, "stdout": subprocess.DEVNULL}
    subprocess.run(["cmake", "-S", tree, "-B", objects, *options], **quiet)
    jobs = str(max(1, len(os.sched_getaffinity(0)) // 2))
    subprocess.run(["cmake", "--build", objects, "--parallel", jobs], **quiet)


def report_branches(tree, objects):
    paths = ("--root", tree, "--object-directory", objects, "--filter", f"{tree}/csrc/")
    rules = (
        "--exclude-directories",
        ".*CompilerId.*",
        "--merge-mode-functions",
        "merge-use-line-min",
        "--gcov-ignore-parse-errors",
        "all",
    )
    rules += ("--exclude-branches-by-pattern", UNTAKEN)
    show = ("--txt-metric", "branch", "--txt", "-", "--json", objects / "coverage.json")
    return run_command(sys.executable, "-m", "gcovr", *paths, *rules, *show, objects)


def measure_package(tests):
    data = ROOT / "build/coverage-package"
    shutil.rmtree(data, ignore_errors=True)
    data.mkdir(parents=True)
    options = {"cwd": ROOT, "env": os.environ | {"COVERAGE_FILE": str(data / "data")}}
    run = [sys.executable, "-m", "coverage"]
    words = (
        "pytest",
        "-q",
        "--tb=short",
        *ON_ALL_PROCESSORS,
        *(tests or OF_PACKAGE),
    )
    run_command(*run, "run", "-m", *words, **options)
    run_command(*run, "combine", "-q", **options)
    return run_command(*run, "report", "--show-missing", "--skip-covered", **options)


SIDES = {"core": measure_core, "package": measure_package}

if __name__ == "__main__":
    raise SystemExit(main())
