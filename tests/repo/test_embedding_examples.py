"""Tests that build and run the programs in examples/."""

import os
import re
import shutil
import sys

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp
from toolbox import (
    ROOT,
    VERSION,
    compile_and_run,
    install_library,
    need,
    need_cargo,
    run,
    write_fast_compiler,
)

EXAMPLES = ROOT / "examples"
REFUSAL = r"there is no step: .+"

# The top of most examples, in SI units. It is released with its spin alone.
GRAVITY, MASS, LEVER, I1, I3, SPIN, TILT = 9.81, 0.5, 0.12, 7.5125e-3, 6.25e-4, 314.159, np.pi / 3
MOMENTUM = SPIN * I3


def solve_lagrange(t, tilt=TILT, momentum=MOMENTUM, i1=I1, pull=MASS * GRAVITY * LEVER):
    """Return the tilt, the tilt rate and the precession angle of a Lagrange top at time `t`.

    The initial angular velocity is a pure spin about the axis. `pull` is mass * gravity * lever.
    """
    vertical = momentum * np.cos(tilt)

    def rate(_, y):
        c, s = np.cos(y[0]), np.sin(y[0])
        turning = (vertical - momentum * c) / (i1 * s * s)
        return [y[1], turning * (turning * c * s - momentum * s / i1) + pull * s / i1, turning]

    return solve_ivp(rate, (0.0, t), [tilt, 0.0, 0.0], "DOP853", rtol=1e-12, atol=1e-13).y[:, -1]


def largest_tilt(tilt, momentum=MOMENTUM, i1=I1, pull=MASS * GRAVITY * LEVER):
    """Return the largest tilt of a Lagrange top that starts with a pure spin."""
    ratio = momentum**2 / (4 * i1 * pull)
    return np.arccos(ratio - np.sqrt(ratio * ratio - 2 * ratio * np.cos(tilt) + 1))


def nutation_integral(function=lambda c: 1.0):
    """Integrate a function of the cosine of the tilt over one nutation period.

    The substitution c = middle + half cos(x) removes the singularities at the turning points.
    """
    pull = MASS * GRAVITY * LEVER
    top, bottom = np.cos(TILT), np.cos(largest_tilt(TILT))
    middle, half = (top + bottom) / 2, (top - bottom) / 2
    third = (
        MOMENTUM**2 / (2 * I1 * pull) - bottom
    )  # roots: f = 2 pull/I1 (c-top)(c-bottom)(c-third)

    def integrand(x):
        c = middle + half * np.cos(x)
        return function(c) / np.sqrt(2 * pull / I1 * (third - c))

    return 2 * quad(integrand, 0, np.pi, epsabs=0, epsrel=1e-12)[0]


PERIOD = nutation_integral()
PRECESSION = (
    nutation_integral(lambda c: MOMENTUM * (np.cos(TILT) - c) / (I1 * (1 - c * c))) / PERIOD
)


@pytest.fixture(scope="module")
def prefix():
    need("cmake", "gcc")
    return install_library()


def build_and_run(name, prefix, tmp_path, *words, linking=("-Wl,--gc-sections",)):
    """Compile a C example with the installed library, and return its output."""
    program = tmp_path / name
    warnings = ["-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wshadow", "-Werror"]
    library = [f"-I{prefix}/include", EXAMPLES / f"{name}.c", prefix / "lib/libkreisel.a"]
    run("gcc", "-std=c99", "-O1", *warnings, *library, "-lm", "-pthread", *linking, "-o", program)
    return run(program, *words)


def numbers(pattern, text):
    """Return the numbers in `text` that the groups of `pattern` match."""
    rows = re.findall(pattern.replace("#", r"([-+.\de]+)"), text, re.M)
    assert rows, text
    return np.array(rows, dtype=float).reshape(len(rows), -1)


def check_hello(output):
    lines = numbers(r"t = # s: tilt # rad", output)
    assert output.startswith(f"kreisel {VERSION}\n") and len(lines) == 11
    truth = [solve_lagrange(t)[0] if t else TILT for t in lines[:, 0]]
    np.testing.assert_allclose(lines[:, 1], truth, rtol=0, atol=1e-8)


def check_one_second(output, refusal):
    ((t, tilt),) = numbers(r"t = #: tilt #", output)
    assert t == 1.0 and abs(tilt - solve_lagrange(1.0)[0]) < 1e-8
    assert re.search(rf"^refused: {refusal}$", output, re.M)


GAME = {"i1": 0.01, "pull": 0.981}  # the tops of game_loop.c, at their start


def read_game(name, output):
    """Return the times, tilts, energies and vertical momenta printed for a top."""
    return numbers(f"^{name}: t = #, tilt #, energy #, vertical momentum #$", output)


def check_push(output):
    """Check the changes of energy and momentum caused by an impulse."""
    impulse, lever, momentum = np.array([0.0, 0.2, 0.0]), 0.1, 100 * 0.002
    tilt, rate, angle = solve_lagrange(0.5, momentum=momentum, **GAME)
    c, s = np.cos(tilt), np.sin(tilt)
    turning = momentum * (0.5 - c) / (0.01 * s * s)
    apex = np.array([s * np.sin(angle), -s * np.cos(angle), c])
    transverse = np.array([np.cos(angle), np.sin(angle), 0.0])
    velocity = (
        rate * np.array([c * np.sin(angle), -c * np.cos(angle), -s]) + turning * s * transverse
    )
    energy = momentum**2 / 0.004 + 0.981 / 2
    work = lever * velocity @ impulse
    work += lever**2 * (impulse @ impulse - (apex @ impulse) ** 2) / (2 * 0.01)
    vertical = momentum / 2
    np.testing.assert_allclose(
        read_game("before the push", output), [[0.5, tilt, energy, vertical]], rtol=0, atol=1e-4
    )
    after = [0.5, tilt, energy + work, vertical + lever * apex[0] * impulse[1]]
    np.testing.assert_allclose(read_game("after the push", output), [after], rtol=0, atol=1e-4)
    assert work > 0.1
    return after[2:]


def check_heavier(output):
    """Check that replacing the body preserves the attitude and momentum."""
    momentum = 101 * 0.002
    tilt, rate, _ = solve_lagrange(1.0, momentum=momentum, **GAME)
    transverse_square = (momentum * (0.5 - np.cos(tilt)) / np.sin(tilt)) ** 2 + (0.01 * rate) ** 2
    energy = momentum**2 / (2 * 0.004) + transverse_square / (2 * 0.02) + 2 * 0.981 * np.cos(tilt)
    row = [1.0, tilt, energy, momentum / 2]
    np.testing.assert_allclose(read_game("heavier", output), [row], rtol=0, atol=1e-4)
    return row[2:]


def check_game(output):
    push_end, heavier_end = check_push(output), check_heavier(output)
    assert "\nrefused: the method does not apply to this body\n" in output
    end = read_game("end", output)
    np.testing.assert_allclose(end[:2, 2:], [push_end, heavier_end], rtol=0, atol=1e-4)
    assert abs(end[2, 1] - solve_lagrange(3.0, momentum=102 * 0.002, **GAME)[0]) < 1e-4


def test_hello_prints_the_motion_of_its_top(prefix, tmp_path):
    check_hello(build_and_run("hello", prefix, tmp_path))


def test_make_finds_the_library_by_pkg_config(prefix, tmp_path):
    need("make", "pkg-config")
    shutil.copy(EXAMPLES / "hello.c", tmp_path)
    folder = shutil.copytree(EXAMPLES / "pkg_config", tmp_path / "pkg_config")
    run("make", cwd=folder, PKG_CONFIG_PATH=str(prefix / "lib/pkgconfig"))
    check_hello(run(folder / "hello"))


def test_the_game_moves_pushes_changes_and_refuses(prefix, tmp_path):
    check_game(build_and_run("game_loop", prefix, tmp_path))


def test_the_loop_of_the_game_allocates_nothing(prefix, tmp_path):
    linking = [f"-Wl,--wrap={name}" for name in ("malloc", "calloc", "realloc")]
    linking.append(ROOT / "tests/repo/allocations.c")
    for frames in ("0", "3000"):
        output = build_and_run("game_loop", prefix, tmp_path, frames, linking=linking)
        assert output.endswith("allocations: 100\n"), output


def test_events_occur_at_the_lowest_points_of_the_axis(prefix, tmp_path):
    output = build_and_run("events", prefix, tmp_path)
    lowest = numbers(r"lowest at t = #: tilt #", output)
    assert len(lowest) == int(2 / PERIOD + 0.5) and "end at t = 2.000" in output
    times = PERIOD * (np.arange(len(lowest)) + 0.5)
    np.testing.assert_allclose(lowest[:, 0], times, rtol=0, atol=1e-11)
    np.testing.assert_allclose(lowest[:, 1], largest_tilt(TILT), rtol=0, atol=2e-12)


def test_an_ensemble_does_not_depend_on_its_threads(prefix, tmp_path):
    output = build_and_run("ensemble", prefix, tmp_path, "1")
    assert run(tmp_path / "ensemble", "7") == output
    lines = numbers(r"start #, largest tilt #", output)
    assert len(lines) == 10 and "\n0 of 1000 tops failed\n" in output
    truth = largest_tilt(lines[:, 0])
    assert (lines[:, 1] <= truth + 1e-12).all()
    np.testing.assert_allclose(lines[:, 1], truth, rtol=1e-4)  # of samples 2 ms apart


def test_a_checkpoint_continues_with_the_same_bits(prefix, tmp_path):
    output = build_and_run("checkpoint", prefix, tmp_path, tmp_path / "top")
    assert output.splitlines()[-1] == "bitwise equal" and "loaded at t = 1.0\n" in output
    assert re.search("^damaged: the checkpoint is damaged", output, re.M)
    ((t, *momentum),) = numbers("t = #: m = # # #", output)
    assert t == 5.0
    np.testing.assert_allclose(momentum, solve_asymmetric(5.0), rtol=0, atol=1e-8)


def solve_asymmetric(t):
    """Return the angular momentum of an asymmetric top at time `t`."""

    def rate(_, y):
        q, m = y[:4] / np.linalg.norm(y[:4]), y[4:]
        w, x, y, z = q
        axes = np.array(
            [
                [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
            ]
        )
        velocity = axes @ ((axes.T @ m) / [0.010, 0.008, 0.003])
        v = velocity / 2
        turn = [-v @ q[1:], *(v * q[0] + np.cross(v, q[1:]))]
        return [*turn, *np.cross(0.1 * axes[:, 2], [0.0, 0.0, -9.81])]

    start = [np.cos(np.pi / 6), np.sin(np.pi / 6), 0, 0, 0, -0.3, 0.2]
    return solve_ivp(rate, (0, t), start, "DOP853", rtol=1e-12, atol=1e-13).y[4:, -1]


def test_the_closed_form_has_the_period_and_precession_of_the_integrals(prefix, tmp_path):
    output = build_and_run("exact", prefix, tmp_path)
    assert output.startswith("motion: cusps\n")
    ((least, greatest),) = numbers("tilt: # to #\n", output)
    assert abs(least - TILT) < 2e-12 and abs(greatest - largest_tilt(TILT)) < 2e-12
    ((period,),) = numbers("period: #", output)
    ((precession,),) = numbers("precession: #", output)
    assert abs(period - PERIOD) < 2e-12 and abs(precession - PRECESSION) < 1e-11
    lines = numbers(r"^t = #: tilt #", output)
    for t, tilt in lines:
        truth = solve_lagrange(t % PERIOD)[0] if t else TILT  # the nutation is periodic
        assert abs(tilt - truth) < 1e-8
    assert lines[-1, 0] == 86400


def test_cpp_frees_by_a_destructor_and_throws(prefix, tmp_path):
    output = compile_and_run(
        EXAMPLES / "raii.cpp", prefix, "-std=c++17", compiler="g++", file=tmp_path / "raii"
    )
    assert re.search(f"^caught: {REFUSAL}$", output, re.M)
    ((t, loss),) = numbers("^t = #: .+, lost energy #", output)
    assert t == 1.0 and abs(loss) < 1e-14


def test_ctypes_calls_the_shared_library(prefix):
    output = run(sys.executable, EXAMPLES / "ctypes_top.py", prefix / "lib/libkreisel.so")
    check_one_second(output, "a time lies before the previous one in the direction of time")


@pytest.fixture(scope="module")
def one_file(tmp_path_factory):
    """Return a folder with kreisel.c and kreisel.h."""
    folder = tmp_path_factory.mktemp("one_file")
    run(sys.executable, ROOT / "cmake/amalgamate.py", folder)
    return folder


@pytest.mark.parametrize("source", ["installed", "pkg_config", "one_file"])
def test_the_rust_crate_is_built_offline(source, prefix, request, tmp_path):
    need("cc", "ar")
    need_cargo()
    crate = shutil.copytree(EXAMPLES / "rust", tmp_path / "rust")
    environment = {"PKG_CONFIG_PATH": str(prefix / "lib/pkgconfig")}
    if source == "installed":
        environment = {"KREISEL_DIR": str(prefix)}
    elif source == "one_file":
        environment = {"KREISEL_DIR": str(request.getfixturevalue("one_file"))}
        environment["CC"] = str(write_fast_compiler(tmp_path))
    output = run("cargo", "run", "-q", "--offline", cwd=crate, **environment)
    check_one_second(output, REFUSAL)


@pytest.mark.parametrize("example", ["add_subdirectory", "fetch_content"])
def test_a_cmake_project_builds_the_library_with_one_method(example, tmp_path):
    need("cmake", "gcc")
    build = tmp_path / "build"
    option = f"-DKREISEL={ROOT}"
    if example == "fetch_content":
        option = f"-DFETCHCONTENT_SOURCE_DIR_KREISEL={ROOT}"
    run("cmake", "-S", EXAMPLES / example, "-B", build, option)
    run("cmake", "--build", build, "--parallel", os.cpu_count())
    check_game(run(build / "game_loop"))


def test_fetch_content_clones_the_given_repository(tmp_path):
    """Check that CMake fetches the repository and runs its CMakeLists.txt."""
    need("cmake", "git")
    repository = tmp_path / "repository"
    run("git", "init", "-q", "-b", "main", repository)
    (repository / "CMakeLists.txt").write_text('message(FATAL_ERROR "this was fetched")\n')
    run("git", "add", ".", cwd=repository)
    author = ["-c", "user.name=a", "-c", "user.email=a@example.org"]
    run("git", *author, "commit", "-qm", "Add", cwd=repository)
    with pytest.raises(pytest.fail.Exception, match="this was fetched"):
        run(
            *["cmake", "-S", EXAMPLES / "fetch_content", "-B", tmp_path / "build"],
            f"-DKREISEL_REPOSITORY={repository}",
        )


def use_zig():
    """Return the command that runs zig, or skip the test if zig is missing."""
    pytest.importorskip("ziglang")
    return f'"{sys.executable}" -m ziglang'


def needed_functions(page):
    """Return the functions that docs/embedding.md lists as required on microcontrollers."""
    section = page.partition("## Microcontrollers")[2].partition("\n## ")[0]
    return {
        name
        for line in section.splitlines()
        if line.startswith("| ")
        for name in re.findall(r"`(\w+)`", line)
    }


def test_a_microcontroller_needs_the_functions_on_the_page(one_file, tmp_path):
    zig = use_zig()
    need("make", "nm")
    folder = shutil.copytree(EXAMPLES / "bare", tmp_path / "bare")
    command = ["make", "-s", f"KREISEL={one_file}", "needs", f"LD={zig} ld.lld"]
    output = run(
        *command,
        f"CC={zig} cc -target thumb-freestanding-eabihf",
        "TARGET=-mcpu=cortex_m4",
        cwd=folder,
    )
    names = set(re.findall(r"\bU (\w+)", output))
    compiler = {name for name in names if name.startswith("__aeabi_")}
    assert compiler and names - compiler == needed_functions(
        (ROOT / "docs/embedding.md").read_text()
    )
    assert "kr_method_taylor" not in run("nm", folder / "image.o")


def test_the_program_of_the_microcontroller_runs_on_a_pc(one_file, tmp_path):
    need("make", "cc")
    folder = shutil.copytree(EXAMPLES / "bare", tmp_path / "bare")
    # Without optimization; test_embedding builds the program with the flags of the Makefile.
    flags = f"CFLAGS=-std=c99 -O0 -ffunction-sections -DKR_ONE_ISA -DKR_SMALL -I{one_file}"
    output = run("make", "-s", f"KREISEL={one_file}", flags, "run", cwd=folder)
    lines = numbers("^t = #: height #", output)
    truth = [np.cos(solve_lagrange(t)[0]) for t in lines[:, 0]]
    np.testing.assert_allclose(lines[:, 1], truth, rtol=0, atol=1e-4)
    ((memory,),) = numbers("^success, # bytes of memory$", output)
    assert 0 < memory <= 2560
