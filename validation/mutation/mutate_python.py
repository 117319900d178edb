"""Generation of mutants of Python source files.

Mutations change operators and constants, swap arguments, negate conditions and delete statements.
Strings are not mutated.
"""

import ast
import re

from .mutant import Mutant

OPERATORS = {
    **{ast.Add: ("+", "-"), ast.Sub: ("-", "+"), ast.Mult: ("*", "/"), ast.Div: ("/", "*")},
    **{ast.FloorDiv: ("//", "/"), ast.Mod: ("%", "*"), ast.Pow: ("**", "*")},
    **{ast.BitAnd: ("&", "|"), ast.BitOr: ("|", "&"), ast.MatMult: ("@", "*")},
    **{ast.And: ("and", "or"), ast.Or: ("or", "and")},
    **{ast.Lt: ("<", "<="), ast.LtE: ("<=", "<"), ast.Gt: (">", ">="), ast.GtE: (">=", ">")},
    **{ast.Eq: ("==", "!="), ast.NotEq: ("!=", "==")},
    **{ast.Is: ("is", "is not"), ast.IsNot: ("is not", "is")},
    **{ast.In: ("in", "not in"), ast.NotIn: ("not in", "in")},
}
NAMES = {"min": "max", "max": "min", "any": "all", "all": "any", "floor": "ceil", "ceil": "floor"}
DROPPED = ast.AugAssign | ast.Raise | ast.Delete | ast.Assert | ast.Expr
COMMUTE = {"min", "max", "minimum", "maximum", "dot", "isinstance", "getattr", "hasattr"}


def list_mutants(file, text):
    """Return all mutants of a source file."""
    tree = ast.parse(text)
    lines = [0]
    for line in text.splitlines(keepends=True):
        lines.append(lines[-1] + len(line))
    rows = text.splitlines()

    def at(row, column):  # the index in the text of a byte column of a line
        return lines[row - 1] + len(rows[row - 1].encode()[:column].decode())

    def span(node):
        return at(node.lineno, node.col_offset), at(node.end_lineno, node.end_col_offset)

    annotations = {id(node) for part in find_annotations(tree) for node in ast.walk(part)}
    nodes = [node for node in ast.walk(tree) if id(node) not in annotations]
    changes = {change for node in nodes for change in mutate_node(node, text, span)}
    return [Mutant(file, text, *change) for change in sorted(changes)]


def find_annotations(tree):
    """Yield all type annotations in a Python syntax tree."""
    for node in ast.walk(tree):
        for field in ("annotation", "returns"):
            if part := getattr(node, field, None):
                yield part


def mutate_node(node, text, span):
    """Yield the mutations of a node of the syntax tree as tuples (begin, end, new text)."""
    if isinstance(node, ast.BinOp):
        yield from mutate_operator(node.op, span(node.left)[1], span(node.right)[0], text)
    elif isinstance(node, ast.BoolOp):
        yield from mutate_operator(node.op, span(node.values[0])[1], span(node.values[1])[0], text)
    elif isinstance(node, ast.Compare):
        sides = [node.left, *node.comparators]
        for op, left, right in zip(node.ops, sides, node.comparators, strict=False):
            yield from mutate_operator(op, span(left)[1], span(right)[0], text)
    elif isinstance(node, ast.AugAssign):
        yield from mutate_operator(node.op, span(node.target)[1], span(node.value)[0], text)
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not | ast.USub):
        yield span(node)[0], span(node.operand)[0], ""
    elif isinstance(node, ast.Constant) and type(node.value) in (bool, int, float):
        yield *span(node), mutate_constant(node.value, text[slice(*span(node))])
    elif isinstance(node, ast.Call):
        yield from mutate_call(node, text, span)
    yield from mutate_statement(node, text, span)


def mutate_operator(op, begin, end, text):
    """Yield the mutations of a binary operator."""
    old, new = OPERATORS.get(type(op), ("", ""))
    words = r"\s+".join(map(re.escape, old.split()))
    if old and (found := re.search(words, text[begin:end])):
        yield begin + found.start(), begin + found.end(), new


def mutate_constant(value, literal):
    if isinstance(value, bool):
        return str(not value)
    return str(value + 1) if isinstance(value, int) else f"({literal} + 1.0)"


def mutate_call(node, text, span):
    name = getattr(node.func, "id", getattr(node.func, "attr", ""))
    if name in NAMES:
        end = span(node.func)[1]
        yield end - len(name), end, NAMES[name]
    if len(node.args) > 1 and name not in COMMUTE:
        (a, b), (c, d) = span(node.args[0]), span(node.args[1])
        starred = any(isinstance(arg, ast.Starred) for arg in node.args[:2])
        if text[a:b] != text[c:d] and not starred:
            yield a, d, f"{text[c:d]}{text[b:c]}{text[a:b]}"


def mutate_statement(node, text, span):
    if isinstance(node, ast.If | ast.While | ast.IfExp):
        begin, end = span(node.test)
        yield begin, end, f"(not ({text[begin:end]}))"
    elif isinstance(node, ast.Break | ast.Continue):
        yield *span(node), "continue" if isinstance(node, ast.Break) else "break"
    elif isinstance(node, DROPPED) and not is_docstring_or_yield(node):
        yield *span(node), "pass"


def is_docstring_or_yield(node):
    """Return True for docstrings and yield statements, which mutations must not delete."""
    return isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant | ast.Yield)


def lines_run_at_import(text):
    """Return the lines of a source file that are executed on import."""
    tree = ast.parse(text)
    body_lines = {
        line
        for node in ast.walk(tree)
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
        for part in node.body
        for line in range(part.lineno, part.end_lineno + 1)
    }
    return set(range(1, len(text.splitlines()) + 1)) - body_lines
