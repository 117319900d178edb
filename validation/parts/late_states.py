"""Run times of closed forms and integrators for computing the state at a large time."""

import kreisel as kr
import numpy as np

from ..competitors import timing
from ..competitors.single_runs import EPS, HeyokaRun, KreiselRun, Setting
from ..references import reference
from ..references.problems import attitude_error
from .formatting import format_large, format_milliseconds
from .tasks import Task

LATE, QUICK = 1e6, 1e3  # time of the state [T]
PART = 0.1  # heyoka runs to this fraction of the time; its run time is proportional to the time
EARLY = 1e-3  # the error is measured at this fraction of the time; 128 bits are slow
ROUNDS = 3
INTEGRATORS = "taylor", "heyoka"


def make_closed_form(problem):
    """Return the closed form of a Kowalewski or Goryachev-Chaplygin top, or None for other tops."""
    try:
        form = kr.exact(problem.to_scene())
    except ValueError:
        return None
    return form if isinstance(form, kr.ExactTorus) else None


def late_key(problem):
    return f"late/{problem.name}"


def list_tasks(problem, size):
    if make_closed_form(problem):
        weight = 0.5 if size.quick else 12.0
        yield Task(late_key(problem), lambda: measure_late_state(problem, size.quick), weight)


def measure_late_state(problem, quick):
    """Return the run times [s] of exact, taylor and heyoka for the state at a large time."""
    t = QUICK if quick else LATE
    form = make_closed_form(problem)
    exact, taylor = (
        KreiselRun(method, problem, t, setting)
        for method, setting in (("exact", Setting()), ("taylor", Setting()))
    )
    heyoka = HeyokaRun(problem, PART * t, Setting(tol=EPS))
    calls = exact.solve, lambda: form(t), taylor.solve, heyoka.solve
    whole, state, series, part = timing.best_times(calls, ROUNDS)
    (truth,) = reference.integrate_states(problem, [EARLY * t])
    early = KreiselRun("exact", problem, EARLY * t, Setting()).attitude()
    return {
        "t": t,
        "exact": whole,
        "state": state,
        "taylor": series,
        "heyoka": part / PART,
        "error": attitude_error(early, np.array(truth[:4], dtype=np.longdouble)),
    }


def describe_late_state(entry):
    """Describe how long each method takes to compute the state of a top at a large time."""
    if not entry:
        return ""
    times = {name: entry[name] for name in ("exact", "state", "taylor", "heyoka")}
    texts = {name: format_milliseconds(seconds) for name, seconds in times.items()}
    whole = " and ".join(format_large(entry[name] / entry["exact"]) for name in INTEGRATORS)
    state = " and ".join(format_large(entry[name] / entry["state"]) for name in INTEGRATORS)
    return (
        f"One state at t = {entry['t']:g}: the closed form takes {texts['exact']} ms with its "
        f"preparation and {texts['state']} ms without, taylor {texts['taylor']} ms, and heyoka "
        f"about {texts['heyoka']} ms, scaled from a run to {PART:g} of this time. The integrators "
        f"take {whole} times as long as the closed form with its preparation, and {state} times "
        f"as long as without. At t = {EARLY * entry['t']:g}, the error of the closed form is "
        f"{entry['error']:.0e} rad relative to heyoka in 128 bit."
    )
