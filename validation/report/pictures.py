"""Take the pictures of README.md: of the viewer, and of error against run time, with Chromium."""

import shutil
from pathlib import Path

from playwright.sync_api import sync_playwright

HERE, ROOT = Path(__file__).parent, Path(__file__).parents[2]
VIEWER = ROOT / "python/kreisel/viewer.html"
FIGURE = ROOT / "report/readme_figure.svg"  # written by `make report`
SOFTWARE = ("--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader")
HAS_THUMBNAILS = (
    "[...document.querySelectorAll('#presets svg')].every(svg => svg.childElementCount)"
)
UNTIL = 0.86  # time of the motion in the picture of the viewer [s]


def main():
    with sync_playwright() as playwright:
        chromium = shutil.which("chromium")
        browser = playwright.chromium.launch(executable_path=chromium, args=SOFTWARE)
        # with reduced motion, the viewer does not start to move by itself
        size = {"width": 1120, "height": 820}
        page = browser.new_page(viewport=size, reduced_motion="reduce")
        page.goto(VIEWER.as_uri())
        while not page.evaluate(HAS_THUMBNAILS):
            page.wait_for_timeout(100)
        page.evaluate(f"kreisel.advance({UNTIL}); kreisel.page.onChange(); kreisel.charts.update()")
        page.screenshot(path=HERE / "page.png")
        if not FIGURE.exists():
            print(f"without {FIGURE.relative_to(ROOT)}, only the viewer's picture was taken")
            return
        page = browser.new_page(device_scale_factor=2)
        page.set_content(FIGURE.read_text())
        page.locator("svg").screenshot(path=HERE / "error_run_time.png", omit_background=True)


if __name__ == "__main__":
    main()
