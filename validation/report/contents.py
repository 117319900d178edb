"""The parts of the report, in the order of the page."""

from ..parts import atlas, ensemble, left_out, many, published, truth, workprecision

PARTS = (
    workprecision.PART,
    truth.PART,
    atlas.PART,
    many.PART,
    ensemble.PART,
    published.PART,
    left_out.PART,
)
