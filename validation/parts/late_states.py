"""Run times of closed forms and integrators for computing the state at a large time."""

import kreisel as kr
import numpy as np

from ..competitors import timing
from ..competitors.single_runs import EPS, HeyokaRun, KreiselRun, Setting
from ..references import reference
from ..references.problems import attitude_error
from .formatting import format_large
from .tasks import Task

LATE, QUICK = 1e6, 1e3  # time of the state [T]
PART = 0.1  # heyoka runs to this fraction of the time; its run time is proportional to the time
EARLY = 1e-3  # the error is measured at this fraction of the time; 128 bits are slow
ROUNDS = 3


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
    exact, taylor = (KreiselRun(name, problem, t, Setting()) for name in ("exact", "taylor"))
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


def late_context(entry):
    """Return the measured run times and the ratios of taylor and heyoka to the closed form."""
    ratios = {
        f"over_{own}": " and ".join(
            format_large(entry[name] / entry[own]) for name in ("taylor", "heyoka")
        )
        for own in ("exact", "state")
    }
    return entry | ratios | {"part": PART, "early": EARLY * entry["t"]}
