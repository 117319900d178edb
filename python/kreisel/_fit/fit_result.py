"""Results of fits: the scene, parameter errors, and directions that the data do not determine."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from .._model.scene import Ensemble, Scene
from .._results.path import Path
from .._utils.atomic_io import atomic_write
from .._utils.optional import optional_dependency
from .._utils.validation import Array, ReadOnlyArrays, as_int, freeze_arrays
from .aliasing import describe_alternative_spin
from .fit_model import predict_measurements_densely
from .fit_path import solve_fitted_motion
from .identifiability import describe_half_turn, describe_undetermined_directions
from .noise import describe_uncertain_sigmas
from .parameters import FitPoint, FreeParameters
from .records import Record
from .search_session import BestFit, SearchSession
from .summary import format_fit_summary, format_fit_summary_as_html
from .uncertainty import (
    FitCovariance,
    classify_fit_directions,
    compute_residual_statistics,
    measure_cost_nonlinearity,
)

if TYPE_CHECKING:
    from pandas import DataFrame

    from .._plot.charts import FigureAxes

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
        from .._plot.fit_charts import plot_fit_panels

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
            *map(describe_half_turn, session.half_turns),
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
    for name, columns in (("moments", p.moments), ("damping", p.damping)):
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
