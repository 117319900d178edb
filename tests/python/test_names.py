"""Public names: methods, conventions, help, representations, and what the package imports."""

from typing import get_args

import kreisel as kr
import numpy as np
import pytest
from kreisel import quaternion
from kreisel.types import QuantityName
from toolbox import python
from tops import CORNER, unit

TOP = kr.scenes.asymmetric
QUANTITIES = get_args(QuantityName)


def list_public_names(value):
    return {name for name in dir(value) if not name.startswith("_")}


def test_modules_list_their_public_names():
    for module in (kr.events, quaternion):
        assert dir(module) == sorted(module.__all__)


def test_methods_describe_themselves():
    rk4, strang = kr.methods["rk4"], kr.methods["strang"]
    assert (rk4.name, rk4.order) == ("rk4", 4) and rk4.algebraic
    assert not rk4.symplectic and strang.symplectic and strang.reversible
    exact = kr.methods["exact"]
    assert exact.exact and exact.symplectic and exact.rotors and not exact.implicit
    assert all(
        method.text and method.conserves and method.reference for method in kr.methods.values()
    )
    assert rk4.applies_to(CORNER) and not kr.methods["bobenko_suris"].applies_to(CORNER)
    lines = repr(kr.methods).splitlines()
    assert [line.split()[0] for line in lines] == list(kr.methods)
    assert "strang             2  kick, free drift, kick" in repr(kr.methods)


@pytest.mark.parametrize("name", ["gsl_rk8pd", "gsl_bsimp"])
def test_a_build_without_gsl_explains_its_missing_methods(name):
    with pytest.raises(KeyError, match="GNU Scientific Library"):
        type(kr.methods)()[name]


def test_the_attitude_error_is_the_angle_between():
    half = np.array([1e-150, 1e-12, 0.4, np.pi / 2])
    turns = np.stack([np.cos(half), np.sin(half), 0 * half, 0 * half], axis=-1)
    np.testing.assert_allclose(kr.attitude_error(turns, (1, 0, 0, 0)), 2 * half, rtol=1e-15)
    np.testing.assert_allclose(
        kr.attitude_error(-turns[2], turns[None]), 2 * abs(half[None] - 0.4), rtol=0, atol=1e-14
    )
    assert kr.attitude_error(turns[:, None], turns[None]).shape == (4, 4)
    with pytest.raises(ValueError, match="shape"):
        kr.attitude_error(turns[:, :3], turns)


def test_conventions_agree_with_the_core():
    quarter = kr.Scene(CORNER, momentum=(0, 0, 0), attitude=unit((1, 0, 0, 1)), gravity=1)
    assert quaternion.turn(quarter.attitude, (1.0, 0.0, 0.0)) == pytest.approx((0, 1, 0), abs=1e-15)
    expected = quaternion.turn(quarter.attitude, quaternion.turn(CORNER.axes, (1.0, 0.0, 0.0)))
    assert kr.solve(quarter, [0.0]).frame[0, 0] == pytest.approx(expected, abs=1e-15)
    assert (
        "scalar first" in quaternion.conventions() and "(0.0, 1.0, 0.0)" in quaternion.conventions()
    )


# Lists of names


WANTS = ["energy"], ["q", "q_low", "kinetic"], ["precession_angle", "nutation", "spin_angle"]


@pytest.mark.parametrize("words", [{}, *({"want": names} for names in WANTS)])
def test_dir_lists_the_quantities_of_a_path(words):
    path = kr.solve(TOP, [1.0, 2.0], **words)
    use = {
        "euler": lambda: path.euler(),
        "scene_at": lambda: path.scene_at(0),
        "specific_force": lambda: path.specific_force((1, 0, 0)),
        "position": lambda: path.position((1, 0, 0)),
        "point_velocity": lambda: path.point_velocity((1, 0, 0)),
        "point_acceleration": lambda: path.point_acceleration((1, 0, 0)),
        "modified_energy": lambda: path.modified_energy(0.1),
        "modified_energy4": lambda: path.modified_energy4(0.1),
        "plot": lambda: (path.apex, path.nutation, path.precession_angle),
        "animate": lambda: (path.q, path.apex),
    }
    for name in list_public_names(kr.solve(TOP, [1.0])) | {"states"}:
        try:
            use.get(name, lambda name=name: getattr(path, name))()
        except AttributeError:
            assert name not in dir(path)
        else:
            assert name in dir(path) or name.endswith("_low")
    if "want" not in words:
        assert list_public_names(path) >= {"states", "end", "rotation", "euler", *QUANTITIES}


# Other packages


MISSING = """
import sys
import numpy
libraries = "pandas xarray matplotlib scipy pyarrow distributed heyoka".split()
sys.modules |= dict.fromkeys(libraries)
import kreisel as kr
beside = {"rich", "click", *(f"kreisel.{name}" for name in ("_cli", "_fit", "_plot", "_sweep"))}
print(sorted(sys.modules.keys() & beside), kr.fit.__name__, "Record" in dir(kr))
path = kr.solve(kr.scenes.thesis, [0.0, 1.0])
path.to_csv("record.csv", "spin")
plan = 't = 1.0\\nscene = "thesis"\\nwant = ["spin"]\\ngrid = { spin = [1.0] }'
open("plan.toml", "w").write(plan)
for use in path.to_pandas, path.to_xarray, path.plot, lambda: path.rotation:
    try:
        use()
    except ImportError as error:
        print(error)
from importlib.metadata import entry_points
[command] = entry_points(group="console_scripts", name="kreisel")
for line in "fit record.csv thesis --plot a.png", "sweep plan.toml --folder runs":
    print(command.load().main(line.split(), standalone_mode=False))
"""


def test_missing_packages_are_named_with_their_installation(tmp_path):
    result = python(MISSING, cwd=tmp_path)
    lines = result.stdout.splitlines()
    assert lines[0] == "[] fit True"  # `import kreisel` needs NumPy and the core alone
    hints = {
        "pandas": "kreisel[tables]",
        "xarray": "kreisel[tables]",
        "matplotlib": "kreisel[plot]",
        "scipy": "pip install scipy",
    }
    for line, (name, hint) in zip(lines[1:5], hints.items(), strict=True):
        assert name in line and hint in line
    told = result.stderr.splitlines()
    assert len(told) == 2 and all(line.startswith("Error: this needs ") for line in told), told
    assert "kreisel[plot]" in told[0] and "kreisel[sweep]" in told[1]
    assert sorted(file.name for file in tmp_path.iterdir()) == ["plan.toml", "record.csv"]
