"""What an erratum of the thesis is: what the text says, what is right, and by how much each is
wrong, computed."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Erratum:
    """`text` and `right` are how wrong each is, in the words of `measure`."""

    number: int
    where: str
    says: str
    is_right: str
    measure: str
    text: float
    right: float


def register_erratum(number, where, says, is_right, measure):
    """Makes an erratum of a function that computes (the text's error, the right one's)."""

    def make_erratum(compute):
        def compute_erratum():
            text, right = map(float, compute())
            return Erratum(number, where, says, is_right, measure, text, right)

        return compute_erratum

    return make_erratum
