"""Sentences of the thesis, each with the result of its check."""

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
