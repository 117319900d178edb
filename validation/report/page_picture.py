"""The picture of the page in README.md, taken by Debian's chromium.

python -m validation.report.page_picture [validation/report/page.png]
"""

import shutil
import sys
from pathlib import Path

from playwright.sync_api import sync_playwright

TARGET = Path(__file__).with_name("page.png")
PAGE = Path(__file__).parents[2] / "python/kreisel/viewer.html"  # as `make build` made it
SOFTWARE = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
SIZE = {"width": 1120, "height": 640}
UNTIL = 9_000_000  # of the clock, which counts a million in a unit of time


def main(target=TARGET):
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=shutil.which("chromium"), args=SOFTWARE
        )
        page = browser.new_page(viewport=SIZE)
        page.goto(PAGE.as_uri())
        while page.evaluate("kreisel.page.clock") < UNTIL:
            page.wait_for_timeout(100)
        page.screenshot(path=target)


if __name__ == "__main__":
    main(*sys.argv[1:])
