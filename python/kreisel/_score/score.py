"""Scores: the errors of motions that other programs computed, and the mistakes that explain them.

The true motion at the times of a file comes from kreisel. Errors of the energy and of the momentum
are differences from the true motion, which does not conserve them in every case.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path as File
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from .._model.scene import Scene, validate_one_top
from .._solve.solve import solve
from .._utils.arguments import (
    RADIANS_PER_DEGREE,
    Array,
    ReadOnlyArrays,
    as_finite_array,
    as_positive,
    format_count,
    freeze_arrays,
    short_repr,
    spell,
    unknown_name_message,
)
from .._utils.html import format_picture_as_html
from ..quaternion import attitude_error, turn_back
from .mistakes import ALIGNED, Motion, list_relabellings, list_wrong_motions
from .results import ComputedMotion, Results, read_motion
from .suite import Case, join, load_cases

if TYPE_CHECKING:
    from .._plot.charts import FigureAxes

LEVELS = "engine", "science"
_WINDOW = 30.0  # angle of the motion in which mistakes are searched for [rad]
_LEAST_ROWS, _MOST_ROWS = 8, 64  # of this window, the first of them if the file has as many
_FEWEST_ROWS = 3  # that tell a mistake
_LONGEST_WINDOW = 300.0  # angle of the motion of the least number of rows [rad]
_TELLING = 0.25  # a mistake explains an error that it reduces by this factor
_SIMPLER = 10.0  # two mistakes must explain an error better than one by this factor
_ALIKE = 2.0  # mistakes that explain an error equally well up to this factor are all named
_DRIFT = 1e-3  # a larger relative change of the energy is a mistake
_STEADY = 0.9  # least factor between the energy errors of successive quarters of a steady drift
_TINY = np.finfo(np.float64).tiny  # in place of a scale that is zero


class _Errors(NamedTuple):
    """The errors (n,) of a run at its times, as described in Score."""

    t: Array
    attitude: Array
    velocity: Array
    energy: Array
    momentum: Array
    direction: Array


@dataclass(frozen=True, eq=False, repr=False)
class Score(ReadOnlyArrays):
    """The result of kreisel.score: the errors of a computed motion, or of k of them.

    The numbers are floats for one file, and arrays (k,) for a list of files. Errors that need
    angular velocities are NaN if the file has none.

    case             the name of the case, or '' for another scene
    limit            the largest attitude error that the level allows [rad]
    names            the names of the files
    steps            the steps of the files [T]
    attitude_error   the largest angle between computed and true attitude [rad]; infinite if a state
                     of the file is not finite
    final_error      this angle at the last time [rad]
    rms_error        the root of its mean square [rad]
    velocity_error   the largest error of the angular velocity, relative to the largest one
    energy_error     the largest change of the energy from the true one, with its sign, relative to
                     the largest kinetic energy plus mass * |gravity| * |com|
    momentum_error   the largest change of the size of the momentum from the true one, with its
                     sign, relative to the largest one
    direction_error  the largest angle between computed and true momentum [rad]
    order            the order of convergence, or NaN unless there are several steps
    mistakes         the names of the mistakes that explain the errors of the file with the smallest
                     step, the most likely first; several mistakes can cause the same motion
    """

    case: str
    limit: float
    names: tuple[str, ...]
    steps: Any
    attitude_error: Any
    final_error: Any
    rms_error: Any
    velocity_error: Any
    energy_error: Any
    momentum_error: Any
    direction_error: Any
    order: float
    mistakes: tuple[str, ...]
    _errors: tuple[_Errors, ...]

    def __post_init__(self) -> None:
        freeze_arrays(self)

    @property
    def is_within(self) -> bool:
        """True if the attitude error is within the level, of several files at the smallest step."""
        return bool(np.ravel(self.attitude_error)[np.argmin(self.steps)] <= self.limit)

    def __repr__(self) -> str:
        verdict = "within" if self.is_within else "above"
        least = np.ravel(self.attitude_error)[np.argmin(self.steps)]
        return f"<kreisel.Score: {least:.2g} rad, {verdict} {self.limit:g} rad>"

    def __str__(self) -> str:
        heads = ("step", "attitude", "final", "rms", "velocity", "energy", "momentum", "direction")
        columns = np.transpose([np.ravel(getattr(self, name)) for name in _NUMBERS]).tolist()
        width = max(4, *map(len, self.names))
        lines = ["  ".join([f"{'file':<{width}}", *(f"{head:>9}" for head in heads)])]
        for name, row in zip(self.names, columns, strict=True):
            cells = ["-" if np.isnan(x) else f"{x:.2g}" for x in row]
            lines.append("  ".join([f"{name:<{width}}", *(f"{cell:>9}" for cell in cells)]))
        if not np.isnan(self.order):
            lines.append(f"order of convergence: {self.order:.2f}")
        if self.mistakes:
            lines.append(f"likely mistake: {', or: '.join(self.mistakes)}")
        verdict = "within" if self.is_within else "above"
        lines.append(f"the attitude error is {verdict} the level of {self.limit:g} rad")
        return "\n".join(lines)

    def plot(self) -> FigureAxes:
        """Plot the errors of attitude and energy over time with matplotlib, and return the axes.

        To save the figure to a file, call `score.plot().figure.savefig("score.png")`. Raises
        ImportError if matplotlib is not installed.
        """
        from .._plot.charts import plot_errors_of_runs

        return plot_errors_of_runs(self.names, self._errors, self.limit, "s" if self.case else "T")

    def _repr_html_(self) -> str | None:
        return format_picture_as_html(lambda: self.plot()[0], repr(self))


_NUMBERS = (
    "steps", "attitude_error", "final_error", "rms_error", "velocity_error", "energy_error",
    "momentum_error", "direction_error",
)  # fmt: skip


def score(
    results: Results | Sequence[Results],
    case: str | Scene | None = None,
    *,
    steps: ArrayLike | None = None,
    level: str | float = "engine",
) -> Score:
    """Compare the motion that another program computed with the true one.

    results  the name of a CSV file, or a mapping of names to arrays (n,), or to arrays (n, 4) and
             (n, 3); or a list of them, computed with different steps. The names are those of the
             files of the suite, t, qw, qx, qy, qz, wx, wy, wz, or similar ones such as
             time, quat_w or angular_velocity.x. The angular velocity may be missing, or be given
             along the axes of the body or of space. The times are any ascending ones from 0 on [T]
    case     the name of a case of the suite, or a kr.Scene. By default, the case whose name begins
             the name of the file
    steps    the step of each file, for the order of convergence [T]; by default, the distance of
             the times
    level    the attitude error allowed: "engine" or "science", as in the files of the suite, or a
             number [rad]

    Mistakes are found by comparing the motion with those that common mistakes cause, in the first
    turns. Raises ValueError for files without times or attitudes, and for names that are unknown.

        >>> import kreisel as kr
        >>> path = kr.solve(kr.scenes.dzhanibekov, [0.0, 1.0, 2.0])
        >>> result = {"t": path.t, "q": path.q * [1, -1, -1, -1]}
        >>> kr.score(result, kr.scenes.dzhanibekov).mistakes
        ('inverse attitude',)
    """
    is_one = not isinstance(results, list | tuple)
    given: Any = [results] if is_one else results
    if not given:
        raise ValueError("results is empty: give at least one file")
    runs = [read_motion(one) for one in given]
    chosen = _find_case(case, runs[0].name)
    limit = _read_level(level, chosen)
    if steps is None:
        sizes = np.array(
            [np.median(np.diff(run.t)) if len(run.t) > 1 else run.t[0] for run in runs]
        )
    else:
        sizes = np.ravel(as_finite_array("steps", steps, "a list of steps"))
        if len(sizes) != len(runs) or not (sizes > 0.0).all():
            count = format_count(len(runs), "positive number")
            raise ValueError(f"{spell('steps')} must be {count}, one for each file")
    finest = runs[int(np.argmin(sizes))]
    found = [_compare(chosen, run, run is finest) for run in runs]
    errors = [one for one, _ in found]
    attitudes = [one.attitude for one in errors]
    columns: list[Any] = [
        sizes,
        [angles.max() for angles in attitudes],
        [angles[-1] for angles in attitudes],
        [np.sqrt(np.mean(angles**2)) for angles in attitudes],
        *([_find_largest(getattr(one, name)) for one in errors] for name in _Errors._fields[2:]),
    ]
    numbers: list[Any] = [float(values[0]) if is_one else np.array(values) for values in columns]
    return Score(
        case=chosen.name,
        limit=limit,
        names=tuple(run.name for run in runs),
        **dict(zip(_NUMBERS, numbers, strict=True)),
        order=_estimate_order(sizes, np.array(columns[1])),
        mistakes=tuple(name for _, names in found for name in names),
        _errors=tuple(errors),
    )


def _find_case(case: str | Scene | None, file: str) -> Case:
    cases = load_cases()
    if isinstance(case, Scene):
        return Case("", "", validate_one_top("case", case), 0.0)
    if case is None:
        names = [name for name in cases if File(file).name.startswith(name)]
        if not names:
            known = ", ".join(cases)
            raise ValueError(f"give {spell('case')}: {file} begins with none of {known}")
        return cases[max(names, key=len)]
    if not isinstance(case, str):
        raise TypeError(f"{spell('case')} must be a name or a kr.Scene, not {short_repr(case)}")
    if case not in cases:
        raise ValueError(unknown_name_message("case", case, cases))
    return cases[case]


def _read_level(level: str | float, case: Case) -> float:
    if isinstance(level, str):
        if level not in LEVELS:
            raise ValueError(unknown_name_message("level", level, LEVELS))
        return float(getattr(case, level))
    return as_positive("level", level)


def _compare(case: Case, run: ComputedMotion, is_explained: bool) -> tuple[_Errors, list[str]]:
    """Return the errors of a motion and, if `is_explained`, the mistakes that explain them."""
    pieces, scene = case.solve(run.t), case.scene
    true_q, true_w, true_m = (join(pieces, name) for name in ("q", "body_velocity", "m"))
    attitude = attitude_error(run.q, true_q)
    mistakes = [*run.problems, *_find_mistakes(case, run, true_q, true_w)] if is_explained else []
    if not run.is_whole:
        attitude[-1] = np.inf
    velocity, energy, momentum, direction = np.full((4, len(run.t)), np.nan)
    if np.isfinite(run.w).all():
        w, is_in_degrees = _choose_velocities(run, true_w)
        energies, momenta = _measure_states(scene, run.t, run.q, w)
        lever = scene.body.mass * abs(scene.gravity) * float(np.linalg.norm(scene.body.com))
        velocity = _norm(w - true_w) / max(_norm(true_w).max(), _TINY)
        energy = energies - join(pieces, "energy")
        energy /= max(join(pieces, "kinetic").max() + lever, _TINY)
        momentum = (_norm(momenta) - _norm(true_m)) / max(_norm(true_m).max(), _TINY)
        direction = np.arctan2(_norm(np.cross(momenta, true_m)), (momenta * true_m).sum(axis=1))
        if is_explained and is_in_degrees:
            mistakes.append("angular velocity in degrees")
        if is_explained and not mistakes and attitude.max() > case.science:
            mistakes += _describe_drift(energy)
    return _Errors(run.t, attitude, velocity, energy, momentum, direction), mistakes


def _norm(vectors: Array) -> Array:
    lengths: Array = np.sqrt((vectors**2).sum(axis=1))
    return lengths


def _choose_velocities(run: ComputedMotion, true_w: Array) -> tuple[Array, bool]:
    """Return the angular velocities in the body, and whether the file has them in degrees.

    The file has them along the axes of the body or of space, whichever is closer to the truth.
    """
    in_body = np.stack(turn_back(tuple(run.q.T), tuple(run.w.T)), axis=-1)
    forms = [run.w, in_body, run.w * RADIANS_PER_DEGREE, in_body * RADIANS_PER_DEGREE]
    gaps = [float(np.median(_norm(form - true_w))) for form in forms]
    least = min(*gaps[:2], float(np.median(_norm(true_w))))
    is_in_degrees = min(gaps[2:]) < _TELLING * least
    best = int(np.argmin(gaps if is_in_degrees else gaps[:2]))
    return forms[best], is_in_degrees


def _measure_states(scene: Scene, t: Array, q: Array, w: Array) -> tuple[Array, Array]:
    """Return the energies (n,) and momenta (n, 3) of states of a scene."""
    words: dict[str, Any] = {"attitude": q, "body_velocity": w}
    if scene.shaking[0]:
        amplitude, rate, phase = scene.shaking
        words["shaking"] = np.stack(np.broadcast_arrays(amplitude, rate, phase + rate * t), axis=-1)
    path = solve(scene.replace(**words), [0.0])
    return path.energy[:, 0], path.m[:, 0]


def _describe_drift(energy: Array) -> list[str]:
    """Return the mistake that a growing or falling energy tells."""
    if len(energy) < 4:
        return []
    means = np.array([part.mean() for part in np.array_split(energy, 4)])
    sizes = means * np.sign(means[-1])
    is_steady = bool((sizes[1:] >= _STEADY * sizes[:-1]).all() and sizes[0] >= 0.0)
    if not is_steady or sizes[-1] < _DRIFT:
        return []
    return ["numerical damping" if means[-1] < 0.0 else "numerical gain of energy"]


def _find_mistakes(case: Case, run: ComputedMotion, true_q: Array, true_w: Array) -> list[str]:
    """Return the mistakes whose motions are those of the run, in its first turns."""
    speed = _norm(true_w)
    angle = np.cumsum(speed * np.diff(run.t, prepend=0.0))
    first, last = np.searchsorted(angle, [_WINDOW, _LONGEST_WINDOW]).tolist()
    n = max(first, min(_LEAST_ROWS, last))
    if n < _FEWEST_ROWS:
        return []
    rows = np.unique(np.linspace(0, n - 1, _MOST_ROWS).astype(int))
    t, q, true_q = run.t[rows], run.q[rows], true_q[rows]
    as_it_is = _compute_rms_angle(q, true_q)
    if as_it_is <= case.science:
        return []
    wrong = list_wrong_motions(case, t, float(speed[:n].max()))
    relabelled = list(list_relabellings(q, true_q[0]))
    gaps: dict[tuple[str, ...], float] = {}
    for (motion, true), (label, meant) in product([Motion("", true_q), *wrong], relabelled):
        names = tuple(filter(None, (motion, label)))
        if names and not (motion and label in ALIGNED) and np.isfinite(true).all():
            gaps[names] = min(_compute_rms_angle(meant, true), gaps.get(names, np.inf))
    best = min(gaps, key=lambda names: gaps[names] * _SIMPLER ** (len(names) - 1))
    if gaps[best] > _TELLING * as_it_is:
        return []
    alike = [names for names, gap in gaps.items() if gap <= _ALIKE * gaps[best]]
    alike = [names for names in alike if len(names) == len(best)]
    return [" and ".join(names) for names in sorted(alike, key=lambda names: gaps[names])]


def _compute_rms_angle(q: Array, true: Array) -> float:
    return float(np.sqrt(np.mean(attitude_error(q, true) ** 2)))


def _find_largest(values: Array) -> float:
    """Return the value of the largest size, with its sign."""
    return float(values[np.argmax(abs(values))])


def _estimate_order(steps: Array, errors: Array) -> float:
    """Return the slope of the errors over the steps, in logarithms, or NaN."""
    is_known = (steps > 0.0) & (errors > 0.0) & np.isfinite(errors)
    if len(set(steps.tolist())) < 2 or not is_known.all():
        return float("nan")
    return float(np.polyfit(np.log(steps), np.log(errors), 1)[0])
