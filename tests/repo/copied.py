"""A copy of the repository in which tests apply the recipes of ARCHITECTURE.md."""

import os
import platform
import shutil
import subprocess
import sys

from toolbox import ROOT, run

APART = [  # makes Python import the package of the copy, and not the one that runs these tests
    "import sys",
    "sys.meta_path = [f for f in sys.meta_path if 'Scikit' not in type(f).__name__]",
    "sys.path[:0] = sys.argv[1:]",
]


class House:
    """A copy of the repository, and the files that each recipe of ARCHITECTURE.md changes."""

    def __init__(self, folder):
        self.folder = folder
        self.touched = {}
        command = ["git", "ls-files", "--cached", "--others", "--exclude-standard"]
        names = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout
        for name in names.splitlines():
            if (ROOT / name).is_file():
                (folder / name).parent.mkdir(parents=True, exist_ok=True)
                shutil.copy(ROOT / name, folder / name)

    def write(self, recipe, name, text):
        self.touched.setdefault(recipe, []).append(name)
        (self.folder / name).write_text(text)

    def insert(self, recipe, name, before, text):
        """Insert `text` into a file, before the first line that begins with `before`."""
        old = (self.folder / name).read_text()
        position = old.index("\n" + before) + 1
        self.write(recipe, name, old[:position] + text + old[position:])

    def build(self):
        """Build the C library and the Python extension quickly, without optimization or inlining.

        On x86_64, only code for the base instruction set is compiled. The sources of the extension
        are compiled as a single file, so that the headers of pybind11 are parsed only once.
        """
        self.merge_extension()
        # ccache finds the object files of other clones by paths within the copy only.
        (self.folder / ".venv").symlink_to(sys.prefix)
        cmake = run(self.folder / ".venv/bin/python", "-m", "pybind11", "--cmakedir").strip()
        options = ["-DKREISEL_PYTHON=ON", "-DKREISEL_TESTS=OFF", "-DCMAKE_BUILD_TYPE=Debug"]
        options += [
            "-DCMAKE_C_FLAGS_DEBUG=-O0 -DKR_SMALL",
            "-DCMAKE_CXX_FLAGS_DEBUG=-O0",
        ]  # without -g
        if platform.machine() == "x86_64":
            options.append("-DKREISEL_ISA=sse2")
        paths = [f"-Dpybind11_DIR={cmake}", f"-DPython_EXECUTABLE={sys.executable}"]
        build = self.folder / "build"
        run("cmake", "-S", self.folder, "-B", build, *options, *paths)
        command = ("cmake", "--build", build, "--target", "_core", "--parallel", os.cpu_count())
        run(*command, CCACHE_BASEDIR=str(self.folder))
        (extension,) = build.glob("_core*.so")
        shutil.copy(extension, self.folder / "python/kreisel")

    def merge_extension(self):
        sources = sorted((self.folder / "python").glob("_*.cpp"))
        text = "".join(f'#include "{file.name}"\n' for file in sources)
        (self.folder / "python/whole.cpp").write_text(text)
        with (self.folder / "CMakeLists.txt").open("a") as file:
            file.write("set_property(TARGET _core PROPERTY SOURCES python/whole.cpp)\n")

    def compile(self, program, file):
        """Compile a C program and link it with the C library."""
        library = self.folder / "build/libkreisel.a"
        run("gcc", "-std=c99", f"-I{self.folder / 'csrc'}", program, library, "-lm", "-o", file)

    def python(self, *lines):
        """Run a Python program that imports the copy of the package, and return its output."""
        program = "\n".join([*APART, *lines])
        return run(sys.executable, "-c", program, self.folder / "python", self.folder, cwd="/")


QUANTITY = """Q(height, 1, 0, "",
  "height of the apex above the fixed point, in parts of the lever")
"""
VALUE = """double kr_state_height(const kr_scene *scene, const kr_state *s)
{
    return kr_state_apex(scene, s).z;
}
"""
DERIVATIVE = """static void tangent_of_height(const quantity_point *at, const quantity_change *by,
                              double out[])
{
    double apex[3];
    tangent_of_apex(at, by, apex);
    *out = apex[2];
}
"""


def add_quantity(house):
    """Add the height of the apex as a new quantity to a copy of the source files."""
    house.insert("quantity", "csrc/quantities.def", "Q(kinetic,", QUANTITY)
    house.insert("quantity", "csrc/model/quantities.c", "double kr_state_nutation(", VALUE)
    before = "static void tangent_of_body_velocity("
    house.insert("quantity", "csrc/model/quantity_tangents.c", before, DERIVATIVE)
