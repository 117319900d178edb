"""Timing that is fair on a noisy machine: each call runs once a round, in turn, so that what
disturbs, disturbs all alike."""

import gc
import math
import statistics
from contextlib import contextmanager
from time import perf_counter

SAMPLE = 2e-3  # a call shorter than this is repeated until it fills it [s]


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


def time_repeated(call, seconds):
    """Measures the seconds of one call, where it is known to take about as long."""
    number = max(1, math.ceil(SAMPLE / seconds))
    with pause_gc():
        begin = perf_counter()
        for _ in range(number):
            call()
        return (perf_counter() - begin) / number


def time_interleaved(calls, seconds, rounds, tick=lambda: None):
    """Takes a sample of each call in each round; `seconds` says about how long each takes. Gives
    the samples, and whether Ctrl-C ended it early."""
    samples = [[] for _ in calls]
    try:
        for _ in range(rounds):
            for call, about, got in zip(calls, seconds, samples, strict=True):
                got.append(time_repeated(call, about))
                tick()
    except KeyboardInterrupt:
        return samples, True
    return samples, False


def best_times(calls, rounds, trials=1):
    """Gives the least seconds of each call over the rounds, for a disturbance only ever adds."""
    about = [min(time_once(call) for _ in range(trials)) for call in calls]
    samples, interrupted = time_interleaved(calls, about, rounds)
    if interrupted:
        raise KeyboardInterrupt
    return [min(got) for got in samples]


def relative_spread(samples):
    """Gives the distance of the quartiles, as a part of the median."""
    if len(samples) < 2:
        return 0.0
    low, middle, high = statistics.quantiles(samples, n=4, method="inclusive")
    return (high - low) / middle
