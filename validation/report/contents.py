"""The parts of the report, in the order of the page."""

from ..parts import atlas, chaos, ensemble, left_out, many, published, truth, workprecision

PARTS = (
    workprecision.PART,
    truth.PART,
    atlas.PART,
    many.PART,
    chaos.PART,
    ensemble.PART,
    published.PART,
    left_out.PART,
)
