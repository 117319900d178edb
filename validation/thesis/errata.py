"""Errata of the thesis, with the numerical errors of the printed text and of the correction."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Erratum:
    """An erratum.

    `text` is the numerical error of the formula as printed, and `right` is the error after the
    correction. The text `measure` explains how both numerical errors are measured.
    """

    number: int
    where: str
    says: str
    is_right: str
    measure: str
    text: float
    right: float


def register_erratum(number, place, statement, is_right, measure):
    """Register a function that computes the errors of a formula as printed and as corrected."""

    def make_erratum(compute):
        def compute_erratum():
            text, right = map(float, compute())
            return Erratum(number, place, statement, is_right, measure, text, right)

        return compute_erratum

    return make_erratum
