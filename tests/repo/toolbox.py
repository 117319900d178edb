"""Helper functions for all tests."""

import atexit
import fcntl
import functools
import os
import re
import shlex
import shutil
import subprocess
import sys
import uuid
from contextlib import contextmanager
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
CSRC = ROOT / "csrc"
RUN_ID = os.environ.get("PYTEST_XDIST_TESTRUNUID", uuid.uuid4().hex)  # of all test processes
VERSION = re.search(r'KR_VERSION "(.+)"', (ROOT / "csrc/kreisel.h").read_text())[1]


def run(*command, cwd=ROOT, **environment):
    """Run a command and return its standard output.

    The running test fails if the command exits with an error.
    """
    result = subprocess.run(
        [str(word) for word in command],
        cwd=cwd,
        env=os.environ | environment,
        capture_output=True,
        text=True,
    )
    if result.returncode:
        pytest.fail(f"{' '.join(result.args)}\n{result.stdout}{result.stderr}", pytrace=False)
    return result.stdout


def run_programs(*files, **options):
    """Run Python programs in one process, each with names of its own, and return their output."""
    code = "import runpy, sys\nfor file in sys.argv[1:]: runpy.run_path(file, run_name='__main__')"
    return run(sys.executable, "-W", "error", "-c", code, *files, **options)


HANG = 600  # seconds after which a program is taken to hang, even on a slow and busy machine


@functools.cache
def start_playwright():
    """Start playwright, which can run only once in a process."""
    from playwright.sync_api import sync_playwright

    tool = sync_playwright().start()
    atexit.register(tool.stop)
    return tool


# The C and C++ compilers that are fastest without optimization.
FAST_CC, FAST_CXX = ("clang", "clang++") if shutil.which("clang++") else ("gcc", "g++")


# Features of Chromium that no test needs. Without the two of the address bar, a new window takes a
# third of the time. Most of the others send requests; playwright disables them unless this list is
# given.
UNUSED_FEATURES = (
    *("WebUIOmniboxPopup", "WebUIOmniboxAimPopup", "AimEnabled", "MediaRouter"),
    *("NetworkTimeServiceQuerying", "OptimizationHints", "PaintHolding", "PreconnectToSearch"),
)


def launch_chromium(*options):
    """Launch Debian's Chromium headless. Without it, skip the test, or fail on a CI server."""
    need("chromium")
    return start_playwright().chromium.launch(
        executable_path=shutil.which("chromium"),
        timeout=1000 * HANG,
        args=["--no-sandbox", f"--disable-features={','.join(UNUSED_FEATURES)}", *options],
    )


def open_context(browser, **options):
    """Open a browser context whose actions may take long, as on a busy machine."""
    context = browser.new_context(**options)
    context.set_default_timeout(1000 * HANG)
    return context


# Restores the default handling of Ctrl-C in a program. Tests in the background, started by nohup
# or by a shell, would let the program ignore SIGINT.
HEEDING = "import signal\nsignal.signal(signal.SIGINT, signal.default_int_handler)\n"


def python(code, *words, **options):
    """Run `code` in a separate Python process, and return the completed process."""
    command = [sys.executable, "-c", HEEDING + code, *words]
    return subprocess.run(command, capture_output=True, text=True, timeout=HANG, **options)


def need(*tools):
    """Skip the test if a required program is missing; on a CI server, let the test fail."""
    missing = [tool for tool in tools if not shutil.which(tool)]
    if missing:
        (pytest.fail if os.environ.get("CI") == "true" else pytest.skip)(
            f"needs {', '.join(missing)}"
        )


def need_cargo():
    """Skip the test if cargo is missing. Cargo is too large to be installed by `make test`."""
    if not shutil.which("cargo"):
        pytest.skip("needs cargo")


def need_gsl():
    need("pkg-config")
    if subprocess.run(["pkg-config", "--exists", "gsl"]).returncode:
        (pytest.fail if os.environ.get("CI") == "true" else pytest.skip)("needs GSL")


def core_sources(csrc=CSRC):
    """Return the C sources of the library, except wasm.c and the adapters to GSL."""
    return sorted(
        file for file in csrc.rglob("*.c") if file.parent.name != "gsl" and file.name != "wasm.c"
    )


@contextmanager
def first_process(name):
    """Yield True in the first process of a test run that enters the `with` block, else False.

    All other processes wait until the first process has left the `with` block, even if an exception
    occurs.
    """
    (ROOT / "build").mkdir(exist_ok=True)
    with (ROOT / f"build/{name}.run").open("a+") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        file.seek(0)
        yield file.read() != RUN_ID
        file.truncate(0)
        file.write(RUN_ID)


@functools.cache
def install_library(gsl="OFF"):
    """Install the library as a user would, once per test run, and return its folder."""
    name = "kreisel-build" if gsl == "OFF" else "kreisel-build-with-gsl"
    build, prefix = ROOT / "build" / name, ROOT / f"build/prefix-gsl-{gsl}"
    with first_process(name) as is_first:
        if is_first:
            shutil.rmtree(prefix, ignore_errors=True)
            options = ["-DKREISEL_TESTS=OFF", f"-DKREISEL_GSL={gsl}", "-DCMAKE_INSTALL_LIBDIR=lib"]
            run("cmake", "-S", ROOT, "-B", build, *options)
            run("cmake", "--build", build, "--parallel", os.cpu_count())
            run("cmake", "--install", build, "--prefix", prefix)
    return prefix


def compile_and_run(source, prefix, *options, compiler="gcc", linking="shared", libraries=(), file):
    """Compile a program with the flags of pkg-config, run it, and return its output."""
    need(compiler, "pkg-config")
    static = ["-static"] if linking == "static" else []
    pc = {"PKG_CONFIG_PATH": f"{prefix / 'lib/pkgconfig'}:{os.environ.get('PKG_CONFIG_PATH', '')}"}
    flags = shlex.split(
        run("pkg-config", *("--" + s[1:] for s in static), "--cflags", "--libs", "kreisel", **pc)
    )
    warnings = ["-Wall", "-Wextra", "-Wpedantic", "-Werror"]
    run(
        compiler,
        *options,
        *warnings,
        source,
        *static,
        *flags,
        *libraries,
        f"-Wl,-rpath,{prefix / 'lib'}",
        "-o",
        file,
    )
    return run(file)
