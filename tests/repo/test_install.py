"""Tests that programs find the installed library with CMake and pkg-config."""

import shutil

import pytest
from toolbox import ROOT, VERSION, compile_and_run, install_library, need, need_gsl, run

EXAMPLES = ROOT / "examples"
FIRST_LINE = f"kreisel {VERSION}\n"


@pytest.fixture(params=["OFF", "ON"], ids=["without_gsl", "with_gsl"])
def prefix(request):
    need("cmake", "gcc")
    if request.param == "ON":
        need_gsl()
    return install_library(request.param)


def test_cmake_finds_the_package(prefix, tmp_path):
    run("cmake", "-S", EXAMPLES / "find_package", "-B", tmp_path, f"-DCMAKE_PREFIX_PATH={prefix}")
    run("cmake", "--build", tmp_path)
    assert run(tmp_path / "hello").startswith(FIRST_LINE)
    assert run(tmp_path / "hello_static").startswith(FIRST_LINE)


def test_cmake_refuses_another_version(prefix, tmp_path):
    project = shutil.copytree(EXAMPLES / "find_package", tmp_path / "project") / "CMakeLists.txt"
    text = project.read_text().replace("find_package(kreisel 0.1", "find_package(kreisel 99.0")
    project.write_text(text)
    with pytest.raises(pytest.fail.Exception, match="compatible with requested"):
        run(
            "cmake", "-S", project.parent, "-B", tmp_path / "build", f"-DCMAKE_PREFIX_PATH={prefix}"
        )


def test_an_installation_can_be_moved(prefix, tmp_path):
    need("pkg-config")
    folder_copy = shutil.copytree(prefix, tmp_path / "elsewhere", symlinks=True)
    folder = folder_copy / "lib/pkgconfig"
    flags = run("pkg-config", "--cflags", "--libs", "kreisel", PKG_CONFIG_PATH=str(folder))
    assert str(folder_copy) in flags and str(prefix) not in flags
    output = compile_and_run(EXAMPLES / "hello.c", folder_copy, "-std=c99", file=tmp_path / "a.out")
    assert output.startswith(FIRST_LINE)


@pytest.mark.parametrize("linking", ["shared", "static"])
@pytest.mark.parametrize(
    "language", [("gcc", "-std=c99"), ("g++", "-std=c++17", "-xc++")], ids=["c", "c++"]
)
def test_pkg_config_builds_a_working_program(prefix, language, linking, tmp_path):
    compiler, *options = language
    source = tmp_path / "hello.c"
    source.write_text((EXAMPLES / "hello.c").read_text())
    output = compile_and_run(
        source, prefix, *options, compiler=compiler, linking=linking, file=tmp_path / "a.out"
    )
    assert output.startswith(FIRST_LINE)
