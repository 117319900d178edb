"""Runs: one top that moves on, is saved and continued."""

from __future__ import annotations

import json
import os
import warnings
import zlib
from collections.abc import Callable, Iterable, Iterator
from fractions import Fraction
from pathlib import Path as File
from typing import TYPE_CHECKING, Any, Literal, cast

import numpy as np
from numpy.typing import ArrayLike

from .. import _core as core
from .._model.body import Body
from .._model.parameters import ENVIRONMENT
from .._model.scene import Scene, SceneKwargs, parse_scene_toml, validate_one_top
from .._options import options as checks
from .._options.methods import resolve_method, unknown_method_message
from .._options.options import CHUNK_SIZE, EventSpec, Options
from .._options.plan import Plan, make_solve_plan
from .._results import path as paths
from .._results import requests
from .._results.calls import ORIGIN, RunStart, Stats
from .._results.path import Path
from .._utils import arguments
from .._utils.arguments import Array, Numbers, Vector, short_repr
from .._utils.files import atomic_write
from .._utils.processes import Progress
from .._utils.quantity_attributes import MethodName, QuantityName
from ..events import Event, refuse_kinetic
from ..quaternion import conjugate, multiply

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation

    from .._core import Run as Motion

# Vectors and quaternions of rational numbers, with which a change of a run is rounded only once.
_Rationals = Any


def _add_exactly(*terms: Any) -> _Rationals:
    return tuple(sum(map(Fraction, row), Fraction(0)) for row in zip(*terms, strict=True))


def _round_twice(exact: _Rationals) -> tuple[Vector, Vector]:
    """Return the doubles nearest to three numbers, and the rounded remainders."""
    try:
        x, y, z = map(float, exact)
    except OverflowError:
        raise ValueError("the new momentum exceeds the range of doubles") from None
    u, v, w = map(float, _add_exactly(exact, (-x, -y, -z)))
    return (x, y, z), (u, v, w)


def _turn(q: _Rationals, v: _Rationals) -> _Rationals:
    """Return q v q* / |q|^2."""
    _, *vector = multiply(multiply(q, (0, *v)), conjugate(q))
    return [x / sum(c * c for c in q) for x in vector]


def _keep_velocity(old: Body, new: Body, q: _Rationals, momentum: _Rationals) -> _Rationals:
    """Return the momentum of the body `new` with the attitude and the velocity of `old`."""
    old_axes, new_axes = _add_exactly(old.axes), _add_exactly(new.axes)
    m = _turn(conjugate(old_axes), _turn(conjugate(q), momentum))
    rotor, moments = _add_exactly(old.principal_rotor), _add_exactly(old.moments)
    rate = [(x - h) / moment for x, h, moment in zip(m, rotor, moments, strict=True)]
    rate = _turn(conjugate(new_axes), _turn(old_axes, rate))
    rotor, moments = _add_exactly(new.principal_rotor), _add_exactly(new.moments)
    m = [w * moment + h for w, h, moment in zip(rate, rotor, moments, strict=True)]
    return _turn(q, _turn(new_axes, m))


MAGIC = b"kreisel run\n"  # the first bytes of a checkpoint
_FUSED = {"avx512", "avx2", "neon"}  # kernels that give identical results, with fused multiply-add
_UNDER_WAY = "this run is under way: another thread leads it, or a call that has not yet returned"


@arguments.make_frozen_class_decorator(
    "run.push, run.reset and run.change change a run; "
    "kreisel.start(path.end.replace(momentum=...)) begins another one at the last state of its path"
)
class Run:
    """A motion that can be advanced in several calls, created by kreisel.start or kreisel.resume.

    Times are measured from the start of the run; absolute values must not decrease.

    scene, method, step, tol, digits, want, events  as in kreisel.solve; step is positive
    t      the time of the last state returned; after a failure the time of the last valid state [T]
    stats  the cost of the run so far

    run.push, run.reset and run.change change the motion at the present time t. Each change starts a
    new motion from the present state without resetting the time.

    - run.scene is the present state, and run.start_time its time. The energy and the error of a
      path refer to the scene for which the path was computed.
    - The grid of a fixed step begins at the present time.
    - run.stats, the limit max_steps and the counts of events begin at zero. A run that ended at a
      terminal event can be continued. An event at the present time is not reported again. A jump of
      an event function caused by the change is not an event.
    - The next path of run.to(t) begins with the state after the change.
    - With 20 or 30 digits, the low words of the present state are kept.

    The method of a run cannot be changed. If an argument is invalid, an exception is raised and the
    run is unchanged.
    """

    scene: Scene
    method: MethodName
    step: float | None
    tol: float | None
    digits: int | None
    want: tuple[QuantityName, ...] | None
    events: tuple[Event, ...] | None
    t: float
    stats: Stats
    _options: Options
    _back: bool
    _fresh: bool
    _origin: RunStart
    _top: Motion

    def __init__(
        self, scene: Scene, options: Options, back: bool, origin: RunStart = ORIGIN
    ) -> None:
        fields = self.__dict__  # ordinary assignments to attributes raise an exception
        fields["_options"], fields["_back"], fields["_fresh"] = options, back, True
        fields["scene"], fields["method"], fields["want"] = scene, options.method, options.want
        fields["events"] = options.events
        fields["step"], fields["tol"], fields["digits"] = options.step, options.tol, options.digits
        fields["t"], fields["stats"] = origin.begin, Stats(0, 0, 0, 0)
        fields["_origin"], fields["_top"] = origin, start_motion(scene, options, back, origin)

    def __repr__(self) -> str:
        steps = arguments.format_count(self.stats.steps, "step")
        return f"<kreisel.Run: {self.method} at t = {self.t:g}, {steps}>"

    def to(self, t: Numbers, *, every: int | None = None, progress: Progress | None = None) -> Path:
        """Advance the run to time t, and return the path.

        If `t` is a number, the path contains the current state and the state at `t`. If `every` is
        given, the path contains the states after each multiple of `every` steps. If `t` is a list,
        the path contains exactly the states at these times. Raises the same exceptions as
        kreisel.solve; after an exception, the run is at its last valid state.
        """
        path = self._advance_in_one_call(t) if every is None and progress is None else None
        if path is not None:
            return path
        number = checks.validate_recording_interval(self._options.integrator, every)
        size = self._options.bytes_per_state
        times = checks.time_array(t, self.step, number, size, self.start_time)
        if np.ndim(t) == 0 and not self._fresh:
            is_later = np.abs(times) > abs(self.t)
            times = np.array([self.t, times[-1]]) if number is None else times[is_later]
        if times.size:
            self._check_requested_times(times)
        if self.ended:
            raise ValueError(
                f"this run has ended at t = {self.t!r}, where a terminal event occurred: continue "
                "from the scene path.end"
            )
        return self._advance_to_times(times, checks.validate_progress_callback(progress))

    def _advance_in_one_call(self, t: object, progress: Progress | None = None) -> Path | None:
        """Advance the run in a single call, or return None if `t` must be validated in Python."""
        path = self._top.advance(self, t, progress)
        if not isinstance(path, tuple):
            return cast(Path | None, path)
        full = paths.build_path_from_core_result(self.scene, self._options, path, self._origin)
        part = paths.drop_unrequested_quantities(full, self.want, path[-1])
        self.__dict__["stats"] = part.stats
        raise paths.make_stop_exception(path[0], part, path[-1])

    def _advance_to_times(self, times: Array, progress: Progress | None) -> Path:
        """Advance the run, and return the path at the given times."""
        if self.want is None:
            status, path = self._record_path(times, progress)
        else:
            status, path = requests.record_quantities_in_chunks(
                times, self.want, lambda part: self._record_path(part, progress), lambda: self.ended
            )
        if status != "OK":
            end = float(times[-1]) if times.size else self.t
            raise paths.make_stop_exception(status, path, end)
        return requests.report_final_time(path, progress)

    def stream(
        self,
        t: Numbers | Iterator[float],
        *,
        every: int | None = None,
        chunk: int = CHUNK_SIZE,
        progress: Progress | None = None,
    ) -> Iterator[Path]:
        """Return an iterator over paths, as kreisel.stream does, starting at the current time.

        The run can be saved or changed between two paths of the iterator. After a change, the run
        continues with the remaining times.
        """
        number = checks.validate_recording_interval(self._options.integrator, every)
        last, size = None if self._fresh else self.t, arguments.as_int("chunk", chunk, 1)
        chunks = checks.iterate_time_chunks(t, self.step, number, size, last, self.start_time)
        return self._yield_path_per_chunk(chunks, checks.validate_progress_callback(progress))

    def _yield_path_per_chunk(
        self, chunks: Iterator[Array], progress: Progress | None
    ) -> Iterator[Path]:
        while not self.ended and (chunk := next(chunks, None)) is not None:
            path = self._advance_in_one_call(chunk, progress)
            if path is None:
                self._check_requested_times(chunk)
                path = self._advance_to_times(chunk, progress)
            yield path
        if progress is not None and not self._fresh:
            progress(self.t)

    def _check_requested_times(self, times: Array) -> None:
        """Raise ValueError if the times are too large or not monotonic."""
        checks.check_times_continue_monotonically(times, self.t, self._back)
        checks.check_resolvable_horizon(self.scene, float(times[-1]), self.step)

    def _record_path(self, times: Array, progress: Progress | None) -> tuple[str, Path]:
        core_events, motion = None, self._top
        try:
            if self.events is None:
                low = self._options.has_extended_precision
                result = motion.record(times, low, progress)
            else:
                result, core_events = motion.record_events(times, progress)
        finally:  # the time is updated even if `progress` raises an exception
            if self._top is not motion:  # another thread changed the run at the same moment
                raise RuntimeError(_UNDER_WAY)
            is_fresh = self._fresh and not times.size
            self.__dict__.update(t=motion.t, _fresh=is_fresh)
        path = paths.build_path_from_core_result(self.scene, self._options, result, self._origin)
        if core_events is not None:
            path = paths.add_events_to_path(path, core_events)
        self.__dict__["stats"] = path.stats
        return result[0], path

    def push(self, impulse: ArrayLike) -> None:
        """Add an angular impulse to the angular momentum at the current time.

        impulse  the integral of a torque about the fixed point over a time in which the top does
                 not move, in space [M L^2 T^-1]

        Raises ValueError for a horizontal impulse if no quantity in `want` depends on the heading
        (rotation about the vertical).

        >>> import kreisel as kr
        >>> run = kr.start(kr.scenes.sleeping)
        >>> upright = run.to(3.0)
        >>> run.push((0.1, 0.0, 0.0))
        >>> bool(run.to([3.5]).nutation[0] > 0.0), run.start_time
        (True, 3.0)
        """
        jolt = arguments.as_three_floats("impulse", impulse)
        if jolt[0] or jolt[1]:
            self._options.check_heading_is_computed("a horizontal impulse")
        motion, t, scene, low = self._read_present_state()
        momentum, low[5:] = _round_twice(_add_exactly(scene.momentum, low[5:], jolt))
        self._restart(motion, t, scene.replace(momentum=momentum), low)

    def reset(
        self,
        momentum: ArrayLike | None = None,
        attitude: ArrayLike | Rotation | None = None,
        *,
        velocity: ArrayLike | None = None,
        body_momentum: ArrayLike | None = None,
        body_velocity: ArrayLike | None = None,
        attitude_xyzw: ArrayLike | None = None,
    ) -> None:
        """Set the momentum, the attitude, or both at the current time.

        The arguments are the same as for kreisel.Scene. An attitude alone preserves the angular
        momentum in the space frame.

        Raises TypeError if no argument is given. Raises ValueError if no quantity in `want` depends
        on the heading (rotation about the vertical), but the new state does: unless attitude and
        momentum are both given, or only body_momentum or body_velocity.
        """
        is_common = velocity is None and body_momentum is None and body_velocity is None
        if is_common and attitude_xyzw is None and self._top.reset(self, momentum, attitude):
            return
        in_body = _drop_missing_arguments(body_momentum=body_momentum, body_velocity=body_velocity)
        momenta = in_body | _drop_missing_arguments(momentum=momentum, velocity=velocity)
        attitudes = _drop_missing_arguments(attitude=attitude, attitude_xyzw=attitude_xyzw)
        if not momenta and not attitudes:
            raise TypeError("reset needs a momentum, an attitude, or both")
        if not in_body and not (momenta and attitudes):
            self._options.check_heading_is_computed("a reset of a part of the state")
        motion, t, scene, low = self._read_present_state()
        if attitudes:
            low[1:5] = 0.0
        if momenta:
            low[5:] = 0.0
        self._restart(motion, t, scene._replace_one(**(momenta | attitudes)), low)

    def change(
        self,
        *,
        body: Body | None = None,
        gravity: float | None = None,
        damping: ArrayLike | None = None,
        turning: ArrayLike | None = None,
        shaking: ArrayLike | None = None,
        friction: float | None = None,
        gradient: float | None = None,
        keep: Literal["momentum", "velocity"] = "momentum",
    ) -> None:
        """Change the body or its environment at the current time.

        The arguments are the same as for kreisel.Scene. The new body's frame of description keeps
        the present attitude. The time in the parameter `shaking` is measured from the start of the
        run.

        keep  the vector in space that stays the same if the body changes. "momentum" describes a
              sudden change by internal forces, as when a skater draws in his arms. "velocity"
              describes parts that already turn with the body when they join or leave it

        Raises TypeError if no argument is given. Raises ValueError if the method is unsuitable for
        the new top, or if the support begins to turn but the heading, on which the motion then
        depends, is not computed: add 'q' to `want`.
        """
        around = zip(
            ENVIRONMENT, (gravity, damping, turning, shaking, friction, gradient), strict=True
        )
        given = _drop_missing_arguments(body=body, **dict(around))
        if not given:
            raise TypeError(f"change needs a body, {', '.join(ENVIRONMENT)}")
        if keep not in ("momentum", "velocity"):
            raise ValueError(f"keep must be 'momentum' or 'velocity', not {short_repr(keep)}")
        motion, t, old, low = self._read_present_state()
        scene = old._replace_one(**given)
        if any(scene.turning):
            self._options.check_heading_is_computed("a turning support")
        if keep == "velocity" and body is not None:
            q, m = _add_exactly(old.attitude, low[1:5]), _add_exactly(old.momentum, low[5:])
            momentum, low[5:] = _round_twice(_keep_velocity(old.body, scene.body, q, m))
            scene = scene.replace(momentum=momentum)
        self._restart(motion, t, scene, low)

    def _read_present_state(self) -> tuple[Motion, float, Scene, Array]:
        """Return the motion, the time, the scene and the low words of the present state."""
        motion = self._top
        state, low = motion.state()
        t, *numbers = state.tolist()
        scene = self.scene.replace(attitude=tuple(numbers[:4]), momentum=tuple(numbers[4:]))
        return motion, t, scene, low

    def _restart(self, motion: Motion, t: float, scene: Scene, low: Array) -> None:
        """Start a new motion of `scene`, of which `motion` has the present state at time t."""
        resolve_method(self.method, scene)
        checks.check_resolvable_horizon(scene, t, self.step)
        origin = RunStart(t, low if self._options.has_extended_precision else None)
        changes = {
            "scene": scene,
            "t": t,
            "stats": Stats(0, 0, 0, 0),
            "_fresh": True,
            "_origin": origin,
            "_top": start_motion(scene, self._options, self._back, origin),
        }
        if self._top is not motion or motion.t != t:
            raise RuntimeError(_UNDER_WAY)
        self.__dict__.update(changes)  # a single call, so that Ctrl-C finds all or nothing changed

    @property
    def start_time(self) -> float:
        """The start time of the motion [T]: 0, or the time of the last push, reset or change."""
        return self._origin.begin

    @property
    def ended(self) -> bool:
        """True if a terminal event has ended the run."""
        return self._top.ended

    @property
    def plan(self) -> Plan:
        """The kreisel.Plan of the run."""
        return make_solve_plan(self.scene, self._options)

    @property
    def checkpoint(self) -> bytes:
        """The complete state of the run; a resumed run gives bitwise identical results."""
        head = {
            **self._options.to_json(),
            "scene": self.scene.to_toml(),
            "back": self._back,
            "fresh": self._fresh,
            "start": self._origin.to_json(),
            "t": self.t,
            "stats": self.stats,
            "kernel": self._top.kernel[0],
            "found": self._top.found,
        }
        body = json.dumps(head).encode() + b"\n" + self._top.save()
        return MAGIC + b"%08x\n" % zlib.crc32(body) + body

    def __reduce__(self) -> tuple[Callable[[bytes], Run], tuple[bytes]]:
        """Return the arguments for reconstructing the run from its checkpoint."""
        return resume, (self.checkpoint,)

    def save(self, file: str | os.PathLike[str]) -> None:
        """Write the checkpoint to a file. An existing file is replaced atomically."""
        atomic_write(file, self.checkpoint)


def start_motion(scene: Scene, options: Options, back: bool, origin: RunStart = ORIGIN) -> Motion:
    """Start a motion, with its events or tangents. Raises an exception if the core rejects it."""
    request = requests.build_request_from_solve_options(options)
    if request is not None:
        status, motion = request.start(scene._block, back, *origin)
    else:
        refuse_kinetic(scene, options.events or ())
        tangents = options.tangent_bit_mask if options.tangents else 0
        given = *options.core_arguments, back, options.core_events, tangents, *origin
        status, motion = core.start(scene._block, *given)
    if motion is not None:
        return motion
    state = scene._start_state.copy()
    state[0, 0] = origin.begin
    result = status, state, None, (0, 0, 0, 0), -0.1 if back else 0.0
    path = paths.build_path_from_core_result(scene, options, result, origin)
    raise paths.make_stop_exception(status, path, origin.begin)


def _drop_missing_arguments(**given: object) -> SceneKwargs:
    return cast(SceneKwargs, {name: value for name, value in given.items() if value is not None})


def resume(checkpoint: bytes | str | os.PathLike[str], *, max_steps: int | None = None) -> Run:
    """Return a run, given its checkpoint or the file in which it was saved.

    `max_steps` replaces the step limit stored in the checkpoint. The documentation of kreisel.start
    explains how to store each state exactly once even if the process is killed.

    Raises ValueError if the checkpoint is damaged, or was written by a different version of kreisel
    or on a different type of machine. Raises OSError if the file cannot be read, and TypeError if
    `checkpoint` is neither bytes nor a path. Warns if this processor rounds otherwise.
    """
    data = checkpoint if isinstance(checkpoint, bytes) else File(checkpoint).read_bytes()
    name = "the checkpoint" if isinstance(checkpoint, bytes) else os.fspath(checkpoint)
    magic, body = data[: len(MAGIC) + 9], data[len(MAGIC) + 9 :]
    if magic != MAGIC + b"%08x\n" % zlib.crc32(body):
        raise ValueError(f"{name} is not a saved run, or is damaged")
    line, _, memory = body.partition(b"\n")
    try:
        head = json.loads(line)
        scene, back, is_fresh = parse_scene_toml(head["scene"]), head["back"], head["fresh"]
        arguments.as_bool("back", back)
        options = Options.from_json(head if max_steps is None else head | {"max_steps": max_steps})
        options = options.for_tops(scene)  # a support that turned may have been stopped
        run = Run(scene, options, back, RunStart.from_json(head.get("start")))
        event_counts = [arguments.as_int("a count of events", n, 0) for n in head.get("found", [])]
        status = run._top.load(memory, event_counts)
        if status != "OK":
            raise ValueError(core.statuses[status][1])
        costs = [arguments.as_int("a number of the stats", n, 0) for n in head["stats"]]
        t, kernel, host = run._top.t, head["kernel"], run._top.kernel[0]
        has_types = isinstance(is_fresh, bool) and isinstance(kernel, str)
        if len(costs) != len(Stats._fields) or not has_types or head["t"] != t:
            raise ValueError("its time, stats, kernel and motion are inconsistent")
        run.__dict__.update(t=t, stats=Stats(*costs), _fresh=is_fresh)
    except (AttributeError, KeyError, RecursionError, TypeError, ValueError) as error:
        raise ValueError(f"{name} is not a checkpoint of a run: {error}") from None
    if kernel != host and not {kernel, host} <= _FUSED:
        text = f"{name} was made with the kernel {kernel!r}; {host!r} agrees only up to rounding"
        warnings.warn(text, stacklevel=2)
    return run


def start(
    scene: Scene,
    method: MethodName = "auto",
    *,
    step: float | None = None,
    tol: float | None = None,
    digits: int | None = None,
    max_steps: int = 0,
    want: Iterable[QuantityName] | None = None,
    events: EventSpec | None = None,
    back: bool = False,
) -> Run:
    """Start a run, which computes the motion of a scene in several calls.

    run.to(t) advances the run to t, with the results of kreisel.solve by the same method.
    run.save(file) saves the run, and kreisel.resume continues it later.

        file = pathlib.Path("run.kreisel")
        run = kr.resume(file) if file.exists() else kr.start(scene, "strang", step=0.01)
        for path in run.stream(1e6, every=100):
            keep(path)
            run.save(file)

    The arguments are the same as for kreisel.solve, without the method 'geometric'; if `back` is
    True, the motion is computed backwards in time. Each path contains the events that occurred
    after the end of the previous path. A terminal event ends the run at its time.

    If the process is killed before the run is saved, the resumed run computes the last path again.
    To store each state only once, delete all states later than run.t from the output file before
    resuming. In this example, that file consists of rows of eight doubles:

        file, begun = pathlib.Path("run.kreisel"), os.path.exists("run.kreisel")
        run = kr.resume(file) if begun else kr.start(scene, "strang", step=0.01)
        with open("states", "r+b" if begun else "w+b") as kept:
            t = np.fromfile(kept, dtype=[("t", float), ("q and m", float, 7)])["t"]
            kept.truncate(64 * np.count_nonzero(abs(t) <= abs(run.t)))
            kept.seek(0, os.SEEK_END)
            for path in run.stream(1e6, every=100):
                kept.write(path.states.tobytes())
                kept.flush()
                os.fsync(kept.fileno())
                run.save(file)
    """
    arguments.as_bool("back", back)
    refuse_step_search(method)
    options = checks.make_options(
        method, step=step, tol=tol, digits=digits, max_steps=max_steps, want=want, events=events
    )
    top = validate_one_top("scene", scene)
    return Run(scene, options.for_tops(top), back)


def refuse_step_search(method: object) -> None:
    """Raise ValueError for method='geometric', which needs several runs."""
    if isinstance(method, str) and method == checks.GEOMETRIC:
        raise ValueError(unknown_method_message(method))
