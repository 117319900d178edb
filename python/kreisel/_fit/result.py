"""The result of a fit, and its summary."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from html import escape
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike

from .._model.scene import Ensemble, Scene
from .._results.path import Error, Path
from .._solve.solve import solve
from .._utils.arguments import (
    Array,
    ReadOnlyArrays,
    as_int,
    format_count,
    freeze_arrays,
    optional_dependency,
    warn_user,
)
from .._utils.files import atomic_write
from .._utils.html import format_html_table
from .fit_model import predict_measurements_densely
from .minimize import describe_uncertain_sigmas
from .parameters import FitPoint, FreeParameters
from .records import Mask, Record, leave_out_rows
from .residuals import STEPS_MOST
from .search import BestFit, SearchSession, describe_alternative_spin
from .uncertainty import (
    FitCovariance,
    classify_fit_directions,
    compute_residual_statistics,
    describe_undetermined_directions,
    measure_cost_nonlinearity,
)

if TYPE_CHECKING:
    from pandas import DataFrame

    from .._plot.charts import FigureAxes


class HasSigma(Protocol):
    """Interface of a measured quantity, with the attributes required to summarize a fit."""

    @property
    def sigma(self) -> object: ...


class RecordLike(Protocol):
    """Interface of a record, with the attributes required to summarize a fit."""

    @property
    def series(self) -> Sequence[HasSigma]: ...

    @property
    def size(self) -> int: ...
    @property
    def missing(self) -> int: ...


class FitLike(Protocol):
    """Interface of a fit, with the attributes required to format its summary."""

    @property
    def records(self) -> Sequence[RecordLike]: ...
    @property
    def names(self) -> Sequence[str]: ...
    @property
    def units(self) -> Sequence[str]: ...
    @property
    def values(self) -> dict[str, float]: ...
    @property
    def error(self) -> dict[str, float]: ...
    @property
    def moment_ratios(self) -> dict[str, tuple[float, float]]: ...
    @property
    def chi2(self) -> float: ...
    @property
    def dof(self) -> int: ...
    @property
    def residual_correlation(self) -> float: ...
    @property
    def inflation(self) -> float: ...
    @property
    def nonlinearity(self) -> float: ...
    @property
    def unidentified(self) -> Sequence[str]: ...
    @property
    def ambiguous(self) -> Sequence[str]: ...
    @property
    def misfit(self) -> float: ...
    @property
    def excess(self) -> float: ...
    @property
    def is_plausible(self) -> bool | None: ...
    @property
    def uncertain_sigma(self) -> Sequence[str]: ...
    @property
    def at_bound(self) -> Sequence[str]: ...
    @property
    def has_converged(self) -> bool: ...
    @property
    def evaluations(self) -> int: ...
    @property
    def piece_starts(self) -> Sequence[float]: ...


_MISFIT = 100.0  # chi2 per degree of freedom from which the model is wrong
_AS_LARGE = 0.5  # residuals relative to the values that no motion explains
_CORRELATED = 0.2  # correlation of neighbouring residuals that is mentioned
_ENLARGED = 1.05  # inflation that is mentioned
_NONLINEAR = 0.3  # deviation of the rise of chi2 along one sigma that is mentioned


def format_fit_summary(fit: FitLike) -> str:
    """Return the summary: a row for each parameter, then sentences about the quality of the fit."""
    rows = _list_parameter_rows(fit)
    width = max(len(name) for name, *_ in rows)
    lines = [f"  {name:<{width}}  {value} {unit}".rstrip() for name, value, unit in rows]
    return "\n".join([_format_summary_head(fit), *lines, *_list_fit_quality_sentences(fit)])


def format_fit_summary_as_html(fit: FitLike) -> str:
    """Return the summary as HTML, with the parameters in a table."""
    head, *sentences = [
        f"<p>{escape(text)}</p>"
        for text in (_format_summary_head(fit), *_list_fit_quality_sentences(fit))
    ]
    table = format_html_table(_list_parameter_rows(fit), ("parameter", "value", "unit"))
    return "\n".join([head, table, *sentences])


def _format_summary_head(fit: FitLike) -> str:
    count = sum(record.size for record in fit.records)
    verdict = {True: " (plausible)", False: " (not plausible)", None: ""}[fit.is_plausible]
    return (
        f"Fit of {len(fit.names)} parameters to {count} numbers: "
        f"chi2 {fit.chi2 / fit.dof:.3g} per degree of freedom{verdict}, {fit.evaluations} paths"
    )


def _list_parameter_rows(fit: FitLike) -> list[tuple[str, str, str]]:
    """Return rows (name, value ± error, unit), also of moment ratios if an error is infinite."""
    ratios = {} if all(map(math.isfinite, fit.error.values())) else fit.moment_ratios
    rows = [
        (
            name,
            format_value_with_error(fit.values[name], fit.error[name]),
            f"[{unit}]" if unit else "",
        )
        for name, unit in zip(fit.names, fit.units, strict=True)
    ]
    return rows + [(name, format_value_with_error(*pair), "") for name, pair in ratios.items()]


def format_value_with_error(value: float, error: float) -> str:
    """Return a value and its error as text, with as many digits as are significant."""
    if not math.isfinite(error):
        return "not identified"
    if not error > 0.0:
        return f"{value:.12g} +- {error:.2g}"
    size = max(abs(value), error)
    digits = min(max(2 + math.floor(math.log10(size)) - math.floor(math.log10(error)), 2), 17)
    return f"{value:#.{digits}g} +- {error:.2g}"


def has_residuals_as_large_as_data(fit: FitLike) -> bool:
    """Return True if the residuals are of the order of the measured values and exceed the noise."""
    is_estimated = any(series.sigma is None for record in fit.records for series in record.series)
    return fit.misfit > _AS_LARGE and (is_estimated or fit.chi2 > _MISFIT * fit.dof)


def describe_misfit(fit: FitLike) -> str:
    return (
        "No motion of this scene fits the records: the residuals are "
        f"{100.0 * fit.misfit:.0f} % of the values, or of 1 rad for angles."
    )


def describe_residual_excess(fit: FitLike) -> str:
    return (
        f"The residuals are {fit.excess:.3g} times as large as sigma explains: the fit is a false "
        "minimum, the records are of another top, or sigma is too small."
    )


def _list_fit_quality_sentences(fit: FitLike) -> list[str]:
    sentences = []
    if not fit.has_converged:
        sentences.append("The search did not converge; this is the best so far.")
    if has_residuals_as_large_as_data(fit):
        sentences.append(describe_misfit(fit))
    elif fit.excess:
        sentences.append(describe_residual_excess(fit))
    if ties := [name for name in fit.names if " = " in name]:
        sentences.append(
            f"Kept equal, as in the given scene: {', '.join(ties)}. Give different numbers to "
            "estimate them apart."
        )
    sentences += _list_labelled_sentences(fit)
    if fit.residual_correlation > _CORRELATED and fit.inflation > _ENLARGED:
        sentences.append(
            f"Neighbouring residuals are correlated ({fit.residual_correlation:.2f}): the "
            "model does not include all forces on the top."
        )
    if fit.inflation > _ENLARGED:
        sentences.append(
            f"Errors were enlarged {fit.inflation:.3g} times, because residuals are large or "
            "correlated."
        )
    if fit.nonlinearity > _NONLINEAR:
        sentences.append(
            "Errors are not normally distributed: along the least certain direction, the change of "
            f"chi2 for one sigma differs from 1 by {fit.nonlinearity:.2g}."
        )
    if missing_count := sum(record.missing for record in fit.records):
        sentences.append(f"{missing_count} values are left out: not measured, or undefined angles.")
    if fit.piece_starts:
        sentences.append(
            f"The motion consists of {len(fit.piece_starts)} joined pieces, each with its own "
            "start."
        )
    return sentences


def _list_labelled_sentences(fit: FitLike) -> list[str]:
    labels = {
        "Not identified": fit.unidentified,
        "Ambiguous": fit.ambiguous,
        "Uncertain": fit.uncertain_sigma,
        "At a bound": fit.at_bound,
    }
    return [f"{label}: {text}." for label, texts in labels.items() for text in texts]


def solve_fitted_motion(
    parameters: FreeParameters, pieces: tuple[tuple[float, FitPoint], ...], t: Array
) -> Path:
    """Return the path at increasing times; each state is computed from the start of its segment."""
    scene = parameters.to_scene(next(point for begin, point in pieces if begin == 0.0))
    begins = np.array([begin for begin, _ in pieces])
    owner = np.maximum(np.searchsorted(begins, t, side="right") - 1, 0)
    states, steps = [], []
    path = solve(scene, np.empty(0), "taylor")
    for k, (begin, point) in enumerate(pieces):
        times = t[owner == k] - begin
        for part in (times[times < 0.0][::-1], times[times >= 0.0]):
            if len(part):
                path = solve(parameters.to_scene(point, begin), part, "taylor")
                rows = path.states if part[0] >= 0.0 else path.states[::-1]
                shifted = rows.copy()
                shifted[:, 0] += begin
                states.append(shifted)
                steps.append(path.stats)
    if len(states) == 1 and len(pieces) == 1 and path.t[0] >= 0.0:
        return path
    all_states = np.ascontiguousarray(np.concatenate(states))
    return Path(scene, all_states, steps[-1], path._options)


_DIFFERENCE = 1e-5  # steps of numerical derivatives, relative to the natural sizes
_AT_BOUND = 1e-6  # distance to a bound that counts as zero, relative to the natural size


@dataclass(frozen=True, eq=False)
class Fit(ReadOnlyArrays):
    """The result of kreisel.fit. `print(fit)` shows a table. Arrays are read-only.

    scene         the fitted scene
    records       the records, without angles that are undefined where the apex is vertical
    names         names of the free parameters. The moments are the principal ones; vectors are
                  given in the frame of description, but turning in space
    units         their units: rad, rad/T, or dimensions of M, L and T; empty for pure numbers
    values        {name: value}; the attitude is a rotation vector [rad]
    error         {name: standard deviation}; infinite where the records do not determine it. The
                  error of the attitude is that of a small rotation in the body frame [rad], those
                  of the axes and of a mounting in their own frames
    moment_ratios  {"I1 / I3": (value, standard deviation)} of the moments to the last one; empty if
                  the moments are not free
    covariance    (k, k) in the order of `names`; infinite and NaN for infinite errors
    residuals     for each record {quantity: (n, ...) model minus measurement, in standard
                  deviations}; NaN where nothing was measured. q has 3 components, a rotation
                  vector in principal-axis components
    sigma         for each record {quantity: standard deviation}, given or estimated; a number if
                  all are equal, otherwise an array, NaN where nothing was measured
    chi2          sum of the squared residuals; for the soft loss, only of those within 3 sigma
    dof           degrees of freedom: the number of residuals minus the number of parameters, at
                  least 1
    residual_correlation  mean correlation of neighbouring residuals
    inflation     factor by which errors were enlarged because residuals are large or correlated
    nonlinearity  |rise - 1|, where `rise` is the increase of chi2 one standard deviation along the
                  least certain direction, relative to that of a linear model. If it is large, the
                  errors are not normal. It is 0 for the soft loss and for a motion in pieces
    unidentified  a sentence for each direction that the records do not determine, and for each half
                  turn of the body that fits as well; the nearest to the given scene is returned
    ambiguous     a sentence about another spin that fits as well, for records with few samples a
                  turn, and about another motion that fits as well; empty otherwise
    misfit        the root mean square of the residuals relative to that of the values, or to 1 rad.
                  For the soft loss it is estimated from the median
    excess        the size of the residuals in sigmas, if it is larger than noise explains;
                  otherwise 0, and for a sigma that is not given. For the soft loss it is estimated
                  from the median, and noise includes 10 % of outliers
    uncertain_sigma  a sentence for each quantity whose unknown sigma is estimated from few numbers
    at_bound      a sentence for each parameter that ended at its bound. The error of such a
                  parameter ignores the bound
    has_converged  False if the search ended at a limit on the number of paths. A search may
                  converge to a wrong minimum, see is_plausible
    evaluations   the number of computed paths
    piece_starts  the times at which the pieces of the motion begin; empty for a single motion
    """

    scene: Scene
    records: tuple[Record, ...]
    names: tuple[str, ...]
    units: tuple[str, ...]
    values: dict[str, float]
    error: dict[str, float]
    moment_ratios: dict[str, tuple[float, float]]
    covariance: Array
    residuals: tuple[dict[str, Array], ...]
    sigma: tuple[dict[str, Array], ...]
    chi2: float
    dof: int
    residual_correlation: float
    inflation: float
    nonlinearity: float
    unidentified: tuple[str, ...]
    ambiguous: tuple[str, ...]
    misfit: float
    excess: float
    uncertain_sigma: tuple[str, ...]
    at_bound: tuple[str, ...]
    has_converged: bool
    evaluations: int
    piece_starts: tuple[float, ...]
    cost: float
    _parameters: FreeParameters
    _point: FitPoint
    _spectrum: FitCovariance
    _pieces: tuple[tuple[float, FitPoint], ...]

    @property
    def is_plausible(self) -> bool | None:
        """True if noise of the given sigma explains chi2; None if a sigma is not given.

        chi2 may exceed `dof` by at most three standard deviations of the chi2 distribution. For the
        soft loss, the median of the residuals decides, and a tenth of them may be outliers. False
        means that the search has missed the motion, that the model lacks a force, or that sigma is
        too small. A sigma estimated from the residuals cannot tell.
        """
        is_sigma_known = all(s.sigma is not None for r in self.records for s in r.series)
        return self.excess == 0.0 if is_sigma_known else None

    @cached_property
    def path(self) -> Path:
        """The fitted motion at all measurement times, corrected for instrument delays.

        If the motion was fitted in segments, each segment is computed from its own initial state.
        """
        times = []
        for i, record in enumerate(self.records):
            delay = self._point.instruments.get(("delay", i, ""))
            times.append(record.t if delay is None else record.t - delay[0])
        t = np.unique(np.concatenate(times))
        return solve_fitted_motion(self._parameters, self._motion_pieces, t)

    @property
    def _motion_pieces(self) -> tuple[tuple[float, FitPoint], ...]:
        """The initial times of the pieces of the motion, and their parameters."""
        return self._pieces or ((0.0, self._point),)

    def error_of(self, function: Callable[[Scene], ArrayLike]) -> tuple[Any, Any]:
        """Return the value of a function of the fitted scene, and its standard deviation.

        The function must return a number or an array. The derivatives of this function with respect
        to the parameters of the fit are computed by finite differences. The standard deviation is
        infinite if the function depends on a combination of parameters that the data do not
        determine.

            >>> import kreisel as kr
            >>> top = kr.scenes.cusps
            >>> t = [0.1 * i for i in range(50)]
            >>> record = kr.Record(t, {"apex": kr.solve(top, t).apex}, sigma=0.01)
            >>> found = kr.fit(top, record, ("start", "moments"))
            >>> moment, error = found.error_of(lambda scene: scene.body.moments[0])
            >>> bool(abs(moment - 1.0) < 1e-6), error < 0.02
            (True, True)

        Raises TypeError if the function returns anything other than numbers.
        """
        value = _convert_to_float_array(function(self.scene))
        columns = []
        for k in range(self._parameters.size):
            step = np.zeros(self._parameters.size)
            step[k] = _DIFFERENCE * self._spectrum.natural[k]
            ends = [
                self._parameters.add_step_within_bounds(self._point, sign * step)
                for sign in (1.0, -1.0)
            ]
            lengths = [min(1.0, self._compute_distance_to_lower_bound(k) / step[k]), 1.0]
            end_values = [
                _convert_to_float_array(function(self._parameters.to_scene(end))) for end in ends
            ]
            columns.append((end_values[0] - end_values[1]).ravel() / (step[k] * sum(lengths)))
        _, errors = self._spectrum.propagate_errors(np.stack(columns, axis=-1))
        error_array = errors.reshape(value.shape)
        return (value, error_array) if value.ndim else (float(value), float(error_array))

    def _compute_distance_to_lower_bound(self, k: int) -> float:
        """Return the distance of parameter k from its lower bound."""
        return float(self._parameters.compute_distances_to_lower_bounds(self._point)[k])

    def scatter(self, n: int, *, seed: int = 0) -> Ensemble:
        """Return an ensemble of n random scenes, drawn with the covariance of the fit.

        The random scenes vary only in those directions of parameter space that the data determine.
        Moments of inertia, damping and friction are clipped to their bounds.
        """
        count, key = as_int("n", n, 1), as_int("seed", seed, 0)
        steps = self._spectrum.draw_random_parameter_changes(np.random.default_rng(key), count)
        return Ensemble.of(
            [
                self._parameters.to_scene(
                    self._parameters.add_step_within_bounds(self._point, step)
                )
                for step in steps
            ]
        )

    def plot(self) -> FigureAxes:
        """Plot measurements, fitted motion and residuals with matplotlib, and return the axes.

        For each quantity, one chart shows the measurements and the fitted motion, and another chart
        shows the residuals. The line of the motion is computed between the measurements as well. If
        the motion has hundreds of turns, black dots show it at the times of the measurements. For
        attitudes, only the measurements are drawn. To save the figure to a file, call
        `fit.plot().figure.savefig("fit.png")`.

        Raises ImportError if matplotlib is not installed.
        """
        from .._plot.charts import plot_fit_panels

        return plot_fit_panels([*_yield_series_chart_data(self)])

    def to_pandas(self) -> DataFrame:
        """Return a pandas.DataFrame with the value, error and unit of each parameter.

        Raises ImportError if pandas is not installed.
        """
        with optional_dependency("'kreisel[tables]'"):
            import pandas

        columns = {
            "value": list(self.values.values()),
            "error": list(self.error.values()),
            "unit": list(self.units),
        }
        return pandas.DataFrame(columns, index=pandas.Index(self.names, name="parameter"))

    def to_toml(self, path: str | os.PathLike[str] | None = None) -> str:
        """Return the fitted scene as TOML text, with the summary of the fit as a comment.

        Scene.from_toml reads the scene. If `path` is given, also write the text to this file.
        """
        comment = "".join(f"# {line}".rstrip() + "\n" for line in str(self).splitlines())
        text = comment + self.scene.to_toml()
        if path is not None:
            atomic_write(path, text.encode())
        return text

    def __str__(self) -> str:
        return format_fit_summary(self)

    def _repr_html_(self) -> str:
        """Return the summary as HTML, with a table of the parameters, for display in notebooks."""
        return format_fit_summary_as_html(self)

    def __repr__(self) -> str:
        ratio = self.chi2 / self.dof
        blind = f", {len(self.unidentified)} unidentified" if self.unidentified else ""
        convergence = "" if self.has_converged else ", not converged"
        return (
            f"<kreisel.Fit: {len(self.names)} parameters{blind}, chi2 {ratio:.3g} per degree of "
            f"freedom, {self.evaluations} paths{convergence}>"
        )


class _SeriesChartData(NamedTuple):
    """The measurements, residuals and fitted motion of one quantity, for a chart."""

    name: str
    t: Array
    values: Array
    residuals: Array
    sigma: Array
    motion: tuple[Array, Array] | None


def _yield_series_chart_data(fit: Fit) -> Iterator[_SeriesChartData]:
    motions = predict_measurements_densely(fit._parameters, fit._motion_pieces, fit.records)
    for i, record in enumerate(fit.records):
        for series in record.series:
            values = np.where(series.measured, series.values / series.unit, np.nan)
            residuals = fit.residuals[i][series.name]
            residual_rows = residuals.reshape(len(record.t), series.residuals_per_row)
            sigma = np.asarray(fit.sigma[i][series.name])
            motion = motions[i].get(series.name)
            yield _SeriesChartData(series.name, record.t, values, residual_rows, sigma, motion)


def _convert_to_float_array(value: ArrayLike) -> Array:
    numbers = np.asarray(value)
    if numbers.dtype.kind not in "iuf":
        raise TypeError(f"function must return numbers, not {type(value).__name__}")
    return numbers.astype(float)


def build_fit_from_search(session: SearchSession) -> Fit:
    """Build a Fit from the best solution found by a search."""
    best, p, loss = session.best, session.parameters, session.loss
    assert best is not None
    stats = compute_residual_statistics(session.model, best.residuals, loss, session.is_sigma_known)
    spectrum = classify_fit_directions(best.jacobian, best.natural, stats.inflation, p.size)
    names, units, values, jacobian = p.list_user_parameters_and_jacobian(best.point)
    covariance, errors = spectrum.propagate_errors(jacobian)
    residuals, sigma = _group_residuals_and_sigmas_by_series(session, best.residuals)
    freeze_arrays((covariance, residuals, sigma))
    return Fit(
        p.to_scene(best.point),
        session.records,
        tuple(names),
        tuple(units),
        dict(zip(names, map(float, values), strict=True)),
        dict(zip(names, map(float, errors), strict=True)),
        _compute_moment_ratios_and_errors(p, names, values, jacobian, spectrum),
        covariance,
        residuals,
        sigma,
        stats.chi2,
        stats.dof,
        stats.correlation,
        stats.inflation,
        _measure_fit_nonlinearity(session, best, spectrum, stats.inflation),
        (
            *describe_undetermined_directions(
                p, best.point, spectrum.natural, spectrum.blind, names
            ),
            *(
                f"a half turn of the body, with its com and its start, about principal axis {k + 1}"
                for k in session.half_turns
            ),
        ),
        _describe_other_motions(session, best.point),
        session.measure_relative_misfit(),
        session.measure_residual_excess(),
        describe_uncertain_sigmas(session.model, best.scaled_jacobian),
        _describe_reached_bounds(p, best.point, best.natural),
        best.has_converged,
        session.evaluations + session.model.evaluations,
        tuple(begin for begin, _ in best.pieces),
        best.cost,
        p,
        best.point,
        spectrum,
        best.pieces,
    )


def _describe_other_motions(session: SearchSession, point: FitPoint) -> tuple[str, ...]:
    sentences = []
    if session.alias is not None:
        sentences.append(describe_alternative_spin(point, session.alias))
    if session.rival is not None:
        names, _, values, _ = session.parameters.list_user_parameters_and_jacobian(session.rival)
        numbers = ", ".join(
            f"{name} = {value:.4g}" for name, value in zip(names, values, strict=True)
        )
        sentences.append(f"the motion: another one fits equally well, with {numbers}")
    return tuple(sentences)


def _compute_moment_ratios_and_errors(
    p: FreeParameters,
    names: list[str],
    values: Array,
    jacobian: Array,
    spectrum: FitCovariance,
) -> dict[str, tuple[float, float]]:
    """Return the ratio of each free moment of inertia to the last one, and its standard error."""
    if not p.can_vary("moments"):
        return {}
    *others, last = range(*p.get_parameter_slice("moments").indices(p.size))
    ratios = {}
    for k in others:
        ratio = values[k] / values[last]
        gradient = (jacobian[k] - ratio * jacobian[last]) / values[last]
        _, [error] = spectrum.propagate_errors(gradient[None])
        ratios[f"{names[k]} / {names[last]}"] = (float(ratio), float(error))
    return ratios


def _measure_fit_nonlinearity(
    session: SearchSession, best: BestFit, spectrum: FitCovariance, inflation: float
) -> float:
    if best.pieces or session.loss != "linear":
        return 0.0
    optimum = session.model, best.point, best.residuals
    return measure_cost_nonlinearity(*optimum, spectrum, inflation)


def _group_residuals_and_sigmas_by_series(
    session: SearchSession, residuals: Array
) -> tuple[tuple[dict[str, Array], ...], tuple[dict[str, Array], ...]]:
    residual_tables: tuple[dict[str, Array], ...] = tuple({} for _ in session.records)
    sigma: tuple[dict[str, Array], ...] = tuple({} for _ in session.records)
    for rows in session.model.rows:
        values = np.where(rows.measured_mask, rows.select_series_residuals(residuals), np.nan)
        residual_tables[rows.record][rows.series.name] = (
            values[:, 0] if values.shape[1] == 1 else values
        )
        deviation = np.where(rows.measured_mask, rows.sigma / rows.series.unit, np.nan)
        known = deviation[rows.measured_mask]
        is_constant = known.size > 0 and bool((known == known[0]).all())
        sigma[rows.record][rows.series.name] = known[0] if is_constant else deviation
    return residual_tables, sigma


def _describe_reached_bounds(p: FreeParameters, point: FitPoint, natural: Array) -> tuple[str, ...]:
    """Return one sentence for each density, damping or friction parameter that is zero."""
    sentences = []
    distances = p.compute_distances_to_lower_bounds(point)
    for name, columns in (("moments", p.columns["moments"]), ("damping", p.columns["damping"])):
        if not p.can_vary(name):
            continue
        part = p.get_parameter_slice(name)
        for k in np.flatnonzero(distances[part] <= _AT_BOUND * natural[part]):
            axes = [int(i) + 1 for i in np.flatnonzero(columns[:, k])]
            sentences.append(_describe_reached_bound(name, axes))
    if p.can_vary("friction") and not point.friction:
        sentences.append("friction is zero: negative friction is excluded")
    return tuple(sentences)


def _describe_reached_bound(name: str, axes: list[int]) -> str:
    if name == "damping":
        return " = ".join(f"damping_{i}" for i in axes) + " is zero: negative damping is excluded"
    if len(axes) == 1:
        rest = [i for i in (1, 2, 3) if i not in axes]
        return (
            f"I{axes[0]} = I{rest[0]} + I{rest[1]}: the body is a plate normal to axis "
            f"{axes[0]}, or flatter than any rigid body"
        )
    return "the body is a rod: one moment is zero"


_UNDEFINED = ("precession_angle", "spin_angle")
_VERTICAL = 1e-3  # lean [rad] up to which these angles change too fast for linear equations
_TIMES_NAMED = 3
_GUESS, _FIT = "scene", "fitted motion"


def search_with_defined_angles(
    records: tuple[Record, ...],
    guesses: Iterable[Scene],
    search: Callable[[tuple[Record, ...]], Fit],
) -> Fit:
    """Search for the best fit to those angles that are defined in the motions of all guesses.

    If angles are undefined in the fitted motion, the search is repeated without them. Otherwise
    they would hold the apex at the vertical, because the least lean can explain any such angle. If
    all angles of a quantity are undefined, the guess says nothing about them, and they are kept.

    Warns if angles are left out. Raises ValueError if all angles of a quantity are undefined in the
    fitted motion.
    """
    if not any(series.quantity in _UNDEFINED for record in records for series in record.series):
        return search(records)
    leaning = _leave_out_angles(records, _find_vertical_times_of_scenes(guesses, records), _GUESS)
    while True:
        fit = search(leaning)
        masks = _find_vertical_times_of_fit(fit)
        fewer = _leave_out_angles(leaning, masks, _FIT)
        if fewer is leaning:
            return fit
        leaning = fewer


def _find_vertical_times_of_scenes(
    scenes: Iterable[Scene], records: tuple[Record, ...]
) -> list[Mask]:
    """Return masks of the times at which the apex of a scene is vertical, one for each record."""
    masks: list[Mask] = [np.zeros(len(record.t), dtype=bool) for record in records]
    for scene in scenes:
        for record, mask in zip(records, masks, strict=True):
            for rows in (np.flatnonzero(record.t < 0.0)[::-1], np.flatnonzero(record.t >= 0.0)):
                try:
                    path = solve(scene, record.t[rows], "taylor", max_steps=STEPS_MOST)
                except (Error, ValueError):
                    continue  # the search reports scenes that cannot be solved
                mask[rows] |= _is_vertical(path.apex)
    return masks


def _find_vertical_times_of_fit(fit: Fit) -> list[Mask]:
    path, is_vertical = fit.path, _is_vertical(fit.path.apex)
    return [
        is_vertical[np.searchsorted(path.t, record.t - fit.values.get(f"delay[{i}]", 0.0))]
        for i, record in enumerate(fit.records)
    ]


def _is_vertical(apex: Array) -> Mask:
    is_vertical: Mask = np.hypot(apex[:, 0], apex[:, 1]) < _VERTICAL
    return is_vertical


def _leave_out_angles(
    records: tuple[Record, ...], masks: list[Mask], motion: str
) -> tuple[Record, ...]:
    """Return the records without the angles at the times in `masks`, or the same tuple."""
    found = tuple(
        _leave_out_angles_of_record(record, mask, motion)
        for record, mask in zip(records, masks, strict=True)
    )
    is_same = all(new is old for new, old in zip(found, records, strict=True))
    return records if is_same else found


def _leave_out_angles_of_record(record: Record, is_vertical: Mask, motion: str) -> Record:
    rows: Mask = np.zeros(len(record.t), dtype=bool)
    names: list[str] = []
    for series in record.series:
        is_measured = series.measured[:, 0]
        is_undefined = is_measured & is_vertical
        if series.quantity not in _UNDEFINED or not is_undefined.any():
            continue
        if (is_undefined == is_measured).all():
            if motion == _GUESS:
                continue
            raise ValueError(
                f"{series.name} is undefined at all its times, because the apex of the {motion} is "
                "vertical then: leave it out, or give a scene that leans"
            )
        names.append(series.name)
        rows |= is_undefined
    if not names:
        return record
    warn_user(
        f"{' and '.join(names)} at {_name_times(record.t[rows])} left out: undefined where the "
        f"apex of the {motion} is vertical"
    )
    return leave_out_rows(record, names, rows)


def _name_times(t: Array) -> str:
    named = ", ".join(f"{time:g}" for time in t[:_TIMES_NAMED])
    rest = len(t) - _TIMES_NAMED
    return f"t = {named}" + (f" and {format_count(rest, 'other time')}" if rest > 0 else "")
