"""Charts of paths, fits, sections and growth."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple, NoReturn

import numpy as np
import numpy.typing as npt

from .._model.scene import Ensemble
from .._model.starts import compute_turning_points
from .._utils.arguments import Array, as_bool, as_unit_name, optional_dependency, short_repr
from .._utils.html import render_figure_as_png
from .dense_motion import evaluate_densely, insert_gaps
from .film import (
    BLUE,
    FAINT,
    ORANGE,
    project_to_view,
    set_equal_scale_and_hide_frame,
    validate_axes_type,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

with optional_dependency("'kreisel[plot]'"):
    import matplotlib
    from matplotlib.axes import Axes
    from matplotlib.colors import LogNorm, Normalize
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D
    from matplotlib.ticker import MaxNLocator


# Classes of tops and their colours, which deuteranopes tell apart by hue and by lightness.
CLASSES = (("regular", "#1f5fb5"), ("chaotic", "#f0810f"), ("in doubt", "#a0a0a0"))

_SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def open_chart(axes: Axes | None, width: float = 6.0, height: float = 4.0) -> Axes:
    """Return `axes`, by default those of a new figure of the given size [in]."""
    if axes is not None:
        return validate_axes_type(axes)
    return Figure(figsize=(width, height), layout="constrained").add_subplot()


def apply_chart_style(chart: Axes) -> None:
    chart.grid(True, alpha=0.25, linewidth=0.6)
    chart.spines[["top", "right"]].set_visible(False)
    chart.tick_params(labelsize=8, length=3)
    chart.tick_params(which="minor", labelsize=7)
    if chart.get_yscale() != "log":
        chart.yaxis.set_major_locator(MaxNLocator(5, steps=[1, 2, 5, 10]))
    if chart.get_xscale() != "log":
        chart.xaxis.set_major_locator(MaxNLocator(6, steps=[1, 2, 5, 10]))
    chart.xaxis.label.set_fontsize(9)
    chart.yaxis.label.set_fontsize(9)
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


def format_time_axis_label(unit: str) -> str:
    return format_axis_label("time", "T", unit)


class AngleBetweenPaths(NamedTuple):
    """The angle between the attitudes of two paths at their common times.

    t      (k,) times [T]
    angle  (k,) the angle [rad]
    what   the directions between which the angle is measured
    """

    t: Array
    angle: Array
    what: str


class FigureAxes(tuple[Axes, ...]):
    """The matplotlib axes of a figure.

    A picture of paths has three axes for each path: trace, nutation and precession. For two paths,
    an additional chart at the end may show the angle between their attitudes or apexes. A picture
    of a fit has two axes for each panel: one for the measurements and one for the residuals.
    Notebooks display the picture. To save the figure to a file, call
    `picture.figure.savefig("top.png")`.
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
    label = format_time_axis_label(as_unit_name("time_unit", time_unit))
    if not all(len(path.t) for path, _ in paths):
        raise ValueError("a path without states cannot be drawn: call solve with times")
    n, has_difference = len(paths), compute_angle_between_paths is not None
    picture = (
        _create_path_axes(n, has_difference) if axes is None else _validate_chart_axes(axes, n)
    )
    for i, (path, events) in enumerate(paths):
        one = picture[3 * i : 3 * i + 3]
        _draw_path_panels(one, path, events, (unit, name), label)
        if i and axes is None:
            for chart in one[1:]:
                chart.set_ylabel("")
    if compute_angle_between_paths is not None and len(picture) > 3 * n:
        _draw_angle_between_paths(picture[-1], compute_angle_between_paths(), (unit, name), label)
    return picture


def _create_path_axes(n: int, has_difference: bool) -> FigureAxes:
    if n == 1:
        figure = Figure(figsize=(8.4, 3.9), layout="constrained")
        grid = figure.add_gridspec(2, 2, width_ratios=(3, 4))
        sphere, nutation_axes = figure.add_subplot(grid[:, 0]), figure.add_subplot(grid[0, 1])
        return FigureAxes(
            (sphere, nutation_axes, figure.add_subplot(grid[1, 1], sharex=nutation_axes))
        )
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


def _validate_chart_axes(axes: Iterable[Axes], paths: int) -> FigureAxes:
    n = 3 * paths
    try:
        picture = FigureAxes(axes)
    except TypeError:
        raise TypeError(f"axes must be a list of {n}, not {short_repr(axes)}") from None
    if len(picture) != n and (len(picture), paths) != (7, 2):
        more = ", or 7 with their difference" if paths == 2 else ""
        raise ValueError(
            f"axes must be {n}, for trace, nutation and precession of each path{more}, not "
            f"{len(picture)}"
        )
    for one in picture:
        validate_axes_type(one)
    return picture


def _draw_path_panels(
    axes: Sequence[Axes],
    path: Any,
    events: Any,
    angle: tuple[float, str],
    time: str,
) -> None:
    sphere, nutation_axes, precession_axes = axes
    unit, sign = angle
    try:
        limits = compute_turning_points(path.scene)
    except ValueError:  # not known in closed form
        limits = None
    angles = [] if limits is None else [float(limits.least[0]), float(limits.greatest[0])]
    drawn = evaluate_densely(path)
    shown = path[:1] if drawn.line is None else drawn.line
    draw_apex_trace(sphere, shown.apex, limits=np.cos(angles))
    motion = path.scene.body.kind if limits is None else str(limits.motion_type[0])
    method = "closed form" if path.method == "exact" else path.method
    sphere.set_title(f"{motion} ({method})", fontsize=10)
    if drawn.line is not None:
        line, style = drawn.line, dict[str, Any](color=BLUE, linewidth=1.2)
        nutation_axes.plot(line.t, unit * line.nutation, **style)
        precession = np.unwrap(line.precession_angle)
        change = np.abs(np.diff(precession))
        # The angle jumps if the apex passes close to the vertical.
        jumps = change > max(0.5, 8.0 * float(np.median(change)) if len(change) else 0.0)
        precession_axes.plot(*insert_gaps(line.t, unit * precession, jumps), **style)
    for angle_limit in angles:
        nutation_axes.axhline(
            unit * angle_limit, color=ORANGE, linewidth=0.9, linestyle="--", zorder=1
        )
    if drawn.has_marks:
        _draw_dots(axes, path, drawn.line, unit, BLUE, 3.0)
    if events is not None:
        _draw_dots(axes, events, drawn.line, unit, ORANGE, 4.0)
    dots = [("start", matplotlib.rcParams["text.color"], 4.0)]
    if drawn.has_marks:
        dots.append(
            ("states" if drawn.line is not None else "states (motion not drawn)", BLUE, 3.0)
        )
    if events is not None:
        dots.append(("events", ORANGE, 4.0))
    marks = [
        make_legend_entry(label, colour, marker="o", markersize=size, linestyle="")
        for label, colour, size in dots
    ]
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
    nutation_axes.tick_params(
        labelbottom=not nutation_axes.get_shared_x_axes().joined(nutation_axes, precession_axes)
    )
    for chart in nutation_axes, precession_axes:
        apply_chart_style(chart)


def _draw_angle_between_paths(
    chart: Axes, difference: AngleBetweenPaths, angle: tuple[float, str], time: str
) -> None:
    """Plot the angle between two paths on a logarithmic scale, omitting angles equal to 0."""
    unit, sign = angle
    values = unit * difference.angle
    chart.set(xlabel=time, ylabel=f"difference [{sign}]")
    if (values > 0.0).any():
        chart.plot(difference.t, np.where(values > 0.0, values, np.nan), color=BLUE, linewidth=1.2)
        chart.set_yscale("log")
        note = f"angle between the {difference.what}"
    elif len(values):
        chart.plot(difference.t, values, color=BLUE, linewidth=1.2)
        note = f"the {difference.what} are equal"
    else:
        note = "the paths have no times in common"
    chart.set_title(note, fontsize=9)
    apply_chart_style(chart)


def _draw_dots(
    axes: Sequence[Axes],
    states: Any,
    line: Any,
    unit: float,
    colour: str,
    size: float,
) -> None:
    """Mark states by dots in all charts, on the line, except on the far side of the sphere."""
    x, y, depth = project_to_view(states.apex)
    precession = states.precession_angle
    if line is not None:
        order = np.argsort(line.t)
        precession = np.interp(states.t, line.t[order], np.unwrap(line.precession_angle)[order])
    points = [
        (x[depth > 0.0], y[depth > 0.0]),
        (states.t, unit * states.nutation),
        (states.t, unit * precession),
    ]
    for chart, (across, up) in zip(axes, points, strict=True):
        chart.plot(across, up, "o", color=colour, markersize=size, zorder=4)


def _draw_circle_of_latitude(
    axes: Axes, height: float, elevation: float, colour: str, style: str
) -> None:
    angle = np.linspace(0.0, 2.0 * np.pi, 200)
    flat = (1.0 - height * height) ** 0.5
    circle = np.stack(
        [flat * np.cos(angle), flat * np.sin(angle), np.full_like(angle, height)], axis=-1
    )
    x, y, depth = project_to_view(circle, elevation)
    axes.plot(x, np.where(depth > 0.0, y, np.nan), style, color=colour, linewidth=0.7)


def draw_apex_trace(
    axes: Axes, trace: Array, elevation: float = 20.0, limits: Iterable[float] = ()
) -> None:
    """Draw a trace on the unit sphere, with fainter lines on the far side of the sphere.

    The initial state is marked by a dot, and the vertical by an arrow. Dashed circles mark the
    limiting heights of the apex, given by `limits`.
    """
    angle = np.linspace(0.0, 2.0 * np.pi, 200)
    axes.plot(np.cos(angle), np.sin(angle), color=FAINT, linewidth=0.8)
    _draw_circle_of_latitude(axes, 0.0, elevation, FAINT, "-")
    x, y, _ = project_to_view(np.array([[0.0, 0.0, 1.0], [0.0, 0.0, 1.25]]), elevation)
    axes.annotate("", (x[1], y[1]), (x[0], y[0]), arrowprops={"arrowstyle": "->", "color": FAINT})
    axes.set(xlim=(-1.05, 1.05), ylim=(-1.05, 1.3))
    for height in limits:
        _draw_circle_of_latitude(axes, float(height), elevation, ORANGE, "--")
    x, y, depth = project_to_view(trace, elevation)
    axes.plot(x, y, color=BLUE, linewidth=0.5, alpha=0.4)
    axes.plot(x, np.where(depth > 0.0, y, np.nan), color=BLUE, linewidth=1.0)
    ink = matplotlib.rcParams["text.color"]
    is_behind = depth[0] < 0.0
    axes.plot(x[:1], y[:1], "o", color=ink, markersize=4, alpha=0.4 if is_behind else 1.0)
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
        verdict, colour = CLASSES[k]
        label = verdict if len(classes) == 1 else f"{verdict} ({n})"
        marks.append(make_legend_entry(label, colour, linewidth=2.0))
    if name == "megno":
        chart.axhline(chaos.threshold, color=FAINT, linewidth=0.9, linestyle="--", zorder=1)
        marks.append(make_legend_entry("threshold", FAINT, linestyle="--"))
    chart.legend(handles=marks, fontsize=8, frameon=False)
    chart.set(xscale="log", yscale="log")
    chart.set(xlabel=format_time_axis_label(unit), ylabel=format_axis_label(*_NAMES[name], unit))
    if chaos.t[-1] < 0.0:
        chart.set_xlabel(f"{format_time_axis_label(unit)}, back from the start")
    apply_chart_style(chart)
    return chart


def draw_chaos_indicator_map(chaos: Any, name: str, axes: Axes | None, unit: str) -> Axes:
    """Plot the final values of an indicator over two parameters; dots mark borderline cases."""
    chart = open_chart(axes)
    values = getattr(chaos, f"{name}_curve")[..., -1]
    (y_name, y), (x_name, x) = (_get_varied_axis_name_and_values(chaos.scene, d) for d in (0, 1))
    scale: Normalize = Normalize()
    if name != "lyapunov":
        largest = float(np.max(values, where=np.isfinite(values), initial=10.0))
        scale = LogNorm(1.0, largest)
        values = np.maximum(values, 1.0)
    field = chart.pcolormesh(x, y, values, cmap="cividis", norm=scale, rasterized=True)
    doubtful = np.asarray(chaos.is_doubtful)
    if doubtful.any():
        rows, columns = np.nonzero(doubtful)
        chart.plot(
            x[columns], y[rows], ".", color="white", markersize=1.5,
            markeredgewidth=0.0,
        )  # fmt: skip
        chart.set_title("dots: classification in doubt", fontsize=9)
    chart.set(xlabel=x_name, ylabel=y_name)
    apply_chart_style(chart)
    chart.grid(visible=False)
    figure = chart.get_figure()
    assert isinstance(figure, Figure)
    end = f"t = {chaos.t[-1]:g}"
    figure.colorbar(field, ax=chart, label=f"{format_axis_label(*_NAMES[name], unit)}, {end}")
    return chart


def _get_varied_axis_name_and_values(tops: Ensemble, dimension: int) -> tuple[str, Array]:
    """Return the name of a dimension, and its monotonic parameter values or else its indices."""
    name, n = tops.axes[dimension], tops.shape[dimension]
    values: Any = tops.coords.get(name)
    if values is not None and np.size(values) == n:
        flat = np.ravel(values).astype(np.float64)
        steps = np.diff(flat)
        if (steps > 0.0).all() or (steps < 0.0).all():
            return name.replace("_", " "), flat
    return name.replace("_", " "), np.arange(n, dtype=np.float64)


_NEAR = 1e-3  # largest difference of a line from a multiple, relative to the frequency of nutation
_DECADES = 0.5  # empty part of the scale below the weakest and above the strongest line


def draw_spectral_lines(spectrum: Any, axes: Axes | None, unit: str) -> Axes:
    """Plot the amplitude of each spectral line against its frequency, and return the axes."""
    chart = open_chart(axes, 6.4, 3.4)
    strengths = np.abs(spectrum.amplitudes)
    is_present = strengths > 0.0
    lines, strengths = spectrum.lines[is_present], strengths[is_present]
    chart.set(
        xlabel=format_axis_label("angular frequency", "T^-1", unit),
        ylabel="amplitude of the apex",
        yscale="log",
    )
    if len(lines):
        floor = 10.0 ** (math.floor(np.log10(strengths.min()) - _DECADES))
        chart.vlines(lines, floor, strengths, color=BLUE, linewidth=1.4)
        chart.plot(lines, strengths, "o", color=BLUE, markersize=4)
        chart.set_ylim(floor, strengths.max() * 10.0**_DECADES)
    if math.isfinite(spectrum.precession_rate):
        chart.axvline(
            spectrum.precession_rate, color=ORANGE, linewidth=1.0, linestyle="--", zorder=1
        )
        if spectrum.nutation > 0.0:
            multiples = (lines - spectrum.precession_rate) / spectrum.nutation
            for line, strength, k in zip(lines, strengths, multiples, strict=True):
                if abs(k - round(k)) < _NEAR:
                    chart.annotate(
                        f"{round(k):+d}" if round(k) else "0", (line, strength), xytext=(0, 4),
                        textcoords="offset points", ha="center", fontsize=7.5,
                    )  # fmt: skip
    title = f"{len(lines)} lines, rest {spectrum.rest:.0e}"
    if math.isfinite(spectrum.precession_rate):
        title += "; dashed: mean precession"
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
            frameon=False,
        )  # fmt: skip
    chart.scatter(x, y, c=colours, s=size, linewidths=0, rasterized=True)
    chart.set(xlabel=labels[0], ylabel=labels[1])
    apply_chart_style(chart)
    chart.grid(visible=False)
    return chart


_COLOURS = (BLUE, ORANGE, "#5a9e6f")
_WIDTH, _HEIGHT = 4.5, 4.5  # size of a column of two charts [inches]


def plot_fit_panels(panels: Sequence[Any]) -> FigureAxes:
    """Draw two charts per panel: one of measurements and fitted motion, and one of residuals.

    Each panel has the attributes name, t, values, residuals, sigma and motion. values and residuals
    have the shapes (n, j) and (n, k), where j > k for attitudes, and are NaN where nothing was
    measured. sigma broadcasts to the residuals. motion has times and values of the fitted motion
    that a line joins, or is None.
    """
    figure = Figure(figsize=(_WIDTH * len(panels), _HEIGHT), layout="constrained")
    axes: list[Axes] = []
    grid = figure.subplots(2, len(panels), sharex="col", squeeze=False, height_ratios=(2.0, 1.0))
    for (upper, lower), panel in zip(grid.T, panels, strict=True):
        for chart, columns in (upper, panel.values), (lower, panel.residuals):
            for k in range(columns.shape[1]):
                colour = _COLOURS[k % len(_COLOURS)]
                chart.plot(panel.t, columns[:, k], ".", ms=3, color=colour)
        if panel.motion is not None:
            t, motion = panel.motion
            for k in range(motion.shape[1]):
                upper.plot(t, motion[:, k], color="black", lw=0.8)
        elif panel.values.shape == panel.residuals.shape:
            upper.plot(panel.t, panel.values + panel.residuals * panel.sigma, "k.", ms=1.5)
        upper.set_title(panel.name)
        lower.axhline(0.0, color="black", lw=0.8)
        lower.set_xlabel(format_time_axis_label("T"))
        lower.set_ylabel("residual [sigma]")
        axes += [upper, lower]
    return FigureAxes(axes)
