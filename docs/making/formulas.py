"""Formulas as MathML, which browsers set by themselves: no script, no font, no network."""

from latex2mathml.converter import convert


def setup(app):
    app.add_html_math_renderer("mathml", (inline, None), (display, None))
    app.config.html_math_renderer = "mathml"


def inline(writer, node):
    writer.body.append(convert(node.astext()))
    raise_skip()


def display(writer, node):
    writer.body.append(f'<div class="formula">{convert(node.astext(), display="block")}</div>')
    raise_skip()


def raise_skip():
    from docutils.nodes import SkipNode

    raise SkipNode
