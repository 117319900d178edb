"""Mutation tests of the Python package.

Only tests that the changed line may affect are run, beginning with those that execute few lines.
Tests that need a browser are not run.
"""

import marshal
import shutil
from time import monotonic

from . import mutate_python
from .line_usage import measure_usage
from .sandbox import Verdict, copy_tree, run_pytest

FOLDERS = ("python", "report", "repo")  # tests/viewer is left out, because it needs a browser
SLOW = ("test_report.py", "test_thesis.py", "test_atlas.py", "test_house.py", "test_install.py")
# Tests of the source text, of the C library alone, and of products that a copy lacks.
ELSEWHERE = (
    "test_abi.py",
    "test_amalgamation.py",
    "test_build_options.py",
    "test_embedding.py",
    "test_embedding_examples.py",
    "test_golden.py",
    "test_language.py",
    "test_layers.py",
    "test_mutate.py",
    "test_parts.py",
    "test_readme_pictures.py",
    "test_recipes.py",
    "test_site_pages.py",
    "test_sizes.py",
    "test_style.py",
    "test_supply.py",
)
SLACK = 5  # time limit, as a multiple of the time without a mutation under line tracing
MOST_FIRST = 40  # number of the tests that run first


def list_sources(root, prefix=""):
    files = sorted((root / "python").rglob("*.py"))
    names = [file.relative_to(root).as_posix() for file in files]
    return [name for name in names if name.startswith(prefix) and "viewer" not in name]


def list_mutants(root, prefix=""):
    return [
        mutant
        for name in list_sources(root, prefix)
        for mutant in mutate_python.list_mutants(name, (root / name).read_text())
    ]


def list_test_modules(root):
    """Return all test modules that are used in mutation testing.

    Slow tests are excluded, and tests that do not check the behaviour of the Python package.
    """
    files = [file for name in FOLDERS for file in sorted((root / "tests" / name).glob("test_*.py"))]
    modules = [file for file in files if file.name not in SLOW + ELSEWHERE]
    return [file.relative_to(root).as_posix() for file in modules]


class Trial:
    """A copy of the source tree in which tests are run on mutants."""

    def __init__(self, root, folder):
        self.root = copy_tree(root, folder)
        for file in (root / "python").glob("*/_core*.so"):
            shutil.copy(file, self.root / file.relative_to(root))
        self.copy_core()
        self.uses = measure_usage(self.root, list_test_modules(self.root), folder.with_name("uses"))

    def copy_core(self):
        """Copy the compiled extension module of the installed package, if it exists."""
        try:
            from kreisel import _core
        except ImportError:
            return
        folder = self.root / "python/kreisel"
        if folder.is_dir():
            shutil.copy(_core.__file__, folder)

    def try_mutant(self, mutant):
        """Run the tests on a mutant, and return the verdict."""
        begin = monotonic()
        if compile_code(mutant.text) == compile_code(self.apply_mutant(mutant)):
            return Verdict("same")
        groups = self.select_tests(mutant)
        mutant.write(self.root)
        try:
            word, test = self.run_tests(groups)
        finally:
            mutant.undo(self.root)
        return Verdict(word, test, monotonic() - begin)

    def apply_mutant(self, mutant):
        return mutant.text[: mutant.begin] + mutant.new + mutant.text[mutant.end :]

    def select_tests(self, mutant):
        """Return the tests that may detect a mutant, in two groups.

        The first group, which runs first, contains the tests that execute the fewest lines of code.
        """
        lines, at_import = {mutant.line}, mutate_python.lines_run_at_import(mutant.text)
        if is_general := mutant.line in at_import:  # every test that uses the file may be affected
            lines = set(range(1, mutant.text.count("\n") + 2)) - at_import
        tests = sorted(t for uses in self.uses for t in uses.rank_tests(mutant.file, lines))
        # sorts the later tests by module, so that each module is set up once
        later = sorted((module, test) for _, module, test in tests[MOST_FIRST:])
        setups = [
            (uses.module, uses.module)
            for uses in self.uses
            if is_general or uses.is_used_in_setup(mutant.file, lines)
        ]
        first = {test: module for _, module, test in tests[:MOST_FIRST]}
        return first, {test: module for module, test in later + setups}

    def run_tests(self, groups):
        seconds = {uses.module: uses.seconds for uses in self.uses}
        for tests in filter(None, groups):
            limit = int(SLACK * sum(seconds[module] for module in {*tests.values()})) + 60
            result, test = run_pytest(self.root, tests, limit, limit)
            if result.status:
                return "killed", test
        return "survived", ""


def compile_code(text):
    """Compile a Python source to bytecode without line numbers."""
    try:
        code = compile(text, "source", "exec")
    except SyntaxError:
        return text.encode()
    return marshal.dumps(strip_positions(code))


def strip_positions(code):
    parts = tuple(strip_positions(c) if hasattr(c, "co_code") else c for c in code.co_consts)
    return code.replace(co_linetable=b"", co_consts=parts, co_exceptiontable=b"")
