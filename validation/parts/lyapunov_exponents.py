"""Lyapunov exponents as a table, and as a function of energy and vertical momentum."""

import kreisel as kr
import numpy as np

from . import section_data

MAPPED = "20 %"
ENERGIES, VERTICALS = (-0.9, 3.5), (0.0, 2.2)
STARTS = 8  # number of starts per energy and vertical momentum
LONG, MAPPED_LONG = 3000.0, 300.0  # integration times [T]
TIMES = 5.0  # motions whose growth rate exceeds this multiple of ln(t)/t are chaotic


def draw_starts(body, energy, vertical, seed):
    """Return random initial states, or None if the energy is too low."""
    try:
        return kr.starts(body, energy=energy, vertical=vertical, n=STARTS, seed=seed, gravity=1)
    except ValueError:  # no motion has such a low energy
        return None


def map_exponents(side):
    """Return the largest Lyapunov exponent on a square grid of energies and vertical momenta.

    The Lyapunov exponent is NaN if no motion has the given energy and vertical momentum.
    """
    body, values = section_data.make_body(MAPPED), np.full(side * side, np.nan)
    energies, verticals = np.linspace(*ENERGIES, side), np.linspace(*VERTICALS, side)
    grid = [(energy, vertical) for energy in energies for vertical in verticals]
    ensembles = [draw_starts(body, *parameters, seed) for seed, parameters in enumerate(grid)]
    indices = [k for k, tops in enumerate(ensembles) if tops is not None]
    ensemble = kr.Ensemble(
        body,
        momentum=np.concatenate([ensembles[k].momentum for k in indices]),
        attitude=np.concatenate([ensembles[k].attitude for k in indices]),
        gravity=1,
    )
    exponents = kr.lyapunov(ensemble, [MAPPED_LONG]).value.reshape(-1, STARTS)
    values[indices] = exponents.max(axis=1)
    return values.reshape(side, side)


def summarize_exponents(name, n):
    """Return statistics of the Lyapunov exponents for `n` random initial states.

    The certificate is the largest estimate of the relative error of a tangent.
    """
    tops = kr.starts(
        section_data.make_body(name),
        energy=section_data.ENERGY,
        vertical=section_data.VERTICAL,
        n=n,
        seed=2,
        gravity=1,
    )
    indicator = kr.lyapunov(tops, [LONG])
    chaotic = indicator.value[indicator.value > TIMES * np.log(LONG) / LONG]
    count = len(chaotic)
    return {
        "top": name,
        "starts": n,
        "chaotic": count,
        "exponent": float(chaotic.mean()) if count else None,
        "error": float(chaotic.std(ddof=1) / np.sqrt(count)) if count > 1 else None,
        "certificate": float(np.max(indicator.certificate)),
    }
