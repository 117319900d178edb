"""The accuracy of the reference solutions, estimated from independent computations."""

from functools import partial

from ..references import reference
from . import scene_runs
from .formatting import format_brief, join_sentences, join_words
from .part import Part, write_csv
from .tasks import Task

COLUMNS = ("scene", "t", "conditioning", "computed_by", "away")
MANY = ("128", "30 digits")  # the names of high-precision computations contain one of these words


def ways_key(problem):
    return f"ways/{problem.name}"


def list_tasks(problems, size, store):
    for problem, end in problems:
        yield scene_runs.make_truth_task(problem, end)
        yield Task(ways_key(problem), partial(compare_truths, problem, end, store), 1.0)


def compare_truths(problem, end, store):
    return list(
        reference.compare_computations(problem, end, store.known[scene_runs.truth_key(problem)])
    )


def load_findings(problems, store):
    """Return the deviations [rad] of independent computations from the reference of each scene."""
    return [
        {
            "scene": problem.name,
            "end": end,
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


def has_many_digits(way):
    return any(word in way for word in MANY)


def summarize_agreement(lines):
    """Yield the largest differences between several computations of the reference solution.

    Each difference is divided by the change in attitude that rounding errors in the input cause.
    """
    for line in lines:
        ratios = [(angle / line["conditioning"], way) for way, angle in line["ways"]]
        many = [angle for angle, way in ratios if has_many_digits(way)]
        others = [each for each in ratios if not has_many_digits(each[1])]
        yield line["scene"], max(many, default=0.0), max(others, default=(0.0, ""))


def conclude(lines):
    summary = list(summarize_agreement(lines))
    return (
        join_sentences(describe_high_precision(summary), describe_double_precision(summary))
        if summary
        else ""
    )


def describe_high_precision(summary):
    outliers = [scene for scene, most, _ in summary if most > 1.0]
    scenes = f"all scenes but {join_words(outliers)}" if outliers else "every scene"
    most = max(most for _, most, _ in summary)
    return (
        f"On {scenes} the high-precision results agree within the conditioning. They differ by at "
        f"most {most:.0e} times the angle by which rounding the data to doubles moves the attitude."
    )


def describe_double_precision(summary):
    scene, _, (worst, way) = max(summary, key=lambda line: line[2][0])
    if not way:
        return ""
    return (
        f"Among the results in double and 80-bit precision, {way.replace(', ', ' in ')} has the "
        "largest error: "
        f"{format_brief(worst)} times this angle, on {scene}."
    )


def list_files(lines, metadata):
    rows = [
        (line["scene"], line["end"], line["conditioning"], *way)
        for line in lines
        for way in line["ways"]
    ]
    yield "truths.csv", write_csv(COLUMNS, (dict(zip(COLUMNS, row, strict=True)) for row in rows))


PART = Part(
    "truth",
    "Truth",
    "Are the reference solutions accurate?",
    list_tasks,
    load_findings,
    lambda lines: {"truths": lines},
    conclude,
    list_files=list_files,
    accepts_user_scenes=True,
)
