"""The accuracy of the reference solutions, estimated from independent computations."""

from functools import partial

from ..references import reference
from . import scene_runs
from .part import write_csv
from .tasks import Task

MANY = ("128", "30 digits")  # the names of high-precision computations contain one of these words


def ways_key(problem):
    return f"ways/{problem.name}"


def list_tasks(problems, size, store):
    for problem, end in problems:
        yield scene_runs.make_truth_task(problem, end)
        yield Task(ways_key(problem), partial(compare_truths, problem, end, store), 1.0)


def compare_truths(problem, end, store):
    truth = store.known[scene_runs.truth_key(problem)]
    return list(reference.compare_computations(problem, end, truth))


def load_findings(problems, store):
    """Return the deviations [rad] of independent computations from the reference of each scene."""
    return [
        {
            "scene": problem.name,
            "t": end,
            "conditioning": store.known[scene_runs.truth_key(problem)]["conditioning"],
            "ways": [*store.known[ways_key(problem)], *heyoka_in_double(store, problem.name)],
        }
        for problem, end in problems
        if ways_key(problem) in store.known
    ]


def heyoka_in_double(store, scene):
    """Return the error of heyoka in double precision at its smallest tolerance."""
    rows = (row for row in scene_runs.load_runs(store, scene) if row.method == "heyoka")
    errors = [row.attitude_error for row in rows if not row.failure]
    return [("heyoka, double", errors[-1])] if errors else []


def build_context(lines):
    """Compare the deviations with the angle by which one rounding of the data moves the attitude.

    The context has the largest ratio of each scene for computations with many digits, and the
    largest ratio of all others.
    """
    ratios = [
        (angle / line["conditioning"], way, line["scene"])
        for line in lines
        for way, angle in line["ways"]
    ]
    high = {line["scene"]: 0.0 for line in lines}
    for ratio, way, scene in ratios:
        if any(word in way for word in MANY):
            high[scene] = max(high[scene], ratio)
    others = [each for each in ratios if not any(word in each[1] for word in MANY)]
    return {"truths": lines, "high": high, "double": max(others, default=None)}


def list_files(lines, metadata):
    rows = (
        {key: line[key] for key in ("scene", "t", "conditioning")}
        | {"computed_by": way, "away": angle}
        for line in lines
        for way, angle in line["ways"]
    )
    yield "truths.csv", write_csv(rows)
