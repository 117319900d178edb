"""False-colour images of a function of two variables."""

from .style import INK, STYLE, figure_to_svg, plt


def draw_field(values, extent, labels):
    """Draw a matrix of values, with the first row at the bottom.

    `extent` is (left, right, bottom, top). `labels` contains the labels of the two axes and of the
    colour bar.
    """
    xlabel, ylabel, of_values = labels
    with plt.rc_context(STYLE | {"axes.spines.top": True, "axes.spines.right": True}):
        figure, axes = plt.subplots(figsize=(6.4, 4.2), layout="constrained")
        image = axes.imshow(
            values,
            origin="lower",
            aspect="auto",
            extent=extent,
            cmap="viridis",
            interpolation="nearest",
        )
        axes.set(xlabel=xlabel, ylabel=ylabel)
        bar = figure.colorbar(image, ax=axes, label=of_values)
        bar.outline.set_edgecolor(INK)
        return figure_to_svg(figure)
