"""The picture in README.md: the motion of the thesis' top, exact and by bobenko_suris.

The steps of bobenko_suris are 0.4.

python -m validation.report.readme_picture [validation/report/picture.svg]
"""

import sys
from pathlib import Path

import kreisel as kr
import numpy as np

from ..drawing.sphere_plots import draw_outline, project
from ..drawing.style import COLOURS, INK, STYLE, figure_to_svg, plt

STEP, SPAN = 0.4, 44.0
TARGET = Path(__file__).with_name("picture.svg")


def draw_sphere(axes, true, steps):
    draw_outline(axes)
    axes.plot(*project(true.apex)[:2], color=COLOURS[0], linewidth=1)
    axes.plot(*project(steps.apex)[:2], "o", color=COLOURS[1], markersize=2.2)
    axes.set_aspect("equal")
    axes.axis("off")
    axes.set_title("path of the axis", fontsize=10)


def draw_energy(axes, steps):
    modified = steps.modified_energy(STEP)
    axes.plot(steps.t, steps.energy - steps.energy[0], color=COLOURS[1], label="energy")
    axes.plot(steps.t, modified - modified[0], color=INK, label="modified energy")
    axes.set(xlabel="time", title=f"bobenko_suris, step {STEP}: change since the start")
    axes.title.set_fontsize(10)
    axes.legend(loc="upper right", ncols=2)


def draw_picture(target=TARGET):
    scene = kr.scenes.thesis
    true = kr.solve(scene, np.linspace(0, SPAN, 2000))
    steps = kr.solve(scene, SPAN, method="bobenko_suris", step=STEP, every=1)
    with plt.rc_context(STYLE):
        figure, (sphere, energy) = plt.subplots(1, 2, figsize=(8, 3.2), width_ratios=(3, 5))
        draw_sphere(sphere, true, steps)
        draw_energy(energy, steps)
        figure.tight_layout()
        text = figure_to_svg(figure).replace(
            "currentColor", "#777777"
        )  # a colour that is readable on light and on dark backgrounds
    Path(target).write_text(text)


if __name__ == "__main__":
    draw_picture(*sys.argv[1:])
