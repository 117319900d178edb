"""Timing that is fair on a noisy machine: every run once a round, in turn, so that what disturbs, disturbs all alike."""

import gc
import math
import statistics
from contextlib import contextmanager
from time import perf_counter

SAMPLE = 2e-3  # a run shorter than this is repeated until it fills it [s]


@contextmanager
def undisturbed():
    gc.disable()
    try:
        yield
    finally:
        gc.enable()


def once(call):
    begin = perf_counter()
    call()
    return perf_counter() - begin


def sample(call, seconds):
    """Seconds of one call, where it is known to take about as long."""
    number = max(1, math.ceil(SAMPLE / seconds))
    with undisturbed():
        begin = perf_counter()
        for _ in range(number):
            call()
        return (perf_counter() - begin) / number


def interleaved(calls, seconds, rounds, tick=lambda: None):
    """Samples of each call, `rounds` of them, each with about the given seconds. On Ctrl-C those that there are."""
    samples = [[] for _ in calls]
    try:
        for _ in range(rounds):
            for call, about, got in zip(calls, seconds, samples):
                got.append(sample(call, about))
                tick()
    except KeyboardInterrupt:
        return samples, True
    return samples, False


def spread(samples):
    """Distance of the quartiles, as a part of the median."""
    if len(samples) < 2:
        return 0.0
    low, middle, high = statistics.quantiles(samples, n=4, method="inclusive")
    return (high - low) / middle
