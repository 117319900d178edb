"""Judges a cell of the atlas, from the truth and from what a careful user sees who has none.

Such a user runs twice: as asked, and finer by half the step or a hundredth of the tolerance. Where
a method of order p is what it claims to be, its error is about d 2^p / (2^p - 1) with d the angle
between the two runs; that of an adaptive one is about d. The words of a verdict stand in VERDICTS.
"""

from math import inf, isfinite, log2, pi, sqrt

from ..references import reference

LOST = 0.1  # [rad]
FACTOR = 3.0  # times what the second run shows, an error may be
PART = 30.0  # times what the second run shows, an error may be that has another sign besides
RESOLVED = 16  # steps a turn from which a step is said to resolve the motion
COARSE = 4  # steps a turn below which it is plain that a step does not
PROMISED = 10.0  # times what the tolerance at every step explains, an adaptive method may err
RIGHT, AS_ASKED, DEGRADED, SILENT = "right", "as asked", "degraded", "silent"
VERDICTS = {
    RIGHT: "off by less than LOST, and by no more than rounding explains: the conditioning, once "
    "a step in random directions",
    AS_ASKED: "off by more than rounding explains, but by no more than the tolerance requested",
    DEGRADED: "off by less than LOST, and something says so (SIGNS)",
    "lost": "off by more, and something says so",
    "stopped": "it gave up with a message",
    "refused": "it did not begin",
    SILENT: "wrong in silence: nothing says so",
}
CAME_TO_THE_END = (RIGHT, AS_ASKED, DEGRADED, "lost", SILENT)
MET = (RIGHT, AS_ASKED)
SIGNS = {
    "second run": f"the finer run differs, to within a factor of {FACTOR:g} by what its order "
    "says, or by so much that it is plain that neither is right",
    "large step": f"fewer than {COARSE} steps a turn, which can be known beforehand, or seen in a "
    f"run that turns too fast; or fewer than {RESOLVED}, and the finer run differs by a {PART:g}th "
    "of the error at least",
    "tolerance": "no more than the tolerance asked for, missed at every step by as much",
    "rounding": "no more than the data's rounding; or than one at every evaluation of the torque, "
    f"all in the same direction, and the finer run differs by a {PART:g}th of the error at least",
}
BLOW_UP, STOPPED, REFUSED, DRIFT = "\N{MULTIPLICATION SIGN}", "S", "R", "d"
ALARM, NOT_CONVERGED, BEYOND, REDUCED = "!", "N", "T", "o"
MARKS = {
    ALARM: "wrong in silence",
    BLOW_UP: "blew up: the state stopped being finite, or the energy grew beyond all that is there",
    NOT_CONVERGED: "an implicit step did not converge",
    STOPPED: "gave up, with a message",
    REFUSED: "refused before anything ran",
    BEYOND: f"off by more than {PROMISED:g} times what its tolerance explains, carried on as the "
    "start's roundings are (an error made half-way through an unstable motion may grow by more); "
    "the second run says so",
    REDUCED: "the error falls by one order less than the method's, or worse, from this step to "
    "half of it",
    DRIFT: "the energy drifts",
}


def rounding_effect(true):
    """Gives the angle by which one rounding anywhere moves the attitude [rad]."""
    return max(true["worst"], reference.ROUNDING)


def rounding_angles(problem, true, cell, by_steps):
    """Gives the angles that rounding explains [rad]: once a step in random directions, and once an
    evaluation all in the same one. A closed form has no way on which to round: of a late time it
    is as exact as the data."""
    radians = problem.rate * cell["end"] if by_steps else 0.0
    random = max(10.0, sqrt(max(cell["steps"], radians)))
    aligned = max(10.0, cell["evaluations"], radians)
    return rounding_effect(true) * random, rounding_effect(true) * aligned


def tolerance_angle(true, rounding, tol, steps):
    """Gives the angle that a tolerance explains [rad]: missed at every step by as much, and carried
    on as the data's roundings are."""
    return rounding + rounding_effect(true) / reference.ROUNDING * tol * steps


def estimate_error(second_run, order):
    """Gives the error that the second run shows [rad]. Order 0 stands for a tolerance in place of a
    step."""
    return second_run * 2.0**order / (2.0**order - 1.0) if order else second_run


def find_sign(error, shown, per_turn, explained):
    """Says what tells somebody without a truth that an attitude is off by `error`; None: nothing
    does. `shown` is the estimate; `per_turn`, how many steps a turn were taken, infinite where a
    tolerance chose them; `explained`, the angles that rounding and a tolerance explain. What both
    runs are off by alike has no sign, however large the step."""
    random, aligned, tolerated = explained
    seen = shown >= error / PART
    if shown >= min(error / FACTOR, LOST):
        return "second run"
    if per_turn < COARSE or (per_turn < RESOLVED * (1 - 1e-9) and seen):
        return "large step"
    if error <= tolerated:
        return "tolerance"
    return "rounding" if error <= random or (error <= aligned and seen) else None


def choose_verdict(error, rounding, shown_by, tol=None):
    """Return the verdict on an attitude error [rad]. `tol` is the tolerance requested, if any."""
    if not isfinite(error):
        return SILENT
    if error <= rounding and error < LOST:
        return RIGHT
    if tol and error <= tol and error < LOST:
        return AS_ASKED
    return SILENT if shown_by is None else DEGRADED if error < LOST else "lost"


def has_order_reduction(order, error, finer, most):
    """Says whether the order is seen to be less than it should be; it is not to be seen below
    rounding, nor for large errors."""
    return bool(order and finer > 10 * most and error < LOST and log2(error / finer) < order - 1)


def choose_mark(cell):
    if cell["verdict"] == SILENT:
        return ALARM
    if cell["energy_error"] > 1:
        return BLOW_UP
    if cell["tol"] and cell["attitude_error"] > PROMISED * cell["promised"]:
        return BEYOND
    return REDUCED if cell["reduced"] else DRIFT if cell["drift"] else ""


def judge_cell(cell, finer, problem, true, who):
    """Gives the verdict on a run with its energy and attitude errors, from the truth and from the
    error of the finer run."""
    rounding, most = rounding_angles(problem, true, cell, bool(who.steered))
    order = who.order if who.steered == "step" else 0
    error, shown = cell["attitude_error"], estimate_error(cell["second_run"], order)
    rate = max(problem.rate, cell["fastest"])
    per_turn = 2 * pi / (rate * cell["step"]) if order else inf
    small = per_turn > RESOLVED * (1 - 1e-9)
    tolerated = cell["tol"] * cell["steps"] if cell["tol"] else 0.0
    shown_by = find_sign(error, shown, per_turn, (rounding, most, tolerated))
    said = choose_verdict(error, rounding, shown_by, cell["tol"])
    cell = cell | {
        "shown": shown,
        "shown_by": "" if said in MET else shown_by,
        "rounding": rounding,
        "verdict": said,
        "promised": tolerance_angle(true, rounding, cell["tol"], cell["steps"])
        if cell["tol"]
        else None,
        "reduced": bool(
            small and said not in MET and has_order_reduction(order, error, finer, most)
        ),
    }
    return cell | {"mark": choose_mark(cell)}
