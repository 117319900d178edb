"""The picture of README.md: where the thesis' top goes, and where bobenko_suris, in steps of 0.4, takes it.

python -m validation.report.picture [validation/report/picture.svg]
"""

import sys
from pathlib import Path

import kreisel as kr
import matplotlib.pyplot as plt
import numpy as np

from .figures import COLOURS, FAINT, INK, STYLE, as_svg

STEP, SPAN = 0.4, 44.0


def side_view(apex):
    """Across and up, seen from a little above."""
    tilt = np.radians(20)
    return apex[:, 0], apex[:, 2] * np.cos(tilt) + apex[:, 1] * np.sin(tilt)


def main(target=Path(__file__).parent / "picture.svg"):
    scene = kr.scenes.thesis
    true = kr.solve(scene, np.linspace(0, SPAN, 2000))
    steps = kr.solve(scene, SPAN, method="bobenko_suris", step=STEP, every=1)
    with plt.rc_context(STYLE):
        figure, (sphere, energy) = plt.subplots(1, 2, figsize=(8, 3.2), width_ratios=(3, 5))
        angle = np.linspace(0, 2 * np.pi, 200)
        sphere.plot(np.cos(angle), np.sin(angle), color=FAINT, linewidth=0.8)
        sphere.plot(*side_view(true.apex), color=COLOURS[0], linewidth=1)
        sphere.plot(*side_view(steps.apex), "o", color=COLOURS[1], markersize=2.2)
        sphere.set_aspect("equal")
        sphere.axis("off")
        sphere.set_title("path of the axis", fontsize=10)
        energy.plot(steps.t, steps.energy - steps.energy[0], color=COLOURS[1], label="energy")
        energy.plot(
            steps.t,
            steps.modified_energy(STEP) - steps.modified_energy(STEP)[0],
            color=INK,
            label="modified energy",
        )
        energy.set(xlabel="time", title=f"bobenko_suris, step {STEP}: change since the start")
        energy.title.set_fontsize(10)
        energy.legend(loc="upper right", ncols=2)
        figure.tight_layout()
        text = as_svg(figure).replace("currentColor", "#777777")  # readable on light and on dark
    Path(target).write_text(text)


if __name__ == "__main__":
    main(*sys.argv[1:])
