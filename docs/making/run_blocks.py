"""The directives `run` and `shell`: programs that run at each build, followed by their output.

All blocks of a page share their variables, like the cells of a notebook, or their folder. A picture
is the value of the last expression in Python, if notebooks can display this value.
"""

import ast
import os
import subprocess
import sys
from base64 import b64encode
from contextlib import redirect_stdout
from html import escape
from io import BytesIO, StringIO
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import ClassVar

import matplotlib
from docutils import nodes
from docutils.parsers.rst import Directive, directives

from .gallery import LOOK, figure_of


def setup(app):
    app.add_directive("run", RunBlock)
    app.add_directive("shell", ShellBlock)


class RunBlock(Directive):
    has_content = True
    option_spec: ClassVar = {"alt": directives.unchanged_required}

    def run(self):
        program = "\n".join(self.content)
        page = self.state.document.settings.env.temp_data  # cleared at the end of each page
        names = page.setdefault("run_names", {"__name__": "__main__"})
        with matplotlib.rc_context(LOOK):
            output, value = run_program(program, names)
            picture = render_value(value, self.options.get("alt", "The picture of this program"))
        # The addresses of viewers are those of pages of the gallery, which are two folders deep.
        depth = self.state.document.settings.env.docname.count("/")
        picture = picture.replace("../../_static/", "../" * depth + "_static/")
        blocks = [nodes.literal_block(program, program, language="python")]
        if output:
            blocks.append(nodes.literal_block(output, output, language="text", classes=["output"]))
        if picture:
            blocks.append(nodes.raw("", picture, format="html"))
        return blocks


class ShellBlock(Directive):
    has_content = True

    def run(self):
        commands = "\n".join(self.content)
        page = self.state.document.settings.env.temp_data
        folder = page.setdefault("shell_folder", TemporaryDirectory())
        path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
        output = subprocess.run(
            ["sh", "-ec", commands],
            cwd=folder.name,
            env=os.environ | {"PATH": path},
            check=True,
            stdout=subprocess.PIPE,
            text=True,
        ).stdout
        return [
            nodes.literal_block(commands, commands, language="sh"),
            nodes.literal_block(output, output, language="text", classes=["output"]),
        ]


def run_program(program, names):
    """Run a program, and return its output and the value of its last expression or None."""
    body = ast.parse(program).body
    last = ast.Expression(body.pop().value) if body and isinstance(body[-1], ast.Expr) else None
    output, value = StringIO(), None
    with redirect_stdout(output):
        exec(compile(ast.Module(body, []), "<page>", "exec"), names)
        if last is not None:
            value = eval(compile(last, "<page>", "eval"), names)
    return output.getvalue().rstrip("\n"), value


def render_value(value, text):
    """Return the HTML that a notebook displays for a value, or an empty string."""
    figure = figure_of(value)
    if figure is not None:
        file = BytesIO()
        figure.savefig(file, format="png", dpi=LOOK["savefig.dpi"])
        data = b64encode(file.getvalue()).decode()
        return f'<img alt="{escape(text)}" src="data:image/png;base64,{data}">'
    display = getattr(value, "_repr_html_", None)
    return (display() if display else None) or ""
