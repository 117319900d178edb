"""Tests that the errors that fits state are those of simulated records."""

from typing import NamedTuple

import kreisel as kr
import numpy as np
import pytest
import scipy  # imports scipy.stats when it is used
from fits import HEAVY, SYMMETRIC, change_parameters, find_difference, read_parameters, simulate

FITS = 10  # of each kind
T = np.linspace(0.0, 2.0, 40)
START, BODY = ("start",), ("start", "moments")


class Kind(NamedTuple):
    """A kind of fit to simulated records.

    truth     the scene whose motion is simulated
    sigmas    the errors of the quantities of each record
    free      the free parameters of the fit
    true      parameters of the instruments, which change the simulated values
    is_known  False if the fit does not know the errors
    pieces    of the motion
    """

    truth: kr.Scene
    sigmas: tuple[dict[str, float], ...]
    free: tuple[str, ...]
    t: np.ndarray = T
    true: dict[str, float] | None = None
    is_known: bool = True
    pieces: int | None = None


ROTOR = kr.Body(
    1.0, HEAVY.body.moments, com=HEAVY.body.com, rotor=(0.5, -0.8, 2.0), unphysical=True
)
BIAS = {f"bias[0].body_velocity_{x}": v for x, v in zip("xyz", (0.05, -0.1, 0.08), strict=True)}
MOUNTING = dict(zip((f"mounting[0]_{x}" for x in "xyz"), (0.03, -0.02, 0.05), strict=True))
SCALE = {f"scale[0].body_velocity_{x}": v for x, v in zip("xyz", (1.01, 0.98, 1.03), strict=True)}
GYROSCOPE, ATTITUDE = {"body_velocity": 0.02}, {"q": 0.005}
TOPS = {
    "gyroscope": Kind(HEAVY, (GYROSCOPE,), BODY),
    "attitudes": Kind(HEAVY, (ATTITUDE,), BODY, 0.05 * np.arange(-12.0, 24.0)),
    "velocity in space": Kind(HEAVY, ({"velocity": 0.02},), BODY),
    "tip": Kind(SYMMETRIC, ({"apex": 0.003},), BODY),
    "angles": Kind(SYMMETRIC, ({"nutation": 0.003, "precession_angle": 0.004},), BODY),
    "accelerometer": Kind(HEAVY, ({"specific_force": 0.1},), ("velocity", "gravity", "com")),
}
INSTRUMENTS = {
    "two clocks": Kind(HEAVY, (GYROSCOPE, {"apex": 0.005}), START, true=BIAS | {"delay[1]": 0.012}),
    "instrument": Kind(HEAVY, (GYROSCOPE, ATTITUDE), START, true=MOUNTING),
    "scale": Kind(HEAVY, (GYROSCOPE, ATTITUDE), START, true=SCALE),
    "unknown sigma": Kind(HEAVY, (GYROSCOPE,), BODY, is_known=False),
    "few rows": Kind(HEAVY, ({"q": 0.002},), BODY, T[::7], is_known=False),
    "unknown sigmas": Kind(HEAVY, (GYROSCOPE, {"apex": 0.003, "spin": 0.1}), START, is_known=False),
}
SURROUNDINGS = {
    "damping": Kind(HEAVY.replace(damping=(0.2, 0.3, 0.1)), (GYROSCOPE,), ("start", "damping")),
    "friction": Kind(HEAVY.replace(friction=1.0), (GYROSCOPE,), ("velocity", "friction", "com")),
    "rotor": Kind(HEAVY.replace(body=ROTOR), (GYROSCOPE,), ("start", "rotor")),
    "turning": Kind(
        HEAVY.replace(turning=(0.3, -0.2, 1.5)),
        (ATTITUDE | {"inertial_velocity": 0.02},),
        ("start", "turning"),
    ),
    "shaking": Kind(
        HEAVY.replace(shaking=(0.02, 15.0, 0.4)), ({"q": 0.003},), ("start", "shaking")
    ),
    "axes": Kind(
        HEAVY.replace(body=HEAVY.body.turn((0.6, 0.48, 0.0, 0.64))),
        (GYROSCOPE | ATTITUDE,),
        ("start", "com", "axes"),
    ),
    "pieces": Kind(HEAVY, (ATTITUDE,), BODY, pieces=3),
}
GROUPS = {"tops": TOPS, "instruments": INSTRUMENTS, "surroundings": SURROUNDINGS}


def disturb(scene, free, rng):
    """Return a first guess with slightly wrong parameters, of which equal ones stay equal."""
    heads = tuple({"start": "body_velocity", "moments": "I"}.get(name, name) for name in free)
    values = {n: v for n, v in read_parameters(scene).items() if n.startswith(heads)}
    changes = {value: 0.01 * rng.normal() for value in values.values()}
    return change_parameters(scene, {n: changes[v] for n, v in values.items() if "axes" not in n})


def fit_simulated_records(kind, *seed):
    """Return a fit, the names that the records determine, and the deviations from the truth."""
    true = kind.true or {}
    settings = [
        {name: value for name, value in true.items() if f"[{i}]" in name}
        for i in range(len(kind.sigmas))
    ]
    words = {} if kind.is_known else {"sigma": None}
    records = [
        simulate(kind.truth, kind.t, sigmas, (*seed, i), settings=settings[i], **words)
        for i, sigmas in enumerate(kind.sigmas)
    ]
    guess = disturb(kind.truth, kind.free, np.random.default_rng(seed))
    fit = kr.fit(guess, records, kind.free, pieces=kind.pieces)
    names = [name for name in fit.names if np.isfinite(fit.error[name])]
    difference = find_difference(fit, kind.truth, names)
    return fit, names, difference - [true.get(name, 0.0) for name in names]


def measure_coverage(kind, number):
    """Return for each fit the share of smaller deviations and of smaller residuals by chance.

    The square of a deviation, in units of its covariance, has the chi2 distribution, and the F
    distribution if sigma is estimated. The estimated sigmas themselves have the chi2 distribution.
    """
    deviations, residuals, biases, evaluations = [], [], {}, []
    for seed in range(FITS):
        fit, names, difference = fit_simulated_records(kind, number, seed)
        rows = [fit.names.index(name) for name in names]
        covariance = fit.covariance[np.ix_(rows, rows)]
        square = difference @ np.linalg.solve(covariance, difference)
        n = len(rows)
        law = scipy.stats.chi2(n) if kind.is_known else scipy.stats.f(n, fit.dof, scale=n)
        deviations.append(law.cdf(square))
        pairs = zip(kind.sigmas, fit.sigma, strict=True)
        ratios = [found[name] / true[name] for true, found in pairs for name in true]
        size = fit.chi2 if kind.is_known else fit.dof * np.mean(np.square(ratios))
        residuals.append(scipy.stats.chi2(fit.dof).cdf(size))
        errors = np.array([fit.error[name] for name in names])
        assert errors == pytest.approx(np.sqrt(np.diag(covariance)))
        for name, ratio in zip(names, difference / errors, strict=True):
            biases.setdefault(name, []).append(ratio)
        assert fit.has_converged and fit.is_plausible in (True, None) and fit.nonlinearity < 0.3
        assert fit.dof == sum(record.size for record in fit.records) - len(fit.names)
        evaluations.append(fit.evaluations)
    assert np.median(evaluations) < (150 if kind.pieces or fit.dof < 10 else 20)
    return deviations, residuals, biases


@pytest.mark.parametrize("group", GROUPS)
def test_true_parameters_lie_within_the_stated_errors(group):
    """Check bias, spread and coverage of the errors, for each kind of records and together."""
    deviations, residuals = [], []
    for number, (name, kind) in enumerate(GROUPS[group].items()):
        shares, sizes, biases = measure_coverage(kind, number)
        for what, values in ("errors", shares), ("residuals", sizes):
            chance = scipy.stats.kstest(values, "uniform").pvalue
            assert chance > 1e-3, f"{name}: {what} {np.round(values, 2)}"
        for parameter, ratios in biases.items():
            mean = np.mean(ratios) * np.sqrt(len(ratios))
            assert abs(mean) < 4.0, f"{name}: the bias of {parameter} is {mean:.2g}"
        deviations += shares
        residuals += sizes
    for shares in (deviations, residuals):
        assert scipy.stats.kstest(shares, "uniform").pvalue > 1e-2, np.round(np.sort(shares), 2)
