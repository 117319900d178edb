"""Quantities that can be measured by instruments."""

from __future__ import annotations

from .._options.quantities import QUANTITIES, QuantityDescription
from .._results.specific_force import SPECIFIC_FORCE

_INTEGRALS = ("kowalewski", "goryachev_chaplygin")  # constant, or NaN for most bodies
MEASURABLE: dict[str, QuantityDescription] = {
    quantity.name: quantity
    for quantity in (*QUANTITIES.values(), SPECIFIC_FORCE)
    if quantity.name not in _INTEGRALS
}
# Vectors that an instrument on the body sees in its own frame.
SEEN_FROM_BODY = frozenset(
    name
    for name in MEASURABLE
    if name.startswith("body_") or name in ("inertial_velocity", SPECIFIC_FORCE.name)
)
