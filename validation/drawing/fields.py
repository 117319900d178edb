"""Poincare sections, fields of two variables, and measured points beside theory."""

import numpy as np

from .style import COLOURS, FAINT, INK, as_svg, plt

PI = "\N{GREEK SMALL LETTER PI}"
TURN = [-np.pi, 0.0, np.pi], [f"\N{MINUS SIGN}{PI}", "0", PI]


def make_panels(rows=1, columns=1, size=(4.9, 3.6), **more):
    """Create a figure whose panels have frames."""
    words = {"figsize": size, "layout": "constrained", "squeeze": False} | more
    figure, axes = plt.subplots(rows, columns, **words)
    for one in axes.flat:
        one.spines[:].set_visible(True)
    return figure, axes.flat


def draw_dots(axes, x, y, colour, title):
    axes.scatter(x, y, c=colour, s=0.45, linewidths=0, rasterized=True, alpha=0.9)
    axes.set(title=title, xlim=(-np.pi, np.pi))
    axes.set_xticks(*TURN)


@as_svg
def draw_field(values, extent, labels):
    """Draw a matrix of values, with the first row at the bottom.

    `extent` is (left, right, bottom, top). `labels` contains the labels of the two axes and of the
    colour bar.
    """
    figure, (axes,) = make_panels(size=(6.4, 4.2))
    image = axes.imshow(values, origin="lower", aspect="auto", extent=extent)
    axes.set(xlabel=labels[0], ylabel=labels[1])
    figure.colorbar(image, ax=axes, label=labels[2])
    return figure


@as_svg
def draw_sections(panels, columns, height):
    """Draw Poincare sections; `panels` maps titles to the coordinates and colours of points."""
    rows = -(-len(panels) // columns)
    figure, all_axes = make_panels(rows, columns, (10.2, height * rows))
    for axes, (title, panel) in zip(all_axes, panels.items(), strict=True):
        draw_dots(axes, *panel, title)
    figure.supxlabel("spin angle")
    figure.supylabel("axial momentum")
    return figure


@as_svg
def draw_section_and_rotation(panel, title, rotation):
    """Draw a Poincare section beside a plot of the rotation number of each orbit."""
    axial, turns, change = rotation
    figure, (left, right) = make_panels(1, 2, (10.2, 4.6), sharey=True)
    draw_dots(left, *panel, title)
    left.set(xlabel="spin angle", ylabel="axial momentum")
    colour = np.log10(np.maximum(change, 1e-12))
    points = right.scatter(turns, axial, c=colour, s=9, linewidths=0)
    right.set(xlabel="turns about the vertical between lowest points, less whole turns")
    figure.colorbar(points, ax=right, label="change between both halves of the time, log10")
    return figure


@as_svg
def draw_regions(borders, points, greatest, highest, close):
    """Draw numbered points in the plane of vertical momentum and energy.

    `close` contains two opposite corners of the rectangle that is shown enlarged in an inset.
    """
    figure, (axes,) = make_panels(size=(4.9, 4.6))
    inset = axes.inset_axes((0.5, 0.03, 0.48, 0.44))
    for g, h in borders:
        axes.plot(g, h, color=INK, linewidth=0.8)
        inset.plot(g, h, color=INK, linewidth=0.8)
    (left, low), (right, high) = close
    for number, (g, h) in enumerate(points, 1):
        panel = inset if left < g < right and low < h < high else axes
        panel.plot(g, h, ".", color=COLOURS[1])
        panel.annotate(f"{number}", (g, h), xytext=(3, 2), textcoords="offset points")
    inset.set(xlim=(left, right), ylim=(low, high), xticks=[], yticks=[])
    axes.indicate_inset_zoom(inset, edgecolor=FAINT)
    axes.set(xlim=(0.0, greatest), ylim=(-1.1, highest))
    axes.set(xlabel="vertical momentum g", ylabel="energy h")
    return figure


@as_svg
def draw_kicks(kicks, amplitude):
    """Plot measured and predicted changes of the axial momentum during one swing.

    `kicks` maps each label to spin angles and changes, divided by the size of the perturbation.
    """
    turn = np.linspace(-np.pi, np.pi, 400)
    figure, (axes,) = make_panels()
    for colour, (name, (angles, changes)) in zip(COLOURS, kicks.items(), strict=False):
        dots = {"color": colour, "markersize": 1.5, "rasterized": True, "label": name}
        axes.plot(angles, changes, ".", **dots)
    axes.plot(turn, amplitude * np.sin(2.0 * turn), color=INK, linewidth=1, label="Melnikov")
    axes.set_xticks(*TURN)
    axes.set(xlabel="spin angle at the lowest point", ylabel="change per swing, over e")
    axes.legend(markerscale=4, loc="upper right")
    return figure


@as_svg
def draw_widths(e, measured, predicted):
    """Draw the measured and the predicted half width of the chaotic layer."""
    figure, (axes,) = make_panels()
    axes.loglog(e, np.array(e) * predicted, color=INK, linewidth=1, label="Melnikov, Chirikov")
    axes.loglog(e, measured, "o", color=COLOURS[0], markersize=6, label="measured")
    axes.set(xlabel="e, relative difference of the equal moments")
    axes.set_ylabel("half width of the layer")
    axes.legend(loc="upper left")
    axes.grid(True)
    return figure
