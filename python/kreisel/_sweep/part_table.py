"""Tables of the tops in a part of a sweep, with one row per top and units for all columns.

Events are stored in separate columns with one row per event, because the number of events varies
between tops.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from .._options.quantities import RECORDABLE, TIME
from .._results.ensemble_buffers import STATUSES
from .._results.ensemble_events import EnsembleEvents
from .._results.ensemble_paths import Paths
from .._results.ensemble_result import EnsembleResult
from .._results.ensemble_tables import yield_reduction_columns
from .._results.indicators import Indicator
from .._results.reductions import Reductions
from .._results.section_result import Section
from .._results.tables import build_quantity_value_pairs
from .._utils.units import get_parameter_unit
from .start_parameters import list_parameter_component_names
from .sweep_plan import SweepPlan
from .task import ChaosTask, TaskResult

Column = npt.NDArray[Any]
ColumnWithUnit = tuple[str, Column, str]  # name, values, unit
COUNT = "events"  # name of the column with the number of events of each top
RATE = {"lyapunov": "T^-1"}  # units of indicators of chaos; all other indicators are dimensionless
_STATES = {"t": TIME, "q": RECORDABLE["q"], "m": RECORDABLE["m"]}
EVENT_STATE = [name for quantity in _STATES.values() for name in quantity.components]


@dataclass
class PartResults:
    """A table of the results and events of the tops in one part of a sweep.

    columns  {name: values (n,) or (n, k)} of the tops
    ragged   {name: values (e,)} of the events, sorted by top
    units    {name: dimension [M L T]}; an empty string for a dimensionless column
    """

    columns: dict[str, Column] = field(default_factory=dict)
    ragged: dict[str, Column] = field(default_factory=dict)
    units: dict[str, str] = field(default_factory=dict)


def tabulate_sweep_part(plan: SweepPlan, tops: range, outcome: TaskResult) -> PartResults:
    """Return a table of the tops with the given indices, including their results."""
    results = _build_result_columns(plan, outcome)
    names = [name for name, _, _ in results]
    part = PartResults({"top": np.arange(tops.start, tops.stop, dtype=np.int64)}, {}, {"top": ""})
    ensemble = plan.build_ensemble_of_tops(tops) if isinstance(outcome, Indicator) else outcome.tops
    for name, one in plan.source._list_varying_values(tops.start, tops.stop, ensemble).items():
        flat = one.values.reshape(len(one.values), -1)
        for i, component in enumerate(list_parameter_component_names(name, one.value)):
            # A recorded quantity can have the name of a parameter, as spin with want=("spin",).
            column = f"{component}_given" if component in names else component
            part.columns[column], part.units[column] = (
                flat[:, i],
                get_parameter_unit(name, one.degrees, i),
            )
    for name, values, dimension in results:
        part.columns[name], part.units[name] = values, dimension
    if isinstance(outcome, Section):
        _add_event_columns(part, outcome)
    elif isinstance(outcome, Paths) and outcome._options.core_events is not None:
        part.ragged = {"event_which": outcome.events.which}
        part.ragged |= {"event_direction": outcome.events.direction}
        _add_event_columns(part, outcome.events)
    return part


def _build_result_columns(plan: SweepPlan, outcome: TaskResult) -> list[ColumnWithUnit]:
    """Return the columns that contain the results of the tops, excluding their parameters."""
    if isinstance(outcome, Indicator):
        assert isinstance(plan.task, ChaosTask)
        return _build_chaos_indicator_columns(plan.task.name, outcome)
    columns = _build_status_columns(outcome)
    if isinstance(outcome, Reductions):
        columns += yield_reduction_columns(outcome, dict(outcome.items()))
    elif isinstance(outcome, Paths):
        columns += _build_state_columns(outcome)
    return columns


def _build_chaos_indicator_columns(name: str, outcome: Indicator) -> list[ColumnWithUnit]:
    """Return the status, final value, classification and time series of an indicator as columns."""
    unit, curve = RATE.get(name, ""), outcome.curve
    names, indices = np.unique(outcome.status, return_inverse=True)
    codes = np.array([STATUSES.index(each) for each in names], dtype=np.int8)
    return [
        ("status", codes[indices], ""),
        (name, curve[:, -1], unit),
        ("certificate", outcome.certificate, ""),
        ("is_chaotic", np.asarray(outcome.is_chaotic), ""),
        ("is_doubtful", np.asarray(outcome.is_doubtful), ""),
        ("t", np.broadcast_to(outcome.t, curve.shape), TIME.dimension),
        (f"{name}_curve", curve, unit),
    ]


def _build_state_columns(outcome: Paths) -> list[ColumnWithUnit]:
    """Return the columns that contain the times and the recorded quantities of all tops."""
    times = np.broadcast_to(outcome.t, (outcome.size, outcome.t.shape[-1]))
    columns = [("t", times, TIME.dimension)]
    for quantity, values in build_quantity_value_pairs(outcome, (), False, False):
        flat = values.reshape(*values.shape[:2], quantity.doubles)
        for i, name in enumerate(quantity.components):
            columns.append((name, flat[:, :, i], quantity.dimension))
    return columns


def _build_status_columns(outcome: EnsembleResult) -> list[ColumnWithUnit]:
    """Return the columns that contain the status, the final time and the number of steps."""
    buffers = outcome._buffers
    return [
        ("status", buffers.status, ""),
        ("reached", buffers.reached, TIME.dimension),
        ("steps", buffers.counts[:, 0], ""),
    ]


def _add_event_columns(part: PartResults, events: EnsembleEvents | Section) -> None:
    """Add columns that contain the recorded events and the number of events of each top."""
    part.columns[COUNT], part.units[COUNT] = events.count, ""
    for name, quantity in _STATES.items():
        values = getattr(events, name).reshape(-1, quantity.doubles)
        for i, component in enumerate(quantity.components):
            part.ragged[f"event_{component}"] = values[:, i]
            part.units[f"event_{component}"] = quantity.dimension
