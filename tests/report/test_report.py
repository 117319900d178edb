"""Tests of the report: it builds, has no gaps and no broken link, and accepts scenes of users.

No assertion depends on run times.
"""

import csv
import re

import kreisel as kr
import pytest
from axe import SIZES, list_violations
from toolbox import open_context

from validation.__main__ import main
from validation.competitors import machine
from validation.parts import advice, tasks
from validation.references import reference
from validation.references.problems import BRIEF, SHORT, attitude_error, load_problem
from validation.report import main as report
from validation.report.contents import PARTS

GAPS = r"{{|{%|\bNone\b(?! of)|\bnan\b|Undefined|np\.float"


@pytest.fixture(scope="module")
def quick_report(tmp_path_factory):
    """Return the folder of a quick report with all parts."""
    out = tmp_path_factory.mktemp("report")
    assert main(["--quick", "--out", str(out)]) == 0
    return out


@pytest.fixture(scope="module")
def page(quick_report):
    return (quick_report / "index.html").read_text()


def read_table(file):
    lines = file.read_text().splitlines()
    return list(csv.DictReader(line for line in lines if not line.startswith("#")))


def test_every_part_has_a_conclusion_figures_and_files_without_gaps(quick_report, page):
    sections = re.split(r'<h2 id="(\w+)">', page)
    texts = dict(zip(sections[1::2], sections[2::2], strict=True))
    for part in PARTS:
        text = re.sub(r"<svg.*?</svg>", "", texts[part.name], flags=re.DOTALL)
        assert not re.search(GAPS, text), part.name
        assert '<p class="conclusion">' in text, part.name
        files = set(re.findall(r'href="([^#"]+)"', text))
        assert files, part.name
        for file in files:
            rows = read_table(quick_report / file)
            assert rows and not any("nan" in row.values() for row in rows), file


def test_the_page_stands_alone_and_has_no_broken_link(quick_report, page):
    assert not re.search(r"\bsrc=|<link|@import|url\((?!#)", page)
    anchors = set(re.findall(r'\bid="([^"]+)"', page))
    links = re.sub(r"<svg.*?</svg>", "", page, flags=re.DOTALL)
    assert set(re.findall(r'href="#([^"]+)"', links)) <= anchors
    for file in set(re.findall(r'href="([^#"]+)"', links)) - {"thesis.html"}:
        assert (quick_report / file).exists(), file


def test_the_lead_is_short_and_diagrams_have_errors_upwards_and_times_to_the_right(page):
    lead = re.search(r"<h1>.*?</h1>\s*<p>(.*?)</p>", page, re.DOTALL)[1]
    assert len(re.sub("<[^>]*>", "", lead).split()) <= 80 and "compiles" in lead
    costs = [svg for svg in re.findall("<svg.*?</svg>", page, re.DOTALL) if "run time" in svg]
    assert len(costs) > 4
    for svg in costs:
        labels = re.findall(r'rotate\((-?\d+)[^"]*"[^>]*>([^<]*(?:error|run time)[^<]*)<', svg)
        assert all((turn == "-90") == ("error" in label) for turn, label in labels if turn), labels


def test_every_suitable_method_is_measured_on_every_scene(quick_report):
    rows = read_table(quick_report / "workprecision.csv")
    for name in BRIEF:
        # the last run of each method has the tightest setting
        runs = {run["method"]: run for run in rows if run["scene"] == name}
        scene = load_problem(name).to_scene()
        methods = {method for method in kr.methods if kr.methods[method].suits(scene)}
        assert set(runs) == methods | {"heyoka", "scipy_dop853"}
        for method, run in runs.items():
            assert not run["failure"] and float(run["seconds"]) > 0, f"{method} on {name}"
            assert float(run["attitude_error"]) < 0.1, f"{method} on {name}"


@pytest.mark.parametrize(
    ("file", "name", "column", "choose", "most"),
    [
        ("truths.csv", None, "away", max, 1e-12),
        ("ensembles.csv", ("mover", "taylor"), "middle", min, 1e-11),
        ("published.csv", ("by", "extrap"), "attitude_error", max, 1e-4),
        ("random_tops.csv", ("method", "exact"), "attitude_error", max, 1e-13),
        ("many_starts.csv", ("program", "kreisel"), "attitude_error", min, 1e-12),
        ("exponents.csv", None, "certificate", max, 1e-12),
        ("kowalewski.csv", None, "off", max, 1e-11),
    ],
)
def test_errors_are_as_small_as_kreisel_promises(quick_report, file, name, column, choose, most):
    rows = read_table(quick_report / file)
    own = [row for row in rows if name is None or row[name[0]] == name[1]]
    assert choose(abs(float(row[column])) for row in own if row[column]) < most


def test_figures_with_other_integrators_name_their_versions(page):
    peers = machine.describe_machine()["peers"]
    assert re.match(r"heyoka [\d.]+, SciPy [\d.]+.*; \d{4}-\d\d-\d\d$", peers)
    figures = re.findall("<figure.*?</figure>", page, re.DOTALL)
    shown = [figure for figure in figures if re.search("heyoka|scipy_|gsl_", figure)]
    assert len(shown) >= 3 * len(BRIEF)
    assert all(peers in figure for figure in shown)


def test_axe_finds_nothing_on_the_report(quick_report, browser):
    address = (quick_report / "index.html").as_uri()
    assert list_violations(browser, address, sizes=SIZES[:1]) == []


def test_links_and_printing_open_folded_sections(quick_report, browser):
    view = open_context(browser, viewport={"width": 1280, "height": 800}).new_page()
    view.goto((quick_report / "index.html").as_uri())
    closed = "document.querySelectorAll('main details:not([open])').length"
    count = view.evaluate(closed)
    assert count > len(BRIEF) and not view.locator("#asymmetric").is_visible()
    view.evaluate("location.hash = '#asymmetric'")
    view.locator("#asymmetric").wait_for(state="visible")
    assert count > view.evaluate(closed) > len(BRIEF)
    view.evaluate("dispatchEvent(new Event('beforeprint'))")
    assert view.evaluate(closed) == 0
    view.evaluate("dispatchEvent(new Event('afterprint'))")
    assert view.evaluate(closed) > len(BRIEF)
    view.close()


def test_the_line_that_answers_a_question_reaches_the_error(quick_report, browser):
    """Run what a reader copies, and compare its attitude with the reference solution."""
    view = open_context(browser, viewport={"width": 1280, "height": 800}).new_page()
    view.goto((quick_report / "index.html").as_uri())
    box = view.locator("#question")
    for name in BRIEF:
        problem = load_problem(name)
        box.locator("[name=top]").select_option(advice.name_kind(problem))
        truth = reference.truth_of(problem, SHORT)["attitude"]
        for error in box.locator("[name=error] option").all_text_contents():
            box.locator("[name=error]").select_option(error)
            assert name in box.locator("[name=motion] option").first.text_content()
            if box.locator("tr.own").count():
                line = box.locator("code").text_content()
                assert "step" not in line  # which would fit this motion alone
                path = eval(line, {"kr": kr, "scene": problem.to_scene()})
                assert attitude_error(path.q[-1], truth) <= float(error.split()[0])
    view.close()
    plain = open_context(browser, java_script_enabled=False).new_page()
    plain.goto((quick_report / "index.html").as_uri())
    assert (
        plain.locator("table.advice").is_visible() and not plain.locator("#question").is_visible()
    )
    plain.close()


@pytest.mark.parametrize("size", SIZES)
def test_no_screen_scrolls_sideways(quick_report, browser, size):
    viewport = dict(zip(("width", "height"), size, strict=True))
    view = open_context(browser, viewport=viewport).new_page()
    view.goto((quick_report / "index.html").as_uri())
    assert view.locator("nav").is_visible() == (size[0] >= 1100)
    assert view.evaluate("document.documentElement.scrollWidth") <= size[0]
    view.close()


OWN = {
    "rotated": kr.Scene(
        kr.Body(1.0, [[2.0, 0.3, 0.1], [0.3, 1.5, -0.2], [0.1, -0.2, 1.0]], (0.1, 0.2, 0.6)),
        momentum=(0.5, -0.4, 2.0),
        gravity=2.0,
    ),
    "free": kr.Scene(kr.Body(1.0, (1.0, 0.8, 0.5), (0.0, 0.0, 0.0)), body_velocity=(0.5, 0.2, 3.0)),
    "nanoparticle": kr.Scene(
        kr.Body.symmetric(1e-18, 1.2e-33, 1e-33, 1e-9, unphysical=True),
        body_velocity=(1e6, 0.0, 1e9),
        gravity=9.81,
    ),
}


def test_the_report_accepts_scenes_of_users(tmp_path):
    files = [str(tmp_path / f"{name}.toml") for name in OWN]
    for scene, file in zip(OWN.values(), files, strict=True):
        scene.to_toml(file)
    assert main(["--quick", "--out", str(tmp_path), *files]) == 0
    text = (tmp_path / "index.html").read_text()
    assert not re.search(rf"{GAPS}|\binf\b", text)
    errors = {}
    for run in read_table(tmp_path / "workprecision.csv"):
        errors[run["scene"], run["method"]] = float(run["attitude_error"])
    for name in OWN:
        assert f'id="{name}"' in text and errors[name, "heyoka"] < 1e-9
        assert errors[name, "extrap"] < 1e-5 and errors[name, "rk4"] < 1e-2


HEAVY = kr.Body(1.0, (1.0, 1.2, 0.7), (0.1, 0.0, 0.5))
ROTOR = kr.Body(1.0, (1.0, 1.2, 0.7), (0.1, 0.0, 0.5), rotor=(0.3, 0.1, 0.5))
REST = {"momentum": (0.0, 0.0, 0.0), "gravity": 0.0}


@pytest.mark.parametrize(
    ("body", "words", "reason"),
    [
        (ROTOR, {}, "a rotor"),
        (HEAVY, {"friction": 0.1}, "friction"),
        (HEAVY, {"turning": (0.0, 0.3, 0.0)}, "a turning support"),
        (HEAVY, {"shaking": (0.1, 3.0, 0.0)}, "a shaken support"),
        (ROTOR, {"friction": 0.1}, "a rotor, friction"),
        (HEAVY, REST, "rests"),
        (HEAVY, REST | {"turning": (0.0, 0.0, 1.0)}, "a turning support"),
    ],
)
def test_the_report_refuses_tops_that_it_cannot_check(body, words, reason, tmp_path, capsys):
    file = tmp_path / "mine.toml"
    kr.Scene(body, **{"momentum": (0.3, 0.2, 2.0), "gravity": 1} | words).to_toml(file)
    with pytest.raises(ValueError, match=rf"mine\.toml: .*{reason}"):
        report.load_problems([file], tasks.SIZES["quick"])
    assert main(["--quick", "--out", str(tmp_path / "out"), str(file)]) == 2
    assert not (tmp_path / "out").exists() and "mine.toml" in "".join(
        capsys.readouterr().out.split()
    )


@pytest.mark.parametrize("content", [None, "", "[body\nmass = 1", "mass = 1"])
def test_invalid_scene_files_are_refused_by_name(content, tmp_path, capsys):
    if content is not None:
        (tmp_path / "wrong.toml").write_text(content)
    assert main(["--quick", "--out", str(tmp_path), str(tmp_path / "wrong.toml")]) == 2
    assert "wrong.toml" in capsys.readouterr().out.replace("\n", "")


def test_a_report_of_a_part_without_methods_has_no_table_of_methods(tmp_path):
    assert main(["--quick", "--only", "engines", "--out", str(tmp_path)]) == 0
    text = (tmp_path / "index.html").read_text()
    assert "methods" not in re.findall(r'(?:id="|href="#)(\w+)', text)


def test_the_report_refuses_an_unknown_part(capsys):
    with pytest.raises(SystemExit) as program_exit:
        main(["--only", "truth,magic"])
    assert program_exit.value.code == 2 and "magic" in capsys.readouterr().err
