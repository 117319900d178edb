"""Statements in the thesis, with the results of numerical checks."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Sentence:
    where: str
    says: str
    found: str
    holds: bool
    why: str = ""  # the reason, if the sentence is not reproduced

    @property
    def verdict(self):
        return "reproduced" if self.holds else "not reproduced"
