"""A sentence of the thesis, with the result of its check."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Sentence:
    where: str
    says: str
    found: str
    holds: bool
    why: str = ""  # reason if it is not reproduced

    @property
    def verdict(self):
        return "reproduced" if self.holds else "not reproduced"
