"""Lyapunov exponents that the chapter on chaos shows: a map of them over energy and vertical
momentum, and a table with errors."""

import kreisel as kr
import numpy as np

from . import section_data

MAPPED = "20 %"
ENERGIES, VERTICALS = (-0.9, 3.5), (0.0, 2.2)
STARTS = 8  # of each energy and vertical momentum
LONG, MAPPED_LONG = 3000.0, 300.0  # how long tangents are carried along [T]
TIMES = 5.0  # how often as fast as ln(t)/t a motion's neighbours part that is called chaotic


def draw_starts(body, energy, vertical, seed):
    """Gives some starts, or none where there are none."""
    try:
        return kr.starts(body, energy=energy, vertical=vertical, n=STARTS, seed=seed)
    except ValueError:  # so little energy is in no motion
        return None


def map_exponents(side):
    """Gives the largest exponent of some starts over vertical momentum and energy, (side, side),
    NaN where nothing moves so."""
    body, values = section_data.make_body(MAPPED), np.full(side * side, np.nan)
    energies, verticals = np.linspace(*ENERGIES, side), np.linspace(*VERTICALS, side)
    grid = [(energy, vertical) for energy in energies for vertical in verticals]
    found = [draw_starts(body, *at, seed) for seed, at in enumerate(grid)]
    there = [k for k, tops in enumerate(found) if tops is not None]
    together = kr.Ensemble(
        body,
        momentum=np.concatenate([found[k].momentum for k in there]),
        attitude=np.concatenate([found[k].attitude for k in there]),
    )
    exponents = kr.lyapunov(together, [MAPPED_LONG]).value.reshape(-1, STARTS)
    values[there] = exponents.max(axis=1)
    return values.reshape(side, side)


def summarize_exponents(name, n):
    """Gives how many of n random starts are chaotic, with their mean exponent and its standard
    error, and how far the integrals of the tangents strayed at most."""
    tops = kr.starts(
        section_data.make_body(name),
        energy=section_data.ENERGY,
        vertical=section_data.VERTICAL,
        n=n,
        seed=2,
    )
    found = kr.lyapunov(tops, [LONG])
    chaotic = found.value[found.value > TIMES * np.log(LONG) / LONG]
    count = len(chaotic)
    return {
        "top": name,
        "starts": n,
        "chaotic": count,
        "exponent": float(chaotic.mean()) if count else None,
        "error": float(chaotic.std(ddof=1) / np.sqrt(count)) if count > 1 else None,
        "certificate": float(np.max(found.certificate)),
    }
