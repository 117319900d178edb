"""Fits of a heavy top to gyroscope measurements, computed by SciPy, lmfit and kreisel.

For SciPy and lmfit, the Euler-Poisson equations are integrated numerically. SciPy and lmfit use the
Levenberg-Marquardt method with finite differences. The ten unknowns are the initial attitude and
angular velocity, the principal moments, and the lever arm.
"""

import warnings

import kreisel as kr
import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import curve_fit
from scipy.spatial.transform import Rotation

NAMES = [f"{name}{k}" for name in ("turn", "velocity", "moment") for k in range(3)] + ["lever"]
TOLERANCE = 1e-9


def read_parameters(scene):
    """Return the ten unknowns of the fit for a given top."""
    turn = Rotation.from_quat(scene.attitude_xyzw).as_rotvec()
    velocity = kr.solve(scene, [0.0]).body_velocity[0]
    return np.concatenate((turn, velocity, scene.body.moments, scene.body.com[2:]))


def compute_velocities(t, weight, parameters):
    """Return the angular velocities in the body frame, with shape (n, 3)."""
    turn, velocity, moments, lever = np.split(np.asarray(parameters), (3, 6, 9))
    vertical = Rotation.from_rotvec(turn).as_matrix()[2]

    def derivative(_, state):
        w1, w2, w3, p1, p2, p3 = state
        i1, i2, i3 = moments
        pull = weight * lever[0]
        return (
            ((i2 - i3) * w2 * w3 + pull * p2) / i1,
            ((i3 - i1) * w3 * w1 - pull * p1) / i2,
            (i1 - i2) * w1 * w2 / i3,
            p2 * w3 - p3 * w2,
            p3 * w1 - p1 * w3,
            p1 * w2 - p2 * w1,
        )

    start = np.concatenate((velocity, vertical))
    options = {"method": "DOP853", "t_eval": t, "rtol": TOLERANCE, "atol": TOLERANCE}
    states = solve_ivp(derivative, (0.0, t[-1]), start, **options).y
    return states[:3].T if states.shape[1] == len(t) else np.full((len(t), 3), 1e6)


def fit_by_scipy(scene, t, values, sigma):
    """Return the fitted parameters, their standard errors, and all warning messages."""
    weight = scene.body.mass * scene.gravity
    with warnings.catch_warnings(record=True) as caught_warnings:
        warnings.simplefilter("always")
        parameters, covariance = curve_fit(
            lambda t, *x: compute_velocities(t, weight, x).ravel(),
            t,
            values.ravel(),
            read_parameters(scene),
            np.full(values.size, sigma),
            absolute_sigma=True,
        )
    return parameters, np.sqrt(np.diag(covariance)), [str(one.message) for one in caught_warnings]


def fit_by_lmfit(scene, t, values, sigma):
    """Return the fitted parameters, their standard errors or None, and a message about the fit."""
    import lmfit  # imports pandas, which takes a second

    weight = scene.body.mass * scene.gravity
    start = lmfit.Parameters()
    for name, value in zip(NAMES, read_parameters(scene), strict=True):
        start.add(name, value=value)

    def residuals(parameters):
        x = list(parameters.valuesdict().values())
        return ((compute_velocities(t, weight, x) - values) / sigma).ravel()

    result = lmfit.minimize(residuals, start, scale_covar=False)
    errors = [result.params[name].stderr for name in NAMES]
    return np.array([result.params[name].value for name in NAMES]), errors, [result.message]


def fit_by_kreisel(scene, t, values, sigma):
    """Return fitted parameters, standard errors, and sentences on undetermined parameters."""
    fit = kr.fit(scene, kr.Record(t, {"body_velocity": values}, sigma), FREE)
    names = list(fit.names)
    columns = [[own[name] for name in names] for own in (fit.values, fit.error)]
    return np.array(columns[0]), columns[1], list(fit.unidentified)


FREE = ("start", "moments", "lever")
FITTERS = {"kreisel": fit_by_kreisel, "curve_fit": fit_by_scipy, "lmfit": fit_by_lmfit}
