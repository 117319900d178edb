"""Indicators of chaos: Lyapunov exponents, MEGNO and OLI."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
import numpy.typing as npt

from .._core import Work, growth, statuses
from .._model.parameters import refuse_disturbances
from .._model.scene import Ensemble, Scene
from .._options.methods import FALLBACK, methods
from .._options.options import (
    Options,
    validate_progress_callback,
    validate_thread_count,
    validate_tol,
)
from .._options.quantities import TIME
from .._options.times import check_resolvable_horizon, time_array
from .._results.buffers import INTERRUPTED, STATUSES, Codes
from .._results.path import Error, Interrupted, build_path_from_core_result, list_failed
from .._results.tables import ColumnTable, TableColumn, list_parameter_columns
from .._utils.arguments import (
    Array,
    Numbers,
    ReadOnlyArrays,
    as_finite_array,
    as_float,
    as_int,
    as_unit_name,
    freeze_array,
    freeze_arrays,
    make_exception_from_status,
    short_repr,
)
from .._utils.html import format_picture_as_html
from .._utils.processes import Job, Progress, WorkerPool

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from pandas import DataFrame
    from xarray import Dataset


def estimate_turn_durations(tops: Ensemble) -> Array:
    """Estimate the time [T] that each top takes to turn once.

    The time is 2 pi / w, where w is the larger of the angular velocity (|m| + |h|) / I and the
    pendulum frequency sqrt(mass |gravity| |com| / I). Here, I is the largest moment of inertia, and
    h the angular momentum of the rotor. For a shaken support, its largest acceleration is added to
    |gravity|. For a torque-free top at rest, which never turns, the returned time is 1.
    """
    body = tops.body
    largest = np.max(body.moments, axis=-1)
    # Unlike the root of a sum of squares, hypot does not overflow for momenta above 1e154.
    momentum = np.hypot.reduce(tops.momentum, axis=-1) + np.hypot.reduce(body.rotor, axis=-1)
    rate = momentum / largest
    amplitude, shaking = tops.shaking[..., 0], tops.shaking[..., 1]
    largest_pull = np.abs(tops.gravity) + np.abs(amplitude) * shaking**2
    torque = body.mass * largest_pull * np.linalg.norm(body.com, axis=-1)
    rate = np.broadcast_to(np.maximum(rate, np.sqrt(torque / largest)), tops.shape).reshape(-1)
    turns: Array = np.divide(2.0 * np.pi, rate, out=np.ones(tops.size), where=rate > 0.0)
    return turns


_UNITS = {"lyapunov": "T^-1", "megno": "", "oli": ""}
_TEXTS = {
    "final_megno": "MEGNO at the last time",
    "is_chaotic": "True if MEGNO at the last time exceeds the threshold",
    "doubt": "the reason why the classification is in doubt, or empty",
    "certificate": "estimate of the largest relative error of the tangent",
    "turns": "the last time in slow turns of the top",
    "status": "OK, or the name of the failure",
}


def _tabulate_indicator(indicator: Indicator, has_curve: bool) -> ColumnTable:
    """Return a table of the indicator of each top, over time or at the end, and of its class."""
    name, tops = indicator.name, indicator._tops
    axes = () if tops is None else tops.axes
    sizes = dict(zip(axes, indicator.certificate.shape, strict=True))
    columns = [] if tops is None else list_parameter_columns(tops)
    if has_curve:
        t, curve = indicator.t, indicator.curve
        columns += [
            TableColumn("t", ("time",), t, TIME.dimension, TIME.text, is_coordinate=True),
            TableColumn(name, (*axes, "time"), curve, _UNITS[name], name),
        ]
        sizes["time"] = t.size
    else:
        columns.append(TableColumn(name, axes, indicator.curve[..., -1], _UNITS[name], name))
    columns += [
        TableColumn(each, axes, np.asarray(getattr(indicator, each)), "", text)
        for each, text in _TEXTS.items()
    ]
    return ColumnTable(sizes, columns, {"indicator": name, "threshold": indicator.threshold})


_T = TypeVar("_T", bound=np.generic)

THRESHOLD = 4.0  # MEGNO above which a motion is called chaotic: twice the limit of regular motion
NEAR = 2.5, 8.0  # values of MEGNO between which a classification is in doubt
FEWEST_TURNS = 100.0  # number of turns below which chaos may not yet show
WORST = 0.01  # certificate above which a classification is in doubt

# Columns of the core's rows: the logarithm of the tangent's size; the time average of MEGNO; the
# largest logarithm so far; the relative changes of the derivatives of the energy and of <m, e3>
# along the tangent; the largest last term of the tangent's series. Without rounding and truncation
# errors, both derivatives would be constant.
LOG, MEGNO, MOST, ENERGY, MOMENTUM, REST = range(6)


# Functions that compute the curves (n, k) of an indicator from the core's rows (n, k, 6) and the
# times (k,). The core evaluates the norm of a tangent at a few times of each step, which differ for
# a step that ends at a requested time. Its largest logarithm so far can therefore fall slightly.
CURVES: dict[str, Callable[[Array, Array], Array]] = {
    "lyapunov": lambda rows, t: rows[..., LOG] / np.abs(t),
    "megno": lambda rows, _: rows[..., MEGNO],
    "oli": lambda rows, _: np.maximum.accumulate(rows[..., MOST], axis=-1),
}


@dataclass(frozen=True, eq=False)
class Indicator(ReadOnlyArrays):
    """The result of kreisel.lyapunov, kreisel.megno or kreisel.oli.

    Arrays are read-only. For a single scene, `shape` is the empty tuple.

    t            (k,) the times of the curve [T]
    curve        (*shape, k) the indicator of the motion from the start to each time in `t`
    certificate  (*shape,) an estimate of the largest relative error of the tangent, namely the
                 largest of three values. Two values are the changes of the derivatives of the
                 energy and of <m, e3> along the tangent, which should be constant. The third value
                 is the last term of the tangent's Taylor series
    status       (*shape,) "OK", or the name of the failure; a str for one scene. The curve of a
                 failed top is NaN
    name         the name of the indicator: "lyapunov", "megno" or "oli"
    final_megno  (*shape,) MEGNO at the last time, which every indicator computes
    turns        (*shape,) the number of slow turns up to the last time, t * rate / (2 pi), where
                 `rate` is the larger of (|m| + |h|) / I and sqrt(mass |gravity| |com| / I), I the
                 largest moment and h the rotor

    A notebook displays the chaos indicator as a picture, which the method `plot` draws.
    """

    t: Array
    curve: Array
    certificate: Array
    status: npt.NDArray[np.str_] | Any
    name: str
    final_megno: Array
    turns: Array
    _tops: Ensemble | None  # None for a single scene

    def __post_init__(self) -> None:
        freeze_arrays(vars(self))

    @property
    def value(self) -> Array | float:
        """The final value of the indicator, a float for a scene or an array for an ensemble."""
        last = self.curve[..., -1]
        return float(last) if last.ndim == 0 else freeze_array(last)

    @property
    def failed(self) -> npt.NDArray[np.intp]:
        """(f,) the indices of the failed tops.

        For f failed tops, the shape is (f,) for one-dimensional ensembles and (f, ndim) otherwise.
        """
        return list_failed(self.status)

    @property
    def threshold(self) -> float:
        """The threshold of `final_megno`, namely 4, above which a motion is classified as chaotic.

        MEGNO tends to 2 for a regular motion. For a chaotic motion, MEGNO is about half the product
        of the Lyapunov exponent and t. All indicators use MEGNO to classify motions. Source:
        Cincotta and Simo, Astronomy and Astrophysics Supplement Series 147 (2000).
        """
        return THRESHOLD

    @property
    def is_chaotic(self) -> npt.NDArray[np.bool_] | bool:
        """(*shape,) True for chaotic motion; a bool for one scene.

        A motion is classified as chaotic if `final_megno` exceeds `threshold`. The Lyapunov
        exponent of a motion classified as regular is below about 2 * threshold / t. A motion that
        starts exactly on an unstable steady or periodic orbit has a positive exponent, and is
        classified as chaotic. The value is False for a top whose run failed. See also `doubt`.
        """
        return _freeze_or_unwrap_scalar(self.final_megno > THRESHOLD)

    @property
    def doubt(self) -> npt.NDArray[np.str_] | str:
        """(*shape,) the reason why `is_chaotic` is in doubt, or ''; a str for one scene.

        The reasons are:

        - the status of a failed top;
        - a certificate above 0.01;
        - a value of `final_megno` between 2.5 and 8, which is near the threshold;
        - fewer than 100 turns, unless the motion is chaotic.

        In a study of 1600 random tops, of which 536 were chaotic, no regular top was classified as
        chaotic with an empty `doubt`. Of the tops classified as regular with an empty `doubt`, 2 %
        were in fact chaotic for runs of 100 turns, 0.7 % for 300 turns, and 0 % for 1000 turns.
        """
        texts = np.array(self.status, dtype=object)
        texts[self.status == "OK"] = ""
        for text, mask in self._find_reasons_for_doubt().items():
            texts[mask & (texts == "")] = text
        return _freeze_or_unwrap_scalar(texts.astype(np.str_))

    @property
    def is_doubtful(self) -> npt.NDArray[np.bool_] | bool:
        """(*shape,) True where `doubt` has a reason; a bool for one scene."""
        return _freeze_or_unwrap_scalar(
            np.any([self.status != "OK", *self._find_reasons_for_doubt().values()], axis=0)
        )

    def _find_reasons_for_doubt(self) -> dict[str, npt.NDArray[np.bool_]]:
        """Map each reason for doubt to a mask, whose values are meaningless for failed runs."""
        megno, (low, high) = self.final_megno, NEAR
        return {
            f"certificate above {WORST:g}": ~(self.certificate <= WORST),
            "MEGNO near the threshold": (low < megno) & (megno < high),
            f"under {FEWEST_TURNS:g} turns": (self.turns < FEWEST_TURNS) & ~(megno > THRESHOLD),
        }

    def __repr__(self) -> str:
        if self.curve.ndim == 1:
            doubt = f", in doubt: {self.doubt}" if self.doubt else ""
            classification = ("chaotic" if self.is_chaotic else "regular") + doubt
            return f"<kreisel.Indicator: {self.value:.6g} at t = {self.t[-1]:g}; {classification}>"
        shape = "x".join(map(str, self.curve.shape[:-1]))
        counts = f"{np.sum(self.is_chaotic)} chaotic, {np.sum(self.is_doubtful)} in doubt"
        failures = f"{self.failed.size} failed"
        return f"<kreisel.Indicator: {shape} tops at t = {self.t[-1]:g}; {counts}, {failures}>"

    def plot(self, axes: Axes | None = None, *, time_unit: str = "T") -> Axes:
        """Plot the indicator with matplotlib, and return the axes.

        axes       the axes to draw in; default: a new figure
        time_unit  the unit of time in which the scenes are described, for the labels

        For a single scene or a one-dimensional ensemble, the indicator of each top is plotted
        against time. Colours distinguish regular, chaotic and doubtful motions. For kreisel.megno,
        a dashed line marks the threshold. For a two-dimensional ensemble, the final values of the
        indicator are drawn as a map, in which dots mark tops whose classification is doubtful. The
        curves omit nonpositive values, and values of MEGNO and OLI up to 0.1. Maps show values of
        MEGNO and OLI below 1 as 1.

            >>> import kreisel as kr
            >>> kr.megno(kr.scenes.asymmetric, 1000).plot(time_unit="s").get_xlabel()
            'time [s]'

        Raises ValueError for ensembles with more than two dimensions, and ImportError if matplotlib
        is not installed.
        """
        unit = as_unit_name("time_unit", time_unit)
        if self.curve.ndim > 3:
            raise ValueError(
                f"indicators of {self.curve.ndim - 1} dimensions cannot be drawn: select two of "
                "the ensemble's dimensions before computing the indicator"
            )
        from .._plot.charts import draw_chaos_indicator_map, draw_indicator_curves

        if self._tops is not None and self._tops.ndim == 2:
            return draw_chaos_indicator_map(self, self._tops, axes, unit)
        return draw_indicator_curves(self, axes, unit)

    def _repr_html_(self) -> str | None:
        """Return the indicator as a picture, or None if it cannot be drawn."""
        if self.curve.ndim > 3 or not self.certificate.size:
            return None
        return format_picture_as_html(self.plot, repr(self))

    def to_pandas(self) -> DataFrame:
        """Return a pandas.DataFrame with one row per top, in C order.

        The columns are the varying parameters, the indicator under its own name, `final_megno`,
        `is_chaotic`, `doubt`, `certificate`, `turns` and `status`. `attrs` contains the units.
        Raises ImportError if pandas is not installed.

            >>> import kreisel as kr
            >>> tops = kr.scenes.asymmetric.vary(gravity=[0.5, 1.0])
            >>> list(kr.oli(tops, 1000).to_pandas())[:4]
            ['gravity', 'oli', 'final_megno', 'is_chaotic']
        """
        frame = _tabulate_indicator(self, has_curve=False).to_pandas()
        frame.attrs["t"] = float(self.t[-1])
        return frame

    def to_xarray(self) -> Dataset:
        """Return an xarray.Dataset with the indicator over time and the classification of each top.

        The dimensions are those of the ensemble; the indicator has time as an additional dimension.
        The varying parameters are stored as coordinates of the Dataset. Raises ImportError if
        xarray is not installed.

            >>> import kreisel as kr
            >>> tops = kr.scenes.asymmetric.vary(gravity=[0.5, 1.0])
            >>> kr.megno(tops, 1000).to_xarray()["megno"].dims
            ('gravity', 'time')
        """
        return _tabulate_indicator(self, has_curve=True).to_xarray()


def _freeze_or_unwrap_scalar(values: npt.NDArray[_T]) -> npt.NDArray[_T] | Any:
    """Return a read-only array, or a Python scalar if the array has no dimensions."""
    if values.ndim == 0:
        return values.item()
    values.flags.writeable = False
    return values


def compute_chaos_indicator(
    tops: Ensemble,
    t: Array,
    name: str,
    controls: tuple[float, int, Sequence[float]],
    pool: WorkerPool,
    progress: Progress | None,
) -> Indicator:
    """Compute a chaos indicator for all tops of an ensemble at the given times.

    The times must have been validated. `controls` contains the tolerance, the step limit and the
    initial direction of the tangent vector. Raises kreisel.Interrupted, with the results of all
    finished tops, after Ctrl-C.
    """
    n, shape = tops.size, tops.shape
    curve, worst, megno = np.full((n, t.size), np.nan), np.full(n, np.nan), np.full(n, np.nan)
    status, work = np.full(n, INTERRUPTED, dtype=np.int8), Work()

    def make_indicator_job(begin: int, end: int) -> Job[tuple[Codes, Array]]:
        return _compute_indicator_rows, (tops, begin, end, t, controls, work)

    def store_slice_results(begin: int, part: tuple[Codes, Array]) -> None:
        codes, rows = part
        span = slice(begin, begin + len(codes))
        status[span], curve[span] = codes, CURVES[name](rows, t)
        megno[span] = rows[:, -1, MEGNO]
        worst[span] = rows[..., [ENERGY, MOMENTUM, REST]].max(axis=(1, 2))

    def build_indicator_result() -> Indicator:
        names = np.array(STATUSES)[status].reshape(shape)
        turns = (abs(t[-1]) / estimate_turn_durations(tops)).reshape(shape)
        parts = curve.reshape(*shape, t.size), worst.reshape(shape)
        return Indicator(t, *parts, names, name, megno.reshape(shape), turns, tops)

    try:
        pool.run_slices(n, make_indicator_job, store_slice_results, work, progress)
    except KeyboardInterrupt:
        indices = np.flatnonzero(status == INTERRUPTED)
        if not indices.size:
            raise
        raise _make_stop_error(
            Interrupted, tops, int(indices[0]), "interrupted", build_indicator_result()
        ) from None
    if progress is not None:
        progress(1.0)
    return build_indicator_result()


def _compute_indicator_rows(
    tops: Ensemble,
    begin: int,
    end: int,
    t: Array,
    steering: tuple[float, int, Sequence[float]],
    work: Work,
) -> tuple[Codes, Array]:
    status, rows = (
        np.full(end - begin, INTERRUPTED, dtype=np.int8),
        np.empty((end - begin, t.size, 6)),
    )
    growth(tops._core_scenes, begin, end, t, *steering, status, rows, work)
    rows[status == INTERRUPTED] = np.nan
    return status, rows


def _make_stop_error(
    kind: type[Error] | type[Interrupted], tops: Ensemble, i: int, text: str, indicator: Indicator
) -> Error | Interrupted:
    """Return the exception for an indicator that failed or was interrupted at its `i`-th top."""
    scene = tops.ravel()[i]
    status = str(indicator.status.ravel()[i])
    result = status, np.empty((0, 8)), None, (0, 0, 0, 0), float(indicator.t[-1])
    path = build_path_from_core_result(scene, Options(FALLBACK, requested_method=FALLBACK), result)
    return kind(f"{text}: the tangent of {scene!r}", status, path, indicator)


def extract_single_top_indicator(indicator: Indicator) -> Indicator:
    """Return the chaos indicator of a single scene, extracted from an ensemble with one top."""

    def take_first_value(values: npt.NDArray[_T]) -> npt.NDArray[_T]:
        return values[0:1].reshape(())

    return replace(
        indicator,
        curve=indicator.curve[0],
        certificate=take_first_value(indicator.certificate),
        status=str(indicator.status[0]),
        final_megno=take_first_value(indicator.final_megno),
        turns=take_first_value(indicator.turns),
        _tops=None,
    )


def raise_if_single_top_failed(tops: Ensemble, indicator: Indicator, text: str) -> None:
    """Raise kreisel.Error if the computation for the first top of an ensemble failed."""
    if indicator.failed.size:
        raise _make_stop_error(Error, tops, 0, text, indicator)


POINTS = 32  # default number of times of a curve; the times are evenly spaced on a log scale
_DECADES = 3.0  # log10 of the ratio of the last of these times to the first


def lyapunov(
    scene: Scene | Ensemble,
    t: Numbers,
    *,
    direction: Sequence[float] | None = None,
    tol: float | None = None,
    max_steps: int = 0,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Indicator:
    """Compute the largest Lyapunov exponent, ln(|tangent(t)| / |tangent(0)|) / t [T^-1].

    For a regular motion, the exponent tends to zero as ln(t) / t.

    scene      an undamped kreisel.Scene or kreisel.Ensemble
    t          a number: the curve has 32 times up to t, evenly spaced on a logarithmic scale over
               three decades; or a monotonic list of times on one side of 0 [T]
    direction  the tangent at the start: three components of a rotation vector seen from the body
               [rad], then three components of a change of momentum in space [M L^2 T^-1]; default:
               a direction that is the same for all tops in scaled units. The components of the
               tangent along the flow and along rotations about the vertical do not grow, and are
               removed
    tol        the local error of a step of the path; default: rounding error. 1e-9 distinguishes
               regular from chaotic motion equally well in about half the time; the certificate is
               then also about 1e-9
    max_steps  the maximal number of steps; 0: no limit
    threads    the number of threads; default: the number of processors
    progress   a function called with the finished fraction of the tops, 0 .. 1

    The tangent is integrated together with the path, and is repeatedly scaled by powers of two. The
    norm of the tangent is computed in units in which the largest moment of inertia and the angular
    velocity are about 1.

        >>> import kreisel as kr
        >>> chaos = kr.lyapunov(kr.scenes.asymmetric, 1000)
        >>> 0.1 < chaos.value < 0.2, chaos.curve.shape, bool(chaos.certificate < 1e-12)
        (True, (32,), True)
        >>> kr.lyapunov(kr.scenes.kowalewski, 1000).value < 0.01
        True

    Raises TypeError or ValueError for invalid arguments, before any computation starts. Raises
    kreisel.Error if the computation for a single scene fails. For an ensemble, failures are
    recorded in the attribute `status`. Raises kreisel.Interrupted after Ctrl-C; its attribute
    `paths` contains the results obtained so far. Source: Benettin, Galgani, Giorgilli and Strelcyn,
    Meccanica 15 (1980).
    """
    return _compute_chaos_indicator(
        "lyapunov", scene, t, direction, tol, max_steps, threads, progress
    )


def megno(
    scene: Scene | Ensemble,
    t: Numbers,
    *,
    direction: Sequence[float] | None = None,
    tol: float | None = None,
    max_steps: int = 0,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Indicator:
    """Compute the mean exponential growth of nearby orbits (MEGNO), averaged over time.

    For a regular motion, MEGNO tends to 2 if neighbouring motions separate linearly in time, and to
    0 if they do not separate. For a chaotic motion, MEGNO is about half the Lyapunov exponent times
    t. The arguments are the same as for kreisel.lyapunov.

        >>> import kreisel as kr
        >>> kr.megno(kr.scenes.asymmetric, 1000).value > 20
        True
        >>> round(kr.megno(kr.scenes.thesis, 10000).value, 1)
        2.0

    Raises the same exceptions as kreisel.lyapunov. Source: Cincotta and Simo, Astronomy and
    Astrophysics Supplement Series 147 (2000).
    """
    return _compute_chaos_indicator("megno", scene, t, direction, tol, max_steps, threads, progress)


def oli(
    scene: Scene | Ensemble,
    t: Numbers,
    *,
    direction: Sequence[float] | None = None,
    tol: float | None = None,
    max_steps: int = 0,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Indicator:
    """Compute the orthogonal Lyapunov indicator (OLI).

    The indicator is the largest logarithm of the norm of a tangent vector up to time t, and never
    decreases. The norm is evaluated at a few times in each integration step and at the requested
    times. The indicator is therefore slightly too small, and depends slightly on the requested
    times. The tangent vector is orthogonal to the direction of motion and to rotations about the
    vertical. The indicator grows as ln(t) for a regular motion, and as t for a chaotic motion. The
    arguments are the same as for kreisel.lyapunov.

        >>> import kreisel as kr
        >>> kr.oli(kr.scenes.asymmetric, 1000).value > 100
        True
        >>> round(kr.oli(kr.scenes.thesis, 1000).value, 1)
        8.4

    Raises the same exceptions as kreisel.lyapunov. Source: Fouchard, Lega, Froeschle and Froeschle,
    Celestial Mechanics and Dynamical Astronomy 83 (2002).
    """
    return _compute_chaos_indicator("oli", scene, t, direction, tol, max_steps, threads, progress)


def _compute_chaos_indicator(
    name: str,
    scene: Scene | Ensemble,
    t: Numbers,
    direction: object,
    tol: object,
    max_steps: object,
    threads: object,
    progress: Progress | None,
) -> Indicator:
    times, controls = validate_indicator_arguments(scene, t, direction, tol, max_steps)
    pool, callback = (
        WorkerPool(validate_thread_count(threads, None)),
        validate_progress_callback(progress),
    )
    if isinstance(scene, Ensemble):
        return compute_chaos_indicator(scene, times, name, controls, pool, callback)
    check_resolvable_horizon(scene, float(times[-1]), None)
    tops = Ensemble.of([scene])
    result = compute_chaos_indicator(tops, times, name, controls, pool, callback)
    status = str(result.status[0])
    if status != "OK" and statuses[status][0] == "INPUT":
        raise make_exception_from_status(
            status, f"no tangent in the direction {direction!r} of {scene!r}"
        )
    raise_if_single_top_failed(tops, result, statuses[status][1])
    return extract_single_top_indicator(result)


def validate_indicator_arguments(
    scene: Scene | Ensemble, t: Numbers, direction: object, tol: object, max_steps: object
) -> tuple[Array, tuple[float, int, Sequence[float]]]:
    """Return the times at which the chaos indicator is recorded, and the validated options.

    Raises TypeError or ValueError for an invalid argument.
    """
    if not isinstance(scene, Scene | Ensemble):
        raise TypeError(
            f"scene must be a kreisel.Scene or a kreisel.Ensemble, not {short_repr(scene)}"
        )
    times = _validate_indicator_times(t)
    accuracy = validate_tol(methods[FALLBACK], tol) or 0.0
    controls = accuracy, as_int("max_steps", max_steps, 0), _validate_tangent_direction(direction)
    if np.any(scene.damping):
        raise ValueError(
            "a damped top has no indicator of chaos: its motion decays, and energy and <m, e3> "
            "are not conserved"
        )
    hint = "path.tangents of kr.solve(..., tangents='start') shows how changes of the start grow"
    refuse_disturbances(scene, "indicators of chaos do not support tops", reason=hint)
    return times, controls


def _validate_indicator_times(t: Numbers) -> Array:
    times = time_array(t, None, None, 16)
    if np.ndim(t) == 0:
        end = as_float("t", t)
        times = end * np.logspace(-_DECADES, 0.0, POINTS)
    if not times.size or not times.all():
        raise ValueError("t must contain only positive or only negative times, and not 0")
    return times


def _validate_tangent_direction(direction: object) -> tuple[float, ...]:
    if direction is None:
        return ()
    vector = as_finite_array("direction", direction, "six numbers")
    if vector.shape != (6,) or not vector.any():
        raise ValueError(
            "direction must be six numbers, not all 0: a rotation vector seen from the body, and a "
            f"change of the momentum in space; not {short_repr(direction)}"
        )
    return tuple(vector.tolist())
