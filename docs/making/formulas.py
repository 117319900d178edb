"""Formulas as MathML, which browsers render without scripts, fonts or network."""

from docutils.nodes import SkipNode, math_block
from latex2mathml.converter import convert

BETTER = {  # corrections of the output of latex2mathml
    "<mo>&#x0007C;</mo>": '<mo stretchy="false" lspace="0" rspace="0">&#x0007C;</mo>',
    "<mi>&#x0007E;</mi>": "<mo>&#x0223C;</mo>",
}


def setup(app):
    app.add_html_math_renderer("mathml", (render, None), (render, None))
    app.config.html_math_renderer = "mathml"


def render(writer, node):
    is_block = isinstance(node, math_block)
    text = convert(node.astext(), **({"display": "block"} if is_block else {}))
    for symbol, better in BETTER.items():
        text = text.replace(symbol, better)
    writer.body.append(f'<div class="formula">{text}</div>' if is_block else text)
    raise SkipNode
