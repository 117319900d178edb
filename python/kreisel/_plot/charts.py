"""Charts of paths: the apex trace on a sphere, and nutation and precession over time."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING, NamedTuple, NoReturn

import numpy as np
import numpy.typing as npt

from .._model.scene import Scene
from .._model.turning_points import TurningPoints, compute_turning_points
from .._utils.html import render_figure_as_png
from .._utils.optional import optional_dependency
from .._utils.validation import Array, as_bool, as_unit_name, short_repr
from .dense_motion import DrawnMotion, PlottablePath, evaluate_densely
from .panels import apply_chart_style, format_time_axis_label
from .solids import (
    BLUE,
    FAINT,
    ORANGE,
    project_to_view,
    set_equal_scale_and_hide_frame,
    validate_axes_type,
)

with optional_dependency("'kreisel[plot]'"):
    import matplotlib
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D


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
    paths: Sequence[tuple[PlottablePath, PlottablePath | None]],
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
    path: PlottablePath,
    events: PlottablePath | None,
    angle: tuple[float, str],
    time: str,
) -> None:
    """Draw a path and its events, with angles in the given unit."""
    sphere, nutation_axes, precession_axes = axes
    unit, sign = angle
    limits = _turning_points_or_none(path.scene)
    heights = [] if limits is None else [np.cos(limits.least[0]), np.cos(limits.greatest[0])]
    drawn = evaluate_densely(path)
    shown = path[:1] if drawn.line is None else drawn.line
    draw_apex_trace(sphere, shown.apex, limits=heights)
    motion = path.scene.body.kind if limits is None else str(limits.motion_type[0])
    method = "closed form" if path.method == "exact" else path.method
    sphere.set_title(f"{motion} ({method})", fontsize=10)
    _draw_angles_over_time(nutation_axes, precession_axes, drawn.line, unit)
    for height in [] if limits is None else [limits.least[0], limits.greatest[0]]:
        nutation_axes.axhline(
            unit * float(height), color=ORANGE, linewidth=0.9, linestyle="--", zorder=1
        )
    if drawn.has_marks:
        _draw_dots(axes, path, drawn.line, unit, BLUE, 3.0)
    if events is not None:
        _draw_dots(axes, events, drawn.line, unit, ORANGE, 4.0)
    _draw_legend(sphere, bool(heights), events is not None, drawn)
    nutation_axes.set_ylabel(f"nutation [{sign}]")
    precession_axes.set(xlabel=time, ylabel=f"precession [{sign}]")
    _widen_narrow_axis(nutation_axes, unit)
    nutation_axes.tick_params(
        labelbottom=not nutation_axes.get_shared_x_axes().joined(nutation_axes, precession_axes)
    )
    for chart in nutation_axes, precession_axes:
        apply_chart_style(chart)


def _draw_angles_over_time(
    nutation_axes: Axes, precession_axes: Axes, line: PlottablePath | None, unit: float
) -> None:
    if line is None:
        return
    nutation_axes.plot(line.t, unit * line.nutation, color=BLUE, linewidth=1.2)
    precession = np.unwrap(line.precession_angle)
    precession_axes.plot(
        *_insert_gaps_at_jumps(line.t, unit * precession, _find_precession_jumps(precession)),
        color=BLUE,
        linewidth=1.2,
    )


def _draw_legend(sphere: Axes, has_limits: bool, has_events: bool, drawn: DrawnMotion) -> None:
    """Draw a legend below a sphere that explains its dots and dashed lines."""
    ink = matplotlib.rcParams["text.color"]
    dots = [("start", ink, 4.0)]
    if drawn.has_marks:
        dots.append(
            ("states" if drawn.line is not None else "states (motion not drawn)", BLUE, 3.0)
        )
    if has_events:
        dots.append(("events", ORANGE, 4.0))
    marks = [
        Line2D([], [], color=colour, marker="o", markersize=size, linestyle="", label=label)
        for label, colour, size in dots
    ]
    if has_limits:
        marks.append(Line2D([], [], color=ORANGE, linewidth=0.9, linestyle="--", label="limits"))
    sphere.legend(
        handles=marks, loc="upper center", bbox_to_anchor=(0.5, 0.0), ncols=4, fontsize=7.5,
        frameon=False, borderpad=0.0, handlelength=1.5, columnspacing=1.2,
    )  # fmt: skip


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


def _find_precession_jumps(precession: Array) -> npt.NDArray[np.intp]:
    """Find the time intervals in which the precession angle jumps, and return their indices.

    The precession angle jumps if the apex passes close to the vertical. A jump is a change by more
    than 0.5 rad and by more than 8 times the median change.
    """
    change = np.abs(np.diff(precession))
    median = float(np.median(change)) if len(change) else 0.0
    return np.flatnonzero(change > max(0.5, 8.0 * median))


def _insert_gaps_at_jumps(
    t: Array, values: Array, intervals: npt.NDArray[np.intp]
) -> tuple[Array, Array]:
    """Insert a NaN into each of the given intervals, so that drawn curves are interrupted there."""
    return np.insert(t, intervals + 1, np.nan), np.insert(values, intervals + 1, np.nan)


def _draw_dots(
    axes: Sequence[Axes],
    states: PlottablePath,
    line: PlottablePath | None,
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


def _turning_points_or_none(scene: Scene) -> TurningPoints | None:
    try:
        return compute_turning_points(scene)
    except ValueError:
        return None


def _widen_narrow_axis(chart: Axes, unit: float) -> None:
    """Widen the vertical range of a chart if the nutation is constant up to rounding errors."""
    low, high = chart.get_ylim()
    if high - low < 1e-6 * unit:
        middle, half = 0.5 * (low + high), 0.05 * unit
        chart.set_ylim(middle - half, middle + half)


def draw_unit_sphere(axes: Axes, elevation: float = 20.0) -> None:
    """Draw the outline of the unit sphere, its equator, and an upward arrow."""
    angle = np.linspace(0.0, 2.0 * np.pi, 200)
    axes.plot(np.cos(angle), np.sin(angle), color=FAINT, linewidth=0.8)
    _draw_circle_of_latitude(axes, 0.0, elevation, FAINT, "-")
    x, y, _ = project_to_view(np.array([[0.0, 0.0, 1.0], [0.0, 0.0, 1.25]]), elevation)
    axes.annotate("", (x[1], y[1]), (x[0], y[0]), arrowprops={"arrowstyle": "->", "color": FAINT})
    axes.set(xlim=(-1.05, 1.05), ylim=(-1.05, 1.3))


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
    draw_unit_sphere(axes, elevation)
    for height in limits:
        _draw_circle_of_latitude(axes, float(height), elevation, ORANGE, "--")
    x, y, depth = project_to_view(trace, elevation)
    axes.plot(x, y, color=BLUE, linewidth=0.5, alpha=0.4)
    axes.plot(x, np.where(depth > 0.0, y, np.nan), color=BLUE, linewidth=1.0)
    ink = matplotlib.rcParams["text.color"]
    is_behind = depth[0] < 0.0
    axes.plot(x[:1], y[:1], "o", color=ink, markersize=4, alpha=0.4 if is_behind else 1.0)
    set_equal_scale_and_hide_frame(axes)
