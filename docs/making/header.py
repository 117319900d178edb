"""The directive `c-header`: a C header, preceded by an index of its functions by subject."""

import re
from itertools import groupby
from pathlib import Path

from docutils import nodes
from docutils.parsers.rst import Directive
from pygments import highlight
from pygments.formatters import HtmlFormatter
from pygments.lexers import CLexer
from sphinx import addnodes

ROOT = Path(__file__).parents[2]
DECLARED = re.compile(r"^KR_API [^;(]*?(kr_(\w+?)_\w+|kr_\w+)\(", re.MULTILINE)


def setup(app):
    app.add_directive("c-header", Header)


def functions(text):
    """Yield (subject, name, line) of each function that a header declares."""
    for found in DECLARED.finditer(text):
        line = text.count("\n", 0, found.start()) + 1
        yield found[2] or found[1].removeprefix("kr_"), found[1], line


class Header(Directive):
    required_arguments = 1

    def run(self):
        file = ROOT / self.arguments[0]
        self.state.document.settings.env.note_dependency(str(file))
        text = file.read_text()
        rows = sorted(functions(text))
        lists = [index_of(s, list(row)) for s, row in groupby(rows, key=lambda row: row[0])]
        formatter = HtmlFormatter(cssclass="highlight", lineanchors="line", linenos=False)
        return [*lists, nodes.raw("", highlight(text, CLexer(), formatter), format="html")]


def index_of(subject, rows):
    """Return a paragraph of links, which are also entries of the site's index."""
    paragraph = nodes.paragraph("", "", nodes.strong("", subject), nodes.Text(": "))
    for i, (_, name, line) in enumerate(rows):
        entry = addnodes.index(entries=[("single", f"{name} (C function)", name, "", None)])
        link = nodes.reference("", "", refuri=f"#line-{line}", internal=True)
        link += nodes.literal("", name)
        paragraph += [nodes.Text(", ")] if i else []
        paragraph += [entry, nodes.target("", "", ids=[name]), link]
    return paragraph
