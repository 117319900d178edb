"""A list of all parts of the report."""

from ..parts import (
    atlas,
    calls,
    chaos,
    engines,
    ensembles,
    fits,
    many_starts,
    omissions,
    proofs,
    published,
    random_tops,
    truth,
    workprecision,
)
from ..parts.part import Part

PARTS = (
    Part(
        workprecision,
        "Error against run time",
        "Error against run time, in short",
        accepts_user_scenes=True,
    ),
    Part(many_starts, "Many starts", "Error against run time, many starts"),
    Part(truth, "Truth", "Are the reference solutions accurate?", accepts_user_scenes=True),
    Part(proofs, "Proofs", "Estimated and proved errors"),
    Part(atlas, "Stability", "The stability atlas"),
    Part(ensembles, "Many tops", "Many tops at once"),
    Part(calls, "Calls", "Calls for one top, beside heyoka"),
    Part(chaos, "Chaos", "Order and chaos"),
    Part(random_tops, "Random tops", "Random tops, at equal time"),
    Part(published, "Published problems", "Published problems"),
    Part(engines, "Engines", "Physics engines on the spin suite"),
    Part(fits, "Fits", "Fits to measurements"),
    Part(omissions, "Left out", "Run time without what is left out"),
)
