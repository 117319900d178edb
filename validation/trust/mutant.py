"""A mutant: one small change of one file; and those that are known to change nothing."""

import random
import tomllib
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

EQUIVALENT = Path(__file__).with_name("equivalent.toml")


@dataclass(frozen=True)
class Mutant:
    """What stands at [begin, end) of a file's text becomes `new`."""

    file: str  # from the root of the tree, with slashes
    text: str
    begin: int
    end: int
    new: str

    @cached_property
    def line(self):
        return self.text.count("\n", 0, self.begin) + 1

    @cached_property
    def words(self):
        """The line in which it begins, without the space around it."""
        return self.text.splitlines()[self.line - 1].strip()

    @cached_property
    def change(self):
        old = " ".join(self.text[self.begin : self.end].split())
        return f"{old} -> {' '.join(self.new.split()) or 'nothing'}"

    @property
    def name(self):
        """What tells it from all others, and from those of the line as it was before an edit."""
        column = self.begin - self.text.rfind("\n", 0, self.begin)
        return f"{self.file}:{self.line}:{column}: {self.change} in {self.words}"

    def write(self, root):
        (root / self.file).write_text(self.text[: self.begin] + self.new + self.text[self.end :])

    def undo(self, root):
        (root / self.file).write_text(self.text)


def sampled(mutants, seed, points):
    """Gives so many of them, drawn without putting back: those of a smaller number come first."""
    drawn = list(mutants)
    random.Random(seed).shuffle(drawn)
    return drawn[:points]


def equivalents(file=EQUIVALENT):
    """Gives the known equivalent mutants, as (file, words of the line, change), with the reason;
    the change is "any" where the line is of no effect but on time."""
    rows = tomllib.loads(file.read_text()).get("equivalent", [])
    return {(row["file"], row["line"], row["change"]): row["why"] for row in rows}


def why_equivalent(mutant, known):
    place = mutant.file, mutant.words
    return known.get((*place, mutant.change)) or known.get((*place, "any"))
