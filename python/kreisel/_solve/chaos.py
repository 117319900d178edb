"""Chaos: the largest Lyapunov exponent, MEGNO and OLI of motions, from one integration."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING, Any, Literal, NoReturn

import numpy as np
import numpy.typing as npt

from .. import quaternion
from .._core import Work, growth, statuses
from .._model.parameters import refuse_disturbances
from .._model.scene import Scene
from .._options import options as checks
from .._options.methods import FALLBACK
from .._options.options import TIME, Options, get_member_by_flat_index
from .._results.calls import (
    INTERRUPTED,
    STATUSES,
    EnsembleBuffers,
    Slice,
    SliceRunner,
    run_ensemble,
)
from .._results.path import Path, build_path_from_core_result
from .._results.results import Error, RunResult
from .._results.tables import ColumnTable, TableColumn, list_parameter_columns
from .._utils import arguments
from .._utils.arguments import Array, Numbers, as_finite_array, short_repr
from .._utils.html import format_picture_as_html
from .._utils.processes import Progress, WorkerPool
from .._utils.quantity_attributes import QuantityName
from .solve import solve

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from pandas import DataFrame
    from xarray import Dataset


IndicatorName = Literal["lyapunov", "megno", "oli"]
INDICATORS: dict[str, tuple[str, str]] = {  # the unit and the text of each indicator
    "lyapunov": ("T^-1", "largest Lyapunov exponent"),
    "megno": ("", "mean exponential growth of nearby orbits"),
    "oli": ("", "orthogonal Lyapunov indicator"),
}
_TEXTS = {
    "is_chaotic": "True if MEGNO at the last time exceeds the threshold",
    "doubt": "the reason why the classification is in doubt, or empty",
    "certificate": "estimate of the largest relative error of the tangent",
    "turns": "the last time in slow turns of the top",
    "status": "OK, or the name of the failure",
}
THRESHOLD = 4.0  # MEGNO above which a motion is called chaotic: twice the limit of regular motion
_NEAR = 2.5, 8.0  # values of MEGNO between which a classification is in doubt
_FEWEST_TURNS = 100.0  # number of turns below which chaos may not yet show
_WORST = 0.01  # certificate above which a classification is in doubt
_POINTS = 32  # default number of times of a curve; the times are evenly spaced on a log scale
_DECADES = 3.0  # log10 of the ratio of the last of these times to the first
# For a tangent that path.tangents gives: the turns after which it is scaled, the nodes per turn of
# the integrals over time, and its start in scaled units, which lies in no direction of symmetry.
_TURNS, _NODES = 8, 24
_DIRECTION = 0.37, -0.53, 0.29, 0.47, 0.31, -0.41


def estimate_turn_durations(tops: Scene) -> Array:
    """Estimate the time [T] that each top takes to turn once.

    It is 2 pi / w with the larger w of the angular velocity (|m| + |h|) / I and the pendulum
    frequency sqrt(mass |gravity| |com| / I + |gradient|), where I is the largest moment and h the
    rotor. For a shaken support, its largest acceleration is added to |gravity|. For a torque-free
    top at rest, which never turns, the returned time is 1.
    """
    body = tops.body
    largest = np.max(body.moments, axis=-1)
    # Unlike the root of a sum of squares, hypot does not overflow for momenta above 1e154.
    momentum = np.hypot.reduce(tops.momentum, axis=-1) + np.hypot.reduce(body.rotor, axis=-1)
    rate = momentum / largest
    amplitude, shaking, _ = np.moveaxis(np.asarray(tops.shaking), -1, 0)
    largest_pull = np.abs(tops.gravity) + np.abs(amplitude) * shaking**2
    torque = body.mass * largest_pull * np.linalg.norm(body.com, axis=-1)
    swing = np.sqrt(torque / largest + np.abs(tops.gradient))
    rate = np.broadcast_to(np.maximum(rate, swing), tops.shape).reshape(-1)
    turns: Array = np.divide(2.0 * np.pi, rate, out=np.ones(tops.size), where=rate > 0.0)
    return turns


def _column(name: str, text: str, is_curve: bool = False) -> Any:
    """Return a property for the values of an indicator at all times, or at the last time."""

    def read(result: Chaos) -> Any:
        values = result._reshape_to_ensemble(result._buffers.columns[name])
        return values if is_curve else result._unwrap(values[..., -1])

    return property(read, doc=text)


class Chaos(RunResult):
    """The indicators of chaos of one or many motions, the result of kreisel.chaos.

    Arrays are read-only. For a single scene, `shape` is the empty tuple, and values are Python
    numbers.

    scene           the ensemble
    lyapunov_curve  (*shape, k) ln(|tangent(t)| / |tangent(0)|) / t [T^-1], at each time in `t`.
                    For a regular motion, it tends to zero as ln(t) / t
    megno_curve     (*shape, k) the mean exponential growth of nearby orbits, averaged over time.
                    For a regular motion, it tends to 2 if neighbouring motions separate linearly in
                    time, and to 0 if they do not separate. For a chaotic motion, it is about half
                    the Lyapunov exponent times t
    oli_curve       (*shape, k) the orthogonal Lyapunov indicator: the largest logarithm so far of
                    the norm of the tangent, which grows as ln(t) for a regular motion, and as t for
                    a chaotic motion. The norm is evaluated at a few times in each integration step
                    and at the requested times. The value is therefore slightly too small, and
                    depends slightly on the requested times
    status          (*shape) as in kreisel.Path; the curves of a failed top are NaN

    A notebook displays the result as a picture, which the method `plot` draws.
    """

    lyapunov: Array | float = _column("lyapunov", "(*shape) the exponent at the last time [T^-1].")
    lyapunov_curve: Array = _column("lyapunov", "(*shape, k) the exponent at each time.", True)
    megno: Array | float = _column("megno", "(*shape) MEGNO at the last time.")
    megno_curve: Array = _column("megno", "(*shape, k) MEGNO at each time.", True)
    oli: Array | float = _column("oli", "(*shape) OLI at the last time.")
    oli_curve: Array = _column("oli", "(*shape, k) OLI at each time.", True)
    certificate: Array | float = _column(
        "certificate",
        """(*shape) an estimate of the largest relative error of the tangent.

        It is the largest of the last term of the tangent's Taylor series, and of the changes of the
        derivatives of the energy and of <m, e3> along the tangent, which should be constant.
        """,
    )

    @property
    def turns(self) -> Array | float:
        """(*shape) the number of slow turns up to the last time, t * rate / (2 pi).

        `rate` is the larger of (|m| + |h|) / I and sqrt(mass |gravity| |com| / I + |gradient|), I
        the largest moment and h the rotor.
        """
        turns = abs(self.t[-1]) / estimate_turn_durations(self.scene)
        return self._unwrap(turns.reshape(self.shape))

    @property
    def threshold(self) -> float:
        """The threshold of `megno`, namely 4, above which a motion is classified as chaotic.

        Source: Cincotta and Simo, Astronomy and Astrophysics Supplement Series 147 (2000).
        """
        return THRESHOLD

    @property
    def is_chaotic(self) -> npt.NDArray[np.bool_] | bool:
        """(*shape) True for chaotic motion; a bool for one scene.

        It is chaotic if `megno` exceeds `threshold`, and regular, with a Lyapunov exponent below
        about 2 * threshold / t, otherwise. A motion that starts exactly on an unstable steady or
        periodic orbit is chaotic. The value is False for a top whose run failed. See also `doubt`.
        """
        return self._unwrap(np.asarray(self.megno) > THRESHOLD)

    @property
    def doubt(self) -> npt.NDArray[np.str_] | str:
        """(*shape) the reason why `is_chaotic` is in doubt, or ''; a str for one scene.

        The reasons are the status of a failed top, a certificate above 0.01, a value of `megno`
        between 2.5 and 8, which is near the threshold, and fewer than 100 turns, unless the motion
        is chaotic.

        In a study of 1600 random tops, of which 536 were chaotic, no regular top was classified as
        chaotic with an empty `doubt`. Of the tops classified as regular with an empty `doubt`, 2 %
        were in fact chaotic for runs of 100 turns, 0.7 % for 300 turns, and 0 % for 1000 turns.
        """
        megno, (low, high) = np.asarray(self.megno), _NEAR
        names = np.array(STATUSES)[self._buffers.status].reshape(self.shape)
        texts = np.where(names == "OK", "", names).astype(object)
        for text, mask in {
            f"certificate above {_WORST:g}": ~(np.asarray(self.certificate) <= _WORST),
            "MEGNO near the threshold": (low < megno) & (megno < high),
            f"under {_FEWEST_TURNS:g} turns": (np.asarray(self.turns) < _FEWEST_TURNS)
            & ~(megno > THRESHOLD),
        }.items():
            texts[mask & (texts == "")] = text
        return self._unwrap(texts.astype(np.str_))

    @property
    def is_doubtful(self) -> npt.NDArray[np.bool_] | bool:
        """(*shape) True where `doubt` has a reason; a bool for one scene."""
        return self._unwrap(np.asarray(self.doubt) != "")

    def __repr__(self) -> str:
        end = f"t = {self.t[-1]:g}" if self.t.size else "no times"
        if not self.shape:
            verdict = "chaotic" if self.is_chaotic else "regular"
            verdict += f", in doubt: {self.doubt}" if self.doubt else ""
            values = f"exponent {self.lyapunov:.6g}, MEGNO {self.megno:.6g}, OLI {self.oli:.6g}"
            return f"<kreisel.Chaos: {values} at {end}; {verdict}>"
        counts = f"{np.sum(self.is_chaotic)} chaotic, {np.sum(self.is_doubtful)} in doubt"
        shape = "x".join(map(str, self.shape))
        return f"<kreisel.Chaos: {shape} tops at {end}; {counts}, {len(self.failed)} failed>"

    def _make_top_error(self, i: int) -> BaseException:
        scene, name = get_member_by_flat_index(self.scene, i), STATUSES[self._buffers.status[i]]
        kind, text = statuses[name]
        if kind == "INPUT":
            return arguments.make_exception_from_status(
                name, f"no tangent of {scene!r} in this direction"
            )
        return Error(f"{text}: the tangent of {scene!r}", name, self._select_member(i), self)

    def _select_member(self, i: int) -> Path:
        """Return a path without states, for exceptions."""
        result = "OK", np.empty((0, 8)), None, (0, 0, 0, 0), float(self._t[-1])
        scene = get_member_by_flat_index(self.scene, i)
        return build_path_from_core_result(scene, self._options, result)

    def plot(
        self,
        axes: Axes | None = None,
        *,
        indicator: IndicatorName = "megno",
        time_unit: str = "T",
    ) -> Axes:
        """Plot an indicator with matplotlib, and return the axes.

        axes       the axes to draw in; default: a new figure
        indicator  "lyapunov", "megno" or "oli"
        time_unit  the unit of time in which the scenes are described, for the labels

        For one top, or tops of one dimension, the indicator of each is plotted against time, in
        colours of regular, chaotic and doubtful motions. For MEGNO, a dashed line marks the
        threshold. For two dimensions, the final values are drawn as a map, in which dots mark
        doubtful tops. The curves omit nonpositive values, and values of MEGNO and OLI up to 0.1.
        Maps show values of MEGNO and OLI below 1 as 1.

            >>> import kreisel as kr
            >>> kr.chaos(kr.scenes.asymmetric, 1000).plot(time_unit="s").get_xlabel()
            'time [s]'

        Raises ValueError for an unknown indicator and for ensembles with more than two dimensions,
        and ImportError if matplotlib is not installed.
        """
        unit = arguments.as_unit_name("time_unit", time_unit)
        if not isinstance(indicator, str) or indicator not in INDICATORS:
            raise ValueError(
                arguments.unknown_name_message("indicator", str(indicator), INDICATORS)
            )
        if self.ndim > 2:
            raise ValueError(
                f"indicators of {self.ndim} dimensions cannot be drawn: select two of "
                "the ensemble's dimensions, as in found[:, :, 0]"
            )
        from .._plot.charts import draw_chaos_indicator_map, draw_indicator_curves

        draw = draw_chaos_indicator_map if self.ndim == 2 else draw_indicator_curves
        return draw(self, indicator, axes, unit)

    def _repr_html_(self) -> str | None:
        """Return the indicators as a picture, or None if they cannot be drawn."""
        if self.ndim > 2 or not self.size:
            return None
        return format_picture_as_html(self.plot, repr(self))

    def to_pandas(self) -> DataFrame:
        """Return a pandas.DataFrame with one row per top, in C order.

        The columns are the varying parameters, `lyapunov`, `megno`, `oli`, `is_chaotic`, `doubt`,
        `certificate`, `turns` and `status`. `attrs` has the units.

            >>> import kreisel as kr
            >>> tops = kr.scenes.asymmetric.vary(gravity=[0.5, 1.0])
            >>> list(kr.chaos(tops, 1000).to_pandas())[:5]
            ['gravity', 'lyapunov', 'megno', 'oli', 'is_chaotic']
        """
        return self._tabulate(has_curves=False).to_pandas()

    def to_xarray(self) -> Dataset:
        """Return an xarray.Dataset of the indicators over time and the classification of each top.

        The dimensions are those of the ensemble; the indicators have the further dimension time.
        The varying parameters are coordinates.

            >>> import kreisel as kr
            >>> tops = kr.scenes.asymmetric.vary(gravity=[0.5, 1.0])
            >>> kr.chaos(tops, 1000).to_xarray()["megno"].dims
            ('gravity', 'time')
        """
        return self._tabulate(has_curves=True).to_xarray()

    def _tabulate(self, has_curves: bool) -> ColumnTable:
        axes, columns = self.scene.axes, list_parameter_columns(self.scene)
        sizes, end, attributes = dict(zip(axes, self.shape, strict=True)), "", {"t": self.t[-1]}
        if has_curves:
            sizes["time"], end, attributes = self.t.size, "_curve", {}
            t = TableColumn("t", ("time",), self.t, TIME.dimension, TIME.text, is_coordinate=True)
            columns.append(t)
        for name, (unit, text) in INDICATORS.items():
            values = np.asarray(getattr(self, name + end))
            columns.append(TableColumn(name, tuple(sizes), values, unit, text))
        for name, text in _TEXTS.items():
            columns.append(TableColumn(name, axes, np.asarray(getattr(self, name)), "", text))
        return ColumnTable(sizes, columns, {"threshold": self.threshold, **attributes})


def _refuse_costs(_: Chaos) -> NoReturn:
    raise AttributeError("the steps of tangents are not counted")


for _name in ("reached", "state_counts", "stats"):
    setattr(Chaos, _name, property(_refuse_costs))


def _follow_tangents_of_slice(part: Slice, direction: Sequence[float]) -> None:
    rows, options, tops, begin, end, t, work = part
    numbers, accuracy = np.empty((end - begin, t.size, 6)), (options.tol or 0.0, options.max_steps)
    growth(tops._core_scenes, begin, end, t, *accuracy, direction, rows.status, numbers, work)
    others = np.flatnonzero(np.isin(rows.status, _NOT_IN_LANES))
    rows.status[others] = INTERRUPTED
    for i in others.tolist():
        scene = get_member_by_flat_index(tops, begin + i)
        rows.status[i] = _follow_tangent(scene, t, options, direction, work, numbers[i])
    # The other columns are the relative changes of the derivatives of the energy and of <m, e3>
    # along the tangent, which are constant without rounding and truncation errors, and the largest
    # last term of the tangent's series.
    logarithm, megno, largest, *errors = np.moveaxis(numbers, -1, 0)
    rows.columns["lyapunov"][:] = logarithm / np.abs(t)
    rows.columns["megno"][:] = megno
    # The core evaluates the norm of a tangent at a few times of each step, which differ for a step
    # that ends at a requested time. Its largest logarithm so far can therefore fall slightly.
    rows.columns["oli"][:] = np.maximum.accumulate(largest, axis=-1)
    rows.columns["certificate"][:] = np.max(errors, axis=(0, 2))[:, None]


_INTEGRALS: tuple[QuantityName, ...] = "energy", "vertical_momentum"
_NOT_IN_LANES = [STATUSES.index(f"ERR_{name}") for name in ("TURNING", "SHAKING", "GRADIENT")]


def _follow_tangent(
    scene: Scene,
    t: Array,
    options: Options,
    direction: Sequence[float],
    work: Work | None,
    numbers: Array,
) -> int:
    """Write the `numbers` (k, 6) of a top that the core does not follow; return a status.

    The path is computed in pieces of a few turns, so that its tangents do not overflow. MEGNO is
    averaged as in the core, 2/T int ln|tangent| (1 + ln(t/T)) dt.
    """
    (turn,), moment = estimate_turn_durations(scene), max(scene.body.moments)
    spin, sign, status = 2.0 * np.pi / turn, np.sign(t[-1]), "OK"
    units = np.array([1.0] * 3 + [moment * spin] * 3)
    x, y, z = _DIRECTION[3:]
    start = np.array([*_DIRECTION[:3], *quaternion.turn(scene.attitude, (x, y, z))]) * units
    tangent = np.array(direction) if direction else start
    begin, log, most, steps = 0.0, 0.0, -np.inf, options.max_steps
    integrals, errors, numbers[:] = np.zeros(2), np.zeros(3), np.nan
    while begin != t[-1]:
        grid = abs(begin) + np.arange(_TURNS * _NODES + 1) * (turn / _NODES)
        times = np.union1d(grid[grid < abs(t[-1])], np.abs(t))
        times = times[(abs(begin) <= times) & (times <= grid[-1])]
        words: Any = {"tol": options.tol, "max_steps": steps, "tangents": "start"}
        try:
            path = solve(scene, sign * times - begin, FALLBACK, **words)
        except Error as error:
            status = error.status
            break
        rest = _remove_known_solutions(path, tangent, units)
        size = np.linalg.norm(rest, axis=-1)
        is_known = size[0] <= 1e-10 * np.linalg.norm(tangent / units)
        if is_known or not np.isfinite(size).all():
            status = "ERR_ARGUMENT" if is_known else "ERR_TANGENT"
            break
        if work is not None and work.stopped:
            status = "ERR_INTERRUPTED"
            break
        for k, name in enumerate(_INTEGRALS):
            if _is_conserved(name, scene):
                change = path.derivative(name) @ tangent
                change = np.abs(change - change[0]) / (moment * spin ** (2 - k) * size)
                errors[k] = max(errors[k], change.max())
        errors[2] = max(errors[2], path.tangents_rest)
        logs = (log if begin else -np.log(size[0])) + np.log(size)
        of_time = np.log(np.maximum(times, np.finfo(float).tiny))
        values = np.stack((logs, logs * of_time))
        areas = np.zeros_like(values)
        areas[:, 1:] = np.cumsum(0.5 * np.diff(times) * (values[:, 1:] + values[:, :-1]), axis=1)
        areas += integrals[:, None]
        highest = np.maximum(most, np.maximum.accumulate(logs))
        mean = (
            2.0
            / np.maximum(times, times[1])
            * (  # not used at the time 0
                areas[0] * (1.0 - of_time) + areas[1]
            )
        )
        rows = np.column_stack((logs, mean, highest, np.tile(errors, (times.size, 1))))
        numbers[np.isin(np.abs(t), times)] = rows[np.isin(times, np.abs(t))]
        integrals, most, log = areas[:, -1], highest[-1], logs[-1]
        tangent, begin, scene = rest[-1] / size[-1] * units, sign * times[-1], path.end
        steps = steps and max(1, steps - path.stats.steps)
    if status != "OK":
        numbers[:] = np.nan
    return STATUSES.index(status)


def _is_conserved(name: QuantityName, scene: Scene) -> bool:
    """Return True if an undamped top on this support conserves energy or vertical momentum."""
    return not scene.shaking[0] if name == "energy" else not any(scene.turning[:2])


def _remove_known_solutions(path: Path, tangent: Array, units: Array) -> Array:
    """Return the tangent (n, 6) along a path, in units, without the solutions that are known.

    They are the flow, unless the support is shaken, and the rotation about the vertical, unless the
    support turns about another axis.
    """
    m, known = path.m[0], []
    if _is_conserved("energy", path.scene):
        force = path.torque[0] - np.cross(path.scene.turning, m)
        known.append(np.concatenate((path.body_velocity[0], force)))
    if _is_conserved("vertical_momentum", path.scene):
        known.append(np.concatenate((path.body_vertical[0], np.cross((0.0, 0.0, 1.0), m))))
    starts = np.stack((*known, tangent), axis=-1)
    vectors: Array = np.swapaxes(path.tangents @ starts / units[:, None], 1, 2)
    for i in range(len(known)):
        along, later = vectors[:, i], vectors[:, i + 1 :]
        square = (along * along).sum(axis=-1)[:, None]
        share = np.divide(
            later @ along[:, :, None], square[..., None], out=np.zeros((*later.shape[:2], 1)),
            where=square[..., None] > 0.0,
        )  # fmt: skip
        vectors[:, i + 1 :] = later - share * along[:, None]
    return vectors[:, -1]


def chaos(
    scene: Scene,
    t: Numbers,
    *,
    direction: Sequence[float] | None = None,
    tol: float | None = None,
    max_steps: int = 0,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Chaos:
    """Compute the largest Lyapunov exponent, MEGNO and OLI of each motion in one integration.

    scene      undamped and without friction, of one top or of many. On moving supports and in
               gravity gradients, tops are computed one by one
    t          a number: the curves have 32 times up to t, evenly spaced on a logarithmic scale over
               three decades; or a monotonic list of times on one side of 0 [T]
    direction  the tangent at the start: three components of a rotation vector seen from the body
               [rad], then three components of a change of momentum in space [M L^2 T^-1]; default:
               a direction that is the same for all tops in scaled units. The components of the
               tangent along the flow and along rotations about the vertical do not grow, and are
               removed where they are solutions
    tol        the local error of a step of the path; default: rounding error. 1e-9 distinguishes
               regular from chaotic motion equally well in about half the time; the certificate is
               then also about 1e-9
    max_steps  the maximal number of steps; 0: no limit
    threads    the number of threads; default: the number of processors
    progress   a function called with the finished fraction of the tops, 0 .. 1

    The tangent is integrated together with the path. Its norm is computed in units in which the
    largest moment of inertia and the angular velocity are about 1.

        >>> import kreisel as kr
        >>> found = kr.chaos(kr.scenes.asymmetric, 1000)
        >>> 0.1 < found.lyapunov < 0.2, found.megno > 20, found.oli > 100, found.is_chaotic
        (True, True, True, True)
        >>> found.megno_curve.shape, found.certificate < 1e-12
        ((32,), True)
        >>> round(kr.chaos(kr.scenes.thesis, 10000).megno, 1)
        2.0

    Raises TypeError or ValueError for invalid arguments, before any computation starts. Raises
    kreisel.Error if the computation for one top fails; for many, `status` has the failures. Raises
    kreisel.Interrupted after Ctrl-C, with the results obtained so far as `result`.

    Sources: Benettin, Galgani, Giorgilli and Strelcyn, Meccanica 15 (1980). Cincotta and Simo,
    Astronomy and Astrophysics Supplement Series 147 (2000). Fouchard, Lega, Froeschle and
    Froeschle, Celestial Mechanics and Dynamical Astronomy 83 (2002).
    """
    times, options, vector = validate_chaos_arguments(scene, t, direction, tol, max_steps)
    pool = WorkerPool(checks.validate_thread_count(threads))
    callback = checks.validate_progress_callback(progress)
    if not scene.shape:
        checks.check_resolvable_horizon(scene, float(times[-1]), None)
    buffers = EnsembleBuffers.allocate_buffers(scene.size, 0, options)
    buffers.states = None
    buffers.columns = {name: np.full((scene.size, times.size), np.nan) for name in INDICATORS}
    buffers.columns["certificate"] = np.full((scene.size, 1), np.nan)
    runner = SliceRunner(partial(_follow_tangents_of_slice, direction=vector.tolist()))
    result = run_ensemble(Chaos, scene, times, options, pool, runner, callback, buffers=buffers)
    if not scene.shape and result._buffers.status[0]:
        raise result._make_top_error(0)
    return result


def validate_chaos_arguments(
    tops: Scene, t: Numbers, direction: object, tol: object, max_steps: object
) -> tuple[Array, Options, Array]:
    """Return the times of the curves, the options, and the direction of the tangent or nothing."""
    arguments.validate_type("scene", tops, Scene)
    times = checks.time_array(t, None, None, 16)
    if np.ndim(t) == 0:
        times = arguments.as_float("t", t) * np.logspace(-_DECADES, 0.0, _POINTS)
    if not times.size or not times.all():
        raise ValueError("t must contain only positive or only negative times, and not 0")
    options = checks.make_options(FALLBACK, tol=tol, max_steps=max_steps)
    vector = np.empty(0)
    if direction is not None:
        vector = as_finite_array("direction", direction, "six numbers")
        if vector.shape != (6,) or not vector.any():
            raise ValueError(
                "direction must be six numbers, not all 0: a rotation vector seen from the body, "
                f"and a change of the momentum in space; not {short_repr(direction)}"
            )
    if np.any(tops.damping):
        raise ValueError("a damped top has no indicator of chaos, because its motion decays")
    supported = "a shaken support", "a turning support", "a gravity gradient"
    hint = "path.tangents of kr.solve(..., tangents='start') shows how changes of the start grow"
    refuse_disturbances(tops, "indicators of chaos do not support tops", supported, hint)
    return times, options, vector
