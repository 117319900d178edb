"""Measures of the language of the Python code: docstring openers, participle names, file names."""

import ast
import re
from collections import Counter, defaultdict

from toolbox import ROOT

TREES = ("python/kreisel", "validation", "tests", "docs")
BANNED_OPENERS = (
    "What|How|Whether|Where|Who|Those|Of|The same|That|None|All|As|In|With|By|Which|Each|It|On|"
    "For|Gives|Tells|Says|Takes"
)
OPENER = re.compile(rf"(?:{BANNED_OPENERS})\b")
IRREGULAR = re.findall(
    r"\w+",
    """told said made kept moved fed met seen looked drawn given done left shown carried held sown
    known grown lost found thrown taken gone begun bound built bought brought caught forgotten
    got heard hurt laid led lent lit meant paid sent spent stood stuck sworn taught thought torn
    understood woken worn written wound spun spelt swept chosen fallen hidden broken frozen proven
    risen spoken stolen stricken""",
)
# Verbs and nouns that end as participles do.
VERBS = {"feed", "need", "seed", "speed", "embed", "exceed", "proceed"}


def python_files(*trees):
    """Return the Python files below `trees` that belong to the project."""
    generated = {"__pycache__", "gallery", "node_modules"}
    files = (file for tree in trees for file in (ROOT / tree).rglob("*.py"))
    return sorted(file for file in files if not generated & set(file.parts))


def definitions(file):
    """Yield (node, name) of each module, class and function in `file`."""
    tree = ast.parse(file.read_text())
    yield tree, file.stem
    for node in ast.walk(tree):
        if isinstance(node, ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            yield node, node.name


def docstrings(*trees):
    """Return (place, docstring) of each definition below `trees` that has a docstring."""
    return [
        (f"{file.relative_to(ROOT)}::{name}", text)
        for file in python_files(*trees)
        for node, name in definitions(file)
        if (text := ast.get_docstring(node))
    ]


def has_banned_opener(docstring):
    """Return True if `docstring` opens with a word that hides its subject or its verb."""
    return OPENER.match(docstring) is not None


def is_participle(name):
    """Return True if the first word of the identifier `name` is a past participle."""
    words = re.findall(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])", name)
    first = words[0].lower() if words else ""
    ends_like_one = first.endswith("ed") and len(first) > 3
    return (ends_like_one or first in IRREGULAR) and first not in VERBS


def names(*trees):
    """Return (place, name) of each class and function below `trees`, test functions apart."""
    return [
        (f"{file.relative_to(ROOT)}::{name}", name)
        for file in python_files(*trees)
        for node, name in definitions(file)
        if not isinstance(node, ast.Module) and not name.startswith(("test_", "__"))
    ]


def find_repeated_basenames(tree):
    """Return the module names that two files below `tree` share, each with its files."""
    places = defaultdict(list)
    for file in python_files(tree):
        if file.name not in {"__init__.py", "__main__.py", "conftest.py"}:
            places[file.stem].append(file.relative_to(ROOT).as_posix())
    return {stem: files for stem, files in places.items() if len(files) > 1}


def report():
    """Print the measures of each tree and the offenders."""
    for tree in TREES:
        texts, found = docstrings(tree), names(tree)
        openers = [place for place, text in texts if has_banned_opener(text)]
        participles = [place for place, name in found if is_participle(name)]
        print(
            f"{tree}: {len(openers)} of {len(texts)} docstrings open badly, "
            f"{len(participles)} of {len(found)} names are participles, "
            f"{len(find_repeated_basenames(tree))} file names are used twice"
        )
        print("  openers:", Counter(text.split()[0] for p, text in texts if p in set(openers)))
        for place in participles:
            print("  ", place)


if __name__ == "__main__":
    report()
