"""Paths: the states at the times asked for, and what can be computed from them, when it is asked for."""
# mypy: disable-error-code="import-untyped"
from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from . import _core, check
from .check import Array
from .columns import picked
from .how import wanted
from .scene import Scene
from .states import NO_STATES, States, Stats, frozen

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation

    from .plan import Plan


class Path(States):
    """n states of a scene in motion. Arrays are read-only; t, q and m are views of `states`, all else is computed when
    it is first asked for. Vectors are seen from space unless said otherwise.

    states  (n, 8): t [T], q (w, x, y, z), m [M L^2 T^-1]
    method  its name; step (negative: back in time), tol and digits as used, None where it has none or chose its own
    stats   what the run cost, trial runs included
    events  those that were met, where solve was asked for events; else None
    want    what solve was asked to keep beside t, and all that there is then; None: the states, and with them everything
    """

    @property
    def rotation(self) -> Rotation:
        """The attitudes as one scipy.spatial.transform.Rotation; ImportError without SciPy."""
        from scipy.spatial.transform import Rotation

        return Rotation.from_quat(self.q_xyzw)

    @cached_property
    def velocity(self) -> Array:
        """(n, 3) angular velocity [T^-1]."""
        return frozen(_core.values("velocity", self.scene._block, self.states))

    @cached_property
    def torque(self) -> Array:
        """(n, 3) torque of gravity about the fixed point, dm/dt [M L^2 T^-2]."""
        return frozen(_core.values("torque", self.scene._block, self.states))

    @cached_property
    def frame(self) -> Array:
        """(n, 3, 3) the principal axes: frame[:, 0], [:, 1], [:, 2] are the unit vectors N, B, T."""
        return frozen(_core.values("frame", self.scene._block, self.states))

    @cached_property
    def apex(self) -> Array:
        """(n, 3) unit vectors from the fixed point to the centre of mass; along T if they are the same point."""
        return frozen(_core.values("apex", self.scene._block, self.states))

    @cached_property
    def nutation(self) -> Array:
        """(n,) angle of the apex with the vertical e3, 0 upright, pi hanging; from its tangent, accurate at both [rad]."""
        return frozen(_core.values("nutation", self.scene._block, self.states))

    @cached_property
    def kinetic(self) -> Array:
        """(n,) kinetic energy [M L^2 T^-2]."""
        return frozen(_core.values("kinetic", self.scene._block, self.states))

    @cached_property
    def potential(self) -> Array:
        """(n,) potential energy, zero with the centre of mass level with the fixed point [M L^2 T^-2]."""
        return frozen(_core.values("potential", self.scene._block, self.states))

    @cached_property
    def energy(self) -> Array:
        """(n,) kinetic + potential [M L^2 T^-2]."""
        return frozen(self.kinetic + self.potential)

    @cached_property
    def vertical_momentum(self) -> Array:
        """(n,) <m, e3>, constant for every top [M L^2 T^-1]."""
        return frozen(_core.values("vertical_momentum", self.scene._block, self.states))

    @cached_property
    def axial_momentum(self) -> Array:
        """(n,) <m, apex>, constant for a Lagrange top [M L^2 T^-1]."""
        return frozen(_core.values("axial_momentum", self.scene._block, self.states))

    @cached_property
    def kowalewski(self) -> Array:
        """(n,) the fourth integral K of a Kowalewski top (Bodack 2008, 5.1) [T^-4]; NaN for other bodies."""
        return frozen(_core.values("kowalewski", self.scene._block, self.states))

    @cached_property
    def goryachev_chaplygin(self) -> Array:
        """(n,) the integral G of a Goryachev-Chaplygin top (Bodack 2008, 5.2) [T^-3]; constant only while <m, e3> = 0;
        NaN for other bodies."""
        return frozen(_core.values("goryachev_chaplygin", self.scene._block, self.states))

    def modified_energy(self, step: float) -> Array:
        """(n,) the energy that bobenko_suris keeps at this step, E + step <torque, m> / (2 I1) [M L^2 T^-2].

        NaN unless the body is a Lagrange top. A step back in time is negative, as `path.step` is.
        """
        return _core.modified_energy(self.scene._block, self.states, check.number("step", step))

    def modified_energy4(self, step: float) -> Array:
        """(n,) the energy that bobenko_suris4 keeps at this step, E up to a constant and step^4 [M L^2 T^-2]; NaN unless
        the body is a Lagrange top, and where the step is too large for the method."""
        return _core.modified_energy4(self.scene._block, self.states, check.number("step", step))

    @cached_property
    def energy_error(self) -> float:
        """max |E - E0| / max (T + M |g| |com|) over the states, E0 at t = 0; zero for a path without states."""
        if not len(self):
            return 0.0
        block = self.scene._block
        start = np.array([block[12:]])
        kinetic, potential = float(_core.values("kinetic", block, start)[0]), float(_core.values("potential", block, start)[0])
        lever = float(np.linalg.norm(self.scene.body.com))
        size = max(kinetic, self.kinetic.max()) + self.scene.body.mass * abs(self.scene.gravity) * lever
        change = np.abs(self.energy - (kinetic + potential)).max()
        return float(change / size) if change else 0.0

    @cached_property
    def error(self) -> float:
        """The largest attitude error of the states [rad]: as solve estimated it where it was given an error; else as a
        second run tells, computed when first asked for: the closed form where there is one, or the Taylor series with 20
        digits (30 for a path of 20; of a path of 30, how far 20 go astray, less as much as their tolerance is wider)."""
        if self._choice or not len(self):
            return self._choice.error if self._choice else 0.0
        from . import accuracy

        return accuracy.estimate(self)

    @cached_property
    def plan(self) -> Plan:
        """What was used for this path, and what was left out, and why."""
        from .plan import of_path

        return of_path(self)

    def only(self, want: Iterable[str]) -> Path:
        """The path with no more than t and these quantities, as if solve had been asked for them."""
        names = wanted(want) or ()
        return replace(self, states=NO_STATES, _low=None, want=names, _columns=picked(self, names))

    def plot(self, axes: Any = None) -> Any:
        """The trace of the axis and its height over the time, with matplotlib, in two axes or in new ones; the axes."""
        from . import plot

        return plot.path(self, axes)


def made(
    scene: Scene, states: Array, method: str, step: float | None, stats: Stats, tol: float | None = None, **others: Any
) -> Path:
    """What Path's constructor makes of these, in a tenth of the time: it would take longer than all else of a short call."""
    states.flags.writeable = False
    path = object.__new__(Path)
    vars(path).update(scene=scene, states=states, method=method, step=step, tol=tol, stats=stats, _columns={}, **others)
    return path
