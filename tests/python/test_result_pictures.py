"""Tests of figures of sections, spectra, indicators and rods, and of displays in notebooks."""

import dataclasses
import math
import sys
import types

import kreisel as kr
import numpy as np
import pytest
from tops import GENERAL

pytest.importorskip("matplotlib")
from kreisel._plot import growth_charts, panels, section_chart, solids, spectrum
from matplotlib import colormaps
from matplotlib.colors import LogNorm, to_rgb
from matplotlib.figure import Figure

TOP = kr.scenes.asymmetric
TOPS = kr.starts(TOP.body, energy=2, vertical=1, n=5, seed=2, gravity=1)
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


def test_a_section_shows_classifications_of_chaos():
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
    assert (
        list(dashed.get_xdata()) == [frequencies.precession_rate] * 2 and axes.get_yscale() == "log"
    )
    assert axes.get_xlabel() == "angular frequency [s⁻¹]"
    positions = {text.get_text(): text.xy[0] for text in axes.texts}
    assert len(positions) == 12 and positions["0"] == pytest.approx(frequencies.precession_rate)
    assert positions["+2"] == pytest.approx(frequencies.precession_rate + 2 * frequencies.nutation)
    assert PNG in frequencies._repr_html_()


def test_a_chaotic_spectrum_has_lines_without_numbers():
    frequencies = kr.frequencies(kr.solve(TOP, np.linspace(0, 200, 2001)), 5)
    axes = frequencies.plot(Figure().add_subplot())
    assert len(axes.lines[0].get_xdata()) == 5 and "rest" in axes.get_title()
    assert len(axes.texts) < 3


def test_a_top_at_rest_has_a_spectrum_without_lines():
    top = kr.Scene(
        kr.Body.symmetric(1.0, 1.0, 0.5, 1.0, unphysical=True), momentum=(0, 0, 0), gravity=1
    )
    found = kr.frequencies(kr.solve(top, np.linspace(0.0, 50.0, 200)))
    axes = found.plot()
    assert axes.get_title().startswith("0 lines, rest ") and not axes.texts
    assert "dashed" in axes.get_title() and found.nutation == found.precession_rate == 0.0
    none = dataclasses.replace(found, precession_rate=math.nan).plot()
    assert not len(none.lines)
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
    lowest = 0.0 if indicate is kr.lyapunov else 0.1
    curves = {tuple(row[row > lowest]) for row in indicator.curve}
    assert len(curves) == 5 and all(map(len, curves))
    for line in lines:
        assert np.array_equal(line.get_xdata(), -indicator.t)
        y = line.get_ydata()
        curves.remove(tuple(y[np.isfinite(y)]))
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
    indicator = kr.oli(kr.Ensemble(TOP.body, momentum=np.ones((2, 1, 2, 3)), gravity=1), 1.0)
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
    for times, count in (([], "0 states"), ([1.0], "1 state")):
        short = kr.rod(kr.solve(kr.scenes.cusps, times))
        with pytest.raises(ValueError, match=f"a rod of {count} cannot be drawn"):
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


# Charts of numbers without a motion


@pytest.mark.parametrize("n, area", [(1, 9.0), (1000, 9.0), (3000, 4.0), (40000, 0.35), (0, 9.0)])
def test_the_points_of_a_section_share_an_area(n, area):
    points = np.arange(2.0 * n).reshape(2, n)
    top = np.zeros(n, dtype=np.int64)
    axes = section_chart.draw_section_points(None, tuple(points), ("a", "b"), top, None)
    (dots,) = axes.collections
    assert list(dots.get_sizes()) == [area] and not np.any(dots.get_linewidths())
    assert np.array_equal(np.asarray(dots.get_offsets()).T, points) and dots.get_rasterized()
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("a", "b")
    assert tuple(axes.figure.get_size_inches()) == (5.2, 4.4)
    assert not axes.xaxis.get_tick_params()["gridOn"] and axes.get_legend() is None
    assert axes.xaxis.label.get_fontsize() == 9


@pytest.mark.parametrize("top", [(0, 1, 2, 4), (0, 1), (0, 0)])
def test_the_colours_of_tops_span_the_visible_part_of_the_map(top):
    x = np.arange(float(len(top)))
    axes = section_chart.draw_section_points(None, (x, x), ("a", "b"), np.array(top), None)
    expected = colormaps["viridis"](0.05 + 0.8 * np.array(top) / max(*top, 1))
    assert np.array_equal(axes.collections[0].get_facecolors(), expected)


def test_the_legend_of_a_section_names_the_classes_that_occur():
    x = np.arange(4.0)
    top, classes = np.array([1, 0, 2, 2]), np.array([2, 0, 2], dtype=np.int8)
    axes = section_chart.draw_section_points(None, (x, x), ("a", "b"), top, classes)
    expected = [to_rgb(panels.CLASSES[k][1]) for k in (0, 2, 2, 2)]
    assert axes.collections[0].get_facecolors()[:, :3] == pytest.approx(np.array(expected))
    legend = axes.get_legend()
    assert [text.get_text() for text in legend.get_texts()] == ["regular", "in doubt"]
    assert [mark.get_color() for mark in legend.get_lines()] == [
        panels.CLASSES[0][1],
        panels.CLASSES[2][1],
    ]
    assert {(mark.get_marker(), mark.get_markersize()) for mark in legend.get_lines()} == {("o", 4)}
    assert {text.get_fontsize() for text in legend.get_texts()} == {8}
    assert legend._ncols == 3 and not legend.get_frame_on()
    anchor = axes.transAxes.inverted().transform(legend.get_bbox_to_anchor().p0)
    assert anchor == pytest.approx((0.5, 1.0))


def make_spectrum(lines, amplitudes, precession=0.5, nutation=2.0):
    amplitudes = np.array(amplitudes, dtype=complex)
    return types.SimpleNamespace(
        lines=np.array(lines), amplitudes=amplitudes, precession_rate=precession, nutation=nutation,
        rest=1.25e-5,
    )  # fmt: skip


@pytest.mark.parametrize("weak, floor", [(1e-3, 1e-4), (10**-2.4, 1e-3), (10**-2.6, 1e-4)])
def test_the_scale_of_a_spectrum_ends_half_a_decade_beyond_its_lines(weak, floor):
    lines = make_spectrum([0.5, 2.5, 9.0, -1.5], [0.25j, weak, 0.0, -0.125])
    axes = spectrum.draw_spectral_lines(lines, None, "s")
    assert tuple(axes.figure.get_size_inches()) == (6.4, 3.4)
    assert axes.get_ylim() == pytest.approx((floor, 0.25 * 10**0.5)) and axes.get_yscale() == "log"
    dots, dashed = axes.lines
    expected = np.array([(0.5, 0.25), (2.5, weak), (-1.5, 0.125)])
    assert dots.get_xydata() == pytest.approx(expected)
    assert (dots.get_marker(), dots.get_markersize(), dots.get_linestyle()) == ("o", 4, "None")
    (stems,) = axes.collections
    for stem, (x, y) in zip(stems.get_segments(), expected, strict=True):
        assert stem == pytest.approx(np.array([(x, floor), (x, y)]))
    assert list(stems.get_linewidth()) == [1.4]
    assert (dashed.get_linewidth(), dashed.get_linestyle()) == (1.0, "--")
    assert dashed.get_zorder() == 1 and axes.margins()[0] == 0.06
    assert axes.get_title() == "3 lines, rest 1e-05; dashed: mean precession"
    assert axes.title.get_fontsize() == 9 and axes.xaxis.label.get_fontsize() == 9
    labels = [text.get_text() for text in axes.texts]
    assert labels == ["0", "+1", "-1"]
    for text, place in zip(axes.texts, expected, strict=True):
        assert text.xy == pytest.approx(tuple(place)) and text.xyann == (0, 4)
        assert (text.get_fontsize(), text.get_ha(), text.anncoords) == (
            *(7.5, "center"),
            "offset points",
        )


def test_lines_have_numbers_within_a_thousandth_of_the_nutation():
    multiples = np.array([0.0, 1.0009, 2.0011, -2.9991, -3.9989, 0.5])
    lines = make_spectrum(0.5 + 2.0 * multiples, np.ones(6))
    labels = [text.get_text() for text in spectrum.draw_spectral_lines(lines, None, "s").texts]
    assert labels == ["0", "+1", "-3"]
    for nutation, count in (0.0, 0), (-2.0, 0), (0.25, 6):
        lines = make_spectrum([0.5 + 0.25 * k for k in range(6)], np.ones(6), nutation=nutation)
        assert len(spectrum.draw_spectral_lines(lines, None, "s").texts) == count


def make_indicator(curve, name="megno", t=(1.0, 10.0), chaotic=False, doubtful=False):
    curve = np.array(curve, dtype=float)
    flags = (
        np.broadcast_to(np.array(flag, dtype=bool), curve.shape[:-1])
        for flag in (chaotic, doubtful)
    )
    return types.SimpleNamespace(
        name=name, t=np.array(t), curve=curve, threshold=4.0,
        **dict(zip(("is_chaotic", "is_doubtful"), flags, strict=True)),
    )  # fmt: skip


def test_curves_have_the_colours_and_the_order_of_their_classes():
    values = [[0.5, 2.0], [0.1, 0.2], [3.0, 4.0], [5.0, 6.0]]
    indicator = make_indicator(values, "oli", chaotic=[0, 1, 1, 0], doubtful=[0, 0, 1, 0])
    assert growth_charts.classify_tops_by_chaos(indicator).tolist() == [0, 1, 2, 0]
    axes = growth_charts.draw_indicator_curves(indicator, None, "s")
    order = [0, 3, 1, 2]
    for line, k, index in zip(axes.lines, order, (0, 0, 1, 2), strict=True):
        expected = [y if y > 0.1 else np.nan for y in values[k]]
        assert line.get_ydata() == pytest.approx(expected, nan_ok=True)
        assert line.get_zorder() == pytest.approx(2.0 + 0.1 * index)
        assert (line.get_color(), line.get_linewidth()) == (panels.CLASSES[index][1], 0.8)
        assert line.get_alpha() == 1.0 and line.get_marker() in ("", "None")
    legend = axes.get_legend()
    labels = [text.get_text() for text in legend.get_texts()]
    assert labels == ["regular (2)", "chaotic (1)", "in doubt (1)"] and not legend.get_frame_on()
    assert {text.get_fontsize() for text in legend.get_texts()} == {8}
    assert [mark.get_linewidth() for mark in legend.get_lines()] == [2.0] * 3
    assert [mark.get_color() for mark in legend.get_lines()] == [c for _, c in panels.CLASSES]
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("time [s]", "OLI")
    assert axes.xaxis.label.get_fontsize() == 9


@pytest.mark.parametrize("n, alpha", [(1, 1.0), (20, 1.0), (40, 0.5), (200, 0.15)])
def test_many_curves_are_transparent(n, alpha):
    indicator = make_indicator(np.full((n, 1), 2.0), t=[5.0])
    *curves, threshold = growth_charts.draw_indicator_curves(indicator, None, "s").lines
    assert len(curves) == n and {line.get_alpha() for line in curves} == {alpha}
    assert {line.get_marker() for line in curves} == {"o"}
    assert {line.get_linewidth() for line in curves} == {1.4 if n == 1 else 0.8}
    assert list(threshold.get_ydata()) == [4.0, 4.0] and threshold.get_zorder() == 1
    assert (threshold.get_linewidth(), threshold.get_linestyle()) == (0.9, "--")
    texts = threshold.axes.get_legend().get_texts()
    assert [text.get_text() for text in texts] == [
        "regular" if n == 1 else f"regular ({n})",
        "threshold",
    ]
    mark = threshold.axes.get_legend().get_lines()[1]
    assert (mark.get_linewidth(), mark.get_linestyle()) == (0.9, "--")


@pytest.mark.parametrize("name, lowest", [("lyapunov", 0.0), ("megno", 0.1), ("oli", 0.1)])
def test_values_that_are_too_small_are_left_out_of_the_scale(name, lowest):
    indicator = make_indicator([[lowest, lowest + 0.01]], name)
    line = growth_charts.draw_indicator_curves(indicator, None, "s").lines[0]
    assert line.get_ydata() == pytest.approx([np.nan, lowest + 0.01], nan_ok=True)


@pytest.mark.parametrize("end, label", [(-1.0, "time [s], back from the start"), (1.0, "time [s]")])
def test_the_axis_of_an_indicator_names_the_direction_of_time(end, label):
    indicator = make_indicator([[2.0, 3.0]], t=(0.0, end))
    axes = growth_charts.draw_indicator_curves(indicator, None, "s")
    assert axes.get_xlabel() == label and list(axes.lines[0].get_xdata()) == [0.0, 1.0]


GRID = TOP.vary(gravity=np.array([[0.5], [1.0]]), spin=[2.0, 1.0, 0.5])


@pytest.mark.parametrize("largest, top", [(3.0, 10.0), (50.0, 50.0), (np.nan, 10.0)])
def test_the_map_of_a_growth_begins_at_one(largest, top):
    values = np.array([[0.5, 1.5, largest], [np.nan, 2.0, 0.0]])
    indicator = make_indicator(
        np.stack([9.0 + values, values], -1), doubtful=[[0, 1, 0], [0, 0, 1]]
    )
    axes = growth_charts.draw_chaos_indicator_map(indicator, GRID, None, "s")
    field = axes.collections[0]
    assert isinstance(field.norm, LogNorm) and (field.norm.vmin, field.norm.vmax) == (1.0, top)
    shown = np.ma.filled(field.get_array(), np.nan)
    assert shown == pytest.approx(np.where(values < 1.0, 1.0, values), nan_ok=True)
    (dots,) = axes.lines
    assert dots.get_xydata().tolist() == [[1.0, 0.5], [0.5, 1.0]]
    assert (dots.get_markersize(), dots.get_markeredgewidth()) == (1.5, 0.0)
    assert axes.get_title() == "dots: classification in doubt" and axes.title.get_fontsize() == 9
    assert axes.figure.axes[1].get_ylabel() == "MEGNO, t = 10" and field.get_rasterized()
    assert not axes.xaxis.get_tick_params()["gridOn"] and axes.xaxis.label.get_fontsize() == 9


def test_the_map_of_an_exponent_has_a_linear_scale():
    values = np.array([[-0.5, 1.5, 0.0], [0.25, 2.0, 0.0]])
    indicator = make_indicator(values[..., None], "lyapunov", t=[4.0])
    axes = growth_charts.draw_chaos_indicator_map(indicator, GRID, None, "s")
    field = axes.collections[0]
    assert np.array_equal(field.get_array(), values) and not len(axes.lines)
    assert (field.norm.vmin, field.norm.vmax) == (-0.5, 2.0) and axes.get_title() == ""


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        ([1.0, 2.0, 4.0], [1.0, 2.0, 4.0]),
        ([[4.0], [2.0], [-1.0]], [4.0, 2.0, -1.0]),
        ([1.0, 2.0, 2.0], [0.0, 1.0, 2.0]),
        ([2.0, 2.0, 1.0], [0.0, 1.0, 2.0]),
        ([1.0, 3.0, 2.0], [0.0, 1.0, 2.0]),
        ([1.0, 2.0], [0.0, 1.0, 2.0]),
        (None, [0.0, 1.0, 2.0]),
    ],
)
def test_only_monotonic_values_are_shown_on_an_axis(values, expected):
    tops = types.SimpleNamespace(axes=("i", "body_mass"), shape=(2, 3), coords={})
    if values is not None:
        tops.coords["body_mass"] = np.array(values)
    name, axis = growth_charts._get_varied_axis_name_and_values(tops, 1)
    assert name == "body mass" and axis.tolist() == expected and axis.dtype == np.float64
