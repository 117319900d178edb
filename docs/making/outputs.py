"""Work on the built site: the report beside it, names of its sidebars, and checks of its links."""

import re
import shutil
from functools import cache
from html import unescape
from pathlib import Path
from urllib.parse import unquote, urlsplit

from sphinx.errors import ExtensionError

REPORT = Path(__file__).parents[2] / "report"
VIEWER = "viewer.html"  # its fragment is a scene, not an anchor
SIDEBARS = {"sidebar-drawer": "Pages of the site", "toc-drawer": "Sections of this page"}


def setup(app):
    app.connect("build-finished", finish_site)


def finish_site(app, exception):
    if exception is not None or app.builder.name != "html":
        return
    root = Path(app.outdir)
    pages = [file for file in root.rglob("*.html") if file.relative_to(root).parts[0] != "report"]
    for page in pages:
        name_sidebars(page)
    if app.tags.has("report"):
        shutil.copytree(REPORT, root / "report", dirs_exist_ok=True)
    dead = [f"{page.relative_to(root)}: {link}" for page in pages for link in dead_links(page)]
    if dead:
        raise ExtensionError("these links lead nowhere:\n" + "\n".join(dead))


def name_sidebars(page):
    """Give the sidebars of the theme names for screen readers."""
    text = named = page.read_text()
    for kind, name in SIDEBARS.items():
        named = named.replace(f'<aside class="{kind}', f'<aside aria-label="{name}" class="{kind}')
    if named != text:
        page.write_text(named)


def dead_links(page):
    """Yield the links of a page, also in raw HTML, whose files or anchors do not exist."""
    if page.name == VIEWER:
        return
    for link in re.findall(r'(?:href|src)="([^"]+)"', page.read_text()):
        parts = urlsplit(unescape(link))
        if parts.scheme or parts.netloc:
            continue
        file = (page.parent / unquote(parts.path)).resolve() if parts.path else page
        fragment = unquote(parts.fragment)
        is_page = fragment and file.suffix == ".html" and file.name != VIEWER
        if not file.is_file() or (is_page and fragment not in list_anchors(file)):
            yield link


@cache
def list_anchors(file):
    return set(re.findall(r'\b(?:id|name)="([^"]+)"', file.read_text()))
