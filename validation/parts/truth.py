"""Whether the truth is true: how far each other way to compute it comes out."""

from functools import partial

from ..references import reference
from . import scene_runs
from .budget import Task
from .formatting import brief, in_a_row, listed
from .part import Part, csv_text

COLUMNS = ("scene", "t", "conditioning", "computed_by", "away")
MANY = ("128", "30 digits")  # in the names of the ways that have more digits than a double


def ways_key(problem):
    return f"ways/{problem.name}"


def tasks(problems, budget, store):
    for problem, end in problems:
        yield scene_runs.truth_task(problem, end)
        yield Task(ways_key(problem), partial(ways, problem, end, store), 1.0)


def ways(problem, end, store):
    return list(
        reference.compare_computations(problem, end, store.known[scene_runs.truth_key(problem)])
    )


def found(problems, store):
    """Gives a line for each scene: its truths side by side."""
    return [
        {
            "scene": problem.name,
            "end": end,
            "conditioning": store.known[scene_runs.truth_key(problem)]["conditioning"],
            "ways": [*store.known[ways_key(problem)], *in_double(store, problem.name)],
        }
        for problem, end in problems
        if ways_key(problem) in store.known
    ]


def in_double(store, scene):
    """Gives what heyoka comes to in doubles at its tightest, where it ran."""
    rows = (row for row in scene_runs.explored(store, scene) if row.method == "heyoka")
    errors = [row.attitude_error for row in rows if not row.failure]
    return [("heyoka, double", errors[-1])] if errors else []


def has_many_digits(way):
    return any(word in way for word in MANY)


def agreement(lines):
    """Gives for each scene how far the ways of many digits are from the truth, and which of the
    others is furthest, in roundings of the data."""
    for line in lines:
        apart = [(angle / line["conditioning"], way) for way, angle in line["ways"]]
        many = [angle for angle, way in apart if has_many_digits(way)]
        others = [each for each in apart if not has_many_digits(each[1])]
        yield line["scene"], max(many, default=0.0), max(others, default=(0.0, ""))


def concluded(lines):
    known = list(agreement(lines))
    return in_a_row(of_many_digits(known), of_doubles(known)) if known else ""


def of_many_digits(known):
    apart = [scene for scene, most, _ in known if most > 1.0]
    where = f"all scenes but {listed(apart)}" if apart else "every scene"
    most = max(most for _, most, _ in known)
    return (
        f"On {where} the truths of many digits agree within the conditioning: they lie at most "
        f"{most:.0e} of one rounding of the data apart."
    )


def of_doubles(known):
    scene, _, (worst, way) = max(known, key=lambda line: line[2][0])
    if not way:
        return ""
    return (
        f"Of the double and 80-bit results, that of {way} is least accurate: {brief(worst)} "
        f"roundings of the data on {scene}."
    )


def files(lines, about):
    rows = [
        (line["scene"], line["end"], line["conditioning"], *way)
        for line in lines
        for way in line["ways"]
    ]
    yield "truths.csv", csv_text(COLUMNS, (dict(zip(COLUMNS, row, strict=True)) for row in rows))


PART = Part(
    "truth",
    "Truth",
    "Is the truth true?",
    tasks,
    found,
    lambda lines: {"truths": lines},
    concluded,
    short="Truth",
    files=files,
    takes_own_scenes=True,
)
