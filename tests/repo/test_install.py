"""The installed library: programs in C and C++ find it with CMake and with pkg-config."""

import shutil

import pytest
from toolbox import ROOT, VERSION, compile_and_run, install_library, need, need_gsl, run

HERE = ROOT / "tests/repo/install"


@pytest.fixture(params=["OFF", "ON"], ids=["without_gsl", "with_gsl"])
def prefix(request):
    need("cmake", "gcc")
    if request.param == "ON":
        need_gsl()
    return install_library(request.param)


def test_cmake_finds_the_package(prefix, tmp_path):
    run("cmake", "-S", HERE, "-B", tmp_path, f"-Dkreisel_ROOT={prefix}", f"-Dversion={VERSION}")
    run("cmake", "--build", tmp_path)
    assert run(tmp_path / "with_shared") == VERSION + "\n"
    assert run(tmp_path / "with_static") == VERSION + "\n"


def test_cmake_refuses_another_version(prefix, tmp_path):
    with pytest.raises(pytest.fail.Exception, match="compatible with requested"):
        run("cmake", "-S", HERE, "-B", tmp_path, f"-Dkreisel_ROOT={prefix}", "-Dversion=99.0")


def test_an_installation_may_be_moved(prefix, tmp_path):
    need("pkg-config")
    moved = shutil.copytree(prefix, tmp_path / "elsewhere", symlinks=True)
    folder = moved / "lib/pkgconfig"
    flags = run("pkg-config", "--cflags", "--libs", "kreisel", PKG_CONFIG_PATH=str(folder))
    assert str(moved) in flags and str(prefix) not in flags
    out = compile_and_run(HERE / "main.c", moved, "-std=c99", to=tmp_path / "a.out")
    assert out == VERSION + "\n"


@pytest.mark.parametrize("linking", ["shared", "static"])
@pytest.mark.parametrize(
    "language", [("gcc", "-std=c99"), ("g++", "-std=c++17", "-xc++")], ids=["c", "c++"]
)
def test_pkg_config_leads_to_a_program_that_runs(prefix, language, linking, tmp_path):
    compiler, *options = language
    source = tmp_path / "main.c"
    source.write_text((HERE / "main.c").read_text())
    out = compile_and_run(
        source, prefix, *options, compiler=compiler, linking=linking, to=tmp_path / "a.out"
    )
    assert out == VERSION + "\n"
