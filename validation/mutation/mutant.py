"""A small change to a source file, used to check the quality of the tests."""

import random
from dataclasses import dataclass
from functools import cached_property


@dataclass(frozen=True)
class Mutant:
    """A mutant, obtained by replacing the characters from `begin` to `end` in a source file."""

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
        """The first changed line of the source, without leading and trailing spaces."""
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
    """Return a random sample of the mutants, drawn without replacement.

    A smaller sample drawn with the same seed is the beginning of a larger one.
    """
    sample = list(mutants)
    random.Random(seed).shuffle(sample)
    return sample[:points]
