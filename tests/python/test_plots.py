"""Tests of plots: the data, labels and units of what is drawn, and the refusals."""

import subprocess
import sys
from typing import NamedTuple

import kreisel as kr
import numpy as np
import pytest
from tops import FREE, GENERAL

pytest.importorskip("matplotlib")
from matplotlib.collections import PathCollection
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure

E20 = np.radians(20.0)
GRID = np.linspace(0.0, 6.0, 301)
CUSPS, BACK, OTHER = (
    kr.solve(kr.scenes.cusps, GRID),
    kr.solve(kr.scenes.cusps, -GRID),
    kr.solve(GENERAL, GRID),
)
EVENTS = kr.solve(GENERAL, np.linspace(0.0, 20.0, 2001), events=[kr.events.nutation()])
ONE = kr.solve(GENERAL, [1.0])
TOP = kr.scenes.asymmetric
TOPS = kr.starts(TOP.body, energy=2, vertical=1, n=5, seed=2, gravity=1)
SECTION = kr.section(TOPS, n=20)
CHAOS = kr.chaos(TOPS, 1000.0)
BACKWARD = kr.chaos(TOPS, -200.0)
GROWTH = kr.chaos(TOP, 800.0)
LINES = kr.frequencies(kr.solve(kr.scenes.cusps, np.linspace(0.0, 200.0, 4001)))
ROUGH = kr.solve(GENERAL, GRID, "rk4", step=0.02)
RECORD = kr.Record(
    GRID[::5], {"apex": CUSPS.apex[::5] + 1e-3 * np.cos(37.0 * GRID[::5, None])}, 1e-3
)
FIT = kr.fit(kr.scenes.cusps, RECORD, free="start")
ROD = kr.rod(kr.solve(kr.scenes.cusps, np.linspace(0.0, 20.0, 401)))
SOLVED = kr.exact(kr.scenes.cusps)
LIMITS = np.array([SOLVED.least_nutation, SOLVED.greatest_nutation])


def project(points):
    """Return points of space as seen from 20 degrees above the horizon, along the y axis."""
    x, y, z = np.asarray(points).T
    return x, z * np.cos(E20) + y * np.sin(E20)


WANT, WAYS = ("apex", "nutation", "precession_angle"), (("taylor", None), ("rk4", 0.02))


def measure_angles(a, b):
    return np.arctan2(np.linalg.norm(np.cross(a, b), axis=1), (a * b).sum(axis=1))


def level(y):
    """Return a dashed line across a chart."""
    return "dashed", [0.0, 1.0], [y, y]


def upright(x):
    return "dashed", [x, x], [0.0, 1.0]


def unwrap_angle(path):
    return np.unwrap(path.precession_angle)


def select(chaos, name, lowest):
    """Return the curves of an indicator that a logarithmic scale can show."""
    return [
        ("line", np.abs(chaos.t), np.where(row > lowest, row, np.nan))
        for row in getattr(chaos, f"{name}_curve").reshape(-1, chaos.t.size)
    ]


def artists_of(axes):
    """Return the kind and the coordinates of each line and group of dots, as triples."""
    kinds = {"-": "line", "--": "dashed", "None": "dots"}
    lines = [(kinds[line.get_linestyle()], *line.get_data()) for line in axes.lines]
    groups = [part for part in axes.collections if isinstance(part, PathCollection)]
    return lines + [("dots", *np.asarray(group.get_offsets()).T) for group in groups]


def is_drawn(expected, artists):
    kind, *points = expected
    return any(
        kind == other[0]
        and all(
            len(a) == len(b) and np.allclose(a, b, rtol=1e-12, atol=1e-12, equal_nan=True)
            for a, b in zip(points, other[1:], strict=True)
        )
        for other in artists
    )


class Chart(NamedTuple):
    """The labels, lines and dots of a chart."""

    axes: object
    x_label: str
    y_label: str
    artists: list


CHARTS = {
    "nutation": lambda: Chart(
        kr.plot(CUSPS)[1], "", "nutation [°]",
        [("line", CUSPS.t, np.degrees(CUSPS.nutation)), *map(level, np.degrees(LIMITS))],
    ),
    "nutation in radians": lambda: Chart(
        kr.plot(BACK, degrees=False)[1], "", "nutation [rad]",
        [("line", BACK.t, BACK.nutation), *map(level, LIMITS)],
    ),
    "precession": lambda: Chart(
        kr.plot(CUSPS)[2], "time [T]", "precession [°]",
        [("line", CUSPS.t, np.degrees(unwrap_angle(CUSPS)))],
    ),
    "precession in radians": lambda: Chart(
        BACK.plot(degrees=False, time_unit="s")[2], "time [s]", "precession [rad]",
        [("line", BACK.t, unwrap_angle(BACK))],
    ),
    "axes of the caller": lambda: Chart(
        kr.plot([CUSPS, OTHER], axes=Figure().subplots(6), time_unit="ms")[5],
        "time [ms]", "precession [°]", [("line", OTHER.t, np.degrees(unwrap_angle(OTHER)))],
    ),
    "second of two paths": lambda: Chart(
        kr.plot([CUSPS, OTHER])[4], "", "", [("line", OTHER.t, np.degrees(OTHER.nutation))],
    ),
    "nutation at events": lambda: Chart(
        kr.plot(EVENTS)[1], "", "nutation [°]",
        [
            ("line", EVENTS.t, np.degrees(EVENTS.nutation)),
            ("dots", EVENTS.events.t, np.degrees(EVENTS.events.path.nutation)),
        ],
    ),
    "precession at events": lambda: Chart(
        kr.plot(EVENTS, degrees=False)[2], "time [T]", "precession [rad]",
        [
            ("line", EVENTS.t, unwrap_angle(EVENTS)),
            ("dots", EVENTS.events.t, np.interp(EVENTS.events.t, EVENTS.t, unwrap_angle(EVENTS))),
        ],
    ),
    "path of one state": lambda: Chart(
        kr.plot(ONE, degrees=False)[1], "", "nutation [rad]",
        [("line", [1.0], ONE.nutation), ("dots", [1.0], ONE.nutation)],
    ),
    "no event": lambda: Chart(
        kr.plot(kr.solve(GENERAL, GRID[:9], events=[kr.events.nutation()]))[1],
        "", "nutation [°]", [("line", GRID[:9], np.degrees(OTHER.nutation[:9]))],
    ),
    "difference of two paths": lambda: Chart(
        kr.plot(OTHER, ROUGH, time_unit="s")[6], "time [s]", "difference [°]",
        [("line", GRID, np.degrees([np.nan, *kr.attitude_error(OTHER.q, ROUGH.q)[1:]]))],
    ),
    "difference in radians": lambda: Chart(
        kr.plot(OTHER, ROUGH, degrees=False)[6], "time [T]", "difference [rad]",
        [("line", GRID, [np.nan, *kr.attitude_error(OTHER.q, ROUGH.q)[1:]])],
    ),
    "difference of apexes": lambda: Chart(
        kr.plot(*(kr.solve(GENERAL, GRID, way, step=step, want=WANT) for way, step in WAYS))[6],
        "time [T]", "difference [°]",
        [("line", GRID, np.degrees([np.nan, *measure_angles(OTHER.apex, ROUGH.apex)[1:]]))],
    ),
    "equal paths": lambda: Chart(
        kr.plot(CUSPS, CUSPS)[6], "time [T]", "difference [°]", [("line", GRID, 0.0 * GRID)],
    ),
    "section": lambda: Chart(
        SECTION.plot(), "spin angle [°]", "apex z",
        [("dots", np.degrees(SECTION.spin_angle), SECTION.apex[:, 2])],
    ),
    "section in radians": lambda: Chart(
        SECTION.plot(Figure().add_subplot(), x="nutation", y="q_w", degrees=False),
        "nutation [rad]", "q w", [("dots", SECTION.nutation, SECTION.q[:, 0])],
    ),
    "section with units": lambda: Chart(
        SECTION.plot(x="t", y="axial_momentum", time_unit="s"),
        "t [s]", "axial momentum [M L² s⁻¹]", [("dots", SECTION.t, SECTION.axial_momentum)],
    ),
    "spectrum": lambda: Chart(
        LINES.plot(time_unit="s"), "angular frequency [s⁻¹]", "amplitude of the apex",
        [("dots", LINES.lines, np.abs(LINES.amplitudes)), upright(LINES.precession_rate)],
    ),
    "exponents back in time": lambda: Chart(
        BACKWARD.plot(indicator="lyapunov", time_unit="s"), "time [s], back from the start",
        "largest exponent [s⁻¹]", select(BACKWARD, "lyapunov", 0.0),
    ),
    "megno": lambda: Chart(
        CHAOS.plot(), "time [T]", "MEGNO",
        [*select(CHAOS, "megno", 0.1), level(CHAOS.threshold)],
    ),
    "oli": lambda: Chart(
        GROWTH.plot(indicator="oli"), "time [T]", "OLI", select(GROWTH, "oli", 0.1)
    ),
    "residuals of a fit": lambda: Chart(
        FIT.plot()[1], "time [T]", "residual [sigma]",
        [("dots", RECORD.t, r) for r in FIT.residuals[0]["apex"].T]
        + [("line", [0.0, 1.0], [0.0, 0.0])],
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", CHARTS)
def test_charts_show_their_data_with_units(name):
    chart = CHARTS[name]()
    assert (chart.axes.get_xlabel(), chart.axes.get_ylabel()) == (chart.x_label, chart.y_label)
    artists = artists_of(chart.axes)
    assert len(artists) == len(chart.artists)
    for expected in chart.artists:
        assert is_drawn(expected, artists), f"{expected[0]} missing"


# Paths


def test_the_trace_is_the_projection_of_the_apex():
    for path in CUSPS, OTHER:
        sphere = kr.plot(path)[0]
        x, up = project(path.apex)
        artists = artists_of(sphere)
        assert is_drawn(("line", x, up), artists) and is_drawn(("dots", x[:1], up[:1]), artists)
        depth = path.apex[:, 2] * np.sin(E20) - path.apex[:, 1] * np.cos(E20)
        assert is_drawn(("line", x, np.where(depth > 0.0, up, np.nan)), artists)


def test_events_on_the_visible_side_are_marked_on_the_sphere():
    apex = EVENTS.events.path.apex
    is_visible = apex[:, 2] * np.sin(E20) - apex[:, 1] * np.cos(E20) > 0.0
    assert 0 < is_visible.sum() < len(apex)
    sphere = kr.plot(EVENTS)[0]
    assert is_drawn(("dots", *project(apex[is_visible])), artists_of(sphere))
    assert [text.get_text() for text in sphere.get_legend().get_texts()] == ["start", "events"]


def test_circles_on_the_globe_are_the_turning_points():
    circles = [line for line in kr.plot(CUSPS)[0].lines if line.get_linestyle() == "--"]
    for circle, angle in zip(circles, LIMITS, strict=True):
        x, y = (np.array(part) for part in circle.get_data())
        is_visible = np.isfinite(y)
        depth = (y[is_visible] - np.cos(angle) * np.cos(E20)) / np.sin(E20)
        assert is_visible.sum() > 50
        assert np.hypot(x[is_visible], depth) == pytest.approx(np.sin(angle), abs=1e-12)


@pytest.mark.parametrize("back", [False, True])
def test_the_precession_is_interrupted_where_it_jumps(back):
    """Check that the precession curve is interrupted each time the apex passes the vertical."""
    path = kr.solve(kr.scenes.thesis, np.linspace(0, -60 if back else 60, 3001))
    line = kr.plot(path, degrees=False)[2].lines[0]
    t, angles = line.get_xdata(), line.get_ydata()
    gaps = np.flatnonzero(np.isnan(t))
    assert np.isnan(angles[gaps]).all() and len(gaps) == 8
    passes = np.abs(t[gaps - 1] + t[gaps + 1]) / 2
    assert passes == pytest.approx(kr.exact(path.scene).period * np.arange(8), abs=0.03)
    assert np.nanmax(np.abs(np.diff(angles))) < 0.5
    is_finite = np.isfinite(t)
    assert np.array_equal(t[is_finite], path.t)
    turns = (angles[is_finite] - path.precession_angle) / (2 * np.pi)
    assert turns == pytest.approx(np.rint(turns), abs=1e-12)


def test_an_upright_start_draws_no_precession_jump():
    path = kr.solve(kr.scenes.kowalewski, np.linspace(0, 20, 2001))
    line = kr.plot(path, degrees=False)[2].lines[0]
    assert np.nanmax(np.abs(np.diff(line.get_ydata()))) < 0.5


def change_run(_):
    run = kr.start(GENERAL, events=[kr.events.nutation()])
    run.to(20.0)
    run.change(gravity=3.0)
    return run.to([25.0, 40.0, 52.0])


def load_path(folder):
    kr.solve(kr.scenes.cusps, [0.0, 20.0, 47.0]).save(folder / "top.npz")
    return kr.load(folder / "top.npz")


SPARSE = {
    "closed form": lambda _: kr.solve(kr.scenes.cusps, [0.0, 20.0, 47.0]),
    "back in time": lambda _: kr.solve(GENERAL, [0.0, -20.0]),
    "unordered": lambda _: kr.solve(GENERAL, 20.0)([20.0, 3.0, 9.0]),
    "damped": lambda _: kr.solve(kr.scenes.fast.replace(damping=0.5), 10.0, tol=1e-6),
    "fixed step": lambda _: kr.solve(GENERAL, 30.0, "strang", step=0.01, every=1000),
    "wanted": lambda _: kr.solve(
        GENERAL, [0.0, 30.0], want=("apex", "nutation", "precession_angle")
    ),
    "spherical": lambda _: kr.solve(
        kr.Scene(kr.Body(1, (2, 2, 2), (1, 0, 0)), (3, 2, 9), gravity=1), 20
    ),
    "pendulum": lambda _: kr.solve(kr.scenes.cusps.replace(momentum=(0, 0, 0)), 30),
    "changed run": change_run,
    "loaded": load_path,
}


@pytest.mark.parametrize("kind", SPARSE)
def test_sparse_states_are_marked_on_the_motion_between_them(kind, tmp_path):
    """Compare the drawn lines with the motion at their times, of which no turn is left out."""
    path = SPARSE[kind](tmp_path)
    sphere, nutation, precession = kr.plot(path, degrees=False)
    t, y = nutation.lines[0].get_data()
    assert np.isin(path.t, t).all() and np.array_equal(y, path(t).nutation)
    trace = next(line for line in sphere.lines if len(line.get_xdata()) == len(t))
    step = np.linalg.norm(np.diff(trace.get_xydata(), axis=0), axis=1)
    assert step.max() < 0.3 and {t[0], t[-1]} == {path.t.min(), path.t.max()}
    assert np.stack(trace.get_data()) == pytest.approx(np.stack(project(path(t).apex)))
    angles = precession.lines[0].get_ydata()
    for chart, values in (nutation, path.nutation), (precession, path.precession_angle):
        marks = next(line for line in chart.lines if np.array_equal(line.get_xdata(), path.t))
        turns = (marks.get_ydata() - values) / (2 * np.pi)
        assert marks.get_linestyle() == "None" and turns == pytest.approx(np.rint(turns), abs=1e-9)
    assert np.isin(marks.get_ydata(), angles).all()
    assert "states" in [text.get_text() for text in sphere.get_legend().get_texts()]


def test_a_plot_of_two_states_shows_the_sense_and_the_size_of_the_motion():
    _, nutation, precession = kr.plot(kr.solve(kr.scenes.cusps, 10))
    assert precession.lines[0].get_ydata()[-1] == pytest.approx(193.74, abs=0.01)
    angles = nutation.lines[0].get_ydata()
    assert [angles.min(), angles.max()] == pytest.approx(np.degrees(LIMITS), abs=0.05)
    assert (np.diff(np.sign(np.diff(angles))) < 0).sum() == round(10 / SOLVED.period)


def test_states_are_not_joined_where_the_motion_cannot_be_drawn():
    path = kr.solve(kr.scenes.cusps, [0.0, 1e6])
    for chart, y in zip(kr.plot(path)[1:], (path.nutation, path.precession_angle), strict=True):
        artists = artists_of(chart)
        assert "line" not in {kind for kind, _, _ in artists}
        assert is_drawn(("dots", path.t, np.degrees(y)), artists)


@pytest.mark.parametrize(
    ("scene", "title", "lines"),
    [
        (kr.scenes.steady_precession, "steady (taylor)", 3),
        (kr.scenes.sleeping, "rosette (taylor)", 3),
        (GENERAL, "general (taylor)", 1),
        (kr.scenes.cusps.replace(damping=(0.1, 0.1, 0.1)), "lagrange (taylor)", 1),
        (FREE, "euler (taylor)", 1),
    ],
)
def test_limits_of_nutation_are_drawn_if_they_exist(scene, title, lines):
    sphere, nutation, _ = kr.solve(scene, np.linspace(0, 3, 301), method="taylor").plot()
    assert sphere.get_title() == title and len(nutation.lines) == lines
    low, high = nutation.get_ylim()
    assert high - low > 1e-3, "the axis of a steady motion must not magnify rounding errors"


def test_several_paths_are_drawn_side_by_side():
    picture = kr.plot([CUSPS, kr.solve(GENERAL, np.linspace(0, 3, 50)), kr.solve(FREE, [1.0])])
    assert set(picture) == set(picture.figure.axes) and len(picture) == 9
    assert picture[1].get_shared_y_axes().joined(picture[1], picture[7])
    assert picture[4].get_shared_x_axes().joined(picture[4], picture[5])
    for charts in picture[1::3], picture[2::3]:
        assert [bool(one.get_ylabel()) for one in charts] == [True, False, False]


def test_existing_axes_are_reused_and_paths_may_be_separate_arguments():
    axes = Figure().subplots(7)
    assert list(kr.plot(CUSPS, axes[:3])) == list(kr.plot(CUSPS, axes=axes[:3])) == list(axes[:3])
    assert list(kr.plot(CUSPS, CUSPS, axes=axes)) == list(axes)
    assert kr.plot(CUSPS, axes[:3]).figure is axes[0].figure
    assert len(kr.plot(CUSPS, CUSPS, CUSPS)) == 9


def test_the_wanted_quantities_suffice_for_a_plot():
    path = kr.solve(GENERAL, GRID, want=("apex", "nutation", "precession_angle"))
    assert np.array_equal(kr.plot(path, degrees=False)[1].lines[0].get_ydata(), path.nutation)


# Sections, spectra, indicators and fits


@pytest.mark.parametrize(
    "tops", [TOPS, TOP, TOP.vary(gravity=[[0.5], [1.0]], spin=[0.0, 1.0, 2.0])]
)
def test_a_section_shows_the_class_of_each_top(tops):
    section, indicator = kr.section(tops, n=3), kr.chaos(tops, 800.0)
    axes = section.plot(chaos=indicator)
    legend = axes.get_legend()
    colour_of = {
        text.get_text(): to_rgb(mark.get_color())
        for text, mark in zip(legend.get_texts(), legend.get_lines(), strict=True)
    }
    doubtful, chaotic = np.ravel(indicator.is_doubtful), np.ravel(indicator.is_chaotic)
    names = np.where(doubtful, "in doubt", np.where(chaotic, "chaotic", "regular"))
    assert set(colour_of) == set(names)
    top = section.top
    if top.ndim == 2:  # of a grid, or of a single scene
        top = top @ [tops.shape[1], 1] if top.shape[1] else np.zeros(len(top), dtype=int)
    expected = np.array([colour_of[name] for name in names[top]])
    assert axes.collections[0].get_facecolors()[:, :3] == pytest.approx(expected)


def test_maps_show_the_value_of_each_top():
    tops = TOP.vary(gravity=np.array([[0.5], [1.0], [1.5]]), spin=[0.0, 1.0])
    indicator = kr.chaos(tops, 100.0)
    axes = indicator.plot(Figure().add_subplot(), indicator="lyapunov", time_unit="s")
    mesh = axes.collections[0]
    assert np.array_equal(mesh.get_array().reshape(3, 2), indicator.lyapunov)
    corners = mesh.get_coordinates()
    centres = np.asarray(0.5 * (corners[1:, 1:] + corners[:-1, :-1]))
    expected = np.stack(np.meshgrid([0.0, 1.0], [0.5, 1.0, 1.5]), axis=-1)
    assert centres == pytest.approx(expected)
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("spin [rad/s]", "gravity [L s⁻²]")
    assert axes.figure.axes[1].get_ylabel() == "largest exponent [s⁻¹], t = 100"
    doubtful = expected[indicator.is_doubtful]
    assert sorted(axes.lines[0].get_xydata().tolist()) == sorted(doubtful.tolist())
    assert "in doubt" in axes.get_title()


def test_spectral_lines_have_the_numbers_of_nutations():
    numbers = {text.get_text(): text.xy[0] for text in LINES.plot().texts}
    assert len(numbers) == 12
    for number, place in numbers.items():
        assert place == pytest.approx(LINES.precession_rate + int(number) * LINES.nutation)
    chaotic = kr.frequencies(kr.solve(TOP, np.linspace(0, 200, 2001)), 5)
    axes = chaotic.plot(Figure().add_subplot())
    assert len(axes.lines[0].get_xdata()) == 5 and len(axes.texts) < 3


def test_a_fit_shows_measurements_on_the_fitted_motion():
    upper, _ = FIT.plot()
    artists = artists_of(upper)
    assert upper.get_title() == "apex"
    for k in range(3):
        assert is_drawn(("dots", RECORD.t, RECORD.series[0].values[:, k]), artists)
    curves = [artist for artist in artists if artist[0] == "line"]
    assert len(curves) == 3
    for k, (_, t, y) in enumerate(curves):
        t, y = t[np.isfinite(t)], y[np.isfinite(t)]
        assert len(t) >= len(RECORD.t) and y == pytest.approx(FIT.path(t).apex[:, k], abs=1e-9)


def test_axes_of_fits_have_the_units_of_the_record():
    values = {"apex": CUSPS.apex[::9], "nutation": np.degrees(CUSPS.nutation[::9])}
    values |= {"body_velocity_x": np.degrees(CUSPS.body_velocity[::9, 0])}
    fit = kr.fit(kr.scenes.cusps, kr.Record(GRID[::9], values, 0.01, degrees=True), free="start")
    upper, lower = fit.plot(time_unit="s")[::2], fit.plot(time_unit="s")[1::2]
    labels = ["apex", "nutation [°]", "body velocity x [°/s]"]
    assert [chart.get_ylabel() for chart in upper] == labels
    assert {chart.get_xlabel() for chart in lower} == {"time [s]"}


# Rods


def test_rods_show_the_start_and_a_scale():
    axes = ROD.plot(length_unit="m", elevation=0.0)
    assert [text.get_text() for text in axes.texts] == ["start", "2 m"]
    dot, bar = axes.lines
    assert dot.get_xydata() == pytest.approx(ROD.centre[:1, [0, 2]], abs=1e-12)
    assert np.ptp(bar.get_xdata()) == pytest.approx(2.0) and np.ptp(bar.get_ydata()) == 0.0
    assert bar.get_ydata()[0] < ROD.centre[:, 2].min()


@pytest.mark.parametrize("elevation, azimuth", [(35.0, 50.0), (-40.0, 170.0)])
def test_the_tube_of_a_rod_follows_its_centre_line(elevation, azimuth):
    """Check that a tube without thickness is the centre line, as seen by the eye."""
    axes = ROD.plot(thickness=1e-9, elevation=elevation, azimuth=azimuth)
    e, a = np.radians((elevation, azimuth))
    right = np.array([np.cos(a), np.sin(a), 0.0])
    towards = np.array([np.sin(a) * np.cos(e), -np.cos(a) * np.cos(e), np.sin(e)])
    expected = ROD.centre @ np.stack([right, np.cross(towards, right)], axis=1)
    points = np.concatenate([path.vertices[:4] for path in axes.collections[0].get_paths()])
    gaps = np.linalg.norm(points[:, None] - expected[None], axis=-1)
    assert gaps.min(axis=1).max() < 1e-8
    assert (gaps.min(axis=0) < 1e-8).mean() > 0.99, "of 401 points of the centre line"


# Refusals

REFUSED = [
    (lambda: kr.plot(kr.solve(GENERAL, [])), ValueError, "without states"),
    (lambda: kr.plot([CUSPS, kr.solve(GENERAL, [])]), ValueError, "without states"),
    (lambda: kr.plot([]), ValueError, "up to 8 paths"),
    (lambda: kr.plot([CUSPS] * 9), ValueError, "up to 8 paths"),
    (lambda: kr.plot("top"), TypeError, "path must be"),
    (lambda: kr.plot([CUSPS, GENERAL]), TypeError, r"path\[1\]"),
    (lambda: kr.plot(kr.solve(GENERAL, [1.0], want=("energy",))), AttributeError, "want"),
    (lambda: kr.plot(CUSPS, CUSPS, Figure().subplots(6)), TypeError, "axes"),
    (lambda: kr.plot(CUSPS, [1], axes=[1]), TypeError, "axes"),
    (lambda: kr.plot(CUSPS, Figure().subplots(2)), ValueError, "axes must be 3"),
    (lambda: kr.plot(CUSPS, Figure().subplots(7)), ValueError, "axes must be 3"),
    (lambda: kr.plot([CUSPS] * 2, Figure().subplots(5)), ValueError, "axes must be 6.* or 7"),
    (lambda: kr.plot([CUSPS] * 3, Figure().subplots(7)), ValueError, "axes must be 9"),
    (lambda: CUSPS.plot(Figure().add_subplot()), TypeError, "axes must be a list of 3"),
    (lambda: SECTION.plot(x="spin_angel"), ValueError, "did you mean 'spin_angle'"),
    (lambda: SECTION.plot(y="apex"), ValueError, "unknown component 'apex'"),
    (lambda: SECTION.plot(y=3), TypeError, "y must be"),
    (lambda: SECTION.plot(chaos=CHAOS.megno), TypeError, "chaos must be"),
    (lambda: SECTION.plot(chaos=GROWTH), ValueError, "the same tops"),
    (lambda: SECTION.plot(degrees=1), TypeError, "degrees must be"),
    (lambda: SECTION.plot(time_unit=" "), ValueError, "time_unit must be"),
    (lambda: SECTION.plot(time_unit=1.0), TypeError, "time_unit must be"),
    (lambda: SECTION.plot(axes=1), TypeError, "axes must be"),
    (lambda: kr.rod(kr.solve(kr.scenes.cusps, [1.0])).plot(), ValueError, "1 state cannot"),
    (
        lambda: kr.chaos(kr.Scene(TOP.body, momentum=np.ones((2, 1, 2, 3)), gravity=1), 1.0).plot(),
        ValueError,
        "3 dimensions",
    ),
    (lambda: kr.plot(CUSPS).savefig, AttributeError, r"figure\.savefig"),
    (lambda: kr.plot(CUSPS).title, AttributeError, "title"),
]


@pytest.mark.parametrize(("draw", "error", "word"), REFUSED)
def test_invalid_drawings_are_refused(draw, error, word):
    with pytest.raises(error, match=word):
        draw()


def test_pyplot_is_not_imported():
    program = (
        "import sys, kreisel as kr; path = kr.solve(kr.scenes.cusps, 1); kr.plot(path);"
        "kr.rod(path).plot(); path.animate(fps=1, size=50)._repr_html_();"
        "assert 'matplotlib.pyplot' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", program], check=True)


T = np.linspace(0.0, 5.0, 101)
FINE = kr.solve(GENERAL, T)
COARSE = {"method": "rk4", "step": 0.05}


def draw_difference(one, other):
    """Return the times and angles [rad] of the last chart, where angles of 0 are NaN."""
    return kr.plot(one, other, degrees=False)[6].lines[0].get_data()


def test_paths_are_compared_at_common_times():
    t, angle = draw_difference(FINE, kr.solve(GENERAL, 5.0, **COARSE))
    expected = kr.attitude_error(kr.solve(GENERAL, t).q, kr.solve(GENERAL, t, **COARSE).q)
    assert (t[0], t[-1]) == (0.0, 5.0) and np.isnan(angle[0]) and expected[0] == 0.0
    assert angle[1:] == pytest.approx(expected[1:], rel=1e-6)
    t, angle = draw_difference(FINE, kr.solve(GENERAL, [4.0, 6.0]))
    assert t.min() >= 4.0 and t.max() <= 5.0 and len(t) > 10 and np.nanmax(angle) < 1e-12
    _, angle = draw_difference(*(kr.solve(GENERAL, T, digits=digits) for digits in (20, 30)))
    assert 1e-22 < np.nanmax(angle) < 1e-17
    for other in (FINE, kr.solve(GENERAL, [-1.0, -2.0])):
        assert kr.plot(FINE, other)[6].get_title()
