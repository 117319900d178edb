"""The quantitative statements of sections 6.3 and 6.4 and of Appendix A, with numerical checks."""

import numpy as np

from .sentence import Sentence
from .sentences_chapter6 import describe_errors, largest_errors

UE = "\N{LATIN SMALL LETTER U WITH DIAERESIS}"


def check_runge_kutta(by_step):
    yield from check_one_step(by_step[0.2])
    ratios = [each.L["rk4"].max() / each.L["BS"].max() for each in by_step.values()]
    yield Sentence(
        "6.3",
        "The same happens for other eps2 in [0.1, 0.6]",
        "L of Runge-Kutta over that of Bobenko-Suris: "
        + ", ".join(f"{ratio:.0f}" for ratio in ratios),
        min(ratios) > 1,
    )
    wrong = {h: find_divergence(each) for h, each in by_step.items()}
    times = ", ".join(f"{h:g}: {'not' if t is None else f'{t:.3g}'}" for h, t in wrong.items())
    yield Sentence(
        "6.3",
        "For larger eps2 the results diverge very soon",
        f"L of Runge-Kutta exceeds 0.5 at: {times}",
        wrong[0.1] is None and wrong[0.6] is not None and wrong[0.6] < 15,
    )


def find_divergence(equal):
    """Return the first time when the frame error of rk4 exceeds 0.5, or None if it never does."""
    errors = zip(equal.t, equal.L["rk4"], strict=True)
    return next((t for t, error in errors if error > 0.5), None)


def check_one_step(equal):
    each = equal.rk4.evaluations / equal.rk4.steps
    yield Sentence(
        "6.3",
        "Runge-Kutta evaluates the equations 4 times a step, Bobenko-Suris once",
        f"{each:g} and {equal.bs.evaluations / equal.bs.steps:g}",
        each == 4,
    )
    rk4, bs = equal.rk4.energy_error, equal.bs.energy_error
    yield Sentence(
        "6.24",
        "Energy, 0.2: Runge-Kutta small at first, then increases strongly, gets very bad",
        f"at most {abs(rk4).max():.3f}; Bobenko-Suris within {np.ptp(bs):.2f}",
        abs(rk4).max() > abs(bs).max(),
        "it increases, but stays below the oscillation of the other until t = 30",
    )
    rk4, bs = equal.L["rk4"], equal.L["BS"].max()
    early, late = rk4[equal.t <= 8].max(), rk4.max()
    yield Sentence(
        "6.25",
        "Frame, 0.2: Runge-Kutta small in the beginning, but grows quickly",
        f"{early:.1e} to t = 8, {late:.2g} to 30; Bobenko-Suris {bs:.1g} rad",
        late > 10 * early and late > 3 * bs,
    )


def check_conclusions(four, equal_time):
    error = four.blue.energy_error
    yield Sentence(
        "6.4",
        "The error in the energy oscillates and does not increase",
        f"range to 300 and from 300 to 600: {describe_halves(four)}",
        abs(np.ptp(error[four.t > 300]) / np.ptp(error) - 1) < 0.02,
    )
    yield Sentence(
        "6.4",
        "An error in the frame already after relatively short periods",
        f"{four.until('BS', 20):.2g} rad by t = 20 (eps = 0.2)",
        four.until("BS", 20) > 10 * four.until("Ext", 20),
    )
    bs, ext = largest_errors(equal_time, 3200)
    yield Sentence(
        "6.4, A",
        "For long intervals Bobenko-Suris clearly dominates (A: dominiert klar), with the settings "
        "of the text",
        f"6.1, to 600: {describe_errors(four, 600)}; "
        f"6.2, to 3200: {describe_errors(equal_time, 3200)}",
        bs < ext and four.until("BS", 600) < four.until("Ext", 600),
        "its error is larger until the end of both",
    )
    yield from check_equal_time(equal_time)


def check_equal_time(equal_time):
    same, ext = largest_errors(equal_time, 3200, ("equal", "Ext"))
    meet = find_overtaking(equal_time)
    remark = f"; Extrap is less accurate from t = {meet:g} on" if meet else ""
    yield Sentence(
        "6.4, A",
        "The same, with equal execution time here and today",
        f"{equal_time.substeps} sub-steps: {same:.2g} against {ext:.2g} rad at 3200{remark}",
        same < ext,
        "the machine was busy, or steps of Bobenko-Suris are more expensive relative to Extrap",
    )
    same, ext = largest_errors(equal_time, 200, ("equal", "Ext"))
    yield Sentence(
        "A",
        f"For short intervals it is unsuitable (f{UE}r kurze Zeitperioden ungeeignet)",
        f"at equal time, at t = 200: {same:.1g} against {ext:.1g} rad",
        same > ext,
        "because its steps can be that short",
    )


def find_overtaking(equal_time):
    """Return the time from which `extrap` stays less accurate than Bobenko-Suris, or None if never.

    The two methods are compared at equal run time.
    """
    ahead = np.maximum.accumulate(equal_time.L["Ext"]) <= np.maximum.accumulate(
        equal_time.L["equal"]
    )
    last = int(np.flatnonzero(ahead)[-1])
    return None if last == len(ahead) - 1 else float(equal_time.t[last + 1])


def describe_halves(four):
    error, is_early = four.blue.energy_error, four.t <= 300
    return " and ".join(f"{np.ptp(error[part]):.3f}" for part in (is_early, ~is_early))
