"""Mutants of the package: tried by the tests that use the changed line, first by those that are
quick and use few others. Those in a browser are not asked."""

import marshal
import shutil
from time import monotonic

from . import mutate_python
from .line_usage import measure_usage
from .sandbox import Verdict, copy_tree, run_pytest

FOLDERS = ("python", "report", "repo")  # of tests; those of the page want a browser
SLOW = ("test_report.py", "test_thesis.py", "test_atlas.py", "test_house.py", "test_install.py")
ELSEWHERE = (
    "test_style.py",
    "test_floors.py",
    "test_golden.py",
    "test_mutate.py",
    "test_recipes.py",
    "test_parts.py",
    "test_readme_pictures.py",
)
SLACK = 5  # times what the tests take when nothing is changed, measured line by line
MOST_FIRST, FIRST_SECONDS = 40, 20.0  # tests that are asked before all others


def list_sources(root, only=""):
    files = sorted((root / "python").rglob("*.py"))
    names = [file.relative_to(root).as_posix() for file in files]
    return [name for name in names if name.startswith(only) and "viewer" not in name]


def list_mutants(root, only=""):
    return [
        mutant
        for name in list_sources(root, only)
        for mutant in mutate_python.list_mutants(name, (root / name).read_text())
    ]


def list_test_modules(root):
    """The test modules that may kill: no laws of form, which see a change, not its effect."""
    files = [file for name in FOLDERS for file in sorted((root / "tests" / name).glob("test_*.py"))]
    kept = [file for file in files if file.name not in SLOW + ELSEWHERE]
    return [file.relative_to(root).as_posix() for file in kept]


class Trial:
    """The package in a copy of the tree, and which tests use which lines."""

    def __init__(self, root, to):
        self.root = copy_tree(root, to)
        for file in (root / "python").glob("*/_core*.so"):
            shutil.copy(file, self.root / file.relative_to(root))
        self.copy_core()
        self.uses = measure_usage(self.root, list_test_modules(self.root), to.with_name("uses"))

    def copy_core(self):
        """The extension of the package that runs this program, where there is one."""
        try:
            from kreisel import _core
        except ImportError:
            return
        folder = self.root / "python/kreisel"
        if folder.is_dir():
            shutil.copy(_core.__file__, folder)

    def try_mutant(self, mutant):
        """Tries a mutant."""
        begin = monotonic()
        if compile_code(mutant.text) == compile_code(self.mutated_text(mutant)):
            return Verdict("same")
        asked = self.select_tests(mutant)
        mutant.write(self.root)
        try:
            word, by = self.run_tests(asked)
        finally:
            mutant.undo(self.root)
        return Verdict(word, by, monotonic() - begin)

    def mutated_text(self, mutant):
        return mutant.text[: mutant.begin] + mutant.new + mutant.text[mutant.end :]

    def select_tests(self, mutant):
        """The tests that may kill, a few good ones and then all others: with their times [s]."""
        lines, at_import = {mutant.line}, mutate_python.lines_run_at_import(mutant.text)
        if is_general := mutant.line in at_import:  # all that uses the file may feel it
            lines = set(range(1, mutant.text.count("\n") + 2)) - at_import
        tests = sorted(t for uses in self.uses for t in uses.rank_tests(mutant.file, lines))
        first, seconds = [], 0.0
        for _, took, test in tests[:MOST_FIRST]:
            seconds += took
            if first and seconds > FIRST_SECONDS:
                break
            first.append((took, test))
        later = [(took, test) for _, took, test in tests[len(first) :]]
        of_module = {uses.module: uses.seconds for uses in self.uses}
        later.sort(key=lambda row: of_module[row[1].partition("::")[0]])  # set-up is dear: once
        around = sorted(
            (uses.seconds, uses.module)
            for uses in self.uses
            if is_general or uses.is_used_in_setup(mutant.file, lines)
        )
        return first, later + around

    def run_tests(self, asked):
        for rows in filter(None, asked):
            seconds = int(SLACK * sum(took for took, _ in rows)) + 60
            done, test = run_pytest(self.root, [name for _, name in rows], seconds, seconds)
            if done.status:
                return "killed", test
        return "survived", ""


def compile_code(text):
    """What a source compiles to, without the columns of its parts."""
    try:
        made = compile(text, "source", "exec")
    except SyntaxError:
        return text.encode()
    return marshal.dumps(strip_positions(made))


def strip_positions(made):
    parts = tuple(strip_positions(c) if hasattr(c, "co_code") else c for c in made.co_consts)
    return made.replace(co_linetable=b"", co_consts=parts, co_exceptiontable=b"")
