"""Errata of the thesis: the printed text, the correction, and the numerical error of each."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Erratum:
    """An erratum.

    `text` is the numerical error of the printed text, and `right` is that of the correction.
    `measure` describes how the error is measured.
    """

    number: int
    where: str
    says: str
    is_right: str
    measure: str
    text: float
    right: float


def register_erratum(number, where, says, is_right, measure):
    """Decorate a function that computes the errors of the printed text and of the correction."""

    def make_erratum(compute):
        def compute_erratum():
            text, right = map(float, compute())
            return Erratum(number, where, says, is_right, measure, text, right)

        return compute_erratum

    return make_erratum
