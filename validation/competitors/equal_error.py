"""What many tops cost at equal error: movers run in turn, round by round; each one's time is read
off between its settings, on straight lines in logarithms, where its median error is the same.
"""

from dataclasses import dataclass
from math import nan
from statistics import median

import numpy as np

from ..references.problems import attitude_errors
from . import timing

NEAR = 1.2  # the tightest error is this much above the larger of two floors, which scatter


@dataclass(frozen=True)
class Run:
    """One mover at one setting."""

    mover: str
    setting: str
    tops: int
    middle: float  # median of the attitude errors of a sample [rad]
    bad: float  # 90 % are below [rad]
    worst: float
    seconds: list  # for one top, in each round

    @property
    def microseconds(self):
        return 1e6 * median(self.seconds)


def measure_runs(tops, movers, truths, rounds, threads=2, tick=lambda: None):
    """Makes each call, takes its errors on the tops whose truths are known, and times all in turn:
    first all at their loosest, so that what is compared ran within a short time."""
    asked = [
        (place / len(who.settings), who, setting, who.tops(tops))
        for who in movers
        for place, setting in enumerate(who.settings)
    ]
    calls = [who.make(own, setting, threads) for _, who, setting, own in asked]
    errors = [sample_errors(call(), truths) for call in calls]
    seconds = [[] for _ in calls]
    in_turn = sorted(range(len(calls)), key=lambda i: asked[i][0])
    for _ in range(rounds):
        for i in in_turn:
            (_, who, _, own), took = asked[i], seconds[i]
            is_known = took and who.is_timed_once
            took.append(took[0] if is_known else time_per_top(calls[i], who, own, threads))
            tick()
    return [
        Run(who.name, str(setting), len(own), *spread, took)
        for (_, who, setting, own), spread, took in zip(asked, errors, seconds, strict=True)
    ]


def sample_errors(q, truths):
    """Gives median, 90 % and largest of the errors of those tops whose truths are known."""
    known = min(len(q), len(truths))
    sizes = attitude_errors(q[:known], truths[:known])
    return [float(np.quantile(sizes, part)) for part in (0.5, 0.9, 1.0)]


def time_per_top(call, who, tops, threads):
    """Gives the seconds of one top; a mover of one thread is taken to share the tops perfectly."""
    with timing.pause_gc():
        return timing.time_once(call) / len(tops) / (threads if who.is_serial else 1)


def group_by_mover(found):
    groups = {}
    for run in found:
        groups.setdefault(run.mover, []).append(run)
    return groups


def tightest_common_error(own, other):
    """Gives the smallest error that both reach, and keep at tighter settings."""
    return NEAR * max(own[-1].middle, other[-1].middle)


def seconds_at(target, own):
    """Gives for each round what a top costs at that median error; nan where it is not reached. An
    error counts as large as the largest of all tighter settings; looser than the loosest costs as
    much as that."""
    errors = np.maximum.accumulate([run.middle for run in own][::-1])[::-1]
    kept = [0, *(i for i in range(1, len(own)) if errors[i] < errors[i - 1])]
    if target < errors[-1]:
        return [nan] * len(own[0].seconds)
    x = np.log(np.maximum(errors[kept], 1e-17))[::-1]
    y = np.log([own[i].seconds for i in kept])[::-1]
    return [float(np.exp(np.interp(np.log(target), x, row))) for row in y.T]


def time_ratio(other, own, target):
    """Gives the median over the rounds of the other's time over the own, and both times [s]; nan
    where one does not reach the error."""
    theirs, ours = seconds_at(target, other), seconds_at(target, own)
    rounds = [b / a for a, b in zip(ours, theirs, strict=True)]
    return median(rounds), median(theirs), median(ours)
