"""Conversion of the package's plain-text docstrings to reST.

A paragraph of lines "name  description" becomes a definition list, and an indented paragraph
becomes a code block. `kreisel.name` becomes a link if the name is public. Lists and text in
backquotes are converted, and other reST markup is escaped.
"""

import inspect
import re

import kreisel as kr
from sphinx.util.inspect import stringify_signature

PRIVATE = re.compile(r"\b_(?=[A-Z])")  # before the names of private types
ROW = re.compile(r"(\S.{0,60}?)\s{2,}(\S.*)")
MADE_BY_USERS = {"Body", "Scene"}


def setup(app):
    app.connect("autodoc-process-docstring", as_rest)
    app.connect("autodoc-process-signature", signature)
    app.connect("autodoc-process-bases", bases)
    app.connect("autodoc-skip-member", skip_member)


def as_rest(app, what, name, thing, options, lines):
    blocks = re.split(r"\n\s*\n", "\n".join(lines).strip("\n"))
    lines[:] = [line for block in blocks for line in [*render_paragraph(block.splitlines()), ""]]


def render_paragraph(block):
    """Return the lines of a paragraph, converted to reST."""
    text = inspect.cleandoc("\n".join(["", *block])).splitlines()
    if not text:
        return []
    if text[0].startswith(">>>"):
        return text
    if block[0].startswith("    "):
        return ["::", "", *("    " + line for line in text)]
    if any(line.startswith("- ") for line in text):
        return bullets(text)
    if ROW.fullmatch(text[0]) and all(line[0] == " " or ROW.fullmatch(line) for line in text):
        return definitions(text)
    return [plain(line) for line in text]


def bullets(text):
    """Return a bullet list and the sentence before it."""
    first = next(i for i, line in enumerate(text) if line.startswith("- "))
    rows = [line if line[0] == " " else "\n" + line for line in map(plain, text[first:])]
    return [*map(plain, text[:first]), "", *"\n".join(rows).splitlines()]


def definitions(text):
    """Return a definition list of names and their descriptions."""
    rows = []
    for line in text:
        found = line[0] != " " and ROW.fullmatch(line)
        if found:
            rows += ["", f"``{found[1]}``"]
        rows.append("    " + plain(found[2] if found else line.strip()))
    return rows


def plain(line):
    """Return a line in which reST markup is escaped and public names are links."""
    parts = re.split(r"(`[^`]+`)", line)
    return "".join(f"`{part}`" if part[:1] == "`" else escape(part) for part in parts)


def escape(text):
    text = re.sub(r"([\\*|])|(?<=\w)(_)(?!\w)", lambda mark: "\\" + mark[0], text)
    return re.sub(r"\bkreisel\.(\w+(?:\.\w+)?)", link, text)


def link(found):
    """Return a cross-reference if the name is public, and otherwise the name itself."""
    thing = kr
    for word in found[1].split("."):
        thing = getattr(thing, word, None)
    return f":py:obj:`{found[0]}`" if thing is not None and found[0] != "kreisel.h" else found[0]


def signature(app, what, name, thing, options, arguments, return_annotation):
    """Return the signature with types as in the source code, unless users do not construct it."""
    if what in {"class", "exception"} and name.split(".")[-1] not in MADE_BY_USERS:
        return "", None
    if what not in {"class", "function", "method"} or not arguments:
        return None
    call_signature = inspect.signature(thing)
    parameters = [
        # the docstring describes **kwargs
        p.replace(annotation=inspect.Parameter.empty) if p.kind == p.VAR_KEYWORD else p
        for p in call_signature.parameters.values()
        if p.name != "self"
    ]
    text = stringify_signature(inspect.Signature(parameters))
    result = call_signature.return_annotation
    is_typed = isinstance(result, str) and what != "class"
    return PRIVATE.sub("", text), PRIVATE.sub("", result) if is_typed else None


def bases(app, name, thing, options, found):
    found[:] = [base for base in found if not base.__module__.startswith("kreisel._")] or [object]


def skip_member(app, what, name, thing, skip, options):
    """Skip the methods that named tuples inherit from tuple."""
    return True if name in {"count", "index"} and inspect.ismethoddescriptor(thing) else None
