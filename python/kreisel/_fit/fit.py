"""Fits of scenes to records."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress

import numpy as np

from .._model.scene import Scene
from .._results.results import Error, Interrupted
from .._utils.arguments import (
    as_int,
    format_count,
    freeze_arrays,
    short_repr,
    spell,
    unknown_name_message,
    validate_type,
    warn_user,
)
from .parameters import FreeName, FreeParameters, expand_free_names
from .records import SCALAR_LAST, Mask, Record
from .residuals import STEPS_MOST, LossName, describe_uncertain_sigmas, join_paths, solve_from_start
from .result import Fit
from .search import SearchSession

_MISFIT = 0.02  # residuals relative to the values that may be a motion that does not fit
_ORDER_LIMIT = 300  # paths of a search with the other order of quaternions
_CORRELATED = 0.5  # correlation of neighbouring residuals of a motion that does not fit
_FAR_BETTER = 0.5  # residuals of the other order of quaternions, relative to those of the given one
_UNDEFINED = ("precession_angle", "spin_angle")
_VERTICAL = 1e-3  # lean [rad] up to which these angles change too fast for linear equations
Progress = Callable[[int, float], object]
LOSSES: tuple[LossName, ...] = ("linear", "soft")


def fit(
    scene: Scene,
    records: Record | Iterable[Record],
    free: FreeName | Iterable[FreeName] = ("start", "moments"),
    *,
    loss: LossName = "linear",
    pieces: int | None = None,
    max_evaluations: int = 2000,
    progress: Progress | None = None,
) -> Fit:
    """Estimate the body and the initial state of a top from measurements of its motion.

    scene     the known values, and a first guess of the values in `free`. If its motion disagrees
              with the records, other guesses are computed from the records and at random. For an
              scene of many tops, the search begins at each member, and the best result is returned
    records   a kreisel.Record or several records of one motion
    free      names of parameters: "start" ("attitude" and "velocity"), "moments", "com" or its
              length "lever", "gravity", "mass", "damping", "friction", "rotor", "turning",
              "shaking", "gradient" and "axes", the principal axes in the frame of description.
              Moments that are equal in `scene` stay equal. A damping given as one number stays one
              number, and three numbers are estimated apart, except about axes with equal moments if
              they are equal. A rotor excludes "axes"
    loss      "linear": least squares. "soft": large residuals count linearly, for records with
              outliers
    pieces    for chaotic motion: the number of pieces into which the motion is divided (multiple
              shooting). Each piece has its own initial state, and must join the next piece. None:
              as many as the growth of errors requires
    max_evaluations   the largest number of paths, through parts of the records as well, that the
                      search from one scene computes
    progress  a function called after each improvement with the number of computed paths and the
              sum of squares per degree of freedom; an exception in it stops the fit

    During the search, the moments of inertia obey the triangle inequalities, and the friction is
    nonnegative. The initial guesses of `turning` and `shaking` are taken from `scene`. On a turning
    support, a gyroscope measures "inertial_velocity", whereas "body_velocity" is the angular
    velocity relative to the support. The reported errors are first-order standard deviations. The
    errors are enlarged if the residuals are correlated or larger than expected from the given
    standard deviations. Along directions in parameter space that the data do not determine, the
    parameters remain near the values of the initial guess, and their errors are infinite. The
    attribute `unidentified` of the fit describes these directions.

        >>> import kreisel as kr
        >>> import numpy as np
        >>> top = kr.scenes.asymmetric
        >>> t = np.linspace(0.0, 10.0, 200)
        >>> noise = 0.01 * np.random.default_rng(1).normal(size=(200, 3))
        >>> record = kr.Record(t, {"body_velocity": kr.solve(top, t).body_velocity + noise}, 0.01)
        >>> found = kr.fit(top, record)
        >>> found.unidentified
        ('the heading: a rotation of the start about the vertical',)
        >>> abs(found.values["I1"] - top.body.moments[0]) < 3 * found.error["I1"]
        True

    The angles precession_angle and spin_angle are undefined where the apex is vertical. If the apex
    of a guess or of the fitted motion is vertical at the time of such an angle, this angle is left
    out with a warning.

    Raises TypeError or ValueError for invalid arguments, for fewer measured values than free
    parameters, for a quantity that no free parameter affects, for a quantity without sigma whose
    values the free parameters fit exactly, and for angles that are undefined at all times. Raises
    kreisel.Error if no motion can be computed from the initial guesses. Ctrl-C raises
    kreisel.Interrupted, whose attribute `result` is the best fit so far or None.
    Warns (UserWarning) if the search does not converge, if no motion fits the measurements, and if
    noise of the given sigma does not explain chi2 (see `Fit.is_plausible`). Also warns if few
    numbers determine an unknown standard deviation.
    """
    is_many = bool(validate_type("scene", scene, Scene).shape)
    guesses = list(scene.ravel()) if is_many else [scene]
    if not guesses:
        raise ValueError("scene is an array without members")
    blocks, record_tuple = expand_free_names(free), _validate_records(records)
    if loss not in LOSSES:
        raise ValueError(unknown_name_message("loss", str(loss), LOSSES))
    limit = as_int("max_evaluations", max_evaluations, 1)
    count = None if pieces is None else as_int("pieces", pieces, 1)
    if progress is not None and not callable(progress):
        raise TypeError(f"progress must be a function, not {short_repr(progress)}")

    def search(kept: tuple[Record, ...], limit: int = limit) -> Fit:
        sessions = [
            SearchSession(FreeParameters(guess, blocks, kept), kept, loss, limit, progress)
            for guess in guesses
        ]
        for session in sessions:
            session.refuse_too_few_measurements(count)
        return _run_search_sessions(sessions, count, is_multistart=is_many)

    best = _search_with_defined_angles(record_tuple, guesses, search)
    hint, misfit, excess = "", best._describe_misfit(), best._describe_excess()
    is_bad = best.is_plausible is False
    if best.is_plausible is None:
        is_bad = best.misfit > _MISFIT and best.residual_correlation > _CORRELATED
    if is_bad:
        hint = _describe_better_quaternion_order(best, search)
    if misfit:
        warn_user(misfit + hint)
    elif not best.has_converged:
        warn_user(
            f"the fit did not converge within {best.evaluations} paths: the result is the best so "
            f"far; raise {spell('max_evaluations')} or give a guess nearer to the motion"
        )
    elif excess or hint:
        warn_user((excess + hint).strip())
    for sentence in best.uncertain_sigma:
        warn_user(f"{sentence}: give {spell('sigma')}, or add measurements")
    return best


def _describe_better_quaternion_order(
    best: Fit, search: Callable[[tuple[Record, ...], int], Fit]
) -> str:
    """Return a sentence if attitudes that fit badly fit well with the scalar at the other end."""
    names = SCALAR_LAST | {first: last for last, first in SCALAR_LAST.items()}
    name, swapped = "", []
    for record in best.records:
        series = list(record.series)
        for k, one in enumerate(series):
            if one.is_attitude:
                name = names[one.name]
                values = np.roll(one.values, -1 if one.name in SCALAR_LAST else 1, axis=1)
                series[k] = one._replace(name=name, values=values)
        swapped.append(record._replace(record.t, series))
    if not name:
        return ""
    try:
        other = search(tuple(swapped), _ORDER_LIMIT)
    except Interrupted:
        raise Interrupted("the fit was interrupted", result=best) from None
    except (Error, ValueError):
        return ""
    if not other.misfit < _FAR_BETTER * best.misfit:
        return ""
    return (
        f" The quaternions fit better scalar {'last' if name in SCALAR_LAST else 'first'}, with a "
        f"misfit of {other.misfit:.2g} instead of {best.misfit:.2g}: if they are, name them {name}."
    )


def _run_search_sessions(
    sessions: Sequence[SearchSession], pieces: int | None, is_multistart: bool
) -> Fit:
    best: Fit | None = None
    for session in sessions:
        is_interrupted = False
        try:
            session.search(pieces, has_data_guess=not is_multistart)
        except KeyboardInterrupt:
            is_interrupted = True
        if session.best is not None:
            if not is_interrupted:
                session.refuse_start_held_by_friction()
                session.refuse_insensitive_quantities(session.best)
                describe_uncertain_sigmas(session.best, refuses=True)
            found = session.build_fit()
            best = found if best is None or found.cost < best.cost else best
        if is_interrupted:
            raise Interrupted("the fit was interrupted", result=best)
    if best is None:
        sessions[0].refuse_start_held_by_friction()
        sessions[0].check_start_scene_is_solvable()
        raise ValueError(
            "the residuals leave the range of doubles: check the values and their sigma"
        )
    return best


def _search_with_defined_angles(
    records: tuple[Record, ...],
    guesses: Iterable[Scene],
    search: Callable[[tuple[Record, ...]], Fit],
) -> Fit:
    """Search for the best fit to those angles that are defined in the motions of all guesses.

    If angles are undefined in the fitted motion, the search is repeated without them. Otherwise
    they would hold the apex at the vertical, because the least lean can explain any such angle. If
    all angles of a quantity are undefined, the guess says nothing about them, and they are kept.
    """
    if not any(series.quantity in _UNDEFINED for record in records for series in record.series):
        return search(records)
    masks = [np.zeros(len(record.t), dtype=bool) for record in records]
    for scene in guesses:
        for record, mask in zip(records, masks, strict=True):
            with suppress(Error, ValueError):  # the search reports scenes that cannot be solved
                paths = solve_from_start(scene, record.t, max_steps=STEPS_MOST)
                mask |= np.hypot(*join_paths(paths, "apex")[:, :2].T) < _VERTICAL
    records = _leave_out_angles(records, masks, "scene")
    while True:
        found = search(records)
        is_vertical, t = np.hypot(*found.path.apex[:, :2].T) < _VERTICAL, found.path.t
        times = found._point.subtract_delays([record.t for record in records])
        masks = [is_vertical[np.searchsorted(t, each)] for each in times]
        fewer = _leave_out_angles(records, masks, "fitted motion")
        if all(new is old for new, old in zip(fewer, records, strict=True)):
            return found
        records = fewer


def _leave_out_angles(
    records: tuple[Record, ...], masks: Sequence[Mask], motion: str
) -> tuple[Record, ...]:
    """Return the records without angles at the times in `masks`; others are the same objects."""
    kept = []
    for record, is_vertical in zip(records, masks, strict=True):
        names, left_out, series = [], np.zeros(len(record.t), dtype=bool), list(record.series)
        for k, one in enumerate(series):
            is_measured = one.measured[:, 0]
            is_undefined = is_measured & is_vertical
            if one.quantity not in _UNDEFINED or not is_undefined.any():
                continue
            if (is_undefined != is_measured).any():
                names.append(one.name)
                left_out |= is_undefined
                values = np.where(is_undefined[:, None], 0.0, one.values)
                series[k] = one._replace(
                    values=values, measured=one.measured & ~is_undefined[:, None]
                )
            elif motion != "scene":
                raise ValueError(
                    f"{one.name} is undefined at all its times, because the apex of the {motion}"
                    " is vertical then: leave it out, or give a scene that leans"
                )
        if names:
            t = record.t[left_out]
            times = ", ".join(f"{time:g}" for time in t[:3])
            if len(t) > 3:
                times += f" and {format_count(len(t) - 3, 'other time')}"
            warn_user(
                f"{' and '.join(names)} at t = {times} left out: undefined where the apex of the "
                f"{motion} is vertical"
            )
            freeze_arrays(series)
        kept.append(record._replace(record.t, series) if names else record)
    return tuple(kept)


def _validate_records(records: object) -> tuple[Record, ...]:
    items = [records] if isinstance(records, Record) else records
    if not isinstance(items, Iterable) or isinstance(items, str):
        raise TypeError(f"records must be kreisel.Record objects, not {short_repr(records)}")
    record_tuple = tuple(items)
    if not record_tuple:
        raise ValueError("records is empty: give at least one kreisel.Record")
    for i, record in enumerate(record_tuple):
        validate_type(f"records[{i}]", record, Record)
    return record_tuple
