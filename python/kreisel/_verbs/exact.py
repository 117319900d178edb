"""kreisel.exact: the closed form of a scene, and of the Bobenko-Suris map; any state at once."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Final, Literal, overload

import numpy as np

from .._core import (
    KowalewskiPlan,
    exact_map_plan,
    exact_map_states,
    exact_plan,
    exact_states,
    kowalewski_plan,
    kowalewski_states,
    statuses,
    turning_potential,
)
from .._ground.arguments import Array, Numbers, array, instance, number, shown
from .._model.scene import Ensemble, Scene
from .._model.turning import Turnings, turning
from .._recording.path import Path, Stats
from .._request.methods import EXACT, fitting, is_kowalewski, no_closed_form
from .._request.times import refuse_endless
from .exact_many import ExactEnsemble, ensemble_of, form_of, no_form, row_of

_MAP: Final = "bobenko_suris"
_COUNTABLE = 2.0**53
_NO_STEPS = Stats(0, 0, 0, 0)


@dataclass(frozen=True)
class _Rates:
    """What a closed form tells of the motion as a whole, in the words of Exact."""

    scene: Scene
    period: float
    precession: float
    spin: float
    _plan: Array = field(repr=False, compare=False)


@dataclass(frozen=True)
class Exact(_Rates):
    """The motion of a scene in closed form; call it with a time or an array of times for a
    kreisel.Path.

    period      of the nutation: from one lowest height of the axis to the next; inf if it keeps
                its height [T]
    precession  mean rate of the axis about the vertical [T^-1]; without torque about the angular
                momentum
    spin        mean rate of the body about its axis [T^-1]: of Euler's angles, hence beside the
                precession

    The axis is that of symmetry; of a free body without one that which circulates, on the
    momentum's side. A top that passes a pole precesses there by half a turn either way, which
    counts as none.

    As exact at t = 1e6 as at 1, and as cheap; times may be in any order and of either sign. Ctrl-C
    is a plain KeyboardInterrupt: there is all or nothing, for no state waits for another.

        >>> import kreisel as kr
        >>> top = kr.exact(kr.scenes.cusps)
        >>> top.course, round(top.least_nutation, 4), round(top.greatest_nutation, 4)
        ('cusps', 0.9273, 1.1414)
        >>> top(top.t_greatest).nutation.round(4)
        array([1.1414])

    The turning points are those of the apex of a Lagrange top, or of a free body that is symmetric
    about its apex; asked for those of another, these attributes raise ValueError.
    """

    @cached_property
    def _turning(self) -> Turnings:
        return turning(self.scene)

    @property
    def least_nutation(self) -> float:
        """The nutation at the turning point nearer to e3, 0 .. pi [rad]."""
        return float(self._turning.least[0])

    @property
    def greatest_nutation(self) -> float:
        """The nutation at the turning point farther from e3, 0 .. pi [rad]."""
        return float(self._turning.greatest[0])

    @property
    def t_least(self) -> float:
        """The first time from the start on at which the nutation is least; the start's where it
        never changes, inf where that is never reached [T]."""
        return float(self._turning.t_least[0])

    @property
    def t_greatest(self) -> float:
        """The first time from the start on at which the nutation is greatest, as t_least [T]."""
        return float(self._turning.t_greatest[0])

    @property
    def course(self) -> str:
        """How the apex goes about the vertical. By the precession where gravity has it highest:
        against that at the other turning point 'loops', none 'cusps', with it 'waves'. Without
        nutation 'sleeping' (upright against gravity), 'hanging', 'steady'. Through the vertical
        'pendulum' (in a plane), 'rosette', 'separatrix' (to the upright in infinite time). Without
        torque 'circle', 'resting'. What is equal to 1e-12 is equal here."""
        return str(self._turning.course[0])

    @property
    def critical_spin(self) -> float:
        """The spin beyond which the body sleeps upright, 2 sqrt(I1 mass |gravity| |com|) / I3
        [T^-1]."""
        return float(self._turning.critical_spin[0])

    def potential(self, nutation: Numbers) -> Array:
        """The effective potential at each nutation [rad], of their shape [M L^2 T^-2]:

            (m3 - c cos)^2 / (2 I1 sin^2) + c^2 / (2 I3) + mass gravity |com| cos

        with m3 = <m, e3>, c = <m, apex>. It is what I1 / 2 times the squared rate of the nutation
        leaves of the energy: that of the motion at turning points off the vertical. inf at a pole
        out of reach.
        """
        angles = array("nutation", nutation, "a number or an array of angles")
        values = turning_potential(self._turning.rows[0], angles.reshape(-1))
        return values.reshape(angles.shape)

    def __call__(self, t: Numbers) -> Path:
        states = self._states(t, self.scene._within)
        if states is None:
            states = self._states(self._times(t), math.inf)
        assert states is not None
        return Path(self.scene, states, EXACT, None, None, _NO_STEPS, _asked=EXACT)

    def tangents(self, t: Numbers) -> Array:
        """(n, 6, 6) the derivatives of the states at these times by the start, as path.tangents has
        them: right at any time, for they are those of one period, taken to its power in decimals.

            >>> import kreisel as kr
            >>> scene = kr.scenes.thesis
            >>> told = kr.exact(scene).tangents(20.0)
            >>> bool(abs(told - kr.solve(scene, [20.0], tangents="start").tangents).max() < 1e-11)
            True

        Raises ValueError for a motion on a separatrix, which has no period, and where a tangent
        has grown beyond what doubles hold. It takes about a millisecond a time.
        """
        from .exact_tangents import tangents_at

        path = self(t)
        return tangents_at(self.scene, self.period, path.t, path.q)

    def _states(self, t: object, most: float) -> Array | None:
        """Return rows of states; None if `t` has to be looked at, or is not below `most`."""
        return exact_states(self._plan, t, most)

    def _times(self, t: Numbers) -> Array:
        times = row_of(t)
        refuse_endless(self.scene, float(np.abs(times).max(initial=0.0)), None)
        return times.reshape(-1)


@dataclass(frozen=True)
class ExactKowalewski(Exact):
    """The motion of a Kowalewski top in closed form, by theta functions of two variables; call it
    with a time or an array of times for a kreisel.Path.

    frequencies  (first, second, precession): each frequency of the attitude's matrix in space is a
                 sum of whole multiples of them; of what is seen from the body, of the first two
                 [T^-1]
    certificate  the largest relative miss of the plan's equations, and of the states at its start;
                 the attitude's error is at most about ten times as much, at any time
    mismatch     how far, relatively, the body's moments and centre of mass are from those of a
                 Kowalewski top: the closed form is of exact ones, and leaves the body's motion by
                 about `mismatch` times the angle by which the top turns

    Such a motion has no period, precession and spin of the axis alone: these are NaN.

        >>> import kreisel as kr
        >>> body = kr.Body(1, (2, 2, 1), (1, 0, 0), made_up=True)
        >>> top = kr.exact(kr.Scene(body, momentum=(0.3, 1.1, 0.8)))
        >>> top.certificate < 1e-13, top.mismatch
        (True, 0.0)
        >>> round(float(top(1e6).m[0, 2]), 12)
        0.8
    """

    frequencies: tuple[float, float, float]
    certificate: float
    mismatch: float
    _sums: KowalewskiPlan = field(repr=False, compare=False)

    def _states(self, t: object, most: float) -> Array | None:
        return kowalewski_states(self._sums, t, most)

    def __reduce__(self) -> tuple[Callable[[Scene], ExactKowalewski], tuple[Scene]]:
        return _exact_kowalewski, (self.scene,)

    def tangents(self, t: Numbers) -> Array:
        """Raises ValueError: no derivatives of this closed form are known here."""
        raise ValueError(
            "the closed form of a Kowalewski top gives no tangents: ask kreisel.solve for them"
        )


@dataclass(frozen=True)
class ExactMap(_Rates):
    """The states of bobenko_suris with this step in closed form; call it with a whole number or an
    array of them.

    Its period, precession and spin, as in Exact, are the map's own: beside those of the motion they
    tell the error of the method.
    """

    step: float

    def __call__(self, k: Numbers) -> Path:
        numbers = array("k", k, "a whole number or a list of them")
        if numbers.ndim > 1:
            raise ValueError(
                f"k must be a whole number or a list of them, not an array of shape {numbers.shape}"
            )
        if (
            not (np.rint(numbers) == numbers).all()
            or np.abs(numbers).max(initial=0.0) >= _COUNTABLE
        ):
            raise ValueError(f"k must be whole and below 2**53, not {shown(k)}")
        states = exact_map_states(self._plan, numbers.astype(np.int64))
        return Path(self.scene, states, _MAP, self.step, None, _NO_STEPS, _asked=EXACT)


@overload
def exact(scene: Scene) -> Exact: ...
@overload
def exact(scene: Ensemble | Sequence[Scene]) -> ExactEnsemble: ...
@overload
def exact(scene: Scene, *, map: Literal["bobenko_suris"], step: float) -> ExactMap: ...
def exact(
    scene: Scene | Ensemble | Sequence[Scene], *, map: str | None = None, step: float | None = None
) -> Exact | ExactEnsemble | ExactMap:
    """The closed form of a scene: of a Lagrange top, a spherical body, any body on which no torque
    acts, and, as a kreisel.ExactKowalewski, of a Kowalewski top.

    scene  or many, as a kreisel.Ensemble or a list of scenes
    map    "bobenko_suris": that of the integrable map instead, for Lagrange tops
    step   the map's, of either sign [T]

    Raises ValueError, with the reason, for a scene without closed form.
    """
    if isinstance(scene, (list, tuple)) and map is None and step is None:
        return ensemble_of(scene)
    if isinstance(scene, Ensemble) and map is None and step is None:
        return form_of(scene)
    top = instance("scene", scene, Scene)
    if map is not None:
        return _exact_map(top, map, step)
    if step is not None:
        raise ValueError('step is for map="bobenko_suris"; the motion itself has none')
    if is_kowalewski(top):
        return _exact_kowalewski(top)
    status, period, precession, spin, plan = exact_plan(top._block)
    if status != "OK":
        raise no_form(status, top)
    return Exact(top, period, precession, spin, plan)


def _exact_map(scene: Scene, map: str, step: float | None) -> ExactMap:
    if map != _MAP:
        raise ValueError(f"the map with a closed form is {_MAP!r}, not {shown(map)}")
    h = number("step", step)
    if h == 0.0:
        raise ValueError("step must not be zero")
    fitting(_MAP, scene)
    status, period, precession, spin, plan = exact_map_plan(scene._block, h)
    if status == "ERR_STEP_SIZE":
        raise ValueError(
            f"no closed form is known for the map at the step {h!r} from this start, which lies "
            "within "
            "k'^2 = 1e-26 of a separatrix: take another step"
        )
    if status != "OK":
        raise ValueError(f"{statuses[status][1]}: step {h!r}, {scene!r}")
    return ExactMap(scene, period, precession, spin, plan, h)


def _exact_kowalewski(scene: Scene) -> ExactKowalewski:
    status, _, frequencies, certificate, mismatch, plan = kowalewski_plan(scene._block, 0.0)
    if status == "ERR_METHOD":
        raise ValueError(f"{no_closed_form(scene)}: {scene!r}")
    if status != "OK":
        raise ValueError(f"{statuses[status][1]}: {scene!r}")
    rates = math.nan, math.nan, math.nan
    none = np.empty(0)
    return ExactKowalewski(scene, *rates, none, frequencies, certificate, mismatch, plan)
