"""Closed-form solutions for all tops in an ensemble."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np
import numpy.typing as npt

from .._core import (
    Work,
    courses,
    exact_rates,
    exact_states_of_tops,
    exact_turnings,
    horizons,
    statuses,
    torus_heads,
    unsuited,
)
from .._model.environment import has_equivalent_support_at_rest
from .._model.scene import Ensemble, Scene
from .._model.turning_points import (
    TurningPoints,
    build_turning_points_from_rows,
    explain_no_turning_points,
)
from .._options.ensemble_options import (
    format_index,
    get_member_by_flat_index,
    unravel_index,
    validate_ensemble_options,
    validate_thread_count,
)
from .._options.methods import EXACT, explain_no_closed_form, methods
from .._options.times import check_resolvable_horizon
from .._results.ensemble_buffers import LANES, Codes
from .._results.ensemble_paths import Paths
from .._results.executor import DivisibleTask, Job, WorkerPool
from .._results.run_ensemble import run_ensemble
from .._utils.validation import Array, Numbers, as_finite_array, freeze_array, validate_type


@dataclass(frozen=True, eq=False)
class ExactEnsemble:
    """The motions of all tops in an ensemble, given in closed form.

    Calling the object with a single time returns the states in an array of shape (*shape, 8). Each
    state consists of t, q (w, x, y, z) and m, as in a kreisel.Path. Calling it with k times, or
    with an array (*shape, k) of separate times for each top, returns an array (*shape, k, 8).
    `shape` is the shape of the ensemble, or (n,) for a list of n scenes.

    period, precession_rate, spin_angle_rate and the attributes of the turning points are arrays of
    shape `shape`, computed on first access. The attributes agree with those of kreisel.exact for a
    single scene; the states are even bitwise identical. Accessing the turning-point attributes
    raises ValueError if any of the motions has no turning points.

    The attributes frequencies and certificate are NaN unless the top is a Kowalewski or
    Goryachev-Chaplygin top.

    The example computes how far tops fall after release, for several spins and tilts [degrees]:

        >>> import numpy as np
        >>> import kreisel as kr
        >>> top = kr.Body.cone(radius=1, height=2, pivot=(0, 0, 0), mass=1)
        >>> spins, tilts = np.linspace(10, 30, 3), np.linspace(0, 1, 2)
        >>> tops = kr.Ensemble.spinning(top, spin=spins[:, None], tilt=tilts, gravity=1)
        >>> np.degrees(kr.exact(tops).greatest_nutation).round(1)
        array([[  0. , 104.7],
               [  0. ,  69.2],
               [  0. ,  62.2]])
    """

    tops: Ensemble
    _word: str = "top"  # the word for a member in messages: "top" or "scene"

    def __repr__(self) -> str:
        shape = self.tops.shape
        count = f"{len(self)} scenes" if len(shape) == 1 else f"scenes of shape {shape}"
        return f"<kreisel.ExactEnsemble: {count}>"

    def __len__(self) -> int:
        return len(self.tops)

    @property
    def scenes(self) -> tuple[Scene, ...]:
        """The scenes of the ensemble in C order."""
        return tuple(get_member_by_flat_index(self.tops, i) for i in range(self.tops.size))

    def __call__(self, t: Numbers) -> Array:
        """Return the states at the times `t` [T]: (*shape, k, 8) numbers t, q and m.

        `t` is a list of k times for all tops, or an array (*shape, k) with the times of each. For a
        single number, the result has the shape (*shape, 8).
        """
        n, shape = self.tops.size, self.tops.shape
        times = as_finite_array(
            "t", t, "a number, a list of times, or an array of times of each top"
        )
        if times.ndim > 1:
            if times.shape[:-1] != shape:
                raise ValueError(
                    "t must be a number, a list of times for all tops, or an array of shape "
                    f"{(*shape, 'k')} with k times of each, not an array of shape {times.shape}"
                )
            times = times.reshape(n, times.shape[-1])
        self._check_precision_at_times(times)
        time_list = np.atleast_1d(times)
        return self._compute_closed_form_states(time_list).reshape(*shape, *times.shape[-1:], 8)

    def _compute_closed_form_states(self, t: Array) -> Array:
        """Return the states at the given times, as an array of shape (n, k, 8).

        Computing all states in one run of the ensemble is faster than evaluating the closed form
        directly, but requires nonzero times that move strictly away from 0 in one direction. At
        time 0, a run returns the initial state without evaluating the closed form. Closed forms on
        a torus are always evaluated directly, because the states of a run would differ from them by
        rounding errors.
        """
        distances = np.where(t[..., -1:] < 0.0, -t, t)
        is_away = t.all() and (np.diff(distances, axis=-1, prepend=0.0) > 0.0).all()
        if is_away and not self._has_any_torus_closed_form:
            pool = WorkerPool(validate_thread_count(None, None))
            options = validate_ensemble_options(self.tops, EXACT)
            paths = run_ensemble(Paths, self.tops, t, options, pool, LANES)
            return paths.check().states.reshape(self.tops.size, t.shape[-1], 8)
        states = np.empty((self.tops.size, t.shape[-1], 8))
        if t.ndim == 2:
            self._call_core_in_slices(exact_states_of_tops, states, t)
        else:
            self._call_core_in_slices(partial(exact_states_of_tops, t=t), states)
        return states

    def _check_precision_at_times(self, times: Array) -> None:
        """Raise ValueError if double precision cannot resolve the attitude at one of the times."""
        ends = np.abs(times).max(axis=-1, initial=0.0) if times.ndim else np.abs(times)
        most = np.empty(self.tops.size)
        horizons(self.tops._core_scenes, most)
        indices = np.flatnonzero(ends >= most)
        if indices.size:
            i = int(indices[0])
            end = float(np.broadcast_to(ends, most.shape)[i])
            try:
                check_resolvable_horizon(get_member_by_flat_index(self.tops, i), end, None)
            except ValueError as error:
                raise ValueError(f"{self._format_error_prefix(i)}{error}") from None

    def _format_error_prefix(self, i: int) -> str:
        return f"{self._word}{format_index(unravel_index(i, self.tops.shape))}: "

    def _call_core_in_slices(
        self, function: Callable[..., tuple[str, int]], *rows: Array | Codes
    ) -> None:
        """Call a C function for consecutive slices of the ensemble and of all arrays in `rows`.

        Raises ValueError for the first top for which the C function returns an error.
        """
        failures: list[tuple[int, str]] = []
        work = Work()

        def make_range_job(begin: int, end: int) -> Job[tuple[str, int]]:
            parts = (each[begin:end] for each in rows)
            return partial(function, work=work), (self.tops._core_scenes, begin, end, *parts)

        def note_slice_failure(_: int, result: tuple[str, int]) -> None:
            if result[0] != "OK":
                failures.append((result[1], result[0]))

        pool = WorkerPool(validate_thread_count(None, None))
        pool.run_task(DivisibleTask(self.tops.size, make_range_job, note_slice_failure, work))
        if failures:
            first, status = min(failures)
            error = (
                _make_no_turning_points_error
                if function is exact_turnings
                else make_no_closed_form_error
            )
            raise error(
                status, get_member_by_flat_index(self.tops, first), self._format_error_prefix(first)
            )

    @cached_property
    def _has_any_torus_closed_form(self) -> bool:
        """True if any of the motions has a closed-form solution on a torus."""
        return unsuited(self.tops._core_scenes, "auto")[1] > 0

    @cached_property
    def _frequencies_and_certificates(self) -> Array:
        """An array with one row per top: the three frequencies and the certificate."""
        heads = np.full((self.tops.size, 4), np.nan)
        if self._has_any_torus_closed_form:
            self._call_core_in_slices(torus_heads, heads)
        return heads

    @cached_property
    def _mean_rates(self) -> Array:
        rates = np.empty((self.tops.size, 3))
        self._call_core_in_slices(exact_rates, rates)
        return rates

    @cached_property
    def _turning_points(self) -> TurningPoints:
        rows, numbers = np.empty((self.tops.size, 10)), np.zeros(self.tops.size, dtype=np.int8)
        self._call_core_in_slices(exact_turnings, rows, numbers)
        return build_turning_points_from_rows(rows, np.array(courses)[numbers])

    def _reshape_to_ensemble(self, row: Array) -> Array:
        return freeze_array(row.reshape(self.tops.shape))

    @property
    def period(self) -> Array:
        """(*shape) the period of the nutation, as in kreisel.Exact [T]."""
        return self._reshape_to_ensemble(self._mean_rates[:, 0])

    @property
    def precession_rate(self) -> Array:
        """(*shape) the mean rate of precession, as in kreisel.Exact [rad/T]."""
        return self._reshape_to_ensemble(self._mean_rates[:, 1])

    @property
    def spin_angle_rate(self) -> Array:
        """(*shape) the mean rate of the spin angle, as in kreisel.Exact [rad/T]."""
        return self._reshape_to_ensemble(self._mean_rates[:, 2])

    @property
    def frequencies(self) -> Array:
        """(*shape, 3) the frequencies of the torus, as in kreisel.ExactTorus [rad/T]."""
        return freeze_array(self._frequencies_and_certificates[:, :3].reshape(*self.tops.shape, 3))

    @property
    def certificate(self) -> Array:
        """(*shape) the largest relative residual, as in kreisel.ExactTorus."""
        return self._reshape_to_ensemble(self._frequencies_and_certificates[:, 3])

    @property
    def least_nutation(self) -> Array:
        """(*shape) the least nutation, as in kreisel.Exact [rad]."""
        return self._reshape_to_ensemble(self._turning_points.least)

    @property
    def greatest_nutation(self) -> Array:
        """(*shape) the greatest nutation, as in kreisel.Exact [rad]."""
        return self._reshape_to_ensemble(self._turning_points.greatest)

    @property
    def t_least(self) -> Array:
        """(*shape) the first time at which the nutation is least, as in kreisel.Exact [T]."""
        return self._reshape_to_ensemble(self._turning_points.t_least)

    @property
    def t_greatest(self) -> Array:
        """(*shape) the first time at which the nutation is greatest, as in kreisel.Exact [T]."""
        return self._reshape_to_ensemble(self._turning_points.t_greatest)

    @property
    def motion_type(self) -> npt.NDArray[np.str_]:
        """(*shape) the name of the apex's motion about the vertical, as in kreisel.Exact."""
        course = self._turning_points.motion_type.reshape(self.tops.shape)
        course.flags.writeable = False
        return course

    @property
    def critical_spin(self) -> Array:
        """(*shape) the spin above which the body sleeps upright, as in kreisel.Exact [rad/T]."""
        return self._reshape_to_ensemble(self._turning_points.critical_spin)


def _make_no_turning_points_error(status: str, scene: Scene, prefix: str) -> ValueError:
    return ValueError(prefix + explain_no_turning_points(status, scene))


def make_exact_ensemble(tops: Ensemble, word: str = "top") -> ExactEnsemble:
    """Return the closed-form solutions for all tops in an ensemble.

    Raises ValueError if the motion of a top has no closed-form solution.
    """
    first, count = unsuited(tops._core_scenes, EXACT)
    if count:
        more = f", the first of {count} such" if count > 1 else ""
        prefix = f"{word}{format_index(unravel_index(first, tops.shape))}{more}: "
        raise make_no_closed_form_error("ERR_METHOD", get_member_by_flat_index(tops, first), prefix)
    refuse_turning_support(tops)
    forms = ExactEnsemble(tops, word)
    _ = (
        forms._frequencies_and_certificates
    )  # many motions of Kowalewski and Goryachev-Chaplygin tops are refused: check them now
    return forms


def refuse_turning_support(tops: Scene | Ensemble) -> None:
    """Raise ValueError for tops on supports that turn about e3, without any other disturbance.

    The turning points and angular rates of a closed-form solution refer to the inertial frame and
    not to the support.
    """
    if has_equivalent_support_at_rest(tops):
        raise ValueError(
            "kreisel.exact does not support turning supports: solve with method='exact' has the "
            "states for a support that turns about e3, and replace(turning=None) gives the same "
            "motion, seen from the inertial frame"
        )


def make_exact_ensemble_of_list(scenes: Sequence[Scene]) -> ExactEnsemble:
    """Return the closed-form solutions for a list of scenes."""
    for i, scene in enumerate(scenes):
        validate_type(f"scene[{i}]", scene, Scene)
    if not scenes:
        raise ValueError("a list of scenes must not be empty")
    return make_exact_ensemble(Ensemble.of(scenes), "scene")


def make_no_closed_form_error(status: str, scene: Scene, prefix: str = "") -> ValueError:
    """Return the exception to raise for a scene whose motion has no closed-form solution."""
    if status != "ERR_METHOD":
        return ValueError(f"{prefix}{statuses[status][1]}: {scene!r}")
    exact, reason = methods[EXACT], explain_no_closed_form(scene)
    if exact.applies_to(scene.body) or any(scene.body.rotor):
        return ValueError(f"{prefix}{reason}: {scene!r}")
    return ValueError(f"{prefix}{reason}: closed forms are known for {exact.tops}")
