"""Tests of the charts of paths and fits: geometry, data, labels, layout and styles."""

import types

import kreisel as kr
import numpy as np
import pytest

pytest.importorskip("matplotlib")
from kreisel._plot import charts, fit_charts, panels
from kreisel._plot.solids import BLUE, FAINT, ORANGE
from matplotlib.figure import Figure

CUSPS = kr.solve(kr.scenes.cusps, np.linspace(0, 6, 61))
GENERAL = kr.solve(kr.scenes.asymmetric, np.linspace(0, 6, 61))
TURN = 2 * np.pi * np.arange(200) / 199


def make_axes():
    return Figure().add_subplot()


def style_of(line):
    """Return the colour, the width, the dashes and the opacity of a line."""
    return line.get_color(), line.get_linewidth(), line.get_linestyle(), line.get_alpha()


def marker_style_of(line):
    return line.get_color(), line.get_marker(), line.get_markersize(), line.get_linestyle()


def test_the_unit_sphere_has_an_outline_an_equator_and_an_arrow():
    axes, e = make_axes(), np.radians(35.0)
    charts.draw_unit_sphere(axes, 35.0)
    outline, equator = axes.lines
    assert np.stack(outline.get_data()) == pytest.approx(np.stack([np.cos(TURN), np.sin(TURN)]))
    assert style_of(outline) == (FAINT, 0.8, "-", None)
    x, y = equator.get_data()
    is_visible = np.sin(TURN) < 0.0  # on the side of the viewer
    assert not is_visible[0] and np.array_equal(np.isfinite(y), is_visible)
    assert x == pytest.approx(np.cos(TURN))
    assert y[is_visible] == pytest.approx(np.sin(TURN[is_visible]) * np.sin(e))
    assert style_of(equator) == (FAINT, 0.7, "-", None)
    (arrow,) = axes.texts
    assert arrow.get_text() == "" and arrow.arrowprops == {"arrowstyle": "->", "color": FAINT}
    assert arrow.xyann == pytest.approx((0.0, np.cos(e)))
    assert arrow.xy == pytest.approx((0.0, 1.25 * np.cos(e)))
    assert axes.get_xlim() == (-1.05, 1.05) and axes.get_ylim() == (-1.05, 1.3)
    by_default = make_axes()
    charts.draw_unit_sphere(by_default)
    assert by_default.texts[0].xyann[1] == pytest.approx(np.cos(np.radians(20.0)))


@pytest.mark.parametrize("height, elevation", [(0.6, 30.0), (-0.28, 50.0), (0.0, 20.0)])
def test_a_circle_of_latitude_is_visible_on_the_side_of_the_viewer(height, elevation):
    axes, e = make_axes(), np.radians(elevation)
    charts._draw_circle_of_latitude(axes, height, elevation, ORANGE, "--")
    x, y = axes.lines[0].get_data()
    radius = np.sqrt(1 - height**2)
    depth = height * np.sin(e) - radius * np.sin(TURN) * np.cos(e)
    up = height * np.cos(e) + radius * np.sin(TURN) * np.sin(e)
    assert x == pytest.approx(radius * np.cos(TURN))
    is_clear = np.abs(depth) > 1e-12
    assert np.array_equal(np.isfinite(y[is_clear]), depth[is_clear] > 0.0)
    assert y[np.isfinite(y)] == pytest.approx(up[np.isfinite(y)])
    assert style_of(axes.lines[0]) == (ORANGE, 0.7, "--", None)


@pytest.mark.parametrize("first, alpha", [((0, 1, 0), 0.4), ((0, -1, 0), 1.0), ((1, 0, 0), 1.0)])
def test_a_trace_is_fainter_on_the_far_side(first, alpha):
    axes, e = make_axes(), np.radians(40.0)
    trace = np.array(
        [first, (1, 0, 0), (0, 0, 1), (0, 0, -1), (0.6, 0.8, 0), (0.6, -0.8, 0)], float
    )
    charts.draw_apex_trace(axes, trace, 40.0, [0.5, -0.5])
    *sphere, whole, front, start = axes.lines
    assert len(sphere) == 4 and [line.get_color() for line in sphere[2:]] == [ORANGE] * 2
    assert len(axes.texts) == 1, "the arrow of the vertical"
    assert sphere[2].get_ydata()[199] == pytest.approx(0.5 * np.cos(e))
    assert np.nanmax(sphere[3].get_ydata()) < -0.5 * np.cos(e)
    up = trace[:, 2] * np.cos(e) + trace[:, 1] * np.sin(e)
    assert np.stack(whole.get_data(), -1) == pytest.approx(np.stack([trace[:, 0], up], -1))
    assert style_of(whole) == (BLUE, 0.5, "-", 0.4) and style_of(front) == (BLUE, 1.0, "-", None)
    is_in_front = trace[:, 2] * np.sin(e) - trace[:, 1] * np.cos(e) > 0.0
    assert np.array_equal(np.isfinite(front.get_ydata()), is_in_front)
    assert front.get_ydata()[is_in_front] == pytest.approx(up[is_in_front])
    assert np.array_equal(front.get_xdata(), trace[:, 0])
    assert start.get_xydata() == pytest.approx(np.array([[trace[0, 0], up[0]]]))
    assert marker_style_of(start) == ("black", "o", 4, "None") and start.get_alpha() == alpha
    assert axes.get_aspect() == 1.0 and not axes.axison


@pytest.mark.parametrize(
    ("changes", "jumps"),
    [
        ([], []),
        ([0.75], []),
        ([0.5, 0.0, 0.0], []),
        ([0.0, 0.0, -0.5625, 0.0, 0.0, 0.5, 0.75], [2, 6]),
        ([0.25, 2.0, 0.25, 0.25, -2.125, -0.25, 0.25], [4]),
        ([1.0, -1.0, 1.0, 7.0], []),
    ],
)
def test_jumps_of_the_precession_exceed_half_a_radian_and_8_medians(changes, jumps):
    precession = np.concatenate([[1.0], 1.0 + np.cumsum(changes)])
    assert charts._find_precession_jumps(precession).tolist() == jumps


def test_no_state_has_no_jump():
    assert charts._find_precession_jumps(np.zeros(0)).tolist() == []


def test_gaps_lie_inside_their_intervals():
    t, values = charts._insert_gaps_at_jumps(np.arange(4.0), 5.0 + np.arange(4.0), np.array([0, 2]))
    assert t == pytest.approx([0, np.nan, 1, 2, np.nan, 3], nan_ok=True)
    assert values == pytest.approx([5, np.nan, 6, 7, np.nan, 8], nan_ok=True)


@pytest.mark.parametrize(
    ("limits", "unit", "expected"),
    [
        ((1.0, 1.0 + 5e-7), 1.0, (0.95, 1.05)),
        ((0.0, 1e-6), 1.0, (0.0, 1e-6)),
        ((60.0, 60.0 + 2e-5), 57.0, (57.15, 62.85)),
        ((0.0, 1e-4), 57.0, (0.0, 1e-4)),
        ((-3.0, -1.0), 1.0, (-3.0, -1.0)),
    ],
)
def test_only_a_constant_nutation_widens_its_axis(limits, unit, expected):
    axes = make_axes()
    axes.set_ylim(limits)
    charts._widen_narrow_axis(axes, unit)
    assert axes.get_ylim() == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize(
    ("angles", "points", "title"),
    [
        ([0.0, 0.5, 1.5], [np.nan, 1.0, 3.0], "angle between the apexes"),
        ([0.0, 0.0, 0.0], [0.0, 0.0, 0.0], "the apexes are equal"),
        ([], None, "the paths have no times in common"),
    ],
)
def test_the_difference_of_paths_omits_zeros_on_its_scale(angles, points, title):
    chart, t = make_axes(), np.array([1.0, 2.0, 4.0])[: len(angles)]
    difference = charts.AngleBetweenPaths(t, np.array(angles), "apexes")
    charts._draw_angle_between_paths(chart, difference, (2.0, "half"), "time [s]")
    assert (chart.get_xlabel(), chart.get_ylabel()) == ("time [s]", "difference [half]")
    assert chart.get_title() == title and chart.title.get_fontsize() == 9
    assert chart.get_yscale() == ("log" if any(angles) else "linear")
    assert len(chart.lines) == (points is not None) and chart.xaxis.label.get_fontsize() == 9
    for line in chart.lines:
        assert np.array_equal(line.get_xdata(), t) and style_of(line) == (BLUE, 1.2, "-", None)
        assert line.get_ydata() == pytest.approx(points, nan_ok=True)


def test_one_path_has_a_globe_beside_two_charts():
    picture = kr.plot(CUSPS)
    assert tuple(picture.figure.get_size_inches()) == (8.4, 3.9)
    specs = [axes.get_subplotspec() for axes in picture]
    assert specs[0].get_gridspec().get_width_ratios() == (3, 4)
    assert specs[0].get_gridspec().get_geometry() == (2, 2)
    assert [(s.rowspan.start, s.rowspan.stop, s.colspan.start) for s in specs] == [
        (0, 2, 0),
        (0, 1, 1),
        (1, 2, 1),
    ]
    assert picture[1].get_shared_x_axes().joined(picture[1], picture[2])
    assert picture[0].title.get_fontsize() == 10
    curve, *limits = picture[1].lines
    assert style_of(curve) == style_of(picture[2].lines[0]) == (BLUE, 1.2, "-", None)
    assert [style_of(line) for line in limits] == [(ORANGE, 0.9, "--", None)] * 2
    assert {line.get_zorder() for line in limits} == {1}
    assert [chart.xaxis.get_tick_params()["labelbottom"] for chart in picture[1:]] == [False, True]
    assert [text.get_text() for text in picture[0].get_legend().get_texts()] == ["start", "limits"]


@pytest.mark.parametrize("paths, difference", [([CUSPS, GENERAL], True), ([CUSPS] * 3, False)])
def test_several_paths_stand_in_columns(paths, difference):
    picture, n = kr.plot(paths), len(paths)
    heights = (6, 4, 4, 4) if difference else (6, 4, 4)
    assert len(picture) == 3 * n + difference
    size = (3.3 * n + 0.6, 6.4 * (18 / 14 if difference else 1.0))
    assert tuple(picture.figure.get_size_inches()) == pytest.approx(size)
    places = [axes.get_subplotspec() for axes in picture]
    grid = places[0].get_gridspec()
    assert grid.get_geometry() == (len(heights), n) and grid.get_height_ratios() == heights
    for k, place in enumerate(places[: 3 * n]):
        assert (place.rowspan.start, place.colspan.start) == (k % 3, k // 3)
        assert len(place.rowspan) == len(place.colspan) == 1
    if difference:
        assert list(places[-1].colspan) == [0, 1] and list(places[-1].rowspan) == [3]
    for i in range(n):
        nutation, precession = picture[3 * i + 1 : 3 * i + 3]
        assert nutation.get_shared_x_axes().joined(nutation, precession)
        assert nutation.get_shared_y_axes().joined(nutation, picture[1])
        assert not precession.get_shared_y_axes().joined(precession, nutation)


def test_axes_of_the_caller_have_labels_of_their_own():
    picture = kr.plot([CUSPS, GENERAL], axes=Figure().subplots(6), time_unit="s")
    for i in range(2):
        nutation, precession = picture[3 * i + 1 : 3 * i + 3]
        assert (nutation.get_ylabel(), precession.get_ylabel()) == (
            "nutation [°]",
            "precession [°]",
        )
        assert precession.get_xlabel() == "time [s]"
        assert nutation.xaxis.get_tick_params()["labelbottom"]


@pytest.mark.parametrize("count, calls", [(6, 0), (7, 1)])
def test_the_difference_is_computed_only_for_its_chart(count, calls):
    results = [charts.AngleBetweenPaths(np.ones(2), np.ones(2), "attitudes")]
    axes = Figure().subplots(count)
    picture = charts.plot_paths([(CUSPS, None), (GENERAL, None)], axes, False, "T", results.pop)
    assert len(results) == 1 - calls and list(picture) == list(axes)
    if calls:
        assert picture[6].get_ylabel() == "difference [rad]"


@pytest.mark.parametrize(
    ("count", "paths", "message"),
    [
        (2, 1, "axes must be 3, for trace, nutation and precession of each path, not 2"),
        (7, 1, "axes must be 3, for .* of each path, not 7"),
        (7, 3, "axes must be 9, for .* of each path, not 7"),
        (5, 2, "axes must be 6, for .* of each path, or 7 with their difference, not 5"),
    ],
)
def test_a_wrong_number_of_axes_is_refused(count, paths, message):
    with pytest.raises(ValueError, match=f"^{message}$"):
        kr.plot([CUSPS] * paths, axes=[make_axes()] * count)


def test_a_path_without_states_is_refused_beside_others():
    empty = kr.solve(kr.scenes.cusps, [])
    for paths in ([CUSPS, empty], [empty, CUSPS]):
        with pytest.raises(ValueError, match="a path without states cannot be drawn"):
            charts.plot_paths([(path, None) for path in paths], None, True, "T")


def test_a_picture_of_one_chart_has_a_figure():
    axes = make_axes()
    assert charts.FigureAxes([axes]).figure is axes.figure


# The style of all charts


def test_a_chart_has_a_faint_grid_and_small_labels():
    axes = make_axes()
    panels.apply_chart_style(axes)
    assert [axes.spines[side].get_visible() for side in ("top", "right", "left", "bottom")] == [
        *(False, False, True, True)
    ]
    for axis in axes.xaxis, axes.yaxis:
        major, minor = axis.get_tick_params(), axis.get_tick_params(which="minor")
        assert (major["labelsize"], major["length"], minor["labelsize"]) == (8, 3, 7)
        assert (major["gridOn"], major["grid_alpha"], major["grid_linewidth"]) == (True, 0.25, 0.6)
        assert axis.label.get_fontsize() == 9
    assert axes.margins() == (0.01, 0.05)
    assert axes.yaxis.get_major_locator().tick_values(0, 11).tolist() == [0, 5, 10, 15]
    assert axes.xaxis.get_major_locator().tick_values(0, 11).tolist() == [0, 2, 4, 6, 8, 10, 12]
    for axis in axes.xaxis, axes.yaxis:
        ticks = axis.get_major_locator().tick_values
        assert ticks(0, 9).tolist() == [0, 2, 4, 6, 8, 10] and ticks(0, 5).size == 6
        assert ticks(0, 31).tolist() == [0, 10, 20, 30, 40]


@pytest.mark.parametrize("x, y", [("log", "linear"), ("linear", "log")])
def test_a_logarithmic_axis_retains_its_ticks(x, y):
    axes = make_axes()
    axes.set(xscale=x, yscale=y)
    locators = {"x": axes.xaxis.get_major_locator(), "y": axes.yaxis.get_major_locator()}
    panels.apply_chart_style(axes)
    assert (axes.xaxis.get_major_locator() is locators["x"]) == (x == "log")
    assert (axes.yaxis.get_major_locator() is locators["y"]) == (y == "log")


def test_new_axes_have_the_requested_size():
    assert tuple(panels.create_axes_in_new_figure().figure.get_size_inches()) == (6.0, 4.0)
    figure = panels.create_axes_in_new_figure(3.0, 2.0).figure
    assert tuple(figure.get_size_inches()) == (3.0, 2.0)
    assert figure.get_layout_engine() is not None


@pytest.mark.parametrize(
    ("dimension", "label"),
    [("", "a"), ("T", "a [s]"), ("M L^2 T^-1", "a [M L² s⁻¹]"), ("T^-20", "a [s⁻²⁰]")],
)
def test_labels_of_axes_have_units(dimension, label):
    assert panels.format_axis_label("a", dimension, "s") == label


# Charts of fits


def make_series(columns, residual_columns=None):
    t = np.arange(4.0)
    values = 10.0 * np.arange(columns) + t[:, None]
    residuals = 0.5 + np.arange(residual_columns or columns) + np.zeros((4, 1))
    values[1, 0] = residuals[1, 0] = np.nan
    return types.SimpleNamespace(
        name=f"series {columns}",
        t=t,
        values=values,
        residuals=residuals,
        sigma=np.array(0.25),
        motion=None,
    )


def test_a_fit_has_a_chart_of_values_above_its_residuals():
    series = [make_series(4), make_series(3, 1)]
    picture = fit_charts.plot_fit_panels(series)
    assert tuple(picture.figure.get_size_inches()) == (9.0, 4.5) and len(picture) == 4
    grid = picture[0].get_subplotspec().get_gridspec()
    assert grid.get_geometry() == (2, 2) and list(grid.get_height_ratios()) == [2.0, 1.0]
    for i, one in enumerate(series):
        upper, lower = picture[2 * i : 2 * i + 2]
        assert upper.get_subplotspec().colspan.start == lower.get_subplotspec().colspan.start == i
        assert upper.get_shared_x_axes().joined(upper, lower)
        assert upper.get_title() == one.name and upper.get_subplotspec().rowspan.start == 0
        assert (lower.get_xlabel(), lower.get_ylabel()) == ("time [T]", "residual [sigma]")
        *dots, zero = lower.lines
        assert np.array_equal(zero.get_ydata(), [0.0, 0.0]) and style_of(zero)[:2] == ("black", 0.8)
        assert len(dots) == one.residuals.shape[1]
        for chart, values in (upper, one.values), (lower, one.residuals):
            for k in range(values.shape[1]):
                line, colour = chart.lines[k], (BLUE, ORANGE, "#5a9e6f", BLUE)[k]
                assert marker_style_of(line) == (colour, ".", 3, "None")
                assert np.array_equal(line.get_ydata(), values[:, k], equal_nan=True)
                assert np.array_equal(line.get_xdata(), one.t)
    curves = picture[0].lines[4:]
    assert len(curves) == 4 and len(picture[2].lines) == 3, "values of other shapes have no model"
    for k, curve in enumerate(curves):
        fitted = 10.0 * k + series[0].t + 0.125 + 0.25 * k
        assert curve.get_linestyle() == "None", "the motion between the measurements is unknown"
        is_measured = np.isfinite(curve.get_ydata())
        assert curve.get_ydata()[is_measured] == pytest.approx(fitted[is_measured])
