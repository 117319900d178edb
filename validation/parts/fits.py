"""Comparison of kreisel.fit with SciPy's curve_fit and lmfit on simulated measurements."""

import math
from functools import partial

import kreisel as kr
import numpy as np

from ..competitors.timing import time_once
from .part import write_csv
from .tasks import Task

TIMES = np.linspace(0.0, 5.0, 334)
SHORT = 60  # number of times of a quick report
NOISE = 0.05  # standard deviation of the angular velocity [T^-1]
SEED = 1
OFF = 1.01  # factor of the guess of moments, lever and angular velocity
MOMENT, LAST = 6, 8  # places of the first and the last moment among the parameters
OWN = "kreisel"


def load_fitters():
    """Return a dictionary that maps the name of each program to its fitting function."""
    from ..competitors.curve_fitters import FITTERS  # imports SciPy's integrators

    return FITTERS


def make_scene(factor):
    """Return a heavy asymmetric top whose moments, lever and velocity are off by a factor."""
    moments = np.array((1.0, 1.3, 0.6)) * (factor, 1.0 / factor, factor)
    body = kr.Body(1.0, moments, com=(0.0, 0.0, 0.4 * factor), unphysical=True)
    velocity = np.array((3.0, 2.0, 12.0)) * factor
    attitude = np.array((0.9, 0.3, 0.2, 0.1))
    attitude /= np.linalg.norm(attitude)
    return kr.Scene(body, attitude=attitude, body_velocity=velocity, gravity=9.81)


def make_record(times):
    noise = np.random.default_rng(SEED).normal(size=(len(times), 3))
    return kr.solve(make_scene(1.0), times).body_velocity + NOISE * noise


def measure_fit(name, times, rounds):
    """Fit simulated measurements, and return a moment of inertia and its standard error."""
    values, guess, results = make_record(times), make_scene(OFF), []
    fit = load_fitters()[name]
    seconds = min(
        time_once(lambda: results.append(fit(guess, times, values, NOISE))) for _ in range(rounds)
    )
    parameters, errors, messages = results[0]
    error = errors[MOMENT]
    return {
        "name": name,
        "numbers": values.size,
        "seconds": seconds,
        "moment": float(parameters[MOMENT]),
        "error": None if error is None or not math.isfinite(error) else float(error),
        "ratio": float(parameters[MOMENT] / parameters[LAST]),
        "messages": messages,
    }


def list_tasks(problems, size, store):
    times = TIMES[:SHORT] if size.quick else TIMES
    for name in load_fitters():
        weight, rounds = (0.2, size.rounds) if name == OWN else (4.0, 1)
        yield Task(f"fits/{name}", partial(measure_fit, name, times, rounds), weight)


def load_findings(problems, store):
    return store.under("fits/")


def build_context(rows):
    truth = make_scene(1.0).body.moments
    seconds = {row["name"]: row["seconds"] for row in rows}
    own = seconds.pop(OWN, None)
    return {
        "rows": rows,
        "numbers": rows[0]["numbers"],
        "truth": truth[0],
        "ratio": truth[0] / truth[2],
        "faster": min(seconds.values()) / own if own and seconds else None,
    }


def list_files(rows, metadata):
    yield "fits.csv", write_csv(rows)
