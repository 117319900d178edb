"""The report and the chapter on the thesis, copied into the site if they exist."""

import shutil
from pathlib import Path

REPORT = Path(__file__).parents[2] / "report"


def setup(app):
    app.connect("build-finished", beside)


def beside(app, exception):
    if exception is None and app.tags.has("report"):
        shutil.copytree(REPORT, app.outdir / "report", dirs_exist_ok=True)
