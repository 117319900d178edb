"""What part of many tops comes out with at most an error: a line for each method."""

import numpy as np

from .style import FAINT, STYLE, as_svg, label_ends, line_styles, panel, plt, powers

LEAST, NAMED_AT = 1e-17, 0.97  # what errors of zero are drawn at; where a line's name stands


def distributions(errors, family, peers):
    """Draws one family in colours, all others grey. `errors`: {method: its errors, sorted}."""
    with plt.rc_context(STYLE):
        figure, axes = panel()
        styles = line_styles(family, peers)
        for name, sizes in errors.items():
            part = np.arange(1, len(sizes) + 1) / len(sizes)
            known = styles.get(name, {})
            style = known and {"markersize": 4, "markevery": 0.25} | known
            axes.semilogx(
                np.maximum(sizes, LEAST),
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
        label_ends(axes, named_ends(errors, styles))
        return as_svg(figure)


def named_ends(errors, styles):
    """Gives where the names are led to, from the least error on, each a little lower."""
    ends = sorted(
        (float(np.quantile(np.maximum(errors[name], LEAST), NAMED_AT)), name)
        for name in styles
        if name in errors
    )
    return [(name, (x, NAMED_AT - 0.001 * i), styles[name]) for i, (x, name) in enumerate(ends)]
