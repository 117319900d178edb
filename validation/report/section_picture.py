"""A figure for docs/theory/tangents.md that shows Poincare sections of regular and chaotic motions.

All tops have the same body, energy and vertical momentum. Each point marks a lowest position of the
apex, and its colour shows whether the motion is chaotic. Each panel shows a different value of
gravity.

    python -m validation.report.section_picture [validation/report/section.png]
"""

import sys
from pathlib import Path

import kreisel as kr
from kreisel._plot.panels import CLASSES
from matplotlib.lines import Line2D

from ..drawing.style import plt

BODY = kr.Body.cuboid(half=(1.0, 0.7, 0.4), pivot=(0.0, 0.0, -0.4), mass=1.0)
GRAVITIES = (0.05, 2.0, 4.0)
TIME = 3000.0  # length of the motions whose verdict is shown
TARGET = Path(__file__).with_name("section.png")


def compute_sections(tops=80, points=800):
    """Compute the Poincare sections for each value of gravity."""
    sections = {}
    for gravity in GRAVITIES:
        starts = kr.starts(BODY, energy=2.0, vertical=1.0, n=tops, seed=3, gravity=gravity)
        sections[gravity] = kr.section(starts, n=points)
    return sections


def draw_sections(sections, target=TARGET):
    with plt.rc_context({"font.size": 9, "savefig.dpi": 110}):
        figure, axes = plt.subplots(
            1, len(sections), figsize=(8.0, 3.2), sharex=True, sharey=True, layout="constrained"
        )
        for chart, (gravity, cuts) in zip(axes, sections.items(), strict=True):
            cuts.plot(chart, indicator=kr.megno(cuts.tops, TIME))
            chart.get_legend().remove()
            chart.set_title(f"gravity {gravity}")
        for chart in axes[1:]:
            chart.set_ylabel("")
        names, colours = zip(*CLASSES, strict=True)
        marks = [Line2D([], [], color=colour, marker="o", linestyle="") for colour in colours]
        figure.legend(marks, names, loc="outside lower center", ncols=3, frameon=False)
        figure.savefig(target)
        plt.close(figure)


if __name__ == "__main__":
    draw_sections(compute_sections(), *sys.argv[1:])
