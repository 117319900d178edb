"""Closed forms of one top and of many."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cached_property, partial
from typing import Any, ClassVar, Generic, Literal, TypeVar, cast, overload

import numpy as np

from .. import _core as core
from .._model import starts
from .._model.parameters import has_equivalent_support_at_rest
from .._model.scene import Scene, Scenes
from .._options import methods as choices
from .._options import options as checks
from .._options.methods import EXACT
from .._options.options import Options, TangentSpec, get_member_by_flat_index
from .._results.calls import CLOSED_FORM, LANES, EnsembleBuffers, Stats, run_ensemble
from .._results.path import EnsemblePath, Path
from .._results.requests import record_path
from .._utils import arguments
from .._utils.arguments import Array, Numbers, as_finite_array
from .._utils.html import format_html_table
from .._utils.processes import Job, Progress, WorkerPool
from . import torus

_Values = TypeVar("_Values")  # a float for one top, an array for many
_Paths = TypeVar("_Paths")  # a Path of one top or of many
_NO_STEPS = Stats(0, 0, 0, 0)


@arguments.make_frozen_class_decorator("call kreisel.exact for other tops")
class Exact(Generic[_Values, _Paths]):
    """The motions of one or many tops, given in closed form.

    Calling the object with a time or an array of times returns a kreisel.Path. Times may be
    positive or negative, and in any order. For many tops, the times can also be an array
    (*shape, k), with separate times for each top. exact[i] is the closed form of one of the
    tops; slices, lists and masks give that of several.

    The attributes are numbers for one top, whose `shape` is (), and arrays of the shape of the
    scene otherwise. They are computed on first access.

    The axis is the apex of a heavy top, the axis of symmetry of a free symmetric body, and the
    principal axis about which the momentum precesses in the frame of a free asymmetric body. The
    axis of a free body makes an acute angle with the momentum. The nutation of a free asymmetric
    body has half the period of body_velocity, T in Landau and Lifshitz, Mechanics, section 37. The
    mean `precession_rate` does not include the half turns by which the precession angle jumps if
    the axis passes exactly through the vertical.

    States at t = 1e6 are as accurate and as cheap as states at t = 1. Ctrl-C raises
    KeyboardInterrupt, and no partial results are returned.

        >>> import kreisel as kr
        >>> top = kr.exact(kr.scenes.cusps)
        >>> top.motion_type, round(top.least_nutation, 4), round(top.greatest_nutation, 4)
        ('cusps', 0.9273, 1.1414)
        >>> top(top.t_greatest).nutation.round(4)
        array([1.1414])

    The example computes how far tops fall after release, for several spins and tilts [degrees]:

        >>> import numpy as np
        >>> body = kr.Body.cone(radius=1, height=2, pivot=(0, 0, 0), mass=1)
        >>> spins, tilts = np.linspace(10, 30, 3), np.linspace(0, 1, 2)
        >>> tops = kr.Scene.spinning(body, spin=spins[:, None], tilt=tilts, gravity=1)
        >>> np.degrees(kr.exact(tops).greatest_nutation).round(1)
        array([[  0. , 104.7],
               [  0. ,  69.2],
               [  0. ,  62.2]])

    The attributes from least_nutation to critical_spin and the potential exist only for tops that
    are symmetric about their apex axis: ValueError if one of the tops is not.

    scene  the scene, of one top or of many
    """

    scene: Scene
    _plan: Any  # the core.ExactPlan of one top
    _word: str  # the word for a member in messages
    _displayed: ClassVar[dict[str, str]] = {  # what notebooks show of one top, and its unit
        "motion_type": "",
        **dict.fromkeys(["least_nutation", "greatest_nutation"], "[rad]"),
        "period": "[T]",
        **dict.fromkeys(["precession_rate", "spin_angle_rate"], "[rad/T]"),
    }

    def __init__(self, scene: Scene, plan: Any = None, word: str = "top") -> None:
        fields = self.__dict__
        fields["scene"], fields["_plan"], fields["_word"] = scene, plan, word

    def __reduce__(self) -> tuple[Any, tuple[Scene]]:
        return exact, (self.scene,)

    def __repr__(self) -> str:
        if self.shape:
            return f"<kreisel.Exact of shape {self.shape}>"
        rates = f"period {self.period:.6g}, precession {self.precession_rate:.6g}"
        return f"<kreisel.Exact: {rates}, spin angle {self.spin_angle_rate:.6g}; {self.scene!r}>"

    def _repr_html_(self) -> str:
        """Return a table of the motion and of the scene, for display in notebooks.

        For many tops, only their parameters are shown, because nothing else is known at once.
        """
        rows = []
        for name, unit in ({} if self.shape else self._displayed).items():
            try:
                values = np.ravel(getattr(self, name)).tolist()
            except ValueError:  # the axis of a free asymmetric body has no such property
                continue
            texts = [x if isinstance(x, str) else f"{x:.6g}" for x in values]
            rows.append((name.replace("_", " "), ", ".join(texts), unit))
        rows += self.scene._list_parameter_rows()
        return format_html_table(rows, ("closed form", "value", "unit"))

    def __eq__(self, other: object) -> bool:
        return type(other) is type(self) and bool(self.scene == other.scene)

    def __hash__(self) -> int:
        return hash(self.scene)

    @property
    def shape(self) -> tuple[int, ...]:
        """The shape of the scene; () for one top."""
        return self.scene.shape

    def __bool__(self) -> bool:
        return self.scene.size > 0

    def __len__(self) -> int:
        return len(self.scene)

    def __getitem__(self, key: Any) -> Any:
        """Return the closed form of one or several tops, selected by a NumPy index."""
        return exact(self.scene[key])

    def _shape_values(self, rows: Any) -> _Values:
        """Return one value for one top, or an array of the shape of many."""
        if not self.shape:
            return cast(_Values, np.reshape(rows, -1)[0].item())
        return cast(_Values, arguments.freeze_array(np.reshape(rows, self.shape)))

    @cached_property
    def _numbers(self) -> Array:
        """(n, 7) period, two mean rates, three frequencies and certificate; NaN where undefined."""
        if self._plan is not None:
            return core.exact_numbers_of(self._plan)
        numbers = np.empty((self.scene.size, 7))
        self._call_core_in_slices(core.exact_numbers, numbers)
        return numbers

    @cached_property
    def _has_torus(self) -> bool:
        """True if the motion of some top is on a torus."""
        return core.unsuited(self.scene._core_scenes, "auto")[1] > 0

    @property
    def period(self) -> _Values:
        """The period of the nutation, from one lowest point of the axis to the next [T].

        It is inf if the height of the axis is constant, and NaN for a motion on a torus.
        """
        return self._shape_values(self._numbers[..., 0])

    @property
    def precession_rate(self) -> _Values:
        """The mean rate of the axis about the vertical [rad/T].

        Without torque, the rate refers to the angular momentum. NaN for a motion on a torus.
        """
        return self._shape_values(self._numbers[..., 1])

    @property
    def spin_angle_rate(self) -> _Values:
        """The mean rate of the Euler angle spin_angle [rad/T]; NaN for a motion on a torus.

        It does not include the precession: the angular velocity about the axis is `path.spin`.
        """
        return self._shape_values(self._numbers[..., 2])

    @property
    def frequencies(self) -> Any:
        """(*shape, 3) the frequencies of a motion on a torus [rad/T], as in kreisel.ExactTorus.

        They are NaN for all other motions.
        """
        if not self.shape:
            return tuple(self._numbers[3:6].tolist())
        return arguments.freeze_array(self._numbers[:, 3:6].reshape(*self.shape, 3))

    @property
    def certificate(self) -> _Values:
        """The largest relative residual of a motion on a torus, as in kreisel.ExactTorus."""
        return self._shape_values(self._numbers[..., 6])

    @cached_property
    def _turning_points(self) -> starts.TurningPoints:
        if not self.shape:
            return starts.compute_turning_points(self.scene)
        rows, numbers = np.empty((self.scene.size, 10)), np.zeros(self.scene.size, dtype=np.int8)
        self._call_core_in_slices(core.exact_turnings, rows, numbers)
        return starts.build_turning_points_from_rows(rows, np.array(core.courses)[numbers])

    @property
    def least_nutation(self) -> _Values:
        """The smallest nutation, between 0 and pi [rad]."""
        return self._shape_values(self._turning_points.least)

    @property
    def greatest_nutation(self) -> _Values:
        """The largest nutation, between 0 and pi [rad]."""
        return self._shape_values(self._turning_points.greatest)

    @property
    def t_least(self) -> _Values:
        """The first time t >= 0 at which the nutation is smallest [T].

        It is 0 if the nutation is constant, and inf if the smallest nutation is never reached.
        """
        return self._shape_values(self._turning_points.t_least)

    @property
    def t_greatest(self) -> _Values:
        """The first time t >= 0 at which the nutation is largest [T], as `t_least`."""
        return self._shape_values(self._turning_points.t_greatest)

    @property
    def motion_type(self) -> Any:
        """The type of the apex's motion about the vertical.

        - If the nutation changes, the name depends on the precession rates at the two turning
          points: 'waves' if they have the same sign, 'loops' if they have opposite signs, and
          'cusps' if the rate is zero at the turning point with the higher potential.

        - If the nutation is constant, the name is 'sleeping' (upright against gravity), 'hanging'
          or 'steady'.

        - If the apex passes through or approaches the vertical, the name is 'pendulum' (motion in a
          plane), 'rosette', or 'separatrix' (the apex approaches the upright position in infinite
          time).

        - Without torque, the name is 'circle' or 'resting'.

        In this classification, values are considered equal if they differ by at most 1e-12.
        """
        return self._shape_values(self._turning_points.motion_type)

    @property
    def critical_spin(self) -> _Values:
        """The spin above which the upright body is stable as a sleeping top [rad/T].

        The critical spin is (2 sqrt(I1 mass |gravity| |com|) - h) / I3, where h is the momentum of
        the rotor along the apex.
        """
        return self._shape_values(self._turning_points.critical_spin)

    def potential(self, nutation: Numbers) -> Array:
        """Return the effective potential at each nutation [rad] [M L^2 T^-2].

        The shape is that of the tops, followed by that of `nutation`:

            (m3 - c cos)^2 / (2 I1 sin^2) + (c - h)^2 / (2 I3) + mass gravity |com| cos

        with m3 = <m, e3>, c = <m, apex>, and the momentum h of the rotor along the apex. The energy
        is the sum of the effective potential and I1 / 2 times the square of the nutation rate. At
        turning points where the axis is not vertical, the effective potential equals the energy.
        The potential at nutation 0 or pi is inf if the apex cannot reach this angle.
        """
        angles = as_finite_array("nutation", nutation, "a number or an array of angles")
        constants = self._turning_points.rows[:, 5:10, np.newaxis].swapaxes(0, 1)
        total, difference, inertia, axial_energy, lever = constants
        half = np.tan(0.5 * angles.reshape(-1))
        with np.errstate(divide="ignore", invalid="ignore"):
            rate = np.where(total == 0.0, 0.0, total * half)
            rate = rate + np.where(difference == 0.0, 0.0, difference / half)
        values = rate**2 / (8.0 * inertia) + axial_energy + lever * np.cos(angles.reshape(-1))
        return cast(Array, values.reshape(self.shape + angles.shape))

    def __call__(self, t: Numbers) -> _Paths:
        """Return the path, or the paths of many tops, at the times `t` [T].

        `t` is a number or a list in any order, and for many tops also an array (*shape, k) with the
        times of each.
        """
        if self.shape:
            return cast(_Paths, self._compute_paths_of_many(t))
        states = core.exact_states(self._plan, t, self.scene._resolvable_horizon)
        if states is None:
            times = checks.validate_time_list(t)
            end = float(np.abs(times).max(initial=0.0))
            checks.check_resolvable_horizon(self.scene, end, None)
            states = core.exact_states(self._plan, times.reshape(-1), math.inf)
        return cast(_Paths, Path(self.scene, cast(Array, states), _NO_STEPS, CLOSED_FORM))

    def _compute_paths_of_many(self, t: Numbers) -> EnsemblePath:
        tops, shape = self.scene, self.shape
        form = "a number, a list of times, or an array of times of each top"
        times = as_finite_array("t", t, form)
        if times.ndim > 1:
            if times.shape[:-1] != shape:
                raise ValueError(
                    "t must be a number, a list of times for all tops, or an array of shape "
                    f"{(*shape, 'k')} with k times of each, not an array of shape {times.shape}"
                )
            times = times.reshape(tops.size, times.shape[-1])
        times = np.atleast_1d(times)
        ends, most = np.abs(times).max(axis=-1, initial=0.0), np.empty(tops.size)
        core.horizons(tops._core_scenes, most)
        for i in np.flatnonzero(ends >= most).tolist():
            end = float(np.broadcast_to(ends, most.shape)[i])
            try:
                checks.check_resolvable_horizon(get_member_by_flat_index(tops, i), end, None)
            except ValueError as error:
                raise ValueError(f"{self._name_member(i)}: {error}") from None
        # Computing all states in one run of the ensemble is faster than evaluating the closed form
        # directly, but requires nonzero times that move strictly away from 0 in one direction. At
        # time 0, a run returns the initial state without evaluating the closed form. Closed forms
        # on a torus are always evaluated directly, because the states of a run would differ from
        # them by rounding errors.
        distances = np.where(times[..., -1:] < 0.0, -times, times)
        is_away = times.all() and (np.diff(distances, axis=-1, prepend=0.0) > 0.0).all()
        if is_away and not self._has_torus:
            pool = WorkerPool(checks.validate_thread_count(None))
            kind = EnsemblePath._of_many
            return run_ensemble(kind, tops, times, CLOSED_FORM, pool, LANES).check()
        buffers = EnsembleBuffers.allocate_buffers(tops.size, times.shape[-1], CLOSED_FORM)
        buffers.status[:], buffers.done[:] = 0, times.shape[-1]
        buffers.reached[:] = times[..., -1] if times.size else 0.0
        states = cast(Array, buffers.states)
        if times.ndim == 2:
            self._call_core_in_slices(core.exact_states_of_tops, states, times)
        else:
            self._call_core_in_slices(partial(core.exact_states_of_tops, t=times), states)
        return EnsemblePath._of_many(tops, times, CLOSED_FORM, buffers)

    def _name_member(self, i: int) -> str:
        return self._word + checks.format_index(checks.unravel_index(i, self.shape))

    def _call_core_in_slices(self, function: Callable[..., tuple[str, int]], *rows: Any) -> None:
        """Call a C function for consecutive slices of the tops and of all arrays in `rows`.

        Raises ValueError for the first top for which the C function returns an error.
        """
        failures: list[tuple[int, str]] = []
        work, tops = core.Work(), self.scene._core_scenes

        def make_job(begin: int, end: int) -> Job[tuple[str, int]]:
            parts = (each[begin:end] for each in rows)
            return partial(function, work=work), (tops, begin, end, *parts)

        def note_failure(_: int, result: tuple[str, int]) -> None:
            if result[0] != "OK":
                failures.append((result[1], result[0]))

        pool = WorkerPool(checks.validate_thread_count(None))
        pool.run_slices(self.scene.size, make_job, note_failure, work)
        if failures:
            first, status = min(failures)
            scene, prefix = get_member_by_flat_index(self.scene, first), self._name_member(first)
            if function is core.exact_turnings:
                reason = starts.explain_no_turning_points(status, scene)
                raise ValueError(f"{prefix}: {reason}")
            raise torus.make_no_closed_form_error(status, scene, f"{prefix}: ")


class ExactTorus(Exact[float, Path]):
    """The motion of a Kowalewski or Goryachev-Chaplygin top or free gyrostat, in closed form.

    The motion is described by angle variables on a torus instead of Euler angles.

    Called with `tangents`, which can be "start", "gravity" and "mass", the object returns a path
    that also has the attributes `tangents` and `derivative`. Most changes of the other parameters
    lead to motions without a closed form. Derivatives with respect to the vertical momentum of a
    Goryachev-Chaplygin top are NaN, and a free gyrostat has those by "start" alone. The
    tangents are computed from closed-form solutions by central differences of order 8, with steps
    that become smaller as time increases. Their relative error usually stays below about 1e-10 even
    for long times, whereas that of a Taylor series grows. It is estimated by `tangents_rest`, and
    is larger near resonances and separatrices. For rapidly rotating tops, the derivatives with
    respect to gravity and mass suffer from cancellation errors.

        >>> import kreisel as kr
        >>> path = kr.exact(kr.scenes.kowalewski)([1.0, 1e5], tangents=("start", "gravity"))
        >>> path.tangents.shape, path.tangents_rest < 1e-10
        ((2, 6, 7), True)

    Raises ValueError for a parameter for which tangents cannot be computed, for times at which the
    top has turned by more than 1e9 rad, and if a neighbouring motion required for a finite
    difference has no closed-form solution.

    kind         "kowalewski", whose closed form separates in two variables,
                 "goryachev_chaplygin", whose <m, e3> must be zero and whose mean precession rate is
                 zero, or "gyrostat", whose two frequencies are those of the body-frame momentum and
                 of the rotation about the momentum, and whose precession rate counts as zero
    frequencies  (first, second, precession_rate) [rad/T]. The frequencies of the attitude matrix in
                 space are integer combinations of all three. The frequencies of quantities seen
                 from the body are integer combinations of the first two
    certificate  the largest relative residual of the equations that the closed form and its initial
                 state must satisfy; the attitude error at any time is at most about ten times this.
                 For a Goryachev-Chaplygin top with G near 0, each radian of rotation about the
                 vertical adds one rounding error

        >>> body = kr.Body(1, (4, 4, 1), (1, 0, 0), unphysical=True)
        >>> scene = kr.Scene(body, momentum=(0.9, 2.1, 0), attitude=(0.8, 0, 0.6, 0), gravity=1)
        >>> top = kr.exact(scene)
        >>> top.kind, top.certificate < 1e-13, top.frequencies[2]
        ('goryachev_chaplygin', True, 0.0)

    The moments, the centre of mass and the momentum must satisfy the conditions of the closed form
    exactly. For moments (2 * x, 2 * x, x) and (4 * x, 4 * x, x), they do for any float `x`. Near a
    separatrix, bodies that differ by rounding errors alone move apart by any angle.

    period, precession_rate and spin_angle_rate are NaN; use `frequencies` instead.
    """

    _displayed: ClassVar[dict[str, str]] = {"kind": "", "frequencies": "[rad/T]", "certificate": ""}

    def __repr__(self) -> str:
        rates = ", ".join(f"{rate:.6g}" for rate in self.frequencies)
        form = f"{self.kind}, frequencies {rates}, certificate {self.certificate:.1e}"
        return f"<kreisel.ExactTorus: {form}; {self.scene!r}>"

    @property
    def kind(self) -> Literal["kowalewski", "goryachev_chaplygin", "gyrostat"]:
        """The kind of the top."""
        kind = core.scene_kind(self.scene._block)
        return cast(Literal["kowalewski", "goryachev_chaplygin", "gyrostat"], kind)

    @cached_property
    def actions(self) -> tuple[float, float, float]:
        """The actions (first, second, third) that belong to `frequencies` [M L^2 T^-1].

        Each action is the integral of <m, dR R^T> along a closed loop on the torus, divided by 2
        pi, with the angular momentum m and the rotation R from the body frame to the space frame.
        Along each loop, one angle increases by a full turn, even if the motion repeats after half a
        turn, while the other angles are constant. The third action is <m, e3>. The energy is a
        function of the actions, and its derivatives are the frequencies: between neighbouring tops,
        d energy = sum of frequencies * d actions. For Goryachev-Chaplygin tops, this holds only
        within the family of tops with <m, e3> = 0.

        Raises ValueError if the motion is too close to a separatrix. Source: Arnold, Mathematical
        Methods of Classical Mechanics, section 50.
        """
        is_level = self.kind == "goryachev_chaplygin"
        states_at = self._compute_states_at_angles
        first, second = (torus.compute_torus_action(states_at, j, is_level) for j in (0, 1))
        return first, second, 0.0 if is_level else self.scene.momentum[2]

    def find_quasi_periods(self, n: int = 4) -> Array:
        """Return `n` quasi-periods: times after which the body returns ever closer to its start.

        Each row of the array (n, 3) contains the number of turns of each torus angle, and the
        quasi-period [T]. The ratio of the two integers is a convergent in the continued-fraction
        expansion of the frequency ratio: a near resonance. At each returned time, the body-frame
        components of the momentum and the vertical are close to their initial values. There are
        fewer than `n` rows if the ratio of the frequencies is rational up to rounding errors, or if
        the next time is too late for double precision to resolve the attitude.

            >>> import kreisel as kr
            >>> top = kr.exact(kr.scenes.kowalewski)
            >>> first, second, time = top.find_quasi_periods(4)[-1]
            >>> int(first), int(second), round(float(time), 6)
            (8, 3, 99.319028)

        Raises TypeError or ValueError if `n` is not a positive integer.
        """
        count = arguments.as_int("n", n, 1)
        first, second, _ = self.frequencies
        ratio = rest = first / second
        previous, last, is_equal = (0, 1), (1, 0), False
        turns: list[tuple[int, int]] = []
        while len(turns) < count and not is_equal:
            part = math.floor(rest)
            previous, last = last, (part * last[0] + previous[0], part * last[1] + previous[1])
            if last[0] > 0:
                turns.append(last)
            is_equal = rest == part or abs(ratio - last[0] / last[1]) <= 4.0 * math.ulp(ratio)
            if not is_equal:
                rest = 1.0 / (rest - part)
        pairs = np.array(turns, dtype=np.float64).reshape(-1, 2)
        times = math.tau * pairs.sum(axis=1) / (first + second)
        rows: Array = np.column_stack([pairs, times])[times < self.scene._resolvable_horizon]
        return rows

    def __call__(self, t: Numbers, *, tangents: TangentSpec | None = None) -> Path:
        """Return the path at the times `t` [T], with `tangents` as in kreisel.solve if given."""
        path = super().__call__(t)
        if tangents is None:
            return path
        names = checks.validate_tangent_names(tangents)
        checks.check_torus_tangent_names(self.scene, names)
        torus.check_tangent_times(self.scene, path.t)
        data = torus.compute_closed_form_tangents(self.scene, path.states, names)
        return replace(path, _tangent_data=data)

    def _compute_states_at_angles(self, turns: Array) -> Array:
        """Return one state for each pair of torus angles, which are given in turns.

        All states share the rotation of the initial state about the vertical, which is arbitrary
        for a Goryachev-Chaplygin top.
        """
        return core.exact_states_at(self._plan, turns)


@overload
def exact(scene: Scenes | Sequence[Scene]) -> Exact[Array, EnsemblePath]: ...  # type: ignore[overload-overlap]
@overload
def exact(scene: Scene) -> Exact[float, Path]: ...
def exact(
    scene: Scene | Sequence[Scene],
) -> Exact[float, Path] | Exact[Array, EnsemblePath]:
    """Return the motion of one or many tops in closed form.

    The result is a kreisel.ExactTorus for most Kowalewski tops, for most Goryachev-Chaplygin tops
    whose vertical momentum is zero, and for free bodies with a rotor off their axis of symmetry.

    scene  a kreisel.Scene of one top or of many, or a list of scenes

    Raises ValueError if a motion has no closed-form solution, or if the support turns about e3. For
    a support that turns about e3, use solve(scene, t, "exact") to compute the states.
    """
    word = "top"
    if not isinstance(scene, Scene):
        if not isinstance(scene, (list, tuple)):
            arguments.validate_type("scene", scene, Scene)
        scene, word = Scene.stack(scene), "scene"
    tops: Scene = scene
    if tops.shape:
        forms: Exact[Array, EnsemblePath] = Exact(tops, word=word)
        first, count = core.unsuited(tops._core_scenes, EXACT)
        if count:
            more = f", the first of {count} such" if count > 1 else ""
            refused, prefix = get_member_by_flat_index(tops, first), forms._name_member(first)
            raise torus.make_no_closed_form_error("ERR_METHOD", refused, f"{prefix}{more}: ")
        _refuse_turning_support(tops)
        if forms._has_torus:  # many motions of such tops are refused
            _ = forms._numbers
        return forms
    if any(tops.turning) and choices.methods[EXACT].suits(tops):
        _refuse_turning_support(tops)
    is_on_torus, plan = torus.plan_closed_form(tops)
    return (ExactTorus if is_on_torus else Exact)(tops, plan)


def _refuse_turning_support(tops: Scene) -> None:
    # The turning points and rates of a closed form refer to the inertial frame.
    if has_equivalent_support_at_rest(tops):
        raise ValueError(
            "kreisel.exact does not support turning supports: solve with method='exact' has the "
            "states for a support that turns about e3, and replace(turning=None) gives the same "
            "motion, seen from the inertial frame"
        )


def record_exact_path_with_tangents(
    scene: Scene, options: Options, times: Array, progress: Progress | None
) -> Path:
    """Compute a path and its tangents from the closed-form solution on a torus.

    Raises ValueError if the tangents cannot be computed.
    """
    torus.check_tangent_times(scene, times)
    path = record_path(scene, options, times, progress)
    data = torus.compute_closed_form_tangents(scene, path.states, options.tangents)
    return replace(path, _tangent_data=data)
