"""Checks of the site's internal links to files and anchors, including those in raw HTML."""

import re
from functools import cache
from html import unescape
from pathlib import Path
from urllib.parse import unquote, urlsplit

from sphinx.errors import ExtensionError

PAGE = "viewer.html"  # its fragment is a scene, not an anchor


def setup(app):
    # runs after the report is copied
    app.connect("build-finished", refuse_dead_links, priority=900)


def refuse_dead_links(app, exception):
    if exception is None and app.builder.name == "html":
        root = Path(app.outdir)
        pages = [
            file for file in root.rglob("*.html") if file.relative_to(root).parts[0] != "report"
        ]
        dead = [f"{page.relative_to(root)}: {link}" for page in pages for link in dead_links(page)]
        if dead:
            raise ExtensionError("these links lead nowhere:\n" + "\n".join(dead))


def dead_links(page):
    """Yield the links of a page whose targets do not exist."""
    if page.name == PAGE:
        return
    for link in re.findall(r'(?:href|src)="([^"]+)"', page.read_text()):
        parts = urlsplit(unescape(link))
        if parts.scheme or parts.netloc:
            continue
        file = (page.parent / unquote(parts.path)).resolve() if parts.path else page
        if not file.is_file() or not is_there(file, unquote(parts.fragment)):
            yield link


def is_there(file, fragment):
    return not fragment or file.suffix != ".html" or file.name == PAGE or fragment in places(file)


@cache
def places(file):
    return set(re.findall(r'\b(?:id|name)="([^"]+)"', file.read_text()))
