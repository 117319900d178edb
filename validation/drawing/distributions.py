"""Plots of cumulative error distributions, with one curve for each method."""

import numpy as np

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

LEAST, NAMED_AT = 1e-17, 0.97  # value drawn for an error of zero; height of the names


def draw_distributions(errors, family, peers):
    """Draw the error distributions of a group in colour, of peers in dashes, of others in grey.

    `errors` maps each method to a sorted list of errors.
    """
    with plt.rc_context(STYLE):
        figure, axes = make_panel()
        styles = choose_line_styles(family, peers)
        for name, sizes in errors.items():
            part = np.arange(1, len(sizes) + 1) / len(sizes)
            base_style = styles.get(name, {})
            style = base_style and {"markersize": 4, "markevery": 0.25} | base_style
            axes.semilogx(
                np.maximum(sizes, LEAST),
                part,
                **(style or {"color": FAINT, "alpha": 0.45}),
                linewidth=1.5 if style else 0.8,
            )
        axes.set(
            xlabel="attitude error at the end [rad]",
            ylabel="fraction of tops with at most this error",
            ylim=(0, 1),
            xlim=(3e-18, 10),
        )
        set_power_ticks(axes.xaxis, 7)
        axes.grid(True)
        label_ends(axes, label_positions(errors, styles))
        return figure_to_svg(figure)


def label_positions(errors, styles):
    """Return the names, positions and styles of the curve labels, in order of increasing error."""
    ends = sorted(
        (float(np.quantile(np.maximum(errors[name], LEAST), NAMED_AT)), name)
        for name in styles
        if name in errors
    )
    return [(name, (x, NAMED_AT - 0.001 * i), styles[name]) for i, (x, name) in enumerate(ends)]
