"""Mutants of the package: tried first by the test modules that use the changed line, the quickest
first, then by all others, but those in a browser."""

import hashlib
import json
import marshal
import shutil
import sys
from time import monotonic

from . import of_python
from .tree import Refused, Verdict, copied, pytest, run

FOLDERS = ("python", "report", "house")  # of tests; those of the page want a browser
SLOW = ("test_report.py", "test_thesis.py", "test_atlas.py", "test_house.py", "test_install.py")
ELSEWHERE = (
    "test_style.py",
    "test_floors.py",
    "test_golden.py",
    "test_recipes.py",
    "test_parts.py",
    "test_readme_pictures.py",
)
SLACK = 10  # times what the modules take when nothing is changed


def sources(root, only=""):
    files = sorted((root / "python").rglob("*.py"))
    names = [file.relative_to(root).as_posix() for file in files]
    return [name for name in names if name.startswith(only) and "viewer" not in name]


def mutants(root, only=""):
    return [
        mutant
        for name in sources(root, only)
        for mutant in of_python.mutants(name, (root / name).read_text())
    ]


def modules(root):
    """The test modules that may kill: no laws of form, which see a change, not its effect."""
    files = [file for name in FOLDERS for file in sorted((root / "tests" / name).glob("test_*.py"))]
    kept = [file for file in files if file.name not in SLOW + ELSEWHERE]
    return [file.relative_to(root).as_posix() for file in kept]


class Trial:
    """The package in a copy of the tree, and which test modules use which lines."""

    def __init__(self, root, to):
        self.root = copied(root, to)
        for file in (root / "python").glob("*/_core*.so"):
            shutil.copy(file, self.root / file.relative_to(root))
        self.put_core()
        self.uses = self.all_used(to.with_name("uses.json"))

    def put_core(self):
        """The extension of the package that runs this program, where there is one."""
        try:
            from kreisel import _core
        except ImportError:
            return
        folder = self.root / "python/kreisel"
        if folder.is_dir():
            shutil.copy(_core.__file__, folder)

    def all_used(self, file):
        """What each test module uses; known from before, where it and what it may use are the
        same."""
        known, names = json.loads(file.read_text()) if file.exists() else {}, modules(self.root)
        texts = digests(self.root, names)
        for name in names:
            if known.get(name, {}).get("text") != texts[name]:
                known[name] = {"text": texts[name], **self.used(name)}
                file.write_text(json.dumps(known))
        return {name: known[name] for name in names}

    def used(self, module):
        """Runs a test module; gives the lines of each source that it uses, and how long it took."""
        how = ["-m", "coverage", "run", "--source=python", "--data-file=used", "-m"]
        tests = ["pytest", "-x", "-q", "-p", "no:cacheprovider", module]
        done = run([sys.executable, *how, *tests], self.root, 900, 3600)
        if done.status:
            raise Refused(f"{module} fails with nothing changed: {done.said[-500:]}")
        told = ["-m", "coverage", "json", "--data-file=used", "-q", "-o", "used.json"]
        run([sys.executable, *told], self.root, 300, 900)
        files = json.loads((self.root / "used.json").read_text())["files"]
        lines = {name: file["executed_lines"] for name, file in files.items()}
        return {"seconds": done.seconds, "lines": lines}

    def verdict(self, mutant):
        """Tries a mutant."""
        begin = monotonic()
        if code(mutant.text) == code(self.changed(mutant)):
            return Verdict("same")
        first = self.first(mutant)
        rest = [name for name in self.by_time() if name not in first]
        mutant.write(self.root)
        try:
            word, by = self.judged(first, rest)
        finally:
            mutant.undo(self.root)
        return Verdict(word, by, monotonic() - begin)

    def changed(self, mutant):
        return mutant.text[: mutant.begin] + mutant.new + mutant.text[mutant.end :]

    def by_time(self):
        return sorted(self.uses, key=lambda name: self.uses[name]["seconds"])

    def first(self, mutant):
        """The modules that use the line inside a function; none where it runs at import."""
        if mutant.line in of_python.runs_at_import(mutant.text):
            return []
        lines = (self.uses[name]["lines"] for name in self.by_time())
        return [
            name
            for name, of in zip(self.by_time(), lines, strict=True)
            if mutant.line in of.get(mutant.file, ())
        ]

    def judged(self, first, rest):
        for names in filter(None, (first, rest)):
            seconds = int(SLACK * sum(self.uses[name]["seconds"] for name in names)) + 60
            done, test = pytest(self.root, names, seconds, seconds)
            if done.status:
                return "killed", test
        return "survived", ""


def digests(root, names):
    """What stands, for each test module, for its text and those of all that it may use."""
    files = [file for name in ("python", "tests") for file in sorted((root / name).rglob("*.py"))]
    shared = [file for file in files if not file.name.startswith("test_")]
    common = hashlib.sha256(b"".join(file.read_bytes() for file in shared)).digest()
    return {n: hashlib.sha256(common + (root / n).read_bytes()).hexdigest() for n in names}


def code(text):
    """What a source compiles to, without the columns of its parts."""
    try:
        made = compile(text, "source", "exec")
    except SyntaxError:
        return text.encode()
    return marshal.dumps(stripped(made))


def stripped(made):
    parts = tuple(stripped(c) if hasattr(c, "co_code") else c for c in made.co_consts)
    return made.replace(co_linetable=b"", co_consts=parts, co_exceptiontable=b"")
