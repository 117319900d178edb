"""Poincare sections, rotation numbers and Lyapunov exponents of tops from order to chaos."""

import kreisel as kr
import numpy as np

from ..references import kowalewski

ENERGY, VERTICAL = 1.6, 0.6
MANY = 60  # number of random candidates for each start
BODIES = {  # bodies, in order of their deviation from a Lagrange top
    "a Lagrange top": ((1.0, 1.0, 0.6), 0.0),
    "moments 2 % apart": ((1.0, 1.02, 0.6), 0.0),
    "8 %": ((1.0, 1.08, 0.6), 0.0),
    "20 %": ((1.0, 1.2, 0.6), 0.0),
    "40 %": ((1.0, 1.4, 0.6), 0.0),
    "59 %, the centre of mass aside": ((1.0, 1.59, 0.6), 0.3),
}
PATH, STATES = 600.0, 4096  # duration and states of a path for frequencies
MAPPED = "20 %"
ENERGIES, VERTICALS = (-0.9, 3.5), (0.0, 2.2)
STARTS = 8  # number of starts per energy and vertical momentum
LONG, MAPPED_LONG = 3000.0, 300.0  # integration times of Lyapunov exponents [T]
TIMES = 5.0  # motions whose growth rate exceeds this multiple of ln(t)/t are chaotic


def make_body(name):
    moments, offset = BODIES[name]
    return kr.Body(1.0, moments, (offset, 0.0, 1.0), unphysical=True)


def draw_starts(name, n):
    """Return random starts with equal energy and vertical momentum."""
    body = make_body(name)
    return kr.starts(body, energy=ENERGY, vertical=VERTICAL, n=n, seed=2, gravity=1)


def compute_section(name, orbits, crossings):
    """Return the Poincare section of random orbits with equal energy and vertical momentum."""
    return kr.section(draw_starts(name, orbits), n=crossings).check()


def compute_kowalewski_section(region, orbits, crossings):
    """Return the Poincare section of orbits with nearly evenly spaced values of K^(1/4)."""
    g, h = kowalewski.REGIONS[region]
    words = {"energy": h, "vertical": kowalewski.vertical_momentum(g), "gravity": 1}
    tops = kr.starts(kowalewski.BODY, n=MANY * orbits, seed=1, **words)
    K = kr.solve(tops, [0.0], want=["kowalewski"]).kowalewski[:, 0] ** 0.25
    levels = np.linspace(K.min(), K.max(), orbits)
    indices = np.abs(K[:, None] - levels).argmin(axis=0)
    return kr.section(tops[indices], n=crossings).check()


def panel_data(section, colour=None):
    """Return the coordinates and colours of the points in one panel."""
    if colour is None:
        rows = section.axial_momentum.reshape(len(section), -1)
        colour = np.repeat(rows.mean(axis=1), rows.shape[1])
    return section.spin_angle, section.axial_momentum, colour


def measure_rotation(orbits, name):
    """Return the axial momentum, the rotation number and its change of each orbit.

    The axial momentum is that at the spin angle closest to zero. The rotation number is the
    precession per nutation period in turns, without whole turns, in the first half of an orbit, and
    its change that between the two halves.
    """
    tops = draw_starts(name, orbits)
    section = kr.section(tops, n=400).check()
    spin, axial = (
        values.reshape(orbits, -1) for values in (section.spin_angle, section.axial_momentum)
    )
    indices = np.abs(spin).argmin(axis=1)
    paths = kr.solve(tops, np.linspace(0.0, PATH, STATES))
    half = STATES // 2
    first, second = (
        np.array([turns_per_nutation(paths[i][half_range]) for i in range(orbits)])
        for half_range in (slice(half), slice(half, None))
    )
    drift = first - second
    return (
        axial[np.arange(orbits), indices],
        first - np.round(first),
        np.abs(drift - np.round(drift)),
    )


def turns_per_nutation(path):
    """Return by how many turns, up to whole ones, a top precesses in one nutation period."""
    frequencies = kr.frequencies(path, 1)
    return frequencies.lines[0] / frequencies.nutation


def largest_frequency_error(n):
    """Return the largest relative error of kr.frequencies for random Lagrange tops."""
    worst, rng = 0.0, np.random.default_rng(11)
    for _ in range(n):
        i1 = rng.uniform(0.5, 2.0)
        body = kr.Body.symmetric(1.0, i1, rng.uniform(0.1, 2.0 * i1), 1.0, unphysical=True)
        q = rng.normal(size=4)
        scene = kr.Scene(body, 2.0 * rng.normal(size=3), q / np.linalg.norm(q), gravity=1)
        exact = kr.exact(scene)
        path = kr.solve(scene, np.linspace(0.0, 40.0 * min(exact.period, 10.0), 4096), "taylor")
        frequencies, nutation = kr.frequencies(path), 2.0 * np.pi / exact.period
        pairs = (
            (frequencies.precession_rate, exact.precession_rate),
            (frequencies.nutation, nutation),
            (frequencies.spin_angle_rate, exact.spin_angle_rate),
        )
        worst = max(worst, *(abs(one / other - 1.0) for one, other in pairs))
    return worst


def find_starts(body, energy, vertical, seed):
    """Return random initial states, or None if the energy is too low."""
    try:
        return kr.starts(body, energy=energy, vertical=vertical, n=STARTS, seed=seed, gravity=1)
    except ValueError:  # no motion has such a low energy
        return None


def map_exponents(side):
    """Return the largest exponent, or NaN without motions, by energy and vertical momentum."""
    body, values = make_body(MAPPED), np.full(side * side, np.nan)
    energies, verticals = np.linspace(*ENERGIES, side), np.linspace(*VERTICALS, side)
    grid = [(energy, vertical) for energy in energies for vertical in verticals]
    ensembles = [find_starts(body, *parameters, seed) for seed, parameters in enumerate(grid)]
    indices = [k for k, tops in enumerate(ensembles) if tops is not None]
    ensemble = kr.Scene(
        body,
        momentum=np.concatenate([ensembles[k].momentum for k in indices]),
        attitude=np.concatenate([ensembles[k].attitude for k in indices]),
        gravity=1,
    )
    exponents = kr.chaos(ensemble, [MAPPED_LONG]).lyapunov.reshape(-1, STARTS)
    values[indices] = exponents.max(axis=1)
    return values.reshape(side, side)


def summarize_exponents(name, n):
    """Return statistics of the Lyapunov exponents for `n` random initial states."""
    tops = draw_starts(name, n)
    indicator = kr.chaos(tops, [LONG])
    chaotic = indicator.lyapunov[indicator.lyapunov > TIMES * np.log(LONG) / LONG]
    count = len(chaotic)
    return {
        "top": name,
        "starts": n,
        "chaotic": count,
        "exponent": float(chaotic.mean()) if count else None,
        "error": float(chaotic.std(ddof=1) / np.sqrt(count)) if count > 1 else None,
        "certificate": float(np.max(indicator.certificate)),
    }
