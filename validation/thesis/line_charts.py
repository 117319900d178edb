"""Line charts and other plane figures in the style of the report."""

import numpy as np

from ..drawing.style import COLOURS, DASHES, FAINT, INK, as_svg, plt

BLUE, ORANGE, GREEN, RED, PURPLE, CYAN, OCHRE = COLOURS[:7]
# colours of the four tops of section 6.1.1
TOPS = {"red": RED, "blue": BLUE, "yellow": OCHRE, "green": GREEN}
IMPROVED = {"bobenko_suris": PURPLE, "bobenko_suris4": CYAN, "takahashi_imada4": ORANGE}


def thin_out(t, values, points=500):
    """Keep only the smallest and the largest value of a curve in each of many short intervals."""
    n = len(t)
    if n <= 2 * points:
        return t, values
    indices = [0, n - 1]
    for part in np.array_split(np.arange(n), points):
        indices += [part[np.argmin(values[part])], part[np.argmax(values[part])]]
    indices = np.unique(indices)
    return t[indices], values[indices]


def make_axes(size=(5.4, 3.1), **labels):
    figure, axes = plt.subplots(figsize=size, layout="constrained")
    axes.set(**labels)
    axes.grid(True)
    return figure, axes


@as_svg
def draw_lines(series, ylabel, log=False, xlabel="time", floor=None):
    """Plot several curves, each given as a tuple (label, t, values, colour, style)."""
    figure, axes = make_axes(xlabel=xlabel, ylabel=ylabel)
    for label, t, values, colour, style in series:
        x, y = thin_out(t, np.abs(values) if log else values)
        if log:
            x, y = x[y > 0], y[y > 0]
        axes.plot(x, y, style, color=colour, linewidth=1.1, markersize=6, label=label)
    if log:
        axes.set_yscale("log")
    if floor is not None:
        axes.axhline(floor, color=FAINT, linewidth=0.8, linestyle=DASHES)
    figure.legend(loc="outside lower center", ncols=2 if len(series) > 3 else 3)
    return figure


@as_svg
def draw_scatter(groups, xlabel, ylabel):
    """Plot groups of points, given as tuples (label, x, y, colour, marker), on logarithmic axes."""
    figure, axes = make_axes(xlabel=xlabel, ylabel=ylabel, xscale="log", yscale="log")
    for label, x, y, colour, marker in groups:
        axes.plot(x, y, marker, color=colour, markersize=5, linewidth=1.2, label=label)
    figure.legend(loc="outside lower center", ncols=3)
    return figure


@as_svg
def draw_two_scales(t, left, right, labels, colours):
    """Plot two functions of time, each with its own vertical axis."""
    figure, axes = make_axes(xlabel="time")
    other = axes.twinx()
    other.spines["right"].set_visible(True)
    for ax, values, label, colour in zip(
        (axes, other), (left, right), labels, colours, strict=True
    ):
        ax.plot(*thin_out(t, values), color=colour, linewidth=1.1)
        ax.set_ylabel(label, color=colour)
    return figure


@as_svg
def draw_geodesic():
    """Draw figure 6.5, which shows a sphere and the shorter geodesic between two points."""
    angle, end = np.linspace(0, 2 * np.pi, 200), 1.1
    arc = np.linspace(0, end, 40)
    x, y = 0.8 * np.sin(end), np.cos(end)
    figure, axes = plt.subplots(figsize=(3.2, 3.2), layout="constrained")
    axes.plot(np.cos(angle), np.sin(angle), color=FAINT, linewidth=0.8)
    axes.plot(np.cos(angle), 0.3 * np.sin(angle), color=FAINT, linewidth=0.6)
    axes.plot(0.8 * np.sin(arc), np.cos(arc), color=BLUE, linewidth=2)
    axes.plot([x, -x], [y, -y], ":", color=FAINT, linewidth=1)
    for point, text, offset, ha in (
        ((0, 1), "N = Id", (0, 7), "center"),
        ((x, y), "E", (9, 0), "left"),
        ((-x, -y), "\N{MINUS SIGN}E", (-16, -4), "left"),
    ):
        axes.plot(*point, "o", color=INK)
        axes.annotate(text, point, xytext=offset, textcoords="offset points", ha=ha)
    middle = 0.8 * np.sin(end / 2), np.cos(end / 2)
    axes.annotate("L(E)", middle, xytext=(6, 4), textcoords="offset points", color=BLUE)
    axes.set_aspect("equal")
    axes.axis("off")
    return figure


@as_svg
def draw_timer(stop=2.0):
    """Draw figure 5.12, which shows two step sizes with a common final time."""
    figure, axes = plt.subplots(figsize=(5.4, 1.5), layout="constrained")
    for y, eps, colour, number in ((1, 0.2, RED, 1), (0, 0.5, BLUE, 2)):
        t = np.arange(round(stop / eps) + 1) * eps
        axes.plot(t, 0 * t + y, "o-", color=colour, markersize=6, linewidth=1)
        text = f"\N{GREEK SMALL LETTER EPSILON}{number} = {eps:g}"
        axes.annotate(text, (-0.06, y), ha="right", va="center", color=colour)
    axes.axvline(stop, color=FAINT, linestyle=DASHES)
    axes.annotate("stoptime", (stop, 1.45), ha="center", color=FAINT, annotation_clip=False)
    axes.set(yticks=[], xlabel="time", ylim=(-0.5, 1.4), xlim=(-0.5, stop + 0.2))
    axes.spines["left"].set_visible(False)
    return figure
