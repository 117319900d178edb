"""The result of a fit, its summary and the fitted motion."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from html import escape
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from .._model.scene import Ensemble, Scene
from .._plot.dense_motion import compute_duration_of_turn, subdivide_times
from .._results.path import Path
from .._solve.solve import solve
from .._utils.arguments import Array, ReadOnlyArrays, as_int, freeze_arrays, optional_dependency
from .._utils.files import atomic_write
from .._utils.html import format_html_table
from .minimize import describe_uncertain_sigmas
from .parameters import FitPoint, FreeParameters
from .records import Record, slice_record
from .residuals import ResidualModel
from .search import FEW_PER_TURN, SearchSession
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

_DIFFERENCE = 1e-5  # steps of numerical derivatives, relative to the natural sizes
_AT_BOUND = 1e-6  # distance to a bound that counts as zero, relative to the natural size
_MISFIT = 100.0  # chi2 per degree of freedom from which the model is wrong
_AS_LARGE = 0.5  # residuals relative to the values that no motion explains
_CORRELATED = 0.2  # correlation of neighbouring residuals that is mentioned
_ENLARGED = 1.05  # inflation that is mentioned
_NONLINEAR = 0.3  # deviation from a quadratic chi2 that is mentioned


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
        begins = np.array([begin for begin, _ in self._pieces])
        owner = np.maximum(np.searchsorted(begins, t, side="right") - 1, 0)
        states, path = [], solve(self.scene, np.empty(0), "taylor")
        for k, (begin, point) in enumerate(self._pieces):
            own = t[owner == k] - begin
            for part, order in ((own[own < 0.0][::-1], -1), (own[own >= 0.0], 1)):
                if len(part):
                    path = solve(self._parameters.to_scene(point, begin), part, "taylor")
                    states.append(path.states[::order].copy())
                    states[-1][:, 0] += begin
        if len(states) == 1 and not self.piece_starts and path.t[0] >= 0.0:
            return path
        joined = np.ascontiguousarray(np.concatenate(states))
        return Path(self.scene, joined, path.stats, path._options)

    @property
    def piece_starts(self) -> tuple[float, ...]:
        """The times at which the pieces of the motion begin; empty for a single motion."""
        return tuple(begin for begin, _ in self._pieces) if len(self._pieces) > 1 else ()

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
        p, point = self._parameters, self._point
        value, columns = _convert_to_float_array(function(self.scene)), []
        distances = p.compute_distances_to_lower_bounds(point)
        for step, distance in zip(
            np.diag(_DIFFERENCE * self._spectrum.natural), distances, strict=True
        ):
            size = step.sum()
            upper, lower = (
                _convert_to_float_array(function(p.to_scene(p.add_step_within_bounds(point, end))))
                for end in (step, -step)
            )
            columns.append((upper - lower).ravel() / (size * (1.0 + min(1.0, distance / size))))
        _, errors = self._spectrum.propagate_errors(np.stack(columns, axis=-1))
        error_array = errors.reshape(value.shape)
        return (value, error_array) if value.ndim else (float(value), float(error_array))

    def scatter(self, n: int, *, seed: int = 0) -> Ensemble:
        """Return an ensemble of n random scenes, drawn with the covariance of the fit.

        The random scenes vary only in those directions of parameter space that the data determine.
        Moments of inertia, damping and friction are clipped to their bounds.
        """
        count, key, p = as_int("n", n, 1), as_int("seed", seed, 0), self._parameters
        steps = self._spectrum.draw_random_parameter_changes(np.random.default_rng(key), count)
        points = [p.add_step_within_bounds(self._point, step) for step in steps]
        return Ensemble.of([p.to_scene(point) for point in points])

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

        motions = _predict_measurements_densely(self._parameters, self._pieces, self.records)
        panels = []
        for i, record in enumerate(self.records):
            for series in record.series:
                values = np.where(series.measured, series.values / series.unit, np.nan)
                residuals, sigma = self.residuals[i][series.name], self.sigma[i][series.name]
                rows = residuals.reshape(len(record.t), series.residuals_per_row)
                motion = motions[i].get(series.name)
                panels.append(_Panel(series.name, record.t, values, rows, sigma, motion))
        return plot_fit_panels(panels)

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
        """Return the summary: a row for each parameter, then sentences about the quality."""
        head, rows, sentences = self._summarize()
        width = max(len(name) for name, *_ in rows)
        lines = [f"  {name:<{width}}  {value} {unit}".rstrip() for name, value, unit in rows]
        return "\n".join([head, *lines, *sentences])

    def _repr_html_(self) -> str:
        """Return the summary as HTML, with a table of the parameters, for display in notebooks."""
        head, rows, sentences = self._summarize()
        first, *others = [f"<p>{escape(text)}</p>" for text in (head, *sentences)]
        return "\n".join([first, format_html_table(rows, ("parameter", "value", "unit")), *others])

    def _summarize(self) -> tuple[str, list[tuple[str, str, str]], list[str]]:
        """Return the head of the summary, rows (name, value +- error, unit), and sentences."""
        verdict = {True: " (plausible)", False: " (not plausible)", None: ""}[self.is_plausible]
        head = (
            f"Fit of {len(self.names)} parameters to {sum(r.size for r in self.records)} numbers: "
            f"chi2 {self.chi2 / self.dof:.3g} per degree of freedom{verdict}, "
            f"{self.evaluations} paths"
        )
        rows = [
            (name, _format_with_error(self.values[name], self.error[name]), unit and f"[{unit}]")
            for name, unit in zip(self.names, self.units, strict=True)
        ]
        if not all(map(math.isfinite, self.error.values())):
            ratios = self.moment_ratios.items()
            rows += [(name, _format_with_error(*pair), "") for name, pair in ratios]
        sentences = []
        if not self.has_converged:
            sentences.append("The search did not converge; this is the best so far.")
        if text := self._describe_misfit() or self._describe_excess():
            sentences.append(text)
        if ties := [name for name in self.names if " = " in name]:
            sentences.append(
                f"Kept equal, as in the given scene: {', '.join(ties)}. Give different numbers to "
                "estimate them apart."
            )
        for label, texts in (
            ("Not identified", self.unidentified),
            ("Ambiguous", self.ambiguous),
            ("Uncertain", self.uncertain_sigma),
            ("At a bound", self.at_bound),
        ):
            sentences += [f"{label}: {text}." for text in texts]
        if self.residual_correlation > _CORRELATED and self.inflation > _ENLARGED:
            sentences.append(
                f"Neighbouring residuals are correlated ({self.residual_correlation:.2f}): the "
                "model does not include all forces on the top."
            )
        if self.inflation > _ENLARGED:
            sentences.append(
                f"Errors were enlarged {self.inflation:.3g} times, because residuals are large or "
                "correlated."
            )
        if self.nonlinearity > _NONLINEAR:
            sentences.append(
                "Errors are not normally distributed: along the least certain direction, the "
                f"change of chi2 for one sigma differs from 1 by {self.nonlinearity:.2g}."
            )
        if missing := sum(record.missing for record in self.records):
            sentences.append(f"{missing} values are left out: not measured, or undefined angles.")
        if self.piece_starts:
            sentences.append(
                f"The motion consists of {len(self.piece_starts)} joined pieces, each with its own "
                "start."
            )
        return head, rows, sentences

    def _describe_misfit(self) -> str:
        """Return a sentence if the residuals are as large as the values and exceed the noise."""
        is_large = self.is_plausible is None or self.chi2 > _MISFIT * self.dof
        if not (is_large and self.misfit > _AS_LARGE):
            return ""
        return (
            "No motion of this scene fits the records: the residuals are "
            f"{100.0 * self.misfit:.0f} % of the values, or of 1 rad for angles."
        )

    def _describe_excess(self) -> str:
        if not self.excess:
            return ""
        return (
            f"The residuals are {self.excess:.3g} times as large as sigma explains: the fit is a "
            "false minimum, the records are of another top, or sigma is too small."
        )

    def __repr__(self) -> str:
        ratio = self.chi2 / self.dof
        blind = f", {len(self.unidentified)} unidentified" if self.unidentified else ""
        convergence = "" if self.has_converged else ", not converged"
        return (
            f"<kreisel.Fit: {len(self.names)} parameters{blind}, chi2 {ratio:.3g} per degree of "
            f"freedom, {self.evaluations} paths{convergence}>"
        )


class _Panel(NamedTuple):
    """The measurements, residuals and fitted motion of one quantity, for a chart."""

    name: str
    t: Array
    values: Array
    residuals: Array
    sigma: Array
    motion: tuple[Array, Array] | None


def _convert_to_float_array(value: ArrayLike) -> Array:
    numbers = np.asarray(value)
    if numbers.dtype.kind not in "iuf":
        raise TypeError(f"function must return numbers, not {type(value).__name__}")
    return numbers.astype(float)


def _format_with_error(value: float, error: float) -> str:
    """Return a value and its error as text, with as many digits as are significant."""
    if not math.isfinite(error):
        return "not identified"
    if not error > 0.0:
        return f"{value:.12g} +- {error:.2g}"
    size = max(abs(value), error)
    digits = min(max(2 + math.floor(math.log10(size)) - math.floor(math.log10(error)), 2), 17)
    return f"{value:#.{digits}g} +- {error:.2g}"


def build_fit_from_search(session: SearchSession) -> Fit:
    best, p, loss, model = session.best, session.parameters, session.loss, session.model
    assert best is not None
    stats = compute_residual_statistics(model, best.residuals, loss, session.is_sigma_known)
    spectrum = classify_fit_directions(best.jacobian, best.natural, stats.inflation, p.size)
    names, units, values, jacobian = p.list_user_parameters_and_jacobian(best.point)
    covariance, errors = spectrum.propagate_errors(jacobian)
    residuals: tuple[dict[str, Array], ...] = tuple({} for _ in session.records)
    sigma: tuple[dict[str, Array], ...] = tuple({} for _ in session.records)
    for rows in model.rows:
        mask, name = rows.measured_mask, rows.series.name
        own = np.where(mask, rows.select_series_residuals(best.residuals), np.nan)
        residuals[rows.record][name] = own[:, 0] if own.shape[1] == 1 else own
        deviation = np.where(mask, rows.sigma / rows.series.unit, np.nan)
        known = deviation[mask]
        is_constant = known.size > 0 and bool((known == known[0]).all())
        sigma[rows.record][name] = known[0] if is_constant else deviation
    freeze_arrays((covariance, residuals, sigma))
    ratios = {}
    if p.can_vary("moments"):
        *others, last = range(p.size)[p.get_parameter_slice("moments")]
        for k in others:
            ratio = values[k] / values[last]
            gradient = (jacobian[k] - ratio * jacobian[last]) / values[last]
            _, [error] = spectrum.propagate_errors(gradient[None])
            ratios[f"{names[k]} / {names[last]}"] = (float(ratio), float(error))
    nonlinearity = 0.0
    if not best.pieces and loss == "linear":
        optimum = model, best.point, best.residuals
        nonlinearity = measure_cost_nonlinearity(*optimum, spectrum, stats.inflation)
    unidentified = describe_undetermined_directions(
        p, best.point, spectrum.natural, spectrum.blind, names
    )
    ambiguous = []
    if session.alias is not None:
        speed, other = (float(np.linalg.norm(one.rate)) for one in (best.point, session.alias))
        ambiguous.append(
            f"the spin: the records have fewer than {FEW_PER_TURN:g} samples per turn, and the "
            f"angular velocity {other:.4g} instead of {speed:.4g} fits equally well"
        )
    if session.rival is not None:
        words, _, numbers, _ = p.list_user_parameters_and_jacobian(session.rival)
        pairs = [f"{name} = {x:.4g}" for name, x in zip(words, numbers, strict=True)]
        ambiguous.append(f"the motion: another one fits equally well, with {', '.join(pairs)}")
    return Fit(
        scene=p.to_scene(best.point),
        records=session.records,
        names=tuple(names),
        units=tuple(units),
        values=dict(zip(names, map(float, values), strict=True)),
        error=dict(zip(names, map(float, errors), strict=True)),
        moment_ratios=ratios,
        covariance=covariance,
        residuals=residuals,
        sigma=sigma,
        chi2=stats.chi2,
        dof=stats.dof,
        residual_correlation=stats.correlation,
        inflation=stats.inflation,
        nonlinearity=nonlinearity,
        unidentified=(
            *unidentified,
            *(
                f"a half turn of the body, with its com and its start, about principal axis {k + 1}"
                for k in session.half_turns
            ),
        ),
        ambiguous=tuple(ambiguous),
        misfit=session.measure_relative_misfit(),
        excess=session.measure_residual_excess(),
        uncertain_sigma=describe_uncertain_sigmas(model, best.scaled_jacobian),
        at_bound=tuple(_describe_reached_bounds(p, best.point, best.natural, names)),
        has_converged=best.has_converged,
        evaluations=session.evaluations + model.evaluations,
        cost=best.cost,
        _parameters=p,
        _point=best.point,
        _spectrum=spectrum,
        _pieces=best.pieces or ((0.0, best.point),),
    )


def _describe_reached_bounds(
    p: FreeParameters, point: FitPoint, natural: Array, names: list[str]
) -> Iterator[str]:
    """Yield one sentence for each density, damping or friction parameter that is zero."""
    distances = p.compute_distances_to_lower_bounds(point)
    for k in np.flatnonzero(distances <= _AT_BOUND * natural[: p.size]):
        name = next(name for (name, *_), part in p.slices.items() if part.start <= k < part.stop)
        if name != "moments":
            yield f"{names[k]} is zero: negative {name} is excluded"
        elif " = " in names[k]:
            yield "the body is a rod: one moment is zero"
        else:
            first, second = {"I1", "I2", "I3"} - {names[k]}
            first, second = sorted((first, second))
            yield (
                f"{names[k]} = {first} + {second}: the body is a plate normal to axis "
                f"{names[k][1:]}, or flatter than any rigid body"
            )


def _predict_measurements_densely(
    parameters: FreeParameters,
    pieces: Sequence[tuple[float, FitPoint]],
    records: Sequence[Record],
) -> list[dict[str, tuple[Array, Array]]]:
    """Return for each record {quantity: (times, values)}, dense enough to be joined by lines.

    A line is interrupted by NaN where an angle jumps and between the pieces of the motion. A
    quantity is missing if it is an attitude, or if the motion has too many turns for a line.
    """
    turn = compute_duration_of_turn(parameters.to_scene(pieces[0][1]), is_seen_from_body=True)
    dense = [_sample_record(record, turn) for record in records]
    lines: list[dict[str, tuple[Array, Array]]] = [{} for _ in records]
    begins = np.array([begin for begin, _ in pieces])
    for k, (begin, point) in enumerate(pieces):
        edges = [begin if k else -np.inf, *begins[k + 1 : k + 2], np.inf][:2]
        places = [np.searchsorted(record.t, edges) for record in dense]
        parts = [
            slice_record(record, int(first), int(last), begin)
            for record, (first, last) in zip(dense, places, strict=True)
        ]
        if not any(part.series for part in parts):
            break
        sigmas = [np.ones_like(series.values) for part in parts for series in part.series]
        model = ResidualModel(parameters, parts, sigmas, origin=begin)
        residuals = model.evaluate_residuals(point, has_jacobian=False).residuals
        for rows in model.rows:
            series, t = rows.series, parts[rows.record].t + begin
            values = (series.values + rows.select_series_residuals(residuals)) / series.unit
            jump = np.pi / series.unit if series.is_angle else np.inf
            gaps = np.flatnonzero((np.abs(np.diff(values, axis=0)) > jump).any(axis=1)) + 1
            gaps = np.append(gaps, len(t))
            line = np.insert(t, gaps, np.nan), np.insert(values, gaps, np.nan, axis=0)
            begun = lines[rows.record].get(series.name, (t[:0], values[:0]))
            t, values = (np.concatenate(pair) for pair in zip(begun, line, strict=True))
            lines[rows.record][series.name] = t, values
    return lines


def _sample_record(record: Record, turn: float) -> Record:
    """Return a record at dense times, with the values measured nearest to each time.

    The residuals of angles refer to the nearest turn of these values. The record has no series if
    too many times would be needed.
    """
    times, sampled = subdivide_times(record.t, turn), []
    for series in record.series:
        rows = np.flatnonzero(series.measured.any(axis=1))
        if times is not None and not series.is_attitude and rows.size:
            t = record.t[rows]
            near = rows[np.rint(np.interp(times, t, np.arange(len(rows)))).astype(int)]
            values = series.values[near]
            mask = np.ones(values.shape, bool)
            sampled.append(series._replace(values=values, measured=mask, sigma=None))
    return record._replace(record.t[:0] if times is None else times, sampled)
