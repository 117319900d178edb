"""The observed order of convergence of a method, for attitude and angular momentum."""

import kreisel as kr
import numpy as np

BODIES = {
    "lagrange": kr.Body.cuboid(half=(0.8, 0.8, 1), pivot=(0, 0, -1)),
    "kowalewski": kr.Body.cuboid(half=(3**0.5, 1, 0.5), pivot=(0, 0, -0.5)),
    "goryachev_chaplygin": kr.Body.cuboid(half=(7**0.5, 1, 0.5), pivot=(0, 0, -0.5)),
    "asymmetric": kr.Body.cuboid(half=(0.6, 0.8, 1), pivot=(0.1, -0.2, -1)),
    "free": kr.Body.cuboid(half=(0.6, 0.8, 1), pivot=(0, 0, 0)),
}
TILT = np.array([0.8, 0.4, -0.2, 0.4]) / np.linalg.norm([0.8, 0.4, -0.2, 0.4])


def tilt_scene(body, momentum=(0.172, -1.862, 1.46), gravity=1.0):
    """Return a scene in which the top is not upright.

    With an upright top, first-order errors would not be noticed, because no torque acts at the
    start.
    """
    return kr.Scene(BODIES[body], momentum=momentum, attitude=TILT, gravity=gravity)


def fit_slope(steps, errors, rounding):
    """Return the slope of log(error) against log(step), or None if there are too few points.

    The slope is fitted to the eight smallest step sizes whose errors are well above the rounding
    errors.
    """
    good = np.flatnonzero(errors > 30 * rounding)[-8:]
    return np.polyfit(np.log(steps[good]), np.log(errors[good]), 1)[0] if len(good) >= 3 else None


def compute_errors(path, truth):
    """Return the errors of attitude and momentum, each as a norm over several times.

    The error at a single time may vanish by coincidence.
    """
    momentum_error = np.linalg.norm(path.m - truth.m) / np.linalg.norm(truth.m[-1])
    return np.array([np.linalg.norm(kr.attitude_error(path.q, truth.q)), momentum_error])


def measure_order(name, body):
    """Return the observed orders of convergence of attitude and momentum.

    Methods of high order are tested with a fast top, because their truncation errors for a slow top
    would be smaller than the rounding errors.
    """
    high = kr.methods[name].order > 4
    top = tilt_scene(body, momentum=(8.0 if high else 1.0) * np.array((0.172, -1.862, 1.46)))
    times = np.arange(3.0 if body == "asymmetric" else 6.0)
    truth = kr.solve(top, times, method="kahan_li8", step=1 / 840)
    rounding = compute_errors(kr.solve(top, times, method="kahan_li8", step=1 / 600), truth)
    steps = 1 / np.unique(np.round(2.0 ** np.arange(1 if high else 3, 8, 0.125)))
    errors = np.array(
        [compute_errors(kr.solve(top, times, method=name, step=h), truth) for h in steps]
    )
    is_conserved = body == "free" and errors[:, 1].max() < 1e-11
    return {
        quantity: fit_slope(steps, errors[:, i], rounding[i])
        for i, quantity in enumerate("qm")
        if not (is_conserved and quantity == "m")
    }
