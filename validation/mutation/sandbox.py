"""Copies of the source tree, and programs that run in them with limited time and memory."""

import os
import resource
import shutil
import subprocess
import sys
from dataclasses import dataclass
from time import monotonic

LEFT_OUT = ("build", ".*", "node_modules", "__pycache__", "report", "dist", "*.so", "*.egg-info")
MEMORY = 8 << 30  # memory limit of a program [bytes]
# Makes Python import the package of the copy, not the editable install of the environment.
SITE = """import sys
sys.meta_path[:] = [finder for finder in sys.meta_path if "Scikit" not in type(finder).__name__]
"""


class TrialError(Exception):
    """An exception that is raised if tests fail on the unmodified source, or a build fails."""


@dataclass(frozen=True)
class Verdict:
    """The verdict of the tests on a mutant, the name of the failing test, and the run time [s]."""

    word: str
    by: str = ""
    seconds: float = 0.0


@dataclass(frozen=True)
class ProgramResult:
    """The exit status, the output and the run time [s] of a program."""

    status: int | str
    said: str
    seconds: float


def copy_tree(root, folder):
    """Copy the source tree without build products, and return the path of the copy."""
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(root, folder, ignore=make_ignore(root))
    (folder / "site").mkdir()
    (folder / "site/sitecustomize.py").write_text(SITE)
    return folder


def make_ignore(root):
    """Return a filter for shutil.copytree that excludes build products."""
    anywhere = shutil.ignore_patterns("node_modules", "__pycache__", "*.so")
    at_the_top = shutil.ignore_patterns(*LEFT_OUT)

    def list_exclusions(folder, names):
        ignored = (at_the_top if folder == str(root) else anywhere)(folder, names)
        return ignored - {".clang-format", ".ci"}

    return list_exclusions


def run_with_limits(command, cwd, cpu, wall, memory=MEMORY):
    """Run a program with limits on processor time, elapsed time [s] and memory [bytes]."""

    def limit():
        resource.setrlimit(resource.RLIMIT_CPU, (cpu, cpu + 1))
        if memory is not None:
            resource.setrlimit(resource.RLIMIT_AS, (memory, memory))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))

    begin = monotonic()
    options = {
        "stdout": subprocess.PIPE,
        "stderr": subprocess.STDOUT,
        "text": True,
        "errors": "replace",
    }
    words = [str(word) for word in command]
    process = subprocess.Popen(
        words,
        cwd=cwd,
        env=make_environment(cwd),
        preexec_fn=limit,
        start_new_session=True,
        **options,
    )
    try:
        output, _ = process.communicate(timeout=wall)
        status = process.returncode
    except subprocess.TimeoutExpired:
        output, status = "", "no end"
    finally:
        kill_group(process)
    return ProgramResult(status, output, monotonic() - begin)


def kill_group(process):
    """Terminate a program that is still running, and all its child processes."""
    if process.poll() is None:
        os.killpg(process.pid, 9)
        process.communicate()


def make_environment(root):
    paths = {"PYTHONPATH": f"{root / 'site'}:{root / 'python'}", "PYTHONDONTWRITEBYTECODE": "1"}
    return os.environ | paths | {"MPLBACKEND": "agg"}


def run_pytest(root, words, cpu=600, wall=1800):
    """Run tests until one fails. Returns the result of pytest and the name of the failing test."""
    options = ("-x", "-q", "-p", "no:cacheprovider", "--no-header", "--tb=no", "-rfE")
    result = run_with_limits([sys.executable, "-m", "pytest", *options, *words], root, cpu, wall)
    failures = [
        line.split()[1] for line in result.said.splitlines() if line.startswith(("FAILED", "ERROR"))
    ]
    return result, failures[0] if failures else str(result.status)
