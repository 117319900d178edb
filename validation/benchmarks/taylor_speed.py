"""Interleaved timing of several functions, used by studies of the Taylor method."""

from statistics import median

from ..competitors import timing


def median_times(calls, rounds=41):
    """Return estimates of the run times of several functions, which are called alternately.

    The estimate for each function after the first is the median time of the first function,
    multiplied by the median ratio of the two run times.
    """
    estimates = [min(timing.time_once(call) for _ in range(2)) for call in calls]
    first, *others = timing.time_in_turn(calls, estimates, rounds)
    ratios = (median(b / a for a, b in zip(first, other, strict=True)) for other in others)
    return [median(first), *(median(first) * ratio for ratio in ratios)]
