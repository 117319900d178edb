"""Mutants of the core: built as users without a newer instruction set have it, tried by the C
tests, the quickest first, then by those in Python.

Only what includes the changed file is compiled again.
"""

import os
import subprocess
import sys
import sysconfig
from dataclasses import replace
from time import monotonic

from . import of_c
from .tree import Refused, Verdict, copied, pytest, run

FLAGS = (
    *("-std=c99", "-O1", "-fPIC", "-ffp-contract=off", "-fno-math-errno", "-Icsrc"),
    *("-Werror=incompatible-pointer-types", "-Werror=int-conversion"),
)
FUZZ = ("1", "20000")  # the seed, and how many rounds
LINKED = {"test_memory": ("-Wl,--wrap=calloc",)}  # as CMakeLists.txt does
SLACK = 10  # times what the test takes of a processor when nothing is changed
# What tells the time or asks a signal for it may fail on a busy machine without being wrong.
UNSURE = ("tests/python/test_stopping.py",)


def sources(root):
    files = sorted((root / "csrc").rglob("*.c"))
    kept = (file for file in files if file.parent.name != "gsl" and file.name != "wasm.c")
    return [file.relative_to(root).as_posix() for file in kept]


def mutants(root, only=""):
    """All mutants of what is compiled; the public header declares, and is left alone."""
    folder = root / "csrc"
    files = [file for file in sorted(folder.rglob("*.[ch]")) if file != folder / "kreisel.h"]
    names = [file.relative_to(root).as_posix() for file in files if file.parent.name != "gsl"]
    kept = [name for name in names if name.startswith(only) and not name.endswith("wasm.c")]
    return [mutant for name in kept for mutant in of_c.mutants(name, (root / name).read_text())]


class Trial:
    """The core in a copy of the tree, compiled, and its tests."""

    def __init__(self, root, to):
        self.root = copied(root, to)
        self.core = sources(self.root)
        self.programs = programs(self.root)
        used = {file for files in self.programs.values() for file in files}
        self.uses = {file: self.compiled(file, "base") for file in [*self.core, *sorted(used)]}
        self.limits = {}
        for name in self.programs:
            done = self.tried(name, {}, 600)
            if done.status:
                raise Refused(f"{name} fails with nothing changed: {done.said[-500:]}")
            self.limits[name] = done.seconds
        self.quickest = sorted(self.limits, key=self.limits.get)
        self.binding = binding(self.root)
        word, test = self.by_python(set()) if self.binding else ("survived", "")
        if word == "killed":
            raise Refused(f"{test} fails with nothing changed")

    def object(self, file, folder):
        return self.root / "objects" / folder / (file.replace("/", "_") + ".o")

    def compiled(self, file, folder):
        """Compiles a source; gives the files that it uses, or None where it does not compile."""
        to = self.object(file, folder)
        to.parent.mkdir(parents=True, exist_ok=True)
        command = ["gcc", *FLAGS, "-MMD", "-MF", to.with_suffix(".d"), "-c", file, "-o", to]
        if run(command, self.root, 300, 900).status:
            return None
        names = to.with_suffix(".d").read_text().replace("\\\n", " ").split()[1:]
        return {os.path.normpath(name) for name in names}

    def linked(self, files, changed, to, *how):
        objects = [self.object(f, "changed" if f in changed else "base") for f in files]
        done = run([*how, *objects, "-lm", "-o", to], self.root, 300, 900)
        if done.status:
            raise Refused(done.said)

    def tried(self, name, changed, seconds):
        """Links a test with the core, and runs it."""
        program = self.root / "objects" / name
        how = ("gcc", *LINKED.get(name, ()))
        self.linked([*self.core, *self.programs[name]], changed, program, *how)
        done = run([program, *(FUZZ if name == "fuzz" else ())], self.root, seconds, 20 * seconds)
        golden = self.root / "tests/core/golden.txt"
        is_wrong = name == "golden" and done.said != golden.read_text()
        return replace(done, status=1) if is_wrong else done

    def verdict(self, mutant):
        """Tries a mutant."""
        begin = monotonic()
        mutant.write(self.root)
        try:
            word, by = self.judged(mutant)
        except Refused:
            word, by = "unbuilt", "it does not link"
        finally:
            mutant.undo(self.root)
        return Verdict(word, by, monotonic() - begin)

    def judged(self, mutant):
        touched = [file for file, uses in self.uses.items() if mutant.file in uses]
        if not touched:
            return "same", "nothing is compiled of it"
        if not all(self.compiled(file, "changed") for file in touched):
            return "unbuilt", ""
        changed = {file for file in touched if self.differs(file)}
        if not changed:
            return "same", ""
        for name in self.quickest:
            if changed & {*self.core, *self.programs[name]}:
                most = int(SLACK * self.limits[name]) + 5
                if self.tried(name, changed, most).status:
                    return "killed", name
        return self.by_python(changed) if self.binding else ("survived", "")

    def differs(self, file):
        objects = (self.object(file, folder).read_bytes() for folder in ("base", "changed"))
        return len(set(objects)) == 2

    def by_python(self, changed):
        to = self.root / "python/kreisel" / ("_core" + sysconfig.get_config_var("EXT_SUFFIX"))
        self.linked(self.core, changed, to, "g++", "-shared", *self.binding)
        done, test = pytest(self.root, ["tests/python", *(f"--ignore={name}" for name in UNSURE)])
        return ("killed", test) if done.status else ("survived", "")


def programs(root):
    """For each program of the C tests its sources."""
    tests = {file.stem: [file] for file in sorted((root / "tests/core").glob("test_*.c"))}
    if (root / "tests/core/golden.txt").exists():
        tests["golden"] = [root / "tests/core/golden.c"]
    if fuzz := sorted((root / "tests/fuzz").glob("*.c")):
        tests["fuzz"] = fuzz
    return {
        name: [file.relative_to(root).as_posix() for file in files] for name, files in tests.items()
    }


def binding(root):
    """Compiles the binding once: it sees the public header alone. Gives its objects, if there is
    one."""
    files = sorted((root / "python").glob("*.cpp"))
    if not files:
        return []
    told = subprocess.run(
        [sys.executable, "-m", "pybind11", "--includes"], capture_output=True, text=True, check=True
    )
    flags = ["-std=c++17", "-O1", "-fPIC", "-fvisibility=hidden", "-w", "-Icsrc"]
    objects = []
    for file in files:
        objects.append(root / "objects" / f"{file.stem}.o")
        command = ["g++", *flags, *told.stdout.split(), "-c", file, "-o", objects[-1]]
        done = run(command, root, 600, 1800)
        if done.status:
            raise Refused(done.said)
    return objects
