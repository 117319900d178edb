"""Tests of the figures that show sections, spectra, chaos indicators and tables."""

import dataclasses
import math
import sys

import kreisel as kr
import numpy as np
import pytest
from tops import GENERAL

pytest.importorskip("matplotlib")
from kreisel._plot import panels, solids
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure

TOP = kr.scenes.asymmetric
TOPS = kr.starts(TOP.body, energy=2, vertical=1, n=5, seed=2)
SECTION = kr.section(TOPS, n=20)
CURVES = kr.megno(TOPS, 1000)
PNG = 'src="data:image/png;base64,iVBORw0KGgo'


def points_of(axes):
    return np.asarray(axes.collections[0].get_offsets())


def test_a_section_has_a_point_for_each_state():
    axes = SECTION.plot()
    x, y = points_of(axes).T
    assert x == pytest.approx(np.degrees(SECTION.spin_angle), rel=1e-15)
    assert np.array_equal(y, SECTION.apex[:, 2])
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("spin angle [°]", "apex z")
    colours = axes.collections[0].get_facecolors()
    first = SECTION.top == 0
    assert len(np.unique(colours[first], axis=0)) == 1 and len(np.unique(colours, axis=0)) == 5


def test_a_section_is_drawn_over_any_components():
    axes = SECTION.plot(x="t", y="axial_momentum", time_unit="s")
    assert np.array_equal(points_of(axes), np.stack([SECTION.t, SECTION.axial_momentum], axis=1))
    assert axes.get_xlabel() == "t [s]" and axes.get_ylabel() == "axial momentum [M L² s⁻¹]"
    axes = SECTION.plot(Figure().add_subplot(), x="nutation", y="q_w", degrees=False)
    assert np.array_equal(points_of(axes), np.stack([SECTION.nutation, SECTION.q[:, 0]], axis=1))
    assert axes.get_xlabel() == "nutation [rad]"


def test_a_section_shows_verdicts_on_chaos():
    axes = SECTION.plot(indicator=CURVES)
    colours = axes.collections[0].get_facecolors()[:, :3]
    for i in range(5):
        index = 2 if CURVES.is_doubtful[i] else int(CURVES.is_chaotic[i])
        expected = to_rgb(panels.CLASSES[index][1])
        assert colours[SECTION.top == i] == pytest.approx(np.tile(expected, (20, 1)))
    texts = [text.get_text() for text in axes.get_legend().get_texts()]
    assert 0 < len(texts) <= 3 and set(texts) <= {"regular", "chaotic", "in doubt"}


@pytest.mark.parametrize("tops", [TOP, TOP.vary(gravity=[[0.5], [1.0]], spin=[0.0, 1.0, 2.0])])
def test_sections_of_any_shape_are_drawn(tops):
    section, indicator = kr.section(tops, n=3), kr.oli(tops, 800.0)
    colours = section.plot(indicator=indicator).collections[0].get_facecolors()[:, :3]
    chaotic = np.repeat(np.ravel(indicator.is_chaotic & ~np.asarray(indicator.is_doubtful)), 3)
    assert chaotic.any()
    expected = to_rgb(panels.CLASSES[1][1])
    assert np.array_equal((colours == expected).all(axis=1), chaotic)


@pytest.mark.parametrize(
    ("words", "error", "text"),
    [
        ({"x": "spin_angel"}, ValueError, "unknown component 'spin_angel'; did you mean 'spin_an"),
        ({"y": "apex"}, ValueError, "unknown component 'apex'"),
        ({"y": 3}, TypeError, "y must be the name of a component, not 3"),
        ({"indicator": CURVES.value}, TypeError, r"indicator must be a kreisel\.Indicator"),
        ({"indicator": kr.oli(TOP, 1.0)}, ValueError, r"the same tops, of shape \(5,\), not of sh"),
        ({"degrees": 1}, TypeError, "degrees must be True or False"),
        ({"time_unit": " "}, ValueError, "time_unit must be the name of a unit"),
        ({"time_unit": 1.0}, TypeError, "time_unit must be the name of a unit"),
        ({"axes": 1}, TypeError, "axes must be axes of matplotlib"),
    ],
)
def test_invalid_drawings_of_sections_are_refused(words, error, text):
    with pytest.raises(error, match=text):
        SECTION.plot(**words)


def test_a_spectrum_has_a_dot_at_each_line_and_counts_nutations():
    frequencies = kr.frequencies(kr.solve(kr.scenes.cusps, np.linspace(0, 200, 4001)))
    axes = frequencies.plot(time_unit="s")
    dots, dashed = axes.lines
    assert np.array_equal(dots.get_xdata(), frequencies.lines)
    assert np.array_equal(dots.get_ydata(), np.abs(frequencies.amplitudes))
    assert list(dashed.get_xdata()) == [frequencies.precession] * 2 and axes.get_yscale() == "log"
    assert axes.get_xlabel() == "angular frequency [s⁻¹]"
    positions = {text.get_text(): text.xy[0] for text in axes.texts}
    assert len(positions) == 12 and positions["0"] == pytest.approx(frequencies.precession)
    assert positions["+2"] == pytest.approx(frequencies.precession + 2 * frequencies.nutation)
    assert PNG in frequencies._repr_html_()


def test_a_chaotic_spectrum_has_lines_without_numbers():
    frequencies = kr.frequencies(kr.solve(TOP, np.linspace(0, 200, 2001)), 5)
    axes = frequencies.plot(Figure().add_subplot())
    assert len(axes.lines[0].get_xdata()) == 5 and "rest" in axes.get_title()
    assert len(axes.texts) < 3


def test_a_top_at_rest_has_a_spectrum_without_lines():
    top = kr.Scene(kr.Body.symmetric(1.0, 1.0, 0.5, 1.0, unphysical=True), momentum=(0, 0, 0))
    found = kr.frequencies(kr.solve(top, np.linspace(0.0, 50.0, 200)))
    axes = found.plot()
    assert axes.get_title().startswith("0 lines, rest ") and not axes.texts
    assert "dashed" in axes.get_title() and found.nutation == found.precession == 0.0
    none = dataclasses.replace(found, precession=math.nan).plot()
    assert none.lines == [] or not len(none.lines)
    assert "dashed" not in none.get_title()
    steady = dataclasses.replace(
        kr.frequencies(kr.solve(TOP, np.linspace(0, 9, 99)), 5), nutation=0.0
    )
    assert len(steady.plot().lines[0].get_xdata()) == 5 and not steady.plot().texts


@pytest.mark.parametrize("indicate", [kr.lyapunov, kr.megno, kr.oli])
def test_curves_show_the_data_of_the_indicator(indicate):
    indicator = indicate(TOPS, -200.0)
    axes = indicator.plot(time_unit="s")
    lines = [line for line in axes.lines if len(line.get_xdata()) == 32]
    assert len(lines) == 5 and axes.get_xlabel() == "time [s], back from the start"
    curves = {tuple(row[row > 0.1]) for row in indicator.curve}
    for line in lines:
        assert np.array_equal(line.get_xdata(), -indicator.t)
        y = line.get_ydata()
        assert indicate is kr.lyapunov or tuple(y[np.isfinite(y)]) in curves
    dashed = [line for line in axes.lines if line.get_linestyle() == "--"]
    assert [line.get_ydata()[0] for line in dashed] == [4.0] * (indicate is kr.megno)
    assert axes.get_xscale() == axes.get_yscale() == "log"


def test_maps_show_the_value_of_each_top():
    tops = TOP.vary(gravity=np.array([[0.5], [1.0], [1.5]]), spin=[0.0, 1.0])
    indicator = kr.lyapunov(tops, 100.0)
    axes = indicator.plot(Figure().add_subplot(), time_unit="s")
    assert np.array_equal(axes.collections[0].get_array().reshape(3, 2), indicator.value)
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("spin", "gravity")
    assert axes.figure.axes[1].get_ylabel() == "largest exponent [s⁻¹], t = 100"
    places = {tuple(place) for place in axes.lines[0].get_xydata()}
    rows, columns = np.nonzero(indicator.is_doubtful)
    assert places == {(columns[i] * 1.0, 0.5 + 0.5 * rows[i]) for i in range(len(rows))}
    short_indicator = kr.megno(tops, 1e3, max_steps=5)
    assert short_indicator.failed.size == 6 and short_indicator.plot().collections


def test_maps_over_unsorted_values_have_numbered_axes():
    tops = TOP.vary(gravity=np.array([[0.5], [1.5], [1.0]]), spin=[1.0, 0.0])
    axes = kr.lyapunov(tops, 20.0).plot()
    assert axes.get_ylim() == (-0.5, 2.5) and axes.get_xlim() == (-0.5, 1.5)


def test_maps_without_doubt_have_no_dots():
    tops = kr.scenes.thesis.vary(gravity=np.array([[0.5], [1.0]]), spin=[8.0, 9.0])
    told = kr.megno(tops, 5000.0)
    assert not np.any(told.is_doubtful)
    axes = told.plot()
    assert not len(axes.lines) and axes.get_title() == ""


def test_a_curve_of_one_point_has_no_scale_bar():
    axes = Figure().add_subplot()
    solids.draw_start_and_scale_bar(np.ones((5, 3)), axes, "m")
    assert [note.get_text() for note in axes.texts] == ["start"] and len(axes.lines) == 1


def test_indicators_of_three_dimensions_are_not_drawn():
    indicator = kr.oli(kr.Ensemble(TOP.body, momentum=np.ones((2, 1, 2, 3))), 1.0)
    with pytest.raises(ValueError, match="indicators of 3 dimensions cannot be drawn: select two"):
        indicator.plot()
    assert indicator._repr_html_() is None and kr.oli(TOPS[:0], 1.0)._repr_html_() is None


def test_drawings_of_rods_show_the_start_and_a_scale():
    rod = kr.rod(kr.solve(kr.scenes.cusps, np.linspace(0, 20, 401)))
    axes = rod.plot(length_unit="m", elevation=0.0)
    assert [text.get_text() for text in axes.texts] == ["start", "2 m"]
    dot, bar = axes.lines
    assert dot.get_xydata().tolist() == [[0.0, 0.0]]
    assert np.ptp(bar.get_xdata()) == pytest.approx(2.0) and np.ptp(bar.get_ydata()) == 0.0
    assert PNG in rod._repr_html_()
    for times in ([], [1.0]):
        short = kr.rod(kr.solve(kr.scenes.cusps, times))
        with pytest.raises(ValueError, match=f"a rod of {len(times)} states cannot be drawn"):
            short.plot()
        assert short._repr_html_() is None


def test_a_rod_back_in_time_is_seen_from_outside():
    """Check that the brightest face of a straight rod is on the illuminated side."""
    sides = []
    for t in (5.0, -5.0):
        rod = kr.rod(kr.solve(kr.scenes.sleeping.replace(momentum=(0, 0, 3)), np.linspace(0, t, 9)))
        tube = rod.plot(Figure().add_subplot(), elevation=0.0).collections[0]
        bright = tube.get_facecolors()[:, 0].argmax()
        sides.append(tube.get_paths()[bright].vertices[:, 0].mean())
    assert sides[0] < 0.0 and sides[1] == pytest.approx(sides[0])


def test_notebooks_show_paths_as_pictures():
    path = kr.solve(GENERAL, [0.0, 1.0])
    html = path._repr_html_()
    assert PNG in html and "&lt;kreisel.Path: 2 states" in html
    assert kr.solve(GENERAL, [])._repr_html_() is None
    assert kr.solve(GENERAL, [1.0], want=("energy",))._repr_html_() is None
    enough = kr.solve(GENERAL, [1.0], want=("apex", "nutation", "precession_angle"))
    assert PNG in enough._repr_html_()


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


def test_notebooks_show_no_pictures_of_long_paths(monkeypatch):
    from kreisel._results import path as paths

    monkeypatch.setattr(paths, "MOST_DISPLAYED", 2)
    assert kr.solve(GENERAL, [0.0, 1.0])._repr_html_() is not None
    assert kr.solve(GENERAL, [0.0, 1.0, 2.0])._repr_html_() is None


def test_notebooks_show_sections_and_indicators():
    assert PNG in SECTION._repr_html_() and PNG in CURVES._repr_html_()
    assert kr.section(TOPS[:0], n=3)._repr_html_() is None


def test_without_matplotlib_notebooks_show_text(monkeypatch):
    path = kr.solve(GENERAL, [0.0, 1.0])
    for name in [name for name in sys.modules if name.startswith("kreisel._plot.")]:
        monkeypatch.delitem(sys.modules, name)
    for name in ("matplotlib", "matplotlib.axes"):
        monkeypatch.setitem(sys.modules, name, None)
    assert path._repr_html_() is None and SECTION._repr_html_() is None


def test_plans_and_tables_are_html_tables():
    plan = kr.plan(GENERAL, 1.0, step=0.1, method="rk4")
    html = plan._repr_html_()
    assert html.count("<tr>") == len(str(plan).splitlines())
    assert ">rk4: requested by name</td>" in html
    many = kr.plan(TOPS, 1.0)._repr_html_()
    assert ">tops</td>" in many and ">the first top</td>" in many
    table = kr.compare(GENERAL, 0.5, ["rk4"], [0.1, 0.05], repeats=1)
    rows = table._repr_html_()
    assert rows.count("<tr>") == 3 and rows.count("<th") == 11 and ">rk4</td>" in rows
    failure_table = kr.Table((kr.Row("<b>", "rk4", None, None, 1, 1, 1, 1, 1, 1, "a < b & c"),))
    assert (
        "&lt;b&gt;" in failure_table._repr_html_()
        and "a &lt; b &amp; c" in failure_table._repr_html_()
    )


TO_CONES = np.array(
    [[17.8824, 43.5161, 4.11935], [3.45565, 27.1554, 3.86714], [0.0299566, 0.184309, 1.46709]]
)
WITHOUT_GREEN = np.array([[1.0, 0.0, 0.0], [0.494207, 0.0, 1.24827], [0.0, 0.0, 1.0]])


def simulate_deuteranopia(colour):
    """Return a colour as seen by deuteranopes (Vienot, Brettel and Mollon 1999)."""
    linear = np.array(to_rgb(colour)) ** 2.2
    rgb = np.linalg.solve(TO_CONES, WITHOUT_GREEN @ TO_CONES @ linear)
    return np.clip(rgb, 0.0, 1.0) ** (1 / 2.2)


@pytest.mark.parametrize(
    "colours",
    [
        [colour for _, colour in panels.CLASSES],
        [solids.BLUE, solids.ORANGE, "white"],
        [solids.RED, solids.CREAM],
    ],
)
def test_deuteranopes_can_distinguish_the_colours(colours):
    simulated_colours = [simulate_deuteranopia(colour) for colour in colours]
    for i, one in enumerate(simulated_colours):
        for other in simulated_colours[:i]:
            assert np.abs(one - other).max() > 0.3
