"""A picture of the interactive viewer for README.md, rendered with Chromium.

python -m validation.report.page_picture [validation/report/page.png]
"""

import shutil
import sys
from pathlib import Path

from playwright.sync_api import sync_playwright

TARGET = Path(__file__).with_name("page.png")
PAGE = Path(__file__).parents[2] / "python/kreisel/viewer.html"  # built by `make build`
SOFTWARE = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
SIZE = {"width": 1120, "height": 720}
UNTIL = 9  # time of the motion at which the picture is taken


def take_picture(target=TARGET):
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=shutil.which("chromium"), args=SOFTWARE
        )
        page = browser.new_page(
            viewport=SIZE, reduced_motion="reduce"
        )  # the viewer must not start to move by itself
        page.goto(PAGE.as_uri())
        while not page.evaluate("!!window.kreisel"):
            page.wait_for_timeout(50)
        page.evaluate(f"kreisel.advance({UNTIL}); kreisel.page.onChange(); kreisel.charts.update()")
        page.screenshot(path=target)


if __name__ == "__main__":
    take_picture(*sys.argv[1:])
