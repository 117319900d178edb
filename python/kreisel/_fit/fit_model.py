"""The fitted motion between the measurements, as the instruments would measure it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .._plot.dense_motion import compute_duration_of_turn, subdivide_times
from .._utils.arguments import Array
from .parameters import FitPoint, FreeParameters
from .records import Record, Series, slice_record
from .residuals import ResidualModel


def predict_measurements_densely(
    parameters: FreeParameters,
    pieces: Sequence[tuple[float, FitPoint]],
    records: Sequence[Record],
) -> list[dict[str, tuple[Array, Array]]]:
    """Return for each record {quantity: (times, values)}, dense enough to be joined by lines.

    A line is interrupted by NaN where an angle jumps and between the pieces of the motion. A
    quantity is missing if it is an attitude, or if the motion has too many turns for a line.
    """
    turn = compute_duration_of_turn(parameters.to_scene(pieces[0][1]), is_seen_from_body=True)
    dense = [_sample_record(record, turn) for record in records]
    lines: list[dict[str, tuple[Array, Array]]] = [{} for _ in records]
    begins = np.array([begin for begin, _ in pieces])
    for k, (begin, point) in enumerate(pieces):
        edges = [begin if k else -np.inf, *begins[k + 1 : k + 2], np.inf][:2]
        places = [np.searchsorted(record.t, edges) for record in dense]
        parts = [
            slice_record(record, int(first), int(last), begin)
            for record, (first, last) in zip(dense, places, strict=True)
        ]
        if not any(part.series for part in parts):
            break
        sigmas = [np.ones_like(series.values) for part in parts for series in part.series]
        model = ResidualModel(parameters, parts, sigmas, origin=begin)
        residuals = model.evaluate_residuals(point, has_jacobian=False).residuals
        for rows in model.rows:
            series, t = rows.series, parts[rows.record].t + begin
            values = (series.values + rows.select_series_residuals(residuals)) / series.unit
            line = _insert_gaps(t, values, np.pi / series.unit if series.is_angle else np.inf)
            begun = lines[rows.record].get(series.name, (t[:0], values[:0]))
            t, values = (np.concatenate(pair) for pair in zip(begun, line, strict=True))
            lines[rows.record][series.name] = t, values
    return lines


def _sample_record(record: Record, turn: float) -> Record:
    """Return a record at dense times, with the values measured nearest to each time.

    The residuals of angles refer to the nearest turn of these values. The record has no series if
    too many times would be needed.
    """
    times = subdivide_times(record.t, turn)
    part = slice_record(record, 0, 0)
    part.__dict__["t"] = record.t[:0] if times is None else times
    part.__dict__["series"] = tuple(
        _sample_series(record.t, one, times)
        for one in record.series
        if times is not None and not one.is_attitude and one.measured.any()
    )
    return part


def _sample_series(t: Array, series: Series, times: Array) -> Series:
    rows = np.flatnonzero(series.measured.any(axis=1))
    near = rows[np.rint(np.interp(times, t[rows], np.arange(len(rows)))).astype(int)]
    values = series.values[near]
    return series._replace(values=values, measured=np.ones(values.shape, bool), sigma=None)


def _insert_gaps(t: Array, values: Array, jump: float) -> tuple[Array, Array]:
    """Insert NaN before each change of a value by more than `jump`, and at the end."""
    gaps = np.flatnonzero((np.abs(np.diff(values, axis=0)) > jump).any(axis=1)) + 1
    gaps = np.append(gaps, len(t))
    return np.insert(t, gaps, np.nan), np.insert(values, gaps, np.nan, axis=0)
