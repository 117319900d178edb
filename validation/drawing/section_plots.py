"""Plots of Poincare sections, and of curves together with measured points.

The points of sections and of swings are embedded as images because of their large number.
"""

import numpy as np

from .style import COLOURS, FAINT, INK, STYLE, figure_to_svg, plt

FRAMED = STYLE | {"axes.spines.top": True, "axes.spines.right": True, "savefig.dpi": 140}
TURN = (
    [-np.pi, 0.0, np.pi],
    ["\N{MINUS SIGN}\N{GREEK SMALL LETTER PI}", "0", "\N{GREEK SMALL LETTER PI}"],
)


def make_panels(rows, columns, height, **more):
    """Create a figure that is as wide as the page."""
    figure, axes = plt.subplots(
        rows, columns, figsize=(10.2, height * rows), layout="constrained", squeeze=False, **more
    )
    return figure, axes.flat


def draw_dots(axes, x, y, colour, title, size=0.45):
    axes.scatter(x, y, c=colour, s=size, cmap="viridis", linewidths=0, rasterized=True, alpha=0.9)
    axes.set_title(title)
    axes.set_xticks(*TURN)
    axes.set_xlim(-np.pi, np.pi)
    axes.tick_params(color=FAINT)


def draw_sections(panels, columns, height):
    """Draw several Poincare sections, one per panel.

    `panels` maps a title to the coordinates and the colours of the points.
    """
    with plt.rc_context(FRAMED):
        rows = -(-len(panels) // columns)
        figure, all_axes = make_panels(rows, columns, height)
        for axes, (title, panel) in zip(all_axes, panels.items(), strict=True):
            draw_dots(axes, *panel, title)
        figure.supxlabel("spin angle")
        figure.supylabel("axial momentum")
        return figure_to_svg(figure)


def draw_section_and_rotation(panel, title, rotation):
    """Draw a Poincare section beside a plot of the rotation number of each orbit."""
    axial, turns, change = rotation
    with plt.rc_context(FRAMED):
        figure, (left, right) = make_panels(1, 2, 4.6, sharey=True)
        draw_dots(left, *panel, title)
        left.set(xlabel="spin angle", ylabel="axial momentum")
        points = right.scatter(
            turns, axial, c=np.log10(np.maximum(change, 1e-12)), s=9, cmap="viridis", linewidths=0
        )
        right.set(xlabel="turns about the vertical between lowest points, less whole turns")
        bar = figure.colorbar(
            points, ax=right, label="change between both halves of the time, log10"
        )
        bar.outline.set_edgecolor(INK)
        return figure_to_svg(figure)


def draw_regions(borders, points, greatest, highest, close):
    """Draw numbered points in the plane of vertical momentum and energy.

    `close` contains two opposite corners of the rectangle that is shown enlarged in an inset.
    """
    with plt.rc_context(FRAMED):
        figure, axes = plt.subplots(figsize=(4.9, 4.6), layout="constrained")
        inset = axes.inset_axes((0.5, 0.03, 0.48, 0.44))
        for g, h in borders:
            axes.plot(g, h, color=INK, linewidth=0.8)
            inset.plot(g, h, color=INK, linewidth=0.8)
        (left, low), (right, high) = close
        for number, (g, h) in enumerate(points, 1):
            panel = inset if left < g < right and low < h < high else axes
            panel.plot(g, h, ".", color=COLOURS[1], markersize=4)
            panel.annotate(f"{number}", (g, h), xytext=(3, 2), textcoords="offset points")
        inset.set(xlim=(left, right), ylim=(low, high), xticks=[], yticks=[])
        axes.indicate_inset_zoom(inset, edgecolor=FAINT)
        axes.set(xlim=(0.0, greatest), ylim=(-1.1, highest))
        axes.set(xlabel="vertical momentum g", ylabel="energy h")
        return figure_to_svg(figure)


def draw_kicks(angles, changes, amplitude):
    """Plot measured and predicted changes of the axial momentum during one swing.

    `changes` maps each label to the changes of the momentum, divided by the size of the
    perturbation.
    """
    turn = np.linspace(-np.pi, np.pi, 400)
    with plt.rc_context(FRAMED):
        figure, axes = plt.subplots(figsize=(4.9, 3.6), layout="constrained")
        for colour, (name, change) in zip(COLOURS[:2], changes.items(), strict=True):
            axes.plot(
                angles[name], change, ".", color=colour, markersize=1.5, rasterized=True, label=name
            )
        axes.plot(turn, amplitude * np.sin(2.0 * turn), color=INK, linewidth=1, label="Melnikov")
        axes.set_xticks(*TURN)
        axes.set(xlabel="spin angle at the lowest point", ylabel="change per swing, over e")
        axes.legend(markerscale=4, loc="upper right")
        return figure_to_svg(figure)


def draw_widths(e, measured, predicted):
    """Draw the measured and the predicted half width of the chaotic layer."""
    with plt.rc_context(FRAMED):
        figure, axes = plt.subplots(figsize=(4.9, 3.6), layout="constrained")
        axes.loglog(e, np.array(e) * predicted, color=INK, linewidth=1, label="Melnikov, Chirikov")
        axes.loglog(e, measured, "o", color=COLOURS[0], label="measured")
        axes.set(
            xlabel="e, relative difference of the equal moments", ylabel="half width of the layer"
        )
        axes.legend(loc="upper left")
        axes.grid(True)
        return figure_to_svg(figure)
