"""The truths, the peers and the report. Nothing here asserts a time."""

import csv
import re
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))     # validation is a package of the source tree
pytest.importorskip("heyoka")
mp = pytest.importorskip("mpmath")

import kreisel as kr                                                        # noqa: E402
from validation import contenders, equations, machine, measure, report, tables, truth, workprecision   # noqa: E402
from validation.scenes import HORIZONS, SHORT, attitude_error, load         # noqa: E402

TIMES = [(name, t) for name, end in HORIZONS.items() for t in (SHORT, end)]


def numbers(texts):
    with mp.workdps(truth.DIGITS):
        return [mp.mpf(x) for x in texts]


def test_a_truth_computed_anew_is_the_one_kept():
    problem = load("thesis")
    kept = truth.stored("thesis", SHORT)
    (state,) = truth.integrator(problem)(equations.start(problem), [SHORT])
    assert truth.angle(state, numbers(kept["attitude"])) < 1e-31
    with mp.workdps(truth.DIGITS):
        assert max(abs(a - b) for a, b in zip(state[4:], numbers(kept["body_momentum"]))) < 1e-30


@pytest.mark.parametrize("name, t", TIMES)
def test_truths_keep_what_a_top_keeps(name, t):
    problem, kept = load(name), truth.stored(name, t)
    state = numbers(kept["attitude"] + kept["body_momentum"])
    with mp.workdps(truth.DIGITS):
        w, x, y, z = state[:4]
        up = [2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z]
        assert abs(sum(c * c for c in state[:4]) - 1) < 1e-32, "unit quaternion"
        assert abs(sum(m * u for m, u in zip(state[4:], up)) - mp.mpf(problem.momentum[2])) < 1e-30, "<m, e3>"
    assert truth.energy_error(problem, state) < 1e-31
    assert 0 < kept["agreement"] < 1e-30
    assert 1e-16 < kept["conditioning"] < 1e-13


@pytest.mark.parametrize("name, t", TIMES)
def test_heyoka_in_double_agrees_with_the_truth(name, t):
    kept = truth.stored(name, t)
    run = contenders.HeyokaRun(load(name), t, contenders.Setting(tol=contenders.EPS))
    assert attitude_error(run.solve(), kept["attitude"]) < 100 * kept["conditioning"]


@pytest.mark.parametrize("name", HORIZONS)
def test_extrap_agrees_with_the_truth(name):
    problem = load(name)
    path = kr.solve(problem.scene(), t=SHORT, method="extrap", tol=1e-12)
    assert attitude_error(path.q[-1], truth.stored(name, SHORT)["attitude"]) < 1e-8


@pytest.mark.parametrize("name", HORIZONS)
def test_energies_are_those_of_kreisel(name):
    problem = load(name)
    path = kr.solve(problem.scene(), t=[0, 1, 2, 3])
    kinetic, potential = problem.energies(path.q, path.m)
    assert (kinetic + potential).astype(float) == pytest.approx(path.energy, rel=1e-14)
    assert 1e-17 < problem.energy_error(path.q, path.m) < 1e-8


def test_attitude_error_is_an_angle_to_the_last_digit():
    for angle in (1e-15, 1e-9, 1e-3, 3.0):
        q = [mp.cos(angle / 2), 0, mp.sin(angle / 2), 0]
        assert attitude_error(list(map(float, q)), [1, 0, 0, 0]) == pytest.approx(angle, rel=1e-14)
    assert attitude_error([-1, 0, 0, 0], [1, 0, 0, 0]) == 0


def row(error, energy, seconds):
    known = {"attitude_error": error, "energy_error": energy, "samples": [seconds]}
    return workprecision.Row("thesis", 1.0, "m", False, **known)


def test_a_lucky_zero_does_not_win():
    lucky, honest, finer = row(1e-13, 1e-13, 1), row(5e-7, 1e-8, 2), row(1e-8, 1e-9, 3)
    assert workprecision.reaching([lucky, honest, finer], 1e-6) is lucky
    assert workprecision.reaching([lucky, honest, finer], 1e-9) is None, "the next tighter run is worse"
    assert workprecision.reaching([row(1e-13, 1e-5, 1), honest, finer], 1e-6) is honest, "the energy disagrees"
    assert workprecision.reaching([honest], 1e-6) is None, "nothing tighter bears it out"


def test_an_interruption_keeps_what_was_measured():
    calls = []

    def call():
        calls.append(1)
        if len(calls) == 5:
            raise KeyboardInterrupt
    samples, interrupted = measure.interleaved([call, call], [1.0, 1.0], rounds=10)
    assert interrupted and [len(own) for own in samples] == [2, 2]


@pytest.fixture(scope="module")
def quick(tmp_path_factory):
    out = tmp_path_factory.mktemp("report")
    assert report.main(["--quick", "--out", str(out)]) == 0
    return out


def test_the_report_writes_its_table(quick):
    lines = (quick / "workprecision.csv").read_text().splitlines()
    header = [line for line in lines if line.startswith("# ")]
    for key in ("machine", "compiler", "commit", "GSL"):
        assert any(re.match(rf"# {key}: \S", line) for line in header), key
    runs = list(csv.DictReader(line for line in lines if not line.startswith("#")))
    assert tuple(runs[0]) == tables.COLUMNS
    for name in HORIZONS:
        ran = {run["method"]: run for run in runs if run["scene"] == name}     # the tightest of each
        applicable = {method for method in kr.methods if kr.methods[method].applies_to(load(name).scene().body)}
        assert set(ran) == applicable | {"heyoka", "scipy_dop853"}
        for method, run in ran.items():
            assert float(run["attitude_error"]) < 1e-3, f"{method} on {name}"
            assert float(run["energy_error"]) < 1e-2, f"{method} on {name}"
            assert float(run["seconds"]) > 0 and not run["failure"], f"{method} on {name}"


def test_the_report_writes_its_page(quick):
    page = (quick / "index.html").read_text()
    assert page.count("<svg") == 3 * len(HORIZONS), "the path of the apex and two errors for each scene"
    assert not re.search(r"{{|{%|\bNone\b|\bnan\b|Undefined", page)
    assert not re.search(r"\bsrc=|<link|@import|url\((?!#)", page), "the page stands alone"
    assert (machine.GSL_MISSING in page) == (not machine.has_gsl())
    bodies = [load(scene).scene().body for scene in HORIZONS]
    for name, method in kr.methods.items():
        assert (f">{name}<" in page) == any(method.applies_to(body) for body in bodies)


def test_the_report_writes_the_table_of_the_readme(quick):
    lines = (quick / "readme_table.md").read_text().splitlines()
    assert len(lines) == 2 + len(HORIZONS) * len(tables.TARGETS)
    assert len({line.count("|") for line in lines}) == 1
