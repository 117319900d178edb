"""Tests that make the changes of the recipes in ARCHITECTURE.md in a copy of the repository.

The changes are written in this module and in copied.py; ARCHITECTURE.md is not read. The tests show
that these changes are sufficient, and the numbers of files remind authors of a further change to
correct the recipe as well. Other recipes are tested in tests/viewer/test_page_recipes.py and
tests/report/test_parts.py.
"""

import json

import pytest
from copied import House, add_quantity
from toolbox import ROOT, need, run

OF_THE_QUANTITY = """import kreisel as kr
import numpy as np


def test_height_is_the_third_component_of_the_apex():
    path = kr.solve(kr.scenes.thesis, [1.0, 2.0], tangents="start")
    assert np.array_equal(path.height, path.apex[:, 2])
    assert np.array_equal(path.derivative("height"), path.derivative("apex")[:, 2])
"""
METHOD = """/* Kick and free drift: the splitting of first order (splitting.h). Keeps <m,e3>. */
#include "splitting.h"

static kr_status kick_drift_reset(kr_motion *motion, const kr_state *start)
{
    splitting_begin((splitting *)motion->work, motion, start);
    return KR_OK;
}
static kr_status kick_drift_step(kr_motion *motion, double until)
{
    splitting *s = (splitting *)motion->work;
    (void)until;
    splitting_kick(s, motion, 1.0);
    splitting_drift(s, 1.0);
    s->steps += 1.0;
    motion->stats.evaluations++;
    return KR_OK;
}
static void kick_drift_read(const kr_motion *motion, kr_state *out)
{
    splitting_read((const splitting *)motion->work, motion, 0.0, out);
}

const kr_method kr_method_kick_drift = {
    .name = "kick_drift",
    .text = "kick, free drift",
    .conserves = "<m,e3>; on Lagrange tops <m,apex>",
    .reference = "symplectic Euler",
    .order = 1,
    .flags = KR_METHOD_SYMPLECTIC | KR_METHOD_ALGEBRAIC,
    .work = sizeof(splitting) / sizeof(double),
    .reset = kick_drift_reset,
    .step = kick_drift_step,
    .read = kick_drift_read,
};
"""
MAKER = '''    @classmethod
    def ball(cls, mass: float, radius: float, height: float) -> Self:
        """A homogeneous ball [M], [L], whose centre stands at (0, 0, height) [L]."""
        inertia = 0.4 * as_positive("mass", mass) * as_positive("radius", radius) ** 2
        return cls.from_com(mass, (inertia,) * 3, (0.0, 0.0, height), (0.0, 0.0, 0.0))

'''
OF_THE_MAKER = """import kreisel as kr


def test_a_ball_is_alike_about_all_axes_through_its_centre():
    assert kr.Body.ball(5.0, 1.0, 0.0).moments == (2.0, 2.0, 2.0)
"""


OF_THREADS = "ensemble_laws", "ensemble_results", "sections", "interruption", "exact"
# Tests of arithmetic, and of other processes, which import the installed package
NOT_OF_THREADS = "taylor_errors", "process_pools", "ctrl_c_stops"


@pytest.fixture(scope="module")
def house(tmp_path_factory):
    need("cmake", "gcc", "g++")
    house_copy = House(tmp_path_factory.mktemp("house"))
    add_quantity(house_copy)
    house_copy.write("quantity", "tests/python/test_height.py", OF_THE_QUANTITY)
    house_copy.write("method", "csrc/methods/kick_drift.c", METHOD)
    house_copy.insert("method", "csrc/methods.def", "X(strang)", "X(kick_drift)\n")
    house_copy.insert(
        "method", "csrc/kreisel.h", "    kr_method_extrap,", "    kr_method_kick_drift,\n"
    )
    house_copy.insert("maker", "python/kreisel/_model/body.py", "    @property", MAKER)
    house_copy.write("maker", "tests/python/test_ball.py", OF_THE_MAKER)
    house_copy.build()
    return house_copy


def test_a_quantity_touches_four_files(house):
    assert len(house.touched["quantity"]) == 4
    output = house.python(
        "import kreisel as kr, json",
        "path = kr.solve(kr.scenes.thesis, [1.0], want=('height',))",
        "whole = kr.solve(kr.scenes.thesis, [1.0])",
        "same = bool(path.height == whole.apex[:, 2]) and bool(whole.height == path.height)",
        "print(json.dumps([same, 'height' in dir(kr.Path), kr.Path.height.__doc__]))",
    )
    is_equal, is_listed, text = json.loads(output)
    assert is_equal and is_listed
    assert text.startswith("(n,) height of the apex above the fixed point")


def test_a_quantity_is_a_column_of_the_command_line(house):
    words = "['solve', 'thesis', '--t', '1', '--want', 'height', '--csv', '-']"
    lines = house.python("from kreisel._cli import main", f"main({words})").splitlines()
    assert lines[0] == "t,height" and len(lines) == 3


def test_a_quantity_is_available_in_c(house, tmp_path):
    program = tmp_path / "user.c"
    program.write_text("""#include <stdio.h>
#include "kreisel.h"
int main(void)
{
    const kr_scene scene = kr_scene_default();
    double height;
    kr_quantity_values(kr_quantity_find("height"), &scene, 1, &scene.start, &height);
    return printf("%g\\n", height) < 0;
}
""")
    house.compile(program, file=tmp_path / "user")
    assert run(tmp_path / "user") == "1\n"


def test_the_tests_of_the_recipes_pass(house):
    tests = [f"tests/python/test_{name}.py" for name in ("height", "ball")]
    output = house.python(
        "import pytest", f"print(pytest.main(['-q', '--rootdir=/', *{at(house, tests)}]))"
    )
    assert "2 passed" in output


def test_references_are_counted_only_with_the_gil(house):
    """Run the thread tests in a build in which pybind11 checks that the GIL is held."""
    (extension,) = (house.folder / "python/kreisel").glob("_core*.so")
    assert b"PyGILState_Check" in extension.read_bytes()
    tests = [f"tests/python/test_{name}.py" for name in OF_THREADS]
    words = ["-q", "-x", "--rootdir=/", "-p", "no:cacheprovider", *at(house, tests)]
    words += ["-k", "not " + " and not ".join(NOT_OF_THREADS)]
    output = house.python("import pytest", f"print(pytest.main({words}))")
    assert output.endswith("\n0\n"), output


def at(house, names):
    return [str(house.folder / name) for name in names]


@pytest.mark.parametrize(("program", "count"), [("golden", 4), ("snapshot", 1)])
def test_a_method_touches_three_files_and_adds_its_golden_lines(house, program, count, tmp_path):
    assert len(house.touched["method"]) == 3
    house.compile(ROOT / f"tests/c/{program}.c", file=tmp_path / program)
    expected = (ROOT / f"tests/c/{program}.txt").read_text().splitlines()
    more = [line for line in run(tmp_path / program).splitlines() if line not in expected]
    assert len(more) == count and all("kick_drift" in line.split() for line in more)


def test_a_method_has_its_stated_order(house):
    output = house.python(
        "import kreisel as kr",
        "from validation.references.orders import measure_order",
        "slopes = measure_order('kick_drift', 'lagrange')",
        "print(kr.methods['kick_drift'].order, round(slopes['q']))",
    )
    assert output == "1 1\n"


def test_a_body_constructor_touches_two_files_and_works_in_toml(house):
    assert len(house.touched["maker"]) == 2
    text = "momentum = [0, 0, 1]\n[body.ball]\nmass = 5\nradius = 1\nheight = 1\n"
    output = house.python(
        "import kreisel as kr, pathlib, tempfile",
        "file = pathlib.Path(tempfile.mkdtemp()) / 'top.toml'",
        f"file.write_text({text!r})",
        "print(kr.Scene.from_toml(file).body.moments)",
    )
    assert output == "(7.0, 7.0, 2.0)\n"
