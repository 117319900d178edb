"""Comparison of the methods 'auto' and 'taylor' for short integration times.

The integration times are the shortest ones for which 'auto' selects a closed form. Conclusion: for
about 1 % of random Kowalewski and Goryachev-Chaplygin tops, 'auto' is slower than the Taylor
method. The set-up times that 'auto' assumes are in kreisel/_options/closed_form_choice.py. The
error of 'auto' is smaller than that of the Taylor method for all tops in the study.

    python -m validation.studies.set_up_times TOPS --seed 0 --errors 20
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator

import kreisel as kr
import numpy as np
from kreisel._options import closed_form_choice

RATIOS = {"kowalewski": 2.0, "goryachev_chaplygin": 4.0}
REPEATS = 3


def draw_scenes(kind: str, n: int, seed: int) -> Iterator[kr.Scene]:
    """Yield tops with random attitudes and with momenta of very different magnitudes."""
    rng = np.random.default_rng(seed)
    body = kr.Body(1.0, (RATIOS[kind], RATIOS[kind], 1.0), (1.0, 0.0, 0.0), unphysical=True)
    for _ in range(n):
        attitude = rng.normal(size=4)
        momentum = rng.normal(size=3) * 10.0 ** rng.uniform(-1.5, 1.5)
        if kind == "goryachev_chaplygin":  # integrable only for <m, e3> = 0
            momentum[2] = 0.0
        yield kr.Scene(body, momentum, attitude / np.linalg.norm(attitude), gravity=1)


def measure_speed(scene: kr.Scene, end: float) -> float:
    """Return the run time of the Taylor method relative to that of 'auto'."""
    best = {"auto": np.inf, "taylor": np.inf}
    for name in ("auto", "taylor") * REPEATS:
        begin = time.perf_counter()
        kr.solve(scene, [end], name)
        best[name] = min(best[name], time.perf_counter() - begin)
    return best["taylor"] / best["auto"]


def measure_accuracy(scene: kr.Scene, end: float) -> float:
    """Return the error of the Taylor method relative to that of 'auto'."""
    truth = kr.solve(scene, [end], digits=20)
    errors = [
        float(kr.attitude_error(kr.solve(scene, [end], name).q, truth.q)[0])
        for name in ("auto", "taylor")
    ]
    return errors[1] / max(errors[0], 2.0**-53)


def main(argv: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(
        prog="python -m validation.studies.set_up_times", description=__doc__.splitlines()[0]
    )
    parser.add_argument("tops", type=int, help="number of tops of each kind")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--errors", type=int, default=20, help="number of tops with an error")
    options = parser.parse_args(argv)
    for kind in RATIOS:
        set_up = closed_form_choice._FORMS[kind].set_up
        speeds, errors = [], []
        for i, scene in enumerate(draw_scenes(kind, options.tops, options.seed)):
            end = 1.02 * set_up / closed_form_choice._estimate_taylor_steps(scene, 1.0)
            if kr.plan(scene, [end]).method != "exact":
                continue
            speeds.append(measure_speed(scene, end))
            if i < options.errors:
                errors.append(measure_accuracy(scene, end))
        least, low, median = np.quantile(speeds, [0.0, 0.01, 0.5])
        print(
            f"{kind}: {len(speeds)} of {options.tops} tops by closed form; time of the series / "
            f"time of auto: least {least:.2f}, 1 % below {low:.2f}, median {median:.1f}; error of "
            f"the series / error of auto: least {min(errors):.0f}, median {np.median(errors):.0f}",
            flush=True,
        )


if __name__ == "__main__":
    main()
