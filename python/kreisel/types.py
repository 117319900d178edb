"""Types for annotations: names of methods and quantities, and classes that users do not build.

from kreisel.types import QuantityName
want: list[QuantityName] = ["apex", "energy"]
"""

from __future__ import annotations

from ._analysis.compare import Row, Table
from ._analysis.curves import Nutation, Rod
from ._analysis.steady import Steady
from ._options.plan import StepChoice
from ._results.calls import Stats
from ._utils.quantity_attributes import MethodName, QuantityName
from ._view import View

__all__ = [
    "MethodName",
    "Nutation",
    "QuantityName",
    "Rod",
    "Row",
    "Stats",
    "Steady",
    "StepChoice",
    "Table",
    "View",
]
