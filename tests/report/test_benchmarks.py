"""Tests of the benchmark and mutation programs."""

import importlib
import re

import kreisel as kr
import numpy as np
import pytest
from toolbox import ROOT, core_sources

from validation.benchmarks import agreement, compiling, support_costs
from validation.mutation import coverage

FILES = sorted(
    file for name in ("benchmarks", "mutation") for file in ROOT.glob(f"validation/{name}/*.py")
)
PROGRAMS = [f"{file.parent.name}.{file.stem}" for file in FILES if "__main__" in file.read_text()]


def test_programs_are_found():
    assert {"benchmarks.closed_form_truth", "mutation.mutate", "mutation.coverage"} <= set(PROGRAMS)


@pytest.mark.parametrize("name", PROGRAMS)
def test_a_program_describes_its_measurement(name, capsys):
    if name == "benchmarks.viewer_speed":
        pytest.importorskip("playwright")
    program = importlib.import_module(f"validation.{name}")
    with pytest.raises(SystemExit) as program_exit:
        program.main(["--help"])
    output = capsys.readouterr().out
    assert program_exit.value.code == 0 and f"python -m validation.{name}" in output
    assert program.__doc__.split()[0] in output


def test_the_core_is_compiled_like_the_library():
    """Check that the benchmarks compile the same files as CMakeLists.txt, with the same options."""
    cmake_text = (ROOT / "CMakeLists.txt").read_text()
    isas = (ROOT / "cmake/isa.cmake").read_text()
    assert compiling.core_files() == core_sources()
    pattern = r'list\(FILTER (?:kernels|scalars) INCLUDE REGEX "(.*)"\)'
    filters = [text.replace("\\\\", "\\") for text in re.findall(pattern, cmake_text)]
    again = {f for f in core_sources() if any(re.search(one, f.as_posix()) for one in filters)}
    assert set(compiling.isa_files()) == again and len(again) >= 5
    avx2 = re.search(r"set\(avx2_options (.*)\)", isas)[1].split()
    avx512 = re.search(r"set\(avx512_options \$\{avx2_options\} (.*)\)", isas)[1].split()
    assert {"avx2": tuple(avx2), "avx512": (*avx2, *avx512)} == compiling.ISAS
    flags = re.search(r"add_compile_options\((-ffp-contract=off .*) -Wall", cmake_text)[1].split()
    assert set(flags) <= set(compiling.FLAGS)


def test_the_costs_of_supports_are_printed_as_ratios(capsys):
    arguments = ["kowalewski", "--rounds", "1", "--share", "0.01", "--digits", "16", "30"]
    assert support_costs.main(arguments) == 0
    rows = re.findall(
        r"^  (\w[\w ]*?) +([\d.]+) +([\d.]+) +([\d.]+)$", capsys.readouterr().out, re.M
    )
    assert [row[0] for row in rows] == 2 * ["rotor", *support_costs.WORDS]
    assert all(float(ratio) > 0 for row in rows for ratio in row[1:])
    times = {"plain": iter([2.0, 4.0, 8.0]), "rotor": iter([3.0, 4.0, 4.0])}
    ratios, base = support_costs.find_ratios(
        lambda scene: next(times[scene]), "plain", {"rotor": "rotor"}, 3
    )
    assert (ratios, base) == ({"rotor": 1.0}, 4.0)


def test_a_cost_of_a_support_is_refused_for_an_unknown_body():
    with pytest.raises(SystemExit):
        support_costs.main(["unknown"])


def test_nearly_upright_tops_are_nearly_upright():
    tops = [agreement.nearly_upright(np.random.default_rng([1, 11, i])) for i in range(20)]
    assert len({top.body.com for top in tops}) == 3, "the centre of mass is on each of the axes"
    for top in tops:
        path = kr.solve(top, [0.0])
        assert path.apex[0] == pytest.approx((0.0, 0.0, 1.0), abs=1.1e-4)
        assert path.body_velocity[0] @ top.body.com >= 0.0


def test_the_help_on_branches_names_the_default_tests(capsys):
    with pytest.raises(SystemExit):
        coverage.main(["--help"])
    output = " ".join(capsys.readouterr().out.split())
    assert f"core: {' '.join(coverage.WITHOUT_BROWSER)}; package: tests/python tests/" in output
    assert "default: all" not in output


def test_every_function_agrees_with_20_digits_on_random_tops(capsys):
    assert agreement.main(["--tops", "120", "--seed", "8"]) == 0
    assert capsys.readouterr().out.endswith("\n0 disagreements\n")
