"""Mutants of the core: built as users without a newer instruction set have it, tried by the C
tests, the quickest first, by these once more under sanitizers, then by those in Python.

Only what includes the changed file is compiled again.
"""

import os
import subprocess
import sys
import sysconfig
from dataclasses import replace
from time import monotonic

from . import mutate_c
from .sandbox import MEMORY, Refused, Verdict, copied, pytest, run

FLAGS = (
    *("-std=c99", "-O1", "-fPIC", "-ffp-contract=off", "-fno-math-errno", "-Icsrc"),
    *("-Werror=incompatible-pointer-types", "-Werror=int-conversion"),
)
SANITIZERS = (
    *("-fsanitize=address,undefined,float-cast-overflow", "-fno-sanitize-recover=all"),
    "-fno-omit-frame-pointer",
)
FUZZ = ("1", "20000")  # the seed, and how many rounds
GOLDEN = "golden", "kernels", "snapshot"  # programs whose output is expected in a file beside them
LINKED = {"test_allocation_failure": ("-Wl,--wrap=calloc",)}  # as CMakeLists.txt does
SLACK = 10  # times what the test takes of a processor when nothing is changed
# What tells the time or asks a signal for it may fail on a busy machine without being wrong.
UNSURE = ("tests/python/test_interruption.py",)


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
    return [mutant for name in kept for mutant in mutate_c.mutants(name, (root / name).read_text())]


class Trial:
    """The core in a copy of the tree, compiled, and its tests."""

    def __init__(self, root, to):
        self.root = copied(root, to)
        self.core = sources(self.root)
        self.programs = programs(self.root)
        files = sorted({*self.core, *(f for files in self.programs.values() for f in files)})
        self.uses = {file: self.compiled(file, "base") for file in files}
        for file in files:
            self.compiled(file, "base", SANITIZERS)
        self.limits = {how: self.unchanged(how) for how in ((), SANITIZERS)}
        self.binding = binding(self.root)
        word, test = self.by_python(set()) if self.binding else ("survived", "")
        if word == "killed":
            raise Refused(f"{test} fails with nothing changed")

    def unchanged(self, how):
        """How long each test takes with nothing changed [s], the quickest first."""
        seconds = {}
        for name in self.programs:
            done = self.tried(name, {}, 600, how)
            if done.status:
                raise Refused(f"{name} fails with nothing changed: {done.said[-500:]}")
            seconds[name] = done.seconds
        return dict(sorted(seconds.items(), key=lambda item: item[1]))

    def object(self, file, folder, how=()):
        kind = "checked" if how else "plain"
        return self.root / "objects" / kind / folder / (file.replace("/", "_") + ".o")

    def compiled(self, file, folder, how=()):
        """Compiles a source; gives the files that it uses, or None where it does not compile."""
        to = self.object(file, folder, how)
        to.parent.mkdir(parents=True, exist_ok=True)
        command = ["gcc", *FLAGS, *how, "-MMD", "-MF", to.with_suffix(".d"), "-c", file, "-o", to]
        if run(command, self.root, 300, 900).status:
            return None
        names = to.with_suffix(".d").read_text().replace("\\\n", " ").split()[1:]
        return {os.path.normpath(name) for name in names}

    def linked(self, files, changed, to, *command, how=()):
        objects = [self.object(f, "changed" if f in changed else "base", how) for f in files]
        done = run([*command, *how, *objects, "-lm", "-o", to], self.root, 300, 900)
        if done.status:
            raise Refused(done.said)

    def tried(self, name, changed, seconds, how=()):
        """Links a test with the core, and runs it."""
        program = self.root / "objects" / name
        command = ("gcc", *LINKED.get(name, ()))
        self.linked([*self.core, *self.programs[name]], changed, program, *command, how=how)
        words = [program, *(FUZZ if name == "fuzz" else ())]
        memory = None if how else MEMORY  # sanitizers ask for more than any machine has
        done = run(words, self.root, seconds, 20 * seconds, memory)
        is_wrong = name in GOLDEN and not done.status and not self.is_golden(name, done.said)
        return replace(done, status=1) if is_wrong else done

    def is_golden(self, name, said):
        golden = (self.root / f"tests/c/{name}.txt").read_text().splitlines()
        if name == "kernels":  # it says first which instruction set, then how that rounds
            lines = [line.split(maxsplit=1)[1] for line in said.splitlines()]
            return lines == [line for line in golden if line.split()[0] == lines[0].split()[0]]
        return said.splitlines() == golden

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
        if test := self.by_c(changed, ()):
            return "killed", test
        for file in changed:
            self.compiled(file, "changed", SANITIZERS)
        if test := self.by_c(changed, SANITIZERS):
            return "killed", f"{test}, sanitized"
        return self.by_python(changed) if self.binding else ("survived", "")

    def by_c(self, changed, how):
        """The C test that fails, if one does."""
        for name, seconds in self.limits[how].items():
            feels = changed & {*self.core, *self.programs[name]}
            if feels and self.tried(name, changed, int(SLACK * seconds) + 5, how).status:
                return name
        return ""

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
    tests = {file.stem: [file] for file in sorted((root / "tests/c").glob("test_*.c"))}
    for name in GOLDEN:
        if (root / f"tests/c/{name}.txt").exists():
            tests[name] = [root / f"tests/c/{name}.c"]
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
