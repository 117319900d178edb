"""Tests of the report's chapter on the thesis."""

import re

import kreisel as kr
import numpy as np
import pytest
from axe import SIZES, list_violations

from validation.__main__ import main
from validation.thesis import chapter, figures_chapter6, integrals, trajectories
from validation.thesis.line_charts import thin_out

FIGURES = [f"5.{i}" for i in range(4, 15)] + [f"6.{i}" for i in range(1, 26)]
REFUTED = {  # (place, beginning of the sentence)
    ("4.2.1", "I3 ="),
    ("4.2.1", "p ="),
    ("5.6.6", "The total value of K"),
    ("5.7.2", "This corresponds"),
    ("6.3", "After 300"),
    ("6.4, 6.1.2", "After 600"),
    ("6.8", "By 600"),
    ("6.1.4", "<m, p>"),
    ("6.11", "The numerical"),
    ("6.2", "The numerical"),
    ("6.16", "At 600"),
    ("6.18", "At 3200 the numerical"),
    ("6.20", "After about 900"),
    ("6.21", "By 3200"),
    ("6.23", "By 3200"),
    ("6.24", "Energy"),
    ("6.4, A", "For long"),
    ("3.4", "The twelve"),
}
CONFIRMED = {
    ("6.2", "After 50"),
    ("6.1.3", "The trend"),
    ("6.9", "<m, a>"),
    ("6.10", "The energy error"),
    ("6.1.4", "H_"),
    ("6.13", "g = 10"),
    ("6.14", "The oscillating"),
    ("6.2.1", "An average of 7"),
    ("6.18", "At 3200 the integrable"),
    ("6.25", "Frame"),
    ("6.4", "The error"),
    ("5.7.2", "The bending"),
    ("6.1.5", "Settings"),
}


@pytest.fixture(scope="module")
def results():
    return chapter.run_experiments(lambda message: None)


@pytest.fixture(scope="module")
def page(results):
    return chapter.render_chapter(results, 1.0)


def test_every_figure_exists(page):
    for number in FIGURES:
        assert re.search(rf"<h3>Figure {re.escape(number)}[:(,]", page), number
    assert page.count("<svg") > 50
    assert "currentColor" in page and "#010203" not in page, "the ink is the page's"


def test_the_page_is_self_contained(page):
    text = re.sub(r"<svg.*?</svg>", "", page, flags=re.DOTALL)
    assert not re.search(r"{{|{%|\bNone\b|\bnan\b|\binf\b|Undefined|np\.float", text)
    assert not re.search(r"\bsrc=|<link|@import|url\((?!#)", page)
    assert len(page) < 4e6


def test_refuted_sentences_are_listed_as_links(results, page):
    sentences = chapter.check_sentences(results)
    places = [i for i, sentence in enumerate(sentences, 1) if not sentence.holds]
    links = page.split('<h2 id="not">')[1].split("<h2")[0]
    assert [int(i) for i in re.findall(r'href="#sentence-(\d+)"', links)] == places
    assert all(page.count(f'id="sentence-{i}"') == 1 for i in places)


def test_axe_finds_nothing_on_the_chapter(tmp_path, browser, page):
    file = tmp_path / chapter.OUTPUT
    file.write_text(page)
    assert list_violations(browser, file.as_uri(), sizes=SIZES[2:]) == []


def test_sentences_have_the_expected_verdicts(results):
    sentences = chapter.check_sentences(results)
    assert [
        sentence.says for sentence in sentences if not (sentence.holds or sentence.why)
    ] == [], "each has a reason"
    for place, begin in REFUTED | CONFIRMED:
        (match,) = [
            sentence
            for sentence in sentences
            if sentence.where == place and sentence.says.startswith(begin)
        ]
        assert match.holds == ((place, begin) in CONFIRMED), f"{place}, {begin}: {match.found}"


def test_the_report_writes_the_chapter(tmp_path, monkeypatch, results, page):
    monkeypatch.setattr(chapter, "run_experiments", lambda report: results)
    monkeypatch.setattr(chapter, "render_chapter", lambda results, seconds: page)
    assert main(["--thesis", "--out", str(tmp_path)]) == 0
    assert [file.name for file in tmp_path.iterdir()] == [chapter.OUTPUT]
    assert 'href="index.html"' in (tmp_path / chapter.OUTPUT).read_text()


def test_experiment_61_agrees_with_the_thesis(results):
    four = results.four
    assert [four.until("BS", t) for t in (50, 300, 600)] == pytest.approx(
        [0.122, 0.786, 1.459], rel=0.01
    )
    assert four.until("Ext", 300) < 0.01 and four.until("Ext", 600) < 0.05
    assert (four.blue.energy_error.min(), four.blue.energy_error.max()) == pytest.approx(
        (-0.603, 0.663), abs=1e-3
    )
    assert np.abs(four.term - four.blue.energy_error).max() < 1e-11
    assert np.ptp(four.blue.energy_error) / np.ptp(four.red.energy_error) == pytest.approx(
        20.03, abs=0.02
    )


def find_caption(figures, number):
    (caption,) = [figure.caption for figure in figures if figure.number == number]
    return caption


def test_captions_on_energies_describe_the_times_of_the_figures(results):
    four, equal_time = results.four, results.timed
    early = four.t < 50.1
    ratio = np.ptp(four.blue.energy_error[early]) / np.ptp(four.red.energy_error[early])
    caption = find_caption(figures_chapter6.draw_integrals(four), "6.10")
    assert f"The ratio of the ranges is {ratio:.2f}," in caption
    figures = list(figures_chapter6.draw_equal_time_energies(equal_time))
    for number, end in (("6.22", 1000.0), ("6.23", 3200.0)):
        error = equal_time.blue.energy_error[equal_time.t < end + 0.1]
        text = f"Bobenko-Suris {error.min():.3f} .. {error.max():.3f}, Extrap"
        assert text in find_caption(figures, number)
    assert np.ptp(equal_time.blue.energy_error[equal_time.t < 1000.1]) < np.ptp(
        equal_time.blue.energy_error
    )


def test_the_failing_top_agrees_with_the_thesis(results):
    error = results.failing.blue.energy_error
    assert (error.min(), error.max(), results.failing.blue.path.energy[0]) == pytest.approx(
        (-17.5, 21.9, 52.8), abs=0.05
    )
    assert results.failing.L["BS"][-1] == pytest.approx(0.513, abs=0.002)


def test_experiment_62_agrees_with_the_thesis(results):
    equal_time = results.timed
    assert equal_time.until("BS", 3200) == pytest.approx(0.194, abs=0.002)
    assert equal_time.until("BS 0.01", 3200) == pytest.approx(0.021, abs=0.001)
    assert (
        equal_time.green.steps / 640 == pytest.approx(5.97, abs=0.4)
        and equal_time.until("Ext", 3200) < 0.1
    )


def test_experiment_63_agrees_with_the_thesis(results):
    assert results.by_step[0.2].L["rk4"][-1] == pytest.approx(0.095, abs=0.002)
    assert results.by_step[0.2].rk4.evaluations == results.by_step[0.2].bs.evaluations == 600


def test_frame_errors_are_refused_for_different_times():
    one, other = (
        trajectories.solve_truth(trajectories.SCENE, np.linspace(0.0, end, 3)) for end in (1.0, 2.0)
    )
    with pytest.raises(ValueError, match=r"^the two trajectories are given at different times$"):
        trajectories.compute_frame_error(one, other)


def test_restarted_runs_equal_consecutive_runs():
    first = kr.solve(trajectories.SCENE, 0.4, method="extrap", tol=1e-5, step=0.1)
    second = kr.solve(first.end, 0.4, method="extrap", tol=1e-5, step=0.1)
    course = trajectories.solve_with_restarts(trajectories.SCENE, 0.4, 0.8)
    assert np.array_equal(course.path.q[1:], [first.q[-1], second.q[-1]])
    assert course.t.tolist() == [0.0, 0.4, 0.8]
    assert course.evaluations == first.stats.evaluations + second.stats.evaluations


def test_values_of_k_agree_with_the_thesis():
    assert list(integrals.compute_k_values().values()) == pytest.approx(
        [1.5255, 6.943, 0.5903, 4.198], rel=1e-3
    )


def test_the_error_of_a_frozen_frame_is_of_first_order():
    errors = [
        integrals.frozen_frame_error(interval, 20.0, kr.scenes.cusps) for interval in (0.01, 0.005)
    ]
    assert 1.7 < errors[0] / errors[1] < 2.3


@pytest.mark.parametrize("scene", ["thesis", "asymmetric"])
def test_both_forms_of_the_equations_agree(scene):
    one, other = (
        kr.solve(getattr(kr.scenes, scene), 20, method=form, tol=1e-12) for form in integrals.FORMS
    )
    assert kr.attitude_error(one.q[-1], other.q[-1]) < 1e-9
    assert np.abs(one.m[-1] - other.m[-1]).max() < 1e-8


def test_thinning_keeps_the_extreme_values():
    t = np.linspace(0, 1, 100_001)
    values = np.sin(3000 * t)
    values[777] = 5.0
    x, y = thin_out(t, values)
    assert len(x) <= 1002 and y.max() == 5.0 and y.min() == values.min() and (np.diff(x) > 0).all()


def test_the_frame_error_grows_with_the_energy_term(results):
    usual = results.growth[results.growth[:, 1] == 1.0]
    assert (np.diff(usual[:, 2]) > 0).all() and (np.diff(usual[:, 3]) > 0).all()
