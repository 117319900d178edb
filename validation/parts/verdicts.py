"""Assessment of the results of the stability atlas.

To judge a solution, a user can compute it again with half the step size or a hundredth of the
tolerance. Let d be the difference in attitude between the two solutions. If the method attains its
order p, the error of the first solution is about d 2^p / (2^p - 1). For an adaptive method, the
error of the first solution is approximately equal to the difference d.
"""

from math import inf, isfinite, log2, pi, sqrt

from ..references import reference

LOST = 0.1  # [rad]
FACTOR = 3.0  # tolerated ratio of error to estimate
PART = 30.0  # tolerated ratio if the user can notice the error in another way too
RESOLVED = 16  # steps per turn that resolve the motion
COARSE = 4  # fewer steps per turn are obviously too few
PROMISED = 10.0  # tolerated ratio of an adaptive method's error to `tolerance_angle`
RIGHT, WITHIN_TOLERANCE, DEGRADED, SILENT = "right", "within tolerance", "degraded", "silent"
# Right: rounding explains the error, in random directions once per step. Degraded: an error below
# LOST, and lost: a larger one, which one of SIGNS reveals. Silent: no sign reveals the error.
VERDICTS = (RIGHT, WITHIN_TOLERANCE, DEGRADED, "lost", "stopped", "refused", SILENT)
CAME_TO_THE_END = (RIGHT, WITHIN_TOLERANCE, DEGRADED, "lost", SILENT)
MET = (RIGHT, WITHIN_TOLERANCE)
SIGNS = {
    "second run": f"the finer run differs by the error, within a factor of {FACTOR:g}, or by so "
    "much that both runs are obviously wrong",
    "large step": f"fewer than {COARSE} steps per turn, which is known beforehand or visible in a "
    f"run that turns too fast; or fewer than {RESOLVED}, and the finer run differs by at least a "
    f"{PART:g}th of the error",
    "tolerance": "an error of at most the tolerance requested, times the number of steps",
    "rounding": "an error that the rounding of the data explains; or one rounding per evaluation "
    "of the torque, all in one direction, and the finer run differs by at least a "
    f"{PART:g}th of the error",
}
BLOW_UP, STOPPED, REFUSED, DRIFT = "\N{MULTIPLICATION SIGN}", "S", "R", "d"
ALARM, NOT_CONVERGED, BEYOND, REDUCED = "!", "N", "T", "o"
MARKS = {
    ALARM: "silently wrong",
    BLOW_UP: "blow-up: the state became infinite, or the energy grew beyond all bounds",
    NOT_CONVERGED: "an implicit step did not converge",
    STOPPED: "stopped with a message",
    REFUSED: "refused before the start",
    BEYOND: f"error more than {PROMISED:g} times what the tolerance explains, if errors grow as "
    "those of the start do (an error made within an unstable motion may grow more); the second "
    "run reveals it",
    REDUCED: "the observed order between this step and half of it is too low by one or more",
    DRIFT: "the energy drifts",
}


def rounding_effect(true):
    """Return the change in attitude [rad] that a single rounding error causes."""
    return max(true["worst"], reference.ROUNDING)


def rounding_angles(problem, true, cell, by_steps):
    """Return the attitude errors [rad] caused by random and by systematic rounding errors.

    Random errors occur once in each step, and in methods with steps at least once per radian.
    Systematic errors occur in each evaluation of the equations, always in the same direction.
    """
    # A damped top comes to rest, so its roundings are those of its steps.
    radians = problem.rate * cell["end"] if by_steps and not problem.is_damped else 0.0
    random = max(10.0, sqrt(max(cell["steps"], radians)))
    aligned = max(10.0, cell["evaluations"], radians)
    return rounding_effect(true) * random, rounding_effect(true) * aligned


def tolerance_angle(true, rounding, tol, steps):
    """Return the largest attitude error [rad] that is consistent with a given tolerance.

    Each step makes an error of this size, which grows as a rounding error of the start does.
    """
    return rounding + rounding_effect(true) / reference.ROUNDING * tol * steps


def estimate_error(second_run, order):
    """Return an error estimate from the angle [rad] between two runs, by Richardson extrapolation.

    The order of adaptive methods is given as zero, and the angle itself is the estimate.
    """
    return second_run * 2.0**order / (2.0**order - 1.0) if order else second_run


def find_sign(error, estimate, per_turn, thresholds):
    """Return an observation by which users can notice an attitude error, or None if there is none.

    `estimate` is that of a second run, and `per_turn` the number of steps per turn, infinite for
    adaptive methods. `thresholds` has the largest errors that rounding or the tolerance explains.
    """
    random, aligned, tolerance_error = thresholds
    is_visible = estimate >= error / PART
    if estimate >= min(error / FACTOR, LOST):
        return "second run"
    if per_turn < COARSE or (per_turn < RESOLVED * (1 - 1e-9) and is_visible):
        return "large step"
    if error <= tolerance_error:
        return "tolerance"
    return "rounding" if error <= random or (error <= aligned and is_visible) else None


def choose_verdict(error, rounding, sign, tol=None):
    """Return the report's verdict on a numerical solution with a given attitude error [rad]."""
    if not isfinite(error):
        return SILENT
    if error <= rounding and error < LOST:
        return RIGHT
    if tol and error <= tol and error < LOST:
        return WITHIN_TOLERANCE
    return SILENT if sign is None else DEGRADED if error < LOST else "lost"


def has_order_reduction(order, error, finer, most):
    """Return True if the observed order is below the nominal one by at least one."""
    return bool(order and finer > 10 * most and error < LOST and log2(error / finer) < order - 1)


def choose_mark(cell):
    if cell["verdict"] == SILENT:
        return ALARM
    if cell["energy_error"] > 1:
        return BLOW_UP
    if cell["tol"] and cell["attitude_error"] > PROMISED * cell["promised"]:
        return BEYOND
    return REDUCED if cell["reduced"] else DRIFT if cell["drift"] else ""


def judge_cell(cell, finer, problem, true, candidate):
    """Add a verdict to the result of a method on a test case."""
    rounding, most = rounding_angles(problem, true, cell, bool(candidate.steered))
    order = candidate.order if candidate.steered == "step" else 0
    error, estimate = cell["attitude_error"], estimate_error(cell["second_run"], order)
    rate = max(problem.rate, cell["fastest"])
    per_turn = 2 * pi / (rate * cell["step"]) if order else inf
    small = per_turn > RESOLVED * (1 - 1e-9)
    tolerance_error = cell["tol"] * cell["steps"] if cell["tol"] else 0.0
    sign = find_sign(error, estimate, per_turn, (rounding, most, tolerance_error))
    verdict = choose_verdict(error, rounding, sign, cell["tol"])
    cell = cell | {
        "shown": estimate,
        "shown_by": "" if verdict in MET else sign,
        "rounding": rounding,
        "verdict": verdict,
        "promised": None,
        "reduced": small and verdict not in MET and has_order_reduction(order, error, finer, most),
    }
    if cell["tol"]:
        cell["promised"] = tolerance_angle(true, rounding, cell["tol"], cell["steps"])
    return cell | {"mark": choose_mark(cell)}
