"""Interleaved timing of several functions on a noisy machine.

All functions are called in each round, so that machine load slows all of them equally.
"""

import gc
import math
import statistics
from contextlib import contextmanager
from time import perf_counter

SAMPLE = 2e-3  # shorter calls are repeated for this long in each round [s]


@contextmanager
def pause_gc():
    gc.disable()
    try:
        yield
    finally:
        gc.enable()


def time_once(call):
    begin = perf_counter()
    call()
    return perf_counter() - begin


def time_sample(call, seconds):
    """Return the mean run time [s] of a function; `seconds` is a rough estimate of this time."""
    number = max(1, math.ceil(SAMPLE / seconds))
    with pause_gc():
        begin = perf_counter()
        for _ in range(number):
            call()
        return (perf_counter() - begin) / number


def time_in_turn(calls, seconds, rounds):
    """Return the run times of each function. `seconds` is the approximate duration of each call."""
    samples = [[] for _ in calls]
    for _ in range(rounds):
        for call, estimate, times in zip(calls, seconds, samples, strict=True):
            times.append(time_sample(call, estimate))
    return samples


def best_times(calls, rounds, trials=1):
    """Return the shortest run time of each function."""
    estimates = [min(time_once(call) for _ in range(trials)) for call in calls]
    return [min(times) for times in time_in_turn(calls, estimates, rounds)]


def relative_spread(samples):
    """Return the interquartile range of the samples, relative to the median."""
    if len(samples) < 2:
        return 0.0
    low, middle, high = statistics.quantiles(samples, n=4, method="inclusive")
    return (high - low) / middle
