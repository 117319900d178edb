"""Comparison of the run times of several integrators at equal error, for many tops.

In each round, all integrators run one after the other. The run time for a given error is
interpolated linearly in the logarithms of time and error.
"""

from dataclasses import dataclass
from math import nan
from statistics import median

import numpy as np

from ..references.problems import attitude_errors
from . import timing

NEAR = 1.2  # safety factor on the larger of the two smallest errors, because these errors scatter


@dataclass(frozen=True)
class Run:
    """Errors and run times of one integrator at one tolerance or step size."""

    mover: str
    setting: str
    tops: int
    middle: float  # median of the attitude errors of a sample [rad]
    bad: float  # 90 % quantile of these errors [rad]
    worst: float
    seconds: list  # time per top, one value for each round

    @property
    def microseconds(self):
        return 1e6 * median(self.seconds)


def measure_runs(tops, movers, truths, rounds, threads=2, tick=lambda: None):
    """Measure the errors and the run times of all integrators.

    The integrators run alternately, so that changes in the load of the machine affect them equally.
    Errors are measured only for tops with a reference solution. Integrators that are timed once are
    timed while their errors are measured.
    """
    asked = [
        (place / len(who.settings), who, setting, who.tops(tops))
        for who in movers
        for place, setting in enumerate(who.settings)
    ]
    calls = [who.make(own, setting, threads) for _, who, setting, own in asked]
    errors, seconds = [], []
    for call, (_, who, _, own) in zip(calls, asked, strict=True):
        q, took = time_per_top(call, who, own, threads)
        errors.append(sample_errors(q, truths))
        seconds.append([took] * rounds if who.is_timed_once else [])
    in_turn = sorted(range(len(calls)), key=lambda i: asked[i][0])
    for _ in range(rounds):
        for i in in_turn:
            _, who, _, own = asked[i]
            if not who.is_timed_once:
                seconds[i].append(time_per_top(calls[i], who, own, threads)[1])
            tick()
    return [
        Run(who.name, str(setting), len(own), *spread, took)
        for (_, who, setting, own), spread, took in zip(asked, errors, seconds, strict=True)
    ]


def sample_errors(q, truths):
    """Return the median, the 90 % quantile and the maximum of the attitude errors."""
    known = min(len(q), len(truths))
    sizes = attitude_errors(q[:known], truths[:known])
    return [float(np.quantile(sizes, part)) for part in (0.5, 0.9, 1.0)]


def time_per_top(call, who, tops, threads):
    """Return the final attitudes and the run time [s] per top.

    The run time of a serial integrator is divided by the number of threads.
    """
    found = []
    with timing.pause_gc():
        seconds = timing.time_once(lambda: found.append(call()))
    return found[0], seconds / len(tops) / (threads if who.is_serial else 1)


def group_by_mover(found):
    groups = {}
    for run in found:
        groups.setdefault(run.mover, []).append(run)
    return groups


def tightest_common_error(own, other):
    """Return the smallest error that both integrators reach, multiplied by a safety factor."""
    return NEAR * max(own[-1].middle, other[-1].middle)


def seconds_at(target, own):
    """Return the run time per top at which the median error equals `target`, for each round.

    The result is nan if the integrator does not reach the error `target`.
    """
    errors = np.maximum.accumulate([run.middle for run in own][::-1])[::-1]
    kept = [0, *(i for i in range(1, len(own)) if errors[i] < errors[i - 1])]
    if target < errors[-1]:
        return [nan] * len(own[0].seconds)
    x = np.log(np.maximum(errors[kept], 1e-17))[::-1]
    y = np.log([own[i].seconds for i in kept])[::-1]
    return [float(np.exp(np.interp(np.log(target), x, row))) for row in y.T]


def time_ratio(other, own, target):
    """Return the median ratio of run times at equal error, and both median times [s] per top.

    All results are nan if one of the integrators does not reach the error.
    """
    theirs, ours = seconds_at(target, other), seconds_at(target, own)
    rounds = [b / a for a, b in zip(ours, theirs, strict=True)]
    return median(rounds), median(theirs), median(ours)
