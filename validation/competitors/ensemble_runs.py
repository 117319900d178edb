"""Integration of many tops with the same body, by kreisel and by other integrators.

Each integrator is wrapped in a function that takes no arguments and returns the final attitudes.
In the compiled heyoka integrators, the parameters of the body are constants. A heyoka integrator
advances eight tops at a time with SIMD instructions. Each thread has its own integrator, unless
heyoka's ensemble function is used.
"""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial

import heyoka as hy
import kreisel as kr
import numpy as np

from ..references import equations
from .single_runs import EPS, ScipyRun, Setting

BATCH = 8


def make_kreisel_call(method, tops, setting, threads):
    ensemble, times = tops.ensemble(), [tops.end]
    words = {"method": method, "threads": threads} | setting.keywords

    def move():
        paths = kr.solve(ensemble, times, **words)
        paths.check()
        return paths.q[:, 0]

    return move


def make_integrator(tops, setting):
    system, _ = equations.build_system(tops.problem)
    hy.llvm_state.set_diskcache_enabled(False)
    return hy.taylor_adaptive_batch(system, np.zeros((7, BATCH)), tol=setting.tol)


def pad_to_batches(tops):
    """Return the initial states as columns of an array, padded to a whole number of batches."""
    missing = -len(tops) % BATCH
    return np.pad(tops.starts, ((0, missing), (0, 0)), mode="edge").T.copy()


def check_end_time(results):
    if any(outcome != hy.taylor_outcome.time_limit for outcome, *_ in results):
        raise ArithmeticError("heyoka stopped before the end")


def make_batch_call(tops, setting, threads):
    """Return a function that integrates batches of eight tops with heyoka on several threads."""
    starts, end = pad_to_batches(tops), tops.end
    own = [make_integrator(tops, setting) for _ in range(threads)]
    pool = ThreadPoolExecutor(threads)

    def work(top, batches, attitudes):
        for i in batches:
            top.set_time(0.0)
            top.state[:] = starts[:, i : i + BATCH]
            top.propagate_until(end)
            check_end_time(top.propagate_res)
            attitudes[:, i : i + BATCH] = top.state[:4]

    def move():
        attitudes = np.empty((4, starts.shape[1]))
        batches = iter(range(0, starts.shape[1], BATCH))
        list(pool.map(lambda top: work(top, batches, attitudes), own))
        return attitudes[:, : len(tops)].T

    return move


def make_ensemble_call(tops, setting, threads):
    starts, top = pad_to_batches(tops), make_integrator(tops, setting)

    def begin(copy, i):
        copy.state[:] = starts[:, BATCH * i : BATCH * (i + 1)]
        return copy

    def move():
        iterations = starts.shape[1] // BATCH
        results = hy.ensemble_propagate_until_batch(
            top, tops.end, iterations, begin, max_workers=threads
        )
        for integrator, *_ in results:
            check_end_time(integrator.propagate_res)
        attitudes = np.concatenate([own.state[:4] for own, *_ in results], axis=1)
        return attitudes[:, : len(tops)].T

    return move


def make_scipy_call(tops, setting, threads):
    """Return a function that integrates all tops with SciPy, one after another."""
    problems = [replace(tops.problem, momentum=momentum) for momentum in tops.momenta]
    runs = [ScipyRun(problem, tops.end, setting) for problem in problems]
    return lambda: np.array([run.solve() for run in runs])


@dataclass(frozen=True)
class Mover:
    """An integrator for many tops, with settings in order of increasing accuracy."""

    name: str
    make: Callable  # (tops, setting, threads) -> call
    settings: tuple
    part: float = 1.0  # fraction of the tops that a slow integrator moves
    least: int = 0  # minimum number of tops
    is_timed_once: bool = False
    is_serial: bool = False  # True if it always uses one thread

    def tops(self, tops):
        return tops.first(max(self.least, round(self.part * len(tops))))


def make_settings(decades, tightest=None):
    more = (Setting(tol=tightest),) if tightest else ()
    return (*(Setting(tol=10.0**-k) for k in decades), *more)


HEYOKA, OWN_CALL, GSL = "heyoka, batches", "heyoka, ensemble", "gsl_rk8pd"
DECADES = range(4, 16)
CLOSED = Mover("exact", partial(make_kreisel_call, "exact"), (Setting(),))
SERIES = Mover("taylor", partial(make_kreisel_call, "taylor"), make_settings(DECADES, 2.0**-53))
OWN = CLOSED.name, SERIES.name
PEERS = (
    Mover(HEYOKA, make_batch_call, make_settings(DECADES, EPS)),
    Mover(OWN_CALL, make_ensemble_call, make_settings(range(4, 15, 5), EPS), 0.1, 64),
    Mover(GSL, partial(make_kreisel_call, GSL), make_settings(range(5, 15, 3)), 0.05, 64),
    Mover("scipy_dop853", make_scipy_call, make_settings(range(5, 14, 4)), 0.0, 8, True, True),
)


def select_movers(tops, each=1):
    """Return the integrators that support a given body, with every n-th setting if `each` is n."""
    closed = (CLOSED,) if tops.problem.symmetric else ()
    return [
        replace(mover, settings=mover.settings[::-each][::-1])
        for mover in (*closed, SERIES, *PEERS)
        if mover.name in kr.methods or not mover.name.startswith("gsl_")
    ]
