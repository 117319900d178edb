"""Names of the two sidebars of each page, for screen readers."""

from pathlib import Path

NAMES = {"sidebar-drawer": "Pages of the site", "toc-drawer": "Sections of this page"}


def setup(app):
    app.connect("build-finished", name_side_bars)


def name_side_bars(app, exception):
    if exception is None and app.builder.name == "html":
        for file in Path(app.outdir).rglob("*.html"):
            text = file.read_text()
            result = add_names(text)
            if result != text:
                file.write_text(result)


def add_names(text):
    """Return HTML in which the sidebars of the theme have accessible names."""
    for kind, name in NAMES.items():
        text = text.replace(f'<aside class="{kind}', f'<aside aria-label="{name}" class="{kind}')
    return text
