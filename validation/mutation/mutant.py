"""A mutant, which is a small change to one source file."""

import random
from dataclasses import dataclass
from functools import cached_property


@dataclass(frozen=True)
class Mutant:
    """A mutant, in which `new` replaces the characters from `begin` to `end` of a file."""

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
        """A unique name of the mutant, which contains the text of the changed line."""
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
