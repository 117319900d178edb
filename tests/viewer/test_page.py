"""Tests that the viewer computes the same states as the Python package."""

import csv
import gzip
import io
import json

import kreisel as kr
import numpy as np
import pytest
from browser import (
    MEASURES,
    PAGE,
    PHONE,
    PRESETS,
    TICKS,
    UNDAMPED,
    UPRIGHT,
    WIDE,
    advance,
    count_colours,
    load,
    make_viewport,
    measure_top,
    open_viewer,
    read_clock,
    read_message,
    read_record,
    read_scene,
    read_states,
    scene_in_python,
    visit,
    wait_for,
)
from toolbox import need

ALGEBRAIC = [  # methods that use only + - * / sqrt give bitwise equal states everywhere
    "bobenko_suris",
    "bobenko_suris2",
    "strang",
    "rk4",
]


# The file


def test_one_small_file_with_its_licences():
    if not PAGE.exists():
        need("npm")
    text = PAGE.read_text(encoding="utf-8")
    size = len(text.encode())
    assert 400_000 < size <= 900_000 and len(gzip.compress(text.encode(), 9)) <= 272_000
    for name in (
        "three.js authors",
        "Leon Sorokin",
        "musl as a whole",
        "Zig contributors",
        "Google LLC",
        "the kreisel authors",
    ):
        assert name in text, name


def test_the_viewer_starts_automatically(browser):
    page = visit(browser)
    wait_for(page, "kreisel.page.clock > 200000 && kreisel.simulation.countRows() > 2")
    assert page.get_by_role("button", name="Stop").is_visible()
    assert page.evaluate("kreisel.view.tops[0].line.geometry.drawRange.count") > 60
    assert page.troubles == []
    page.context.close()


def test_the_viewer_waits_if_reduced_motion_is_preferred(page):
    page.wait_for_timeout(900)
    assert (
        read_clock(page) == 0 and page.get_by_role("button", name="Start", exact=True).is_visible()
    )


# The numbers


@pytest.mark.parametrize("preset", PRESETS)
def test_states_equal_those_of_python_bitwise(page, preset):
    load(page, preset, step=[0.01, 0.07])
    scene = read_scene(page)
    for method in ALGEBRAIC:
        if not kr.methods[method].suits(scene_in_python(scene)):
            continue
        page.evaluate(
            "name => kreisel.page.editScene((s) => (s.methods = s.methods.map(() => name)))", method
        )
        advance(page, 21)
        for i, state in enumerate(read_states(page)):
            top = scene_in_python(scene, second=bool(i > 1 and scene["second"]))
            expected = kr.solve(top, 21, method, step=(0.01, 0.07)[i % 2], every=300).states[-1]
            assert state == expected.tolist(), (method, i)


@pytest.mark.parametrize("preset", [UPRIGHT, "Kowalewski", "Dzhanibekov effect"])
def test_algebraic_methods_equal_python_bitwise(page, preset):
    load(page, preset)
    top = scene_in_python(read_scene(page))
    names = [name for name, method in kr.methods.items() if method.algebraic and method.suits(top)]
    assert len(names) >= 9
    for name in names:
        page.evaluate(
            "name => { kreisel.page.editScene((s) => (s.methods = [name])); kreisel.advance(5); }",
            name,
        )
        expected = kr.solve(top, 5, name, step=0.01, every=500).states[-1]
        assert read_states(page)[0] == expected.tolist(), name


def test_adaptive_methods_agree_with_python(page):
    page.evaluate("kreisel.page.editScene((s) => ((s.methods = ['extrap']), (s.tol = 1e-10)))")
    advance(page, 20)
    expected = kr.solve(scene_in_python(read_scene(page)), [20.0], "extrap", tol=1e-10).states[0]
    assert read_states(page)[0] == pytest.approx(expected.tolist(), abs=1e-7)


def test_extrap_restarts_at_each_step(page):
    load(page, "Compare four")
    advance(page, 4)
    state, scene = read_states(page)[3], scene_in_python(read_scene(page))
    for _ in range(20):
        scene = kr.solve(scene, [0.2], "extrap", tol=1e-5).end
    expected = [*scene.attitude, *scene.momentum]
    assert state[1:] == pytest.approx(
        expected, abs=1e-9
    )  # logarithms and powers may differ in the last bits
    assert 1e-9 < measure_top(page, 3, "error") < 1e-3


def test_one_large_advance_equals_many_small_ones(page):
    load(page, "Compare four")
    advance(page, 30)
    states = read_states(page)
    page.evaluate("""{
        kreisel.page.rewind();
        for (let t = 0, i = 0; t < 30; i++) {
            t = Math.min(30, t + ((i * 7919) % 97) / 300);
            kreisel.advance(t);
        }
    }""")
    assert read_states(page) == states


def test_tops_are_compared_only_at_common_multiples_of_their_steps(page):
    load(page, "Compare four", step=[0.03, 0.2])
    advance(page, 30)
    assert page.evaluate("kreisel.simulation.getCommonStep()") == 0.6 * TICKS
    times = np.array(page.evaluate("Array.from(kreisel.simulation.getTimes())"))
    assert np.abs(times - 0.6 * np.arange(51)).max() < 1e-9
    assert 1e-4 < read_record(page, 1, "error").max() < 0.3
    advance(page, 30.03)
    assert np.isnan(measure_top(page, 1, "error"))


@pytest.mark.parametrize("preset", UNDAMPED)
def test_presets_conserve_their_integrals(page, preset):
    load(page, preset)
    advance(page, 50)
    scene, tops = read_scene(page), page.evaluate("kreisel.page.tops")
    for i, top in enumerate(tops):
        energy = read_record(page, i, "energy")
        vertical, axial = (
            read_record(page, i, f"{name}_momentum") for name in ("vertical", "axial")
        )
        size = np.abs(energy).max() + np.abs(vertical).max()
        coarse = min(top["step"], 0.2)
        limit = {"extrap": 1e-4, "rk4": 0.01}.get(top["method"], 1e-6)
        assert np.ptp(energy) <= coarse * size and np.ptp(vertical) <= limit * size, top["method"]
        if page.evaluate("kreisel.page.kind") == "lagrange":
            assert np.ptp(axial) <= limit * size
        if scene["chart"] in {"kowalewski", "goryachev_chaplygin"}:
            fourth = read_record(page, i, scene["chart"])
            assert np.ptp(fourth) <= 1e-3 * max(1, np.abs(fourth).max())
        assert scene["about"]


def heights_until(page, end):
    """Return the apex heights of all tops at integer times up to `end`."""
    states = page.evaluate(
        """(end) => Array.from({length: end + 1}, (_, t) => {
            kreisel.advance(t);
            return kreisel.readStates();
        })""",
        end,
    )
    x, y = np.moveaxis(np.array(states)[:, :, 2:4], 2, 0)
    return 1 - 2 * (x * x + y * y)


def test_the_sleeping_top_sleeps_and_the_other_falls(page):
    load(page, "Sleeping top")
    heights = np.min(heights_until(page, 30), axis=0)
    assert heights[0] > 0.95 and heights[1] < 0.8


def test_steady_precession_keeps_its_height(page):
    load(page, "Steady precession")
    heights = heights_until(page, 30)[:, 0]
    assert heights == pytest.approx([np.cos(np.radians(35))] * 31, abs=1e-12)


# Downloads


def download_file(page, name):
    with page.expect_download() as download:
        page.get_by_role("button", name=name, exact=True).click()
    return download.value.path()


@pytest.mark.usefixtures("full_picture")
def test_downloaded_files_have_the_scene_and_the_states(page, window, tmp_path):
    load(page, "Compare four")
    advance(page, 2)
    scene = read_scene(page)
    rows = list(csv.reader(io.StringIO(download_file(page, "CSV").read_text())))
    assert (
        len(rows) == 12 and len(rows[0]) == 1 + 4 * (len(MEASURES) - 2) and float(rows[-1][0]) == 2
    )
    assert json.loads(download_file(page, "JSON").read_text()) == scene
    assert kr.Scene.from_toml(download_file(page, "TOML")) == scene_in_python(scene)
    assert download_file(page, "Picture").read_bytes().startswith(b"\x89PNG")
    (tmp_path / "top.html").write_bytes(download_file(page, "This page").read_bytes())
    other = open_viewer(window, tmp_path / "top.html")
    other.evaluate("kreisel.advance(2)")
    assert read_scene(other) == scene and other.evaluate("kreisel.readStates()") == page.evaluate(
        "kreisel.readStates()"
    )
    page.get_by_role("button", name="Share").click()
    link = page.url
    page.evaluate("history.replaceState(null, '', '#')")
    other.goto("about:blank")
    other.goto(link)
    wait_for(other, "!!window.kreisel")
    assert read_scene(other) == scene and other.troubles == []


BAD = [
    "garbage",
    "[1]",
    "{}x",
    '{"methods":[]}',
    '{"methods":["none"]}',
    '{"step":7}',
    '{"show":{"opacity":"x"}}',
    "7",
]


@pytest.mark.parametrize("link", BAD[:2])
def test_a_viewer_opened_by_an_invalid_link_shows_a_message(window, link):
    page = open_viewer(window, fragment=f"#scene={link}")
    assert "cannot be shown" in read_message(page)
    assert read_scene(page)["name"] == PRESETS[0] and page.troubles == []


@pytest.mark.parametrize("link", BAD)
def test_an_invalid_link_shows_a_message(page, link):
    before = read_scene(page)
    page.evaluate("link => { location.hash = ''; location.hash = `#scene=${link}`; }", link)
    wait_for(page, "document.getElementById('words').textContent.includes('cannot be')")
    assert read_scene(page) == before
    page.evaluate("history.replaceState(null, '', '#'); kreisel.page.showMessage('')")


def test_python_snippet_runs(page):
    program, names = page.get_by_label("Equivalent Python program").input_value(), {}
    exec(program, names)
    assert names["scene"] == scene_in_python(read_scene(page))
    advance(page, 100)
    ends = [[100, *end.attitude, *end.momentum] for end in names["ends"]]
    assert ends == read_states(page)


def test_picture_is_not_blank(page):
    page.evaluate("drawPicture()")
    assert count_colours(page) > 200


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_the_viewer_fits_windows_of_all_sizes(browser, theme):
    page = visit(browser, size=PHONE, color_scheme=theme, reduced_motion="reduce")
    for size in (PHONE, (800, 460), WIDE):
        page.set_viewport_size(make_viewport(size))
        wait_for(page, "kreisel.view.pixels[0] === document.querySelector('main').clientWidth")
        assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
        assert (
            page.get_by_role("button", name="Start", exact=True).bounding_box()["y"] < size[1] - 40
        )
        panel = page.locator("#panel").bounding_box()
        for handle in ("tip", "face"):
            x, y = page.evaluate(f"kreisel.locate('{handle}')")
            assert 0 < x < size[0] and 0 < y < size[1]
            assert not (x > panel["x"] and y > panel["y"]), handle
    assert page.troubles == []
    page.context.close()
