"""The fraction of random tops whose MEGNO exceeds a bound at t = 1000, which means chaos.

Conclusion: with a bound of 8, no integrable top is classified as chaotic, and most tops with the
body of the asymmetric scene are.

    python -m validation.studies.chaos_fraction TOPS --seed 0 --tol 1e-9
"""

from __future__ import annotations

import argparse
import time

import kreisel as kr
import numpy as np

BOUND, END = 8.0, 1000.0
BODIES = {
    "kowalewski": kr.Body(mass=1.0, inertia=(2.0, 2.0, 1.0), com=(1.0, 0.0, 0.0), unphysical=True),
    "goryachev_chaplygin": kr.Body(
        mass=1.0, inertia=(4.0, 4.0, 1.0), com=(1.0, 0.0, 0.0), unphysical=True
    ),
    "lagrange": kr.Body(mass=1.0, inertia=(1.5, 1.5, 0.7), com=(0.0, 0.0, 0.5)),
    "euler": kr.Body(mass=1.0, inertia=(1.0, 1.6, 2.1), com=(0.0, 0.0, 0.0)),
    "asymmetric": kr.scenes.asymmetric.body,
}


def draw_tops(name: str, n: int, seed: int) -> kr.Ensemble:
    """Return tops with random attitudes and with momenta from slow to fast."""
    rng = np.random.default_rng(seed)
    q = rng.standard_normal((n, 4))
    m = rng.standard_normal((n, 3)) * rng.uniform(0.2, 3.0, (n, 1))
    if name == "goryachev_chaplygin":  # integrable only for <m, e3> = 0
        m[:, 2] = 0.0
    return kr.Ensemble(
        BODIES[name], momentum=m, attitude=q / np.linalg.norm(q, axis=1, keepdims=True)
    )


def print_counts(n: int, seed: int, tol: float | None) -> None:
    for name in BODIES:
        tops = draw_tops(name, n, seed)
        begun = time.perf_counter()
        told = kr.megno(tops, [END], tol=tol)
        rate = n / (time.perf_counter() - begun)
        value = np.asarray(told.value)
        print(
            f"{name:20s} {n} tops, {told.failed.size} failed, {int((value > BOUND).sum())} above "
            f"{BOUND:g}; largest {np.nanmax(value):.2f}, median {np.nanmedian(value):.2f}, "
            f"certificate {np.nanmax(told.certificate):.1e}; {rate:.0f} tops per second",
            flush=True,
        )


def main(argv: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(
        prog="python -m validation.studies.chaos_fraction",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("tops", type=int, help="number of tops of each kind")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--tol", type=float, help="tolerance of a step (default: rounding)")
    asked = parser.parse_args(argv)
    print_counts(asked.tops, asked.seed, asked.tol)


if __name__ == "__main__":
    main()
