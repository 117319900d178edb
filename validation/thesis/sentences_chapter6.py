"""Numerical checks of the quantitative statements in sections 6.1 and 6.2 of the thesis."""

import numpy as np

from .sentence import Sentence
from .trajectories import fit_exponent, largest_until

EPS, PI = "\N{GREEK SMALL LETTER EPSILON}", "\N{GREEK SMALL LETTER PI}"
TIMES = "\N{MULTIPLICATION SIGN}"
SEEN = 0.05  # the smallest frame error that is visible in the pictures [rad]


def largest_errors(experiment, t, names=("BS", "Ext")):
    return [experiment.until(name, t) for name in names]


def describe_errors(experiment, t):
    bs, ext = largest_errors(experiment, t)
    return f"Bobenko-Suris {bs:.2g}, Extrap {ext:.1g} rad"


def explain_experiment1(loose):
    """Describe how a larger tolerance would affect the error in experiment 6.1 of the thesis."""
    tol, error = max(loose.items())
    return (
        f"Extrap keeps its tolerance; with {tol:.0e} its error would be {error:.1g} rad. The "
        "program's own Extrap is not available"
    )


def explain_experiment2(crossings, target=900.0):
    """Report the tolerances for which the error curves cross at the time quoted in the thesis."""
    late = [tol for tol, t, _ in crossings if t is None or t > target]
    early = [tol for tol, t, _ in crossings if t is not None and t <= target]
    return (
        f"this would hold for a tolerance between {max(late):.0e} and {min(early):.0e}; the "
        "program's own Extrap is not available"
    )


def check_experiment1(four, loose):
    yield from check_visible_errors(four, loose)
    yield from check_frame_errors(four, loose)
    yield from check_momenta(four)
    yield from check_energies(four)


def check_visible_errors(four, loose):
    worse = explain_experiment1(loose)
    yield Sentence(
        "6.2",
        "After 50 time units the numerical discretization shows no visible errors",
        describe_errors(four, 50),
        four.until("Ext", 50) < SEEN,
    )
    bs, ext = largest_errors(four, 300)
    yield Sentence(
        "6.3",
        "After 300 both discretizations show more or less comparable errors",
        describe_errors(four, 300),
        ext > bs / 3,
        worse,
    )
    bs, ext = largest_errors(four, 600)
    yield Sentence(
        "6.4, 6.1.2",
        "After 600 both show big errors, the integrable one is somewhat closer",
        describe_errors(four, 600),
        ext > bs > SEEN,
        worse,
    )


def check_frame_errors(four, loose):
    worse = explain_experiment1(loose)
    bs, ext = largest_errors(four, 50)
    yield Sentence(
        "6.6",
        "To 50: the numerical error is negligible compared to the integrable one",
        describe_errors(four, 50),
        ext < bs / 100,
    )
    slopes = [slope_from_200_to_300(four, name) for name in ("BS", "Ext")]
    yield Sentence(
        "6.7",
        "To 300: the numerical error is lower but already has a comparable trend",
        f"{slopes[0]:.1e} and {slopes[1]:.1e} rad per unit from 200 to 300",
        slopes[1] > slopes[0] / 3,
        worse,
    )
    yield Sentence(
        "6.8",
        f"By 600 both have reached the maximum {PI}/2",
        describe_errors(four, 600),
        min(largest_errors(four, 600)) > 1.3,
        "Bobenko-Suris has, Extrap has not; " + worse,
    )
    growth = [fit_exponent(four.t, four.L[name], 20) for name in ("BS", "Ext")]
    yield Sentence(
        "6.1.3",
        "The trend of Bobenko-Suris is almost linear, of the numerical one more or less quadratic",
        f"powers of t: {growth[0]:.2f} and {growth[1]:.2f}",
        abs(growth[0] - 1) < 0.15 and abs(growth[1] - 2) < 0.3,
    )


def slope_from_200_to_300(four, name):
    selection = (four.t >= 200) & (four.t <= 300)
    return np.polyfit(four.t[selection], np.maximum.accumulate(four.L[name])[selection], 1)[0]


def check_momenta(four):
    bs, ext = (np.ptp(course.vertical_momentum) for course in (four.blue, four.green))
    yield Sentence(
        "6.1.4",
        "<m, p> stays constant in both",
        f"Bobenko-Suris moves by {bs:.0e}, Extrap by {ext:.0e}",
        max(bs, ext) < 1e-10,
        "Extrap conserves no integral; its error is of the size of its tolerance",
    )
    exact, drift = abs(four.blue.axial_error).max(), four.green.axial_error
    yield Sentence(
        "6.9",
        "<m, a>: Bobenko-Suris no error, Extrap small but constantly increasing",
        f"{exact:.0e}; {drift[-1]:.1e} at 600",
        exact < 1e-10 and abs(drift[-1]) > 0.8 * abs(drift).max() and abs(drift[-1]) < 1e-2,
    )


def check_energies(four):
    blue, red, green = (top.energy_error for top in (four.blue, four.red, four.green))
    ratio, eps = np.ptp(blue) / np.ptp(red), four.eps2 / four.eps1
    yield Sentence(
        "6.10",
        f"The energy error is a periodic oscillation proportional to {EPS}",
        f"range {ratio:.2f} times as large for {eps:g} times the step",
        abs(ratio / eps - 1) < 0.02,
    )
    small, large = abs(green).max(), abs(blue).max()
    yield Sentence(
        "6.11",
        "The numerical energy error is small at first, later increases fast, while the integrable "
        "stays oscillating",
        f"{small:.0e} against {large:.2f} by 600",
        small > large / 10,
        "it grows, but at 600 it is negligible compared with the oscillation",
    )
    difference = abs(four.term - blue).max()
    yield Sentence(
        "6.1.4",
        f"H_{EPS} stays constant: the energy error is {EPS}/2 <a {TIMES} m, p>",
        f"it is -I1 times that, less its start, to {difference:.0e}",
        difference < 1e-11,
    )
    at_once, best, delay = correlate_errors(four)
    yield Sentence(
        "6.12",
        "The oscillating energy error is correlated to the oscillating part of the frame error",
        f"both have one period; coefficient {at_once:.2f} at equal times, {best:.2f} with the "
        f"energy delayed by {delay:.1f}",
        best > 0.7,
    )


def correlate_errors(four, end=200.0):
    """Return the correlation between the energy error and the oscillations of the frame error L.

    Returns the correlation at zero lag, the largest correlation, and the lag at which it occurs.
    On average, the frame error L grows linearly with time; its oscillations are therefore visible
    in L / t.
    Only time lags shorter than half a nutation period are considered.
    """
    selection = (four.t > 20) & (four.t <= end)
    swing = (four.L["BS"][1:] / four.t[1:])[selection[1:]]
    first = int(np.argmax(selection))
    later = [four.blue.energy_error[first + k : first + k + len(swing)] for k in range(21)]
    correlations = [np.corrcoef(energy, swing)[0, 1] for energy in later]
    best = int(np.argmax(correlations))
    return float(correlations[0]), float(correlations[best]), best * four.eps2


def check_failing(four, rows):
    yield check_strong_settings(rows)
    bs, ext = four.L["BS"][-1], four.L["Ext"][-1]
    yield Sentence(
        "6.13",
        "g = 10, m = (5, 0, 0): the position is already very wrong at t = 20",
        f"{bs:.2f} rad, a turn by {np.degrees(2 * bs):.0f}\N{DEGREE SIGN}; Extrap {ext:.0e}",
        bs > 0.3,
    )
    error = four.blue.energy_error
    yield Sentence(
        "6.14",
        "The oscillating error in the energy is of very high magnitude",
        f"{error.min():.1f} .. {error.max():+.1f} on {four.blue.path.energy[0]:.1f}",
        np.ptp(error) > 10,
    )


def check_strong_settings(rows):
    by_g = {g: rows[rows[:, 0] == g] for g in sorted(set(rows[:, 0]))}
    weak, usual, heavy = (by_g[g][:, 3] for g in (0.5, 1.0, 10.0))
    term = by_g[1.0][:, 2]
    more_g = bool((heavy > weak).all())
    more_m = all(own[-1, 3] > own[0, 3] for own in by_g.values())
    return Sentence(
        "6.1.5",
        f"Settings that increase {EPS}/2 <a {TIMES} m, p>, a longer m or a higher g, decrease the "
        "exactness",
        f"L at most: {weak[1]:.2g} .. {heavy[1]:.2g} rad for g = 0.5 .. 10; {usual[0]:.2g} .. "
        f"{usual[-1]:.2g} for m times 0.5 .. 4, though that changes the term by "
        f"{term[-1] / term[0] - 1:.0%} only",
        more_g and more_m,
    )


def check_settings(equal_time, errors):
    yield Sentence(
        "6.2.1",
        "The step 0.01 resembles the continuous motion",
        f"{equal_time.until('BS 0.01', 3200):.2g} rad by 3200, "
        f"{equal_time.until('BS 0.01', 600):.1g} by 600",
        equal_time.until("BS 0.01", 3200) < SEEN,
    )
    yield Sentence(
        "6.2",
        "The numerical discretization is a multi-step method",
        "a one-step method; each step evaluates many times",
        False,
        "erratum 12",
    )
    yield from check_execution(equal_time)
    low, high = min(errors.values()), max(errors.values())
    yield Sentence(
        "6.2.1",
        "Changing h = 1.5 within its order of magnitude shows practically no change",
        f"L at 1000 for h = {', '.join(f'{h:g}' for h in errors)}: {low:.1e} .. {high:.1e} rad",
        high < 3 * low,
        "the errors keep their size, but h determines the positions of the steps",
    )


def check_execution(equal_time):
    yield Sentence(
        "6.2.1",
        "m = 166 yields an effective step of 0.03",
        f"{5 / 166:.4f}",
        abs(5 / 166 - 0.03) < 5e-4,
    )
    bs, ext = equal_time.seconds["BS"], equal_time.seconds["Ext"]
    yield Sentence(
        "6.2.1",
        "Both use the same amount of execution time, 0.8 ms for five units",
        f"here {1e6 * bs:.1f} and {1e6 * ext:.1f} \N{MICRO SIGN}s: equal for {equal_time.substeps} "
        "sub-steps",
        abs(ext / bs - 1) < 0.25,
        "in Java they were equal; here Extrap costs more, so Bobenko-Suris can have finer steps at "
        "equal time",
    )
    intervals = len(equal_time.t) - 1
    steps, rejected = equal_time.green.steps / intervals, equal_time.green.rejected / intervals
    yield Sentence(
        "6.2.1",
        "An average of 7 steps are calculated for an interval",
        f"{steps:.1f} accepted and {rejected:.1f} rejected",
        abs(steps + rejected - 7) < 1,
    )


def check_experiment2(equal_time, crossings):
    yield from check_visible_growth(equal_time, crossings)
    yield from check_crossing(equal_time, crossings)
    yield from check_energy_growth(equal_time, crossings)


def check_visible_growth(equal_time, crossings):
    worse = explain_experiment2(crossings)
    yield Sentence(
        "6.15",
        "At 200 there are almost no errors recognizable",
        describe_errors(equal_time, 200),
        max(largest_errors(equal_time, 200)) < SEEN,
    )
    bs, ext = largest_errors(equal_time, 600)
    yield Sentence(
        "6.16",
        "At 600 both start to show errors, Bobenko-Suris a little higher",
        describe_errors(equal_time, 600),
        bs > ext > bs / 5,
        worse,
    )
    growth = [fit_exponent(equal_time.t, equal_time.L[name], 100) for name in ("BS", "Ext")]
    yield Sentence(
        "6.17",
        "At 1000 the errors in the numerical discretization increase faster",
        f"powers of t: {growth[0]:.2f} and {growth[1]:.2f}",
        growth[1] > growth[0] + 0.4,
    )
    bs, ext = largest_errors(equal_time, 3200)
    yield Sentence(
        "6.18",
        "At 3200 the integrable errors are still somewhat acceptable",
        f"{bs:.2g} rad",
        bs < 0.3,
    )
    yield Sentence(
        "6.18", "At 3200 the numerical ones have gotten very big", f"{ext:.2g} rad", ext > bs, worse
    )


def check_crossing(equal_time, crossings):
    worse = explain_experiment2(crossings)
    bs, ext = largest_errors(equal_time, 400)
    yield Sentence(
        "6.19",
        "To 400 Bobenko-Suris is higher, the numerical error low",
        describe_errors(equal_time, 400),
        ext < bs / 10,
    )
    description = "; ".join(
        f"tolerance {tol:.0e}: {'never' if t is None else f'{t:g}'}" for tol, t, _ in crossings
    )
    yield Sentence(
        "6.20",
        "After about 900 time units the numerical error equals the integrable one",
        f"first above it: {description}",
        crossings[0][1] is not None and 600 < crossings[0][1] < 1200,
        worse,
    )
    loosest, _, error = crossings[-1]
    yield Sentence(
        "6.21",
        f"By 3200 the numerical error has reached {PI}/2",
        f"{equal_time.until('Ext', 3200):.2g} rad; at tolerance {loosest:.0e} {error:.2g}",
        equal_time.until("Ext", 3200) > 1.5,
        worse,
    )


def check_energy_growth(equal_time, crossings):
    energy = abs(equal_time.green.energy_error)
    early, late = (largest_until(equal_time.t, energy, t) for t in (100, 1000))
    yield Sentence(
        "6.22",
        "The numerical error in the energy is small but steadily increasing",
        f"{late:.0e} to t = 1000, {late / early:.1f} times the error to t = 100",
        late < 1e-3 and late > 2 * early,
    )
    oscillation = abs(equal_time.blue.energy_error).max()
    yield Sentence(
        "6.23",
        "By 3200 it reaches the magnitude of the integrable error",
        f"{energy.max():.0e} against {oscillation:.2f}",
        energy.max() > oscillation / 3,
        explain_experiment2(crossings),
    )
