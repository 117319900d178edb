"""Errata of the thesis: the printed text, the correction, and the computed error of both."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Erratum:
    """An erratum.

    The fields `text` and `right` are the numerical errors of the printed text and of the
    correction. `measure` is the definition of the error.
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
