"""Generation of mutants of C source files.

The source files must be formatted by clang-format. Mutations change operators and constants, swap
arguments, negate conditions and delete statements.
"""

import re
from itertools import pairwise

from .mutant import Mutant

TOKEN = re.compile(
    r"""(?P<skip>/\*.*?\*/|//[^\n]*|"(?:\\.|[^"\\])*"|'(?:\\.|[^'\\])*'|\s+|\\\n
        |^[ ]*\#(?:\\\n|[^\n])*)
      |(?P<number>(?:0[xX][0-9a-fA-F]*\.?[0-9a-fA-F]*(?:[pP][+-]?\d+)?
        |(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)[uUlLfF]*)
      |(?P<name>[A-Za-z_]\w*)
      |(?P<sign><<=|>>=|->|\+\+|--|<<|>>|<=|>=|==|!=|&&|\|\||[-+*/%&|^]=|.)""",
    re.S | re.M | re.X,
)
BINARY = {
    **{"+": "-", "-": "+", "*": "/", "/": "*", "%": "*", "&&": "||", "||": "&&"},
    **{"<": "<=", "<=": "<", ">": ">=", ">=": ">", "==": "!=", "!=": "=="},
    **{"+=": "-=", "-=": "+=", "*=": "/=", "/=": "*=", "<<": ">>", ">>": "<<", "&": "|", "|": "&"},
}
WRONG_WAY = {"<": ">", ">": "<", "<=": ">=", ">=": "<="}
NO_STATEMENT = re.compile(
    r"\.|(?:return|break|continue|goto|case|default|static|const|typedef|struct|enum|union|extern"
    r"|else|for|if|while|do|switch|\}|#|\(void\))"
    r"|[A-Za-z_]\w*(?:\s+\*?|\s*\*+)[A-Za-z_]\w*\s*[\[;,=(]"
)


COMMUTE = re.compile(
    r"fmin|fmax|hypot|two_sum|two_product|q_dd|(?:dd|duo|quad|triple)_mul"
    r"|(?:dd|duo|quad|triple|v|q|qdd|wide)_(?:add|dot|max|min)|(?:mask|truth)_(?:and|or)"
    r"|(?:one|lone|duo|quad|triple|wide)_fma"
)


def list_mutants(file, text):
    """Return all mutants of a source file."""
    tokens = [m for m in TOKEN.finditer(text) if m.lastgroup != "skip"]
    spans = [
        *mutate_operators(text, tokens),
        *mutate_numbers(text, tokens),
        *negate_conditions(tokens),
    ]
    spans += [*swap_arguments(text, tokens), *drop_statements(text, tokens)]
    return [Mutant(file, text, *span) for span in sorted(spans)]


def mutate_operators(text, tokens):
    for token in tokens:
        sign, begin, end = token[0], token.start(), token.end()
        neighbours = text[begin - 1 : begin], text[end : end + 1]
        if sign in ("++", "--"):
            yield begin, end, {"++": "--", "--": "++"}[sign]
        elif sign in BINARY and all(a.isspace() for a in neighbours):
            yield begin, end, BINARY[sign]
            if sign in WRONG_WAY:
                yield begin, end, WRONG_WAY[sign]
        elif sign in ("-", "!") and not neighbours[1].isspace():
            yield begin, end, ""


def mutate_numbers(text, tokens):
    for i, token in enumerate(tokens):
        if token.lastgroup != "number" or is_array_size(tokens, i):
            continue
        number = token[0]
        if re.fullmatch(r"\d+[uUlL]*", number):
            yield token.start(), token.end(), str(int(number.rstrip("uUlL")) + 1)
        elif re.fullmatch(r"0[xX][0-9a-fA-F]+[uUlL]*", number):
            yield token.start(), token.end(), f"({number} ^ 1)"
        else:
            yield token.start(), token.end(), f"({number} + 1.0)"


def is_array_size(tokens, i):
    """Return True if the number at index `i` is the size of an array in a declaration."""
    words = [token[0] for token in tokens[max(0, i - 3) : i]]
    type_match = re.fullmatch(r"\w+|\*", words[0]) and words[0] != "return" if words else False
    return len(words) == 3 and words[2] == "[" and bool(type_match)


def negate_conditions(tokens):
    for i, token in enumerate(tokens[:-1]):
        if token[0] in ("if", "while") and tokens[i + 1][0] == "(":
            end = find_closing(tokens, i + 1)
            begin, condition_end = tokens[i + 1].start(), tokens[end].end()
            condition = token.string[begin:condition_end]
            yield begin, condition_end, f"(!{condition})"


def find_closing(tokens, opening):
    """Return the index of the bracket that closes the bracket at index `opening`."""
    depth = 0
    for i in range(opening, len(tokens)):
        depth += (tokens[i][0] in "([{") - (tokens[i][0] in ")]}")
        if depth == 0:
            return i
    return len(tokens) - 1


def swap_arguments(text, tokens):
    """Yield mutations that swap the first two arguments of a function call."""
    for i, token in enumerate(tokens[:-1]):
        bracket = tokens[i + 1]
        if (
            COMMUTE.fullmatch(token[0])
            or token.lastgroup != "name"
            or bracket[0] != "("
            or bracket.start() != token.end()
        ):
            continue
        ends, depth = [bracket.end()], 0
        for other in tokens[i + 2 : find_closing(tokens, i + 1) + 1]:
            if depth == 0 and other[0] in (",", ")"):
                ends.append(other.start())
            depth += (other[0] in "([{") - (other[0] in ")]}")
        if len(ends) < 3:
            continue
        first, second = text[ends[0] : ends[1]], text[ends[1] + 1 : ends[2]].strip()
        is_declaration = any(
            re.match(r"(const\b|void\b|\w+ \**\w+$)", part) for part in (first, second)
        )
        if first != second and not is_declaration:
            yield ends[0], ends[2], f"{second}, {first}"


def drop_statements(text, tokens):
    """Yield mutations that delete a simple statement. Declarations are not deleted."""
    begins = None
    depth = 0
    for before, token in pairwise(tokens):
        depth += (before[0] in "([") - (before[0] in ")]")
        if before[0] in (";", "{", "}", ")") and depth == 0 and is_line_start(text, token.start()):
            begins = token.start()
        if token[0] == "{":
            begins = None
        elif token[0] == ";" and depth == 0 and begins is not None:
            if not NO_STATEMENT.match(text, begins) and is_indented(text, begins):
                yield begins, token.start(), ""
            begins = None


def is_line_start(text, position):
    return not text[text.rfind("\n", 0, position) + 1 : position].strip()


def is_indented(text, position):
    return position - text.rfind("\n", 0, position) > 4
