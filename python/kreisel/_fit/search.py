"""The search for the best minimum of a fit."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import islice
from typing import Any, NamedTuple

import numpy as np

from .._results.results import Error
from .._solve.solve import solve
from .._utils.arguments import Array
from .guess import Guess, guess_parameters_from_records, reconstruct_motions, yield_random_starts
from .minimize import (
    MEDIAN,
    LossName,
    Minimum,
    SearchSettings,
    compute_cost,
    estimate_initial_sigmas,
    estimate_sigmas_from_residuals,
    minimize_cost,
)
from .parameters import (
    FitPoint,
    FreeParameters,
    compute_rotation_quaternions,
    multiply_quaternions,
    rotation_matrix,
)
from .records import Record, slice_record
from .residuals import STEPS_MOST, ResidualModel, find_time_of_large_residuals
from .shooting import (
    Segments,
    ShootingModel,
    choose_segment_count,
    fits_with_gaps,
    minimize_by_multiple_shooting,
)
from .uncertainty import classify_fit_directions, compute_largest_reduced_chi2

FEW_PER_TURN = 4.0  # samples per turn from which an angular velocity is determined


def list_spin_aliases_of_point(
    parameters: FreeParameters, point: FitPoint, records: Sequence[Record]
) -> list[FitPoint]:
    """Return parameters whose motion differs by one full turn between successive measurements.

    Returns an empty list if the body rotates so slowly that the measurements resolve every turn. If
    the measurements contain fewer than two samples per turn of the body, the returned list also
    contains a faster rotation in the same direction. If the moments of inertia are free parameters,
    the list also contains motions with another moment of inertia but the same angular momentum.
    """
    pauses = [np.diff(np.unique(record.t)) for record in records]
    interval = min((float(np.median(p)) for p in pauses if p.size), default=0.0)
    if not (interval > 0.0 and parameters.can_vary("velocity")):
        return []
    turn, aliases = 2.0 * np.pi / interval, []
    speed, columns = float(np.linalg.norm(point.rate)), parameters.columns["moments"]
    spins = [
        (point.rate / (speed or 1.0), speed),
        *zip(np.eye(3), point.rate.tolist(), strict=True),
    ]
    for axis, rate in spins:
        if abs(rate) <= turn / FEW_PER_TURN:
            continue
        others = [rate - math.copysign(turn, rate)]
        if abs(rate) > 0.5 * turn:
            others.append(2.0 * rate - others[0])
        k = int(np.abs(axis).argmax())
        is_principal = abs(axis[k]) == 1.0 and columns[:, columns[k].argmax()].sum() == 1.0
        for other in others:
            alias = replace(point, rate=point.rate + (other - rate) * axis)
            aliases.append(alias)
            if parameters.can_vary("moments") and is_principal and other and rate / other > 0.0:
                moments = alias.moments.copy()
                moments[k] *= rate / other
                densities = 0.5 * moments.sum() - moments
                aliases += [replace(alias, densities=densities)] if densities.min() >= 0.0 else []
    return aliases


_FTOL = 1e-10  # relative improvement of the cost that ends a search
_ROUGH_FTOL = 1e-3  # the same for a part of the records
_ROUGH_LIMIT = 12  # evaluations for a part of the records
_GROWTH = 1.4  # least factor from one part of the records to the next
_PARTS_MOST = 40
_UNSTABLE = 8  # pieces from which a motion that disagrees is searched in pieces
_CHAOTIC = 28  # pieces from which errors grow more than a millionfold
_STARTS_COMPARED = 16  # random initial states, from the nearest of which a search begins
_STARTS_AGREE = 3  # starts that reach the best minimum again, after which it counts as the only one
_PIECES_TRIED = 8  # pieces of a part of the records that must fit before many more are tried
_FITS = 3.0  # largest chi2 per degree of freedom of a motion that needs no pieces
_CHANCE = 3.0  # standard deviations of chi2 up to which a fit needs no other guess
_PLAUSIBLE = 1.3  # chi2 per degree of freedom from the median with a tenth of outliers
_MEDIAN_SPREAD = 2.34  # its standard deviation for one normally distributed residual
_ROUGHLY = 1.5  # largest chi2 per degree of freedom of a good fit if sigma is estimated
_FAR = 100.0  # longest time before the first measurement, relative to the length of the records
_SAME_MOMENTS = 1e-3  # relative difference of moments of the same motion
_SAME = 1e-6  # relative difference of equal costs
_BLIND_TO_SIGN = {"body_velocity", "inertial_velocity", "body_acceleration"}
_BLIND_TO_SIGN |= {"body_momentum", "kinetic"}
_ROUNDS = 6  # estimates of unknown standard deviations
_SIGMA_RTOL = 0.01  # change of a standard deviation that needs another round
_RELATED = 1e4  # chi2 per degree of freedom up to which another spin may be the right one
_ALIAS_LIMIT = 25  # evaluations for another spin
_ALIAS_FTOL = 1e-6
_AS_WELL = 9.0  # rise of chi2 up to which another motion fits as well, three standard deviations
_INSENSITIVE = 1e-9  # a series that changes less, relative to its spread, tells nothing


class BestFit(NamedTuple):
    """The best fit so far.

    point      the parameters
    residuals  (n,) of the records
    jacobian   (m, k) of the residuals and of the gaps; its first columns are the parameters
    natural    (k,) natural sizes of the columns
    pieces     ((begin, point), ...) of a motion in pieces, or empty
    """

    point: FitPoint
    residuals: Array
    jacobian: Array
    natural: Array
    cost: float
    has_converged: bool
    pieces: tuple[tuple[float, FitPoint], ...] = ()

    @property
    def scaled_jacobian(self) -> Array:
        scaled: Array = self.jacobian * self.natural
        return scaled


class SearchSession:
    """A search for the best fit, starting from one scene.

    model  the residuals of all records
    best   the best solution so far, or None
    """

    def __init__(
        self,
        parameters: FreeParameters,
        records: tuple[Record, ...],
        loss: LossName,
        limit: int,
        progress: Callable[[int, float], object] | None,
    ) -> None:
        self.parameters, self.records, self.loss = parameters, records, loss
        self.limit, self.progress = limit, progress
        self.is_sigma_known = all(s.sigma is not None for r in records for s in r.series)
        self.model = ResidualModel(parameters, records, estimate_initial_sigmas(records))
        self.best: BestFit | None = None
        self.alias: FitPoint | None = None  # another start that fits as well
        self.rival: FitPoint | None = None  # another motion that fits as well
        self.half_turns: list[int] = []  # principal axes of half turns that fit as well
        self.evaluations = 0  # of parts, of pieces and of former models
        self._piece_count = 0  # the number of pieces of the last search in pieces
        self._end = max(float(np.abs(record.t).max()) for record in records)

    @property
    def dof(self) -> int:
        return max(int(self.model.measured.sum()) - self.parameters.size, 1)

    @property
    def sigmas(self) -> list[Array]:
        return [rows.sigma for rows in self.model.rows]

    def check_start_scene_is_solvable(self) -> None:
        times = np.unique(np.concatenate([record.t for record in self.records]))
        for t in (times[times < 0.0][::-1], times[times >= 0.0]):
            solve(self.parameters.start.to_scene(), t, "taylor", max_steps=STEPS_MOST)

    def refuse_start_held_by_friction(self) -> None:
        """Raise ValueError if no motion fits and friction holds the top in its initial state.

        Many different motions end in a state in which friction holds the top.
        """
        if self._has_small_misfit() or not self.parameters.start.friction:
            return
        try:
            self.check_start_scene_is_solvable()
        except Error as error:
            if error.status == "ERR_STOPPED":
                raise ValueError(
                    "the records begin before the start at t = 0, where friction holds the top, "
                    "and many motions lead there: subtract the first time from t"
                ) from None

    def refuse_too_few_measurements(self, pieces: int | None) -> None:
        times = np.concatenate([record.t for record in self.records])
        first, span = float(np.abs(times).min()), float(np.ptp(times))
        if first > _FAR * span > 0.0:
            raise ValueError(
                f"the records begin at t = {first:g}, long after the start at t = 0, and last only "
                f"{span:g}: subtract the first time from t"
            )
        count = sum(record.size for record in self.records)
        if count < self.parameters.size:
            raise ValueError(
                f"the records have {count} numbers, fewer than the {self.parameters.size} free "
                "parameters: add measurements, or remove names from free"
            )
        if count == self.parameters.size and not self.is_sigma_known:
            raise ValueError(
                f"the records have {count} numbers, as many as free parameters, so that sigma "
                "cannot be estimated: give sigma, add measurements, or remove names from free"
            )
        most = max(len(np.unique(times)) // 2, 1)
        if pieces is not None and pieces > most:
            raise ValueError(
                f"pieces must be at most {most}, one for two times of the records, not {pieces}"
            )

    def search(self, pieces: int | None, has_data_guess: bool) -> None:
        base = Guess(self.parameters.start, None)
        is_single = pieces is None or pieces == 1
        agreement, _ = self._find_match_end_and_cost(base.point)
        is_done = is_single and (agreement >= self._end or not has_data_guess)
        if is_done:
            self._search_from_point(base.point, agreement)
        if not self._has_good_fit() and (has_data_guess or not is_single):
            guesses = guess_parameters_from_records(self.parameters, self.records)
            guesses = guesses if has_data_guess else [g._replace(point=base.point) for g in guesses]
            if pieces is None:
                self._try_multiple_shooting(guesses, None, _CHAOTIC)
            if is_single and not self._has_small_misfit():
                ranked = self._rank_guesses(guesses if is_done else [*guesses, base])
                for end, _, guess in ranked:
                    if not self._has_good_fit():
                        self._search_from_point(guess.point, end)
                if ranked and self.loss == "soft":  # outliers look like disagreement
                    _, _, nearest = min(ranked, key=lambda entry: entry[1])
                    self._search_from_point(nearest.point, self._end)
                if ranked and not self._is_plausible():
                    # noise biases the moments of guesses, and so their frequencies
                    body = ("densities", "com", "damping", "friction")
                    fields: dict[str, Any] = {name: getattr(base.point, name) for name in body}
                    self._search_from_point(replace(ranked[0][2].point, **fields), 0.0)
            if pieces is None and not self._has_small_misfit():
                self._try_multiple_shooting(guesses, None, _UNSTABLE)
            elif not is_single:
                ranked = self._rank_guesses([] if agreement >= self._end else guesses)
                self._try_multiple_shooting([guess for _, _, guess in ranked], pieces, 2)
        has_attitudes = any(series.is_attitude for r in self.records for series in r.series)
        if is_single and has_data_guess and self.best is not None and not has_attitudes:
            is_known = is_done or bool(reconstruct_motions(self.records, base.point))
            can_differ = self.parameters.can_vary("moments")
            self._search_from_random_starts(has_rivals=can_differ and not is_known)
        best = self.best
        if pieces is None and best is not None and self._has_small_misfit() and not best.pieces:
            count = choose_segment_count(best.point, self.records)
            if count >= _CHAOTIC:  # too chaotic to fit the motion from one start
                model = ShootingModel(self.parameters, self.records, self.sigmas, count)
                begin = model.build_segment_starts(best.point)
                self._fit_by_multiple_shooting(model, begin, np.inf)
        self._choose_equivalent_nearest_to_scene()
        self._refine_with_estimated_sigmas()
        self._try_alternative_spins()

    def _search_from_random_starts(self, has_rivals: bool) -> None:
        """Search from random initial states until noise explains the residuals.

        If several starts reach the best minimum, it is the global one, and the model is not exact.
        With `has_rivals`, other motions may fit as well, and the search goes on until the best
        minimum is reached again or another motion that fits as well is found. Of two motions that
        fit equally, the farther one from the scene is the rival.
        """
        distance = self.parameters.measure_distance_from_start
        count, starts = 0, yield_random_starts(self.parameters, self.records)
        while count < _STARTS_AGREE and self._remaining_evaluations:
            if self._is_plausible() and (not has_rivals or self.rival is not None):
                return
            old = self.best
            guesses = [Guess(point, None) for point in islice(starts, _STARTS_COMPARED)]
            agreement, _, guess = self._rank_guesses(guesses)[0]
            minimum = self._search_from_point(guess.point, agreement)
            if old is None:
                continue
            found, cost = minimum.point, minimum.cost
            rise = _AS_WELL * max(min(old.cost, cost) / self.dof, 1.0)
            is_equal = abs(cost - old.cost) <= _SAME * max(old.cost, 1.0)
            has_same_moments = np.allclose(found.moments, old.point.moments, _SAME_MOMENTS, 0.0)
            if is_equal and has_same_moments:
                count += 1
            elif minimum.has_converged and abs(cost - old.cost) < rise:
                assert self.best is not None
                if is_equal and distance(found) < distance(old.point):
                    self._try_equivalent(found)
                self.rival = old.point if self.best.point is not old.point else found
            elif cost < old.cost:
                count, self.rival = 0, None

    def _compute_best_reduced_chi2(self) -> float:
        """Return chi2 per degree of freedom (a median-based estimate for the soft loss)."""
        if self.best is None:
            return np.inf
        if self.loss == "linear":
            return self.best.cost / self.dof
        residuals = np.abs(self.best.residuals[self.model.measured])
        return float(MEDIAN * np.median(residuals)) ** 2

    def _has_small_misfit(self) -> bool:
        return self._compute_best_reduced_chi2() <= _FITS

    def _has_good_fit(self) -> bool:
        """Return True if noise explains the residuals, and a wrong motion cannot do so.

        For the soft loss, a wrong motion can agree with most measurements.
        """
        return self.loss == "linear" and self._is_plausible()

    def _is_plausible(self) -> bool:
        """Return True if noise and, for the soft loss, a few outliers can explain the residuals."""
        limit = compute_largest_reduced_chi2(self.dof) if self.is_sigma_known else _ROUGHLY
        if self.loss == "soft":
            limit = _PLAUSIBLE + _CHANCE * _MEDIAN_SPREAD / math.sqrt(self.model.measured.sum())
        return self._compute_best_reduced_chi2() <= limit

    def measure_residual_excess(self) -> float:
        """Return the typical |residual| / sigma if noise does not explain it, otherwise 0."""
        if not self.is_sigma_known or self._is_plausible():
            return 0.0
        return float(np.sqrt(self._compute_best_reduced_chi2()))

    @property
    def _remaining_evaluations(self) -> int:
        return max(self.limit - self.evaluations - self.model.evaluations, 0)

    def _store_minimum_if_best(self, minimum: Minimum[FitPoint]) -> None:
        """Report the cost of a fit to all records, and store the fit if it is the best."""
        self._report_cost(minimum)
        if self.best is None or minimum.cost <= self.best.cost:
            point, evaluation, cost, has_converged = minimum
            natural = self.model.estimate_parameter_scales(point)
            self.best = BestFit(point, *evaluation, natural, cost, has_converged)

    def _report_cost(self, minimum: Minimum[Any]) -> None:
        if self.progress is not None:
            self.progress(self.evaluations + self.model.evaluations, minimum.cost / self.dof)

    def _search_from_point(self, point: FitPoint, agreement: float) -> Minimum[FitPoint]:
        old_best = self.best
        point = self._fit_growing_time_spans(point, agreement)
        limit = self.model.evaluations + self._remaining_evaluations
        settings = SearchSettings(self.loss, limit, _FTOL, self._store_minimum_if_best)
        minimum = minimize_cost(self.model, point, settings)
        if np.isfinite(minimum.cost):
            self._store_minimum_if_best(minimum)
        has_ended = old_best is not None and old_best.has_converged
        if old_best is not None and has_ended and minimum.cost > (1.0 - _SAME) * old_best.cost:
            self.best = old_best  # equal minima differ by rounding: the nearer guess counts
        return minimum

    def _choose_equivalent_nearest_to_scene(self) -> None:
        """Choose the motion nearest to the scene among those that the instruments cannot tell."""
        p, best = self.parameters, self.best
        quantities = {series.quantity for record in self.records for series in record.series}
        if best is None or best.pieces or not p.can_vary("attitude"):
            return
        point, old = best.point, p.start
        # Instruments on the body do not show a reversal of com and of the vertical,
        if p.can_vary("com") and quantities <= _BLIND_TO_SIGN and point.com @ old.com < 0.0:
            attitude = multiply_quaternions(np.array([0.0, 1.0, 0.0, 0.0]), point.attitude)
            best = self._try_equivalent(replace(point, attitude=attitude, com=-point.com))
        # or a rotation of the whole scene about the vertical,
        point, target = best.point, old.turning
        if p.can_vary("turning") and target[:2].any() and point.turning[:2].any():
            source = point.turning
            angle = np.arctan2(target[1], target[0]) - np.arctan2(source[1], source[0])
            turn = compute_rotation_quaternions(np.array([0.0, 0.0, angle]))
            attitude = multiply_quaternions(turn, point.attitude)
            turning = rotation_matrix(turn) @ source
            best = self._try_equivalent(replace(point, attitude=attitude, turning=turning))
        # and instruments in space do not show a half turn of the body with its com and rotor.
        points = [best.point]
        most = _SAME * max(best.cost, 1.0)
        if p.can_vary("velocity") and "q" not in quantities:
            for k in range(3):
                twin = p.turn_body_by_half_turn(best.point, k)
                if twin is not None:
                    residuals = self.model.evaluate_residuals(twin, has_jacobian=False).residuals
                    if compute_cost(residuals, self.loss) <= best.cost + most:
                        points.append(twin)
                        self.half_turns.append(k)
            nearest = min(points, key=p.measure_distance_from_start)
            if nearest is not best.point:
                self._try_equivalent(nearest)

    def _try_equivalent(self, twin: FitPoint) -> BestFit:
        """Replace the best solution by the equivalent point `twin` if it fits equally well."""
        best = self.best
        assert best is not None
        evaluation = self.model.evaluate_residuals(twin)
        cost = compute_cost(evaluation.residuals, self.loss)
        if cost <= best.cost + _SAME * max(best.cost, 1.0):
            natural = self.model.estimate_parameter_scales(twin)
            self.best = best = BestFit(twin, *evaluation, natural, cost, best.has_converged)
        return best

    def _try_alternative_spins(self) -> None:
        """Search from alternative spins, and store a solution that fits as well or better."""
        best = self.best
        if best is None or best.cost > _RELATED * self.dof:
            return
        if best.pieces and self._has_small_misfit():
            return
        aliases = list_spin_aliases_of_point(self.parameters, best.point, self.records)
        if not aliases:
            return
        spectrum = classify_fit_directions(best.jacobian, best.natural, 1.0, self.parameters.size)
        velocity = np.eye(self.parameters.size)[self.parameters.get_parameter_slice("velocity")]
        if np.isinf(spectrum.propagate_errors(velocity)[1]).any():
            return
        rise = _AS_WELL * max(best.cost / self.dof, 1.0)
        for alias in aliases:
            limit = self.model.evaluations + min(_ALIAS_LIMIT, self._remaining_evaluations)
            settings = SearchSettings(self.loss, limit, _ALIAS_FTOL, self._report_cost)
            minimum = minimize_cost(self.model, alias, settings)
            solution = minimum.point
            change = float(np.linalg.norm(solution.rate - best.point.rate))
            is_other = change > 0.5 * float(np.linalg.norm(alias.rate - best.point.rate))
            if not is_other or minimum.cost > best.cost + rise:
                continue
            if minimum.cost < best.cost - rise:
                self._store_minimum_if_best(minimum)
                self._search_from_point(solution, self._find_match_end_and_cost(solution)[0])
                return self._try_alternative_spins()
            self.alias = solution if self._has_small_misfit() else None
            return

    def _fit_growing_time_spans(self, point: FitPoint, agreement: float) -> FitPoint:
        """Fit ever longer parts of the records, and return the parameters.

        A motion that agrees nowhere is fitted to slowly growing parts, up to the end.
        """
        is_slow = agreement == 0.0
        horizon, times = 0.0, np.unique(np.abs(np.concatenate([r.t for r in self.records])))
        least = float(times[min(len(times) - 1, 2 * self.parameters.size)])
        for _ in range(_PARTS_MOST):
            horizon = max(0.0 if is_slow else agreement, _GROWTH * horizon, least)
            if horizon >= self._end or not self._remaining_evaluations:
                break
            records, sigmas = self._select_records_until(horizon)
            if sum(record.size for record in records) >= self.parameters.size:
                part = ResidualModel(self.parameters, records, sigmas)
                part.max_steps = self.model.max_steps
                limit = min(_ROUGH_LIMIT, self._remaining_evaluations)
                settings = SearchSettings(self.loss, limit, _ROUGH_FTOL, self._report_cost)
                point = minimize_cost(part, point, settings).point
                self.evaluations += part.evaluations
            agreement, cost = self._find_match_end_and_cost(point)
            if not np.isfinite(cost):
                break  # the motion takes too many steps, or leaves the range of doubles
        return point

    def _select_records_until(self, horizon: float) -> tuple[list[Record], list[Array]]:
        """Return the records restricted to |t| <= horizon, and their standard deviations."""
        records, sigmas, sigma_iterator = [], [], iter(self.sigmas)
        for record in self.records:
            low = int(np.searchsorted(record.t, -horizon))
            high = int(np.searchsorted(record.t, horizon, side="right"))
            records.append(slice_record(record, low, high))
            sigmas += [next(sigma_iterator)[low:high] for _ in record.series]
        return records, sigmas

    def _find_match_end_and_cost(self, point: FitPoint) -> tuple[float, float]:
        """Return the time up to which a motion agrees with the records, and the motion's cost.

        The cost is the sum of all soft losses.
        """
        trial = self.model.evaluate_residuals(point, has_jacobian=False)
        if not np.isfinite(trial.residuals).all():
            return 0.0, np.inf
        end = self._end
        for rows in self.model.rows:
            time = find_time_of_large_residuals(rows, trial, np.abs(self.records[rows.record].t))
            end = min(end, time)
        return end, compute_cost(trial.residuals, "soft")

    def _try_multiple_shooting(self, guesses: list[Guess], pieces: int | None, least: int) -> None:
        """Try multiple shooting with `least` segments or more; keep a far better fit."""
        for guess in guesses:
            count = pieces or choose_segment_count(guess.point, self.records)
            if count < least or guess.motion is None:
                continue
            if count == self._piece_count:
                return  # these pieces have been tried
            self._piece_count = count
            if pieces is None and count > _PIECES_TRIED and not self._try_gapped_fit(guess, count):
                return
            model = ShootingModel(self.parameters, self.records, self.sigmas, count)
            begin = model.data_starts(guess.point, guess.motion)
            self._fit_by_multiple_shooting(model, begin, 0.5)
            return
        if pieces is not None:
            model = ShootingModel(self.parameters, self.records, self.sigmas, pieces)
            begin = model.build_segment_starts(self.parameters.start)
            self._fit_by_multiple_shooting(model, begin, 0.5)

    def _rank_guesses(self, guesses: list[Guess]) -> list[tuple[float, float, Guess]]:
        """Return the match end and the cost of each guess with the guess, the best match first."""
        ranked = [(*self._find_match_end_and_cost(guess.point), guess) for guess in guesses]
        return sorted(ranked, key=lambda entry: (-entry[0], entry[1]))

    def _try_gapped_fit(self, guess: Guess, count: int) -> bool:
        """Return True if segments separated by gaps fit part of the records."""
        records, sigmas = self._select_records_until(self._end * _PIECES_TRIED / count)
        if sum(record.size for record in records) < self.parameters.size or guess.motion is None:
            return True
        model = ShootingModel(self.parameters, records, sigmas, _PIECES_TRIED)
        begin = model.data_starts(guess.point, guess.motion)
        minimum = minimize_by_multiple_shooting(
            model, begin, self.loss, self._remaining_evaluations
        )
        self.evaluations += model.evaluations
        return fits_with_gaps(model, minimum)

    def _fit_by_multiple_shooting(
        self, model: ShootingModel, begin: Segments, factor: float
    ) -> None:
        """Fit the motion in segments, and keep the result if it reduces the cost sufficiently."""
        old_best, self.best = self.best, None

        def store(minimum: Minimum[Segments]) -> None:
            self._report_cost(minimum)
            pieces, (residuals, jacobian) = minimum.point, minimum.evaluation
            self.best = BestFit(
                pieces[model.first],
                residuals[: model.data_size],
                jacobian,
                model.estimate_parameter_scales(pieces),
                minimum.cost,
                minimum.has_converged,
                tuple(zip(map(float, model.edges[:-1]), pieces, strict=True)),
            )

        limit = self._remaining_evaluations
        minimum = minimize_by_multiple_shooting(model, begin, self.loss, limit, store)
        self.evaluations += model.evaluations
        if np.isfinite(minimum.cost):
            store(minimum)
        if old_best is not None and (self.best is None or self.best.cost > factor * old_best.cost):
            self.best = old_best

    def _refine_with_estimated_sigmas(self) -> None:
        """Estimate the unknown measurement errors from the residuals, and fit again."""
        for k in range(0 if self.is_sigma_known else _ROUNDS):
            best = self.best
            if best is None or not best.has_converged:
                return
            sigmas = estimate_sigmas_from_residuals(
                self.model, best.residuals, best.scaled_jacobian, self.loss
            )
            pairs = zip(self.sigmas, sigmas, strict=True)
            change = max(abs(float((new / old).flat[0]) - 1.0) for old, new in pairs)
            if k and change < _SIGMA_RTOL:
                return
            self.evaluations += self.model.evaluations
            self.model, self.best = ResidualModel(self.parameters, self.records, sigmas), None
            if best.pieces:
                model = ShootingModel(self.parameters, self.records, sigmas, len(best.pieces))
                begin = tuple(point for _, point in best.pieces)
                self._fit_by_multiple_shooting(model, begin, np.inf)
            else:
                self._search_from_point(best.point, self._end)

    def measure_relative_misfit(self) -> float:
        assert self.best is not None
        shares = [
            rows.select_series_residuals(self.best.residuals)[rows.measured_mask]
            * rows.sigma[rows.measured_mask]
            / rows.series.size
            for rows in self.model.rows
        ]
        misfits = np.concatenate(shares)
        if self.loss == "soft":
            return float(MEDIAN * np.median(np.abs(misfits)))
        return float(np.sqrt((misfits @ misfits) / misfits.size))

    def refuse_insensitive_quantities(self) -> None:
        assert self.best is not None
        scaled = np.abs(self.best.scaled_jacobian)
        for rows in self.model.rows:
            mask = rows.measured_mask
            sensitivities = scaled[rows.residual_slice][mask.ravel()]
            scale = rows.series.typical_value_scale / rows.sigma.mean(where=mask | ~mask.any())
            if mask.any() and sensitivities.max() <= _INSENSITIVE * scale:
                raise ValueError(
                    f"{rows.series.name} does not depend on the free parameters "
                    f"({', '.join(self.parameters.free)}): add names to free, or leave it out"
                )
