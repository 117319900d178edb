"""Tests of the report's chapter on the thesis: its numbers, its verdicts and its errata."""

import re

import kreisel as kr
import numpy as np
import pytest
from axe import SIZES, list_violations

from validation.__main__ import main
from validation.thesis import chapter, errata, errata_maps, su2, trajectories
from validation.thesis.scaled_units import h_eps, scaled_units
from validation.thesis.sentences import check_sentences
from validation.thesis.trajectories import SCENE

FIGURES = [f"5.{i}" for i in range(4, 15)] + [f"6.{i}" for i in range(1, 26)]
REFUTED = [  # places, in the order of the chapter
    *("3.4", "4.2.1", "4.2.1", "5.6.6", "5.7.2", "6.3", "6.4, 6.1.2", "6.7", "6.8", "6.1.4"),
    *("6.11", "6.2", "6.2.1", "6.2.1", "6.16", "6.18", "6.20", "6.21", "6.23", "6.24", "6.4, A"),
]
BY_TIME = {"6.2.1", "6.4, A", "A"}  # places of sentences about run times
ERRATA = (  # the error of the text, to within a tenth, and the largest error of the correction
    *((2.42, 5e-3), (8.5e-2, 1e-13), (2.96, 5e-3), (1.83, 1e-14), (0.26, 1e-11)),
    *((0.72, 1e-11), (0.62, 1e-14), (0.25, 0.0), (0.306, 1e-7), (1.41, 1e-14)),
    *((0.752, 1e-13), (0.21, 1e-15), (1.23, 1e-7), (9.64, 1e-9), (1.0, 0.03)),
)


@pytest.fixture(scope="module")
def results():
    return chapter.run_experiments(lambda message: None)


@pytest.fixture(scope="module")
def page(results):
    return chapter.render_chapter(results, 1.0)


def test_the_chapter_has_all_figures_and_stands_alone(page):
    for number in FIGURES:
        assert re.search(rf"<h3>Figure {re.escape(number)}[:(,]", page), number
    text = re.sub(r"<svg.*?</svg>", "", page, flags=re.DOTALL)
    assert page.count("<svg") > 50 and "#010203" not in page, "the ink is that of the page"
    assert not re.search(r"{{|{%|\bNone\b|\bnan\b|\binf\b|Undefined|np\.float", text)
    assert not re.search(r"\bsrc=|<link|@import|url\((?!#)", page) and len(page) < 4e6
    links, anchors = (set(re.findall(rf'{key}="#?([^"]+)"', text)) for key in ("href", "id"))
    assert links - anchors <= {"index.html"}


def test_axe_finds_nothing_on_the_chapter(tmp_path, browser, page):
    file = tmp_path / chapter.OUTPUT
    file.write_text(page)
    assert list_violations(browser, file.as_uri(), sizes=SIZES[2:]) == []


def test_the_report_writes_the_chapter(tmp_path, monkeypatch, results, page):
    monkeypatch.setattr(chapter, "run_experiments", lambda report: results)
    monkeypatch.setattr(chapter, "render_chapter", lambda results, seconds: page)
    assert main(["--thesis", "--out", str(tmp_path)]) == 0
    assert [file.name for file in tmp_path.iterdir()] == [chapter.OUTPUT]


def test_sentences_have_the_expected_verdicts(results):
    sentences = check_sentences(results)
    assert all(sentence["holds"] or sentence["why"] for sentence in sentences)
    places = [s["where"] for s in sentences if not s["holds"] and s["where"] not in BY_TIME]
    assert places == [place for place in REFUTED if place not in BY_TIME]


@pytest.mark.parametrize(
    ("expected", "measure", "tolerance"),
    [
        (0.122, lambda r: r.four.until("BS", 50), 0.002),
        (0.786, lambda r: r.four.until("BS", 300), 0.008),
        (1.459, lambda r: r.four.until("BS", 600), 0.015),
        (0.0, lambda r: r.four.until("Ext", 600), 0.05),
        (-0.603, lambda r: r.four.blue.energy_error.min(), 1e-3),
        (0.663, lambda r: r.four.blue.energy_error.max(), 1e-3),
        (0.0, lambda r: np.abs(r.four.term - r.four.blue.energy_error).max(), 1e-11),
        (-17.5, lambda r: r.failing.blue.energy_error.min(), 0.05),
        (0.513, lambda r: r.failing.L["BS"][-1], 0.002),
        (0.194, lambda r: r.timed.until("BS", 3200), 0.002),
        (0.021, lambda r: r.timed.until("BS 0.01", 3200), 0.001),
        (5.97, lambda r: r.timed.green.steps / 640, 0.4),
        (0.095, lambda r: r.by_step[0.2].L["rk4"][-1], 0.002),
        (600, lambda r: r.by_step[0.2].rk4.evaluations, 0),
        (600, lambda r: r.by_step[0.2].bs.evaluations, 0),
    ],
)
def test_experiments_agree_with_the_thesis(results, expected, measure, tolerance):
    assert measure(results) == pytest.approx(expected, abs=tolerance)


def test_the_printed_text_is_wrong_and_the_correction_is_right():
    rows = errata.compute_errata()
    for row, (wrong, right) in zip(rows, ERRATA, strict=True):
        assert row["printed_error"] == pytest.approx(wrong, rel=0.1), row["where"]
        assert row["corrected_error"] <= right, row["where"]


@pytest.mark.parametrize("scene", [errata_maps.SCALED, errata_maps.TILTED])
def test_the_run_of_theorem_42_follows_the_theorem_literally(scene):
    path = trajectories.solve_theorem42(scene, 0.05, 5.0).path
    for form in 1, 2:
        assert kr.attitude_error(su2.run_theorem42(scene, 0.05, 5.0, form=form), path.q[-1]) < 1e-11


def test_restarted_runs_equal_consecutive_runs():
    first = kr.solve(SCENE, 0.4, method="extrap", tol=1e-5, step=0.1)
    second = kr.solve(first.end, 0.4, method="extrap", tol=1e-5, step=0.1)
    course = trajectories.solve_with_restarts(SCENE, 0.4, 0.8)
    assert np.array_equal(course.path.q[1:], [first.q[-1], second.q[-1]])
    assert course.evaluations == first.stats.evaluations + second.stats.evaluations


def test_scaled_units_change_neither_times_nor_attitudes():
    body = kr.Body.cuboid(half=(0.3, 0.3, 2.5), pivot=(0, 0, -2.5), density=3.0)
    scene = kr.Scene(body, momentum=(10, 3, 1), gravity=9.81)
    scaled = scaled_units(body).into(scene)
    one, other = (kr.solve(s, 2.0, method="strang", step=0.01) for s in (scene, scaled))
    assert kr.attitude_error(one.q[-1], other.q[-1]) < 1e-12 and scaled.body.com == (0, 0, 1)
    with pytest.raises(ValueError, match="kowalewski"):
        scaled_units(kr.scenes.kowalewski.body)


def test_h_eps_equals_the_formula_of_the_thesis_and_is_conserved():
    scaled, step = scaled_units(SCENE.body).into(SCENE), 0.2
    path = kr.solve(scaled, 100, method="bobenko_suris", step=step, every=1)
    p = np.array((0, 0, scaled.body.mass * scaled.gravity))
    text = (path.m**2).sum(-1) / 2 + path.apex @ p + step / 2 * np.cross(path.apex, path.m) @ p
    assert h_eps(path, step) == pytest.approx(text, abs=1e-13) and np.ptp(text) < 1e-13
