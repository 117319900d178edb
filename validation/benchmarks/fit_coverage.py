"""The coverage of kr.fit: how often the true value lies within 1, 2 and 3 standard errors.

    python -m validation.benchmarks.fit_coverage [--seeds 1000] [KIND ...]

Measurements are simulated for tops with known parameters. The noise is normally distributed, with a
standard deviation of 1 % of the signal or 0.01 rad. The fit starts from wrong moments of inertia, a
wrong initial state and, for asymmetric tops, a wrong centre of mass. Because these initial values
are wrong, kr.fit must derive a better initial guess from the measurements. Only quantities that can
be determined from the measurements are compared. Errors within one fit are correlated, so the
number of independent samples is the number of fits.
"""

import argparse
import time
from typing import NamedTuple

import kreisel as kr
import numpy as np
from kreisel._fit.rotations import compute_rotation_quaternions, multiply_quaternions

NOISE = 0.01  # standard deviation, relative to the signal or in radians
LOST = 2.0  # chi2 per degree of freedom of a fit that missed the motion
GRAVITY = 9.81
BIAS = np.array((0.05, -0.1, 0.08))


class Case(NamedTuple):
    """A fit of simulated measurements to a model with known parameters.

    truth    the scene whose motion is simulated
    guess    the initial guess of the fit
    records  the simulated measurements
    free     the parameters to be fitted
    compare  functions of the scene that the measurements determine
    loss     the loss function of the fit
    """

    truth: kr.Scene
    guess: kr.Scene
    records: list[kr.Record]
    free: tuple[str, ...]
    compare: object
    loss: str = "linear"


def heavy_truth():
    body = kr.Body(1.0, (1.0, 1.3, 0.6), com=(0.05, 0.1, 0.4), unphysical=True)
    attitude = compute_rotation_quaternions(np.array([0.6, 0.3, 0.2]))
    return kr.Scene(body, attitude=attitude, body_velocity=(3.0, 2.0, 12.0), gravity=GRAVITY)


def heavy_case(records, moments=(1.0, 1.1, 1.2)):
    body = kr.Body(1.0, moments, com=(0.0, 0.0, 0.3), unphysical=True)
    guess = kr.Scene(body, body_velocity=(0.0, 0.0, 1.0), gravity=GRAVITY)
    return Case(heavy_truth(), guess, records, ("start", "moments", "com"), heavy_ratios)


def heavy_ratios(scene):
    moments, com = np.array(scene.body.moments), np.array(scene.body.com)
    return np.concatenate((moments[:2], com * scene.gravity)) / moments[2]


def symmetric_truth():
    body = kr.Body.symmetric(1.0, 1.0, 0.6, 0.4, unphysical=True)
    return kr.Scene.spinning(body, spin=20.0, tilt=0.8, precession=0.5, gravity=GRAVITY)


def symmetric_case(records):
    body = kr.Body.symmetric(1.0, 1.7, 1.5, 0.4, unphysical=True)
    guess = kr.Scene(body, body_velocity=(0.0, 0.0, 1.0), gravity=GRAVITY)
    return Case(symmetric_truth(), guess, records, ("start", "moments"), symmetric_ratios)


def symmetric_ratios(scene):
    transverse = scene.body.moments[0]
    axial = kr.solve(scene, [0.0]).axial_momentum[0]
    return np.array((scene.body.com[2] * scene.gravity / transverse, axial / transverse))


def add_noise(rng, values):
    sigma = NOISE * float(np.std(values))
    return values + sigma * rng.normal(size=values.shape), sigma


def gyroscope(rng):
    t = np.arange(500) * 0.01
    values, sigma = add_noise(rng, kr.solve(heavy_truth(), t).body_velocity)
    return heavy_case([kr.Record(t, {"body_velocity": values}, sigma)])


def attitudes(rng):
    t = np.arange(300) * 0.02
    turns = compute_rotation_quaternions(NOISE * rng.normal(size=(len(t), 3)))
    q = multiply_quaternions(kr.solve(heavy_truth(), t).q, turns)
    return heavy_case([kr.Record(t, {"q": q}, NOISE)])


def velocity(rng):
    """Simulate measurements of the angular velocity in the space frame.

    The angular velocity in the space frame does not determine the order of the body axes.
    """
    t = np.arange(500) * 0.01
    values, sigma = add_noise(rng, kr.solve(heavy_truth(), t).velocity)
    return heavy_case([kr.Record(t, {"velocity": values}, sigma)], (1.1, 1.2, 1.0))


def tip(rng):
    t = np.arange(241) / 60.0
    values = kr.solve(symmetric_truth(), t).apex + NOISE * rng.normal(size=(len(t), 3))
    return symmetric_case([kr.Record(t, {"apex": values}, NOISE)])


def angles(rng):
    t = np.sort(rng.uniform(0.0, 4.0, 300))
    path = kr.solve(symmetric_truth(), t)
    sigma = {"nutation": NOISE, "precession_angle": NOISE / np.sin(path.nutation)}
    values = {name: getattr(path, name) + rng.normal(size=len(t)) * sigma[name] for name in sigma}
    return symmetric_case([kr.Record(t, values, sigma)])


def two_clocks(rng):
    """Simulate a gyroscope with a bias and a camera with a clock error."""
    t, late = np.arange(500) * 0.01, np.arange(150) / 30.0 + 0.02
    values, sigma = add_noise(rng, kr.solve(heavy_truth(), t).body_velocity)
    drift = kr.Record(t, {"body_velocity": values + BIAS}, sigma, free="bias")
    apex = kr.solve(heavy_truth(), late - 0.012).apex + NOISE * rng.normal(size=(len(late), 3))
    return heavy_case([drift, kr.Record(late, {"apex": apex}, NOISE, free="delay")])


def environment_case(records, truth, free, measure, **start):
    """Return a test case in which friction or a motion of the support is fitted as well.

    The fit starts from the parameter values given in `start`.
    """

    def compare(scene):
        return np.concatenate((heavy_ratios(scene), measure(scene)))

    plain = heavy_case(records)
    free = (*plain.free, free)
    return plain._replace(
        truth=truth, guess=plain.guess.replace(**start), free=free, compare=compare
    )


def friction(rng):
    """Simulate a gyroscope with friction that eventually stops the spin.

    In the initial guess, the friction is zero.
    """
    t, truth = np.arange(500) * 0.01, heavy_truth().replace(friction=2.0)
    values, sigma = add_noise(rng, kr.solve(truth, t).body_velocity)
    record = kr.Record(t, {"body_velocity": values}, sigma)

    def measure(scene):
        return [scene.friction / scene.body.moments[2]]

    return environment_case([record], truth, "friction", measure)


def turning(rng):
    """Simulate a gyroscope and a camera on a turning support.

    In the initial guess, the support is at rest.
    """
    t, truth = np.arange(300) * 0.02, heavy_truth().replace(turning=(0.3, -0.2, 1.5))
    path = kr.solve(truth, t)
    values, sigma = add_noise(rng, path.inertial_velocity)
    turns = compute_rotation_quaternions(NOISE * rng.normal(size=(len(t), 3)))
    measurements = {"q": multiply_quaternions(path.q, turns), "inertial_velocity": values}
    record = kr.Record(t, measurements, {"q": NOISE, "inertial_velocity": sigma})
    return environment_case([record], truth, "turning", lambda scene: scene.turning)


def shaking(rng):
    """Simulate attitude measurements on a shaken support.

    The initial guess of the shaking rate is within 2 % of the true rate.
    """
    t, truth = np.arange(300) * 0.01, heavy_truth().replace(shaking=(0.02, 15.0, 0.4))
    turns = compute_rotation_quaternions(NOISE * rng.normal(size=(len(t), 3)))
    record = kr.Record(t, {"q": multiply_quaternions(kr.solve(truth, t).q, turns)}, NOISE)

    def measure(scene):
        return scene.shaking

    return environment_case([record], truth, "shaking", measure, shaking=(0.01, 15.3, 0.0))


def replace_rows(rng, record):
    """Replace 3 % of the measurements by outliers."""
    [series] = record.series
    values, rows = series.values.copy(), rng.random(len(record.t)) < OUTLIERS
    nonsense = rng.uniform(-1.0, 1.0, (int(rows.sum()), values.shape[1]))
    values[rows] = nonsense * np.abs(values).max()
    return kr.Record(record.t, {series.name: values}, series.sigma[0, 0])


def tip_with_outliers(rng):
    case = tip(rng)
    return case._replace(records=[replace_rows(rng, case.records[0])], loss="soft")


def gyroscope_with_outliers(rng):
    case = gyroscope(rng)
    return case._replace(records=[replace_rows(rng, case.records[0])], loss="soft")


OUTLIERS = 0.03  # share of rows
SIX = (gyroscope, attitudes, velocity, tip, angles, two_clocks)
MOVING = (friction, turning, shaking)
CASES = (*SIX, *MOVING, tip_with_outliers, gyroscope_with_outliers)
KINDS = {case.__name__: case for case in CASES}


class Coverage(NamedTuple):
    """The errors of fitted parameters in units of their standard errors, and fit statistics."""

    deviations: np.ndarray
    chi2: np.ndarray
    milliseconds: np.ndarray
    dof: int
    lost: int

    def shares(self):
        """Return the fractions of errors within 1, 2 and 3 standard errors."""
        size = np.abs(self.deviations)
        return [float((size < k).mean()) for k in (1.0, 2.0, 3.0)]


def measure_coverage(kind, seeds):
    """Simulate measurements with different random seeds, and fit them."""
    deviations, chi2, times, failures, dof = [], [], [], 0, 1
    for seed in range(seeds):
        case = KINDS[kind](np.random.default_rng(seed))
        begin = time.perf_counter()
        fit = kr.fit(case.guess, case.records, case.free, loss=case.loss)
        times.append(1e3 * (time.perf_counter() - begin))
        dof = fit.dof
        if fit.chi2 > LOST * dof:
            failures += 1
            continue
        values, error = fit.error_of(case.compare)
        deviations.append((values - case.compare(case.truth)) / error)
        chi2.append(fit.chi2 / dof)
    return Coverage(np.array(deviations), np.array(chi2), np.array(times), dof, failures)


def main():
    """Print the coverage of the standard errors for each kind of measurement."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("kinds", nargs="*", choices=[*KINDS, []])
    parser.add_argument("--seeds", type=int, default=1000)
    options = parser.parse_args()
    for kind in options.kinds or KINDS:
        result = measure_coverage(kind, options.seeds)
        shares = " ".join(f"{share:.4f}" for share in result.shares())
        print(
            f"{kind:<23} lost {result.lost}; within 1, 2, 3 sigma {shares}; "
            f"chi2 {result.chi2.mean():.4f} +- {result.chi2.std():.4f} "
            f"({np.sqrt(2.0 / result.dof):.4f} expected); {np.median(result.milliseconds):.0f} ms",
            flush=True,
        )


if __name__ == "__main__":
    main()
