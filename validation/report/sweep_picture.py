"""A figure for docs/theory/ensembles.md that shows the largest tilt of two million tops.

All tops have the same body. The motion has no closed-form solution, because all moments of inertia
are different and the centre of mass is not the fixed point. The tops have different spins and
initial tilts. An interrupted computation is continued from the results in FOLDER.

    python -m validation.report.sweep_picture FOLDER [validation/report/sweep.png]
"""

import sys
from pathlib import Path

import kreisel as kr
import numpy as np

from ..drawing.style import plt

BODY = kr.Body(1.0, (1.0, 1.2, 0.5), com=(0.2, 0.0, 1.0), unphysical=True)
SPINS, TILTS = np.linspace(0.0, 8.0, 2000), np.linspace(0.001, 1.5, 1000)
TIMES = np.geomspace(1.0, 100.0, 101)  # unequal intervals, not in step with the nutation
TARGET = Path(__file__).with_name("sweep.png")


def run_sweep(folder, spins=SPINS, tilts=TILTS):
    """Return the largest nutation [rad] of each top, with one row per spin."""
    top = kr.Scene.from_euler(BODY, angles=(0.0, 0.1, 0.0), rates=(0.0, 0.0, 1.0), gravity=1)
    # all tops are released without precession
    source = kr.Source.grid(top, spin=spins, tilt=tilts, precession=0.0)
    kr.sweep(source, TIMES, folder=folder, reduce={"nutation": "max"}, tol=1e-9)
    return kr.read_sweep(folder).to_xarray()["nutation_max"]


def draw_sweep(nutation, target=TARGET):
    with plt.rc_context({"font.size": 9, "savefig.dpi": 110}):
        figure, axes = plt.subplots(figsize=(8.0, 4.2), layout="constrained")
        mesh = axes.pcolormesh(
            nutation.spin, nutation.tilt, nutation.values.T, cmap="inferno", rasterized=True
        )
        axes.set(xlabel="spin", ylabel="tilt at the start [rad]")
        figure.colorbar(mesh, ax=axes, label="greatest nutation [rad]", pad=0.01)
        figure.savefig(target)
        plt.close(figure)


if __name__ == "__main__":
    folder, *target = sys.argv[1:]
    draw_sweep(run_sweep(folder), *target)
