"""The result of a fit: its errors, its summary and the fitted motion."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from html import escape
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from .._core import values as values_of_core
from .._model.scene import Scene
from .._results.path import Path
from .._utils.arguments import (
    Array,
    ReadOnlyArrays,
    as_int,
    as_unit_name,
    get_angular_unit,
    optional_dependency,
)
from .._utils.files import atomic_write
from .._utils.html import format_html_table
from . import rotations
from .parameters import FitPoint, FreeParameters
from .records import MEASURABLE, Record
from .residuals import Minimum, ResidualModel, join_paths, solve_from_start

if TYPE_CHECKING:
    from pandas import DataFrame

    from .._plot.charts import FigureAxes

_CHANCE = 3.0  # standard deviations beyond which a deviation is not chance
_RANK = 1e-9  # smaller singular values are rounding errors, relative to the largest
_LOST = 0.1  # contribution of blind directions from which an error is infinite
_LOST_IF_WEAK = 0.01  # the same if it exceeds the error by the determined directions
_LOST_IF_HIDDEN = 1e-4  # the same for hidden directions if it exceeds `_CHANCE` times that error
_PRESENT = 1e-3  # part of a blind direction that lies in the parameters
_CLIP = 3.0  # standard deviations at which residuals are cut off for their correlation
_FEWEST = 6  # residuals that a correlation needs


@dataclass(frozen=True, eq=False)
class FitCovariance:
    """The covariance of fitted parameters, and the parameter changes that affect no residual.

    natural  (size,) the natural sizes of the parameters, which are the units of the other fields
    factor   (size, k) the matrix F for which F F^T is the covariance on the determined directions
    blind    (size, l) unit vectors along all directions that the data do not determine
    weak     (size, m) the same as `factor` for those of them that affect the residuals a little
    hidden   (size, n) unit vectors along those of them that do not affect any residual
    """

    natural: Array
    factor: Array
    blind: Array
    weak: Array
    hidden: Array

    def propagate_errors(self, gradient: Array) -> tuple[Array, Array]:
        """Return the covariance matrix and standard deviations of k functions from their gradients.

        The standard deviation includes the contribution of one standard deviation along the weak
        directions, and of one natural size along the hidden ones. It is infinite if the function
        depends mainly on them, in proportion to its natural size and to the contribution of the
        determined directions.
        """
        scaled = gradient * self.natural
        parts = [scaled @ part for part in (self.factor, self.weak, self.hidden)]
        own, weak, hidden = (np.linalg.norm(part, axis=1) for part in parts)
        size = np.linalg.norm(scaled, axis=1)
        joined = np.concatenate(parts, axis=1)
        covariance = joined @ joined.T
        errors = np.sqrt(np.diag(covariance))
        is_lost = weak > np.clip(own, _LOST_IF_WEAK * size, _LOST * size)
        is_lost |= hidden > np.clip(_CHANCE * own, _LOST_IF_HIDDEN * size, _LOST * size)
        errors = np.where(is_lost, np.inf, errors)
        covariance[is_lost, :] = covariance[:, is_lost] = np.nan
        covariance[is_lost, is_lost] = np.inf
        return covariance, errors


def classify_fit_directions(best: Minimum, inflation: float) -> FitCovariance:
    """Find the directions in the space of the reported parameters that the data determine.

    A direction counts as undetermined if one standard deviation along it exceeds the typical
    magnitude of the parameters.
    """
    size, natural = best.model.parameters.size, best.model.estimate_parameter_scales(best.point)
    triangle = np.linalg.qr(best.jacobian * natural, mode="r")
    _, values, vectors = np.linalg.svd(triangle)
    values = np.concatenate((values, np.zeros(len(natural) - len(values))))
    is_hidden = values <= _RANK * values[0]
    is_seen = (values > inflation) & ~is_hidden
    is_weak = ~is_seen & ~is_hidden
    factor, weak = (vectors[x].T[:size] * (inflation / values[x]) for x in (is_seen, is_weak))
    spans = []
    for is_blind in (~is_seen, is_hidden):
        # without the components along the starts of later pieces, unit vectors become shorter
        directions, lengths, _ = np.linalg.svd(vectors[is_blind].T[:size], full_matrices=False)
        spans.append(directions[:, lengths > _PRESENT])
    return FitCovariance(natural[:size], factor, spans[0], weak, spans[1])


def compute_residual_statistics(
    best: Minimum, is_sigma_known: bool
) -> tuple[float, int, float, float]:
    """Return chi2, its degrees of freedom, the correlation of neighbours, and the inflation.

    For the soft loss, chi2 is that of the residuals within 3 sigma. The inflation is the factor of
    the standard deviations of the parameters.
    """
    model = best.model
    sample = best.residuals[model.measured]
    dof = max(sample.size - model.parameters.size, 1)
    if model.loss == "linear":
        chi2 = float(sample @ sample)
        factor = chi2 / dof
    else:
        inliers = sample[np.abs(sample) <= _CLIP]
        chi2 = float(inliers @ inliers)
        influence = sample / np.hypot(1.0, sample)
        slope = float(((1.0 + sample**2) ** -1.5).mean())
        factor = float(influence @ influence) / dof / slope**2
    correlations = []
    for rows in model.rows:
        residuals, measured = rows.select_series_residuals(best.residuals), rows.measured_mask
        for k in range(residuals.shape[1]):
            column = np.clip(residuals[measured[:, k], k], -_CLIP, _CLIP)
            if column.size >= _FEWEST and np.ptp(column) > 0.0:
                centred = column - column.mean()
                correlations.append(float(centred[1:] @ centred[:-1] / (centred @ centred)))
    correlation = float(np.mean(correlations)) if correlations else 0.0
    if correlation > _CHANCE / math.sqrt(sample.size):
        factor *= (1.0 + correlation) / max(1.0 - correlation, 1.0 / sample.size)
    chance = 1.0 + _CHANCE * math.sqrt(2.0 / dof) if model.loss == "linear" else 1.0
    if is_sigma_known and not factor > chance:
        factor = 1.0
    return chi2, dof, correlation, math.sqrt(factor)


def measure_cost_nonlinearity(best: Minimum, spectrum: FitCovariance, inflation: float) -> float:
    """Return the relative deviation of chi2 from a quadratic function at one standard deviation.

    The deviation is computed for changes of both signs along the most uncertain direction in
    parameter space, and the larger value is returned. It is 0 for the soft loss and for pieces.
    """
    model, worst = best.model, 0.0
    if not spectrum.factor.size or model.loss == "soft" or len(model.pieces) > 1:
        return worst
    k = int(np.linalg.norm(spectrum.factor, axis=0).argmax())
    step = spectrum.natural * spectrum.factor[:, k]
    distances = model.parameters.compute_distances_to_lower_bounds(best.point)
    for change in (step, -step):
        if (-change > distances).any():
            continue
        trial = model.parameters.add_step_within_bounds(best.point, change)
        residuals, _ = model.evaluate_residuals(trial, has_jacobian=False)
        rise = model.compute_cost(residuals) - best.cost
        worst = max(worst, abs(rise / inflation**2 - 1.0)) if np.isfinite(rise) else np.inf
    return worst


_ALIKE = 0.999  # cosine from which a generator lies in the blind directions
_LARGEST = 4  # components that describe an unknown direction
_SMALL = 0.1  # smaller components are not described
_ROUNDING = 1e-4
_LEVEL = 1e-3  # horizontal part of an angular velocity that a heading turns, relative to its size


def describe_undetermined_directions(
    p: FreeParameters, point: FitPoint, spectrum: FitCovariance
) -> Iterator[str]:
    """Describe each direction in parameter space that the residuals do not determine."""
    natural, blind = spectrum.natural, spectrum.blind
    basis, described, known = blind, np.zeros((p.size, 0)), set()
    for sentence, change in _yield_symmetries(p, point):
        length = float(np.linalg.norm(change / natural))
        if not basis.shape[1] or not length > _ROUNDING**2:
            continue
        unit = change / natural / length
        # A symmetry near to a described one, as of a nearly upright top, needs its own direction.
        rest = unit - described @ (described.T @ unit)
        coords = basis.T @ unit
        is_apart = np.linalg.norm(coords) > max(_ROUNDING, _ALIKE * float(np.linalg.norm(rest)))
        if np.linalg.norm(blind.T @ unit) > _ALIKE and is_apart:
            if sentence not in known:
                yield sentence
            known.add(sentence)
            coords /= np.linalg.norm(coords)
            described = np.column_stack((described, basis @ coords))
            complement = np.linalg.svd(np.eye(len(coords)) - np.outer(coords, coords))[0]
            basis = basis @ complement[:, :-1]
    names, _, _, jacobian = p.list_user_parameters_and_jacobian(point)
    changes = rotations.normalize(jacobian * natural) @ basis
    for direction in (changes / np.linalg.norm(changes, axis=0)).T:
        largest = np.argsort(-np.abs(direction))[:_LARGEST]
        terms = [f"{direction[k]:+.2f} {names[k]}" for k in largest if abs(direction[k]) > _SMALL]
        if len(terms) == 1:
            yield names[int(largest[0])]
        else:
            yield f"a combination of parameters: {' '.join(terms)}, in natural units"


def _yield_symmetries(p: FreeParameters, point: FitPoint) -> Iterator[tuple[str, Array]]:
    """Yield changes of the free parameters that many instruments do not show, and their names."""
    delays = [part for (name, _, _), part in p.slices.items() if name == "delay"]
    for sentence, blocks in _list_symmetries(p, point):
        is_delay = "delay" in blocks
        if blocks.keys() - {"delay"} <= p.places.keys() and len(delays) >= is_delay * len(
            p.records
        ):
            change = np.zeros(p.size)
            for name, value in blocks.items():
                for part in delays if name == "delay" else [p.places[name]]:
                    change[part] = value
            yield sentence, change


def _list_symmetries(
    p: FreeParameters, point: FitPoint
) -> Iterator[tuple[str, dict[str, Array | float]]]:
    """Yield changes of the fields of blocks, all of which must be free, and their names."""
    factors: dict[str, dict[str, Array | float]] = {
        "com": {"com": point.com},
        "lever": {"lever": point.com @ p.columns["lever"]},
        "gravity": {"gravity": point.gravity},
        "mass": {"mass": point.mass},
    }
    if "shaking" in p.places:
        factors["gravity"]["shaking"] = point.shaking * (1.0, 0.0, 0.0)
    sizes = {"damping": point.damping, "friction": np.array([point.friction]), "rotor": point.rotor}
    free = [name for name in sizes if name in p.places]
    if all(name in free or not value.any() for name, value in sizes.items()):
        size: dict[str, Array | float] = {"moments": p.average_tied("moments", point.densities)}
        size |= {name: p.average_tied(name, sizes[name]) for name in free}
        amplitude, pace, _ = point.shaking
        is_heavy = (point.gravity or amplitude * pace) and point.com.any()
        for name in factors if is_heavy else [""]:
            *others, last = dict.fromkeys(filter(None, ("moments", "damping", *free, name)))
            words = f"{', '.join(others)} and {last} have an unknown common factor"
            yield f"the scale of the moments: {words}", size | factors.get(name, {})
    for pair in "gravity com", "gravity lever", "mass com", "mass lever", "gravity mass":
        first, second = pair.split()
        opposite = {name: -value for name, value in factors[second].items()}
        sentence = f"{first} against {second}: only mass * gravity * com counts"
        yield sentence, factors[first] | opposite
    heading = {"attitude": rotations.to_matrix(point.attitude)[2]}
    turning = np.cross([0.0, 0.0, 1.0], point.turning)
    if np.linalg.norm(turning) > _LEVEL * np.linalg.norm(point.turning):
        sentence = "the heading: a rotation of the start and of turning about the vertical"
        yield sentence, {**heading, "turning": turning}
    yield "the heading: a rotation of the start about the vertical", {**heading}
    scene = point.to_scene()
    [acceleration] = values_of_core("body_acceleration", scene._block, scene._start_state)
    shift = {"attitude": point.rate, "velocity": acceleration, "delay": 1.0}
    if "shaking" in p.places:
        shift["shaking"] = np.array([0.0, 0.0, point.shaking[1]])
    yield "the delay against the start: a shift in time", shift


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
    _begins: tuple[float, ...]

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
        times = self._point.subtract_delays([record.t for record in self.records])
        t = np.unique(np.concatenate(times))
        owner = np.maximum(np.searchsorted(self._begins, t, side="right") - 1, 0)
        states = []
        for k, begin in enumerate(self._begins):
            if (owner == k).any():
                own = self._point.at_piece(k) if begin else self._point
                scene = self._parameters.to_scene(own, begin)
                paths = solve_from_start(scene, t[owner == k] - begin)
                states.append(join_paths(paths, "states"))
                states[-1][:, 0] += begin
        if not self.piece_starts and t[0] >= 0.0:
            return paths[0]
        return Path(self.scene, np.concatenate(states), paths[0].stats, paths[0]._options)

    @property
    def piece_starts(self) -> tuple[float, ...]:
        """The times at which the pieces of the motion begin; empty for a single motion."""
        return self._begins if len(self._begins) > 1 else ()

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

    def scatter(self, n: int, *, seed: int = 0) -> Scene:
        """Return an ensemble of n random scenes, drawn with the covariance of the fit.

        The random scenes vary only in those directions of parameter space that the data determine.
        Moments of inertia, damping and friction are clipped to their bounds.
        """
        count, key, p = as_int("n", n, 1), as_int("seed", seed, 0), self._parameters
        natural, factor = self._spectrum.natural, self._spectrum.factor
        normal = np.random.default_rng(key).standard_normal((count, factor.shape[1]))
        steps = normal @ factor.T * natural
        points = [p.add_step_within_bounds(self._point, step) for step in steps]
        return Scene.stack([p.to_scene(point) for point in points])

    def plot(self, *, time_unit: str = "T") -> FigureAxes:
        """Plot measurements, fitted motion and residuals with matplotlib, and return the axes.

        For each quantity, one chart shows the measurements and the fitted motion, and another chart
        shows the residuals. The line of the motion is computed between the measurements as well. If
        the motion has hundreds of turns, black dots show it at the times of the measurements. For
        attitudes, only the measurements are drawn. To save the figure to a file, call
        `fit.plot().figure.savefig("fit.png")`. The labels name the unit of time `time_unit`, and
        radians or degrees as in the record.

        Raises ImportError if matplotlib is not installed.
        """
        from .._plot.charts import plot_fit_panels

        unit = as_unit_name("time_unit", time_unit)
        panels, motions = [], self._predict_measurements_densely()
        for i, record in enumerate(self.records):
            for series in record.series:
                name, known = series.name, MEASURABLE[series.quantity]
                panel = SimpleNamespace(name=name, t=record.t, motion=motions.get((i, name)))
                panel.components = [name] if series.part is not None else known.components
                panel.dimension = get_angular_unit(known.dimension, series.unit != 1.0)
                panel.values = np.where(series.measured, series.values / series.unit, np.nan)
                shape = len(record.t), series.residuals_per_row
                panel.residuals = self.residuals[i][name].reshape(shape)
                panel.sigma = self.sigma[i][name]
                panels.append(panel)
        return plot_fit_panels(panels, unit)

    def _predict_measurements_densely(self) -> dict[tuple[int, str], tuple[Array, Array]]:
        """Return {(record, quantity): (times, values)}, dense enough to be joined by lines.

        A line is interrupted by NaN where an angle jumps and between the pieces of the motion. A
        quantity is missing if it is an attitude, or if the motion has too many turns for a line.
        """
        from .._plot.charts import compute_duration_of_turn, insert_gaps, subdivide_times

        turn, dense = compute_duration_of_turn(self.scene, is_seen_from_body=True), []
        for record in self.records:
            times, sampled = subdivide_times(record.t, turn), []
            for series in record.series:
                rows = np.flatnonzero(series.measured.any(axis=1))
                if times is not None and not series.is_attitude and rows.size:
                    # the residuals of angles refer to the turn of the nearest measurement
                    places = np.interp(times, record.t[rows], np.arange(len(rows)))
                    values = series.values[rows[np.rint(places).astype(int)]]
                    mask = np.ones(values.shape, bool)
                    sampled.append(series._replace(values=values, measured=mask, sigma=None))
            dense.append(record._replace(record.t[:0] if times is None else times, sampled))
        if not any(record.series for record in dense):
            return {}
        sigmas = [np.ones_like(series.values) for record in dense for series in record.series]
        model = ResidualModel(self._parameters, dense, sigmas, "linear", self._begins)
        residuals, _ = model.evaluate_residuals(self._point, has_jacobian=False)
        lines = {}
        for one in model.rows:
            series, t = one.series, dense[one.record].t
            values = (series.values + one.select_series_residuals(residuals)) / series.unit
            is_jump = np.diff(np.searchsorted(self._begins, t, side="right")) > 0
            if series.is_angle:
                is_jump |= (np.abs(np.diff(values, axis=0)) > np.pi / series.unit).any(axis=1)
            lines[one.record, series.name] = insert_gaps(t, values, is_jump)
        return lines

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
        ties = ", ".join(name for name in self.names if " = " in name)
        lists = {
            "Not identified": self.unidentified,
            "Ambiguous": self.ambiguous,
            "Uncertain": self.uncertain_sigma,
            "At a bound": self.at_bound,
        }
        missing, is_enlarged = sum(r.missing for r in self.records), self.inflation > _ENLARGED
        sentences: dict[str, object] = {
            "The search did not converge; this is the best so far.": not self.has_converged,
            self._describe_misfit() or self._describe_excess(): True,
            f"Kept equal, as in the given scene: {ties}. Give different numbers to estimate them "
            "apart.": ties,
            **{f"{label}: {text}.": True for label, texts in lists.items() for text in texts},
            f"Neighbouring residuals are correlated ({self.residual_correlation:.2f}): the model "
            "does not include all forces on the top.": is_enlarged
            and self.residual_correlation > _CORRELATED,
            f"Errors were enlarged {self.inflation:.3g} times, because residuals are large or "
            "correlated.": is_enlarged,
            "Errors are not normally distributed: along the least certain direction, the change of "
            f"chi2 for one sigma differs from 1 by {self.nonlinearity:.2g}.": self.nonlinearity
            > _NONLINEAR,
            f"{missing} values are left out: not measured, or undefined angles.": missing,
            f"The motion consists of {len(self._begins)} joined pieces, each with its own start.": (
                self.piece_starts
            ),
        }
        return head, rows, [text for text, is_said in sentences.items() if text and is_said]

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


def describe_reached_bounds(
    p: FreeParameters, point: FitPoint, natural: Array, names: list[str]
) -> Iterator[str]:
    """Yield one sentence for each density, damping or friction parameter that is zero."""
    distances = p.compute_distances_to_lower_bounds(point)
    for k in np.flatnonzero(distances <= _AT_BOUND * natural):
        name = next(name for (name, *_), part in p.slices.items() if part.start <= k < part.stop)
        if name != "moments":
            yield f"{names[k]} is zero: negative {name} is excluded"
        elif " = " in names[k]:
            yield "the body is a rod: one moment is zero"
        else:
            first, second = sorted({"I1", "I2", "I3"} - {names[k]})
            yield (
                f"{names[k]} = {first} + {second}: the body is a plate normal to axis "
                f"{names[k][1:]}, or flatter than any rigid body"
            )
