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

    def summarize(self):
        """Return the run as a row of a table."""
        numbers = {key: value for key, value in vars(self).items() if key != "seconds"}
        return numbers | {"microseconds": 1e6 * median(self.seconds)}


def measure_runs(tops, movers, truths, rounds, threads=2):
    """Measure the errors and the run times of all integrators, which run alternately."""
    settings = [
        (place / len(mover.settings), mover, setting, mover.tops(tops))
        for mover in movers
        for place, setting in enumerate(mover.settings)
    ]
    calls = [mover.make(own, setting, threads) for _, mover, setting, own in settings]
    errors, seconds = [], []
    for call, (_, mover, _, own) in zip(calls, settings, strict=True):
        q, seconds_once = time_per_top(call, mover, own, threads)
        errors.append(sample_errors(q, truths))
        seconds.append([seconds_once] * rounds if mover.is_timed_once else [])
    in_turn = sorted(range(len(calls)), key=lambda i: settings[i][0])
    for _ in range(rounds):
        for i in in_turn:
            _, mover, _, own = settings[i]
            if not mover.is_timed_once:
                seconds[i].append(time_per_top(calls[i], mover, own, threads)[1])
    results = zip(settings, errors, seconds, strict=True)
    return [
        Run(mover.name, str(setting), len(own), *spread, times)
        for (_, mover, setting, own), spread, times in results
    ]


def sample_errors(q, truths):
    """Return the median, the 90 % quantile and the maximum of the attitude errors."""
    count = min(len(q), len(truths))
    sizes = attitude_errors(q[:count], truths[:count])
    return [float(np.quantile(sizes, part)) for part in (0.5, 0.9, 1.0)]


def time_per_top(call, mover, tops, threads):
    """Return the final attitudes and the run time [s] per top."""
    results = []
    with timing.pause_gc():
        seconds = timing.time_once(lambda: results.append(call()))
    return results[0], seconds / len(tops) / (threads if mover.is_serial else 1)


def group_by_mover(runs):
    groups = {}
    for run in runs:
        groups.setdefault(run.mover, []).append(run)
    return groups


def tightest_common_error(own, other):
    """Return the smallest error that both integrators reach, multiplied by a safety factor."""
    return NEAR * max(own[-1].middle, other[-1].middle)


def seconds_at(target, own):
    """Return the run time per top, or nan, at which the median error is `target`, by round."""
    errors = np.maximum.accumulate([run.middle for run in own][::-1])[::-1]
    indices = [0, *(i for i in range(1, len(own)) if errors[i] < errors[i - 1])]
    if target < errors[-1]:
        return [nan] * len(own[0].seconds)
    x = np.log(np.maximum(errors[indices], 1e-17))[::-1]
    y = np.log([own[i].seconds for i in indices])[::-1]
    return [float(np.exp(np.interp(np.log(target), x, row))) for row in y.T]


def time_ratio(other, own, target):
    """Return the median ratio of run times at equal error and the median run times [s], or nan."""
    theirs, ours = seconds_at(target, other), seconds_at(target, own)
    rounds = [b / a for a, b in zip(ours, theirs, strict=True)]
    return median(rounds), median(theirs), median(ours)
