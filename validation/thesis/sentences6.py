"""The quantitative sentences of chapter 6 and of Appendix A, each beside what is true."""

import numpy as np

from .runs import exponent
from .sentences import Sentence

EPS, PI = "\N{GREEK SMALL LETTER EPSILON}", "\N{GREEK SMALL LETTER PI}"
SEEN = 0.05  # a frame error that can be seen in the pictures [rad]


def pair(run, t, names=("BS", "Ext")):
    return [run.until(name, t) for name in names]


def both(run, t):
    bs, ext = pair(run, t)
    return f"Bobenko-Suris {bs:.2g}, Extrap {ext:.1g} rad"


def why_first(loose):
    """Of 6.1: what a looser tolerance would have shown."""
    tol, error = max(loose.items())
    return f"Extrap keeps its tolerance; with {tol:.0e} it would be off by {error:.1g} rad. The program's own is not to be had"


def why_timed(crossed, wanted=900.0):
    """Of 6.2: the tolerances between which the lines would cross where the text has them."""
    late = [tol for tol, t, _ in crossed if t is None or t > wanted]
    early = [tol for tol, t, _ in crossed if t is not None and t <= wanted]
    return f"it would be so for a tolerance between {max(late):.0e} and {min(early):.0e}; the program's Extrap is not to be had"


def visual(four, loose):
    worse = why_first(loose)
    yield Sentence(
        "6.2",
        "After 50 time units the numerical discretization shows no visible errors",
        both(four, 50),
        four.until("Ext", 50) < SEEN,
    )
    bs, ext = pair(four, 300)
    yield Sentence(
        "6.3",
        "After 300 both discretizations show more or less comparable errors",
        both(four, 300),
        ext > bs / 3,
        worse,
    )
    bs, ext = pair(four, 600)
    yield Sentence(
        "6.4, 6.1.2",
        "After 600 both show big errors, the integrable one is somewhat closer",
        both(four, 600),
        ext > bs > SEEN,
        worse,
    )
    bs, ext = pair(four, 50)
    yield Sentence(
        "6.6",
        "To 50: the numerical error is negligible compared to the integrable one",
        both(four, 50),
        ext < bs / 100,
    )
    slopes = [np.polyfit(*chosen(four, name), 1)[0] for name in ("BS", "Ext")]
    yield Sentence(
        "6.7",
        "To 300: the numerical error is lower but already has a comparable trend",
        f"{slopes[0]:.1e} and {slopes[1]:.1e} rad per unit from 200 to 300",
        slopes[1] > slopes[0] / 3,
        worse,
    )
    bs, ext = pair(four, 600)
    yield Sentence(
        "6.8",
        f"By 600 both have reached the maximum {PI}/2",
        both(four, 600),
        min(bs, ext) > 1.3,
        "Bobenko-Suris has, Extrap has not; " + worse,
    )
    growth = [exponent(four.t, four.L[name], 20) for name in ("BS", "Ext")]
    yield Sentence(
        "6.1.3",
        "The trend of Bobenko-Suris is almost linear, of the numerical one more or less quadratic",
        f"powers of t: {growth[0]:.2f} and {growth[1]:.2f}",
        abs(growth[0] - 1) < 0.15 and abs(growth[1] - 2) < 0.3,
    )


def chosen(four, name, begin=200, end=300):
    kept = (four.t >= begin) & (four.t <= end)
    return four.t[kept], np.maximum.accumulate(four.L[name])[kept]


def integrals(four):
    moved = [np.ptp(run.path.vertical_momentum) for run in (four.blue, four.green)]
    yield Sentence(
        "6.1.4",
        "<m, p> stays constant in both",
        f"Bobenko-Suris moves by {moved[0]:.0e}, Extrap by {moved[1]:.0e}",
        max(moved) < 1e-10,
        "Extrap keeps no integral: its own error shows, of the size of its tolerance",
    )
    exact, drift = (
        abs(four.blue.change("axial_momentum")).max(),
        four.green.change("axial_momentum"),
    )
    yield Sentence(
        "6.9",
        "<m, a>: Bobenko-Suris no error, Extrap small but constantly increasing",
        f"{exact:.0e}; {drift[-1]:.1e} at 600",
        exact < 1e-10 and abs(drift[-1]) > 0.8 * abs(drift).max() and abs(drift[-1]) < 1e-2,
    )
    ratio, eps = (
        np.ptp(four.blue.energy_error) / np.ptp(four.red.energy_error),
        four.eps2 / four.eps1,
    )
    yield Sentence(
        "6.10",
        f"The energy error is a periodic oscillation proportional to {EPS}",
        f"range {ratio:.2f} times as large for {eps:g} times the step",
        abs(ratio / eps - 1) < 0.02,
    )
    small, large = abs(four.green.energy_error).max(), abs(four.blue.energy_error).max()
    yield Sentence(
        "6.11",
        "The numerical energy error is small at first, later increases fast, while the integrable stays oscillating",
        f"{small:.0e} against {large:.2f} by 600",
        small > large / 10,
        "it grows, but by 600 it is nothing beside the oscillation",
    )
    off = abs(four.term - four.blue.energy_error).max()
    yield Sentence(
        "6.1.4",
        f"H_{EPS} stays constant: the energy error is {EPS}/2 <a \N{MULTIPLICATION SIGN} m, p>",
        f"it is -I1 times that, less its start, to {off:.0e}",
        off < 1e-11,
    )
    at_once, best, delay = correlation(four)
    yield Sentence(
        "6.12",
        "The oscillating energy error is correlated to the oscillating part of the frame error",
        f"they have one period; coefficient {at_once:.2f} at the same time, {best:.2f} with the energy taken "
        f"{delay:.1f} later",
        best > 0.7,
    )


def correlation(four, end=200.0):
    """Of the energy error and the oscillating part of the frame error, L / t: at the same time; and the largest for delays
    of the energy by less than half a nutation, with that delay."""
    kept = (four.t > 20) & (four.t <= end)
    swing = (four.L["BS"][1:] / four.t[1:])[kept[1:]]
    first = int(np.argmax(kept))
    found = [
        np.corrcoef(four.blue.energy_error[first + k : first + k + len(swing)], swing)[0, 1]
        for k in range(21)
    ]
    best = int(np.argmax(found))
    return float(found[0]), float(found[best]), best * four.eps2


def strong(four, rows):
    by_g = {g: rows[rows[:, 0] == g] for g in sorted(set(rows[:, 0]))}
    weak, usual, heavy = (by_g[g] for g in (0.5, 1.0, 10.0))
    more_g = bool((heavy[:, 3] > weak[:, 3]).all())
    more_m = all(own[-1, 3] > own[0, 3] for own in by_g.values())
    yield Sentence(
        "6.1.5",
        f"Settings that increase {EPS}/2 <a \N{MULTIPLICATION SIGN} m, p>, a longer m or a higher g, decrease "
        "the exactness",
        f"L at most: {weak[1, 3]:.2g} .. {heavy[1, 3]:.2g} rad for g = 0.5 .. 10; {usual[0, 3]:.2g} .. "
        f"{usual[-1, 3]:.2g} for m times 0.5 .. 4, "
        f"though that changes the term by {usual[-1, 2] / usual[0, 2] - 1:.0%} only",
        more_g and more_m,
    )
    yield Sentence(
        "6.13",
        "g = 10, m = (5, 0, 0): the position is already very wrong at t = 20",
        f"{four.L['BS'][-1]:.2f} rad, a turn by {np.degrees(2 * four.L['BS'][-1]):.0f}\N{DEGREE SIGN}; Extrap "
        f"{four.L['Ext'][-1]:.0e}",
        four.L["BS"][-1] > 0.3,
    )
    error = four.blue.energy_error
    yield Sentence(
        "6.14",
        "The oscillating error in the energy is of very high magnitude",
        f"{error.min():.1f} .. {error.max():+.1f} on {four.blue.path.energy[0]:.1f}",
        np.ptp(error) > 10,
    )


def settings(run, tested):
    yield Sentence(
        "6.2.1",
        "The step 0.01 resembles the continuous motion",
        f"{run.until('BS 0.01', 3200):.2g} rad by 3200, {run.until('BS 0.01', 600):.1g} by 600",
        run.until("BS 0.01", 3200) < SEEN,
    )
    yield Sentence(
        "6.2",
        "The numerical discretization is a multi-step method",
        "a one-step method; each step evaluates many times",
        False,
        "erratum 12",
    )
    yield Sentence(
        "6.2.1",
        "m = 166 yields an effective step of 0.03",
        f"{5 / 166:.4f}",
        abs(5 / 166 - 0.03) < 5e-4,
    )
    bs, ext = run.seconds["BS"], run.seconds["Ext"]
    yield Sentence(
        "6.2.1",
        "Both use the same amount of execution time, 0.8 ms for five units",
        f"here {1e6 * bs:.1f} and {1e6 * ext:.1f} \N{MICRO SIGN}s: equal for {run.substeps} sub-steps",
        abs(ext / bs - 1) < 0.25,
        "in Java they were equal; here Extrap costs more, so at equal time Bobenko-Suris may have finer steps",
    )
    steps, lost = run.green.steps / (len(run.t) - 1), run.green.rejected / (len(run.t) - 1)
    yield Sentence(
        "6.2.1",
        "An average of 7 steps are calculated for an interval",
        f"{steps:.1f} accepted and {lost:.1f} rejected",
        abs(steps + lost - 7) < 1,
    )
    low, high = min(tested.values()), max(tested.values())
    yield Sentence(
        "6.2.1",
        "Changing h = 1.5 within its order of magnitude shows practically no change",
        f"L at 1000 for h = {', '.join(f'{h:g}' for h in tested)}: {low:.1e} .. {high:.1e} rad",
        high < 3 * low,
        "the errors stay of one size, but h decides where the steps lie",
    )


def timed(run, crossed):
    worse = why_timed(crossed)
    yield Sentence(
        "6.15",
        "At 200 there are almost no errors recognizable",
        both(run, 200),
        max(pair(run, 200)) < SEEN,
    )
    bs, ext = pair(run, 600)
    yield Sentence(
        "6.16",
        "At 600 both start to show errors, Bobenko-Suris a little higher",
        both(run, 600),
        bs > ext > bs / 5,
        worse,
    )
    growth = [exponent(run.t, run.L[name], 100) for name in ("BS", "Ext")]
    yield Sentence(
        "6.17",
        "At 1000 the errors in the numerical discretization increase faster",
        f"powers of t: {growth[0]:.2f} and {growth[1]:.2f}",
        growth[1] > growth[0] + 0.4,
    )
    bs, ext = pair(run, 3200)
    yield Sentence(
        "6.18",
        "At 3200 the integrable errors are still somewhat acceptable",
        f"{bs:.2g} rad",
        bs < 0.3,
    )
    yield Sentence(
        "6.18", "At 3200 the numerical ones have gotten very big", f"{ext:.2g} rad", ext > bs, worse
    )
    bs, ext = pair(run, 400)
    yield Sentence(
        "6.19",
        "To 400 Bobenko-Suris is higher, the numerical error low",
        both(run, 400),
        ext < bs / 10,
    )
    met = "; ".join(
        f"tolerance {tol:.0e}: {'never' if t is None else f'{t:g}'}" for tol, t, _ in crossed
    )
    yield Sentence(
        "6.20",
        "After about 900 time units the numerical error equals the integrable one",
        f"first above it: {met}",
        crossed[0][1] is not None and 600 < crossed[0][1] < 1200,
        worse,
    )
    yield Sentence(
        "6.21",
        f"By 3200 the numerical error has reached {PI}/2",
        f"{run.until('Ext', 3200):.2g} rad; at tolerance {crossed[-1][0]:.0e} {crossed[-1][2]:.2g}",
        run.until("Ext", 3200) > 1.5,
        worse,
    )
    energy = abs(run.green.energy_error)
    later = energy[len(energy) // 2 :].max() / energy[: len(energy) // 2].max()
    yield Sentence(
        "6.22",
        "The numerical error in the energy is small but steadily increasing",
        f"{energy.max():.0e}; second half {later:.1f} times the first",
        energy.max() < 1e-3 and later > 1.3,
    )
    yield Sentence(
        "6.23",
        "By 3200 it reaches the magnitude of the integrable error",
        f"{energy.max():.0e} against {abs(run.blue.energy_error).max():.2f}",
        energy.max() > abs(run.blue.energy_error).max() / 3,
        worse,
    )


def runge_kutta(by_step):
    run = by_step[0.2]
    each = run.rk4.evaluations / run.rk4.steps
    yield Sentence(
        "6.3",
        "Runge-Kutta evaluates the equations 4 times a step, Bobenko-Suris once",
        f"{each:g} and {run.bs.evaluations / run.bs.steps:g}",
        each == 4,
    )
    early = run.t <= 8
    yield Sentence(
        "6.24",
        "Energy, 0.2: Runge-Kutta small at first, then increases strongly, gets very bad",
        f"at most {abs(run.rk4.energy_error).max():.3f}; Bobenko-Suris within {np.ptp(run.bs.energy_error):.2f}",
        abs(run.rk4.energy_error).max() > abs(run.bs.energy_error).max(),
        "it increases, but stays below the other's oscillation to t = 30",
    )
    yield Sentence(
        "6.25",
        "Frame, 0.2: Runge-Kutta small in the beginning, but grows quickly",
        f"{run.L['rk4'][early].max():.1e} to t = 8, {run.L['rk4'].max():.2g} to 30; Bobenko-Suris "
        f"{run.L['BS'].max():.1g} rad",
        run.L["rk4"].max() > 10 * run.L["rk4"][early].max()
        and run.L["rk4"].max() > 3 * run.L["BS"].max(),
    )
    ratios = [each.L["rk4"].max() / each.L["BS"].max() for each in by_step.values()]
    yield Sentence(
        "6.3",
        "The same happens for other eps2 in [0.1, 0.6]",
        f"L of Runge-Kutta over that of Bobenko-Suris: {', '.join(f'{ratio:.0f}' for ratio in ratios)}",
        min(ratios) > 1,
    )

    wrong = {
        h: next((t for t, error in zip(each.t, each.L["rk4"]) if error > 0.5), None)
        for h, each in by_step.items()
    }
    said = ", ".join(f"{h:g}: {'not' if t is None else f'{t:.3g}'}" for h, t in wrong.items())
    yield Sentence(
        "6.3",
        "For larger eps2 the results diverge very soon",
        f"L of Runge-Kutta exceeds 0.5 at: {said}",
        wrong[0.1] is None and wrong[0.6] is not None and wrong[0.6] < 15,
    )


def conclusions(four, run):
    yield Sentence(
        "6.4",
        "The error in the energy oscillates and does not increase",
        f"range to 300 and from 300 to 600: {halves(four)}",
        abs(np.ptp(four.blue.energy_error[four.t > 300]) / np.ptp(four.blue.energy_error) - 1)
        < 0.02,
    )
    yield Sentence(
        "6.4",
        "An error in the frame already after relatively short periods",
        f"{four.until('BS', 20):.2g} rad by t = 20 (eps = 0.2)",
        four.until("BS", 20) > 10 * four.until("Ext", 20),
    )
    bs, ext, same = pair(run, 3200, ("BS", "Ext", "equal"))
    yield Sentence(
        "6.4, A",
        "For long intervals Bobenko-Suris clearly dominates (A: dominiert klar), with the settings of the text",
        f"6.1, to 600: {both(four, 600)}; 6.2, to 3200: {both(run, 3200)}",
        bs < ext and four.until("BS", 600) < four.until("Ext", 600),
        "its error is the larger one to the end of both",
    )
    meet = overtaken(run)
    yield Sentence(
        "6.4, A",
        "The same, with equal execution time here and today",
        f"{run.substeps} sub-steps: {same:.2g} against {ext:.2g} rad at 3200; Extrap the worse from t = {meet:g} "
        "on"
        if meet
        else f"{run.substeps} sub-steps: {same:.2g} against {ext:.2g} rad at 3200",
        same < ext,
        "the machine was too busy, or steps of Bobenko-Suris cost more beside those of Extrap",
    )
    yield Sentence(
        "A",
        "For short intervals it is unsuitable (f\N{LATIN SMALL LETTER U WITH DIAERESIS}r kurze Zeitperioden "
        "ungeeignet)",
        f"at equal time, at t = 200: {run.until('equal', 200):.1g} against {run.until('Ext', 200):.1g} rad",
        run.until("equal", 200) > run.until("Ext", 200),
        "its steps may be so short",
    )


def overtaken(run):
    """From when on Extrap's largest error so far exceeds that of Bobenko-Suris with equal time; None for never."""
    ahead = np.maximum.accumulate(run.L["Ext"]) <= np.maximum.accumulate(run.L["equal"])
    last = int(np.flatnonzero(ahead)[-1])
    return None if last == len(ahead) - 1 else float(run.t[last + 1])


def halves(four):
    middle = four.t <= 300
    return " and ".join(f"{np.ptp(four.blue.energy_error[part]):.3f}" for part in (middle, ~middle))
