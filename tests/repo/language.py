"""Measures and rules for the language of docstrings, identifiers and file names.

Run `python tests/repo/language.py` to print the measures and all names that are participles. Run
`python tests/repo/language.py sample SEED` to print 60 sentences and 40 private names to rate.
"""

import ast
import random
import re
import sys
from collections import Counter, defaultdict

from toolbox import ROOT

TREES = ("python/kreisel", "validation", "tests", "docs", "examples")
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
# Verbs and nouns that end like participles.
VERBS = {"feed", "need", "seed", "speed", "embed", "exceed", "proceed"}


def python_files(*trees):
    """Return the Python files of the project in the folders `trees`, without generated files."""
    generated_folders = {"__pycache__", "gallery", "node_modules"}
    files = (file for tree in trees for file in (ROOT / tree).rglob("*.py"))
    return sorted(file for file in files if not generated_folders & set(file.parts))


def definitions(file):
    """Yield the node and the name of each module, class and function in `file`."""
    tree = ast.parse(file.read_text())
    yield tree, file.stem
    for node in ast.walk(tree):
        if isinstance(node, ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            yield node, node.name


def docstrings(*trees):
    """Return the location and the text of each docstring in the files of the folders `trees`."""
    return [
        (f"{file.relative_to(ROOT)}::{name}", text)
        for file in python_files(*trees)
        for node, name in definitions(file)
        if (text := ast.get_docstring(node))
    ]


def has_banned_opener(docstring):
    """Return True if `docstring` begins with a banned word."""
    return OPENER.match(docstring) is not None


def is_participle(name):
    """Return True if `name` begins with a past participle."""
    words = re.findall(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])", name)
    first = words[0].lower() if words else ""
    ends_like_one = first.endswith("ed") and len(first) > 3
    return (ends_like_one or first in IRREGULAR) and first not in VERBS


def names(*trees):
    """Return the place and name of each class and function, except tests and special methods."""
    return [
        (f"{file.relative_to(ROOT)}::{name}", name)
        for file in python_files(*trees)
        for node, name in definitions(file)
        if not isinstance(node, ast.Module) and not name.startswith(("test_", "__"))
    ]


def find_repeated_basenames(tree):
    """Return a dictionary that maps each repeated module name to the files that have it."""
    places = defaultdict(list)
    for file in python_files(tree):
        if file.name not in {"__init__.py", "__main__.py", "conftest.py"}:
            places[file.stem].append(file.relative_to(ROOT).as_posix())
    return {stem: files for stem, files in places.items() if len(files) > 1}


def report():
    """Print statistics of the docstrings and names, and all names that are participles."""
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


def split_sentences(text):
    """Return the complete sentences of five or more words in `text`, except those with formulas."""
    paragraphs = re.split(r"\n\s*\n|\n(?=\s{4,}|\s*>>>)", text)
    prose = [" ".join(part.split()) for part in paragraphs if not part.lstrip().startswith(">>>")]
    sentences = [s for part in prose for s in re.split(r"(?<=[.]) (?=[A-Z`])", part)]
    whole = [s for s in sentences if re.fullmatch(r"[A-Z`].*\.", s)]
    return [s for s in whole if len(s.split()) >= 5 and len(re.findall(r"[=^*]", s)) < 2]


def comment_sentences(tree):
    """Return the sentences in the comments of C files, with the file names."""
    return [
        (file.relative_to(ROOT), sentence)
        for file in sorted((ROOT / tree).rglob("*.[ch]"))
        for comment in re.findall(r"/\*(.*?)\*/", file.read_text(), re.DOTALL)
        for sentence in split_sentences(re.sub(r"\n \*", "\n", comment))
    ]


def docstring_sentences(*trees):
    return [(place, s) for place, text in docstrings(*trees) for s in split_sentences(text)]


def public_names():
    """Return the public names of the package, of its modules and of its classes."""
    import kreisel

    owners = [getattr(kreisel, name) for name in dir(kreisel) if not name.startswith("_")]
    owners += [getattr(kreisel.events, name) for name in kreisel.events.__all__]
    return {*dir(kreisel), *(name for owner in owners for name in dir(owner))}


def sample(seed):
    """Print randomly drawn sentences and names, to be rated by a reader."""
    draw = random.Random(seed)
    sources = (
        (20, comment_sentences("csrc")),
        (25, docstring_sentences("python/kreisel")),
        (15, docstring_sentences("validation", "tests")),
    )
    for number, sentences in sources:
        for place, sentence in draw.sample(sentences, number):
            print(f"{place}: {sentence}")
    public = public_names()
    private = [
        (place, name)
        for place, name in names("python/kreisel")
        if "/_" in place and name not in public
    ]
    for place, name in draw.sample(private, 40):
        print(f"{place.split('::')[0]}: {name}")


if __name__ == "__main__":
    if sys.argv[1:2] == ["sample"]:
        sample(int(sys.argv[2]))
    else:
        report()
