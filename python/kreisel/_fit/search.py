"""The search for the best minimum of a fit."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from itertools import islice
from typing import Any

import numpy as np

from .._results.results import Error
from .._solve.solve import solve
from .._utils.arguments import Array, freeze_arrays, spell
from . import result, rotations
from .guess import Guess, guess_parameters, interpolate_motion, yield_random_starts
from .parameters import FitPoint, FreeParameters
from .records import Record, slice_record
from .residuals import (
    MEDIAN,
    STEPS_MOST,
    LossName,
    Minimum,
    ResidualModel,
    describe_uncertain_sigmas,
    estimate_initial_sigmas,
    estimate_sigmas_from_residuals,
    join_paths,
    minimize_cost,
    solve_from_start,
)

_FEW_PER_TURN = 4.0  # samples per turn from which an angular velocity is determined
_FTOL = 1e-10  # relative improvement of the cost that ends a search
_PART_FTOL, _PART_LIMIT = 1e-3, 12  # the same, and evaluations, for a part of the records
_GROWTH = 1.4  # factor from one part of the records to the next
_AGREE = 0.4  # residuals relative to the spread of the data up to which a motion agrees
_GAPS = (1e-2, 1e-5)  # standard deviations of the gaps in each stage [rad]
_STAGE_FTOL, _STAGE_LIMIT = 1e-5, 40  # the end of a stage
_HOPELESS = 3.0  # mean squared residual from which smaller gaps are not tried
_PER_GROWTH = 2.0  # pieces for each factor e of the growth of errors
_ROWS = 10  # fewest times of a piece
_PIECES_MOST = 400
_UNSTABLE = 8  # pieces from which a motion that disagrees is searched in pieces
_CHAOTIC = 28  # pieces from which errors grow more than a millionfold
_STARTS_COMPARED = 16  # random initial states, from the nearest of which a search begins
_STARTS_AGREE = 3  # starts that reach the best minimum again, after which it counts as the only one
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
_ALIAS_FTOL, _ALIAS_LIMIT = 1e-6, 25  # the end of a search from another spin
_AS_WELL = 9.0  # rise of chi2 up to which another motion fits as well, three standard deviations
_APART = 5.0  # standard deviations of values between two motions
_INSENSITIVE = 1e-9  # a series that changes less, relative to its spread, tells nothing


def _list_spin_aliases(
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
    if not (interval > 0.0 and "velocity" in parameters.places):
        return []
    turn, aliases = 2.0 * np.pi / interval, []
    speed, columns = float(np.linalg.norm(point.rate)), parameters.columns["moments"]
    spins = [
        (point.rate / (speed or 1.0), speed),
        *zip(np.eye(3), point.rate.tolist(), strict=True),
    ]
    for axis, rate in spins:
        if abs(rate) <= turn / _FEW_PER_TURN:
            continue
        others = [rate - math.copysign(turn, rate)]
        if abs(rate) > 0.5 * turn:
            others.append(2.0 * rate - others[0])
        k = int(np.abs(axis).argmax())
        is_principal = abs(axis[k]) == 1.0 and columns[:, columns[k].argmax()].sum() == 1.0
        for other in others:
            alias = replace(point, rate=point.rate + (other - rate) * axis)
            aliases.append(alias)
            if "moments" in parameters.places and is_principal and other and rate / other > 0.0:
                moments = alias.moments.copy()
                moments[k] *= rate / other
                densities = 0.5 * moments.sum() - moments
                aliases += [replace(alias, densities=densities)] if densities.min() >= 0.0 else []
    return aliases


def _choose_piece_count(point: FitPoint, records: Sequence[Record]) -> int:
    """Return a number of pieces that is large enough to limit the growth of errors in each one."""
    times = np.concatenate([record.t for record in records])
    most = max(min(len(np.unique(times)) // _ROWS, _PIECES_MOST), 1)
    end = float(times[np.abs(times).argmax()])
    try:
        path = solve(point.to_scene(), [end], "taylor", tangents="start", max_steps=10**6)
    except (Error, ValueError):
        return most
    sizes = np.ones(6)
    sizes[3:] = float(np.linalg.norm(point.momentum)) or 1.0
    tangents = path.tangents[0] / sizes[:, None] * sizes
    growth = math.log(max(float(np.linalg.norm(tangents, 2)), 1.0))
    return min(max(math.ceil(_PER_GROWTH * growth), 2), most)


class SearchSession:
    """A search for the best fit, starting from one scene.

    model  the residuals of all records
    best   the best minimum so far, or None
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
        self.models: list[ResidualModel] = []
        self.model = self._make_model(records, estimate_initial_sigmas(records))
        self.best: Minimum | None = None
        self.alias: FitPoint | None = None  # another start that fits as well
        self.rival: FitPoint | None = None  # another motion that fits as well
        self.half_turns: list[int] = []  # principal axes of half turns that fit as well
        self._times = np.concatenate([record.t for record in records])
        self.dof = max(int(self.model.measured.sum()) - parameters.size, 1)

    def _make_model(
        self, records: Sequence[Record], sigmas: Sequence[Array], begins: Iterable[float] = (0.0,)
    ) -> ResidualModel:
        model = ResidualModel(self.parameters, records, sigmas, self.loss, tuple(begins))
        self.models.append(model)
        return model

    @property
    def evaluations(self) -> int:
        return sum(model.evaluations for model in self.models)

    @property
    def _remaining_evaluations(self) -> int:
        return max(self.limit - self.evaluations, 0)

    def check_start_scene_is_solvable(self) -> None:
        start = self.parameters.start.to_scene()
        solve_from_start(start, np.unique(self._times), max_steps=STEPS_MOST)

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
        first, span = float(np.abs(self._times).min()), float(np.ptp(self._times))
        if first > _FAR * span > 0.0:
            raise ValueError(
                f"the records begin at t = {first:g}, long after the start at t = 0, and last only "
                f"{span:g}: subtract the first time from t"
            )
        count = sum(record.size for record in self.records)
        if count < self.parameters.size:
            raise ValueError(
                f"the records have {count} numbers, fewer than the {self.parameters.size} free "
                f"parameters: add measurements, or remove names from {spell('free')}"
            )
        if count == self.parameters.size and not self.is_sigma_known:
            raise ValueError(
                f"the records have {count} numbers, as many as free parameters, so that sigma "
                f"cannot be estimated: give {spell('sigma')}, more measurements or fewer names"
            )
        most = max(len(np.unique(self._times)) // 2, 1)
        if pieces is not None and pieces > most:
            raise ValueError(
                f"pieces must be at most {most}, one for two times of the records, not {pieces}"
            )

    def search(self, pieces: int | None, has_data_guess: bool) -> None:
        start = Guess(self.parameters.start, None)
        agrees, _ = self._compare_with_records(start.point)
        if pieces is not None and pieces > 1:
            guesses = [] if agrees else guess_parameters(self.parameters, self.records)
            if not has_data_guess:
                guesses = [other._replace(point=start.point) for other in guesses]
            self._fit_in_pieces(pieces, next(iter(self._rank(guesses)), start), 0.5)
        elif agrees or not has_data_guess:
            self._search_from_point(start.point)
            if has_data_guess and not self._has_good_fit():
                self._search_from_guesses([], pieces)
        else:
            self._search_from_guesses([start], pieces)
        best = self.best
        if pieces is None and best is not None and self._has_small_misfit():
            count = _choose_piece_count(best.point, self.records)
            if count >= _CHAOTIC and len(best.model.pieces) == 1:
                # too chaotic to fit the motion from one start
                self._fit_in_pieces(count, Guess(best.point, None), np.inf)
        self._choose_equivalent_nearest_to_scene()
        self._refine_with_estimated_sigmas()
        self._try_alternative_spins()

    def _search_from_guesses(self, others: list[Guess], pieces: int | None) -> None:
        """Search from guesses by the records and from others, the nearest first, and at random."""
        guesses = guess_parameters(self.parameters, self.records)
        is_tried = pieces is None and self._try_pieces(guesses, _CHAOTIC)
        if not self._has_small_misfit():
            ranked = self._rank([*guesses, *others])
            for guess in ranked:
                if not self._has_good_fit():
                    self._search_from_point(guess.point)
            if ranked and not self._is_plausible():
                # noise biases the moments of guesses, and so their frequencies
                body = ("densities", "com", "damping", "friction")
                fields: dict[str, Any] = {x: getattr(self.parameters.start, x) for x in body}
                self._search_from_point(replace(ranked[0].point, **fields), is_near=False)
        if pieces is None and not (is_tried or self._has_small_misfit()):
            self._try_pieces(guesses, _UNSTABLE)
        has_attitudes = any(series.is_attitude for r in self.records for series in r.series)
        if self.best is not None and (self.loss == "soft" or not has_attitudes):
            is_known = bool(guesses) or not others
            can_differ = "moments" in self.parameters.places
            self._search_from_random_starts(has_rivals=can_differ and not is_known)

    def _try_pieces(self, guesses: Iterable[Guess], least: int) -> bool:
        """Fit the motion in pieces, if `least` or more are needed; keep a far better fit."""
        for guess in guesses:
            count = _choose_piece_count(guess.point, self.records)
            if count >= least:
                self._fit_in_pieces(count, guess, 0.5)
                return True
        return False

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
            nearest = self._rank([Guess(x, None) for x in islice(starts, _STARTS_COMPARED)])[0]
            minimum = self._search_from_point(nearest.point)
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
        residuals = np.abs(self.best.residuals[self.best.model.measured])
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
        # Noise of the given sigma explains up to three standard deviations of chi2. Source: Wilson
        # and Hilferty, Proceedings of the National Academy of Sciences 17 (1931) 684.
        variance = 2.0 / (9.0 * self.dof)
        limit = (1.0 - variance + _CHANCE * math.sqrt(variance)) ** 3
        limit = limit if self.is_sigma_known else _ROUGHLY
        if self.loss == "soft":
            limit = _PLAUSIBLE + _CHANCE * _MEDIAN_SPREAD / math.sqrt(self.model.measured.sum())
        return self._compute_best_reduced_chi2() <= limit

    def _is_in_pieces(self) -> bool:
        return self.best is not None and len(self.best.model.pieces) > 1

    def _store_if_best(self, minimum: Minimum) -> None:
        """Report the cost of a fit to all records, and store the fit if it is the best."""
        self._report_cost(minimum)
        if self.best is None or minimum.cost <= self.best.cost:
            self.best = minimum

    def _report_cost(self, minimum: Minimum) -> None:
        if self.progress is not None:
            self.progress(self.evaluations, minimum.cost / self.dof)

    def _search_from_point(self, point: FitPoint, is_near: bool | None = None) -> Minimum:
        """Search from a point, unless it `is_near` the records first for growing parts of them."""
        old = self.best
        if is_near is None:
            is_near, _ = self._compare_with_records(point)
        begin = point if is_near else self._fit_growing_parts(point)
        limit = self._remaining_evaluations
        minimum = minimize_cost(self.model, begin, limit, _FTOL, self._store_if_best)
        if np.isfinite(minimum.cost):
            self._store_if_best(minimum)
        elif not is_near:  # the motion that fits a part takes too many steps beyond it
            return self._search_from_point(point, is_near=True)
        if old is not None and old.has_converged and minimum.cost > (1.0 - _SAME) * old.cost:
            self.best = old  # equal minima differ by rounding: the nearer guess counts
        return minimum

    def _choose_equivalent_nearest_to_scene(self) -> None:
        """Choose the motion nearest to the scene among those that the instruments cannot tell."""
        p, best = self.parameters, self.best
        quantities = {series.quantity for record in self.records for series in record.series}
        if best is None or self._is_in_pieces() or "attitude" not in p.places:
            return
        point, old = best.point, p.start
        # Instruments on the body do not show a reversal of com and of the vertical,
        if "com" in p.places and quantities <= _BLIND_TO_SIGN and point.com @ old.com < 0.0:
            attitude = rotations.multiply(np.array([0.0, 1.0, 0.0, 0.0]), point.attitude)
            best = self._try_equivalent(replace(point, attitude=attitude, com=-point.com))
        # or a rotation of the whole scene about the vertical,
        point, target = best.point, old.turning
        if "turning" in p.places and target[:2].any() and point.turning[:2].any():
            source = point.turning
            angle = np.arctan2(target[1], target[0]) - np.arctan2(source[1], source[0])
            turn = rotations.from_vector(np.array([0.0, 0.0, angle]))
            attitude = rotations.multiply(turn, point.attitude)
            turning = rotations.to_matrix(turn) @ source
            best = self._try_equivalent(replace(point, attitude=attitude, turning=turning))
        # and instruments in space do not show a half turn of the body with its com and rotor.
        points, most = [best.point], best.cost + _SAME * max(best.cost, 1.0)
        for k in range(3):
            twin = p.turn_body_by_half_turn(best.point, k)
            if twin is not None and "velocity" in p.places and "q" not in quantities:
                residuals, _ = self.model.evaluate_residuals(twin, has_jacobian=False)
                if self.model.compute_cost(residuals) <= most:
                    points.append(twin)
                    self.half_turns.append(k)
        nearest = min(points, key=p.measure_distance_from_start)
        if nearest is not best.point:
            self._try_equivalent(nearest)

    def _try_equivalent(self, twin: FitPoint) -> Minimum:
        """Replace the best solution by the equivalent point `twin` if it fits equally well."""
        best = self.best
        assert best is not None
        residuals, jacobian = self.model.evaluate_residuals(twin)
        cost = self.model.compute_cost(residuals)
        if cost <= best.cost + _SAME * max(best.cost, 1.0):
            best = Minimum(self.model, twin, residuals, jacobian, cost, best.has_converged)
            self.best = best
        return best

    def _try_alternative_spins(self) -> None:
        """Search from alternative spins, and store a solution that fits as well or better."""
        best, p = self.best, self.parameters
        if best is None or best.cost > _RELATED * self.dof:
            return
        aliases = _list_spin_aliases(p, best.point, self.records)
        if not aliases or (self._is_in_pieces() and self._has_small_misfit()):
            return
        spectrum = result.classify_fit_directions(best, 1.0)
        velocity = np.eye(p.size)[p.places["velocity"]]
        if np.isinf(spectrum.propagate_errors(velocity)[1]).any():
            return
        rise = _AS_WELL * max(best.cost / self.dof, 1.0)
        for alias in aliases:
            limit = min(_ALIAS_LIMIT, self._remaining_evaluations)
            minimum = minimize_cost(self.model, alias, limit, _ALIAS_FTOL, self._report_cost)
            change = float(np.linalg.norm(minimum.point.rate - best.point.rate))
            is_other = change > 0.5 * float(np.linalg.norm(alias.rate - best.point.rate))
            if not is_other or minimum.cost > best.cost + rise:
                continue
            if minimum.cost < best.cost - rise:
                self._store_if_best(minimum)
                self._search_from_point(minimum.point)
                return self._try_alternative_spins()
            self.alias = minimum.point if self._has_small_misfit() else None
            return

    def _fit_growing_parts(self, point: FitPoint) -> FitPoint:
        """Fit ever longer parts of the records, and return the parameters."""
        times = np.unique(np.abs(self._times))
        horizon = float(times[min(len(times) - 1, 2 * self.parameters.size)])
        while horizon < times[-1] and self._remaining_evaluations:
            records, sigmas, rows = [], [], iter(self.model.rows)
            for record in self.records:
                low = int(np.searchsorted(record.t, -horizon))
                high = int(np.searchsorted(record.t, horizon, side="right"))
                records.append(slice_record(record, low, high))
                sigmas += [next(rows).sigma[low:high] for _ in record.series]
            part = self._make_model(records, sigmas)
            if int(part.measured.sum()) >= self.parameters.size:
                part.max_steps = self.model.max_steps
                limit = min(_PART_LIMIT, self._remaining_evaluations)
                point = minimize_cost(part, point, limit, _PART_FTOL, self._report_cost).point
            horizon *= _GROWTH
        return point

    def _compare_with_records(self, point: FitPoint) -> tuple[bool, float]:
        """Return whether a motion agrees with the records, and its cost by the soft loss."""
        residuals, _ = self.model.evaluate_residuals(point, has_jacobian=False)
        if not np.isfinite(residuals).all():
            return False, np.inf
        agrees = True
        for rows in self.model.rows:
            mask = rows.measured_mask
            scale = np.hypot(rows.series.typical_value_scale, 3.0 * rows.sigma)
            relative = np.abs(rows.select_series_residuals(residuals) * rows.sigma / scale)[mask]
            if relative.size:
                agrees &= bool((np.minimum(relative, 1.0) ** 2).mean() <= _AGREE**2)
        return agrees, float((np.hypot(1.0, residuals) - 1.0).sum())

    def _rank(self, guesses: Iterable[Guess]) -> list[Guess]:
        """Return the guesses, that of the motion nearest to the records first."""
        return sorted(guesses, key=lambda guess: self._compare_with_records(guess.point)[1])

    def _fit_in_pieces(self, count: int, guess: Guess, factor: float) -> None:
        """Fit the motion in pieces, and keep the result if it reduces the cost by a factor.

        They start in states of the measured motion of the guess or, without it, of its own motion.
        """
        point, motion = guess
        first, last = min(float(self._times.min()), 0.0), max(float(self._times.max()), 0.0)
        begins = np.linspace(first, last, count + 1)[:-1]
        begins[np.abs(begins).argmin()] = 0.0
        if motion is None:
            paths = solve_from_start(point.to_scene(), begins)
            pairs = zip(join_paths(paths, "q"), join_paths(paths, "m"), strict=True)
            states = [(q, point.relative_angular_velocity(q, m)) for q, m in pairs]
        else:
            states = [interpolate_motion(motion, t) for t in begins.tolist()]
        starts = [state if t else None for t, state in zip(begins, states, strict=True)]
        self._close_gaps(begins.tolist(), point.with_pieces(starts), factor)

    def _close_gaps(self, begins: Sequence[float], point: FitPoint, factor: float) -> None:
        """Close the gaps between the pieces in several stages.

        The search stops early if the pieces do not fit the measurements even with gaps.
        """
        old, self.best = self.best, None
        model = self._make_model(self.records, [rows.sigma for rows in self.model.rows], begins)
        for model.gap in _GAPS:
            limit = min(_STAGE_LIMIT, self._remaining_evaluations)
            report = self._store_if_best if model.gap == _GAPS[-1] else lambda _: None
            minimum = minimize_cost(model, point, limit, _STAGE_FTOL, report)
            point = minimum.point
            if minimum.cost > _HOPELESS * model.size:
                break
        if np.isfinite(minimum.cost):
            self._store_if_best(minimum)
        if old is not None and (self.best is None or self.best.cost > factor * old.cost):
            self.best = old

    def _refine_with_estimated_sigmas(self) -> None:
        """Estimate the unknown measurement errors from the residuals, and fit again."""
        for k in range(0 if self.is_sigma_known else _ROUNDS):
            best = self.best
            if best is None or not best.has_converged:
                return
            sigmas = estimate_sigmas_from_residuals(best)
            pairs = zip(self.model.rows, sigmas, strict=True)
            change = max(abs(float((new / rows.sigma).flat[0]) - 1.0) for rows, new in pairs)
            if k and change < _SIGMA_RTOL:
                return
            self.model, self.best = self._make_model(self.records, sigmas), None
            if len(best.model.pieces) > 1:
                self._close_gaps(best.model.begins, best.point, np.inf)
            else:
                self._search_from_point(best.point, is_near=True)

    def refuse_insensitive_quantities(self, best: Minimum) -> None:
        scaled = np.abs(best.scaled_jacobian)
        for rows in best.model.rows:
            mask = rows.measured_mask
            sensitivities = scaled[rows.residual_slice][mask.ravel()]
            scale = rows.series.typical_value_scale / rows.sigma.mean(where=mask | ~mask.any())
            if mask.any() and sensitivities.max() <= _INSENSITIVE * scale:
                raise ValueError(
                    f"{rows.series.name} does not depend on the free parameters "
                    f"({', '.join(self.parameters.free)}): add to {spell('free')}, or leave it out"
                )

    def _measure_relative_misfit(self, best: Minimum) -> float:
        shares = [
            rows.select_series_residuals(best.residuals)[rows.measured_mask]
            * rows.sigma[rows.measured_mask]
            / rows.series.size
            for rows in best.model.rows
        ]
        misfits = np.concatenate(shares)
        if self.loss == "soft":
            return float(MEDIAN * np.median(np.abs(misfits)))
        return float(np.sqrt((misfits @ misfits) / misfits.size))

    def build_fit(self) -> result.Fit:
        best, p = self.best, self.parameters
        assert best is not None
        model, point = best.model, best.point
        chi2, dof, correlation, inflation = result.compute_residual_statistics(
            best, self.is_sigma_known
        )
        spectrum = result.classify_fit_directions(best, inflation)
        names, units, values, jacobian = p.list_user_parameters_and_jacobian(point)
        covariance, errors = spectrum.propagate_errors(jacobian)
        residuals: tuple[dict[str, Array], ...] = tuple({} for _ in self.records)
        sigma: tuple[dict[str, Array], ...] = tuple({} for _ in self.records)
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
        if "moments" in p.places:
            *others, last = range(p.size)[p.places["moments"]]
            for k in others:
                ratio = values[k] / values[last]
                gradient = (jacobian[k] - ratio * jacobian[last]) / values[last]
                _, [error] = spectrum.propagate_errors(gradient[None])
                ratios[f"{names[k]} / {names[last]}"] = (float(ratio), float(error))
        turns = (
            f"a half turn of the body, with its com and its start, about principal axis {k + 1}"
            for k in self.half_turns
        )
        is_excessive = self.is_sigma_known and not self._is_plausible()
        return result.Fit(
            scene=p.to_scene(point),
            records=self.records,
            names=tuple(names),
            units=tuple(units),
            values=dict(zip(names, map(float, values), strict=True)),
            error=dict(zip(names, map(float, errors), strict=True)),
            moment_ratios=ratios,
            covariance=covariance,
            residuals=residuals,
            sigma=sigma,
            chi2=chi2,
            dof=dof,
            residual_correlation=correlation,
            inflation=inflation,
            nonlinearity=result.measure_cost_nonlinearity(best, spectrum, inflation),
            unidentified=(*result.describe_undetermined_directions(p, point, spectrum), *turns),
            ambiguous=tuple(self._describe_other_motions(names, values, errors)),
            misfit=self._measure_relative_misfit(best),
            excess=math.sqrt(self._compute_best_reduced_chi2()) if is_excessive else 0.0,
            uncertain_sigma=describe_uncertain_sigmas(best),
            at_bound=tuple(result.describe_reached_bounds(p, point, spectrum.natural, names)),
            has_converged=best.has_converged,
            evaluations=self.evaluations,
            cost=best.cost,
            _parameters=p,
            _point=point,
            _spectrum=spectrum,
            _begins=model.begins,
        )

    def _describe_other_motions(
        self, names: list[str], values: Array, errors: Array
    ) -> Iterator[str]:
        """Yield a sentence for each other motion that fits as well."""
        assert self.best is not None
        if self.alias is not None:
            speed, other = (float(np.linalg.norm(x.rate)) for x in (self.best.point, self.alias))
            yield (
                f"the spin: the records have fewer than {_FEW_PER_TURN:g} samples per turn, and "
                f"the angular velocity {other:.4g} instead of {speed:.4g} fits equally well"
            )
        if self.rival is not None:
            _, _, numbers, _ = self.parameters.list_user_parameters_and_jacobian(self.rival)
            if (np.abs(numbers - values) > _APART * errors).any():
                pairs = [f"{name} = {x:.4g}" for name, x in zip(names, numbers, strict=True)]
                yield f"the motion: another one fits equally well, with {', '.join(pairs)}"
