"""A sentence of the thesis, beside what is true."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Sentence:
    where: str
    says: str
    found: str
    holds: bool
    why: str = ""  # it is not reproduced

    @property
    def verdict(self):
        return "reproduced" if self.holds else "not reproduced"
