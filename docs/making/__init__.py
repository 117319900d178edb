"""Extensions of Sphinx for the site.

They render plain-text docstrings, formulas as MathML, the C header with an index, and the
interactive viewer with a scene. They run the programs on the pages, name the sidebars, and create
thumbnails. They also check links, and copy the report if it exists.
"""

from pygments.lexers import TextLexer

from . import (
    code_blocks,
    docstrings,
    formulas,
    header,
    landmarks,
    links,
    live,
    report,
    run_blocks,
    thumbnails,
)

PARTS = (
    code_blocks,
    docstrings,
    formulas,
    header,
    landmarks,
    links,
    live,
    report,
    run_blocks,
    thumbnails,
)


def setup(app):
    for part in PARTS:
        part.setup(app)
    app.add_lexer("layers", TextLexer)  # the code block with the layers in ARCHITECTURE.md
    return {"parallel_read_safe": True, "parallel_write_safe": True}
