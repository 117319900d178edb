"""A list of all parts of the report."""

from ..parts import (
    atlas,
    calls,
    chaos,
    ensembles,
    fits,
    many_starts,
    omissions,
    published,
    random_tops,
    truth,
    workprecision,
)

PARTS = (
    workprecision.PART,
    many_starts.PART,
    truth.PART,
    atlas.PART,
    ensembles.PART,
    calls.PART,
    chaos.PART,
    random_tops.PART,
    published.PART,
    fits.PART,
    omissions.PART,
)
