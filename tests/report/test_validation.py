"""The truths, the peers and the report. Nothing here asserts a time."""

import csv
import re
from dataclasses import replace

import kreisel as kr
import mpmath as mp
import pytest

from validation.parts import race, runs, workprecision
from validation.parts.budget import BUDGETS, Task, work_through
from validation.parts.store import Store
from validation.peers import contenders, machine, measure
from validation.report import main as report
from validation.truth import reference
from validation.truth.problems import HORIZONS, SHORT, attitude_error, described, load

TIMES = [(name, t) for name, end in HORIZONS.items() for t in (SHORT, end)]


def numbers(texts):
    with mp.workdps(reference.DIGITS):
        return [mp.mpf(x) for x in texts]


def test_a_truth_computed_anew_is_the_one_kept():
    problem = load("thesis")
    kept = reference.stored("thesis", SHORT)
    (state,) = reference.states(problem, [SHORT])
    assert reference.angle(state, numbers(kept["attitude"])) < 1e-31
    with mp.workdps(reference.DIGITS):
        assert (
            max(abs(a - b) for a, b in zip(state[4:], numbers(kept["body_momentum"]), strict=True))
            < 1e-30
        )


@pytest.mark.parametrize("name, t", TIMES)
def test_truths_keep_what_a_top_keeps(name, t):
    problem, kept = load(name), reference.stored(name, t)
    state = numbers(kept["attitude"] + kept["body_momentum"])
    with mp.workdps(reference.DIGITS):
        w, x, y, z = state[:4]
        up = [2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z]
        assert abs(sum(c * c for c in state[:4]) - 1) < 1e-32, "unit quaternion"
        assert (
            abs(
                sum(m * u for m, u in zip(state[4:], up, strict=True)) - mp.mpf(problem.momentum[2])
            )
            < 1e-30
        ), "<m, e3>"
    assert reference.energy_error(problem, state) < 1e-31
    assert 0 < kept["agreement"] < 1e-28
    assert 1e-15 < kept["conditioning"] < 1e-10


@pytest.mark.parametrize("name", HORIZONS)
def test_truths_by_all_ways_agree_within_the_conditioning(name):
    kept = reference.stored(name, SHORT)
    apart = dict(reference.ways(load(name), SHORT, kept))
    assert apart.pop("heyoka, 128 bit, momentum") < 1e-28
    assert apart.pop("heyoka, 128 bit, spin apart", 0.0) < 1e-28
    assert apart.pop("heyoka, 80 bit") < kept["conditioning"] / 10
    for way, angle in apart.items():
        assert angle < 10 * kept["conditioning"], way


def test_the_conditioning_is_what_a_moved_scene_shows():
    problem, size = load("asymmetric"), 1e-8
    moved = kr.Scene(
        problem.scene().body, [m * (1 + size) for m in problem.momentum], problem.attitude
    )
    ends = [
        kr.solve(scene, 30.0, method="extrap", tol=1e-13).q[-1]
        for scene in (problem.scene(), moved)
    ]
    expected = reference.stored("asymmetric", 30.0)["conditioning"] * size / reference.ROUNDING
    assert 0.01 * expected < attitude_error(*ends) < expected, (
        "the momentum is only part of the data"
    )


def test_a_truth_computed_on_the_way_does_not_depend_on_units_or_frame():
    scene = kr.scenes.thesis
    here = reference.on_the_way(described("here", scene), SHORT)
    assert attitude_error(here["attitude"], reference.stored("thesis", SHORT)["attitude"]) < 1e-18
    far = kr.Scene(
        kr.Body(
            2.0**-60,
            [x * 2.0**-100 for x in scene.body.inertia],
            [z * 2.0**-20 for z in scene.body.com],
        ),
        [m * 2.0**-90 for m in scene.momentum],
        gravity=1.0,
    )
    with_rate = reference.on_the_way(described("far", far), SHORT * 2.0**-10)
    assert attitude_error(here["attitude"], with_rate["attitude"]) < 1e-18


@pytest.mark.parametrize("name, t", TIMES)
def test_heyoka_in_double_agrees_with_the_truth(name, t):
    kept = reference.stored(name, t)
    run = contenders.HeyokaRun(load(name), t, contenders.Setting(tol=contenders.EPS))
    assert attitude_error(run.solve(), kept["attitude"]) < 100 * kept["conditioning"]


@pytest.mark.parametrize("name", HORIZONS)
def test_extrap_agrees_with_the_truth(name):
    problem = load(name)
    path = kr.solve(problem.scene(), t=SHORT, method="extrap", tol=1e-12)
    assert attitude_error(path.q[-1], reference.stored(name, SHORT)["attitude"]) < 1e-8


@pytest.mark.parametrize("name", HORIZONS)
def test_energies_are_those_of_kreisel(name):
    problem = load(name)
    path = kr.solve(problem.scene(), t=[0, 1, 2, 3])
    kinetic, potential = problem.energies(path.q, path.m)
    assert (kinetic + potential).astype(float) == pytest.approx(path.energy, rel=1e-14)
    assert problem.energy_error(path.q, path.m) < 1e-8


def test_attitude_error_is_an_angle_to_the_last_digit():
    for angle in (1e-15, 1e-9, 1e-3, 3.0):
        q = [mp.cos(angle / 2), 0, mp.sin(angle / 2), 0]
        assert attitude_error(list(map(float, q)), [1, 0, 0, 0]) == pytest.approx(angle, rel=1e-14)
    assert attitude_error([-1, 0, 0, 0], [1, 0, 0, 0]) == 0


def row(error, energy, seconds):
    known = {"tol": error, "attitude_error": error, "energy_error": energy, "samples": [seconds]}
    return runs.Measurement("thesis", 1.0, "m", False, **known)


def test_a_lucky_zero_does_not_win():
    lucky, honest, finer = row(1e-13, 1e-13, 1), row(5e-7, 1e-8, 2), row(1e-8, 1e-9, 3)
    assert race.reaching([lucky, honest, finer], 1e-6) is lucky
    assert race.reaching([lucky, honest, finer], 1e-9) is None, "the next tighter run is worse"
    assert race.reaching([row(1e-13, 1e-5, 1), honest, finer], 1e-6) is honest, (
        "the energy disagrees"
    )
    assert race.reaching([honest], 1e-6) is None, "nothing tighter bears it out"
    closed_form = replace(honest, tol=None)
    assert race.reaching([closed_form], 1e-6) is closed_form


def test_an_interruption_keeps_what_was_measured():
    calls = []

    def call():
        calls.append(1)
        if len(calls) == 5:
            raise KeyboardInterrupt

    samples, interrupted = measure.interleaved([call, call], [1.0, 1.0], rounds=10)
    assert interrupted and [len(own) for own in samples] == [2, 2]


def test_what_was_found_is_kept_and_not_found_again(tmp_path):
    made = []

    def make(i):
        if i == 2 and len(made) < 3:
            made.append("interrupted")
            raise KeyboardInterrupt
        made.append(i)
        return i

    class Bar:
        add_task = update = advance = staticmethod(lambda *args, **words: None)

    for expected in ("interrupted", ""):
        store = Store(tmp_path / "findings.jsonl", ["as before"])
        outcome = work_through(
            [Task(f"task/{i}", lambda i=i: make(i)) for i in range(4)], store, BUDGETS["quick"], Bar
        )
        assert outcome.startswith(expected) and bool(outcome) == bool(expected)
    assert made == [0, 1, "interrupted", 2, 3]
    kept = (tmp_path / "findings.jsonl").read_text()
    (tmp_path / "findings.jsonl").write_text(kept + "[cut off")
    assert Store(tmp_path / "findings.jsonl", ["as before"]).under("task/") == [0, 1, 2, 3]
    assert Store(tmp_path / "findings.jsonl", ["another machine"]).known == {}


@pytest.fixture(scope="module")
def quick(tmp_path_factory):
    out = tmp_path_factory.mktemp("report")
    assert report.main(["--quick", "--only", "workprecision,truth", "--out", str(out)]) == 0
    return out


def rows_of(out):
    lines = (out / "workprecision.csv").read_text().splitlines()
    return list(csv.DictReader(line for line in lines if not line.startswith("#")))


def test_the_report_writes_its_table(quick):
    header = [
        line
        for line in (quick / "workprecision.csv").read_text().splitlines()
        if line.startswith("# ")
    ]
    for key in ("machine", "compiler", "commit", "GSL"):
        assert any(re.match(rf"# {key}: \S", line) for line in header), key
    assert tuple(rows_of(quick)[0]) == workprecision.COLUMNS
    for name in HORIZONS:
        ran = {
            run["method"]: run for run in rows_of(quick) if run["scene"] == name
        }  # the tightest of each
        scene = load(name).scene()
        suited = {method for method in kr.methods if kr.methods[method].suits(scene)}
        assert set(ran) == suited | {"heyoka", "scipy_dop853"}
        for method, run in ran.items():
            assert not run["failure"] and float(run["seconds"]) > 0, f"{method} on {name}"
            if method != "scipy_dop853":  # stopped early where it is slow
                assert float(run["attitude_error"]) < 0.1 and float(run["energy_error"]) < 1e-2, (
                    f"{method} on {name}"
                )


def test_the_report_writes_its_page(quick):
    page = (quick / "index.html").read_text()
    assert page.count("<svg") >= 7 * len(HORIZONS), (
        "the path of the apex, at least three families and three overviews a scene"
    )
    assert not re.search(r"{{|{%|\bNone\b|\bnan\b|Undefined", page)
    assert not re.search(r"\bsrc=|<link|@import|url\((?!#)", page), "the page stands alone"
    assert (machine.GSL_MISSING in page) == (not machine.has_gsl())
    scenes = [load(name).scene() for name in HORIZONS]
    for name, method in kr.methods.items():
        assert (f">{name}<" in page) == any(method.suits(scene) for scene in scenes)
    anchors = set(re.findall(r'\bid="([^"]+)"', page))
    assert set(re.findall(r'href="#([^"]+)"', page.split("<svg")[0])) <= anchors, (
        "links within the page"
    )
    for file in set(re.findall(r'href="([^#"]+)"', page)) - {
        "thesis.html"
    }:  # that one has a command of its own
        assert (quick / file).exists(), file


def test_the_report_writes_the_table_of_the_readme(quick):
    lines = (quick / "readme_table.md").read_text().splitlines()
    assert len(lines) == 2 + len(HORIZONS) * len(race.TARGETS)
    assert len({line.count("|") for line in lines}) == 1


def test_the_report_takes_a_scene_of_ones_own(tmp_path):
    """It is described in a frame that is not its principal one: errors must come out small all the
    same."""
    turned = kr.Body(1.0, [[2.0, 0.3, 0.1], [0.3, 1.5, -0.2], [0.1, -0.2, 1.0]], (0.1, 0.2, 0.6))
    kr.Scene(turned, momentum=(0.5, -0.4, 2.0), gravity=2.0).to_toml(tmp_path / "mine.toml")
    assert report.main(["--quick", "--out", str(tmp_path), str(tmp_path / "mine.toml")]) == 0
    best = {run["method"]: float(run["attitude_error"]) for run in rows_of(tmp_path)}
    assert {run["scene"] for run in rows_of(tmp_path)} == {"mine"}
    assert best["heyoka"] < 1e-9 and best["extrap"] < 1e-5 and best["rk4"] < 1e-2
    assert report.main(["--out", str(tmp_path), str(tmp_path / "missing.toml")]) == 2
