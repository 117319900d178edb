"""Tests of the build options in CMakeLists.txt."""

import os
import platform
import re
import shutil

import pytest
from toolbox import CSRC, FAST_CC, ROOT, install_library, need, run

PROGRAM = ROOT / "tests/repo/options.c"
NAMES = re.findall(r"^ *X\((\w+),", (CSRC / "kreisel.h").read_text(), re.M)
STATUS = {name: i for i, name in enumerate(NAMES[: NAMES.index("ERR_STOPPED") + 1])}
SECTIONS = ["-ffunction-sections", "-fdata-sections", "-Wl,--gc-sections"]


def build_library(name, **options):
    """Build the static library with the given options, and return its path.

    The build folder lies inside `build`, so that ccache can reuse the object files of other clones.
    """
    need("cmake", "gcc")
    folder = ROOT / "build" / f"options-{name}"
    shutil.rmtree(folder, ignore_errors=True)
    defined = [f"-D{name}={value}" for name, value in options.items()]
    run("cmake", "-S", ROOT, "-B", folder, "-DKREISEL_TESTS=OFF", *defined)
    run("cmake", "--build", folder, "--target", "kreisel_static", "--parallel", os.cpu_count())
    return folder / "libkreisel.a"


def query_methods(library, *methods):
    """Return the status codes of `methods`, and the names of all methods in the C library."""
    program = library.with_name("options")
    run("gcc", "-std=c99", f"-I{CSRC}", PROGRAM, library, "-lm", "-o", program)
    *lines, table = run(program, *methods).splitlines()
    statuses = {name: tuple(map(int, codes)) for name, *codes in map(str.split, lines)}
    assert {len(codes) for codes in statuses.values()} <= {7}
    return statuses, table.split()


def symbols(program):
    """Return the names of all functions and constants in a program."""
    return {line.split()[-1] for line in run("nm", program).splitlines() if line}


def test_a_build_with_one_method_reports_omitted_methods():
    library = build_library("strang", KREISEL_METHODS="strang")
    statuses, table = query_methods(library, "strang", "taylor", "exact", "none")
    expected = (STATUS["ERR_NOT_BUILT"],) * 7
    option = STATUS["ERR_OPTION"]
    assert statuses["strang"][:3] == (0, option, option)
    friction, shaking = STATUS["ERR_FRICTION"], STATUS["ERR_SHAKING"]
    assert list(statuses["strang"][3:]) == [friction, 0, shaking, option]
    assert statuses["taylor"] == statuses["exact"] == expected
    assert statuses["none"] == (STATUS["ERR_NO_METHOD"],) * 7
    assert table == ["strang"]


@pytest.mark.skipif(platform.machine() != "x86_64", reason="names instruction sets of x86_64")
def test_taylor_with_sixteen_digits_without_tangents_and_supports():
    library = build_library(
        "taylor",
        KREISEL_METHODS="exact;taylor",
        KREISEL_ISA="sse2",
        KREISEL_DIGITS="16",
        KREISEL_TANGENTS="OFF",
        KREISEL_SUPPORTS="OFF",
        CMAKE_BUILD_TYPE="MinSizeRel",
        CMAKE_C_COMPILER=FAST_CC,
        CMAKE_C_FLAGS_MINSIZEREL="-O0",  # compiles faster
    )
    statuses, table = query_methods(library, "exact", "taylor", "rk4")
    assert statuses["taylor"] == (0, *(STATUS["ERR_NOT_BUILT"],) * 6)
    assert statuses["exact"][:3] == (0, STATUS["ERR_OPTION"], STATUS["ERR_OPTION"])
    assert statuses["rk4"] == (STATUS["ERR_NOT_BUILT"],) * 7
    assert table == ["exact", "taylor"]
    assert not [name for name in symbols(library) if name.endswith(("_avx2", "_avx512"))]


def test_wrong_options_are_refused():
    for options, message in (
        ({"KREISEL_METHODS": "strang;euler"}, r"euler\s+is\s+not"),
        ({"KREISEL_ISA": "mmx"}, r"mmx\s+is\s+not"),
        ({"KREISEL_DIGITS": "17"}, r"17\s+is\s+neither"),
    ):
        with pytest.raises(pytest.fail.Exception, match=message):
            build_library("wrong", **options)


def link_program(folder, lines, *sources):
    """Compile a C program with the given statements, run it, and return its linker symbols.

    The given statements must leave the variable `status` equal to KR_OK. The files `sources` are
    linked before the library.
    """
    prefix = install_library()
    source, program = folder / "program.c", folder / "program"
    source.write_text(
        "#include <kreisel.h>\n"
        "int main(void)\n"
        "{\n"
        "    kr_scene scene = kr_scene_default();\n"
        "    kr_status status = KR_OK;\n"
        f"{lines}"
        "    return status != KR_OK;\n"
        "}\n"
    )
    library = prefix / "lib/libkreisel.a"
    run(
        *("gcc", "-std=c99", *SECTIONS, f"-I{prefix}/include", source, *sources, library, "-lm"),
        *("-o", program),
    )
    run(program)
    return symbols(program)


RUN_TOP = (
    "    kr_config config = kr_config_default();\n"
    "    kr_top *top = NULL;\n"
    "    config.step = 0.01;\n"
    "    status = kr_top_create(&scene, &METHOD, config, &top);\n"
    "    if (status == KR_OK) status = kr_top_advance(top, 1.0);\n"
    "    kr_top_free(top);\n"
)


def test_a_static_program_links_only_the_method_it_uses(tmp_path):
    names = link_program(tmp_path, RUN_TOP.replace("METHOD", "kr_method_strang"))
    assert "kr_method_strang" in names and "kr_top_create" in names
    methods = {name for name in names if re.match("kr_method_(?!applies|describe|suits)", name)}
    assert methods == {"kr_method_strang"}
    assert not [name for name in names if re.match("kr_(exact|taylor|kernel|lanes|worker)", name)]
    text, data, *_ = run("size", tmp_path / "program").splitlines()[1].split()
    assert int(text) + int(data) < 80_000


def torus_names(names):
    """Return the symbols that implement the closed forms on a torus."""
    kinds = "kr_(kowalewski|(goryachev_)?chaplygin|gyrostat)"
    return [name for name in names if re.match(kinds, name)]


def test_a_static_program_links_closed_forms_without_methods(tmp_path):
    lines = (
        "    static double memory[KR_EXACT_SIZE / sizeof(double)];\n"
        "    kr_exact *exact = (kr_exact *)(void *)memory;\n"
        "    if (kr_exact_size(&scene) > sizeof memory) return 1;\n"
        "    status = kr_exact_plan(&scene, 0.0, exact);\n"
        "    if (!(kr_exact_state(exact, 1.0).t == 1.0)) return 1;\n"
    )
    names = link_program(tmp_path, lines)
    assert "kr_exact_plan" in names and "kr_method_exact" not in names


def test_method_exact_can_be_built_without_closed_forms_on_a_torus(tmp_path):
    lines = RUN_TOP.replace("METHOD", "kr_method_exact") + (
        "    if (!kr_method_applies(&kr_method_exact, &scene.body)) return 1;\n"
        "    scene.body.inertia = (kr_vec3){2.0, 2.0, 1.0};\n"
        "    scene.body.com = (kr_vec3){1.0, 0.0, 0.0};\n"
        "    scene.start.q = (kr_quat){0.8, 0.4, -0.2, 0.4};\n"
        "    scene.start.m = (kr_vec3){0.3, 1.1, 0.8};\n"
        "    if (kr_body_kind(&scene.body, KR_KIND_RTOL) != KR_KIND_KOWALEWSKI) return 1;\n"
        "    if (kr_method_applies(&kr_method_exact, &scene.body) != APPLIES) return 1;\n"
        "    if (kr_method_suits(&kr_method_exact, &scene) != APPLIES) return 1;\n"
        "    top = NULL;\n"
        "    kr_status refused = kr_top_create(&scene, &kr_method_exact, config, &top);\n"
        "    kr_top_free(top);\n"
        "    if ((refused == KR_OK) != APPLIES) return 1;\n"
    )
    assert torus_names(link_program(tmp_path, lines.replace("APPLIES", "1")))
    exact = tmp_path / "exact.o"
    run(
        *("gcc", "-std=c99", "-O2", *SECTIONS[:2], f"-I{CSRC}", "-DKR_NO_TORUS"),
        *("-c", CSRC / "exact/exact.c", "-o", exact),
    )
    assert not torus_names(link_program(tmp_path, lines.replace("APPLIES", "0"), exact))
