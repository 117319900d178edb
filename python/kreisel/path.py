"""Paths: the states at the times asked for, and what can be computed from them, when it is asked for."""
# mypy: disable-error-code="import-untyped"
from __future__ import annotations

import difflib
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from . import _core, check
from .check import Array
from .scene import Scene

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation


class Stats(NamedTuple):
    """What a run cost: steps, rejected ones, evaluations of the right-hand side or torque, iterations of a solver."""

    steps: int
    rejected: int
    evaluations: int
    iterations: int


@dataclass(frozen=True)
class Plan:
    """What method='geometric' chose so that the attitude error stays below a target on [0, t], and what that cost.

    step          [T]
    target        the error asked for, error the estimate of what it is [rad]
    conditioning  how far one rounding of the data moves the attitude [rad]; None where the target is far above that
    run, trials   evaluations of the torque: of the run that was kept, and of all before it
    """

    method: str
    step: float
    order: int
    target: float
    error: float
    conditioning: float | None
    run: int
    trials: int

    def __str__(self) -> str:
        moved = f"; one rounding of the data moves the attitude by {self.conditioning or 0.0:.1e} rad"
        known = "" if self.conditioning is None else moved
        return (
            f"{self.method} (order {self.order}) with step {self.step:g}: attitude error about {self.error:.1e} rad "
            f"of {self.target:g} allowed, for {self.run} evaluations of the torque and {self.trials} in trial runs{known}"
        )


@dataclass(frozen=True, eq=False, repr=False)
class Path:
    """n states of a scene in motion. Arrays are read-only; t, q and m are views of `states`, all else is computed when
    it is first asked for. Vectors are seen from space unless said otherwise.

    states  (n, 8): t [T], q (w, x, y, z), m [M L^2 T^-1]
    method  its name; step (negative: back in time) and tol as used, None where it has none or chose its own
    stats   what the run cost, trial runs included
    plan    what was chosen and why, where solve was given an error; else None
    """

    scene: Scene
    states: Array
    method: str
    step: float | None
    tol: float | None
    stats: Stats
    plan: Plan | None = None

    def __post_init__(self) -> None:
        self.states.flags.writeable = False

    def __len__(self) -> int:
        return len(self.states)

    def __repr__(self) -> str:
        steering = "".join(f", {k}={v!r}" for k, v in (("step", self.step), ("tol", self.tol)) if v is not None)
        span = f", t = {self.t[0]:g} .. {self.t[-1]:g}" if len(self) else ""
        return f"<kreisel.Path: {len(self)} states{span}; {self.method}{steering}, {self.stats.steps} steps>"

    def __getattr__(self, name: str) -> object:
        if name.startswith("__"):
            raise AttributeError(name)
        known = [word for word in (*self.__dataclass_fields__, *vars(Path)) if not word.startswith("_")]
        near = difflib.get_close_matches(name, known, n=1)
        hint = f"did you mean {near[0]!r}?" if near else "there are " + ", ".join(known)
        raise AttributeError(f"a path has no {name!r}; {hint}")

    @property
    def t(self) -> Array:
        """(n,) times [T]."""
        return self.states[:, 0]

    @property
    def q(self) -> Array:
        """(n, 4) unit quaternions (w, x, y, z), scalar first, from the frame in which the body was described to space."""
        return self.states[:, 1:5]

    @property
    def q_xyzw(self) -> Array:
        """(n, 4) attitudes with the scalar last."""
        return self.states[:, [2, 3, 4, 1]]

    @property
    def m(self) -> Array:
        """(n, 3) angular momentum about the fixed point [M L^2 T^-1]."""
        return self.states[:, 5:8]

    @property
    def rotation(self) -> Rotation:
        """The attitudes as one scipy.spatial.transform.Rotation; ImportError without SciPy."""
        from scipy.spatial.transform import Rotation

        return Rotation.from_quat(self.q_xyzw)

    @cached_property
    def velocity(self) -> Array:
        """(n, 3) angular velocity [T^-1]."""
        return _frozen(_core.velocity(self.scene._block, self.states))

    @cached_property
    def torque(self) -> Array:
        """(n, 3) torque of gravity about the fixed point, dm/dt [M L^2 T^-2]."""
        return _frozen(_core.torque(self.scene._block, self.states))

    @cached_property
    def frame(self) -> Array:
        """(n, 3, 3) the principal axes: frame[:, 0], [:, 1], [:, 2] are the unit vectors N, B, T."""
        return _frozen(_core.frame(self.scene._block, self.states))

    @cached_property
    def apex(self) -> Array:
        """(n, 3) unit vectors from the fixed point to the centre of mass; along T if they are the same point."""
        return _frozen(_core.apex(self.scene._block, self.states))

    @cached_property
    def kinetic(self) -> Array:
        """(n,) kinetic energy [M L^2 T^-2]."""
        return _frozen(_core.kinetic(self.scene._block, self.states))

    @cached_property
    def potential(self) -> Array:
        """(n,) potential energy, zero with the centre of mass level with the fixed point [M L^2 T^-2]."""
        return _frozen(_core.potential(self.scene._block, self.states))

    @cached_property
    def energy(self) -> Array:
        """(n,) kinetic + potential [M L^2 T^-2]."""
        return _frozen(self.kinetic + self.potential)

    @cached_property
    def vertical(self) -> Array:
        """(n,) <m, e3>, constant for every top [M L^2 T^-1]."""
        return _frozen(_core.vertical(self.scene._block, self.states))

    @cached_property
    def axial(self) -> Array:
        """(n,) <m, apex>, constant for a Lagrange top [M L^2 T^-1]."""
        return _frozen(_core.axial(self.scene._block, self.states))

    @cached_property
    def kowalewski(self) -> Array:
        """(n,) the fourth integral K of a Kowalewski top (Bodack 2008, 5.1) [T^-4]; NaN for other bodies."""
        return _frozen(_core.kowalewski(self.scene._block, self.states))

    @cached_property
    def goryachev_chaplygin(self) -> Array:
        """(n,) the integral G of a Goryachev-Chaplygin top (Bodack 2008, 5.2) [T^-3]; constant only while <m, e3> = 0;
        NaN for other bodies."""
        return _frozen(_core.goryachev_chaplygin(self.scene._block, self.states))

    def modified_energy(self, step: float) -> Array:
        """(n,) the energy that bobenko_suris keeps at this step, E + step <torque, m> / (2 I1) [M L^2 T^-2].

        NaN unless the body is a Lagrange top. A step back in time is negative, as `path.step` is.
        """
        return _core.modified_energy(self.scene._block, self.states, check.number("step", step))

    def modified_energy4(self, step: float) -> Array:
        """(n,) the energy that bobenko_suris4 keeps at this step, E up to a constant and step^4 [M L^2 T^-2]; NaN unless
        the body is a Lagrange top, and where the step is too large for the method."""
        return _core.modified_energy4(self.scene._block, self.states, check.number("step", step))

    @property
    def error(self) -> float | None:
        """The largest attitude error on [0, t], as estimated where solve was given an error; else None [rad]."""
        return self.plan.error if self.plan else None

    @cached_property
    def energy_error(self) -> float:
        """max |E - E0| / max (T + M |g| |com|) over the states, E0 at t = 0; zero for a path without states."""
        if not len(self):
            return 0.0
        block = self.scene._block
        start = np.array([block[12:]])
        kinetic, potential = float(_core.kinetic(block, start)[0]), float(_core.potential(block, start)[0])
        lever = float(np.linalg.norm(self.scene.body.com))
        size = max(kinetic, self.kinetic.max()) + self.scene.body.mass * abs(self.scene.gravity) * lever
        change = np.abs(self.energy - (kinetic + potential)).max()
        return float(change / size) if change else 0.0

    def scene_at(self, i: int) -> Scene:
        """The scene that begins, at t = 0, with state i. IndexError if there is none."""
        _, *q = self.states[i, :5]
        return self.scene.replace(attitude=q, momentum=self.m[i])

    @property
    def end(self) -> Scene:
        """The scene that begins, at t = 0, with the last state."""
        return self.scene_at(-1)


def _frozen(values: Array) -> Array:
    values.flags.writeable = False
    return values
