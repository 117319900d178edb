"""Formulas as MathML, which browsers render without scripts, fonts or network."""

from docutils.nodes import SkipNode
from latex2mathml.converter import convert

BETTER = {  # corrections of the output of latex2mathml
    "<mo>&#x0007C;</mo>": '<mo stretchy="false" lspace="0" rspace="0">&#x0007C;</mo>',
    "<mi>&#x0007E;</mi>": "<mo>&#x0223C;</mo>",
}


def setup(app):
    app.add_html_math_renderer("mathml", (inline, None), (display, None))
    app.config.html_math_renderer = "mathml"


def inline(writer, node):
    writer.body.append(mathml(node))
    raise SkipNode


def display(writer, node):
    writer.body.append(f'<div class="formula">{mathml(node, display="block")}</div>')
    raise SkipNode


def mathml(node, **options):
    text = convert(node.astext(), **options)
    for symbol, better in BETTER.items():
        text = text.replace(symbol, better)
    return text
