"""Which tests use which lines of the package, and how long they take.

Each test module is measured by itself, with the test that runs as the context of coverage. What is
known is kept beside the copies, as long as the module and all that it may use stay the same.
"""

import hashlib
import json
import os
import shutil
import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from coverage import CoverageData

from .sandbox import TrialError, run_limited

PLUGIN = Path(__file__).with_name("pytest_contexts.py")
SET_UP = ""  # the context of what runs outside of a test: import, fixtures, other processes


@dataclass(frozen=True)
class ModuleUsage:
    """What a test module uses."""

    module: str
    text: str  # a digest
    seconds: float
    tests: dict  # of each, how long it takes [s]
    lines: dict  # of each source, for each context the lines

    @cached_property
    def line_counts(self):
        """Of each test, how many lines it uses."""
        files = self.lines.values()
        return {test: sum(len(of.get(test, ())) for of in files) for test in self.tests}

    def rank_tests(self, file, lines):
        """The tests that use one of some lines themselves, each with what it costs to ask it: a
        test of few lines looks at these more closely."""
        of = self.lines.get(file, {})
        asked = [test for test in self.tests if not lines.isdisjoint(of.get(test, ()))]
        return [
            (self.tests[test] * self.line_counts[test], self.tests[test], test) for test in asked
        ]

    def is_used_in_setup(self, file, lines):
        return not lines.isdisjoint(self.lines.get(file, {}).get(SET_UP, ()))


def measure_usage(root, modules, folder):
    """What each test module uses, as many measured at once as there are processors."""
    folder.mkdir(parents=True, exist_ok=True)
    shutil.copy(PLUGIN, root / "site")
    texts = compute_digests(root, modules)

    def load_or_measure(module):
        file = folder / f"{module.replace('/', '-')}.json"
        found = json.loads(file.read_text()) if file.exists() else {}
        if found.get("text") != texts[module]:
            found = measure_module(root, module) | {"text": texts[module]}
            file.write_text(json.dumps(found))
        return ModuleUsage(**found)

    with ThreadPoolExecutor(len(os.sched_getaffinity(0))) as pool:
        return list(pool.map(load_or_measure, modules))


def compute_digests(root, modules):
    """What stands, for each test module, for its text and those of all that it may use."""
    files = [file for name in ("python", "tests") for file in sorted((root / name).rglob("*.py"))]
    shared = [file for file in files if not file.name.startswith("test_")]
    common = hashlib.sha256(b"".join(file.read_bytes() for file in shared)).digest()
    return {
        module: hashlib.sha256(common + (root / module).read_bytes()).hexdigest()
        for module in modules
    }


def measure_module(root, module):
    data = root / "used" / module.replace("/", "-")
    data.mkdir(parents=True)
    where = f"--data-file={data / 'data'}"
    coverage = [sys.executable, "-m", "coverage"]
    how = ("-x", "-q", "-p", "no:cacheprovider", "-p", PLUGIN.stem)
    tests = ["-m", "pytest", *how, "--times-of-tests", data / "times.json", module]
    done = run_limited([*coverage, "run", "--source=python", where, *tests], root, 900, 3600)
    if done.status:
        raise TrialError(f"{module} fails with nothing changed: {done.said[-500:]}")
    run_limited([*coverage, "combine", "-q", where, data], root, 300, 900)
    return {
        "module": module,
        "seconds": done.seconds,
        "tests": json.loads((data / "times.json").read_text()),
        "lines": read_lines(data / "data", root),
    }


def read_lines(file, root):
    """Of each source, for each context the lines that it uses."""
    data = CoverageData(str(file))
    data.read()
    found = {}
    for source in data.measured_files():
        of = found.setdefault(Path(source).relative_to(root).as_posix(), {})
        for line, contexts in data.contexts_by_lineno(source).items():
            for context in contexts:
                of.setdefault(context, []).append(line)
    return found
