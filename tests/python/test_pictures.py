"""Tests that plots and animations show the data of a path."""

import doctest
import itertools
import subprocess
import sys
import tempfile

import kreisel as kr
import numpy as np
import pytest
from internals import solid_of
from tops import CORNER, FREE, GENERAL

pytest.importorskip("matplotlib")
from kreisel._plot import solids
from kreisel._plot.solids import build_faces_of_revolution, draw_tube
from kreisel._plot.stage import STEEL
from matplotlib.animation import FFMpegWriter
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from PIL import Image

THESIS = kr.scenes.thesis

CUSPS = kr.solve(kr.scenes.cusps, np.linspace(0, 6, 301))
PNG, GIF = b"\x89PNG\r\n", b"GIF89a"


@pytest.mark.parametrize("degrees", [False, True])
@pytest.mark.parametrize("back", [False, True])
def test_lines_show_the_data_of_the_path(degrees, back):
    path = kr.solve(kr.scenes.cusps, np.linspace(0, -6 if back else 6, 301))
    unit = np.degrees(1) if degrees else 1
    sphere, nutation, precession = kr.plot(path, **({} if degrees else {"degrees": False}))
    line, upper, lower = nutation.lines
    assert np.array_equal(line.get_xdata(), path.t)
    assert line.get_ydata() == pytest.approx(unit * path.nutation, rel=1e-15)
    top = kr.exact(path.scene)
    assert list(upper.get_ydata()) == [unit * top.least_nutation] * 2
    assert list(lower.get_ydata()) == [unit * top.greatest_nutation] * 2
    angles = precession.lines[0].get_ydata()
    turns = (angles / unit - path.precession_angle) / (2 * np.pi)
    assert turns == pytest.approx(np.rint(turns), abs=1e-12)
    assert np.abs(np.diff(angles)).max() < unit * 0.1
    assert nutation.get_ylabel() == ("nutation [°]" if degrees else "nutation [rad]")
    assert precession.get_xlabel() == "time [T]"
    assert path.method == "exact" and sphere.get_title() == "cusps (closed form)"


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


def changed_run(_):
    run = kr.start(GENERAL, events=[kr.events.nutation()])
    run.to(20.0)
    run.change(gravity=3.0)
    return run.to([25.0, 40.0, 52.0])


def loaded(file):
    kr.solve(kr.scenes.cusps, [0.0, 20.0, 47.0]).save(file / "top.npz")
    return kr.load(file / "top.npz")


WANTED = ("apex", "nutation", "precession_angle")
SPHERE = kr.Scene(kr.Body(1, (2, 2, 2), (1, 0, 0)), (3, 2, 9), gravity=1.0)
SPARSE = {
    "closed form": lambda _: kr.solve(kr.scenes.cusps, [0.0, 20.0, 47.0]),
    "back in time": lambda _: kr.solve(GENERAL, [0.0, -20.0]),
    "unordered": lambda _: kr.solve(GENERAL, 20.0)([20.0, 3.0, 9.0]),
    "damped": lambda _: kr.solve(kr.scenes.fast.replace(damping=0.5), 10.0, tol=1e-6),
    "fixed step": lambda _: kr.solve(GENERAL, 30.0, "strang", step=0.01, every=1000),
    "wanted": lambda _: kr.solve(GENERAL, [0.0, 30.0], want=WANTED),
    "spherical": lambda _: kr.solve(
        kr.Scene(kr.Body(1, (2, 2, 2), (1, 0, 0)), (3, 2, 9), gravity=1), 20
    ),
    "pendulum": lambda _: kr.solve(kr.scenes.cusps.replace(momentum=(0, 0, 0)), 30),
    "changed run": changed_run,
    "loaded": loaded,
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
    angles = precession.lines[0].get_ydata()
    for chart, values in (nutation, path.nutation), (precession, path.precession_angle):
        marks = next(line for line in chart.lines if np.array_equal(line.get_xdata(), path.t))
        turns = (marks.get_ydata() - values) / (2 * np.pi)
        assert marks.get_linestyle() == "None" and turns == pytest.approx(np.rint(turns), abs=1e-9)
    assert np.isin(marks.get_ydata(), angles).all()


def test_a_plot_of_two_states_shows_the_sense_and_the_size_of_the_motion():
    _, nutation, precession = kr.plot(kr.solve(kr.scenes.cusps, 10))
    assert precession.lines[0].get_ydata()[-1] == pytest.approx(193.74, abs=0.01)
    top = kr.exact(kr.scenes.cusps)
    limits = np.degrees([top.least_nutation, top.greatest_nutation])
    angles = nutation.lines[0].get_ydata()
    assert [angles.min(), angles.max()] == pytest.approx(limits, abs=0.05)
    assert (np.diff(np.sign(np.diff(angles))) < 0).sum() == round(10 / top.period)


@pytest.mark.parametrize(
    "path",
    [
        kr.exact(kr.scenes.thesis, map="bobenko_suris", step=0.01)([0, 1000, 2500]),
        kr.solve(kr.scenes.cusps, [0.0, 1e6]),
    ],
)
def test_states_are_not_joined_where_the_motion_cannot_be_drawn(path):
    for chart in kr.plot(path)[1:]:
        lines = [line for line in chart.lines if len(line.get_xdata()) == len(path)]
        assert {line.get_linestyle() for line in lines} <= {"None", "--"}
        assert any(np.array_equal(line.get_xdata(), path.t) for line in lines)


def test_the_trace_is_the_projection_of_the_apex():
    sphere, _, _ = kr.plot(CUSPS)
    trace = next(line for line in sphere.lines if len(line.get_xdata()) == len(CUSPS))
    x, y, z = CUSPS.apex.T
    e = np.radians(20)
    assert trace.get_xdata() == pytest.approx(x, abs=1e-15)
    assert trace.get_ydata() == pytest.approx(z * np.cos(e) + y * np.sin(e), abs=1e-15)


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


def test_circles_on_the_globe_are_the_turning_points():
    sphere, _, _ = kr.plot(CUSPS)
    circles = [line for line in sphere.lines if line.get_linestyle() == "--"]
    top, e = kr.exact(CUSPS.scene), np.radians(20)
    for circle, angle in zip(circles, [top.least_nutation, top.greatest_nutation], strict=True):
        x, y = (np.array(part) for part in circle.get_data())
        is_visible = np.isfinite(y)
        depth = (y[is_visible] - np.cos(angle) * np.cos(e)) / np.sin(e)
        assert is_visible.sum() > 50
        assert np.hypot(x[is_visible], depth) == pytest.approx(np.sin(angle), abs=1e-12)


def test_a_picture_leaves_no_empty_space():
    """Check that the three plots together fill the figure."""
    picture = kr.plot(CUSPS)
    picture.figure.draw_without_rendering()
    globe, above, below = (axes.get_tightbbox() for axes in picture)
    whole = picture.figure.bbox
    assert globe.x1 < above.x0 and below.y1 < above.y0
    assert picture[1].get_position().intervalx == pytest.approx(picture[2].get_position().intervalx)
    assert globe.x0 < 0.1 * whole.x1 and min(above.x1, below.x1) > 0.9 * whole.x1
    assert below.y0 < 0.1 * whole.y1 and above.y1 > 0.9 * whole.y1
    assert globe.width > 0.3 * whole.x1 and above.width > 0.4 * whole.x1


def test_events_are_marked():
    path = kr.solve(GENERAL, np.linspace(0, 20, 2001), events=[kr.events.nutation()])
    _, nutation, precession = kr.plot(path, degrees=False)
    _, dots = nutation.lines
    assert len(path.events) > 4 and np.array_equal(dots.get_xdata(), path.events.t)
    assert dots.get_ydata() == pytest.approx(path.events.path.nutation, abs=1e-15)
    on_the_line = np.interp(path.events.t, path.t, precession.lines[0].get_ydata())
    assert precession.lines[1].get_ydata() == pytest.approx(on_the_line, abs=1e-12)
    motion = kr.solve(GENERAL, np.linspace(0, 0.1, 5), events=[kr.events.nutation()])
    assert len(kr.plot(motion)[1].lines) == 1


def test_several_paths_are_drawn_side_by_side():
    paths = [CUSPS, kr.solve(GENERAL, np.linspace(0, 3, 50)), kr.solve(FREE, [1.0])]
    picture = kr.plot(paths)
    assert len(picture) == 9 and len(picture.figure.axes) == 9
    for i, path in enumerate(paths):
        assert np.array_equal(picture[3 * i + 1].lines[0].get_xdata(), path.t)
    assert picture[1].get_shared_y_axes().joined(picture[1], picture[7])
    for charts in picture[1::3], picture[2::3]:
        assert [bool(one.get_ylabel()) for one in charts] == [True, False, False]
    assert picture._repr_png_().startswith(PNG)


def test_existing_axes_are_reused():
    axes = Figure().subplots(3)
    picture = kr.plot(CUSPS, axes)
    assert list(picture) == list(axes) and picture.figure is axes[0].figure
    with pytest.raises(ValueError, match="axes must be 6, for trace, nutation and precession"):
        kr.plot([CUSPS, CUSPS], axes)
    with pytest.raises(TypeError, match="axes must be a list of 3, not <Axes"):
        CUSPS.plot(axes[0])


def test_invalid_drawings_are_refused():
    with pytest.raises(ValueError, match="a path without states cannot be drawn"):
        kr.plot(kr.solve(GENERAL, []))
    for paths in [], [CUSPS] * 9:
        with pytest.raises(ValueError, match="a list of up to 8 paths, not of"):
            kr.plot(paths)
    with pytest.raises(TypeError, match=r"path must be a kreisel\.Path or a list of them"):
        kr.plot("top")
    with pytest.raises(TypeError, match=r"path\[1\] must be a kreisel\.Path"):
        kr.plot([CUSPS, GENERAL])
    with pytest.raises(AttributeError, match=r"only the quantities of want=\('energy',\)"):
        kr.plot(kr.solve(GENERAL, [1.0], want=("energy",)))


def test_the_wanted_quantities_suffice_for_a_plot():
    path = kr.solve(
        GENERAL, np.linspace(0.0, 1.0, 99), want=("apex", "nutation", "precession_angle")
    )
    y = kr.plot(path, degrees=False)[1].lines[0].get_ydata()
    assert np.array_equal(y, path.nutation)


def test_pyplot_is_not_imported():
    program = (
        "import sys, kreisel as kr; path = kr.solve(kr.scenes.cusps, 1); kr.plot(path);"
        "kr.rod(path).plot(); path.animate(fps=1, size=50)._repr_html_();"
        "assert 'matplotlib.pyplot' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", program], check=True)


def steel_lines(figure):
    return [line.get_xydata() for line in figure.axes[0].lines if line.get_color() == STEEL]


def frames_of(file):
    with Image.open(file) as film:
        for i in range(film.n_frames):
            film.seek(i)
            yield film.convert("RGB").copy()


def test_a_gif_contains_every_frame(tmp_path):
    file = tmp_path / "top.gif"
    film = CUSPS.animate(file, speed=2, fps=5, size=100)
    assert file.read_bytes().startswith(GIF)
    assert len(film) == 16 and film.t == pytest.approx(np.linspace(0, 6, 16), abs=1e-14)
    assert film.fps == 5 and repr(film) == "<Film: 16 frames, 5 a second, t = 0 .. 6>"
    frames = list(frames_of(file))
    assert len(frames) == 16 and {frame.size for frame in frames} == {(100, 100)}
    assert all(frame.getpixel((0, 0)) == (255, 255, 255) for frame in frames)
    for one, other in itertools.pairwise(frames):
        assert one.tobytes() != other.tobytes(), "each frame must show a different time"
    with Image.open(file) as image:
        assert image.info["duration"] == 200 and image.info["loop"] == 0
    assert list(tmp_path.iterdir()) == [file]


def test_a_film_may_be_as_small_as_an_icon(tmp_path):
    CUSPS.animate(tmp_path / "icon.gif", fps=1, size=16)
    assert {frame.size for frame in frames_of(tmp_path / "icon.gif")} == {(16, 16)}


def test_the_default_speed_shows_the_path_in_8_seconds():
    film = CUSPS.animate(fps=10)
    assert len(film) == 81 and film.t[-1] == 6


@pytest.mark.parametrize("scene", [GENERAL, kr.scenes.thesis])
def test_uneven_times_are_resampled_evenly(scene, tmp_path):
    uneven = kr.solve(scene, [0.0, 0.01, 0.02, 1.5, 4.0], method="taylor")
    even = kr.solve(scene, np.linspace(0, 4, 41), method="taylor")
    films = []
    for name, path in ("uneven.gif", uneven), ("even.gif", even):
        path.animate(tmp_path / name, fps=1, size=100)
        films.append((tmp_path / name).read_bytes())
    assert films[0] == films[1]


def test_a_film_runs_in_the_direction_of_its_path(tmp_path):
    back = kr.solve(GENERAL, np.linspace(0, -2, 21)).animate(fps=1, size=50)
    assert back.t == pytest.approx(np.linspace(0, -2, 9), abs=1e-15)
    film = kr.exact(kr.scenes.cusps)([1.0, 5.0]).animate(fps=1, size=50)
    assert film.t == pytest.approx(np.linspace(1, 5, 9), abs=1e-15)


def test_the_needle_of_a_film_begins_at_the_surface_of_the_body():
    figure = next(CUSPS.animate(fps=1, size=50)._draw_frames())
    assert figure.axes[0].get_aspect() == kr.plot(CUSPS)[0].get_aspect() == 1.0
    needle, _ = steel_lines(figure)
    quads, _ = solid_of(CUSPS.scene.body)  # its apex is the third axis
    surface = 0.8 * quads[..., 2].max() / np.linalg.norm(quads, axis=-1).max()
    assert needle[0] == pytest.approx(surface * needle[1], abs=1e-12)


@pytest.mark.parametrize("method", ["bobenko_suris", "strang", "rk4", "extrap", "taylor", "exact"])
def test_paths_of_all_kinds_of_methods_become_films(method):
    words = {} if kr.methods[method].adaptive else {"step": 0.05}
    film = kr.solve(kr.scenes.thesis, 2, method=method, **words).animate(fps=1, size=50)
    assert (
        film._repr_html_().lstrip().startswith("<link") and "data:image/png" in film._repr_html_()
    )


def test_html_films_contain_their_frames(tmp_path):
    CUSPS.animate(tmp_path / "top.html", fps=1, size=50)
    text = (tmp_path / "top.html").read_text()
    assert "<html" in text.lower() and text.count("data:image/png") == 9


def test_mp4_films_need_ffmpeg(tmp_path):
    file = tmp_path / "top.mp4"
    if not FFMpegWriter.isAvailable():
        with pytest.raises(OSError, match="needs ffmpeg, which was not found"):
            CUSPS.animate(file)
        return
    CUSPS.animate(file, fps=5, size=101)
    assert b"ftyp" in file.read_bytes()[:16]


@pytest.mark.parametrize("name", ["top.gif", "top.html"])
@pytest.mark.parametrize("old", [None, b"an older film"])
def test_ctrl_c_leaves_the_old_file(name, old, tmp_path, monkeypatch):
    scratch = tmp_path / "scratch"
    scratch.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(scratch))
    file = tmp_path / name
    if old:
        file.write_bytes(old)
    draw, frames = Figure.savefig, []

    def stops(figure, *args, **words):
        frames.append(1)
        if len(frames) == 3:
            raise KeyboardInterrupt
        return draw(figure, *args, **words)

    monkeypatch.setattr(Figure, "savefig", stops)
    with pytest.raises(KeyboardInterrupt):
        CUSPS.animate(file, fps=1, size=50)
    assert len(frames) == 3 and list(scratch.iterdir()) == []
    assert file.read_bytes() == old if old else not file.exists()
    assert len(list(tmp_path.iterdir())) == (2 if old else 1)


@pytest.mark.parametrize(
    ("words", "error", "text"),
    [
        ({"file": "top.avi"}, ValueError, "must end in one of .gif, .mp4, .html, not 'top.avi'"),
        ({"file": "nowhere/top.gif"}, FileNotFoundError, "there is no folder"),
        ({"speed": 0}, ValueError, "speed must be positive, not 0"),
        ({"speed": "fast"}, TypeError, "speed must be a number"),
        ({"speed": 1e-4}, ValueError, "1500001 frames of 480 x 480 pixels are too many: 1165"),
        ({"fps": 0}, ValueError, "fps must be at least 1"),
        ({"fps": 2.5}, TypeError, "fps must be a whole number"),
        ({"size": 15}, ValueError, "size must be at least 16"),
        ({"size": 20000}, ValueError, "are too many"),
    ],
)
def test_invalid_arguments_are_refused_before_anything_is_drawn(words, error, text, monkeypatch):
    monkeypatch.setattr(Figure, "savefig", None)
    with pytest.raises(error, match=text):
        CUSPS.animate(**words)


def test_the_suggested_speed_is_accepted():
    with pytest.raises(ValueError) as error:
        CUSPS.animate(speed=1e-4)
    speed = float(str(error.value).split("speed = ")[1].split(",")[0])
    assert len(CUSPS.animate(speed=1.01 * speed)) <= 1165


@pytest.mark.parametrize("t", [[], [1.0], [2.0, 2.0]])
def test_a_film_needs_a_positive_duration(t):
    with pytest.raises(ValueError, match="a film needs a path of positive duration"):
        kr.solve(GENERAL, t).animate()


def test_a_cuboid_is_drawn_with_its_dimensions():
    faces, colours = solid_of(CORNER)
    corners = np.unique(faces.reshape(-1, 3).round(9), axis=0)
    assert len(corners) == 8 and faces.shape == (6, 4, 3) and colours.shape == (6, 3)
    edges = np.linalg.norm(faces - np.roll(faces, 1, axis=1), axis=-1)
    assert np.sort(edges.ravel())[::8] == pytest.approx([1.2, 1.6, 2.0], rel=1e-9)
    assert corners.mean(axis=0) == pytest.approx(CORNER.principal_com, abs=1e-8)


BODIES = {name: kr.scenes.get_scene(name).body for name in kr.scenes.about}
BODIES["hanging"] = kr.Body.symmetric(1.0, 1.1, 0.5, -0.9)


@pytest.mark.parametrize("name", BODIES)
def test_solids_are_closed_and_seen_from_outside(name):
    """Check that the faces of each solid form a closed surface with outward normals."""
    faces, _ = solid_of(BODIES[name])
    area = 0.5 * np.cross(faces[:, 2] - faces[:, 0], faces[:, 3] - faces[:, 1])
    size = np.abs(faces).max()
    assert area.sum(axis=0) == pytest.approx(0.0, abs=1e-12 * size**2)
    assert np.einsum("ni,ni->", area, faces.mean(axis=1)) > 0.0


def test_a_symmetric_body_is_drawn_as_a_solid_of_revolution():
    for height in 0.9, -0.9:
        body = kr.Body.symmetric(1.0, 1.1, 0.5, height)
        faces, _ = solid_of(body)
        x, y, z = faces.reshape(-1, 3).T
        assert np.hypot(x, y).max() == pytest.approx((2 * 0.5) ** 0.5, rel=1e-12), "I3 = m R^2 / 2"
        assert z.mean() * height > 0, "towards its centre of mass"


@pytest.mark.parametrize("function", [kr.plot, kr.Path.animate])
def test_examples_run(function):
    tests = doctest.DocTestFinder().find(function, globs={})
    assert sum(len(test.examples) for test in tests) > 1
    assert all(doctest.DocTestRunner().run(test).failed == 0 for test in tests)


@pytest.mark.parametrize("section", [(1.0, 0.25), (0.25, 1.0)])
def test_the_tube_of_a_rod_has_the_thickness_of_its_section(section):
    (axes,) = Figure().subplots(1, squeeze=False)[0]
    x = np.linspace(0.0, 3.0, 5)
    centre = np.stack([x, np.zeros(5), np.zeros(5)], axis=-1)
    normals = np.tile(np.eye(3)[[1, 2]], (5, 1, 1))  # away from the eye, and upwards
    draw_tube(centre, normals, section, axes, elevation=0.0)
    outlines = axes.collections[0].get_paths()
    heights = np.concatenate([path.vertices[:, 1] for path in outlines])
    assert len(outlines) and np.ptp(heights) == pytest.approx(0.1 * section[1])


def test_paths_may_be_separate_arguments():
    picture = kr.plot(CUSPS, CUSPS, CUSPS, degrees=True)
    assert len(picture) == 9 and picture[1].get_ylabel() == "nutation [°]"
    assert len(kr.plot(CUSPS, CUSPS, axes=kr.plot([CUSPS, CUSPS]))) == 7
    assert len(kr.plot(CUSPS, CUSPS, axes=kr.plot([CUSPS, CUSPS])[:6])) == 6
    axes = kr.plot(CUSPS)
    assert tuple(kr.plot(CUSPS, axes)) == tuple(kr.plot(CUSPS, axes=axes)) == tuple(axes)
    for more, words in (((CUSPS, axes), {}), ((axes,), {"axes": axes})):
        with pytest.raises(TypeError, match="paths as arguments or as one list, and axes as"):
            kr.plot(CUSPS, *more, **words)


def test_a_picture_suggests_savefig():
    picture = kr.plot(CUSPS)
    for name in ("savefig", "save"):
        with pytest.raises(AttributeError, match=r"picture\.figure\.savefig\(file\) writes a file"):
            getattr(picture, name)
    with pytest.raises(AttributeError, match=r"a picture has no 'title'$"):
        picture.title  # noqa: B018  reading the attribute raises
    with pytest.raises(AttributeError):
        picture.title = "cusps"


WHEEL = kr.Body.disk(0.1, (0, 0, -0.15), mass=0.5)
BLOCK = kr.Body.cuboid((0.1, 0.2, 0.3), pivot=(0.5, 0, -0.4))


def corners_of_film(film):
    """Return the projected vertices of the body in the first frame of an animation."""
    collections = next(film._draw_frames()).axes[0].collections
    (solid,) = [part for part in collections if isinstance(part, PolyCollection)]
    return np.concatenate([path.vertices for path in solid.get_paths()])


@pytest.mark.parametrize("heading", [0.0, 1.0, 3.0, -2.0])
def test_a_film_shows_a_wheel_at_the_end_of_its_lever(heading):
    scene = kr.Scene.from_euler(WHEEL, angles=(heading, 1.2, 0.0), rates=(0, 0, 200), gravity=9.81)
    film = kr.solve(scene, 0.1).animate(fps=1, size=100)
    ends = film._apex[0]
    assert ends[0] > 0.7 and ends[1] < -0.4  # the apex points to the right and towards the eye
    corners = corners_of_film(film)
    rim = corners[np.hypot(*corners.T) > 0.5]
    assert rim[:, 0].min() > 0.1 and corners[:, 0].min() > -0.05
    assert np.hypot(*corners.T).min() < 0.05  # the axle reaches the fixed point


def test_a_film_shows_a_block_on_a_lever_that_begins_at_the_fixed_point():
    scene = kr.Scene(BLOCK, attitude=(0.8, 0.6, 0, 0), momentum=(0, 0, 0.1), gravity=1)
    figure = next(kr.solve(scene, 1.0).animate(fps=1, size=100)._draw_frames())
    needle, lever = steel_lines(figure)
    assert not lever[0].any() and needle[0].any()
    assert 0.1 < np.hypot(*lever[1]) < np.hypot(*needle[0])


def test_a_rim_is_round():
    quads, _ = solid_of(WHEEL)
    x, y = quads.reshape(-1, 3)[:, :2].T
    is_outer = np.hypot(x, y) > 0.999 * np.hypot(x, y).max()
    angles = np.unique(np.round(np.arctan2(y[is_outer], x[is_outer]), 9))
    assert np.diff(angles).max() < np.radians(4)


@pytest.mark.parametrize("scene", [kr.scenes.thesis, kr.scenes.sleeping])
def test_films_of_upright_starts_choose_a_viewing_direction(scene):
    film = kr.solve(scene, 5.0).animate(fps=1, size=50)
    lean = np.hypot(*film._apex[:, :2].T)
    index = int(np.argmax(lean > min(0.2, lean.max() - 1e-12)))
    assert index > 0 and (lean.max() > 0.2) == (scene == kr.scenes.thesis)
    side = film._apex[index, :2] / lean[index]
    assert side == pytest.approx([np.cos(np.radians(30)), -0.5], abs=1e-12)
    assert np.abs(np.linalg.norm(film._q, axis=1) - 1.0).max() < 1e-14


# Boundary values


def test_plots_have_a_largest_number_of_paths_and_round_ticks():
    pytest.importorskip("matplotlib")
    from kreisel._analysis.plot import MOST
    from matplotlib.ticker import MaxNLocator

    path = kr.solve(THESIS, np.linspace(0.0, 5.0, 50))
    figure = kr.plot([path] * MOST).figure
    charts = [one for one in figure.axes if one.get_ylabel()]
    assert charts
    for chart in charts:
        for axis in (chart.xaxis, chart.yaxis):
            assert isinstance(axis.get_major_locator(), MaxNLocator)
            assert axis.get_major_locator().tick_values(0, 13).tolist() == [0, 5, 10, 15]
    with pytest.raises(ValueError, match=f"a list of up to {MOST} paths, not of {MOST + 1}"):
        kr.plot([path] * (MOST + 1))


def test_bodies_are_drawn_alike_at_any_scale():
    moments = np.array([2.0, 2.0, 1.0])
    for size in (1e-10, 1.0, 1e10):
        leans, stands = (
            solids.build_solid_faces(1.0, moments * size**2, size * np.array([x, 0.0, 0.3]))[0]
            for x in (0.1, 0.0)
        )
        assert len(leans) == 6 and len(stands) > 100


def test_a_body_of_revolution_without_a_tip_is_drawn_as_its_cylinder():
    faces, _ = build_faces_of_revolution(2.0, 0.3, 0.5, False)
    points = faces.reshape(-1, 3)
    assert points.min(axis=0) == pytest.approx([-2.0, -2.0, 0.2])
    assert points.max(axis=0) == pytest.approx([2.0, 2.0, 0.8])
    assert {round(float(z), 12) for z in points[:, 2]} == {0.2, 0.8}


def test_an_isotropic_rod_is_round_and_its_sides_do_not_turn_with_the_spin(monkeypatch):
    face_lists = []
    monkeypatch.setattr(
        solids, "draw_solid_faces", lambda axes, faces, *_: face_lists.append(faces)
    )
    rod = kr.rod(CUSPS)
    rod.plot(thickness=0.1)
    n = len(rod.centre)
    faces = face_lists[0]
    corners = len(faces) // n  # faces of each segment; each end has half as many
    rims = faces[: (n - 1) * corners, 0].reshape(n - 1, corners, 3) - rod.centre[:-1, None]
    assert np.linalg.norm(rims, axis=-1) == pytest.approx(0.05, rel=1e-12)
    tangent_changes = np.linalg.norm(np.diff(rod.frame[:-1, 2], axis=0), axis=-1)
    rim_changes = np.linalg.norm(np.diff(rims, axis=0), axis=-1).max(axis=1)
    assert (rim_changes <= 0.05 * tangent_changes * 1.001).all()
    assert (np.linalg.norm(np.diff(rod.frame[:-1, 0], axis=0), axis=-1) > 2 * tangent_changes).any()
