"""Results of runs of one or of many tops: their statuses, and the quantities of their states."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import cache, cached_property
from typing import TYPE_CHECKING, Any, Self, TypeVar, cast

import numpy as np
import numpy.typing as npt
from numpy.typing import ArrayLike

from .. import quaternion
from .._core import derivatives, modified_energy, modified_energy4, statuses, values
from .._core import tangents as TANGENTS
from .._options import options as choices
from .._options.options import QUANTITIES, RECORDABLE, TIME, Options
from .._options.plan import StepChoice
from .._utils import arguments
from .._utils.arguments import Array, as_float, freeze_array, short_repr
from .._utils.quantity_attributes import MethodName, QuantityAttributes, QuantityName
from . import calls
from .calls import EnsembleBuffers, EventColumns, TangentData
from .tables import ColumnTable, TableColumn, list_parameter_columns, name_axes

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation


class RunStoppedException(BaseException):
    """Base class of exceptions for runs that ended before the last requested time.

    status  the name of the status in kreisel.h without its prefix: 'ERR_LIMIT', 'ERR_NOT_FINITE',
            ...
    path    the requested states that were reached, and the last valid state if it is later; of
            several tops the path of the first that failed or was not finished; None for sweeps,
            fits and comparisons
    result  all that was computed: the path, or of several tops a kreisel.Path, kreisel.Reductions,
            kreisel.Section or kreisel.Chaos; the finished parts of a sweep; the rows of a
            comparison; the best fit so far or None
    """

    def __init__(
        self,
        message: str,
        status: str = "ERR_INTERRUPTED",
        path: Any = None,
        result: Any = None,
    ) -> None:
        super().__init__(message)
        self.status, self.path = status, path
        self.result = path if result is None else result

    def __reduce__(self) -> tuple[type[RunStoppedException], tuple[str, str, Any, object]]:
        return type(self), (str(self), self.status, self.path, self.result)


class Error(RunStoppedException, RuntimeError):
    """Exception for a failed run; `path` contains the valid states, and `status` is the reason."""

    __module__ = "kreisel"  # a traceback then shows the public name


class Interrupted(RunStoppedException, KeyboardInterrupt):
    """Exception for a computation interrupted by Ctrl-C, with what was computed in `.result`."""

    __module__ = "kreisel"


_T = TypeVar("_T", bound=np.generic)


def find_flat_index(shape: tuple[int, ...], key: Any) -> int | None:
    """Return the flat index of the member that `key` selects, or None if it selects several."""
    if type(key) is int and len(shape) == 1 and -shape[0] <= key < shape[0]:
        return key % shape[0]
    element = np.arange(math.prod(shape)).reshape(shape)[key]
    return None if isinstance(element, np.ndarray) else int(element)


@arguments.make_frozen_class_decorator("call solve again for a different result")
class RunResult(arguments.ShapedBase):
    """The result of a run of one top or of many.

    Arrays are read-only, and those of many tops begin with the dimensions of the scene.

    scene  the scene, of one top or of many
    """

    scene: Any
    _t: Array  # (k,), or (n, k) if each top has its own times
    _options: Options
    _buffers: EnsembleBuffers
    _is_back: bool = False
    _is_many: bool = True  # False: the path of a single scene

    def __init__(self, scene: Any, t: Array, options: Options, buffers: EnsembleBuffers) -> None:
        vars(self).update(scene=scene, _t=t, _options=options, _buffers=buffers)

    @property
    def shape(self) -> tuple[int, ...]:
        """The shape of the ensemble; () for one top."""
        return cast(tuple[int, ...], self.scene.shape) if self._is_many else ()

    def __len__(self) -> int:
        return len(self.scene)

    def __iter__(self) -> Iterator[Any]:
        """Return an iterator over the first dimension, or over the states of one top."""
        return (self[i] for i in range(len(self)))

    @property
    def method(self) -> MethodName:
        """The name of the method; for many tops, of the requested method.

        For each of many tops, 'auto' uses exact for Lagrange tops, spherical bodies and bodies
        without torque if exact applies to the scene, and taylor for all others.
        """
        options = self._options
        return cast(MethodName, options.requested_method if self._is_many else options.method)

    @property
    def step(self) -> float | None:
        """The step size [T], negative if a path runs back in time; None if the method chose it."""
        step = self._options.step
        return -step if self._is_back and step is not None else step

    @property
    def tol(self) -> float | None:
        """The tolerance that was used, or None if the method has none or chooses its own."""
        return self._options.tol

    @property
    def digits(self) -> int | None:
        """The number of digits, rounded up to 16, 20 or 30, or None if it was not given."""
        return self._options.digits

    def _list_controls(self) -> dict[str, object]:
        """Return the method and its parameters, without those that are None."""
        names = "method", "step", "tol", "digits"
        return {name: x for name in names if (x := getattr(self, name)) is not None}

    def _format_controls(self) -> str:
        """Return the method and its parameters, as in "strang, step=0.01"."""
        method, *others = self._list_controls().items()
        return "".join([str(method[1]), *(f", {name}={value!r}" for name, value in others)])

    def _format_summary(self) -> str:
        count = int(np.count_nonzero(self._buffers.status))
        return f"{self._format_controls()}, {count or 'none'} failed"

    def _reshape_to_ensemble(self, rows: npt.NDArray[_T]) -> npt.NDArray[_T]:
        """Return `rows`, an array with one row per top, reshaped to the ensemble's shape."""
        array = rows.reshape(self.shape + rows.shape[1:])
        array.flags.writeable = False
        return array

    def _unwrap(self, values: npt.NDArray[_T]) -> npt.NDArray[_T] | Any:
        """Return a read-only array, or a Python scalar for one top."""
        if values.ndim == 0:
            return values.item()
        values.flags.writeable = False
        return values

    @property
    def t(self) -> Array:
        """(k,) times common to all tops, or (*shape, k) if each top has its own times [T]."""
        return freeze_array(self._t[:]) if self._t.ndim == 1 else self._reshape_to_ensemble(self._t)

    @property
    def status(self) -> Any:
        """(*shape) the name of each top's status: 'OK', 'ERR_LIMIT', ...; a str for one top.

        The names are those of the constants in kreisel.h without KR_. The method `message`
        describes a failure. The run of one top raises an exception, whose path has the status.
        """
        return self._unwrap(np.array(calls.STATUSES)[self._buffers.status].reshape(self.shape))

    @property
    def failed(self) -> npt.NDArray[np.intp]:
        """(f,) the indices of the tops that did not reach their last time.

        For f failed tops, the shape is (f,) for one-dimensional ensembles and (f, ndim) otherwise.
        """
        indices = np.argwhere(np.asarray(self.status) != "OK")
        return indices[:, 0] if self.ndim == 1 else indices

    @property
    def reached(self) -> Any:
        """(*shape) the time of the last valid state of each top [T]; a float for one top."""
        return self._unwrap(self._buffers.reached.reshape(self.shape))

    @property
    def state_counts(self) -> Any:
        """(*shape) the number of requested times that each top reached; an int for one top."""
        return self._unwrap(self._buffers.done.reshape(self.shape))

    @cached_property
    def stats(self) -> Any:
        """The cost of the run: a named tuple of four arrays (*shape), such as `stats.steps`."""
        arrays: Any = map(self._reshape_to_ensemble, self._buffers.counts.T.copy())
        return calls.Stats(*arrays)

    def message(self, index: int | tuple[int, ...] = ()) -> str:
        """Return the reason why the top at `index` failed, or 'success' if it did not fail."""
        i = find_flat_index(self.shape, index)
        if i is None:
            raise IndexError(
                f"{short_repr(index)} is not the index of one top, of the shape {self.shape}"
            )
        return statuses["OK"][1] if self._buffers.status[i] == 0 else str(self._make_top_error(i))

    def check(self) -> Self:
        """Check that every top reached its final time, and return this result.

        Raises kreisel.Error, or kreisel.Interrupted after Ctrl-C, for the first top that did not.
        The message states its index and the number of failed tops. The attribute `path` of the
        exception is the path of the failed top, and `result` is this result.
        """
        indices = np.flatnonzero(self._buffers.status)
        if indices.size:
            raise self._make_stop_error(int(indices[0]), indices.size)
        return self

    def _make_top_error(self, i: int) -> BaseException:
        """Return the exception that would be raised if the i-th top were computed alone."""
        raise NotImplementedError

    def _make_stop_error(self, i: int, count: int) -> Error | Interrupted:
        """Return the exception for `count` unfinished tops, first the `i`-th."""
        text, code = str(self._make_top_error(i)), self._buffers.status[i]
        if self.shape:
            first = f", the first of {count} of {self.size}" if count > 1 else ""
            text = f"top{choices.format_index(choices.unravel_index(i, self.shape))}{first}: {text}"
        kind = Interrupted if code == calls.INTERRUPTED else Error
        return kind(text, calls.STATUSES[code], self._select_member(i), self)

    def _select_times_of_top(self, i: int) -> Array:
        return self._t if self._t.ndim == 1 else self._t[i]

    def _select_member(self, i: int) -> Any:
        """Return the path of the i-th top, counted in C order."""
        raise NotImplementedError

    def _select_rows(self, key: Any) -> tuple[Any, Array, Options, EnsembleBuffers]:
        """Return the arguments of the result of the tops that a NumPy index selects."""
        rows = key
        if not (isinstance(key, slice) and self.ndim == 1):
            rows = np.asarray(np.arange(self.size).reshape(self.shape)[key]).reshape(-1)
        t = self._t if self._t.ndim == 1 else self._t[rows]
        return self.scene[key], t, self._options, self._buffers.select_buffer_rows(rows)

    def __getitem__(self, key: Any) -> Any:
        """Return the result of one or several tops, selected by a NumPy index."""
        return type(self)(*self._select_rows(key))

    def _make_column_table(
        self,
        columns: Sequence[TableColumn],
        taken: Iterable[str] = (),
        times: Mapping[str, int] | None = None,
    ) -> ColumnTable:
        """Return a table of the varying parameters, apart from the names `taken`, and `columns`."""
        axes, text = name_axes(self.scene, taken), "the time of the last valid state"
        states = [
            TableColumn("status", axes, self.status, "", "OK, or the name of the failure"),
            TableColumn("reached", axes, self.reached, TIME.dimension, text),
        ]
        states = [x._replace(values=np.asarray(x.values), is_coordinate=True) for x in states]
        sizes = {**dict(zip(axes, self.shape, strict=True)), **(times or {})}
        parameters = list_parameter_columns(self.scene, taken)
        return ColumnTable(sizes, [*parameters, *states, *columns], self._list_controls())

    @cached_property
    def _event_columns(self) -> EventColumns:
        """The events of many tops, sorted by the index of the top."""
        rows, states, kinds = np.empty(0, np.int64), np.empty((0, 8)), np.empty(0, np.intc)
        none = EventColumns(rows, states, states, kinds, kinds)
        parts = zip(none, *self._buffers.events, strict=True)
        columns = [np.concatenate(column) for column in parts]
        order = np.argsort(columns[0], kind="stable")
        return EventColumns(*(column[order] for column in columns))


def unravel_rows(rows: Any, shape: tuple[int, ...]) -> Any:
    """Return the indices of tops from their positions in C order.

    The array has the shape (k,) for a one-dimensional ensemble, and otherwise (k, dimensions).
    """
    if len(shape) == 1:
        return freeze_array(rows)
    indices: Any = np.array(np.unravel_index(rows, shape) if shape else (), np.int64)
    return freeze_array(indices.T.reshape(len(rows), len(shape)))


_FORCE = (
    "acceleration of a point of the body minus that of gravity, seen from the frame of the body"
)
_FORCE_NAMES = [f"specific_force_{axis}" for axis in "xyz"]
SPECIFIC_FORCE = choices.QuantityDescription(
    "specific_force", 3, _FORCE_NAMES, False, "L T^-2", _FORCE
)


def specific_force(
    change: Array,
    rate: Array,
    vertical: Array,
    weight: float | Array,
    place: Array,
    gradient: float | Array,
) -> Array:
    """Return W' x r + W x (W x r) + g V - k (<V, r> V - r / 3) at the position r in the body frame.

    weight    g, the acceleration by gravity and by the shaking of the support, a number or (n,)
    gradient  k, a number or (n,)
    """
    support = (weight - gradient * (vertical @ place))[..., None] * vertical
    tide = np.asarray(gradient)[..., None] * place / 3.0
    return np.cross(change, place) + np.cross(rate, np.cross(rate, place)) + support + tide


@cache
def make_attitudes_class() -> Any:
    """Return a class of SciPy rotations that also accept read-only arrays, unlike SciPy 1.17.

    Inverses, products and subsets of such rotations also have this class.
    """
    with arguments.optional_dependency("scipy"):
        from scipy.spatial.transform import Rotation

    class Attitudes(Rotation):  # type: ignore[misc]
        def apply(self, vectors: ArrayLike, inverse: bool = False) -> Any:
            return super().apply(np.array(vectors, dtype=np.float64), inverse)

        def inv(self) -> Any:
            return Attitudes(super().inv().as_quat(), normalize=False)

        def __getitem__(self, which: object) -> Any:
            return Attitudes(super().__getitem__(which).as_quat(), normalize=False)

        def __iter__(self) -> Iterator[Any]:
            return (self[i] for i in range(len(self)))

        def __mul__(self, other: Rotation) -> Any:
            return Attitudes(super().__mul__(other).as_quat(), normalize=False)

        def __reduce__(self) -> tuple[Any, ...]:  # a local class cannot be pickled
            return make_rotations, (self.as_quat(), False)

    return Attitudes


def make_rotations(q_xyzw: Array, normalize: bool = True) -> Any:
    return make_attitudes_class()(q_xyzw, normalize=normalize)


_Recorded = TypeVar("_Recorded")
_START_HINT = "solve with tangents='start' to have it"
TANGENT_ATTRIBUTES = {  # {attribute of a path with tangents: the hint if it is missing}
    **dict.fromkeys(("tangents", "tangents_low", "tangents_rest", "derivative"), _START_HINT),
    "conditioning": "solve with tangents with respect to 'start' and all parameters that are not 0",
}
_POINT = ["q", "velocity", "body_acceleration"]
_DEPENDENCIES = {  # {attribute of a path: the quantities that it needs, or "states"}
    "q_xyzw": ["q"],
    "rotation": ["q"],
    "error": ["q"],
    "euler": ["precession_angle", "nutation", "spin_angle"],
    "energy_error": ["energy", "kinetic"],
    "plot": ["apex", "nutation", "precession_angle"],
    "animate": ["q", "apex"],
    "specific_force": ["body_acceleration", "inertial_velocity", "body_velocity", "body_vertical"],
    **{"position": _POINT[:1], "point_velocity": _POINT[:2], "point_acceleration": _POINT},
    **{name: ["states"] for name in ("end", "scene_at", "modified_energy", "modified_energy4")},
}


class PathBase(RunResult, QuantityAttributes):
    """The quantities of a kreisel.Path as attributes."""

    states: Array  # not set if the path has _columns
    stats: Any
    _low: Array | None  # low words of the states
    _columns: dict[str, Array] | None  # t and the quantities in want, instead of states
    _choice: StepChoice | None  # the choice of method='geometric'
    _tangent_data: TangentData | None
    _origin: calls.RunStart

    @property
    def want(self) -> tuple[QuantityName, ...] | None:
        """The quantities that the path stores in addition to t; None: the complete states."""
        return self._options.want

    def __len__(self) -> int:
        """Return the number of states of one top, or the first dimension of an ensemble."""
        return super().__len__() if self._is_many else len(self.t)

    def __bool__(self) -> bool:
        return super().__bool__() if self._is_many else len(self.t) > 0

    def _list_members(self) -> list[Any]:
        return [self._select_member(i) for i in range(self.size)]

    def _compute_per_top(self, compute: Callable[[Any], Any], kind: Any = np.float64) -> Any:
        """Return an array (*shape) of the value of `compute` for the path of each top."""
        rows = np.empty(self.size, kind)
        rows[:] = [compute(path) for path in self._list_members()]
        return self._reshape_to_ensemble(rows)

    def _compute_per_state(self, compute: Callable[[Any], Array]) -> Array:
        """Return an array (*shape, k) of the values of `compute` for the path of each top."""
        rows = np.full((self.size, self.t.shape[-1]), np.nan)
        for row, n, path in zip(rows, self._buffers.done, self._list_members(), strict=True):
            row[:n] = compute(path)[:n]  # a path can end with a state between the times
        return self._reshape_to_ensemble(rows)

    def __dir__(self) -> list[str]:
        """Return the names of the available attributes, omitting quantities that are not stored."""
        names = {"states", *super().__dir__()}
        names -= set() if self._tangent_data else set(TANGENT_ATTRIBUTES)
        if self.want is not None:
            names -= {"states", *RECORDABLE} - set(self.want)
            names -= {word for word in _DEPENDENCIES if self._list_missing_quantities(word)}
            names |= {"error"} if self._choice else set()
        return sorted(names)

    def _list_missing_quantities(self, name: str) -> list[str]:
        """List the quantities, or "states", that the attribute `name` needs but the path lacks."""
        needs = [name] if name in RECORDABLE else _DEPENDENCIES.get(name, ["states"])
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
            hint = arguments.suggest_name(name, names)
            raise AttributeError(f"a path has no {short_repr(name)}; {hint}")

    def _select_state_component(self, name: str) -> Array:
        if self._columns is not None and name in self._columns:
            return self._columns[name]
        part = self.states[..., calls.STATE_COLUMNS[name]]
        return part[..., 0] if name == "t" else part

    @property
    def t(self) -> Array:
        """(n,) times [T]; (*shape, n) if each top of an ensemble has its own times."""
        return super().t if self._is_many else self._select_state_component("t")

    @property
    def q(self) -> Array:  # type: ignore[override]
        """(n, 4) unit quaternions (w, x, y, z), from the frame of description to space."""
        return self._select_state_component("q")

    @property
    def q_xyzw(self) -> Array:
        """(n, 4) unit quaternions (x, y, z, w), with the scalar component last."""
        return self.q[..., [1, 2, 3, 0]]

    @property
    def m(self) -> Array:  # type: ignore[override]
        """(n, 3) angular momentum about the fixed point [M L^2 T^-1]."""
        return self._select_state_component("m")

    @cached_property
    def q_low(self) -> Array:
        """(n, 4) low words of q; zero if at most 16 digits were requested."""
        return self._select_low_words("q")

    @cached_property
    def m_low(self) -> Array:
        """(n, 3) low words of m [M L^2 T^-1]; zero if at most 16 digits were requested."""
        return self._select_low_words("m")

    def _select_low_words(self, name: str) -> Array:
        if self._low is not None:
            return self._low[..., calls.STATE_COLUMNS[name]]
        if self.want is not None and (self.digits or 0) > 16:
            raise AttributeError(name)
        return freeze_array(np.zeros_like(getattr(self, name)))

    @property
    def tangents(self) -> Array:
        """(n, 6, c) derivatives of the states, if solve was called with `tangents`.

        The first three rows of each matrix are changes of attitude, as rotation vectors in the body
        frame [rad], the others changes of momentum in space [M L^2 T^-1]. With "start", the first
        six columns are the derivatives with respect to the initial state, an identity matrix at
        t = 0. Those with respect to parameters, at constant initial momentum, follow in this order:
        the moments (3), the centre of mass (3), gravity, mass, damping (3), rotor (3), turning (3),
        shaking (3), friction and gradient. The centre of mass and the rotor are given by their
        components along the principal axes.
        """
        return self._get_tangents_or_raise().high

    @property
    def tangents_low(self) -> Array:
        """(n, 6, c) low words of the tangents; zero if at most 16 digits were requested."""
        return self._get_tangents_or_raise().low

    @property
    def tangents_rest(self) -> float:
        """The truncation error of the tangents, relative to their magnitude.

        The estimate is the largest magnitude among the last retained Taylor terms of the tangents;
        the steps are chosen for the accuracy of the path. For a kreisel.ExactTorus, it is the
        largest difference between the tangents computed with orders 6 and 8, plus 5e-11 for
        rounding errors, relative to the state if the tangent is smaller.
        """
        return self._get_tangents_or_raise().truncation

    @property
    def conditioning(self) -> Array:
        """(n,) a bound on the change of attitude if each number of the scene is rounded [rad].

        Each number is assumed to be rounded once, with a relative error of at most 2^-53. Raises
        AttributeError unless the path stores the tangents with respect to every parameter that is
        not zero.
        """
        data = self._get_tangents_or_raise()
        if self._is_many:
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
            "gradient": (scene.gradient,),
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
        `frame`, where the last dimension has the columns of `path.tangents`. The derivatives of q
        are rotation vectors in the body frame [rad], of the shape (n, 3, c). Angles change without
        jumps.

        Derivatives that do not exist are NaN: those of the Euler angles if the apex is vertical,
        and those with respect to com if com is zero and the quantity depends on the apex. Those of
        `kowalewski` and `goryachev_chaplygin` are NaN for parameters whose variation violates the
        conditions on such bodies: the moments, and com along the principal axis whose moment
        differs from the other two.

            >>> import kreisel as kr
            >>> path = kr.solve(kr.scenes.asymmetric, [0.0, 1.0], tangents=("start", "gravity"))
            >>> path.derivative("nutation").shape, path.derivative("apex").shape
            ((2, 7), (2, 3, 7))

        quantity  the name of a quantity, except t and the low words

        Raises AttributeError if the path stores no tangents, and ValueError for an unknown name.
        """
        if self._tangent_data is None:
            raise AttributeError(f"this path has no derivatives: {_START_HINT}")
        name, data = str(quantity), self._tangent_data
        if name not in QUANTITIES:
            raise ValueError(arguments.unknown_name_message("quantity", name, QUANTITIES))
        bits = sum(TANGENTS[name][0] for name in data.by)
        if not self._is_many:
            rows = derivatives(name, self.scene._block, self.states, bits, data.high)
            return freeze_array(rows)
        rows = calls.compute_quantity_values(name, self.scene, self._buffers, bits)
        return self._reshape_to_ensemble(rows)

    def _get_tangents_or_raise(self) -> TangentData:
        if self._tangent_data is None:
            raise AttributeError("tangents")
        return self._tangent_data

    @property
    def rotation(self) -> Rotation:
        """The attitudes as a single scipy.spatial.transform.Rotation.

        Raises ImportError if SciPy is not installed.
        """
        return make_rotations(self.q_xyzw)

    def specific_force(self, point: ArrayLike) -> Array:
        """Return the readings of an accelerometer at a given point of the body [L T^-2].

        They are the acceleration of the point, including that by a turning or shaken support, minus
        the gravitational acceleration, in the body frame.

            >>> import kreisel as kr
            >>> top = kr.scenes.asymmetric.replace(attitude=(1, 0, 0, 0), gravity=9.81)
            >>> kr.solve(top, [0.0]).specific_force((0, 0, 0)).round(9).tolist()
            [[0.0, 0.0, 9.81]]

        point  its place from the fixed point, in the frame of the body [L]
        """
        place = np.array(arguments.as_three_floats("point", point))
        scene, rate, change = self.scene, self.inertial_velocity, self.body_acceleration
        if np.any(scene.turning):
            change = change + np.cross(rate - self.body_velocity, self.body_velocity)
        weight = np.asarray(scene.gravity)[..., None]
        amplitude, pace, phase = np.moveaxis(np.asarray(scene.shaking)[..., None, :], -1, 0)
        if amplitude.any():
            weight = weight - amplitude * pace**2 * np.cos(pace * self.t + phase)
        gradient = np.asarray(scene.gradient)[..., None]
        vertical = self.body_vertical
        return freeze_array(specific_force(change, rate, vertical, weight, place, gradient))

    def position(self, point: ArrayLike, *, tangents: bool = False) -> Array:
        """Return the positions (n, 3) of a point of the body in space [L].

        They are relative to the fixed point, along e1, e2, e3.

            >>> import kreisel as kr
            >>> path = kr.solve(kr.scenes.asymmetric, [0.0, 1.0], tangents=["gravity"])
            >>> path.position((0, 0, 1)).shape, path.position((0, 0, 1), tangents=True).shape
            ((2, 3), (2, 3, 1))

        point     its place from the fixed point, in the frame of the body [L]
        tangents  True to return the derivatives (n, 3, c) of the positions, whose last dimension
                  has the columns of `path.tangents`
        """
        return self._compute_point_motion(point, tangents)[0]

    def point_velocity(self, point: ArrayLike, *, tangents: bool = False) -> Array:
        """Return the velocities of a point of the body relative to the support [L T^-1].

        The arguments are those of `position`.
        """
        return self._compute_point_motion(point, tangents, 1)[1]

    def point_acceleration(self, point: ArrayLike, *, tangents: bool = False) -> Array:
        """Return the accelerations of a point of the body relative to the support [L T^-2].

        The arguments are those of `position`. If the support neither turns nor shakes, the mass
        times the acceleration of the centre of mass is the sum of weight and `pivot_force`.
        """
        return self._compute_point_motion(point, tangents, 2)[2]

    def _compute_point_motion(
        self, point: ArrayLike, tangents: bool, order: int = 0
    ) -> list[Array]:
        """Return the position and its time derivatives up to an order, or their tangents.

        With the rotation R and the angular velocity w, position, velocity and acceleration are
        r = R point, v = w x r and R body_acceleration x r + w x v. Arrays (n, 3, 1 + c) contain a
        vector and its tangents.
        """
        place = np.array(arguments.as_three_floats("point", point))
        is_tangent = arguments.as_bool("tangents", tangents)
        turns = self.derivative("q") if is_tangent else np.empty((*self.q.shape[:-1], 3, 0))
        q = tuple(np.moveaxis(self.q, -1, 0)[..., None])

        def with_tangents(name: QuantityName) -> Array:
            value = getattr(self, name)[..., None]
            return np.concatenate((value, self.derivative(name)), -1) if is_tangent else value

        def turn_to_space(v: Array) -> Array:
            v = np.concatenate((v[..., :1], v[..., 1:] + cross(turns, v)), axis=-1)
            return np.stack(quaternion.turn(q, tuple(np.moveaxis(v, -2, 0))), axis=-2)

        def cross(a: Array, b: Array) -> Array:
            return np.cross(a, b[..., :1], axis=-2)

        def multiply(a: Array, b: Array) -> Array:
            product = cross(a, b)
            product[..., 1:] -= cross(b[..., 1:], a)
            return product

        zeros = np.zeros((*turns.shape[:-1], 1 + turns.shape[-1]))
        zeros[..., 0] = place
        motion = [turn_to_space(zeros)]
        if order > 0:
            rate = with_tangents("velocity")
            motion.append(multiply(rate, motion[0]))
        if order > 1:
            gain = turn_to_space(with_tangents("body_acceleration"))
            motion.append(multiply(gain, motion[0]) + multiply(rate, motion[1]))
        return [freeze_array(x[..., 1:] if is_tangent else x[..., 0]) for x in motion]

    def modified_energy(self, step: float) -> Array:
        """Return the energies (n,) that bobenko_suris conserves with step `step` [M L^2 T^-2].

        They are E + step <torque, m> / (2 I1) for the energy E and the transverse moment I1, and
        NaN unless the body is a Lagrange top. Like `path.step`, `step` is negative back in time.
        """
        if self._is_many:
            return self._compute_per_state(lambda path: path.modified_energy(step))
        return modified_energy(self.scene._block, self.states, as_float("step", step))

    def modified_energy4(self, step: float) -> Array:
        """Return the energies (n,) that bobenko_suris4 conserves with step `step` [M L^2 T^-2].

        They differ from the energy by a constant and by terms of order step^4, and are NaN if the
        body is not a Lagrange top, or if the step is too large.
        """
        if self._is_many:
            return self._compute_per_state(lambda path: path.modified_energy4(step))
        return modified_energy4(self.scene._block, self.states, as_float("step", step))

    @cached_property
    def energy_error(self) -> float:
        """The largest relative error of the energy, max |E - E0| / max (T + mass |gravity| |com|).

        E0 is the initial energy, T the kinetic energy, and the maxima are over all states. The
        error is 0 if there are no states, and NaN for scenes with damping, friction or a shaken
        support, which do not conserve the energy.
        """
        if self._is_many:
            return cast(float, self._compute_per_top(lambda path: path.energy_error))
        if self.scene._is_losing_energy or self.scene._is_shaken:
            return np.nan
        if not len(self):
            return 0.0
        scene, names = self.scene, ("kinetic", "potential")
        kinetic, potential = (values(n, scene._block, scene._start_state).item() for n in names)
        lever = float(np.linalg.norm(scene.body.com))
        size = max(kinetic, self.kinetic.max()) + scene.body.mass * abs(scene.gravity) * lever
        change = np.abs(self.energy - (kinetic + potential)).max()
        return float(change / size) if change else 0.0


def add_quantity_properties(
    kind: type[_Recorded], lead: tuple[str, ...], column: Callable[[_Recorded, str], Array]
) -> None:
    """Add a property for each quantity, computed by `column`, after the dimensions `lead`."""
    for name in [name for name in QUANTITIES if name not in vars(kind)]:
        quantity = QUANTITIES[name]

        def of(path: _Recorded, name: str = name) -> Array:
            return column(path, name)

        sizes = [*lead, *map(str, quantity.shape)]
        shape = ", ".join(sizes) + ("," if len(sizes) == 1 else "")
        unit = f" [{quantity.dimension}]" if quantity.dimension else ""
        of.__doc__ = f"({shape}) {quantity.text}{unit}."
        attribute = cached_property(of)
        attribute.__set_name__(kind, name)
        setattr(kind, name, attribute)


def _compute_path_quantity(path: PathBase, name: str) -> Array:
    if not path._is_many:
        return freeze_array(values(name, path.scene._block, path.states))
    if path.want is not None:
        return path.states  # raises AttributeError
    return path._reshape_to_ensemble(calls.compute_quantity_values(name, path.scene, path._buffers))


add_quantity_properties(PathBase, ("n",), _compute_path_quantity)
