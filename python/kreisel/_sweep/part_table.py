"""The rows of a part: a row for each top, its columns with their units; and events, of which each
top has as many as it met, be they those of a path or the states of a section."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from .._options.quantities import RECORDABLE, TIME
from .._results.ensemble_buffers import STATUSES
from .._results.ensemble_events import EnsembleEvents
from .._results.ensemble_paths import Paths
from .._results.ensemble_result import EnsembleResult
from .._results.ensemble_tables import reduction_columns
from .._results.indicators import Indicator
from .._results.reductions import Reductions
from .._results.section_result import Section
from .._results.tables import quantity_rows
from .parameter_values import ParameterValues, components, unit
from .sweep_plan import SweepPlan
from .task import Became, Growth

Column = npt.NDArray[Any]
COUNT = "events"  # the column that tells how many a top met
RATE = {"lyapunov": "T^-1"}  # of the indicators of chaos the others are pure numbers
_STATES = {"t": TIME, "q": RECORDABLE["q"], "m": RECORDABLE["m"]}
MET = [name for quantity in _STATES.values() for name in quantity.components]


@dataclass
class PartTable:
    """n tops, and e events of all of them.

    columns  (n,) or (n, k) by their names; ragged: (e,), those of a top after those of another
    units    of both, [M L T]; empty for a pure number
    """

    columns: dict[str, Column] = field(default_factory=dict)
    ragged: dict[str, Column] = field(default_factory=dict)
    units: dict[str, str] = field(default_factory=dict)

    def add(self, name: str, values: Column, unit: str = "") -> None:
        """A column with its unit."""
        self.columns[name], self.units[name] = values, unit


def rows_of(plan: SweepPlan, tops: range, outcome: Became) -> PartTable:
    """The rows of tops of these numbers, of which this became."""
    rows, results = PartTable(), list(_result_columns(plan, outcome))
    taken = {name for name, _, _ in results}
    rows.add("top", np.arange(tops.start, tops.stop, dtype=np.int64))
    made = plan.ensemble(tops) if isinstance(outcome, Indicator) else outcome.tops
    starts = plan.source._coords(tops.start, tops.stop, made)
    for name, one in starts.items():
        for column, values in _components(name, one):
            given = f"{column}_given" if column in taken else column  # as spin with want=("spin",)
            rows.add(given, values, unit(name, plan.source._flags.get("degrees", False)))
    for name, values, dimension in results:
        rows.add(name, values, dimension)
    if isinstance(outcome, Section):
        _add_states(rows, outcome)
    elif isinstance(outcome, Paths) and outcome._options.core_events is not None:
        rows.ragged = {"event_which": outcome.events.which}
        rows.ragged |= {"event_direction": outcome.events.direction}
        _add_states(rows, outcome.events)
    return rows


def _components(name: str, one: ParameterValues) -> Iterator[tuple[str, Column]]:
    names = components(name, one.value)
    flat = one.values.reshape(len(one.values), len(names))
    return ((column, flat[:, i]) for i, column in enumerate(names))


def _result_columns(plan: SweepPlan, outcome: Became) -> Iterator[tuple[str, Column, str]]:
    """Yield the name, values and unit of each result of the tops."""
    if isinstance(outcome, Indicator):
        assert isinstance(plan.asked, Growth)
        yield from _indicator_columns(plan.asked.verb, outcome)
        return
    yield from _status_columns(outcome)
    if isinstance(outcome, Reductions):
        yield from reduction_columns(outcome, dict(outcome.items()))
    elif isinstance(outcome, Paths):
        yield from _state_columns(outcome)


def _indicator_columns(name: str, outcome: Indicator) -> Iterator[tuple[str, Column, str]]:
    """An indicator of chaos at the last time, its curve, and what certifies them."""
    unit, curve = RATE.get(name, ""), outcome.curve
    names, which = np.unique(outcome.status, return_inverse=True)
    yield "status", np.array([STATUSES.index(each) for each in names], dtype=np.int8)[which], ""
    yield name, curve[:, -1], unit
    yield "certificate", outcome.certificate, ""
    yield "t", np.broadcast_to(outcome.t, curve.shape), TIME.dimension
    yield f"{name}_curve", curve, unit


def _state_columns(outcome: Paths) -> Iterator[tuple[str, Column, str]]:
    """The states of each top, or what is wanted in their place."""
    yield "t", np.broadcast_to(outcome.t, (outcome.size, outcome.t.shape[-1])), TIME.dimension
    for quantity, values in quantity_rows(outcome, (), False, False):
        flat = values.reshape(*values.shape[:2], quantity.doubles)
        for i, name in enumerate(quantity.components):
            yield name, flat[:, :, i], quantity.dimension


def _status_columns(outcome: EnsembleResult) -> Iterator[tuple[str, Column, str]]:
    """Yield the columns of status, time reached and step counts."""
    yield "status", outcome.status, ""
    yield "reached", outcome.reached, TIME.dimension
    yield "steps", outcome.steps, ""


def _add_states(rows: PartTable, met: EnsembleEvents | Section) -> None:
    """The states at events, and how many there are of each top."""
    rows.add(COUNT, met.count)
    for name, quantity in _STATES.items():
        values = getattr(met, name).reshape(-1, quantity.doubles)
        for i, component in enumerate(quantity.components):
            rows.ragged[f"event_{component}"] = values[:, i]
            rows.units[f"event_{component}"] = quantity.dimension
