"""The rows of a part: a row for each top, its columns with their units; and events, of which each
top has as many as it met."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from .._recording.many_events import ManyEvents
from .._recording.outcomes import Outcomes
from .._recording.paths import Paths
from .._recording.reduced import Reduced
from .._recording.tables import tabled
from .._recording.tables_of_tops import kept_columns
from .._request.quantities import TIME, WANTED
from .planned import SweepPlan
from .start_words import Given, components, unit

Column = npt.NDArray[Any]
COUNT = "events"  # the column that tells how many a top met
_STATES = {"t": TIME, "q": WANTED["q"], "m": WANTED["m"]}
MET = [name for quantity in _STATES.values() for name in quantity.components]


@dataclass
class Rows:
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


def rows_of(plan: SweepPlan, tops: range, outcome: Paths | Reduced) -> Rows:
    """The rows of tops of these numbers, of which this became."""
    rows, results = Rows(), list(_results(outcome))
    taken = {name for name, _, _ in results}
    rows.add("top", np.arange(tops.start, tops.stop, dtype=np.int64))
    starts = plan.source._coords(tops.start, tops.stop, outcome.tops)
    for name, one in starts.items():
        for column, values in _components(name, one):
            given = f"{column}_given" if column in taken else column  # as spin with want=("spin",)
            rows.add(given, values, unit(name, plan.source._flags.get("degrees", False)))
    for name, values, dimension in results:
        rows.add(name, values, dimension)
    if isinstance(outcome, Paths) and outcome.events is not None:
        _add_events(rows, outcome.events)
    return rows


def _components(name: str, one: Given) -> Iterator[tuple[str, Column]]:
    names = components(name, one.value)
    flat = one.values.reshape(len(one.values), len(names))
    return ((column, flat[:, i]) for i, column in enumerate(names))


def _results(outcome: Paths | Reduced) -> Iterator[tuple[str, Column, str]]:
    """What is known of each top behind its start: name, values, unit."""
    yield from _how(outcome)
    if isinstance(outcome, Reduced):
        yield from kept_columns(outcome, dict(outcome.items()))
        return
    yield "t", np.broadcast_to(outcome.t, (outcome.size, outcome.t.shape[-1])), TIME.dimension
    for quantity, values in tabled(outcome, (), False, False):
        flat = values.reshape(*values.shape[:2], quantity.doubles)
        for i, name in enumerate(quantity.components):
            yield name, flat[:, :, i], quantity.dimension


def _how(outcome: Outcomes) -> Iterator[tuple[str, Column, str]]:
    """How a top went, how far it came, and what that cost."""
    yield "status", outcome.status, ""
    yield "reached", outcome.reached, TIME.dimension
    yield "steps", outcome.steps, ""


def _add_events(rows: Rows, met: ManyEvents) -> None:
    rows.add(COUNT, met.count)
    rows.ragged = {"event_which": met.which, "event_direction": met.direction}
    for name, quantity in _STATES.items():
        values = getattr(met, name).reshape(len(met), quantity.doubles)
        for i, component in enumerate(quantity.components):
            rows.ragged[f"event_{component}"] = values[:, i]
            rows.units[f"event_{component}"] = quantity.dimension
