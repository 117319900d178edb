"""The figures, as SVG that takes its ink from the page around it, light or dark."""

import io

import matplotlib

matplotlib.use("svg")
import matplotlib.pyplot as plt  # noqa: E402  (after the choice of backend)
import numpy as np  # noqa: E402

INK = "#010203"  # stands for the page's own colour of text
FAINT = "#8c8c8c"
COLOURS = ("#2f7de1", "#e8710a", "#1a9e55", "#d9304f", "#9b59d0", "#12a5a8", "#b5850b", "#e05fb0")
MARKERS = "os^vDPX<"
STYLE = {
    "svg.fonttype": "none",
    "font.size": 10,
    "font.family": "sans-serif",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.edgecolor": INK,
    "axes.labelcolor": INK,
    "text.color": INK,
    "xtick.color": INK,
    "ytick.color": INK,
    "grid.color": FAINT,
    "grid.alpha": 0.25,
    "savefig.transparent": True,
    "legend.frameon": False,
}


def as_svg(figure, **options):
    page = io.StringIO()
    figure.savefig(page, format="svg", metadata={"Date": None}, **options)
    plt.close(figure)
    svg = page.getvalue()
    return svg[svg.index("<svg") :].replace(INK, "currentColor")


def panel(height=3.1, width=4.9):
    """Axes with room for labels at their right [inch]."""
    left, right, top, below = 0.72, 1.35, 0.1, 0.5
    figure = plt.figure(figsize=(width, height))
    return figure, figure.add_axes(
        (left / width, below / height, 1 - (left + right) / width, 1 - (top + below) / height)
    )


def powers(axis, ticks=12):
    """Ticks at powers of ten, as 1e-9: quick to draw, and as the tables have them."""
    axis.set_major_locator(matplotlib.ticker.LogLocator(numticks=ticks))
    axis.set_major_formatter(
        lambda x, _: (
            f"{x:g}" if 0.001 < x < 1e4 else f"{x:.0e}".replace("e-0", "e-").replace("e+0", "e")
        )
    )
    axis.set_minor_formatter(matplotlib.ticker.NullFormatter())


def label_ends(axes, ends):
    """Names at the right of the axes, each led to the end of its line; pushed apart where they would overlap."""
    low, high = axes.get_ylim()
    gap = 11.5 / (
        72 * axes.get_position().height * axes.figure.get_figheight()
    )  # of the axes' height
    placed = sorted(
        (
            np.clip(
                (np.log10(y / low)) / np.log10(high / low) if axes.get_yscale() == "log" else y,
                0,
                1,
            ),
            x,
            y,
            name,
            colour,
        )
        for name, (x, y), colour in ends
    )
    heights = [place[0] for place in placed]
    for i in range(1, len(heights)):
        heights[i] = max(heights[i], heights[i - 1] + gap)
    over = max(0.0, heights[-1] - 1) if heights else 0.0
    for i in reversed(range(len(heights))):
        heights[i] = min(
            heights[i] - (over if i == len(heights) - 1 else 0.0),
            heights[i + 1] - gap if i + 1 < len(heights) else 1,
        )
    for height, (_, x, y, name, colour) in zip(heights, placed):
        inside = x, np.clip(y, low, high)
        axes.annotate(
            name,
            inside,
            xytext=(1.03, height),
            textcoords="axes fraction",
            color=colour,
            fontsize=9,
            va="center",
            annotation_clip=False,
            arrowprops={"arrowstyle": "-", "color": colour, "linewidth": 0.5, "alpha": 0.5},
        )


def looks(family, peers):
    """Colour and marker of each line of a panel; what is only compared with is in ink, broken and hollow."""
    own = [name for name in family if name not in peers]
    found = {
        name: {
            "color": COLOURS[i % len(COLOURS)],
            "marker": MARKERS[i % len(MARKERS)],
            "linestyle": "-",
        }
        for i, name in enumerate(own)
    }
    strokes = (
        ((0, (4, 2)), "o"),
        ((0, (1, 1.5)), "s"),
        ((0, (5, 1.5, 1, 1.5)), "D"),
        ((0, (2, 1)), "^"),
    )
    return found | {
        name: {"color": INK, "linestyle": stroke, "marker": marker, "markerfacecolor": "none"}
        for name, (stroke, marker) in zip(peers, strokes)
    }


def small_multiple(lines, family, peers, label, floor, limits, cost):
    """One family in colours with its names, the peers in ink, all others grey behind them: of several, one panel."""
    with plt.rc_context(STYLE):
        figure, axes = panel()
        shown = looks(family, peers)
        for name, points in lines.items():
            if name not in shown:
                axes.loglog(*points, color=FAINT, linewidth=0.8, alpha=0.45)
        for name, look in shown.items():
            if name in lines:
                axes.loglog(*lines[name], markersize=4, linewidth=1.4, **look)
        frame(axes, label, floor, limits, cost)
        label_ends(
            axes,
            [
                (name, best(lines[name]), look["color"])
                for name, look in shown.items()
                if name in lines
            ],
        )
        return as_svg(figure)


def best(points):
    """Where a line's smallest error is."""
    return min(zip(*points), key=lambda point: point[1])


def frame(axes, label, floor, limits, cost, ticks=8):
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
            fontsize=7,
            color=FAINT,
        )
    axes.set(xlabel=COSTS[cost], ylabel=label, xlim=limits[0], ylim=limits[1])
    powers(axes.xaxis, ticks)
    powers(axes.yaxis, 9)
    axes.grid(True)


COSTS = {"seconds": "run time [ms]", "evaluations": "evaluations of right-hand side or torque"}


def lines_of(groups, quantity, cost):
    """Cost and error of each run of each method, loose to tight; and the limits that hold them all."""

    def place(row):
        return 1e3 * row.seconds if cost == "seconds" else row.evaluations

    known = {
        name: [
            (place(row), max(getattr(row, quantity), 1e-17))
            for row in rows
            if not row.failure and getattr(row, cost)
        ]
        for name, rows in groups.items()
    }
    lines = {name: tuple(zip(*points)) for name, points in known.items() if points}
    x, y = ([value for points in lines.values() for value in points[i]] for i in (0, 1))
    return lines, (
        (min(x) / 1.5, max(x) * 1.5),
        (min(y) / 3, min(10.0, max(y) * 3)),
    ) if lines else None


def error_against(groups, families, quantity, label, cost, floor=None):
    """A panel a family; families: {title: (its methods, peers to show with them)}."""
    lines, limits = lines_of(groups, quantity, cost)
    for title, (family, peers) in families.items():
        if any(name in lines for name in family):
            yield title, small_multiple(lines, family, peers, label, floor, limits, cost)


def front(groups, families, quantity, label, cost, floor=None):
    """All in one panel, a colour a family; named are those that lead at some error, a closed form apart."""
    lines, limits = lines_of(groups, quantity, cost)
    if not lines:
        return ""
    colours = {
        name: COLOURS[i] for i, (family, _) in enumerate(families.values()) for name in family
    }
    racing = {
        name: points for name, points in lines.items() if name in colours and len(points[0]) > 1
    }
    leading = {
        min((x, name) for name, points in racing.items() for x, y in zip(*points) if y <= target)[1]
        for target in {y for points in racing.values() for y in points[1]}
    }
    with plt.rc_context(STYLE):
        figure, axes = panel(2.9, 3.9)
        for name, points in lines.items():
            ahead = name in leading
            axes.loglog(
                *points,
                color=colours.get(name, INK),
                linewidth=1.8 if ahead else 0.8,
                alpha=1 if ahead else 0.6,
                linestyle="-" if name in colours else (0, (4, 2)),
                marker="o" if len(points[0]) == 1 else None,
                markersize=4,
            )
        frame(axes, label, floor, limits, cost, 4)
        label_ends(
            axes,
            [
                (name, best(lines[name]), colours.get(name, INK))
                for name in lines
                if name in leading or name == "heyoka"
            ],
        )
        return as_svg(figure)


def distributions(errors, family, peers):
    """What part of the tops has at most this error: one line a method, one family in colours."""
    with plt.rc_context(STYLE):
        figure, axes = panel()
        shown = looks(family, peers)
        for name, sizes in errors.items():
            part = np.arange(1, len(sizes) + 1) / len(sizes)
            style = {
                key: value
                for key, value in shown.get(name, {}).items()
                if key in ("color", "linestyle")
            }
            axes.semilogx(
                np.maximum(sizes, 1e-17),
                part,
                **(style or {"color": FAINT, "alpha": 0.45}),
                linewidth=1.5 if style else 0.8,
            )
        axes.set(
            xlabel="attitude error at the end [rad]",
            ylabel="part of the tops with no more",
            ylim=(0, 1),
            xlim=(3e-18, 10),
        )
        powers(axes.xaxis, 7)
        axes.grid(True)
        ends = sorted(
            (float(np.quantile(np.maximum(errors[name], 1e-17), 0.97)), name)
            for name in shown
            if name in errors
        )
        label_ends(
            axes,
            [
                (name, (x, 0.97 - 0.001 * i), shown[name]["color"])
                for i, (x, name) in enumerate(ends)
            ],
        )
        return as_svg(figure)


def kinds(lines):
    """A colour for each kind of method."""
    return dict(zip(dict.fromkeys(line["kind"] for line in lines), COLOURS))


def watched(lines):
    """Attitude and energy error in the course of the stiff run: two panels, a colour a kind of method."""
    colours = kinds(lines)
    for quantity, label in (
        ("attitude", "attitude error [rad]"),
        ("energy", "energy error, relative"),
    ):
        with plt.rc_context(STYLE):
            figure, axes = panel(4.2)
            known = [line for line in lines if len(line["t"]) > 1]
            for line in known:
                axes.semilogy(
                    line["t"][1:],
                    np.maximum(line[quantity][1:], 1e-17),
                    color=colours[line["kind"]],
                    linewidth=1.2,
                )
            axes.set(xlabel="time; a turn of the precession is 2 pi", ylabel=label)
            axes.set_ylim(1e-17, 10)
            powers(axes.yaxis, 9)
            axes.grid(True)
            label_ends(
                axes,
                [
                    (
                        line["method"],
                        (line["t"][-1], max(line[quantity][-1], 1e-17)),
                        colours[line["kind"]],
                    )
                    for line in known
                ],
            )
            yield {"label": label, "svg": as_svg(figure)}


def globe(axes, view):
    """The outline of the unit sphere, its equator and the vertical."""
    angle = np.linspace(0, 2 * np.pi, 200)
    axes.plot(np.cos(angle), np.sin(angle), color=FAINT, linewidth=0.8)
    x, y, depth = view(np.stack([np.cos(angle), np.sin(angle), 0 * angle], -1))
    axes.plot(x, np.where(depth > 0, y, np.nan), color=FAINT, linewidth=0.6)
    x, y, _ = view(np.array([[0, 0, 1], [0, 0, 1.25]]))
    axes.annotate("", (x[1], y[1]), (x[0], y[0]), arrowprops={"arrowstyle": "->", "color": FAINT})
    axes.annotate("up", (x[1], y[1]), ha="center", va="bottom", fontsize=9, color=FAINT)


def apex_path(apex, colour=COLOURS[0]):
    """Where the centre of mass goes, on the sphere about the fixed point, seen from a little above."""
    tilt = np.radians(20)

    def view(a):
        across, away, up = a[:, 0], a[:, 1], a[:, 2]
        return (
            across,
            up * np.cos(tilt) + away * np.sin(tilt),
            up * np.sin(tilt) - away * np.cos(tilt),
        )

    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(figsize=(2.6, 2.6))
        globe(axes, view)
        x, y, depth = view(apex)
        axes.plot(x, y, color=colour, linewidth=0.5, alpha=0.4)
        axes.plot(x, np.where(depth > 0, y, np.nan), color=colour, linewidth=1)
        axes.plot(x[:1], y[:1], "o", color=INK, markersize=4)
        axes.set_aspect("equal")
        axes.axis("off")
        return as_svg(figure, bbox_inches="tight")
