"""Charts of paths, fits, sections and indicators of chaos, and the motion between their states."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple, NoReturn

import numpy as np
import numpy.typing as npt

from .._core import body_symmetry
from .._model.parameters import get_parameter_unit
from .._model.scene import Scene
from .._model.starts import compute_turning_points
from .._utils.arguments import Array, as_bool, as_unit_name, optional_dependency, short_repr
from .._utils.html import render_figure_as_png

if TYPE_CHECKING:
    from matplotlib.axes import Axes

with optional_dependency("'kreisel[plot]'"):
    import matplotlib
    from matplotlib.axes import Axes
    from matplotlib.colors import LogNorm, Normalize
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D
    from matplotlib.ticker import MaxNLocator


BLUE, ORANGE, FAINT = "#2f7de1", "#e8710a", "#8c8c8c"
# Classes of tops and their colours, which deuteranopes tell apart by hue and by lightness.
CLASSES = (("regular", "#1f5fb5"), ("chaotic", "#f0810f"), ("in doubt", "#a0a0a0"))

_SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


_FEWEST_PER_TURN = 16  # states per turn from which lines between them show the motion
POINTS_PER_TURN = 48
MOST_POINTS = 30_000  # a line of more points would show a filled band
_AGREE = 1e-6  # distance of two apex directions that is not visible


def compute_duration_of_turn(scene: Scene, *, is_seen_from_body: bool = False) -> float:
    """Estimate the time of a turn about the fastest axis [T], or inf if nothing moves.

    The apex of a symmetric top does not feel its spin, which quantities seen from the body do.
    """
    moments = np.array(scene.body.moments)
    symmetry = body_symmetry(scene.body._block)
    moment = symmetry[0] if symmetry and not is_seen_from_body else moments.min()
    rate = scene._rotation_rate * float(moments.max() / moment)
    return 2.0 * np.pi / rate if rate > 0.0 else np.inf


def subdivide_times(t: Array, turn: float) -> Array | None:
    """Return the distinct times `t` in increasing order, with more times between distant ones.

    Returns None if more than MOST_POINTS times would be needed.
    """
    times = np.unique(t)
    gaps = np.diff(times)
    if (gaps * _FEWEST_PER_TURN <= turn).all():
        return times
    needed = np.maximum(np.ceil(gaps * POINTS_PER_TURN / turn), 1.0)
    if needed.sum() >= MOST_POINTS:
        return None
    counts = needed.astype(int)
    ends = np.cumsum(counts)
    place = np.arange(ends[-1]) - np.repeat(ends - counts, counts)
    inner = np.repeat(times[:-1], counts) + place * np.repeat(gaps / counts, counts)
    return np.append(inner, times[-1])


def evaluate_densely(path: Any) -> Any:
    """Return the motion of a path for a line, from the first state to the last; or None.

    The result is the path itself if its states are close enough, otherwise the motion at more
    times. No line is drawn if the path cannot be evaluated, if its states are not those of a single
    motion of its scene, or if the motion has too many turns for a picture.
    """
    times = subdivide_times(path.t, compute_duration_of_turn(path.scene))
    if times is None:
        return None
    if path.t[-1] < path.t[0]:
        times = times[::-1]
    if np.array_equal(times, path.t):
        return path
    try:
        motion = path(times)
    except (ValueError, RuntimeError):  # a map has no states between its steps
        return None
    order = np.argsort(times)
    states = order[np.searchsorted(times, path.t, sorter=order)]
    return motion if (np.abs(motion.apex[states] - path.apex) < _AGREE).all() else None


def insert_gaps(t: Array, values: Array, is_jump: npt.NDArray[np.bool_]) -> tuple[Array, Array]:
    """Insert a NaN into each interval where `is_jump`, so that drawn curves are interrupted."""
    gaps = np.flatnonzero(is_jump) + 1
    return np.insert(t, gaps, np.nan), np.insert(values, gaps, np.nan, axis=0)


def project_to_view(
    points: Array, elevation: float = 20.0, azimuth: float = 0.0
) -> tuple[Array, Array, Array]:
    """Project points onto the directions right, up and towards the viewer (angles in degrees)."""
    e, a = np.radians((elevation, azimuth))
    x, y, z = np.moveaxis(np.asarray(points), -1, 0)
    horizontal, distance = x * np.cos(a) + y * np.sin(a), y * np.cos(a) - x * np.sin(a)
    return horizontal, z * np.cos(e) + distance * np.sin(e), z * np.sin(e) - distance * np.cos(e)


def set_equal_scale_and_hide_frame(axes: Axes) -> None:
    axes.set_aspect("equal")
    axes.autoscale_view()
    axes.axis("off")


def draw_start_and_scale_bar(
    centre: Array, axes: Axes, unit: str, elevation: float = 20.0, azimuth: float = 0.0
) -> None:
    """Mark the first point of a curve, and draw a scale bar of 1, 2 or 5 times a power of ten."""
    ink = matplotlib.rcParams["text.color"]
    x, y, _ = project_to_view(centre, elevation, azimuth)
    axes.plot(x[:1], y[:1], "o", color=ink, markersize=4, zorder=4)
    style = {"textcoords": "offset points", "fontsize": 8, "color": ink}
    extent = float(max(np.ptp(x), np.ptp(y)))
    is_near = np.hypot(x - x[0], y - y[0]) <= 0.3 * extent
    dx, dy = x[0] - x[is_near].mean(), y[0] - y[is_near].mean()  # away from the curve
    distance = float(np.hypot(dx, dy))
    dx, dy = (dx / distance, dy / distance) if distance > 0.0 else (-1.0, 0.0)
    axes.annotate(
        "start", (x[0], y[0]), xytext=(9 * dx, 9 * dy),
        ha=("center", "left", "right")[round(dx)],
        va=("center", "bottom", "top")[round(dy)], **style,
    )  # fmt: skip
    if not extent > 0.0:
        return
    power = 10.0 ** np.floor(np.log10(0.25 * extent))
    # The logarithm of a number just below a power of ten may be rounded up.
    length = float(max(k for k in (0.5, 1.0, 2.0, 5.0) if k * power <= 0.25 * extent) * power)
    left, bottom = float(x.max()) - length, float(y.min()) - 0.08 * extent
    axes.plot(
        [left, left + length], [bottom, bottom], color=ink, linewidth=2.0, solid_capstyle="butt"
    )
    axes.annotate(
        f"{length:.12g} {unit}", (left + 0.5 * length, bottom), xytext=(0, -4), va="top",
        ha="center", **style,
    )  # fmt: skip


def check_axes(axes: object) -> None:
    if not isinstance(axes, Axes):
        raise TypeError(
            "axes must be axes of matplotlib, as returned by figure.add_subplot(), not "
            f"{short_repr(axes)}"
        )


def open_chart(axes: Axes | None, width: float = 6.0, height: float = 4.0) -> Axes:
    """Return `axes`, by default those of a new figure of the given size [in]."""
    if axes is None:
        return Figure(figsize=(width, height), layout="constrained").add_subplot()
    check_axes(axes)
    return axes


def apply_chart_style(chart: Axes) -> None:
    chart.grid(True, alpha=0.25, linewidth=0.6)
    chart.spines[["top", "right"]].set_visible(False)
    chart.tick_params(labelsize=8, length=3)
    chart.tick_params(which="minor", labelsize=7)
    for axis, most in (chart.xaxis, 6), (chart.yaxis, 5):
        if axis.get_scale() != "log":
            axis.set_major_locator(MaxNLocator(most, steps=[1, 2, 5, 10]))
        axis.label.set_fontsize(9)
    chart.margins(x=0.01)


def make_legend_entry(label: str, colour: str, **style: Any) -> Line2D:
    style = {"linewidth": 0.9} | style
    return Line2D([], [], color=colour, label=label, **style)


def format_axis_label(name: str, dimension: str, time_unit: str) -> str:
    """Return the label of an axis: a name and, if there is one, a unit such as M L^2 T^-1."""
    if not dimension:
        return name
    parts = [
        base.replace("T", time_unit).replace("deg", "°") + power.translate(_SUPERSCRIPTS)
        for base, _, power in (factor.partition("^") for factor in dimension.split())
    ]
    return f"{name} [{' '.join(parts)}]"


class AngleBetweenPaths(NamedTuple):
    """The angle [rad] between the attitudes or the apexes of two paths at their common times."""

    t: Array
    angle: Array
    what: str


class FigureAxes(tuple[Axes, ...]):
    """The matplotlib axes of a figure.

    A picture of paths has three axes for each path: trace, nutation and precession, and for two
    paths possibly a chart of the angle between them. A picture of a fit has two axes for each
    panel: one for the measurements and one for the residuals. Notebooks display the picture; the
    method `picture.figure.savefig("top.png")` saves it.
    """

    __slots__ = ()

    @property
    def figure(self) -> Figure:
        """The figure that contains the axes; to save it, call `figure.savefig`."""
        figure = self[0].get_figure()
        assert isinstance(figure, Figure)
        return figure

    if not TYPE_CHECKING:

        def __getattr__(self, name: str) -> NoReturn:
            """Raise AttributeError; for names such as save, suggest `figure.savefig`."""
            hint = ": picture.figure.savefig(file) writes a file" if "save" in name else ""
            raise AttributeError(f"a picture has no {short_repr(name)}{hint}")

    def _repr_png_(self) -> bytes:
        return render_figure_as_png(self.figure)


def plot_paths(
    paths: Sequence[tuple[Any, Any]],
    axes: Iterable[Axes] | None,
    degrees: bool,
    time_unit: str,
    compute_angle_between_paths: Callable[[], AngleBetweenPaths] | None = None,
) -> FigureAxes:
    """Plot each path and its events in three charts, in a new figure by default.

    For two paths, an additional chart may show the angle between them.
    """
    unit, name = (180.0 / np.pi, "°") if as_bool("degrees", degrees) else (1.0, "rad")
    label = format_axis_label("time", "T", as_unit_name("time_unit", time_unit))
    if not all(len(path.t) for path, _ in paths):
        raise ValueError("a path without states cannot be drawn: call solve with times")
    n = len(paths)
    if axes is None:
        picture = _create_path_axes(n, compute_angle_between_paths is not None)
    else:
        try:
            picture = FigureAxes(axes)
        except TypeError:
            raise TypeError(f"axes must be a list of {3 * n}, not {short_repr(axes)}") from None
        if len(picture) != 3 * n and (len(picture), n) != (7, 2):
            more = ", or 7 with their difference" if n == 2 else ""
            raise ValueError(
                f"axes must be {3 * n}, for trace, nutation and precession of each path{more}, not "
                f"{len(picture)}"
            )
        for one in picture:
            check_axes(one)
    for i, (path, events) in enumerate(paths):
        own = picture[3 * i : 3 * i + 3]
        _draw_path_panels(own, path, events, (unit, name), label)
        if i and axes is None:
            for chart in own[1:]:
                chart.set_ylabel("")
    if compute_angle_between_paths is not None and len(picture) > 3 * n:
        t, angles, what = compute_angle_between_paths()
        note = f"the {what} are equal" if len(t) else "the paths have no times in common"
        if (angles > 0.0).any():
            angles = np.where(angles > 0.0, angles, np.nan)
            picture[-1].set_yscale("log")
            note = f"angle between the {what}"
        picture[-1].plot(t, unit * angles, color=BLUE, linewidth=1.2)
        picture[-1].set(xlabel=label, ylabel=f"difference [{name}]")
        picture[-1].set_title(note, fontsize=9)
        apply_chart_style(picture[-1])
    return picture


def _create_path_axes(n: int, has_difference: bool) -> FigureAxes:
    if n == 1:
        figure = Figure(figsize=(8.4, 3.9), layout="constrained")
        grid = figure.add_gridspec(2, 2, width_ratios=(3, 4))
        sphere, nutation_axes = figure.add_subplot(grid[:, 0]), figure.add_subplot(grid[0, 1])
        precession_axes = figure.add_subplot(grid[1, 1], sharex=nutation_axes)
        return FigureAxes((sphere, nutation_axes, precession_axes))
    heights = (6, 4, 4, 4) if has_difference else (6, 4, 4)
    figure = Figure(figsize=(3.3 * n + 0.6, 6.4 * sum(heights) / 14), layout="constrained")
    grid = figure.add_gridspec(len(heights), n, height_ratios=heights)
    axes: list[Axes] = []
    for i in range(n):
        nutation_axes = figure.add_subplot(grid[1, i], sharey=axes[1] if i else None)
        precession_axes = figure.add_subplot(grid[2, i], sharex=nutation_axes)
        axes += figure.add_subplot(grid[0, i]), nutation_axes, precession_axes
    if has_difference:
        axes.append(figure.add_subplot(grid[3, :]))
    return FigureAxes(axes)


def _draw_path_panels(
    axes: Sequence[Axes], path: Any, events: Any, angle: tuple[float, str], time: str
) -> None:
    sphere, nutation_axes, precession_axes = axes
    unit, sign = angle
    try:
        limits = compute_turning_points(path.scene)
    except ValueError:  # not known in closed form
        limits = None
    angles = [] if limits is None else [float(limits.least[0]), float(limits.greatest[0])]
    line = evaluate_densely(path)
    has_marks = line is not path or len(path) == 1
    shown = path[:1] if line is None else line
    draw_apex_trace(sphere, shown.apex, np.cos(angles))
    motion = path.scene.body.kind if limits is None else str(limits.motion_type[0])
    method = "closed form" if path.method == "exact" else path.method
    sphere.set_title(f"{motion} ({method})", fontsize=10)
    if line is not None:
        style = dict[str, Any](color=BLUE, linewidth=1.2)
        nutation_axes.plot(line.t, unit * line.nutation, **style)
        precession = np.unwrap(line.precession_angle)
        change = np.abs(np.diff(precession))
        # The angle jumps if the apex passes close to the vertical.
        jumps = change > max(0.5, 8.0 * float(np.median(change)) if len(change) else 0.0)
        precession_axes.plot(*insert_gaps(line.t, unit * precession, jumps), **style)
    for limit in angles:
        nutation_axes.axhline(unit * limit, color=ORANGE, linewidth=0.9, linestyle="--", zorder=1)
    if has_marks:
        _draw_dots(axes, path, line, unit, BLUE, 3.0)
    if events is not None:
        _draw_dots(axes, events, line, unit, ORANGE, 4.0)
    dots = [("start", matplotlib.rcParams["text.color"], 4.0)]
    if has_marks:
        dots.append(("states" + " (motion not drawn)" * (line is None), BLUE, 3.0))
    if events is not None:
        dots.append(("events", ORANGE, 4.0))
    shape = {"marker": "o", "linestyle": ""}
    marks = [make_legend_entry(text, ink, markersize=size, **shape) for text, ink, size in dots]
    if angles:
        marks.append(make_legend_entry("limits", ORANGE, linestyle="--"))
    sphere.legend(
        handles=marks, loc="upper center", bbox_to_anchor=(0.5, 0.0), ncols=4, fontsize=7.5,
        frameon=False, borderpad=0.0, handlelength=1.5, columnspacing=1.2,
    )  # fmt: skip
    nutation_axes.set_ylabel(f"nutation [{sign}]")
    precession_axes.set(xlabel=time, ylabel=f"precession [{sign}]")
    low, high = nutation_axes.get_ylim()
    if high - low < 1e-6 * unit:  # constant up to rounding errors
        middle, half = 0.5 * (low + high), 0.05 * unit
        nutation_axes.set_ylim(middle - half, middle + half)
    is_shared = nutation_axes.get_shared_x_axes().joined(nutation_axes, precession_axes)
    nutation_axes.tick_params(labelbottom=not is_shared)
    for chart in nutation_axes, precession_axes:
        apply_chart_style(chart)


def _draw_dots(
    axes: Sequence[Axes], states: Any, line: Any, unit: float, colour: str, size: float
) -> None:
    """Mark states by dots in all charts, on the line, except on the far side of the sphere."""
    x, y, depth = project_to_view(states.apex)
    precession = states.precession_angle
    if line is not None:
        order = np.argsort(line.t)
        precession = np.interp(states.t, line.t[order], np.unwrap(line.precession_angle)[order])
    angles = (states.t, unit * states.nutation), (states.t, unit * precession)
    points = (x[depth > 0.0], y[depth > 0.0]), *angles
    for chart, (across, up) in zip(axes, points, strict=True):
        chart.plot(across, up, "o", color=colour, markersize=size, zorder=4)


def draw_apex_trace(axes: Axes, trace: Array, limits: Iterable[float]) -> None:
    """Draw a trace on the unit sphere, with fainter lines on the far side of the sphere.

    The initial state is marked by a dot, and the vertical by an arrow. Dashed circles mark the
    limiting heights of the apex, given by `limits`.
    """
    angle = np.linspace(0.0, 2.0 * np.pi, 200)
    axes.plot(np.cos(angle), np.sin(angle), color=FAINT, linewidth=0.8)
    x, y, _ = project_to_view(np.array([[0.0, 0.0, 1.0], [0.0, 0.0, 1.25]]))
    axes.annotate("", (x[1], y[1]), (x[0], y[0]), arrowprops={"arrowstyle": "->", "color": FAINT})
    axes.set(xlim=(-1.05, 1.05), ylim=(-1.05, 1.3))
    for height, colour, style in [(0.0, FAINT, "-"), *((z, ORANGE, "--") for z in limits)]:
        radius = (1.0 - height * height) ** 0.5
        circle = radius * np.cos(angle), radius * np.sin(angle), np.full_like(angle, height)
        x, y, depth = project_to_view(np.stack(circle, axis=-1))
        axes.plot(x, np.where(depth > 0.0, y, np.nan), style, color=colour, linewidth=0.7)
    x, y, depth = project_to_view(trace)
    axes.plot(x, y, color=BLUE, linewidth=0.5, alpha=0.4)
    axes.plot(x, np.where(depth > 0.0, y, np.nan), color=BLUE, linewidth=1.0)
    ink, opacity = matplotlib.rcParams["text.color"], 0.4 if depth[0] < 0.0 else 1.0
    axes.plot(x[:1], y[:1], "o", color=ink, markersize=4, alpha=opacity)
    set_equal_scale_and_hide_frame(axes)


_NAMES = {"lyapunov": ("largest exponent", "T^-1"), "megno": ("MEGNO", ""), "oli": ("OLI", "")}
_LOWEST = {"megno": 0.1, "oli": 0.1}  # values below are left out of the logarithmic scale
_CHAOTIC, _DOUBTFUL = 1, 2  # indices of CLASSES


def classify_tops_by_chaos(chaos: Any) -> npt.NDArray[np.int8]:
    """Return the class of each top: 0 if it is regular, 1 if it is chaotic, and 2 if uncertain."""
    classes = np.where(np.ravel(chaos.is_chaotic), _CHAOTIC, 0).astype(np.int8)
    classes[np.ravel(chaos.is_doubtful)] = _DOUBTFUL
    return classes


def draw_indicator_curves(chaos: Any, name: str, axes: Axes | None, unit: str) -> Axes:
    """Plot a chaos indicator over time, in colours for regular, chaotic and uncertain tops."""
    chart = open_chart(axes)
    curves = getattr(chaos, f"{name}_curve").reshape(-1, chaos.t.size)
    lowest, classes = _LOWEST.get(name, 0.0), classify_tops_by_chaos(chaos)
    visible = np.where(curves > lowest, curves, np.nan)
    marker = "o" if chaos.t.size == 1 else ""
    for k in np.unique(classes):
        chart.plot(
            np.abs(chaos.t), visible[classes == k].T, color=CLASSES[k][1], marker=marker,
            linewidth=1.4 if len(curves) == 1 else 0.8, zorder=2.0 + 0.1 * float(k),
            alpha=max(0.15, min(1.0, 20.0 / len(curves))),
        )  # fmt: skip
    marks = []
    for k, n in zip(*np.unique(classes, return_counts=True), strict=True):
        label = CLASSES[k][0] if len(classes) == 1 else f"{CLASSES[k][0]} ({n})"
        marks.append(make_legend_entry(label, CLASSES[k][1], linewidth=2.0))
    if name == "megno":
        chart.axhline(chaos.threshold, color=FAINT, linewidth=0.9, linestyle="--", zorder=1)
        marks.append(make_legend_entry("threshold", FAINT, linestyle="--"))
    chart.legend(handles=marks, fontsize=8, frameon=False)
    chart.set(xscale="log", yscale="log")
    time = format_axis_label("time", "T", unit) + ", back from the start" * bool(chaos.t[-1] < 0.0)
    chart.set(xlabel=time, ylabel=format_axis_label(*_NAMES[name], unit))
    apply_chart_style(chart)
    return chart


def draw_chaos_indicator_map(chaos: Any, name: str, axes: Axes | None, unit: str) -> Axes:
    """Plot the final values of an indicator over two parameters; dots mark borderline cases."""
    chart = open_chart(axes)
    values = getattr(chaos, f"{name}_curve")[..., -1]
    axes_of_map = []  # the label of each parameter, and its monotonic values or else its indices
    for name_of_axis, n in zip(chaos.scene.axes, values.shape, strict=True):
        numbers = np.ravel(chaos.scene.coords.get(name_of_axis, ())).astype(np.float64)
        dimension = get_parameter_unit(name_of_axis, chaos.scene._in_degrees)
        steps = np.diff(numbers)
        if len(numbers) != n or not ((steps > 0.0).all() or (steps < 0.0).all()):
            numbers, dimension = np.arange(n, dtype=np.float64), ""
        label = format_axis_label(name_of_axis.replace("_", " "), dimension, unit)
        axes_of_map.append((label, numbers))
    (y_name, y), (x_name, x) = axes_of_map
    scale: Normalize = Normalize()
    if name != "lyapunov":
        scale = LogNorm(1.0, float(np.max(values, where=np.isfinite(values), initial=10.0)))
        values = np.maximum(values, 1.0)
    field = chart.pcolormesh(x, y, values, cmap="cividis", norm=scale, rasterized=True)
    doubtful = np.asarray(chaos.is_doubtful)
    if doubtful.any():
        rows, columns = np.nonzero(doubtful)
        chart.plot(x[columns], y[rows], ".", color="white", markersize=1.5, markeredgewidth=0.0)
        chart.set_title("dots: classification in doubt", fontsize=9)
    chart.set(xlabel=x_name, ylabel=y_name)
    apply_chart_style(chart)
    chart.grid(visible=False)
    figure = chart.get_figure()
    assert isinstance(figure, Figure)
    label = format_axis_label(*_NAMES[name], unit)
    figure.colorbar(field, ax=chart, label=f"{label}, t = {chaos.t[-1]:g}")
    return chart


_NEAR = 1e-3  # largest difference of a line from a multiple, relative to the frequency of nutation
_DECADES = 0.5  # empty part of the scale below the weakest and above the strongest line


def draw_spectral_lines(spectrum: Any, axes: Axes | None, unit: str) -> Axes:
    """Plot the amplitude of each spectral line against its frequency, and return the axes."""
    chart = open_chart(axes, 6.4, 3.4)
    strengths = np.abs(spectrum.amplitudes)
    is_present = strengths > 0.0
    lines, strengths = spectrum.lines[is_present], strengths[is_present]
    label = format_axis_label("angular frequency", "T^-1", unit)
    chart.set(xlabel=label, ylabel="amplitude of the apex", yscale="log")
    if len(lines):
        floor = 10.0 ** (math.floor(np.log10(strengths.min()) - _DECADES))
        chart.vlines(lines, floor, strengths, color=BLUE, linewidth=1.4)
        chart.plot(lines, strengths, "o", color=BLUE, markersize=4)
        chart.set_ylim(floor, strengths.max() * 10.0**_DECADES)
    title, rate = f"{len(lines)} lines, rest {spectrum.rest:.0e}", spectrum.precession_rate
    if math.isfinite(rate):
        title += "; dashed: mean precession"
        chart.axvline(rate, color=ORANGE, linewidth=1.0, linestyle="--", zorder=1)
        if spectrum.nutation > 0.0:
            multiples = (lines - rate) / spectrum.nutation
            for line, strength, k in zip(lines, strengths, multiples, strict=True):
                if abs(k - round(k)) < _NEAR:
                    chart.annotate(
                        f"{round(k):+d}" if round(k) else "0", (line, strength), xytext=(0, 4),
                        textcoords="offset points", ha="center", fontsize=7.5,
                    )  # fmt: skip
    chart.set_title(title, fontsize=9)
    apply_chart_style(chart)
    chart.margins(x=0.06)
    return chart


_INK = 12000.0  # sum of the areas of all points [pt^2], within the limits below
_SMALLEST, _LARGEST = 0.35, 9.0  # area of a point [pt^2]
_DARKEST, _BRIGHTEST = 0.05, 0.85  # part of the colour map that is visible on white


def draw_section_points(
    axes: Axes | None,
    points: tuple[Array, Array],
    labels: tuple[str, str],
    top: npt.NDArray[np.int64],
    classes: npt.NDArray[np.int8] | None,
) -> Axes:
    """Draw points (e,) of tops; colours tell the tops, or their classes in CLASSES, apart."""
    chart = open_chart(axes, 5.2, 4.4)
    x, y = points
    size = float(np.clip(_INK / max(len(x), 1), _SMALLEST, _LARGEST))
    if classes is None:
        most = max(int(top.max(initial=0)), 1)
        part = _DARKEST + (_BRIGHTEST - _DARKEST) * top / most
        colours = matplotlib.colormaps["viridis"](part)
        chart.set_title("a colour for each top" if top.max(initial=0) else "", fontsize=9)
    else:
        palette = np.array([matplotlib.colors.to_rgba(colour) for _, colour in CLASSES])
        colours = palette[classes[top]]
        marks = [
            make_legend_entry(name, colour, marker="o", markersize=4, linestyle="")
            for k, (name, colour) in enumerate(CLASSES)
            if (classes == k).any()
        ]
        chart.legend(
            handles=marks, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=3, fontsize=8,
            frameon=False, title_fontsize=8,
            title="a longer t of kr.chaos settles doubt" if (classes == _DOUBTFUL).any() else None,
        )  # fmt: skip
    chart.scatter(x, y, c=colours, s=size, linewidths=0, rasterized=True)
    chart.set(xlabel=labels[0], ylabel=labels[1])
    apply_chart_style(chart)
    chart.grid(visible=False)
    return chart


def draw_steady_rotations(found: Any, axes: Axes | None, unit: str) -> Axes:
    """Draw the energies of steady rotations over their vertical momenta, and return the axes."""
    chart = open_chart(axes, 5.2, 4.4)
    styles = {"stable": (BLUE, "o"), "linear": ("#5a9e6f", "s"), "unstable": (ORANGE, "x")}
    for kind, (colour, marker) in styles.items():
        has = found.stability == kind
        if has.any():
            x, y = found.vertical_momentum[has], found.energy[has]
            chart.plot(x, y, marker, color=colour, markersize=4, label=kind)
    label = format_axis_label("vertical momentum", "M L^2 T^-1", unit)
    chart.set(xlabel=label, ylabel=format_axis_label("energy", "M L^2 T^-2", unit))
    chart.legend(fontsize=8)
    apply_chart_style(chart)
    return chart


_COLOURS = (BLUE, ORANGE, "#5a9e6f")
_WIDTH, _HEIGHT = 4.5, 4.5  # size of a column of two charts [inches]


def plot_errors_of_runs(
    names: Sequence[str], errors: Sequence[Any], limit: float, time_unit: str
) -> FigureAxes:
    """Draw the attitude errors of runs over time, with the error allowed, and the energy errors."""
    figure = Figure(figsize=(2.0 * _WIDTH, _HEIGHT), layout="constrained")
    left, right = figure.subplots(1, 2)
    for name, each in zip(names, errors, strict=True):
        left.plot(each.t, each.attitude, ".-", ms=3, lw=0.8, label=name)
        right.plot(each.t, each.energy, ".-", ms=3, lw=0.8)
    left.axhline(limit, color="black", lw=0.8)
    left.set_yscale("log")
    left.set_ylabel("attitude error [rad]")
    left.legend()
    right.set_ylabel("relative change of the energy")
    for chart in (left, right):
        chart.set_xlabel(format_axis_label("time", "T", time_unit))
    return FigureAxes([left, right])


def plot_fit_panels(panels: Sequence[Any], time_unit: str) -> FigureAxes:
    """Draw two charts per panel: one of measurements and fitted motion, and one of residuals.

    Each panel has the attributes name, components (j names), dimension, t, values (n, j), residuals
    (n, k), where j > k for attitudes, sigma, and motion: times and values that a line joins, or
    None.
    """
    figure = Figure(figsize=(_WIDTH * len(panels), _HEIGHT), layout="constrained")
    axes: list[Axes] = []
    grid = figure.subplots(2, len(panels), sharex="col", squeeze=False, height_ratios=(2.0, 1.0))
    for (upper, lower), panel in zip(grid.T, panels, strict=True):
        for chart, columns in (upper, panel.values), (lower, panel.residuals):
            for k, column in enumerate(columns.T):
                colour = _COLOURS[k % len(_COLOURS)]
                chart.plot(panel.t, column, ".", ms=3, color=colour, zorder=2.5)
        if panel.motion is not None:
            upper.plot(*panel.motion, color="black", lw=0.8)
        elif panel.values.shape == panel.residuals.shape:
            upper.plot(panel.t, panel.values + panel.residuals * panel.sigma, "k.", ms=1.5)
        upper.set_title(panel.name)
        label = panel.name.replace("_", " ")
        upper.set_ylabel(format_axis_label(label, panel.dimension, time_unit))
        if len(panel.components) > 1:
            named = zip(panel.components, _COLOURS, strict=False)
            dots = {"marker": ".", "linestyle": ""}
            upper.legend(handles=[make_legend_entry(*one, **dots) for one in named], fontsize=8)
        lower.axhline(0.0, color="black", lw=0.8)
        lower.set_xlabel(format_axis_label("time", "T", time_unit))
        lower.set_ylabel("residual [sigma]")
        axes += [upper, lower]
    return FigureAxes(axes)
