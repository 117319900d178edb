"""Tests that charts and tables of the viewer agree with values computed in Python."""

import kreisel as kr
import numpy as np
import pytest
from browser import (
    LEVEL,
    UPRIGHT,
    advance,
    load,
    read_clock,
    read_scene,
    read_states,
    scene_in_python,
    wait_for,
)

AXES = ("first", "second", "vertical")


def read_lines(page, chart=0):
    """Return the times and values of the lines in a chart."""
    return np.array(
        page.evaluate(f"kreisel.charts.plots[{chart}].data.map((line) => Array.from(line))"), float
    )


def run_to(page, t):
    """Advance to the time `t`, and wait until the charts are updated."""
    advance(page, t)
    wait_for(
        page, "kreisel.charts.plots[0].data[0].at(-1) === kreisel.simulation.getTimes().at(-1)"
    )


def read_labels(page):
    """Return the tick labels of the vertical axis of a chart."""
    return page.evaluate("""async () => {
        const seen = [], own = CanvasRenderingContext2D.prototype, write = own.fillText;
        own.fillText = function (text, ...where) {
            if (this.textAlign === 'right') seen.push(text);
            return write.call(this, text, ...where);
        };
        kreisel.charts.plots[0].redraw();
        await new Promise(requestAnimationFrame);
        own.fillText = write;
        return seen.filter(Boolean);
    }""")


def find_fields(page):
    return [page.get_by_label(f"Momentum, {axis} component") for axis in AXES]


def wait_for_momentum(page, m):
    values = [float(f"{x:.6g}" if x == 0 or abs(x) >= 1e-3 else f"{x:.3g}") for x in m]
    wait_for(
        page,
        """m => [...document.querySelectorAll("[aria-label^='Momentum, ']")]
            .every((field, k) => +field.value === m[k])""",
        arg=values,
    )


# Charts


@pytest.mark.parametrize("preset, t", [(UPRIGHT, 8), ("Compare four", 30), ("Kowalewski", 100)])
def test_logarithmic_charts_show_absolute_values_between_powers_of_ten(page, preset, t):
    load(page, preset, log=False, **({} if preset == "Kowalewski" else {"chart": "energy"}))
    run_to(page, t)
    before, box = read_lines(page), page.get_by_role("checkbox", name="log")
    assert (before[1:] < 0).any()
    box.check()
    sizes, powers = read_lines(page), [float(label) for label in read_labels(page)]
    box.uncheck()
    assert np.nanmin(sizes[1:]) > 0 and np.nanmax(sizes[1:]) == np.nanmax(np.abs(before[1:]))
    assert 2 <= len(powers) <= 5 and np.log10(powers) == pytest.approx(
        np.round(np.log10(powers)), abs=1e-9
    )
    assert read_lines(page) == pytest.approx(before, nan_ok=True)


def test_the_zoom_of_charts_stays_while_time_advances(page):
    load(page, "Compare four")
    run_to(page, 30)
    spans = "kreisel.charts.plots.slice(0, 2).map(({scales: {x}}) => [x.min, x.max])"
    whole = page.evaluate(spans)
    chart = page.get_by_role("img", name="Change of energy over time").first.locator(".u-over")
    chart.scroll_into_view_if_needed()
    box = chart.bounding_box()
    left, right, y = box["x"] + 0.25 * box["width"], box["x"] + 0.75 * box["width"], box["y"] + 40
    page.mouse.move(left, y)
    page.mouse.down()
    page.mouse.move((left + right) / 2, y)
    page.mouse.move(right, y)
    page.mouse.up()
    zoomed = page.evaluate(spans)
    assert zoomed[0] == pytest.approx((7.5, 22.5), abs=0.5) and zoomed[1] == pytest.approx(
        zoomed[0]
    )
    run_to(page, 60)
    assert page.evaluate(spans) == zoomed
    page.mouse.dblclick(left, y)
    assert (
        page.evaluate(spans) == [[0, pytest.approx(60)]] * 2
        and whole == [[0, pytest.approx(30)]] * 2
    )


def test_thinned_records_keep_their_extremes(page):
    run_to(page, 100)
    _, short = read_lines(page)
    run_to(page, 20000)
    times, long = read_lines(page)
    assert len(times) <= 2050 and times[-1] > 19900
    assert (long.min(), long.max()) == pytest.approx((short.min(), short.max()), rel=1e-3)
    assert (
        long[2::2].max() < 0.98 * short.min() and long[3::2].min() > 0.98 * short.max()
    )  # the values at every time


def test_charts_offer_all_quantities_of_the_table(page):
    """Check that the menu lists all quantities that a chart can show."""
    run_to(page, 1)
    menu = page.get_by_label("Quantity in the chart")
    options = "list => [...list.options].map((option) => [option.value, option.title])"
    level = {each["name"]: each["text"] for each in LEVEL}
    level["error"] = "attitude error against another top, in radians"
    integrals = {"kowalewski", "goryachev_chaplygin"}
    for t, shape in enumerate(["kowalewski", "lagrange", "goryachev_chaplygin"], 2):
        page.get_by_label("Shape").select_option(shape)
        run_to(page, t)
        missing = integrals - {shape}
        assert dict(menu.evaluate(options)) == {k: v for k, v in level.items() if k not in missing}
        if shape in integrals:
            menu.select_option(shape)
            assert 0 < np.ptp(read_lines(page)[1]) < 1e-2


@pytest.mark.parametrize("each", LEVEL, ids=lambda each: each["name"])
def test_charts_of_integrals_show_changes_and_others_show_values(page, each):
    name = each["name"]
    owners = {"kowalewski": "Kowalewski", "goryachev_chaplygin": "Goryachev-Chaplygin"}
    load(page, owners.get(name, UPRIGHT), methods=["strang"], chart=name)
    run_to(page, 3)
    path = kr.solve(scene_in_python(read_scene(page)), 3, "strang", step=0.01, every=1)
    values = getattr(path, name)
    values = values - values[0] if each["kept"] else values
    values = np.degrees(values) if name == "nutation" else values
    assert read_lines(page)[1][::2] == pytest.approx(values, rel=1e-9, abs=1e-12)


# The table


def read_table(page):
    """Return the displayed values and changes of the integrals of motion.

    The integrals of motion are the energy, the vertical and axial momentum, and a fourth integral
    if there is one.
    """
    rows = page.locator("#integrals .values").evaluate_all(
        "rows => rows.map((row) => [...row.querySelectorAll('td')].map((cell) => cell.textContent))"
    )
    return np.array(
        [
            [cell.split("\n") if cell != "\N{EN DASH}" else ["nan"] * 2 for cell in row]
            for row in rows
        ],
        float,
    )


def compute_table(path):
    """Return the values that the viewer's table should show for a path."""
    lines = [path.energy, path.vertical_momentum, path.axial_momentum]
    if path.scene.body.kind in {"kowalewski", "goryachev_chaplygin"}:
        lines.append(getattr(path, path.scene.body.kind))
    return np.array([(line[-1], line[-1] - line[0]) for line in lines])


@pytest.mark.parametrize(
    "preset, fourth", [(UPRIGHT, None), ("Kowalewski", "K"), ("Goryachev-Chaplygin", "G")]
)
def test_integrals_agree_with_python(page, preset, fourth):
    load(page, preset, methods=["strang", "rk4"], step=[0.05])
    page.evaluate("kreisel.page.setValue('gravity', 2.5)")
    for t in (2, 6):
        advance(page, t)
        wait_for_momentum(page, read_states(page)[0][5:])
        tables, top = read_table(page), scene_in_python(read_scene(page))
        assert len(tables) == 2
        for row, method in zip(tables, ("strang", "rk4"), strict=True):
            path = kr.solve(top, t, method, step=0.05, every=20 * t)
            values, change = compute_table(path).T
            assert row[: len(values), 0] == pytest.approx(values, rel=1e-5, abs=1e-9)
            assert row[: len(values), 1] == pytest.approx(change, rel=0.06, abs=1e-13)
            assert len(values) == (4 if fourth else 3) and np.isnan(row[len(values) :]).all()
    if fourth:
        assert (
            page.get_by_role("columnheader", name=fourth, exact=True).is_visible()
            and abs(tables[1, 3, 1]) > 0
        )


# The momentum


def test_the_shown_momentum_is_the_current_one(page):
    wait_for_momentum(page, read_scene(page)["momentum"])
    advance(page, 3)
    wait_for_momentum(page, read_states(page)[0][5:])
    page.get_by_role("button", name="Rewind").click()
    wait_for_momentum(page, read_scene(page)["momentum"])


def test_a_typed_momentum_keeps_the_other_current_components(page):
    end = kr.solve(scene_in_python(read_scene(page)), 4, "bobenko_suris", step=0.01, every=400).end
    advance(page, 3)
    second = find_fields(page)[1]
    second.fill("2.5")
    advance(page, 4)  # while the value is being typed
    second.press("Tab")
    assert read_clock(page) == 0 and read_scene(page)["momentum"] == [
        end.momentum[0],
        2.5,
        end.momentum[2],
    ]
    assert read_scene(page)["attitude"] == list(end.attitude)


# Time


def test_charts_continue_after_a_single_step(page):
    load(page, "A spinning top")
    run_to(page, 3)
    page.evaluate("kreisel.page.stepOnce(); kreisel.page.setRunning(true); kreisel.advance(3.5)")
    page.evaluate("kreisel.page.stepOnce(), kreisel.advance(4), kreisel.charts.update()")
    page.evaluate("kreisel.page.setRunning(false)")
    run_to(page, 9)
    assert page.evaluate("kreisel.charts.plots[0].scales.x.max") == pytest.approx(9)


def test_charts_have_room_for_the_limits_of_the_tilt(page):
    load(page, "A spinning top")
    wait_for(page, "kreisel.charts.plots[0].scales.y.max > 40")
    scale = page.evaluate("(({min, max}) => [min, max])(kreisel.charts.plots[0].scales.y)")
    assert 25 < scale[0] <= 30 and 48.6 <= scale[1] < 55


PUSH = """kreisel.page.pushTop(kreisel.page.tops[0], (s) => (s.momentum[0] += 2));
    kreisel.page.setRunning(false)"""


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


@pytest.mark.parametrize("change", [PUSH, "kreisel.page.setValue('gravity', 2)"])
def test_curves_before_a_change_are_drawn_below_current_ones(page, change):
    load(page, "A spinning top")
    run_to(page, 3)
    before = read_lines(page)
    page.evaluate(change)
    assert read_clock(page) == 0
    run_to(page, 1)
    times, tilts = read_lines(page)
    assert times[0] == 0 and times[-1] == 1
    earlier = read_earlier(page)
    assert earlier.tolist() == before.tolist()
    first, last, low, high = read_spans(page)
    assert (first, last) == (0, 3) and low < earlier[1].min() and high > earlier[1].max()
    assert np.abs(tilts[-1] - earlier[1][times.size - 1]) > 0.1
    run_to(page, 5)
    assert read_spans(page)[:2] == [0, 5]


@pytest.mark.parametrize("log", [False, True])
def test_error_charts_have_room_for_curves_before_a_change(page, log):
    load(page, "Compare four", log=log)
    run_to(page, 30)
    before = read_lines(page)
    page.evaluate(PUSH)
    run_to(page, 1)
    assert read_earlier(page) == pytest.approx(before, nan_ok=True)
    first, last, low, high = read_spans(page)
    assert (first, last) == (0, 12)
    errors = before[1:, before[0] <= 12]
    assert low <= np.nanmin(errors) and high >= np.nanmax(errors)


def count_pixels(page):
    """Count the coloured pixels of a chart, first with earlier motions, then with them hidden."""
    return page.evaluate("""async () => {
        const [{ctx, earlier, redraw}] = kreisel.charts.plots, draw = earlier.draw;
        const count = async () => {
            redraw(false);
            await new Promise(requestAnimationFrame);
            const {width, height} = ctx.canvas;
            const copy = new OffscreenCanvas(width, height).getContext('2d');
            copy.drawImage(ctx.canvas, 0, 0);
            const {data} = copy.getImageData(0, 0, width, height);
            let all = 0;
            for (let k = 0; k < data.length; k += 4) all += data[k] > data[k + 2] + 20;
            return all;
        };
        const both = await count();
        earlier.draw = () => 0;
        const one = await count();
        delete earlier.draw;
        return [both, one];
    }""")


def test_the_motion_before_a_push_stays_visible(page):
    load(page, "A spinning top")
    run_to(page, 3)
    same, one = count_pixels(page)
    assert same == one
    page.evaluate(PUSH)
    run_to(page, 1)
    both, one = count_pixels(page)
    assert both > 1.3 * one > 0
    values = page.locator(".chart + p").first
    assert "before the change" in values.inner_text()
    old = "kreisel.view.tops[0].before?.visible ?? false"
    assert page.evaluate(old)
    page.get_by_role("button", name="Rewind").click()
    assert page.evaluate(old) and read_earlier(page).shape[0] == 2
    page.get_by_role("button", name="Undo").click()
    assert not page.evaluate(old) and page.evaluate("kreisel.page.previousMotion") is None
    run_to(page, 2)
    assert read_earlier(page).size == 0 and "before" not in values.inner_text()


def test_a_change_of_scene_removes_curves_before_a_push(page):
    advance(page, 2)
    push = "kreisel.page.pushTop(kreisel.page.tops[0], (s) => (s.momentum[0] += 1))"
    page.evaluate(f"{push}; kreisel.page.setRunning(false)")
    assert page.evaluate("!!kreisel.page.previousMotion")
    page.evaluate("kreisel.page.setValue('gravity', 2)")
    assert page.evaluate("kreisel.page.previousMotion") is None


def test_charts_of_integrals_follow_the_shape(page):
    load(page, chart="energy")
    page.get_by_label("Shape").select_option("kowalewski")
    assert read_scene(page)["chart"] == read_scene(page)["integral"] == "kowalewski"
    load(page, chart="spin")
    page.get_by_label("Shape").select_option("kowalewski")
    assert read_scene(page)["chart"] == "spin"
