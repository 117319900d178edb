"""The fastest methods for given target errors, and tables of their run times."""

from rich.table import Table

from .formatting import format_digits, format_milliseconds, format_power
from .scene_runs import group_by_method

# The other integrators in the tables, with their titles.
REFERENCES = {"heyoka": "heyoka", "gsl_rk8pd": "GSL rk8pd", "scipy_dop853": "SciPy DOP853"}
TARGETS = (1e-3, 1e-6, 1e-9, 1e-12)  # targets for the attitude error [rad]
# A method reaches a target if attitude and energy error meet it and the next tighter run
# is not much worse. Errors at one time change sign with the setting, and an accidental zero
# must not win.
LUCK = 3.0
# run times within this ratio count as equal, because neighbouring settings differ by 2 or 10
TIE = 4 / 3


def fastest_reaching(rows, target):
    """Return the fastest run of one method that reaches the target error, or None if there is none.

    The list `rows` is sorted by increasing accuracy.
    """
    tighter = rows[1:] if rows[0].step or rows[0].tol else rows  # a closed form has a single run
    good = [
        row
        for row, following in zip(rows, tighter, strict=False)
        if not row.failure
        and row.seconds
        and not following.failure
        and max(row.attitude_error, row.energy_error) <= target
        and following.attitude_error <= LUCK * target
    ]
    return min(good, key=lambda row: row.seconds, default=None)


def fastest_row(rows, scene, target, is_candidate):
    """Return the fastest run that reaches the target error and satisfies `is_candidate`."""
    hits = [
        hit
        for own in group_by_method(rows, scene).values()
        if is_candidate(own[0]) and (hit := fastest_reaching(own, target))
    ]
    return min(hits, key=lambda row: row.seconds, default=None)


def fastest_with_step(rows, scene, target):
    return fastest_row(rows, scene, target, lambda row: not row.peer and row.step is not None)


def run_races(rows, scenes):
    """Return (scene, target, kreisel's fastest run, that of the others) for each target error."""
    return [
        (
            scene,
            target,
            fastest_row(rows, scene, target, lambda row: not row.peer),
            fastest_row(rows, scene, target, lambda row: row.peer),
        )
        for scene in scenes
        for target in TARGETS
    ]


def is_faster(one, other):
    """Return True if one run is clearly faster than the other."""
    return bool(one and (not other or TIE * one.seconds < other.seconds))


def times_to_targets(rows, scene):
    """Yield each method, its smallest error, and pairs (time, is the fastest) by target error."""
    groups = group_by_method(rows, scene)
    seconds = {
        name: [hit and hit.seconds for hit in (fastest_reaching(own, target) for target in TARGETS)]
        for name, own in groups.items()
    }
    columns = zip(*seconds.values(), strict=True)
    fastest = [min((s for s in column if s), default=None) for column in columns]
    for name, own in groups.items():
        errors = [row.attitude_error for row in own if not row.failure]
        cells = [
            (format_milliseconds(s), s is not None and s == least)
            for s, least in zip(seconds[name], fastest, strict=True)
        ]
        yield name, format_digits(min(errors, default=None)), cells


def list_references(methods):
    """Return a dictionary from the names of the other integrators to their titles."""
    return {name: title for name, title in REFERENCES.items() if name in methods}


def list_hits(rows, scenes):
    """Yield (scene, target, kreisel's fastest run, {other integrator: its fastest run})."""
    references = list_references({row.method for row in rows})
    for scene, target, own, _ in run_races(rows, scenes):
        yield (
            scene,
            target,
            own,
            {
                name: fastest_row(rows, scene, target, lambda row, name=name: row.method == name)
                for name in references
            },
        )


def summarize_races(rows, scenes):
    """Yield the run times of kreisel and other integrators for each scene and target error."""
    for scene, target, own, others in list_hits(rows, scenes):
        yield {
            "scene": scene,
            "target": format_power(target),
            "own": format_milliseconds(own and own.seconds),
            "method": own.method if own else "",
            "others": [format_milliseconds(hit and hit.seconds) for hit in others.values()],
        }


def make_terminal_table(rows, scene, end):
    title = f"{scene} to t = {end:g}: run time \\[ms] for an attitude error of"
    table = Table(title=title, title_justify="left")
    table.add_column("method")
    for target in TARGETS:
        table.add_column(f"{format_power(target)} rad", justify="right")
    table.add_column("smallest", justify="right")
    for name, smallest, cells in times_to_targets(rows, scene):
        texts = [f"[bold]{text}[/]" if is_fastest else text for text, is_fastest in cells]
        table.add_row(name, *texts, smallest)
    return table
