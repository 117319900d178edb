"""Angles about the vertical and the apex, which are undefined where the apex is vertical."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np

from .._model.scene import Scene
from .._results.path import Error
from .._solve.solve import solve
from .._utils.counts import format_count
from .._utils.errors import warn_user
from .._utils.validation import Array
from .fit_result import Fit
from .records import Mask, Record, leave_out_rows
from .residuals import STEPS_MOST

_UNDEFINED = ("precession_angle", "spin_angle")
_VERTICAL = 1e-3  # lean [rad] up to which these angles change too fast for linear equations
_TIMES_NAMED = 3
_GUESS, _FIT = "scene", "fitted motion"


def search_with_defined_angles(
    records: tuple[Record, ...],
    guesses: Iterable[Scene],
    search: Callable[[tuple[Record, ...]], Fit],
) -> Fit:
    """Search for the best fit to those angles that are defined in the motions of all guesses.

    If angles are undefined in the fitted motion, the search is repeated without them. Otherwise
    they would hold the apex at the vertical, because the least lean can explain any such angle. If
    all angles of a quantity are undefined, the guess says nothing about them, and they are kept.

    Warns if angles are left out. Raises ValueError if all angles of a quantity are undefined in the
    fitted motion.
    """
    if not any(series.quantity in _UNDEFINED for record in records for series in record.series):
        return search(records)
    leaning = _leave_out_angles(records, _find_vertical_times_of_scenes(guesses, records), _GUESS)
    while True:
        fit = search(leaning)
        masks = _find_vertical_times_of_fit(fit)
        fewer = _leave_out_angles(leaning, masks, _FIT)
        if fewer is leaning:
            return fit
        leaning = fewer


def _find_vertical_times_of_scenes(
    scenes: Iterable[Scene], records: tuple[Record, ...]
) -> list[Mask]:
    """Return masks of the times at which the apex of a scene is vertical, one for each record."""
    masks: list[Mask] = [np.zeros(len(record.t), dtype=bool) for record in records]
    for scene in scenes:
        for record, mask in zip(records, masks, strict=True):
            for rows in (np.flatnonzero(record.t < 0.0)[::-1], np.flatnonzero(record.t >= 0.0)):
                try:
                    path = solve(scene, record.t[rows], "taylor", max_steps=STEPS_MOST)
                except (Error, ValueError):
                    continue  # the search reports scenes that cannot be solved
                mask[rows] |= _is_vertical(path.apex)
    return masks


def _find_vertical_times_of_fit(fit: Fit) -> list[Mask]:
    path, is_vertical = fit.path, _is_vertical(fit.path.apex)
    return [
        is_vertical[np.searchsorted(path.t, record.t - fit.values.get(f"delay[{i}]", 0.0))]
        for i, record in enumerate(fit.records)
    ]


def _is_vertical(apex: Array) -> Mask:
    is_vertical: Mask = np.hypot(apex[:, 0], apex[:, 1]) < _VERTICAL
    return is_vertical


def _leave_out_angles(
    records: tuple[Record, ...], masks: list[Mask], motion: str
) -> tuple[Record, ...]:
    """Return the records without the angles at the times in `masks`, or the same tuple."""
    found = tuple(
        _leave_out_angles_of_record(record, mask, motion)
        for record, mask in zip(records, masks, strict=True)
    )
    is_same = all(new is old for new, old in zip(found, records, strict=True))
    return records if is_same else found


def _leave_out_angles_of_record(record: Record, is_vertical: Mask, motion: str) -> Record:
    rows: Mask = np.zeros(len(record.t), dtype=bool)
    names: list[str] = []
    for series in record.series:
        is_measured = series.measured[:, 0]
        is_undefined = is_measured & is_vertical
        if series.quantity not in _UNDEFINED or not is_undefined.any():
            continue
        if (is_undefined == is_measured).all():
            if motion == _GUESS:
                continue
            raise ValueError(
                f"{series.name} is undefined at all its times, because the apex of the {motion} is "
                "vertical then: leave it out, or give a scene that leans"
            )
        names.append(series.name)
        rows |= is_undefined
    if not names:
        return record
    warn_user(
        f"{' and '.join(names)} at {_name_times(record.t[rows])} left out: undefined where the "
        f"apex of the {motion} is vertical"
    )
    return leave_out_rows(record, names, rows)


def _name_times(t: Array) -> str:
    named = ", ".join(f"{time:g}" for time in t[:_TIMES_NAMED])
    rest = len(t) - _TIMES_NAMED
    return f"t = {named}" + (f" and {format_count(rest, 'other time')}" if rest > 0 else "")
