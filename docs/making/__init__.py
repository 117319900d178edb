"""Extensions of Sphinx for the site.

They render plain-text docstrings, formulas as MathML, the C header with an index, and the
interactive viewer with a scene. They run the programs on the pages, make pages accessible, check
links, and copy the report if it exists.
"""

from pygments.lexers import TextLexer

from . import accessibility, docstrings, formulas, header, live, outputs, run_blocks


def setup(app):
    for part in (accessibility, docstrings, formulas, header, live, outputs, run_blocks):
        part.setup(app)
    app.add_lexer("layers", TextLexer)  # the code block with the layers in ARCHITECTURE.md
    return {"parallel_read_safe": True, "parallel_write_safe": True}
