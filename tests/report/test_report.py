"""Tests of the report for built-in and user-defined scenes.

No assertion depends on run times.
"""

import csv
import re

import kreisel as kr
import pytest
from axe import SIZES, list_violations
from toolbox import open_context

from validation.competitors import machine
from validation.parts import atlas_cases, fastest, tasks, workprecision
from validation.references.problems import HORIZONS, load_problem
from validation.report import main as report


@pytest.fixture(scope="module")
def quick_report(tmp_path_factory):
    out = tmp_path_factory.mktemp("report")
    assert report.main(["--quick", "--only", "workprecision,truth", "--out", str(out)]) == 0
    return out


def rows_of(out):
    lines = (out / "workprecision.csv").read_text().splitlines()
    return list(csv.DictReader(line for line in lines if not line.startswith("#")))


def test_the_report_writes_its_table(quick_report):
    header = [
        line
        for line in (quick_report / "workprecision.csv").read_text().splitlines()
        if line.startswith("# ")
    ]
    for key in ("machine", "compiler", "commit", "GSL"):
        assert any(re.match(rf"# {key}: \S", line) for line in header), key
    assert tuple(rows_of(quick_report)[0]) == workprecision.COLUMNS
    for name in HORIZONS:
        runs_by_method = {
            run["method"]: run for run in rows_of(quick_report) if run["scene"] == name
        }  # the last run of each method has the tightest setting
        scene = load_problem(name).to_scene()
        methods = {method for method in kr.methods if kr.methods[method].suits(scene)}
        assert set(runs_by_method) == methods | {"heyoka", "scipy_dop853"}
        for method, run in runs_by_method.items():
            assert not run["failure"] and float(run["seconds"]) > 0, f"{method} on {name}"
            assert float(run["attitude_error"]) < 0.1 and float(run["energy_error"]) < 1e-2, (
                f"{method} on {name}"
            )


def test_the_report_writes_its_page(quick_report):
    page = (quick_report / "index.html").read_text()
    assert page.count("<svg") >= 7 * len(HORIZONS), (
        "the path of the apex, at least three families and three overviews a scene"
    )
    assert not re.search(r"{{|{%|\bNone\b|\bnan\b|Undefined", page)
    assert not re.search(r"\bsrc=|<link|@import|url\((?!#)", page), "the page stands alone"
    assert (machine.GSL_MISSING in page) == (not machine.has_gsl())
    scenes = [load_problem(name).to_scene() for name in HORIZONS]
    for name, method in kr.methods.items():
        assert (f">{name}<" in page) == any(method.suits(scene) for scene in scenes)
    anchors = set(re.findall(r'\bid="([^"]+)"', page))
    assert set(re.findall(r'href="#([^"]+)"', page.split("<svg")[0])) <= anchors, (
        "links within the page"
    )
    for file in set(re.findall(r'href="([^#"]+)"', page)) - {
        "thesis.html"
    }:  # a separate command makes this picture
        assert (quick_report / file).exists(), file


def test_figures_with_other_integrators_name_their_versions(quick_report):
    page, peers = (quick_report / "index.html").read_text(), machine.describe_machine()["peers"]
    assert re.match(r"heyoka [\d.]+, SciPy [\d.]+.*; \d{4}-\d\d-\d\d$", peers)
    figures = re.findall("<figure.*?</figure>", page, re.DOTALL)
    peer_figures = [figure for figure in figures if re.search("heyoka|scipy_|gsl_", figure)]
    assert len(peer_figures) >= 3 * len(HORIZONS)
    assert all(peers in figure.partition("<figcaption>")[2] for figure in peer_figures)


def test_axe_finds_nothing_on_the_report(quick_report, browser, tmp_path):
    """Check the accessibility of the whole report, and of two scenes with all sections open."""
    whole, short = quick_report / "index.html", tmp_path / "short.html"
    text = whole.read_text()
    for name in list(HORIZONS)[2:]:
        section = rf'<section>\s*<h3 id="{name}">.*?</section>'
        text, count = re.subn(section, "", text, count=1, flags=re.DOTALL)
        assert count
    short.write_text(text)
    assert list_violations(browser, whole.as_uri(), sizes=SIZES[:1]) == []
    assert list_violations(browser, short.as_uri(), open_folds=True, sizes=SIZES[2:]) == []


def count_folds(page):
    return page.evaluate("document.querySelectorAll('main details:not([open])').length")


def test_links_and_printing_open_folded_sections(quick_report, browser):
    page = open_context(browser, viewport={"width": 1280, "height": 800}).new_page()
    page.goto((quick_report / "index.html").as_uri())
    count = count_folds(page)
    assert count > len(HORIZONS) and not page.locator("#asymmetric").is_visible()
    page.evaluate("location.hash = '#asymmetric'")
    page.locator("#asymmetric").wait_for(state="visible")
    assert count > count_folds(page) > len(HORIZONS)
    page.evaluate("dispatchEvent(new Event('beforeprint'))")
    assert count_folds(page) == 0
    page.evaluate("dispatchEvent(new Event('afterprint'))")
    assert count_folds(page) > len(HORIZONS)
    page.close()


# Run times on a busy machine can recommend more than two methods, each in a row of its own.
KEEP_TWO_METHODS = """() => {
    const rows = [...document.querySelector('.advice').children];
    rows.slice(2, -2).forEach((row) => row.remove());
}"""


def test_the_first_screen_has_the_advice_and_phones_fold_the_contents(quick_report, browser):
    for size in SIZES:
        page = open_context(
            browser, viewport=dict(zip(("width", "height"), size, strict=True))
        ).new_page()
        page.goto((quick_report / "index.html").as_uri())
        assert page.locator("nav").is_visible() == (size[0] >= 1100)
        assert page.evaluate("document.documentElement.scrollWidth") <= size[0]
        page.evaluate(KEEP_TWO_METHODS)
        assert page.locator(".advice li").count() == 4
        for item in page.locator(".advice li").all():
            box = item.bounding_box()
            assert box["y"] + box["height"] < size[1]
        page.close()


def test_the_unfolded_page_is_short(quick_report, browser):
    page = open_context(browser, viewport={"width": 1280, "height": 800}).new_page()
    page.goto((quick_report / "index.html").as_uri())
    words = page.locator("main").inner_text().split()  # without closed folds
    height = page.evaluate("document.documentElement.scrollHeight")
    page.evaluate("document.querySelectorAll('details').forEach((fold) => (fold.open = true))")
    assert len(page.locator("main").inner_text().split()) > len(words) > 100
    assert len(words) <= 6000 and height <= 8 * 800, (len(words), height)
    page.close()


def test_the_report_writes_the_table_of_the_readme(quick_report):
    lines = (quick_report / "readme_table.md").read_text().splitlines()
    assert len(lines) == 2 + len(HORIZONS) * len(fastest.TARGETS)
    assert len({line.count("|") for line in lines}) == 1


def test_the_report_accepts_a_scene_of_the_user(tmp_path):
    """Check attitude errors in the report for a user-defined body in rotated axes."""
    body = kr.Body(1.0, [[2.0, 0.3, 0.1], [0.3, 1.5, -0.2], [0.1, -0.2, 1.0]], (0.1, 0.2, 0.6))
    kr.Scene(body, momentum=(0.5, -0.4, 2.0), gravity=2.0).to_toml(tmp_path / "mine.toml")
    assert report.main(["--quick", "--out", str(tmp_path), str(tmp_path / "mine.toml")]) == 0
    best = {run["method"]: float(run["attitude_error"]) for run in rows_of(tmp_path)}
    assert {run["scene"] for run in rows_of(tmp_path)} == {"mine"}
    assert best["heyoka"] < 1e-9 and best["extrap"] < 1e-5 and best["rk4"] < 1e-2
    assert report.main(["--out", str(tmp_path), str(tmp_path / "missing.toml")]) == 2


ODD = {
    "free": kr.Scene(kr.Body(1.0, (1.0, 0.8, 0.5), (0.0, 0.0, 0.0)), body_velocity=(0.5, 0.2, 3.0)),
    "nanoparticle": atlas_cases.scene_factory(
        lambda: atlas_cases.lagrange(1.2e-33, 1e-33, 1e-18, 1e-9),
        body_velocity=(1e6, 0.0, 1e9),
        gravity=9.81,
    )(),
}


@pytest.mark.parametrize("name", ODD)
def test_the_report_accepts_unusual_scenes(name, tmp_path):
    ODD[name].to_toml(tmp_path / f"{name}.toml")
    assert report.main(["--quick", "--out", str(tmp_path), str(tmp_path / f"{name}.toml")]) == 0
    page = (tmp_path / "index.html").read_text()
    assert f'id="{name}"' in page and not re.search(
        r"{{|{%|\bNone\b|\bnan\b|\binf\b|Undefined", page
    )


@pytest.mark.parametrize("content", ["", "[body\nmass = 1", "mass = 1"])
def test_invalid_scene_files_are_refused_by_name(content, tmp_path, capsys):
    (tmp_path / "wrong.toml").write_text(content)
    assert report.main(["--quick", "--out", str(tmp_path), str(tmp_path / "wrong.toml")]) == 2
    assert "wrong.toml" in capsys.readouterr().out.replace("\n", "")


def test_the_report_refuses_a_top_that_rests_forever(tmp_path, capsys):
    ODD["free"].replace(momentum=(0.0, 0.0, 0.0)).to_toml(tmp_path / "still.toml")
    assert report.main(["--quick", "--out", str(tmp_path), str(tmp_path / "still.toml")]) == 2
    assert "rests forever" in capsys.readouterr().out.replace("\n", " ")


HEAVY = {"mass": 1.0, "inertia": (1.0, 1.2, 0.7), "com": (0.1, 0.0, 0.5)}
UNKNOWN_TO_THE_REFERENCE = {
    "a rotor": ({"rotor": (0.3, 0.1, 0.5)}, {}),
    "friction": ({}, {"friction": 0.1}),
    "a turning support": ({}, {"turning": (0.0, 0.3, 0.0)}),
    "a shaken support": ({}, {"shaking": (0.1, 3.0, 0.0)}),
    "a rotor, friction": ({"rotor": (0.3, 0.1, 0.5)}, {"friction": 0.1}),
}


@pytest.mark.parametrize("reason", UNKNOWN_TO_THE_REFERENCE)
def test_the_report_refuses_a_top_without_reference_solution(reason, tmp_path):
    of_body, of_scene = UNKNOWN_TO_THE_REFERENCE[reason]
    body, file = kr.Body(**HEAVY, **of_body), tmp_path / "mine.toml"
    kr.Scene(body, body_velocity=(0.3, 0.2, 2.0), gravity=1, **of_scene).to_toml(file)
    with pytest.raises(ValueError, match=rf"mine\.toml: this top has {reason}, but"):
        report.load_problems([file], tasks.SIZES["quick"])
    assert report.main(["--quick", "--out", str(tmp_path / "out"), str(file)]) == 2
    assert not (tmp_path / "out").exists()


def test_the_report_refuses_a_top_at_rest_on_a_turning_support_for_its_support(tmp_path):
    file = tmp_path / "still.toml"
    ODD["free"].replace(momentum=(0.0, 0.0, 0.0), turning=(0.0, 0.0, 1.0)).to_toml(file)
    with pytest.raises(ValueError, match=r"still\.toml: this top has a turning support"):
        report.load_problems([file], tasks.SIZES["quick"])


def test_a_shaking_of_amplitude_zero_is_accepted(tmp_path):
    file = tmp_path / "mine.toml"
    kr.Scene(
        kr.Body(**HEAVY), body_velocity=(0.3, 0.2, 2.0), shaking=(0.0, 3.0, 1.0), gravity=1
    ).to_toml(file)
    assert len(report.load_problems([file], tasks.SIZES["quick"])) == 1


def test_the_report_refuses_an_unknown_part(capsys):
    with pytest.raises(SystemExit) as program_exit:
        report.main(["--only", "truth,magic"])
    assert program_exit.value.code == 2
    output = " ".join(capsys.readouterr().err.split())
    assert "unknown part 'magic'; parts are workprecision, many_starts, truth" in output
