"""What the site needs beside Sphinx' own: docstrings in plain words, formulas as MathML, the C
header with an index, the page with a scene inside, the report where there is one, links that lead
somewhere."""

from pygments.lexers import TextLexer

from . import code_blocks, docstrings, formulas, header, links, live, report


def setup(app):
    for part in (code_blocks, docstrings, formulas, header, links, live, report):
        part.setup(app)
    app.add_lexer("layers", TextLexer)  # the plan in ARCHITECTURE.md
    return {"parallel_read_safe": True, "parallel_write_safe": True}
