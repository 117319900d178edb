from collections.abc import Callable, Sequence
from typing import Any, TypedDict

import numpy as np
import numpy.typing as npt

from ._utils.quantity_attributes import MethodName, QuantityName

_Array = npt.NDArray[np.float64]
_Doubles = _Array | Sequence[float]
_Vector = tuple[float, float, float]
_Quaternion = tuple[float, float, float, float]
_Stats = tuple[int, int, int, int]
_Integers = npt.NDArray[np.intc]
_Terms = list[tuple[float, int, int]]
_Met = tuple[_Array, _Array, _Integers, _Integers]
_Event = tuple[_Terms, _Terms, bool, int, int, bool]

class _Method(TypedDict):
    name: MethodName
    text: str
    order: int
    conserves: str
    reference: str
    flags: int

class _Quantity(TypedDict):
    name: QuantityName
    doubles: int
    turns: bool
    kept: bool
    in_events: bool
    dimension: str
    text: str
    components: list[str]

version: str
statuses: dict[str, tuple[str, str]]
methods: list[_Method]
quantities: list[_Quantity]
components: dict[str, int]
kinds: list[str]
flags: dict[str, int]
tangents: dict[str, tuple[int, int]]  # the bit of each, and its columns
reductions: list[str]
courses: list[str]
INPUT_RTOL: float
KIND_RTOL: float
TENSOR_LEAST: float

def method_applies(method: str, body: bytes) -> bool: ...
def method_suits(method: str, scene: bytes) -> bool: ...

class ExactPlan: ...

def plan_exact(scene: bytes, bound: float) -> tuple[str, str, bool, ExactPlan | None]: ...
def exact_numbers_of(plan: ExactPlan) -> _Array: ...
def exact_states(plan: ExactPlan, t: object, most: float) -> _Array | None: ...
def exact_states_at(plan: ExactPlan, turns: _Array) -> _Array: ...
def exact_numbers(tops: Tops, begin: int, end: int, out: _Array, work: Work) -> tuple[str, int]: ...
def exact_states_of_tops(
    tops: Tops, begin: int, end: int, out: _Array, t: _Array, work: Work
) -> tuple[str, int]: ...
def exact_turning(scene: bytes) -> tuple[str, _Array, str]: ...
def exact_turnings(
    tops: Tops, begin: int, end: int, rows: _Array, courses: npt.NDArray[np.int8], work: Work
) -> tuple[str, int]: ...
def turning_potential(row: _Array, nutation: _Array) -> _Array: ...
def body(
    mass: object, inertia: object, com: object, inertia_rtol: object, rotor: object, at_com: bool
) -> tuple[object, ...] | None: ...
def shapes(kind: int, shape: tuple[int, ...], columns: list[_Array], are_dense: bool) -> _Array: ...
def body_symmetry(body: bytes) -> tuple[float, float] | None: ...
def body_kind(body: bytes, rtol: float) -> str: ...
def scene_kind(scene: bytes) -> str: ...
def scene_horizon(scene: bytes) -> float: ...

_SceneNumbers = tuple[_Vector, _Quaternion, float, _Vector, _Vector, _Vector, float, bytes]
_Environment = tuple[object, object, object, object, object, object]

def scene(
    body: bytes,
    starts: tuple[object, object, object, object],
    attitude: object,
    around: _Environment,
) -> _SceneNumbers | None: ...
def euler(
    body: bytes, angles: object, rates: object, in_degrees: bool, around: _Environment
) -> _SceneNumbers | None: ...
def spinning(
    body: bytes,
    spin: object,
    tilt: object,
    precession: object,
    is_steady: bool,
    is_fast: bool,
    in_degrees: bool,
    around: _Environment,
) -> _SceneNumbers | None: ...

class Tops:
    def __init__(self, shape: Sequence[int], columns: list[_Array]) -> None: ...
    def __len__(self) -> int: ...
    def check(self) -> tuple[str, int]: ...
    def block(self, index: int) -> bytes: ...
    def values(self, name: str) -> _Array: ...
    def momenta(self, kind: int, vectors: _Array) -> _Array: ...
    def euler(self, angles: _Array, rates: _Array) -> _Array: ...
    def steady(self, spins: _Array, tilts: _Array, is_fast: bool) -> _Array: ...
    def symmetric(self) -> _Array: ...

def bodies(
    shape: Sequence[int], columns: list[_Array], are_matrices: bool
) -> tuple[str, int, npt.NDArray[np.bool_], _Array]: ...
def cosine(x: _Array) -> _Array: ...
def sine(x: _Array) -> _Array: ...
def logarithm(x: _Array) -> _Array: ...

class Work:
    def __init__(self) -> None: ...
    def listen(self, tops: int, progress: Callable[[float], object] | None) -> None: ...
    def end(self) -> None: ...
    def share(self, threads: int) -> None: ...
    def stop(self) -> None: ...
    def did(self, tops: int) -> None: ...
    @property
    def stopped(self) -> bool: ...
    @property
    def done(self) -> int: ...

class Worker:
    @property
    def kernel(self) -> tuple[str, int]: ...
    def __init__(
        self,
        method: str | None,
        step: float,
        tol: float,
        digits: int,
        max_steps: int,
        leave_heading: bool,
        reductions: Sequence[tuple[str, int, int]],
        work: Work | None = ...,
    ) -> None: ...
    def run(
        self,
        tops: Tops,
        begin: int,
        end: int,
        t: _Array,
        status: npt.NDArray[np.int8],
        done: npt.NDArray[np.int64],
        counts: npt.NDArray[np.int64],
        reached: _Array,
        states: _Array | None = ...,
        reduced: _Array | None = ...,
        columns: dict[str, _Array] = ...,
    ) -> tuple[npt.NDArray[np.int64], _Array]: ...
    def section(
        self,
        tops: Tops,
        begin: int,
        end: int,
        event: list[_Event],
        n: int,
        wait: _Array,
        status: npt.NDArray[np.int8],
        done: npt.NDArray[np.int64],
        counts: npt.NDArray[np.int64],
        reached: _Array,
        states: _Array,
    ) -> tuple[npt.NDArray[np.int64], _Array]: ...

def alone(
    method: str,
    step: float,
    tol: float,
    digits: int,
    max_steps: int,
    leave_heading: bool,
    events: list[_Event],
    work: Work | None,
    tops: Tops,
    begin: int,
    end: int,
    t: _Array,
    status: npt.NDArray[np.int8],
    done: npt.NDArray[np.int64],
    counts: npt.NDArray[np.int64],
    reached: _Array,
    states: _Array | None,
    low: _Array | None,
    columns: dict[str, _Array],
    by: int = ...,
    tangents: _Array | None = ...,
    tangents_low: _Array | None = ...,
    truncation: _Array | None = ...,
) -> tuple[_Array, _Array, npt.NDArray[np.int64], npt.NDArray[np.int64], _Met]: ...
def growth(
    tops: Tops,
    begin: int,
    end: int,
    t: _Array,
    tol: float,
    max_steps: int,
    direction: Sequence[float],
    status: npt.NDArray[np.int8],
    out: _Array,
    work: Work | None = ...,
) -> None: ...
def values_of_tops(
    name: str, tops: Tops, states: _Array, done: npt.NDArray[np.int64], out: _Array
) -> None: ...
def derivatives_of_tops(
    name: str,
    tops: Tops,
    states: _Array,
    done: npt.NDArray[np.int64],
    by: int,
    tangents: _Array,
    out: _Array,
) -> None: ...
def horizons(tops: Tops, out: _Array) -> None: ...
def unsuited(tops: Tops, method: str) -> tuple[int, int]: ...

_Recorded = tuple[str, _Array, _Array | None, _Stats, float]
_Progress = Callable[[float], object] | None

class Run:
    def record(self, t: _Array, low: bool, progress: _Progress = ...) -> _Recorded: ...
    def record_tangents(
        self, t: _Array, low: bool, progress: _Progress | Work = ...
    ) -> tuple[_Recorded, _Array, _Array, float]: ...
    def record_events(self, t: _Array, progress: _Progress = ...) -> tuple[_Recorded, _Met]: ...
    def state(self) -> tuple[_Array, _Array]: ...
    def save(self) -> bytes: ...
    def load(self, memory: bytes, found: list[int]) -> str: ...
    def advance(self, owner: object, t: object, progress: _Progress, /) -> Any: ...
    def reset(self, owner: object, momentum: object, attitude: object, /) -> bool: ...
    @property
    def found(self) -> list[int]: ...
    @property
    def ended(self) -> bool: ...
    @property
    def kernel(self) -> tuple[str, int]: ...
    @property
    def t(self) -> float: ...

class Request:
    def __init__(
        self,
        classes: tuple[type, type, type],
        options: object,
        stored: object,
        core: tuple[str, float, float, int, int, bool],
        want: tuple[str, ...] | None,
        most: float,
        limit: int,
        closed: Request | None = ...,
        decide: Callable[..., float] | None = ...,
    ) -> None: ...
    def start(
        self, scene: bytes, back: bool, begin: float, low: _Array | None
    ) -> tuple[str, Run | None]: ...
    def solve(self, scene: object, t: object, progress: _Progress, /) -> Any: ...

def start(
    scene: bytes,
    method: str,
    step: float,
    tol: float,
    digits: int,
    max_steps: int,
    leave_heading: bool = ...,
    back: bool = ...,
    events: list[_Event] = ...,
    tangents: int = ...,
    begin: float = ...,
    low: _Array | None = ...,
) -> tuple[str, Run | None]: ...
def plain_times(t: object) -> _Array | None: ...
def record(
    scene: bytes,
    method: str,
    step: float,
    tol: float,
    digits: int,
    max_steps: int,
    leave_heading: bool,
    t: _Array,
    progress: _Progress | Work = ...,
    begin: float = ...,
    low: _Array | None = ...,
) -> _Recorded: ...
def terms_value(scene: bytes, states: _Array, terms: _Terms) -> _Array: ...
def values(name: str, scene: bytes, states: _Array) -> _Array: ...
def derivatives(name: str, scene: bytes, states: _Array, by: int, tangents: _Array) -> _Array: ...
def modified_energy(scene: bytes, states: _Array, step: float) -> _Array: ...
def modified_energy4(scene: bytes, states: _Array, step: float) -> _Array: ...
def attitude_error(a: _Array, b: _Array) -> _Array: ...
