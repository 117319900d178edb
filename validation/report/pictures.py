"""The pictures of README.md and the theory pages that are stored in this folder.

    python -m validation.report.pictures page.png | section.png | sweep.png

page.png shows the interactive viewer in Chromium, and section.png Poincare sections of tops with
equal body, energy and vertical momentum. sweep.png shows the largest tilt of two million tops,
which have different spins and initial tilts, and no closed form; an interrupted computation is
continued from the folder build/sweep.
"""

import shutil
import sys
from pathlib import Path

import kreisel as kr
import numpy as np

from ..drawing.style import plt

HERE, ROOT = Path(__file__).parent, Path(__file__).parents[2]
BROWSER = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
SHOW = "kreisel.advance(9); kreisel.page.onChange(); kreisel.charts.update()"
CUBOID = kr.Body.cuboid(half=(1.0, 0.7, 0.4), pivot=(0.0, 0.0, -0.4), mass=1.0)
GRAVITIES = (0.05, 2.0, 4.0)
SPINS, TILTS = np.linspace(0.0, 8.0, 2000), np.linspace(0.001, 1.5, 1000)
TIMES = np.geomspace(1.0, 100.0, 101)  # unequal intervals, not in step with the nutation
ASIDE = kr.Body(1.0, (1.0, 1.2, 0.5), com=(0.2, 0.0, 1.0), unphysical=True)


def take_page(target):
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        chromium = shutil.which("chromium")
        browser = playwright.chromium.launch(executable_path=chromium, args=BROWSER)
        # the viewer must not start to move by itself
        words = {"viewport": {"width": 1120, "height": 720}, "reduced_motion": "reduce"}
        page = browser.new_page(**words)
        page.goto((ROOT / "python/kreisel/viewer.html").as_uri())  # built by `make build`
        page.wait_for_function("!!window.kreisel")
        page.evaluate(SHOW)
        page.screenshot(path=target)


def draw_sections(target, tops=80, points=800, time=3000.0):
    figure, axes = plt.subplots(
        1, len(GRAVITIES), figsize=(8.0, 3.2), sharex=True, sharey=True, layout="constrained"
    )
    for chart, gravity in zip(axes, GRAVITIES, strict=True):
        starts = kr.starts(CUBOID, energy=2.0, vertical=1.0, n=tops, seed=3, gravity=gravity)
        section = kr.section(starts, n=points)
        section.plot(chart, indicator=kr.megno(section.tops, time))
        legend = chart.get_legend()
        names = [text.get_text() for text in legend.get_texts()]
        marks = dict(zip(names, legend.legend_handles, strict=True))
        legend.remove()
        chart.set(title=f"gravity {gravity}", ylabel="" if chart is not axes[0] else None)
    figure.legend(marks.values(), marks, loc="outside lower center", ncols=3, frameon=False)
    figure.savefig(target)


def draw_sweep(target, folder=ROOT / "build/sweep", spins=SPINS, tilts=TILTS):
    top = kr.Scene.from_euler(ASIDE, angles=(0.0, 0.1, 0.0), rates=(0.0, 0.0, 1.0), gravity=1)
    # all tops are released without precession
    source = kr.Source.grid(top, spin=spins, tilt=tilts, precession=0.0)
    kr.sweep(source, TIMES, folder=folder, reduce={"nutation": "max"}, tol=1e-9)
    nutation = kr.read_sweep(folder).to_xarray()["nutation_max"]
    figure, axes = plt.subplots(figsize=(8.0, 4.2), layout="constrained")
    values = nutation.values.T
    mesh = axes.pcolormesh(nutation.spin, nutation.tilt, values, cmap="inferno", rasterized=True)
    axes.set(xlabel="spin", ylabel="tilt at the start [rad]")
    figure.colorbar(mesh, ax=axes, label="greatest nutation [rad]", pad=0.01)
    figure.savefig(target)


if __name__ == "__main__":
    plt.rcParams.update({"font.size": 9, "savefig.dpi": 110})
    draw = {"page.png": take_page, "section.png": draw_sections, "sweep.png": draw_sweep}
    draw[sys.argv[1]](HERE / sys.argv[1])
