"""The figures, as SVG that takes its ink from the page around it, light or dark."""
import io

import matplotlib
matplotlib.use("svg")
import matplotlib.pyplot as plt     # noqa: E402  (after the choice of backend)
import numpy as np                  # noqa: E402

INK = "#010203"                     # stands for the page's own colour of text
FAINT = "#8c8c8c"
COLOURS = ("#2f7de1", "#e8710a", "#1a9e55", "#d9304f", "#9b59d0", "#12a5a8", "#b5850b", "#e05fb0", "#6f8f1d", "#7a86a8",
           "#5a4fd6", "#f0876a")
MARKERS = "os^vDPX<>*p"             # one fewer than colours: no look comes twice
PEERS = {"heyoka": {"color": INK, "linestyle": (0, (4, 2)), "marker": "o"},
         "scipy_dop853": {"color": FAINT, "linestyle": (0, (1, 1.5)), "marker": "s"},
         "gsl_rk8pd": {"color": "#8a6350", "linestyle": (0, (4, 2)), "marker": "D"},
         "gsl_bsimp": {"color": "#b08d3c", "linestyle": (0, (1, 1.5)), "marker": "^"}}
STYLE = {"svg.fonttype": "none", "font.size": 10, "font.family": "sans-serif", "axes.spines.top": False,
         "axes.spines.right": False,
         "axes.edgecolor": INK, "axes.labelcolor": INK, "text.color": INK, "xtick.color": INK, "ytick.color": INK,
         "grid.color": FAINT, "grid.alpha": .25, "savefig.transparent": True, "legend.frameon": False}


def looks(names):
    """Colour and marker of each name, the same in all figures; what is only compared with is broken and hollow."""
    own = [name for name in names if name not in PEERS]
    return {name: {"color": COLOURS[i % len(COLOURS)], "marker": MARKERS[i % len(MARKERS)], "linestyle": "-"}
            for i, name in enumerate(own)} | {name: {**look, "markerfacecolor": "none"} for name, look in PEERS.items()}


def as_svg(figure, **options):
    page = io.StringIO()
    figure.savefig(page, format="svg", metadata={"Date": None}, **options)
    plt.close(figure)
    svg = page.getvalue()
    return svg[svg.index("<svg"):].replace(INK, "currentColor")


def panel(entries, columns=3):
    """Axes of one size in all figures, with room for the legend below [inch]."""
    left, right, top, below, width, height = .75, .1, .1, .5, 5.4, 3.9
    legend = .15 + .2 * -(-entries // columns)
    total = height + legend
    figure = plt.figure(figsize=(width, total))
    axes = figure.add_axes((left / width, (below + legend) / total,
                            1 - (left + right) / width, (height - top - below) / total))
    return figure, axes, {"loc": "lower center", "bbox_to_anchor": (.5, 0), "ncols": columns, "fontsize": 9}


def powers(axis, ticks=12):
    """Ticks at powers of ten, as 1e-9: quick to draw, and as the tables have them."""
    axis.set_major_locator(matplotlib.ticker.LogLocator(numticks=ticks))
    axis.set_major_formatter(lambda x, _: f"{x:g}" if .001 < x < 1e4 else f"{x:.0e}".replace("e-0", "e-").replace("e+0", "e"))
    axis.set_minor_formatter(matplotlib.ticker.NullFormatter())


def error_against(groups, quantity, label, cost, look, floor=None):
    """One line a method, one point a run; `cost` is the run time or the number of evaluations."""
    def place(row):
        return 1e3 * row.seconds if cost == "seconds" else row.evaluations
    lines = {name: [(place(row), getattr(row, quantity)) for row in rows if not row.failure and getattr(row, cost)]
             for name, rows in groups.items()}
    with plt.rc_context(STYLE):
        figure, axes, legend = panel(len(lines))
        for name, points in lines.items():
            if points:
                x, y = zip(*points)
                axes.loglog(x, np.maximum(y, 1e-17), label=name, markersize=4.5, linewidth=1.3, **look[name])
        if floor:
            axes.axhline(floor, color=FAINT, linewidth=.8)
            axes.annotate("one rounding of the data", (1, floor), xycoords=("axes fraction", "data"),
                          ha="right", va="bottom", fontsize=8, color=FAINT)
        axes.set(xlabel="run time [ms]" if cost == "seconds" else "evaluations of the right-hand side or the torque",
                 ylabel=label)
        axes.set_ylim(top=min(10.0, axes.get_ylim()[1]))
        powers(axes.xaxis)
        powers(axes.yaxis)
        axes.grid(True)
        figure.legend(**legend)
        return as_svg(figure)


def distributions(errors, look):
    """What part of the tops has at most this error: one line a method."""
    with plt.rc_context(STYLE):
        figure, axes, legend = panel(len(errors))
        for name, sizes in errors.items():
            part = np.arange(1, len(sizes) + 1) / len(sizes)
            style = {key: value for key, value in look[name].items() if key in ("color", "linestyle")}
            axes.semilogx(np.maximum(sizes, 1e-17), part, label=name, linewidth=1.5, **style)
        axes.set(xlabel="attitude error at the end [rad]", ylabel="part of the tops with no more", ylim=(0, 1))
        powers(axes.xaxis, 9)
        axes.grid(True)
        figure.legend(**legend)
        return as_svg(figure)


def globe(axes, view):
    """The outline of the unit sphere, its equator and the vertical."""
    angle = np.linspace(0, 2 * np.pi, 200)
    axes.plot(np.cos(angle), np.sin(angle), color=FAINT, linewidth=.8)
    x, y, depth = view(np.stack([np.cos(angle), np.sin(angle), 0 * angle], -1))
    axes.plot(x, np.where(depth > 0, y, np.nan), color=FAINT, linewidth=.6)
    x, y, _ = view(np.array([[0, 0, 1], [0, 0, 1.25]]))
    axes.annotate("", (x[1], y[1]), (x[0], y[0]), arrowprops={"arrowstyle": "->", "color": FAINT})
    axes.annotate("up", (x[1], y[1]), ha="center", va="bottom", fontsize=9, color=FAINT)


def apex_path(apex, colour=COLOURS[0]):
    """Where the centre of mass goes, on the sphere about the fixed point, seen from a little above."""
    tilt = np.radians(20)

    def view(a):
        across, away, up = a[:, 0], a[:, 1], a[:, 2]
        return across, up * np.cos(tilt) + away * np.sin(tilt), up * np.sin(tilt) - away * np.cos(tilt)
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(figsize=(2.6, 2.6))
        globe(axes, view)
        x, y, depth = view(apex)
        axes.plot(x, y, color=colour, linewidth=.5, alpha=.4)
        axes.plot(x, np.where(depth > 0, y, np.nan), color=colour, linewidth=1)
        axes.plot(x[:1], y[:1], "o", color=INK, markersize=4)
        axes.set_aspect("equal")
        axes.axis("off")
        return as_svg(figure, bbox_inches="tight")
