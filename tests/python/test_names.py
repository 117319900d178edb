"""Tests of public names and attitude conventions."""

import kreisel as kr
import numpy as np
import pytest
from internals import core
from kreisel import quaternion
from toolbox import ROOT, python
from tops import CORNER, unit

PACKAGE = ROOT / "python/kreisel"


def test_public_modules_have_unique_names():
    modules = {file.stem for file in PACKAGE.glob("*.py") if not file.stem.startswith("_")}
    assert modules == {"events", "quaternion", "scenes"} and modules <= set(kr.__all__)
    assert all(getattr(kr, name).__name__ == f"kreisel.{name}" for name in modules)


def test_subpackages_are_private():
    rooms = [folder.name for folder in PACKAGE.iterdir() if (folder / "__init__.py").is_file()]
    assert len(rooms) == 10 and all(name.startswith("_") for name in rooms)


def test_methods_describe_themselves():
    assert {"bobenko_suris", "bobenko_suris2", "strang", "rk4", "extrap"} <= set(kr.methods)
    rk4, strang = kr.methods["rk4"], kr.methods["strang"]
    assert (rk4.name, rk4.order) == ("rk4", 4) and rk4.algebraic
    assert not rk4.symplectic and not rk4.adaptive and kr.methods["extrap"].adaptive
    assert strang.symplectic and strang.reversible
    assert all(
        method.text and method.conserves and method.reference for method in kr.methods.values()
    )
    assert rk4.applies_to(CORNER) and not kr.methods["bobenko_suris"].applies_to(CORNER)
    with pytest.raises(KeyError, match="did you mean 'strang'"):
        kr.methods["strng"]


def test_the_attitude_error_is_the_angle_between():
    half = np.array([1e-150, 1e-12, 0.4, np.pi / 2])
    turns = np.stack([np.cos(half), np.sin(half), 0 * half, 0 * half], axis=-1)
    np.testing.assert_allclose(kr.attitude_error(turns, (1, 0, 0, 0)), 2 * half, rtol=1e-15)
    np.testing.assert_allclose(
        kr.attitude_error(-turns[2], turns[None]), 2 * abs(half[None] - 0.4), atol=1e-15
    )
    assert kr.attitude_error(turns[:, None], turns[None]).shape == (4, 4)
    with pytest.raises(ValueError, match="shape"):
        kr.attitude_error(turns[:, :3], turns)


def test_conventions_agree_with_the_core():
    quarter = kr.Scene(CORNER, momentum=(0, 0, 0), attitude=unit((1, 0, 0, 1)), gravity=1)
    assert quaternion.turn(quarter.attitude, (1.0, 0.0, 0.0)) == pytest.approx((0, 1, 0), abs=1e-15)
    expected = quaternion.turn(quarter.attitude, quaternion.turn(CORNER.axes, (1.0, 0.0, 0.0)))
    assert kr.solve(quarter, [0.0]).frame[0, 0] == pytest.approx(expected, abs=1e-15)
    assert "scalar first" in kr.conventions() and "(0.0, 1.0, 0.0)" in kr.conventions()


def test_the_core_matches_its_stub():
    stub = (ROOT / "python/kreisel/_core.pyi").read_text()
    public = {name for name in dir(core) if not name.startswith("_")}
    names = {
        line.split("(")[0].removeprefix("def ").split(":")[0]
        for line in stub.splitlines()
        if line[:1].isalpha()
    }
    names = {
        word.removeprefix("class ")
        for word in names
        if not word.startswith(("class _", "from ", "import "))
    }
    assert public == names


def test_import_needs_only_numpy():
    optional = {"scipy", "rich", "click", "matplotlib", "heyoka", "pandas", "xarray", "pyarrow"}
    result = python(f"import sys, kreisel; print(sorted(sys.modules.keys() & {optional}))")
    assert (result.returncode, result.stdout) == (0, "[]\n")
