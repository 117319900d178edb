"""Plots of throughput in tops per second against error, with one curve for each integrator."""

from statistics import median

from .style import (
    STYLE,
    choose_line_styles,
    figure_to_svg,
    label_ends,
    make_panel,
    plt,
    set_power_ticks,
)

LEAST = 1e-17  # value drawn for an error of zero


def draw_throughput(groups, own):
    """Draw the curves of kreisel in colour, and those of other integrators in the text colour.

    `groups` maps the name of each integrator to a list of runs.
    """
    lines = {
        name: tuple(
            zip(*((1 / median(run.seconds), max(run.middle, LEAST)) for run in runs), strict=True)
        )
        for name, runs in groups.items()
    }
    with plt.rc_context(STYLE):
        figure, axes = make_panel(3.6, 6.4)
        styles = choose_line_styles(own, [name for name in lines if name not in own])
        for name, points in lines.items():
            axes.loglog(*points, markersize=4, linewidth=1.4, **styles[name])
        axes.set(xlabel="tops per second", ylabel="median attitude error [rad]")
        set_power_ticks(axes.xaxis)
        set_power_ticks(axes.yaxis, 9)
        axes.grid(True)
        ends = [
            (name, (points[0][-1], points[1][-1]), styles[name]) for name, points in lines.items()
        ]
        label_ends(axes, ends)
        return figure_to_svg(figure)
