"""Errata of the thesis, with the numerical errors of the printed text and of the correction."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Erratum:
    """An erratum.

    `printed_error` is the numerical error of the formula as printed, and `corrected_error` that of
    the corrected formula. `measure` describes how the two errors are measured.
    """

    number: int
    where: str
    says: str
    is_right: str
    measure: str
    printed_error: float
    corrected_error: float


def register_erratum(number, place, statement, is_right, measure):
    """Register a function that computes the errors of a formula as printed and as corrected."""

    def make_erratum(compute):
        def compute_erratum():
            printed, corrected = map(float, compute())
            return Erratum(number, place, statement, is_right, measure, printed, corrected)

        return compute_erratum

    return make_erratum
