"""A copy of the tree, to follow the recipes of ARCHITECTURE.md in; and the recipe of a quantity."""

import os
import shutil
import subprocess
import sys

from toolbox import ROOT, run

APART = [  # python in the copy, not the package that these tests run in
    "import sys",
    "sys.meta_path = [f for f in sys.meta_path if 'Scikit' not in type(f).__name__]",
    "sys.path[:0] = sys.argv[1:]",
]


class House:
    """A copy of the tree, and what a recipe has touched in it."""

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
        """Text before the first line that begins so."""
        old = (self.folder / name).read_text()
        at = old.index("\n" + before) + 1
        self.write(recipe, name, old[:at] + text + old[at:])

    def build(self):
        """The core and the extension, as fast as a compiler makes them."""
        cmake = run(sys.executable, "-m", "pybind11", "--cmakedir").strip()
        options = ["-DKREISEL_PYTHON=ON", "-DKREISEL_TESTS=OFF", "-DCMAKE_BUILD_TYPE=Debug"]
        paths = [f"-Dpybind11_DIR={cmake}", f"-DPython_EXECUTABLE={sys.executable}"]
        build = self.folder / "build"
        run("cmake", "-S", self.folder, "-B", build, *options, *paths)
        run("cmake", "--build", build, "--target", "_core", "--parallel", os.cpu_count())
        (extension,) = build.glob("_core*.so")
        shutil.copy(extension, self.folder / "python/kreisel")

    def compile(self, program, to):
        """A program with the core as it was built, and all that the core keeps to itself."""
        library = self.folder / "build/libkreisel.a"
        run("gcc", "-std=c99", f"-I{self.folder / 'csrc'}", program, library, "-lm", "-o", to)

    def python(self, *lines):
        """Return the output of a program that runs with the package of the copy."""
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


def add_quantity(house):
    """The height of the apex, without the test that a quantity has."""
    house.insert("quantity", "csrc/quantities.def", "Q(kinetic,", QUANTITY)
    house.insert("quantity", "csrc/model/quantities.c", "double kr_state_nutation(", VALUE)
