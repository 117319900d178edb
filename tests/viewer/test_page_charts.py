"""Tests that charts and tables of the viewer show the numbers that kreisel computes."""

import kreisel as kr
import numpy as np
import pytest
from browser import UPRIGHT, wait_for

INTEGRALS = {"energy", "vertical_momentum", "axial_momentum", "kowalewski"}
INTEGRALS |= {"goryachev_chaplygin", "modified_energy"}
PUSH = """kreisel.page.pushTop(kreisel.page.tops[0], (s) => (s.momentum[0] += 1e-3));
    kreisel.page.setRunning(false)"""


def read_lines(page, chart=0):
    """Return the times and values of the lines in a chart."""
    return np.array(
        page.evaluate(f"kreisel.charts.plots[{chart}].data.map((line) => Array.from(line))"), float
    )


def read_earlier(page, chart=0):
    """Return the times and values of the curves that show earlier motions in a chart."""
    return np.array(
        page.evaluate(f"""(({{times, curves}}) => [times, ...curves.map(({{values}}) => values)])(
            kreisel.charts.plots[{chart}].earlier)"""),
        float,
    )


def read_spans(page, chart=0):
    """Return the ranges of time and value that a chart shows."""
    return page.evaluate(f"""(({{x, y}}) => [x.min, x.max, y.min, y.max])(
        kreisel.charts.plots[{chart}].scales)""")


def read_labels(page):
    """Return the numbers drawn beside the vertical axis of a chart, from below."""
    return np.array(page.evaluate("kreisel.charts.plots[0].axes[1]._values.filter(Boolean)"), float)


def run_to(page, t):
    """Advance to the time `t`, and wait until the charts are updated."""
    page.advance(t)
    wait_for(
        page, "kreisel.charts.plots[0].data[0].at(-1) === kreisel.simulation.getTimes().at(-1)"
    )


# What is drawn


@pytest.mark.parametrize("preset", [UPRIGHT, "Kowalewski", "Goryachev-Chaplygin", "Compare four"])
def test_charts_show_the_record_and_changes_of_conserved_measures(page, preset):
    page.load(preset, log=False)
    run_to(page, 3)
    menu = page.get_by_label("Quantity in the chart")
    for name in menu.evaluate("(list) => [...list.options].map(({value}) => value)"):
        menu.select_option(name)
        assert page.read_scene()["chart"] == name
        title = menu.evaluate("(list) => list.selectedOptions[0].text")
        lines = read_lines(page)
        assert lines[0][::2].tolist() == page.read_times().tolist()
        is_kept = title.startswith("Change of")
        for i, line in enumerate(lines[1:]):
            record = page.read_record(i, name)
            record = np.degrees(record) if name == "nutation" else record
            expected = record - record[0] if is_kept else record
            low, high = np.fmin(line[::2], line[1::2]), np.fmax(line[::2], line[1::2])
            tight = 1e-12 * np.nanmax(np.abs(record), initial=1)
            assert np.nanmax(np.append(low - expected, expected - high), initial=0) <= tight
        assert is_kept == (name in INTEGRALS)
        assert ("[°]" in title) == (name == "nutation")


@pytest.mark.parametrize("preset, t", [(UPRIGHT, 8), ("Compare four", 30), ("Kowalewski", 100)])
def test_logarithmic_charts_show_absolute_values_between_powers_of_ten(page, preset, t):
    page.load(preset, log=False, **({} if preset == "Kowalewski" else {"chart": "energy"}))
    run_to(page, t)
    before, box = read_lines(page), page.get_by_role("checkbox", name="log")
    ticks = read_labels(page)
    assert len(ticks) > 2 and np.diff(ticks) == pytest.approx(ticks[1] - ticks[0], rel=1e-9)
    assert (before[1:] < 0).any()
    box.check()
    sizes, powers = read_lines(page), np.log10(read_labels(page))
    box.uncheck()
    assert np.nanmin(sizes[1:]) > 0 and np.nanmax(sizes[1:]) == np.nanmax(np.abs(before[1:]))
    assert 2 <= len(powers) <= 5 and powers == pytest.approx(np.round(powers), abs=1e-9)
    assert read_lines(page) == pytest.approx(before, nan_ok=True)


def test_the_zoom_of_charts_stays_while_time_advances(page):
    page.load("Compare four")
    run_to(page, 30)
    assert read_spans(page)[:2] == read_spans(page, 1)[:2] == [0, pytest.approx(30)]
    chart = page.get_by_role("img", name="Change of energy over time").first.locator(".u-over")
    chart.scroll_into_view_if_needed()
    box = chart.bounding_box()
    left, right, y = box["x"] + 0.25 * box["width"], box["x"] + 0.75 * box["width"], box["y"] + 40
    page.mouse.move(left, y)
    page.mouse.down()
    page.mouse.move((left + right) / 2, y)
    page.mouse.move(right, y)
    page.mouse.up()
    zoomed = read_spans(page)[:2]
    assert zoomed == pytest.approx((7.5, 22.5), abs=0.5)
    assert read_spans(page, 1)[:2] == pytest.approx(zoomed)
    run_to(page, 60)
    assert read_spans(page)[:2] == zoomed
    page.mouse.dblclick(left, y)
    assert read_spans(page)[:2] == read_spans(page, 1)[:2] == [0, pytest.approx(60)]
    page.mouse.move(60, 120)


def test_charts_have_room_for_the_limits_of_the_tilt_and_continue_after_a_step(page):
    page.load("A spinning top")
    wait_for(page, "kreisel.charts.plots[0].scales.y.max > 40")
    first, last, low, high = read_spans(page)
    assert 25 < low <= 30 and 48.6 <= high < 55 and last - first <= 1
    run_to(page, 0.3)
    page.evaluate("kreisel.page.stepOnce(); kreisel.page.setRunning(true); kreisel.advance(0.35)")
    page.evaluate("kreisel.page.stepOnce(), kreisel.advance(0.4), kreisel.charts.update()")
    page.evaluate("kreisel.page.setRunning(false)")
    run_to(page, 0.9)
    assert read_spans(page)[1] == pytest.approx(0.9)


def test_values_under_the_cursor_are_shown(page):
    page.load("Compare four", chart="energy")
    run_to(page, 30)
    legend = page.locator("#charts .read")
    assert legend.inner_text().startswith("t = 30")
    chart = page.locator("#charts .u-over")
    chart.scroll_into_view_if_needed()
    box = chart.bounding_box()
    page.mouse.move(box["x"] + box["width"] / 2, box["y"] + 30)
    wait_for(page, "/^t = 1[45]/.test(document.querySelector('#charts .read').textContent)")
    _, *lines = read_lines(page)
    row = page.evaluate("kreisel.charts.plots[0].cursor.idx")
    shown = [float(words) for words in page.locator("#charts .read span").all_inner_texts()]
    assert shown == pytest.approx([line[row] for line in lines], rel=0.05)
    page.mouse.move(60, 120)


def test_a_hidden_top_has_no_curves(page):
    page.load("Compare four")
    page.advance(2)
    shown = "kreisel.charts.plots[0].series.slice(1).map((line) => line.show)"
    box = page.get_by_role("checkbox", name="extrap 0.2")
    box.uncheck()
    assert page.evaluate(shown) == [True, True, True, False]
    box.check()
    x, y = page.evaluate("kreisel.locate('corner', 2, 5)")
    page.mouse.click(x, y)
    assert page.evaluate(shown) == [True] * 4
    page.mouse.dblclick(x, y)
    assert page.evaluate(shown) == [False, False, True, False]
    page.mouse.dblclick(60, 120)
    assert page.evaluate(shown) == [True] * 4 and page.read_clock() == 2e6


def test_charts_of_integrals_follow_the_shape(page):
    shape, menu = page.get_by_label("Shape"), page.get_by_label("Quantity in the chart")
    offered = "(list) => [...list.options].map(({value}) => value)"
    for chart, expected in (("energy", "kowalewski"), ("spin", "spin")):
        page.load(chart=chart)
        shape.select_option("kowalewski")
        assert page.read_scene()["chart"] == expected
        assert page.read_scene()["integral"] == "kowalewski"
        assert "goryachev_chaplygin" not in menu.evaluate(offered)
    shape.select_option("lagrange")
    assert page.read_scene()["integral"] == "energy" and "kowalewski" not in menu.evaluate(offered)


def test_charts_are_larger_on_demand(page):
    page.advance(3)
    width = "kreisel.charts.plots[0].over.clientWidth"
    before = page.evaluate(width)
    page.evaluate("document.getElementById('panel').scrollTop = 1e4")
    page.keyboard.press("l")
    wait_for(page, f"{width} > {1.5 * before}")
    for part in ("#charts select", "#charts .uplot", "#charts .read"):
        box = page.locator(part).bounding_box()
        assert box["y"] >= 0 and box["y"] + box["height"] <= page.viewport_size["height"], part
    page.find_button("Larger").click()
    wait_for(page, f"{width} === {before}")


# Motions before a change


@pytest.mark.parametrize("change", [PUSH, "kreisel.page.setValue('gravity', 2)"])
def test_the_motion_before_a_change_stays_visible(page, change):
    page.load("A spinning top")
    run_to(page, 0.3)
    before = read_lines(page)
    trace = page.evaluate("Array.from(kreisel.view.getTrace(0))")
    page.evaluate(change)
    assert page.read_clock() == 0
    run_to(page, 0.1)
    times, tilts = read_lines(page)
    earlier = read_earlier(page)
    assert earlier.tolist() == before.tolist() and (times[0], times[-1]) == (0, 0.1)
    first, last, low, high = read_spans(page)
    assert (first, last) == (0, 0.3) and low < earlier[1].min() and high > earlier[1].max()
    assert np.abs(tilts[-1] - earlier[1][times.size - 1]) > 0.1
    values = page.locator("#charts .read")
    assert "before" in values.inner_text()
    old = "kreisel.view.tops[0].before?.visible ?? false"
    assert page.evaluate(old)
    assert page.evaluate("Array.from(kreisel.page.previousMotion.ways[0])") == trace
    run_to(page, 5)
    assert read_spans(page)[:2] == [0, 5]
    page.find_button("Rewind").click()
    assert page.evaluate(old)
    page.find_button("Undo").click()
    run_to(page, 2)
    assert not page.evaluate(old) and read_earlier(page).size == 0
    assert "before" not in values.inner_text()


@pytest.mark.parametrize("log", [False, True])
def test_error_charts_have_room_for_curves_before_a_change(page, log):
    page.load("Compare four", log=log)
    run_to(page, 30)
    before = read_lines(page)
    page.evaluate(PUSH)
    run_to(page, 1)
    assert read_earlier(page) == pytest.approx(before, nan_ok=True)
    first, last, low, high = read_spans(page)
    assert (first, last) == (0, 12)
    errors = before[1:, before[0] <= 12]
    assert low <= np.nanmin(errors) and high >= np.nanmax(errors)


# Tables and numbers


def read_table(page):
    """Return the displayed values and changes of the integrals of all tops."""
    rows = page.locator("#integrals .values").evaluate_all(
        "rows => rows.map((row) => [...row.querySelectorAll('td')].map((cell) => cell.textContent))"
    )
    return [
        np.array([cell.split("\n") for cell in row if cell != "\N{EN DASH}"], float) for row in rows
    ]


@pytest.mark.parametrize("preset", [UPRIGHT, "Kowalewski", "Goryachev-Chaplygin"])
def test_the_table_of_integrals_agrees_with_python(page, preset):
    page.load(preset, methods=["strang", "rk4"], step=[0.05], gravity=2.5)
    page.advance(6)
    page.evaluate("kreisel.page.onChange()")
    top = page.build_scene()
    fourth = [top.body.kind] if top.body.kind != "lagrange" else []
    for row, method in zip(read_table(page), ("strang", "rk4"), strict=True):
        path = kr.solve(top, 6, method, step=0.05, every=120)
        lines = [
            getattr(path, name)
            for name in ("energy", "vertical_momentum", "axial_momentum", *fourth)
        ]
        assert row[:, 0] == pytest.approx([line[-1] for line in lines], rel=1e-5, abs=1e-9)
        changes = [line[-1] - line[0] for line in lines]
        assert row[:, 1] == pytest.approx(changes, rel=0.06, abs=1e-13)


def read_momentum(page):
    """Return the momentum that the fields show."""
    page.evaluate("kreisel.page.onChange()")
    fields = page.locator("[aria-label^='Momentum, ']").all()
    return [float(field.input_value()) for field in fields]


def test_the_shown_momentum_is_the_current_one_and_can_be_typed(page):
    start = page.read_scene()["momentum"]
    assert read_momentum(page) == start
    page.advance(3)
    assert read_momentum(page) == pytest.approx(page.read_states()[0][5:], rel=1e-5)
    end = kr.solve(page.build_scene(), 4, "bobenko_suris", step=0.01, every=400).end
    second = page.get_by_label("Momentum, second component")
    second.fill("2.5")
    page.advance(4)  # while the value is being typed
    second.press("Tab")
    assert page.read_clock() == 0
    assert page.read_scene()["momentum"] == [end.momentum[0], 2.5, end.momentum[2]]
    assert page.read_scene()["attitude"] == list(end.attitude)


def test_a_typed_value_is_set_even_if_the_field_showed_it_when_the_edit_began(page):
    field = page.get_by_label("Tilt [°], number", exact=True)
    shown = field.input_value()
    field.focus()
    page.advance(3)
    page.fill_field("Tilt [°], number", shown)
    assert page.read_scene()["taken"] == 3
    assert np.degrees(page.measure_top(0, "nutation")) == pytest.approx(float(shown))


@pytest.mark.parametrize("damping, text", [(0, "0"), (1e-6, "1e-6"), (1.2345e-7, "1.23e-7")])
def test_fields_show_small_numbers_completely(page, damping, text):
    page.load("A spinning top", damping=damping)
    assert page.get_by_label("Damping, number").input_value() == text
    assert page.get_by_role("slider", name="Damping").get_attribute("aria-valuetext") == text


def test_rounding_errors_are_not_shown_as_values_of_the_body(page):
    page.load(body={"half": [0.8, 0.8, 1], "pivot": [1.2e-16, 0.3, -1], "density": 1})
    page.evaluate("kreisel.page.onChange()")
    assert "e-" not in page.locator("#body").inner_text()
    assert page.get_by_label("Fixed point, from the centre, N").input_value() == "0"


def test_numbers_of_several_tops_name_their_top(page):
    assert "top" not in page.read_numbers()
    page.load("Compare four")
    assert page.read_numbers()["top"] == ["left", "bobenko_suris 0.01"]
    assert page.read_numbers()["tilt"][1].startswith("exact")
