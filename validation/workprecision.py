"""Error against run time: which runs are made, and what is known of each."""
from dataclasses import dataclass, field
from statistics import median

import numpy as np

import kreisel as kr

from . import contenders, measure, truth
from .contenders import Setting
from .scenes import attitude_error

STEPS = [2.0 ** -k for k in range(1, 16)]
TOLERANCES = [float(f"1e-{k}") for k in range(2, 16)]
QUICK = ([2.0 ** -k for k in (4, 6, 8)], [1e-4, 1e-8, 1e-12])
LIMIT = 0.1        # a method is not steered tighter once a run takes longer than this [s]
CHAOS = 1e-6        # only below this do errors that no longer fall mean that rounding is reached [rad]
LOOKS = 100         # about as many states are recorded for the energy


@dataclass
class Row:
    """One run: a method at one setting on one scene."""
    scene: str
    t: float
    method: str
    peer: bool
    step: float = None
    tol: float = None
    attitude_error: float = None
    energy_error: float = None
    steps: int = None
    evaluations: int = None
    setup_seconds: float = None
    failure: str = ""
    about: float = None                             # seconds of the first runs
    samples: list = field(default_factory=list)     # seconds of a run, one a round
    solve: callable = None

    @property
    def seconds(self):
        """The best of all rounds: a disturbance only ever adds."""
        return min(self.samples, default=None)

    @property
    def middle(self):
        return median(self.samples) if self.samples else None

    @property
    def spread(self):
        return measure.spread(self.samples) if self.samples else None


def looks(end, step):
    """Times to look at the energy: on the grid of every step, and about as many for every run."""
    every = max(2.0 ** np.floor(np.log2(end / LOOKS)), step or 0.0)
    return every * np.arange(int(end / every) + 1)


def try_out(problem, contender, end, setting, q_end):
    """Make a run and look at its errors; not yet at its time."""
    row = Row(problem.name, end, contender.name, contender.peer, setting.step, setting.tol)
    try:
        run = contender.make(problem, end, setting)
        q, m = run.record(looks(end, setting.step))
        row.about = min(measure.once(run.solve) for _ in range(2))
        row.attitude_error = attitude_error(run.solve(), q_end)
        row.energy_error = problem.energy_error(q, m)
    except (kr.Error, ValueError, ArithmeticError) as error:
        row.failure = str(error)
        return row
    row.steps, row.evaluations, row.setup_seconds, row.solve = run.steps, run.evaluations, run.setup, run.solve
    return row


def settings(contender, quick):
    steps, tolerances = QUICK if quick else (STEPS, TOLERANCES)
    if not contender.adaptive:
        return [Setting(step=h) for h in steps]
    tightest = contender.tightest or 0.0
    kept = [Setting(tol=tol) for tol in tolerances if tol > tightest]
    return kept + [Setting(tol=tightest)] if tightest else kept


def enough(rows):
    """Tighter settings would take too long, or gain nothing any more."""
    errors = [row.attitude_error for row in rows if not row.failure]
    if not errors:
        return False
    slow = rows[-1].about is not None and rows[-1].about > LIMIT
    at_the_floor = min(errors) < CHAOS and len(errors) - 1 - int(np.argmin(errors)) > 2
    return slow or at_the_floor


def explore(problem, end, quick=False, tick=lambda: None):
    """All runs on one scene, from loose to tight, with their errors against the truth."""
    q_end = truth.stored(problem.name, end)["attitude"]
    rows = []
    for contender in (*contenders.ours(problem), *contenders.PEERS):
        own = []
        for setting in settings(contender, quick):
            own.append(try_out(problem, contender, end, setting, q_end))
            tick()
            if enough(own):
                break
        rows += own
    return rows


def time_all(rows, budget, rounds=15, tick=lambda: None, plan=lambda rounds: None):
    """Time the runs of all scenes, in turn, in as many rounds as the budget [s] allows. True if interrupted."""
    timed = [row for row in rows if not row.failure]
    cost = sum(max(row.about, measure.SAMPLE) for row in timed)
    rounds = max(3, min(rounds, int(budget / cost)))
    plan(rounds * len(timed))
    samples, interrupted = measure.interleaved([row.solve for row in timed], [row.about for row in timed], rounds, tick)
    for row, got in zip(timed, samples):
        row.samples = got or [row.about]        # interrupted in the first round
    return interrupted


# A method reaches a target where attitude and energy error are within it and the next tighter run is not much worse:
# errors at one moment change sign with the setting, and a lucky zero must not win.
LUCK = 3.0


def reaching(rows, target):
    """The fastest of one method's rows, from loose to tight, that reaches the target; None if none does."""
    good = [row for row, tighter in zip(rows, rows[1:]) if row.seconds and not tighter.failure
            and max(row.attitude_error, row.energy_error) <= target and tighter.attitude_error <= LUCK * target]
    return min(good, key=lambda row: row.seconds, default=None)


def by_method(rows, scene):
    """The rows of one scene, method by method."""
    groups = {}
    for row in rows:
        if row.scene == scene:
            groups.setdefault(row.method, []).append(row)
    return groups
