"""The lines of the Python package that each test executes.

Each test module is run separately, and the coverage is recorded for each test. The coverage results
are stored beside the copies of the source tree. A test module is run again if its source, a helper
file or the package has changed.
"""

import hashlib
import json
import os
import sys
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from coverage import CoverageData

from .sandbox import TrialError, run_with_limits

SETTINGS = "[run]\nsource = python\npatch = subprocess\ndynamic_context = test_function\n"
SET_UP = ""  # the context of code that runs outside tests: imports, fixtures, other processes


@dataclass(frozen=True)
class ModuleUsage:
    """The lines of the package that one test module executes."""

    module: str
    text: str  # a digest
    seconds: float
    lines: dict  # source -> test, or SET_UP -> lines

    @cached_property
    def line_counts(self):
        """The number of lines that each test executes."""
        counts = Counter()
        for tests in self.lines.values():
            counts.update({test: len(lines) for test, lines in tests.items()})
        return counts

    def rank_tests(self, file, lines):
        """Return (line count, module, test) for each test that executes one of the given lines.

        A test that executes few lines is likely to check each of them thoroughly.
        """
        tests = self.lines.get(file, {}).items()
        names = [test for test, own in tests if test != SET_UP and not lines.isdisjoint(own)]
        return [(self.line_counts[test], self.module, test) for test in names]

    def is_used_in_setup(self, file, lines):
        return not lines.isdisjoint(self.lines.get(file, {}).get(SET_UP, ()))


def measure_usage(root, modules, folder):
    """Run test modules without current results, and return the lines that each module executes."""
    folder.mkdir(parents=True, exist_ok=True)
    (root / "site/coverage.ini").write_text(SETTINGS)
    texts = compute_digests(root, modules)

    def load_or_measure(module):
        file = folder / f"{module.replace('/', '-')}.json"
        data = json.loads(file.read_text()) if file.exists() else {}
        if data.get("text") != texts[module]:
            data = measure_module(root, module) | {"text": texts[module]}
            file.write_text(json.dumps(data))
        return ModuleUsage(**data)

    with ThreadPoolExecutor(len(os.sched_getaffinity(0))) as pool:
        return list(pool.map(load_or_measure, modules))


def compute_digests(root, modules):
    """Return for each test module a hash of its source, the package and all helper files."""
    files = [file for name in ("python", "tests") for file in sorted((root / name).rglob("*.py"))]
    helpers = [file for file in files if not file.name.startswith("test_")]
    common = hashlib.sha256(b"".join(file.read_bytes() for file in helpers)).digest()
    return {
        module: hashlib.sha256(common + (root / module).read_bytes()).hexdigest()
        for module in modules
    }


def measure_module(root, module):
    data = root / "used" / module.replace("/", "-")
    data.mkdir(parents=True)
    data_option = f"--data-file={data / 'data'}"
    coverage = [sys.executable, "-m", "coverage"]
    tests = ["--rcfile=site/coverage.ini", "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider"]
    result = run_with_limits([*coverage, "run", data_option, *tests, module], root, 900, 3600)
    if result.status:
        raise TrialError(f"{module} fails with nothing changed: {result.said[-500:]}")
    run_with_limits([*coverage, "combine", "-q", data_option, data], root, 300, 900)
    return {
        "module": module,
        "seconds": result.seconds,
        "lines": read_lines(data / "data", root, module),
    }


def read_lines(file, root, module):
    """Return the lines of each source file that the tests of a module execute."""
    data = CoverageData(str(file))
    data.read()
    lines = {}
    for source in data.measured_files():
        tests = lines.setdefault(Path(source).relative_to(root).as_posix(), {})
        for line, contexts in data.contexts_by_lineno(source).items():
            for context in contexts:
                name = context.rpartition(".")[2]
                tests.setdefault(f"{module}::{name}" if name else SET_UP, []).append(line)
    return lines
