"""Rotation numbers of orbits, and the accuracy of kr.frequencies."""

import kreisel as kr
import numpy as np

from . import section_data

LONG, STATES = 600.0, 4096  # duration and states of a path for frequencies


def measure_rotation(orbits, name):
    """Return the axial momentum and the rotation number of each orbit.

    The axial momentum is evaluated at the section point whose spin angle is closest to zero. The
    rotation number is the precession per nutation period in turns, without whole turns, in the
    first half of an orbit. The function also returns how much the rotation number changes between
    the two halves of each orbit.
    """
    tops = kr.starts(
        section_data.make_body(name),
        energy=section_data.ENERGY,
        vertical=section_data.VERTICAL,
        n=orbits,
        seed=2,
        gravity=1,
    )
    section = kr.section(tops, n=400).check()
    spin, axial = (
        values.reshape(orbits, -1) for values in (section.spin_angle, section.axial_momentum)
    )
    indices = np.abs(spin).argmin(axis=1)
    paths = kr.solve(tops, np.linspace(0.0, LONG, STATES))
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
    """Return the angle in turns by which a top precesses during one nutation period.

    The result is determined only up to an integer number of turns.
    """
    frequencies = kr.frequencies(path, 1)
    return frequencies.lines[0] / frequencies.nutation


def largest_frequency_error(n):
    """Return the largest relative error of kr.frequencies for random Lagrange tops.

    The reference values are computed from the closed-form solution.
    """
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
