"""Tests of what notebooks display: pictures of results, and tables."""

import re
from pathlib import Path

import kreisel as kr
import numpy as np
import pytest
from kreisel.types import Row, Table
from toolbox import python
from tops import GENERAL

TOP = kr.scenes.asymmetric
TOPS = kr.starts(TOP.body, energy=2, vertical=1, n=5, seed=2, gravity=1)
PICTURES = {
    "path": lambda: kr.solve(GENERAL, [0.0, 1.0]),
    "wanted path": lambda: kr.solve(GENERAL, [1.0], want=("apex", "nutation", "precession_angle")),
    "section": lambda: kr.section(TOPS, n=3),
    "indicator": lambda: kr.chaos(TOPS, 10.0),
    "map of an indicator": lambda: kr.chaos(
        TOP.vary(gravity=[[0.5], [1.0]], spin=[1.0, 2.0]), 10.0
    ),
    "frequencies": lambda: kr.frequencies(kr.solve(kr.scenes.cusps, np.linspace(0, 50, 1001))),
    "steady rotations": lambda: kr.steady(TOP.body, [1.0, 2.0], gravity=1),
    "rod": lambda: kr.rod(kr.solve(kr.scenes.cusps, np.linspace(0, 5, 101))),
}
WITHOUT = {
    "path without states": lambda: kr.solve(GENERAL, []),
    "path without apex": lambda: kr.solve(GENERAL, [1.0], want=("energy",)),
    "section of no top": lambda: kr.section(TOPS[:0], n=3),
    "indicator of no top": lambda: kr.chaos(TOPS[:0], 1.0),
    "indicator of three dimensions": lambda: kr.chaos(
        kr.Scene(TOP.body, momentum=np.ones((2, 1, 2, 3)), gravity=1), 1.0
    ),
    "rod of one state": lambda: kr.rod(kr.solve(kr.scenes.cusps, [1.0])),
}


@pytest.mark.parametrize("kind", PICTURES)
def test_notebooks_show_pictures_of_results(kind):
    pytest.importorskip("matplotlib")
    result = PICTURES[kind]()
    html = result._repr_html_()
    assert 'src="data:image/png;base64,iVBORw0KGgo' in html
    assert type(result).__name__ in html


@pytest.mark.parametrize("kind", WITHOUT)
def test_notebooks_show_text_if_there_is_nothing_to_draw(kind):
    assert WITHOUT[kind]()._repr_html_() is None


def test_notebooks_show_plots_and_no_pictures_of_long_paths():
    pytest.importorskip("matplotlib")
    assert kr.plot(kr.solve(GENERAL, [0.0, 1.0]))._repr_png_().startswith(b"\x89PNG\r\n")
    assert kr.solve(kr.scenes.cusps, np.linspace(0.0, 1.0, 300_000))._repr_html_() is None


WITHOUT_MATPLOTLIB = """
import sys
sys.modules["matplotlib"] = None
sys.path.append("../repo")
from test_displays import PICTURES
print({make()._repr_html_() for make in PICTURES.values()})
"""


def test_without_matplotlib_notebooks_show_text():
    result = python(WITHOUT_MATPLOTLIB, cwd=Path(__file__).parent)
    assert result.stdout == "{None}\n", result.stderr


CONE = kr.Body.cone(radius=0.03, height=[0.06, 0.07], pivot=(0, 0, 0), mass=0.1)
TABLES = {  # what is shown, and rows of it whose numbers are known without the program
    "body": (lambda: CONE, {"mass": "0.1 [M]", "com": "0, 0, 0.045 .. 0.0525 [L]"}),
    "full inertia": (
        lambda: kr.Body(1, [[3, 0.5, 0], [0.5, 3, 0], [0, 0, 2]], (0, 0, 0)),
        {"inertia": "3, 0.5, 0; 0.5, 3, 0; 0, 0, 2 [M L^2]"},
    ),
    "scene": (lambda: kr.scenes.cusps, {"gravity": "1 [L T^-2]", "com": "0, 0, 1 [L]"}),
    "supported scene": (
        lambda: GENERAL.replace(shaking=(0.1, 200, 0), turning=(0, 0, 3)),
        {"shaking": "0.1, 200, 0 [L, rad/T, rad]", "turning": "0, 0, 3 [rad/T]"},
    ),
    "scenes in degrees": (
        lambda: kr.Scene.spinning(CONE, spin=[[10], [30]], tilt=20, degrees=True, gravity=9.81),
        {"spin": "10 .. 30 [deg/T]", "height": "0.06 .. 0.07 [L]", "mass": "0.1 [M]"},
    ),
    "no scene": (lambda: kr.scenes.cusps.vary(gravity=[1.0, 2.0])[:0], {}),
    "closed form": (
        lambda: kr.exact(kr.scenes.cusps),
        {"motion type": "cusps ", "least nutation": f"{np.arccos(0.6):.6g} [rad]"},
    ),
    "free body": (
        lambda: kr.exact(kr.Scene(kr.Body(1, (1, 2, 2.5), (0, 0, 0)), momentum=(1, 2, 3))),
        {"momentum": "1, 2, 3 [M L^2 T^-1]"},
    ),
    "torus": (lambda: kr.exact(kr.scenes.kowalewski), {"kind": "kowalewski "}),
    "closed forms": (
        lambda: kr.exact(kr.scenes.cusps.vary(gravity=[1, 2])),
        {"gravity": "1 .. 2 [L T^-2]"},
    ),
    "ensemble": (
        lambda: kr.solve(kr.scenes.cusps.vary(gravity=np.linspace(1, 2, 9)), [0, 1, 2]),
        {"states": "3 each ", "gravity": "1 .. 2 [L T^-2]"},
    ),
}


@pytest.mark.parametrize("kind", TABLES)
def test_notebooks_show_numbers_with_their_units(kind):
    make, expected = TABLES[kind]
    html = make()._repr_html_()
    assert html.count("<table>") == html.count("</table>") == 1
    rows = re.findall(r"<tr><td[^>]*>(.*?)</td><td[^>]*>(.*?)</td><td[^>]*>(.*?)</td>", html)
    table = {name: f"{value} {unit}" for name, value, unit in rows}
    assert expected.items() <= table.items() and len(rows) == len(table)


def test_notebooks_show_fits_as_tables():
    t = np.arange(60) * 0.1
    record = kr.Record(t, {"apex": kr.solve(kr.scenes.cusps, t).apex}, sigma=0.01)
    fit = kr.fit(kr.scenes.cusps, record, ("start", "moments"))
    html, text = fit._repr_html_(), str(fit).splitlines()
    assert html.startswith(f"<p>{text[0]}</p>\n<table>")
    assert html.count("<tr>") == 1 + len(fit.names) + len(fit.moment_ratios)
    for name, error in fit.error.items():
        error_text = f"+- {error:.2g}" if np.isfinite(error) else "not identified"
        assert f">{name}<" in html and f"{error_text}<" in html
    assert html.count("<p>Not identified: ") == len(fit.unidentified) == 2


def test_plans_and_tables_are_html_tables():
    plan = kr.plan(GENERAL, 1.0, step=0.1, method="rk4")
    html = plan._repr_html_()
    assert html.count("<tr>") == len(str(plan).splitlines())
    assert ">rk4: requested by name</td>" in html
    many = kr.plan(TOPS, 1.0)._repr_html_()
    assert ">tops</td>" in many and ">first top</td>" in many
    rows = kr.compare(GENERAL, 0.5, ["rk4"], [0.1, 0.05], repeats=1)._repr_html_()
    assert rows.count("<tr>") == 3 and rows.count("<th") == 11 and ">rk4</td>" in rows
    failed = Table((Row("<b>", "rk4", None, None, 1, 1, 1, 1, 1, 1, "a < b & c"),))
    html = failed._repr_html_()
    assert "&lt;b&gt;" in html and "a &lt; b &amp; c" in html
