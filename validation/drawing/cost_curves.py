"""Plots of error against computational cost, for all methods or for groups of methods."""

from .style import (
    FAINT,
    STYLE,
    choose_line_styles,
    figure_to_svg,
    label_ends,
    make_panel,
    plt,
    set_power_ticks,
)

COSTS = {"seconds": "run time [ms]", "evaluations": "evaluations of right-hand side or torque"}
LEAST = 1e-17  # value drawn for an error of zero


def collect_lines(groups, quantity, cost):
    """Return the costs and the errors of each method, and the limits of the axes.

    If there are no measurements, an empty dictionary and None are returned.
    """

    def cost_and_error(row):
        return 1e3 * row.seconds if cost == "seconds" else row.evaluations

    points_by_name = {
        name: [
            (cost_and_error(row), max(getattr(row, quantity), LEAST))
            for row in rows
            if not row.failure and getattr(row, cost)
        ]
        for name, rows in groups.items()
    }
    lines = {
        name: tuple(zip(*points, strict=True)) for name, points in points_by_name.items() if points
    }
    if not lines:
        return lines, None
    x, y = ([value for points in lines.values() for value in points[i]] for i in (0, 1))
    return lines, ((min(x) / 1.5, max(x) * 1.5), (min(y) / 3, min(10.0, max(y) * 3)))


def lowest_point(points):
    """Return the point of a cost curve at which the error is smallest."""
    return min(zip(*points, strict=True), key=lambda point: point[1])


def set_frame(axes, label, floor, limits, cost, ticks=8):
    if floor:
        axes.axhline(floor, color=FAINT, linewidth=0.8)
        axes.annotate(
            "one rounding of the data",
            (0, floor),
            xycoords=("axes fraction", "data"),
            xytext=(3, 0),
            textcoords="offset points",
            ha="left",
            va="top",
            color=FAINT,
        )
    axes.set(xlabel=COSTS[cost], ylabel=label, xlim=limits[0], ylim=limits[1])
    set_power_ticks(axes.xaxis, ticks)
    set_power_ticks(axes.yaxis, 9)
    axes.grid(True)


def make_log_panel(*size):
    figure, axes = make_panel(*size)
    axes.set(xscale="log", yscale="log")
    return figure, axes


def draw_family(lines, family, peers, label, floor, limits, cost):
    """Draw a group of methods in colour, other integrators dashed, and other methods in grey."""
    with plt.rc_context(STYLE):
        figure, axes = make_log_panel()
        styles = choose_line_styles(family, peers)
        for name, points in lines.items():
            if name not in styles:
                axes.plot(*points, color=FAINT, linewidth=0.8, alpha=0.45)
        styles_by_name = {name: style for name, style in styles.items() if name in lines}
        for name, style in styles_by_name.items():
            axes.plot(*lines[name], markersize=4, linewidth=1.4, **style)
        set_frame(axes, label, floor, limits, cost)
        label_ends(
            axes,
            [(name, lowest_point(lines[name]), style) for name, style in styles_by_name.items()],
        )
        return figure_to_svg(figure)


def draw_families(groups, families, quantity, label, cost, floor=None):
    """Yield the title and the figure of each group of methods that has measurements."""
    lines, limits = collect_lines(groups, quantity, cost)
    for title, (family, peers) in families.items():
        if any(name in lines for name in family):
            yield title, draw_family(lines, family, peers, label, floor, limits, cost)


def find_leaders(lines):
    """Return the methods that are fastest for at least one target error."""
    errors = {y for points in lines.values() for y in points[1]}
    return {
        min(
            (x, name)
            for name, points in lines.items()
            for x, y in zip(*points, strict=True)
            if y <= target
        )[1]
        for target in errors
    }


def select_leaders(groups, methods, quantities_and_costs):
    """Return the fastest methods that are not closed forms."""
    leaders = set()
    for quantity, cost in quantities_and_costs:
        lines, _ = collect_lines(groups, quantity, cost)
        leaders |= find_leaders(
            {name: lines[name] for name in methods if name in lines and len(lines[name][0]) > 1}
        )
    return [name for name in methods if name in leaders]


def draw_overview(groups, leaders, peers, quantity, label, cost, floor=None):
    """Draw the curves of all methods in one panel, highlighting the methods in `leaders`.

    The list `leaders` determines the colour and the marker of each method in it.
    """
    lines, limits = collect_lines(groups, quantity, cost)
    if not lines:
        return ""
    styles = choose_line_styles(leaders, peers)
    with plt.rc_context(STYLE):
        figure, axes = make_log_panel(2.7, 4.6)
        for name, points in lines.items():
            if name in styles:
                axes.plot(*points, markersize=4, linewidth=1.4, **styles[name])
            else:
                dot = "o" if len(points[0]) == 1 else None  # a closed form has a single run
                axes.plot(*points, color=FAINT, linewidth=0.8, alpha=0.45, marker=dot, markersize=4)
        set_frame(axes, label, floor, limits, cost, 4)
        ends = [(name, lowest_point(lines[name]), styles[name]) for name in styles if name in lines]
        label_ends(axes, ends)
        return figure_to_svg(figure)
