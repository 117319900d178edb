"""Mutation tests of the C library, compiled for the baseline instruction set.

The C tests run first, then the C tests under sanitizers, and finally the Python tests. Only files
that depend on the mutated file are recompiled.
"""

import os
import subprocess
import sys
import sysconfig
from dataclasses import replace
from time import monotonic

from . import mutate_c
from .sandbox import MEMORY, TrialError, Verdict, copy_tree, run_pytest, run_with_limits

FLAGS = (
    *("-std=c99", "-O1", "-fPIC", "-ffp-contract=off", "-fno-math-errno", "-Icsrc"),
    *("-Werror=incompatible-pointer-types", "-Werror=int-conversion"),
)
SANITIZERS = (
    *("-fsanitize=address,undefined,float-cast-overflow", "-fno-sanitize-recover=all"),
    "-fno-omit-frame-pointer",
)
FUZZ = ("1", "20000")  # the seed and the number of rounds
GOLDEN = "golden", "kernels", "snapshot"  # programs whose expected output is stored in a file
LINKED = {"test_allocation_failure": ("-Wl,--wrap=calloc",)}  # as in CMakeLists.txt
SLACK = 10  # limit of the processor time, as a multiple of the elapsed time without a mutation
# Tests that depend on time or signals may fail on a busy machine.
UNSURE = ("tests/python/test_interruption.py",)


def list_sources(root):
    files = sorted((root / "csrc").rglob("*.c"))
    sources = (file for file in files if file.parent.name != "gsl" and file.name != "wasm.c")
    return [file.relative_to(root).as_posix() for file in sources]


def list_mutants(root, prefix=""):
    """Return the mutants of all C files except the public header, GSL and WebAssembly files.

    The public header contains only declarations.
    """
    folder = root / "csrc"
    files = [file for file in sorted(folder.rglob("*.[ch]")) if file != folder / "kreisel.h"]
    names = [file.relative_to(root).as_posix() for file in files if file.parent.name != "gsl"]
    sources = [name for name in names if name.startswith(prefix) and not name.endswith("wasm.c")]
    return [
        mutant
        for name in sources
        for mutant in mutate_c.list_mutants(name, (root / name).read_text())
    ]


class Trial:
    """A copy of the source tree in which the C tests can be compiled."""

    def __init__(self, root, folder):
        self.root = copy_tree(root, folder)
        self.core = list_sources(self.root)
        self.programs = list_programs(self.root)
        files = sorted({*self.core, *(f for files in self.programs.values() for f in files)})
        self.uses = {file: self.compile_file(file, "base") for file in files}
        for file in files:
            self.compile_file(file, "base", SANITIZERS)
        self.limits = {
            sanitizers: self.time_baseline(sanitizers) for sanitizers in ((), SANITIZERS)
        }
        self.binding = compile_binding(self.root)
        word, test = self.run_python_tests(set()) if self.binding else ("survived", "")
        if word == "killed":
            raise TrialError(f"{test} fails with nothing changed")

    def time_baseline(self, sanitizers):
        """Return the run time [s] of each test on the unmodified source, in increasing order."""
        seconds = {}
        for name in self.programs:
            result = self.run_program(name, {}, 600, sanitizers)
            if result.status:
                raise TrialError(f"{name} fails with nothing changed: {result.said[-500:]}")
            seconds[name] = result.seconds
        return dict(sorted(seconds.items(), key=lambda item: item[1]))

    def object_path(self, file, folder, sanitizers=()):
        kind = "checked" if sanitizers else "plain"
        return self.root / "objects" / kind / folder / (file.replace("/", "_") + ".o")

    def compile_file(self, file, folder, sanitizers=()):
        """Compile a source file, and return the files on which it depends, or None on failure."""
        object_file = self.object_path(file, folder, sanitizers)
        object_file.parent.mkdir(parents=True, exist_ok=True)
        command = [
            "gcc",
            *FLAGS,
            *sanitizers,
            "-MMD",
            "-MF",
            object_file.with_suffix(".d"),
            "-c",
            file,
            "-o",
            object_file,
        ]
        if run_with_limits(command, self.root, 300, 900).status:
            return None
        names = object_file.with_suffix(".d").read_text().replace("\\\n", " ").split()[1:]
        return {os.path.normpath(name) for name in names}

    def link(self, files, changed_files, output, *command, sanitizers=()):
        objects = [
            self.object_path(f, "changed" if f in changed_files else "base", sanitizers)
            for f in files
        ]
        result = run_with_limits(
            [*command, *sanitizers, *objects, "-lm", "-o", output], self.root, 300, 900
        )
        if result.status:
            raise TrialError(result.said)

    def run_program(self, name, changed_files, seconds, sanitizers=()):
        """Link a test program with the C library, and run the program."""
        program = self.root / "objects" / name
        command = ("gcc", *LINKED.get(name, ()))
        self.link(
            [*self.core, *self.programs[name]],
            changed_files,
            program,
            *command,
            sanitizers=sanitizers,
        )
        words = [program, *(FUZZ if name == "fuzz" else ())]
        memory = None if sanitizers else MEMORY  # sanitizers reserve more memory than the limit
        result = run_with_limits(words, self.root, seconds, 20 * seconds, memory)
        is_wrong = (
            name in GOLDEN and not result.status and not self.has_expected_output(name, result.said)
        )
        return replace(result, status=1) if is_wrong else result

    def has_expected_output(self, name, output):
        golden = (self.root / f"tests/c/{name}.txt").read_text().splitlines()
        if name == "kernels":  # a line begins with the instruction set and its rounding
            lines = [line.split(maxsplit=1)[1] for line in output.splitlines()]
            return lines == [line for line in golden if line.split()[0] == lines[0].split()[0]]
        return output.splitlines() == golden

    def try_mutant(self, mutant):
        """Run the tests on a mutant, and return the verdict."""
        begin = monotonic()
        mutant.write(self.root)
        try:
            word, test = self.run_tests(mutant)
        except TrialError:
            word, test = "unbuilt", "it does not link"
        finally:
            mutant.undo(self.root)
        return Verdict(word, test, monotonic() - begin)

    def run_tests(self, mutant):
        files = [file for file, uses in self.uses.items() if mutant.file in uses]
        if not files:
            return "same", "nothing is compiled of it"
        if not all(self.compile_file(file, "changed") for file in files):
            return "unbuilt", ""
        changed_files = {file for file in files if self.has_new_object(file)}
        if not changed_files:
            return "same", ""
        if test := self.find_failing_c_test(changed_files, ()):
            return "killed", test
        for file in changed_files:
            self.compile_file(file, "changed", SANITIZERS)
        if test := self.find_failing_c_test(changed_files, SANITIZERS):
            return "killed", f"{test}, sanitized"
        return self.run_python_tests(changed_files) if self.binding else ("survived", "")

    def find_failing_c_test(self, changed_files, sanitizers):
        """Return the name of a failing C test, or an empty string."""
        for name, seconds in self.limits[sanitizers].items():
            feels = changed_files & {*self.core, *self.programs[name]}
            if (
                feels
                and self.run_program(
                    name, changed_files, int(SLACK * seconds) + 5, sanitizers
                ).status
            ):
                return name
        return ""

    def has_new_object(self, file):
        objects = (self.object_path(file, folder).read_bytes() for folder in ("base", "changed"))
        return len(set(objects)) == 2

    def run_python_tests(self, changed_files):
        module_file = (
            self.root / "python/kreisel" / ("_core" + sysconfig.get_config_var("EXT_SUFFIX"))
        )
        self.link(self.core, changed_files, module_file, "g++", "-shared", *self.binding)
        result, test = run_pytest(
            self.root, ["tests/python", *(f"--ignore={name}" for name in UNSURE)]
        )
        return ("killed", test) if result.status else ("survived", "")


def list_programs(root):
    """Return a dictionary that maps each C test program to a list of its source files."""
    tests = {file.stem: [file] for file in sorted((root / "tests/c").glob("test_*.c"))}
    for name in GOLDEN:
        if (root / f"tests/c/{name}.txt").exists():
            tests[name] = [root / f"tests/c/{name}.c"]
    if fuzz := sorted((root / "tests/fuzz").glob("*.c")):
        tests["fuzz"] = fuzz
    return {
        name: [file.relative_to(root).as_posix() for file in files] for name, files in tests.items()
    }


def compile_binding(root):
    """Compile the Python binding, and return the object files.

    The object files need not be recompiled for mutants, because they depend only on the public
    header.
    """
    files = sorted((root / "python").glob("*.cpp"))
    if not files:
        return []
    result = subprocess.run(
        [sys.executable, "-m", "pybind11", "--includes"], capture_output=True, text=True, check=True
    )
    flags = ["-std=c++17", "-O1", "-fPIC", "-fvisibility=hidden", "-w", "-Icsrc"]
    objects = []
    for file in files:
        objects.append(root / "objects" / f"{file.stem}.o")
        command = ["g++", *flags, *result.stdout.split(), "-c", file, "-o", objects[-1]]
        done = run_with_limits(command, root, 600, 1800)
        if done.status:
            raise TrialError(done.said)
    return objects
