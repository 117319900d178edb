"""The class `Mutant`: one small change of one file."""

import random
from dataclasses import dataclass
from functools import cached_property


@dataclass(frozen=True)
class Mutant:
    """A change that replaces the characters [begin, end) of a file by the string `new`."""

    file: str  # path relative to the root of the tree, with slashes
    text: str
    begin: int
    end: int
    new: str

    @cached_property
    def line(self):
        return self.text.count("\n", 0, self.begin) + 1

    @cached_property
    def line_text(self):
        """The line in which the change begins, without leading and trailing space."""
        return self.text.splitlines()[self.line - 1].strip()

    @cached_property
    def change(self):
        old = " ".join(self.text[self.begin : self.end].split())
        return f"{old} -> {' '.join(self.new.split()) or 'nothing'}"

    @property
    def name(self):
        """A unique name, which contains the line's text and so changes when the line is edited."""
        column = self.begin - self.text.rfind("\n", 0, self.begin)
        return f"{self.file}:{self.line}:{column}: {self.change} in {self.line_text}"

    def write(self, root):
        (root / self.file).write_text(self.text[: self.begin] + self.new + self.text[self.end :])

    def undo(self, root):
        (root / self.file).write_text(self.text)


def draw_sample(mutants, seed, points):
    """Return a random sample without replacement. A smaller sample is a prefix of a larger one."""
    drawn = list(mutants)
    random.Random(seed).shuffle(drawn)
    return drawn[:points]
