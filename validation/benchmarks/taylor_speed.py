"""Timing of functions, called alternately in one process, for studies of the Taylor method."""

from statistics import median

from ..competitors import timing


def median_times(calls, rounds=41):
    """Return the median time of the first call, and estimates of the times of the other calls.

    All calls are interleaved. The estimate for a call is the median time of the first call,
    multiplied by the median ratio of the two times in a round.
    """
    about = [min(timing.time_once(call) for _ in range(2)) for call in calls]
    (first, *others), _ = timing.time_in_turn(calls, about, rounds)
    ratios = (median(b / a for a, b in zip(first, other, strict=True)) for other in others)
    return [median(first), *(median(first) * ratio for ratio in ratios)]
