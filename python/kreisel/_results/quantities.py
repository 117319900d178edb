"""Quantities of states, and derivatives of states, read from the core."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple, SupportsIndex, TypeVar, cast

import numpy as np
import numpy.typing as npt
from numpy.typing import ArrayLike

from .._core import derivatives, modified_energy, modified_energy4, values
from .._core import tangents as TANGENTS
from .._model.scene import Scene
from .._options.options import (
    QUANTITIES,
    RECORDABLE,
    Options,
    QuantityDescription,
    validate_quantity_name,
    validate_time_list,
)
from .._options.plan import StepChoice
from .._utils.arguments import (
    Array,
    Numbers,
    as_float,
    as_three_floats,
    freeze_array,
    short_repr,
    suggest_name,
)
from .._utils.quantity_attributes import MethodName, QuantityAttributes, QuantityName
from .buffers import compute_quantity_derivatives, compute_quantity_values
from .error import RunStart

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation


SPECIFIC_FORCE = QuantityDescription(
    "specific_force",
    3,
    [f"specific_force_{axis}" for axis in "xyz"],
    False,
    "L T^-2",
    "acceleration of a point of the body minus that of gravity, seen from the frame of the body",
)


def specific_force(
    change: Array, rate: Array, vertical: Array, weight: float | Array, place: Array
) -> Array:
    """Return the specific force W' x r + W x (W x r) + g V at the position r in the body frame.

    weight  g, the acceleration by gravity and by the shaking of the support, a number or (n,)
    """
    support_force = np.asarray(weight)[..., None] * vertical
    force: Array = np.cross(change, place) + np.cross(rate, np.cross(rate, place)) + support_force
    return force


StateIndex = SupportsIndex | slice | Sequence[int] | npt.NDArray[np.integer | np.bool_]
ResolvedIndex = slice | npt.NDArray[np.intp]


def normalize_path_index(n: int, key: StateIndex) -> ResolvedIndex:
    """Convert an index to a slice, of length 1 for an integer, or an array of integers."""
    if isinstance(key, slice):
        return key
    numbers = np.asarray(key)
    kinds = "iub" if numbers.ndim else "iu"
    if numbers.ndim > 1 or (numbers.size and numbers.dtype.kind not in kinds):
        raise TypeError(
            "the states of a path are indexed by a whole number, a slice or a list of numbers, not "
            f"{short_repr(key)}; its quantities are attributes"
        )
    if numbers.ndim == 0:
        i = int(numbers)
        if not -n <= i < n:
            raise IndexError(f"a path of {n} states has no state of index {i}")
        return slice(i % n, i % n + 1)
    indices: npt.NDArray[np.intp] = np.arange(n)[numbers if numbers.size else []]
    return indices


def validate_times_within_path(path_times: Array, t: Numbers, begin: float) -> Array:
    """Return the times as an array; raise ValueError for times that a path does not span."""
    times = validate_time_list(t)
    low, high = float(path_times.min(initial=begin)), float(path_times.max(initial=begin))
    indices = np.flatnonzero((times < low) | (times > high))
    if indices.size:
        i = int(indices[0])
        label = f"t[{i}]" if times.ndim else "t"
        raise ValueError(
            f"{label} = {float(times.reshape(-1)[i])!r} lies outside the path, whose times go "
            f"from {low!r} to {high!r}: solve for a longer time"
        )
    return times.reshape(-1)


def list_flat_indices(shape: tuple[int, ...], key: Any) -> npt.NDArray[np.intp]:
    """Return the flat indices, in C order, of the elements that `key` selects from `shape`."""
    every: npt.NDArray[np.intp] = np.arange(math.prod(shape)).reshape(shape)
    return np.asarray(every[key])


def find_flat_index(shape: tuple[int, ...], key: Any) -> int | None:
    """Return the flat index of the member that `key` selects, or None if it selects several."""
    if type(key) is int and len(shape) == 1 and -shape[0] <= key < shape[0]:
        return key % shape[0]
    element = np.arange(math.prod(shape)).reshape(shape)[key]
    return None if isinstance(element, np.ndarray) else int(element)


TANGENT_ATTRIBUTES = {  # {attribute of a path with tangents: the hint if it is missing}
    "tangents": "solve with tangents='start' to have it",
    "tangents_low": "solve with tangents='start' to have it",
    "tangents_rest": "solve with tangents='start' to have it",
    "conditioning": "solve with tangents with respect to 'start' and all parameters that are not 0",
    "derivative": "solve with tangents='start' to have it",
}


class TangentData(NamedTuple):
    """(n, 6, columns) tangents, their low words and their truncation error.

    The truncation error is the largest magnitude among the last retained terms of the Taylor
    series. `by` lists the parameters with respect to which the derivatives are taken, in the order
    of the C library.
    """

    high: Array
    low: Array
    truncation: float | Any  # an array (*shape) for many tops
    by: tuple[str, ...]

    @classmethod
    def from_flat_arrays(
        cls, high: Array, low: Array, truncation: float, names: tuple[str, ...]
    ) -> TangentData:
        columns = sum(TANGENTS[name][1] for name in names)
        shape = (len(high), 6, columns)
        return cls(
            freeze_array(high.reshape(shape)), freeze_array(low.reshape(shape)), truncation, names
        )

    @property
    def parameter_bit_mask(self) -> int:
        return sum(TANGENTS[name][0] for name in self.by)


Recorded = TypeVar("Recorded")
NO_STATES = np.empty((0, 8))
STATE_COLUMNS = {"t": slice(0, 1), "q": slice(1, 5), "m": slice(5, 8)}
DEPENDENCIES = {  # {attribute of a path: the quantities that it needs, or "states"}
    "q_xyzw": ["q"],
    "rotation": ["q"],
    "error": ["q"],
    "euler": ["precession_angle", "nutation", "spin_angle"],
    "energy_error": ["energy", "kinetic"],
    "plot": ["apex", "nutation", "precession_angle"],
    "animate": ["q", "apex"],
    "end": ["states"],
    "scene_at": ["states"],
    "specific_force": ["body_acceleration", "inertial_velocity", "body_velocity", "body_vertical"],
    "modified_energy": ["states"],
    "modified_energy4": ["states"],
}


class Stats(NamedTuple):
    """The numbers of steps, rejected steps, torque evaluations and solver iterations in a run."""

    steps: int
    rejected: int
    evaluations: int
    iterations: int


class PathBase(QuantityAttributes):
    """The quantities of a kreisel.Path as attributes."""

    scene: Scene  # a kreisel.Ensemble for many tops
    states: Array  # not set if the path has _columns
    stats: Stats
    _options: Options
    _is_back: bool
    _low: Array | None  # low words of the states
    _columns: dict[str, Array] | None  # t and the quantities in want, instead of states
    _choice: StepChoice | None  # the choice of method='geometric'
    _tangent_data: TangentData | None
    _origin: RunStart
    _many: Any  # the result of an ensemble with the same states; None for one top

    @property
    def shape(self) -> tuple[int, ...]:
        """The shape of the ensemble; () for one top."""
        return () if self._many is None else self._many.shape

    @property
    def ndim(self) -> int:
        """The number of dimensions of the ensemble; 0 for one top."""
        return len(self.shape)

    @property
    def size(self) -> int:
        """The number of tops."""
        return math.prod(self.shape)

    @property
    def method(self) -> MethodName:
        """The name of the method; for many tops, of the requested method.

        For each top of an ensemble, 'auto' uses exact for Lagrange tops, spherical bodies and
        bodies without torque if exact applies to the scene, and taylor for all other tops.
        """
        if self._many is not None:
            return cast(MethodName, self._options.requested_method)
        return cast(MethodName, self._options.method)

    @property
    def step(self) -> float | None:
        """The step size [T], which is negative if the path runs backwards in time.

        The value is None if the method has no step size, or if it chose the step size itself.
        """
        return self._options.get_signed_step(self._is_back)

    @property
    def tol(self) -> float | None:
        """The tolerance that was used, or None if the method has none or chooses its own."""
        return self._options.tol

    @property
    def digits(self) -> int | None:
        """The number of digits, rounded up to 16, 20 or 30, or None if it was not given."""
        return self._options.digits

    @property
    def want(self) -> tuple[QuantityName, ...] | None:
        """The quantities that the path stores in addition to t.

        The value None means that the path stores complete states, from which all quantities can be
        computed.
        """
        return self._options.want

    def __len__(self) -> int:
        """Return the number of states of one top, or the first dimension of an ensemble."""
        return len(self.t if self._many is None else self._many)

    def _list_members(self) -> list[Any]:
        return [self._many._select_member(i) for i in range(self.size)]

    def _compute_per_top(self, compute: Callable[[Any], Any]) -> Any:
        """Return an array (*shape) of the value of `compute` for the path of each top."""
        values = [compute(path) for path in self._list_members()]
        return freeze_array(np.array(values or np.empty(0)).reshape(self.shape))

    def _compute_per_state(self, compute: Callable[[Any], Array]) -> Array:
        """Return an array (*shape, k) of the values of `compute` for the path of each top."""
        rows = np.full((self.size, self.t.shape[-1]), np.nan)
        counts = np.ravel(self._many.state_counts).tolist()
        for row, n, path in zip(rows, counts, self._list_members(), strict=True):
            row[:n] = compute(path)[:n]  # a path can end with a state between the times
        return freeze_array(rows.reshape(*self.shape, -1) if rows.size else rows)

    def __dir__(self) -> list[str]:
        """Return the names of the available attributes, omitting quantities that are not stored."""
        names = {"states", *super().__dir__()}
        names -= set() if self._tangent_data else set(TANGENT_ATTRIBUTES)
        if self.want is not None:
            names -= {"states", *RECORDABLE} - set(self.want)
            names -= {word for word in DEPENDENCIES if self._list_missing_quantities(word)}
            names |= {"error"} if self._choice else set()
        return sorted(names)

    def _list_missing_quantities(self, name: str) -> list[str]:
        """List the quantities, or "states", that the attribute `name` needs but the path lacks."""
        needs = [name] if name in RECORDABLE else DEPENDENCIES.get(name, ["states"])
        if name == "error" and self._options.has_extended_precision:
            needs = [*needs, "q_low"]
        return [need for need in needs if need not in (self.want or ())]

    if not TYPE_CHECKING:  # type checkers know the quantities from QuantityAttributes

        def __getattr__(self, name: str) -> Array:
            """Raise AttributeError with a message that helps to find or compute the quantity."""
            if name.startswith("__"):
                raise AttributeError(name)
            if self.want is not None and (name == "states" or hasattr(type(self), name)):
                missing = self._list_missing_quantities(name)
                more = f"add {' and '.join(map(repr, missing))} to want"
                more = "solve without want" if "states" in missing else more
                raise AttributeError(
                    f"this path has no {name!r}: it has only the quantities of "
                    f"want={self.want!r}; {more}"
                )
            if name in TANGENT_ATTRIBUTES:
                raise AttributeError(f"this path has no {name!r}: {TANGENT_ATTRIBUTES[name]}")
            names = [word for word in sorted({"states", *dir(type(self))}) if word[0] != "_"]
            raise AttributeError(f"a path has no {short_repr(name)}; {suggest_name(name, names)}")

    def _select_state_component(self, name: str) -> Array:
        if self._columns is not None and name in self._columns:
            return self._columns[name]
        if name == "t" and self._many is not None:
            times: Array = self._many.t
            return times
        part = self.states[..., STATE_COLUMNS[name]]
        return part[..., 0] if name == "t" else part

    @property
    def t(self) -> Array:
        """(n,) times [T]; (*shape, n) if each top of an ensemble has its own times."""
        return self._select_state_component("t")

    @property
    def q(self) -> Array:
        """(n, 4) unit quaternions (w, x, y, z), from the frame of description to space."""
        return self._select_state_component("q")

    @property
    def q_xyzw(self) -> Array:
        """(n, 4) unit quaternions (x, y, z, w), with the scalar component last."""
        return self.q[..., [1, 2, 3, 0]]

    @property
    def m(self) -> Array:
        """(n, 3) angular momentum about the fixed point [M L^2 T^-1]."""
        return self._select_state_component("m")

    @cached_property
    def q_low(self) -> Array:
        """(n, 4) low words of q: the sum q + q_low has the requested digits.

        The low-order parts of the quaternion q are zero if at most 16 digits were requested.
        """
        return self._select_low_words("q")

    @cached_property
    def m_low(self) -> Array:
        """(n, 3) low words of m [M L^2 T^-1]; zero if at most 16 digits were requested."""
        return self._select_low_words("m")

    def _select_low_words(self, name: str) -> Array:
        if self._low is not None:
            return self._low[..., STATE_COLUMNS[name]]
        if self.want is not None and (self.digits or 0) > 16:
            raise AttributeError(name)
        return freeze_array(np.zeros_like(getattr(self, name)))

    @property
    def tangents(self) -> Array:
        """(n, 6, c) derivatives of the states, if solve was called with `tangents`.

        The first three rows of each matrix of derivatives are changes of attitude, expressed as
        rotation vectors in the body frame [rad]. The other three rows are changes of momentum in
        space [M L^2 T^-1].

        If "start" was requested, the first six columns are the derivatives with respect to the
        initial state; at t = 0, they form an identity matrix. The requested derivatives with
        respect to scene parameters follow in this order: the moments (3), the centre of mass (3),
        gravity, mass, damping (3), rotor (3), turning (3), shaking (3) and friction. The centre of
        mass and the rotor are given by their components along the principal axes. Each of these
        columns contains the derivatives with respect to one parameter at constant initial momentum.
        """
        return self._get_tangents_or_raise().high

    @property
    def tangents_low(self) -> Array:
        """(n, 6, c) low words of the tangents.

        The low-order parts of the tangents, which extend their precision, are zero if at most 16
        digits were requested.
        """
        return self._get_tangents_or_raise().low

    @property
    def tangents_rest(self) -> float:
        """The truncation error of the tangents, relative to their magnitude.

        The estimate is the largest magnitude among the last retained Taylor terms of the tangents.
        The steps are chosen for the accuracy of the path, not for that of the tangents.

        For a kreisel.ExactTorus, the estimate is the largest difference between the tangents
        computed with orders 6 and 8, plus 5e-11, the largest effect of rounding errors.
        Both are relative to the magnitude of the tangent or, for small tangents, to that of the
        state.
        """
        return self._get_tangents_or_raise().truncation

    @property
    def conditioning(self) -> Array:
        """(n,) a bound on the change of attitude if each number of the scene is rounded [rad].

        The bound assumes that each number that defines the scene is rounded once, with a relative
        error of at most 2^-53. Raises AttributeError unless the path stores the tangents with
        respect to every parameter that is not zero.
        """
        data = self._get_tangents_or_raise()
        if self._many is not None:
            return self._compute_per_state(lambda path: path.conditioning)
        scene, body = self.scene, self.scene.body
        numbers: dict[str, tuple[float, ...]] = {
            # a change of a unit quaternion rotates by twice its size
            "start": (2.0, 2.0, 2.0, *scene.momentum),
            "moments": body.moments,
            "com": body.principal_com,
            "gravity": (scene.gravity,),
            "mass": (body.mass,),
            "damping": scene.damping,
            "rotor": body.principal_rotor,
            "turning": scene.turning,
            "shaking": scene.shaking if scene._is_shaken else (0.0, 0.0, 0.0),
            "friction": (scene.friction,),
        }
        # Parameters equal to zero carry no rounding error.
        if any(name not in data.by and any(each) for name, each in numbers.items()):
            hint = TANGENT_ATTRIBUTES["conditioning"]
            raise AttributeError(f"this path has no 'conditioning': {hint}")
        sizes = np.abs([number for name in data.by for number in numbers[name]])
        changes = np.sqrt((data.high[:, :3] ** 2).sum(axis=1))
        return freeze_array(2.0**-53 * (changes * sizes).sum(axis=1))

    def derivative(self, quantity: QuantityName) -> Array:
        """Return the derivatives of a quantity; `tangents` must have been passed to solve.

        The shape of the array is (n, c) for a scalar, (n, 3, c) for a vector and (n, 3, 3, c) for
        `frame`. The last dimension of the array corresponds to the columns of `path.tangents`. The
        derivatives of q are expressed as rotation vectors in the body frame [rad], with shape (n,
        3, c). Angles change without jumps.

        Derivatives that do not exist are NaN. The derivatives of the Euler angles do not exist if
        the apex is vertical. Derivatives with respect to com do not exist if com is zero and the
        quantity depends on the direction of the apex. The functions `kowalewski` and
        `goryachev_chaplygin` are conserved only for special bodies. Derivatives of `kowalewski` and
        `goryachev_chaplygin` are NaN for parameters whose variation violates the conditions on the
        body. Changes of the moments of inertia violate the conditions on a Kowalewski or
        Goryachev-Chaplygin body, and so do changes of com along the principal axis whose moment
        differs from the other two.

            >>> import kreisel as kr
            >>> path = kr.solve(kr.scenes.asymmetric, [0.0, 1.0], tangents=("start", "gravity"))
            >>> path.derivative("nutation").shape, path.derivative("apex").shape
            ((2, 7), (2, 3, 7))

        quantity  the name of a quantity, except t and the low words

        Raises AttributeError if the path stores no tangents, and ValueError for an unknown name.
        """
        if self._tangent_data is None:
            hint = TANGENT_ATTRIBUTES["derivative"]
            raise AttributeError(f"this path has no derivatives: {hint}")
        name, data = validate_quantity_name(quantity), self._tangent_data
        bits = data.parameter_bit_mask
        if self._many is not None:
            rows = compute_quantity_derivatives(name, self._many.scene, self._many._buffers, bits)
            return freeze_array(rows.reshape(*self.shape, *rows.shape[1:]))
        return freeze_array(derivatives(name, self.scene._block, self.states, bits, data.high))

    def _get_tangents_or_raise(self) -> TangentData:
        if self._tangent_data is None:
            raise AttributeError("tangents")
        return self._tangent_data

    @property
    def rotation(self) -> Rotation:
        """The attitudes as a single scipy.spatial.transform.Rotation.

        Raises ImportError if SciPy is not installed.
        """
        from .scipy_rotation import Attitudes

        return Attitudes(self.q_xyzw)

    def specific_force(self, point: ArrayLike) -> Array:
        """Return the readings of an accelerometer at a given point of the body [L T^-2].

        The result is the acceleration of the point minus the gravitational acceleration, in the
        body frame. At the fixed point, the reading is the negative of the gravitational
        acceleration, unless the support is shaken. The result includes the acceleration caused by a
        turning or shaken support.

            >>> import kreisel as kr
            >>> top = kr.scenes.asymmetric.replace(attitude=(1, 0, 0, 0), gravity=9.81)
            >>> kr.solve(top, [0.0]).specific_force((0, 0, 0)).round(9).tolist()
            [[0.0, 0.0, 9.81]]

        point  its place from the fixed point, in the frame of the body [L]
        """
        place = np.array(as_three_floats("point", point))
        scene, rate, change = self.scene, self.inertial_velocity, self.body_acceleration
        if np.any(scene.turning):
            change = change + np.cross(rate - self.body_velocity, self.body_velocity)
        weight = np.asarray(scene.gravity)[..., None]
        amplitude, pace, phase = np.moveaxis(np.asarray(scene.shaking)[..., None, :], -1, 0)
        if amplitude.any():
            weight = weight - amplitude * pace**2 * np.cos(pace * self.t + phase)
        return freeze_array(specific_force(change, rate, self.body_vertical, weight, place))

    def modified_energy(self, step: float) -> Array:
        """Return the energies (n,) that bobenko_suris conserves with step `step` [M L^2 T^-2].

        For a top with energy E and transverse moment of inertia I1, the method conserves the energy
        E + step <torque, m> / (2 I1). All energies are NaN unless the body is a Lagrange top. Like
        `path.step`, the argument `step` is negative if the path runs backwards in time.
        """
        if self._many is not None:
            return self._compute_per_state(lambda path: path.modified_energy(step))
        return modified_energy(self.scene._block, self.states, as_float("step", step))

    def modified_energy4(self, step: float) -> Array:
        """Return the energies (n,) that bobenko_suris4 conserves with step `step` [M L^2 T^-2].

        The quantity that the method conserves differs from the energy E by a constant and by terms
        of order step^4. The values are NaN if the body is not a Lagrange top, or if the step is too
        large.
        """
        if self._many is not None:
            return self._compute_per_state(lambda path: path.modified_energy4(step))
        return modified_energy4(self.scene._block, self.states, as_float("step", step))

    @cached_property
    def energy_error(self) -> float:
        """The largest relative error of the energy, max |E - E0| / max (T + mass |gravity| |com|).

        E0 is the initial energy, T is the kinetic energy, and both maxima are taken over all
        states. The relative error is zero if the path has no states. The value is NaN for scenes
        with damping, friction or a shaken support, because the energy is then not conserved.
        """
        if self._many is not None:
            return cast(float, self._compute_per_top(lambda path: path.energy_error))
        if self.scene._is_losing_energy or self.scene._is_shaken:
            return np.nan
        if not len(self):
            return 0.0
        scene = self.scene
        kinetic, potential = (
            float(values(name, scene._block, scene._start_state)[0])
            for name in ("kinetic", "potential")
        )
        lever = float(np.linalg.norm(scene.body.com))
        size = max(kinetic, self.kinetic.max()) + scene.body.mass * abs(scene.gravity) * lever
        change = np.abs(self.energy - (kinetic + potential)).max()
        return float(change / size) if change else 0.0


def add_quantity_properties(
    kind: type[Recorded], lead: tuple[str, ...], column: Callable[[Recorded, str], Array]
) -> None:
    """Add a property for each quantity, computed by `column`, after the dimensions `lead`."""
    for name in [name for name in QUANTITIES if name not in vars(kind)]:
        quantity = QUANTITIES[name]

        def of(path: Recorded, name: str = name) -> Array:
            return column(path, name)

        sizes = [*lead, *map(str, quantity.shape)]
        shape = ", ".join(sizes) + ("," if len(sizes) == 1 else "")
        unit = f" [{quantity.dimension}]" if quantity.dimension else ""
        of.__doc__ = f"({shape}) {quantity.text}{unit}."
        attribute = cached_property(of)
        attribute.__set_name__(kind, name)
        setattr(kind, name, attribute)


def _compute_path_quantity(path: PathBase, name: str) -> Array:
    if path._many is None:
        return freeze_array(values(name, path.scene._block, path.states))
    states = path.states  # raises AttributeError if the path has only some quantities
    rows = compute_quantity_values(name, path._many.scene, path._many._buffers)
    return freeze_array(rows.reshape(*states.shape[:-1], *rows.shape[2:]))


add_quantity_properties(PathBase, ("n",), _compute_path_quantity)
