"""What the public calls give for words that are drawn: drawn.txt has, for each call, hashes of what
is told of a few such calls. A change that moves any of them is seen.

python tests/python/drawn.py writes the hashes anew; with the name of a call and the number of a
hash, it tells these calls.
"""

import contextlib
import dataclasses
import hashlib
import random
import re
import shutil
import sys
import tempfile
import warnings
import webbrowser
from functools import cache
from itertools import islice
from pathlib import Path
from types import GeneratorType

import kreisel as kr
import matplotlib.pyplot as plt
import numpy as np
import results
import words
from public import calls

FILE = Path(__file__).with_suffix(".txt")
CALLS = calls()
OWN_METHODS = sum(not name.startswith("gsl") for name in kr.methods)  # the first in the table
EACH = 8  # calls of a hash
# What takes times, draws the page, or tells addresses and the order of a set.
LEFT_OUT = re.compile(
    r"compare|Table\.|Row\.|View|view|Run\.checkpoint|SweepInterrupted|ManyPlan.__repr__|.*__iter__"
)
# of things in memory or a file, and of methods that may not be built in
ADDRESS = re.compile(r" at 0x[0-9a-f]+|0x[0-9a-f]{6,}|byte 0x.*|,? gsl_\w+")
ODD = [None, True, 0, -1, 0.5, float("nan"), float("inf"), "x", "apex_z", (), [0, 0, 0], [1, 2]]


def names():
    return [name for name in CALLS if not LEFT_OUT.match(name)]


def count(name):
    """How many hashes a call has: the more, the more words it takes."""
    _, parameters = CALLS[name]
    return 1 + len(parameters)


def drawn_words(chance, name, parameters):
    """Words of a call, most of them right, and not all of those that may be left out."""
    listed, named = [], {}
    few = 2.0 / max(1, sum(p.default is not p.empty for p in parameters))
    for p in parameters:
        if p.kind is p.VAR_KEYWORD:
            for word in chance.sample(words.WORDS[p.name], chance.randrange(3)):
                named[word] = value(chance, name, word)
        elif p.kind is p.VAR_POSITIONAL:
            listed = [value(chance, name, p.name) for _ in range(chance.randrange(3))]
        elif p.default is p.empty or chance.random() < min(0.5, few):
            named[p.name] = value(chance, name, p.name)
    if name == "section":  # how many events come in so many steps is a matter of roundings
        named |= {"n": 4, "max_steps": 0}
    elif "max_steps" in (p.name for p in parameters):
        named.setdefault("max_steps", words.MOST)
    return listed, named


def value(chance, name, word):
    right = words.PARTICULAR.get(f"{name}.{word}") or words.RIGHT[word]
    if word == "method":
        right = [method for method in right if not method.startswith("gsl")]
    return chance.choice(ODD if chance.random() < 0.05 else right)


def told_of(name, number):
    """What is told of the calls of a hash, in a place of their own."""
    makes, parameters = CALLS[name]
    makes = makes[:OWN_METHODS] if name.startswith("Method.") else makes
    chance = random.Random(f"{name} {number}")
    with tempfile.TemporaryDirectory() as folder, place(folder), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for _ in range(EACH):
            call = chance.choice(makes)()
            listed, named = drawn_words(chance, name, parameters)
            yield f"{named}", told(call, listed, named)
            plt.close("all")


def told(call, listed, named):
    """What a call gives, or how it is refused."""
    try:
        given = call(*listed, **named)
        if isinstance(given, GeneratorType):
            given = list(islice(given, 3))
        if isinstance(given, kr.ManyPlan):
            given = dataclasses.replace(given, seconds=None)
    except Exception as refused:
        given = [f"{type(refused).__name__}: {refused}", getattr(refused, "path", None)]
    return ADDRESS.sub("", results.told(given))


@cache
def template():
    """A folder with a file of each kind."""
    folder = Path(tempfile.mkdtemp())
    with contextlib.chdir(folder):
        kr.solve(kr.scenes.asymmetric, [1, 2]).save("top.npz")
        kr.scenes.thesis.to_toml("top.toml")
        kr.start(kr.scenes.asymmetric).save("top.run")
        for name, parts in {"swept": None, "half": range(1)}.items():
            asked = {"part": 3, "parts": parts, "reduce": {"nutation": "min"}}
            kr.sweep(words.SOURCES[0], [1.0], to=name, **asked)
        np.savez("tops.npz", gravity=[1.0, 2.0])
        kr.read_sweep("swept").to_pandas()[["spin", "tilt"]].to_parquet("tops.parquet")
    return folder


@contextlib.contextmanager
def place(folder):
    """Files go there, and pages to no browser."""
    shutil.copytree(template(), folder, dirs_exist_ok=True)
    opens = webbrowser.open
    webbrowser.open = lambda *_, **__: True
    try:
        with contextlib.chdir(folder):
            yield
    finally:
        webbrowser.open = opens


def hash_of(name, number):
    text = "\n".join(what for _, what in told_of(name, number))
    return hashlib.sha256(text.encode(errors="replace")).hexdigest()[:8]


def hashes():
    """The hashes of each call, as the file has them."""
    rows = (row.split() for row in FILE.read_text().splitlines())
    return {name: found for name, *found in rows}


if __name__ == "__main__":
    if len(sys.argv) > 1:
        for asked, what in told_of(sys.argv[1], int(sys.argv[2])):
            print(asked, what, sep="\n", end="\n\n")
    else:
        rows = (
            f"{name} {' '.join(hash_of(name, i) for i in range(count(name)))}\n" for name in names()
        )
        FILE.write_text("".join(rows))
