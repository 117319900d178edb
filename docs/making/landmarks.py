"""Names of the two side bars of each page, by which screen readers distinguish them."""

from pathlib import Path

NAMES = {"sidebar-drawer": "Pages of the site", "toc-drawer": "Sections of this page"}


def setup(app):
    app.connect("build-finished", name_side_bars)


def name_side_bars(app, exception):
    if exception is None and app.builder.name == "html":
        for file in Path(app.outdir).rglob("*.html"):
            text = file.read_text()
            named = add_names(text)
            if named != text:
                file.write_text(named)


def add_names(text):
    """Return HTML in which the side bars of the theme have names."""
    for kind, name in NAMES.items():
        text = text.replace(f'<aside class="{kind}', f'<aside aria-label="{name}" class="{kind}')
    return text
