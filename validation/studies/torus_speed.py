"""The speed of closed-form solutions for Kowalewski and Goryachev-Chaplygin tops.

    python -m validation.studies.torus_speed [kowalewski|goryachev_chaplygin] [--tops 400]

Random tops are generated as in validation/benchmarks/kowalewski_speed.py. All functions are timed
in C: the preparation of closed forms, their evaluation, and the Taylor method. Closed forms are
evaluated at random times from 0 to 1000 units, one by one and in batches. The Taylor method is
timed up to `--longest` units of time. The run time of the Taylor method is extrapolated linearly to
1e6 units of time.

For some tops, kreisel.solve with the method 'auto' is also timed against heyoka. The errors of
heyoka and of the closed form are measured after 1e4 units of time. The run time of heyoka is also
extrapolated to 1e6 units of time.
"""

from __future__ import annotations

import argparse
import ctypes
import tempfile
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import kreisel as kr
import numpy as np
import numpy.typing as npt

from ..benchmarks.compiling import compile_core
from ..benchmarks.kowalewski_speed import draw_top
from ..competitors import timing
from ..competitors.single_runs import EPS, HeyokaRun, Setting
from ..references.problems import Problem

SOURCE = Path(__file__).with_suffix(".c")
RATIOS = {"kowalewski": 2, "goryachev_chaplygin": 4}
STATES, ROUNDS = 256, 5
LATE = 1e6  # the time at which the series is compared [tau]
PEER_END = 1e4  # the time to which heyoka runs [tau]
Row = tuple[float, float, float, float]


class TorusBench:
    """Access to the C functions that are timed."""

    def __init__(self) -> None:
        self.folder = tempfile.TemporaryDirectory()
        self.library = compile_core(self.folder.name, SOURCE)
        self.library.kr_bench_torus_plan.restype = ctypes.c_void_p
        for name in ("states", "taylor"):
            getattr(self.library, f"kr_bench_torus_{name}").restype = ctypes.c_double

    def measure(
        self, kind: int, scene: kr.Scene, times: npt.NDArray[np.float64], end: float
    ) -> Row:
        """Return median run times of closed forms and of the Taylor method.

        Raises ValueError if the library rejects the closed form for this scene.
        """
        block, out = ctypes.c_char_p(scene._block), np.empty((len(times), 8))
        seconds, rounds = ctypes.c_double(), []
        for _ in range(ROUNDS):
            plan = self.library.kr_bench_torus_plan(block, kind, ctypes.byref(seconds))
            if plan is None:
                raise ValueError("the closed form is refused")
            states = [
                self.library.kr_bench_torus_states(
                    *(kind, ctypes.c_void_p(plan), batch, ctypes.c_size_t(len(times))),
                    *(ctypes.c_void_p(times.ctypes.data), ctypes.c_void_p(out.ctypes.data)),
                )
                for batch in (0, 1)
            ]
            self.library.kr_bench_torus_free(ctypes.c_void_p(plan))
            series = self.library.kr_bench_torus_taylor(block, ctypes.c_double(end))
            rounds.append((seconds.value, *states, series))
        plan_time, one, batch, series = np.median(rounds, axis=0)
        return float(plan_time), float(one), float(batch), float(series)


def measure_tops(
    bench: TorusBench, kind: str, tops: int, longest: float, seed: int
) -> Iterator[Row]:
    """Yield the run times for all tops whose motion has a closed form."""
    rng = np.random.default_rng(seed)
    for _ in range(tops):
        scene, tau = draw_top(rng, RATIOS[kind])
        times = np.ascontiguousarray(rng.uniform(0.0, 1000.0 * tau, STATES))
        try:
            *own, series = bench.measure(list(RATIOS).index(kind), scene, times, longest * tau)
        except ValueError:
            continue
        yield (*own, series * LATE / longest)  # type: ignore[misc]


def print_times(kind: str, rows: list[Row]) -> None:
    """Print run times, and the speed of closed forms relative to the Taylor method."""
    plan, one, batch, series = np.array(rows).T
    print(f"{kind}: {len(rows)} tops")
    for name, seconds in (("plan", plan), ("one state", one), ("state in batches", batch)):
        half, most = 1e6 * np.quantile(seconds, (0.5, 0.99))
        print(f"  {name}: median {half:.3g} us, 99 % {most:.3g} us")
    for name, seconds in (("a state", one), ("a plan and a state", plan + one)):
        half, least = np.quantile(series / seconds, (0.5, 0.01))
        print(f"  taylor to {LATE:g} tau / {name}: median {half:.3g}, 1 % below {least:.3g}")


def compare_with_heyoka(kind: str, tops: int, seed: int) -> None:
    """Print the run times and the errors of 'auto' and heyoka."""
    rng = np.random.default_rng(seed)
    for _ in range(tops):
        scene, tau = draw_top(rng, RATIOS[kind])
        body, late, end = scene.body, [LATE * tau], [PEER_END * tau]
        lever = tuple(body.mass * scene.gravity * x for x in body.com)
        problem = Problem(kind, body.inertia, lever, scene.attitude, scene.momentum)
        peer = HeyokaRun(problem, end[0], Setting(tol=EPS))
        auto, part = timing.best_times((partial(kr.solve, scene, late), peer.solve), ROUNDS)
        truth = kr.solve(scene, end, digits=30).q[0]
        states = kr.solve(scene, end, "exact").q[0], peer.solve()
        exact, other = (float(kr.attitude_error(q, truth)) for q in states)
        print(
            f"  a state at {LATE:g} tau: {kr.plan(scene, late).method} by 'auto' {1e3 * auto:.3g} "
            f"ms, heyoka / auto {part * LATE / PEER_END / auto:.3g}; errors at {PEER_END:g} tau: "
            f"exact {exact:.1e}, heyoka {other:.1e} rad",
            flush=True,
        )


def main(argv: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(
        prog="python -m validation.studies.torus_speed", description=__doc__.splitlines()[0]
    )
    parser.add_argument("kind", nargs="?", choices=list(RATIOS))
    parser.add_argument("--tops", type=int, default=400, help="number of tops of each kind")
    parser.add_argument("--longest", type=float, default=100.0, help="end of the series [tau]")
    parser.add_argument("--heyoka", type=int, default=3, help="number of tops beside heyoka")
    parser.add_argument("--seed", type=int, default=7)
    options = parser.parse_args(argv)
    bench = TorusBench()
    for kind in [options.kind] if options.kind else RATIOS:
        print_times(
            kind, list(measure_tops(bench, kind, options.tops, options.longest, options.seed))
        )
        compare_with_heyoka(kind, options.heyoka, options.seed)


if __name__ == "__main__":
    main()
