"""The page: for somebody who has not read the thesis."""

from pathlib import Path

import jinja2
import kreisel as kr
import numpy as np

from ..parts import atlas_cases, ensemble, judge, left_out, omissions
from ..parts.published import problems as published_problems
from ..parts.workprecision import LUCK, by_method
from ..peers import contenders
from . import figures, heatmap, tables, verdicts
from .families import families

ABOUT = {
    "thesis": """The top of the thesis: an upright box, 1.6 by 1.6 by 2, that stands on the middle of its lower face. It is a
        <em>Lagrange top</em>: two moments of inertia are equal and the centre of mass lies on the third axis. Let go, it
        falls, swings through below and comes up again, over and over, while it circles about the vertical: a regular
        motion.""",
    "kowalewski": """A flat box, 3.5 by 2 by 1, held in the middle of a large face, with sides chosen such that two moments
        of inertia are equal and the third is half of them: the <em>Kowalewski top</em>. Its motion is regular too, but
        nothing about it looks so; methods for symmetric tops only do not apply.""",
    "goryachev_chaplygin": """Another flat box, whose third moment is a quarter of the equal two: the <em>Goryachev-Chaplygin
        top</em>, regular only while its angular momentum has no vertical part. Beside such a motion lie chaotic ones.""",
    "asymmetric": """A box, 1.2 by 1.6 by 2, held at a point beside the middle of its lower face: three different moments of
        inertia and no symmetry. Its motion is <em>chaotic</em>: small errors grow exponentially. By t = 100, one rounding
        of the data moves the attitude a million times as far as by t = 30, hence the full comparison ends at t = 30.""",
    "asymmetric_regular": """A box of three different sides, held in the middle of its lower face, that spins fast enough to
        be regular.""",
    "fast": """The top of the thesis, spinning so fast that it hardly moves its axis. What is fast is simple, what is hard is
        slow: methods that turn a free body exactly take far larger steps here than those that follow each turn.""",
    "strong_gravity": """The top of the thesis, pulled ten times as much and spinning little: a heavy pendulum that circles.""",
}
QUANTITIES = {
    "attitude_error": "attitude error at the end [rad]",
    "energy_error": "energy error, relative",
}
COUNTED = (judge.BLOW_UP, judge.BEYOND, judge.REDUCED, judge.DRIFT)
SHOWN, SEEN = 30.0, 3000  # of the apex: turns or so, and how many states


def apex(problem, end):
    """Where the centre of mass goes, and how often the body turns in a unit of time."""
    path = kr.solve(problem.scene(), t=np.linspace(0, end, SEEN))
    return path.apex, np.linalg.norm(path.velocity, axis=1).mean() / (2 * np.pi)


def described_scene(problem):
    if not problem.user:
        return ABOUT[problem.name]
    return f"A scene of yours, of a body of kind {problem.user.body.kind}, gravity {problem.user.gravity:g}."


def scene_part(found, problem, end, groups_of):
    shown = end if end * problem.rate < 6 * SHOWN else 6 * SHOWN / problem.rate
    path, turns = apex(problem, shown)
    groups, true = by_method(found["rows"], problem.name), found["truths"][problem.name]
    floor = {"attitude_error": true["conditioning"]}
    main, *others = [
        (quantity, cost) for cost in ("seconds", "evaluations") for quantity in QUANTITIES
    ]

    def drawing(quantity, cost):
        return quantity, QUANTITIES[quantity], cost, floor.get(quantity)

    return {
        "name": problem.name,
        "end": f"{end:.4g}",
        "about": described_scene(problem),
        "shown": f"{shown:.3g}",
        "turns": verdicts.figure(turns * end),
        "apex": figures.apex_path(path),
        "verdict": verdicts.of_scene(found["rows"], problem.name),
        "panels": [
            {"label": title, "svg": svg}
            for title, svg in figures.error_against(groups, groups_of, *drawing(*main))
        ],
        "overviews": [
            {
                "label": f"{QUANTITIES[quantity]} against {figures.COSTS[cost]}",
                "svg": figures.front(groups, groups_of, *drawing(quantity, cost)),
            }
            for quantity, cost in others
        ],
        "times": list(tables.times(found["rows"], problem.name)),
    }


def truth_part(found):
    """The truths side by side: a line for each scene."""
    for problem, end in found["problems"]:
        true, groups = found["truths"][problem.name], by_method(found["rows"], problem.name)
        good = [row.attitude_error for row in groups.get("heyoka", []) if not row.failure]
        ways = [("heyoka, double", good[-1])] if good else []
        yield {
            "scene": problem.name,
            "end": end,
            "conditioning": true["conditioning"],
            "ways": [*found["ways"][problem.name], *ways],
        }


def atlas_part(cells):
    for name, (_, about) in atlas_cases.FAMILIES.items():
        own = [cell for cell in cells if cell["family"] == name]
        if own:
            yield {
                "name": name,
                "about": about,
                "svg": heatmap.family(own, columns(own)),
                "notes": list(notes(own)),
            }


def columns(cells):
    """Methods, then peers, as far as they ran."""
    ran = {cell["method"] for cell in cells}
    return [name for name in (*kr.methods, *contenders.RECORDERS) if name in ran]


def notes(cells):
    """What was stopped, refused, wrong in silence, or lost in spite of a tolerance: what is said, of which cases by which methods."""
    said = {}
    for cell in cells:
        if cell["verdict"] in ("stopped", "refused"):
            message = cell["message"].split(f": {cell['method']}")[
                0
            ]  # the rest is in the table's file
        elif cell["verdict"] == "silent" or cell["verdict"] == "lost" and cell["tol"]:
            message = f"off by {cell['attitude_error']:.1g} rad; finer, it comes out {cell['second_run']:.1g} rad away"
        else:
            continue
        word = "wrong in silence" if cell["verdict"] == "silent" else cell["verdict"]
        said.setdefault((word, message), {}).setdefault(cell["case"], []).append(cell["method"])
    for (word, message), cases in said.items():
        whom = {}
        for case, methods in cases.items():
            whom.setdefault(", ".join(methods), []).append(case)
        yield {
            "verdict": word,
            "message": message,
            "whom": [
                {"methods": methods, "cases": "; ".join(own)} for methods, own in whom.items()
            ],
        }


def verdict_counts(cells):
    """How often each method is what."""
    for name in columns(cells):
        own = [cell for cell in cells if cell["method"] == name]
        if own:
            known = [cell["attitude_error"] for cell in own if cell["verdict"] in heatmap.RAN]
            yield {
                "method": name,
                "cells": len(own),
                "middle": float(np.median(known)) if known else None,
                "counts": [sum(cell["verdict"] == word for cell in own) for word in judge.VERDICTS],
                "marks": [sum(cell["mark"] == letter for cell in own) for letter in COUNTED],
            }


def ensemble_part(found, groups_of):
    lines = list(ensemble.summary(found))
    for kind, about in ensemble.KINDS.items():
        errors = {name: sizes for name, (_, sizes) in ensemble.errors(found, kind).items()}
        if errors:
            yield {
                "kind": kind,
                "about": about,
                "panels": distribution_panels(errors, groups_of),
                "tops": len(next(iter(errors.values()))),
                "lines": [line for line in lines if line["kind"] == kind],
            }


def distribution_panels(errors, groups_of):
    return [
        {"label": title, "svg": figures.distributions(errors, family, peers)}
        for title, (family, peers) in groups_of.items()
        if any(name in errors for name in family)
    ]


def published_part(rows):
    for problem in published_problems():
        own = [row for row in rows if row["problem"] == problem.name]
        if own:
            yield {
                "name": problem.name,
                "source": problem.entry["source"],
                "end": problem.end,
                "energy_end": problem.energy_end,
                "others": problem.entry["others_measured"],
                "rows": own,
                "velocity": any("velocity_error" in row for row in own),
            }


def described_methods(found):
    """Name, order, what it is and where it comes from, for each that ran."""
    ran = {row.method for row in found["rows"]} | {cell["method"] for cell in found["cells"]}
    for name, method in kr.methods.items():
        if name in ran:
            yield {
                "name": name,
                "order": method.order or "varies",
                "text": method.text,
                "reference": method.reference,
            }
    for peer in contenders.PEERS:
        if peer.name in ran:
            yield {
                "name": peer.name,
                "order": peer.order,
                "text": peer.text,
                "reference": "for comparison",
            }


def digits(value, form=".0e"):
    return "–" if value is None else format(value, form)


def setup_times(rows):
    """What heyoka takes to compile its integrator, at loose and tight tolerances [s]."""
    known = [row.setup_seconds for row in rows if row.setup_seconds is not None]
    return (
        {"least": min(known), "middle": float(np.median(known)), "most": max(known)}
        if known
        else None
    )


def template(name):
    templates = jinja2.FileSystemLoader(Path(__file__).with_name("templates"))
    environment = jinja2.Environment(
        loader=templates,
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {"digits": digits, "milliseconds": tables.milliseconds}
    return environment.get_template(name)


def conclusions(found, names, truths):
    """A paragraph for each section, made from what was found; empty where there is nothing."""
    return {
        "workprecision": verdicts.of_workprecision(found["rows"], names),
        "truth": verdicts.of_truths(truths),
        "atlas": verdicts.of_atlas(found["cells"]),
        "stiff": verdicts.of_stiff(found["stiff"]),
        "ensemble": verdicts.of_ensemble(found["ensemble"]),
        "published": verdicts.of_published(found["published"]),
        "left_out": verdicts.of_left_out(found["left_out"]),
    }


def render(found, files):
    groups_of, truths = families(), list(truth_part(found))
    names = [problem.name for problem, _ in found["problems"]]
    return template("report.html").render(
        about=found["about"],
        files=files,
        luck=f"{LUCK:g}",
        setup=setup_times(found["rows"]),
        concluded=conclusions(found, names, truths),
        colours=dict(zip(groups_of, figures.COLOURS)),
        scenes=[scene_part(found, problem, end, groups_of) for problem, end in found["problems"]],
        summary=list(tables.summary(found["rows"], names)),
        references=tables.references(found["rows"]),
        targets=[tables.power(target) for target in tables.TARGETS],
        truths=truths,
        atlas=list(atlas_part(found["cells"])),
        verdicts=list(verdict_counts(found["cells"])),
        words=judge.VERDICTS,
        marks=judge.MARKS,
        signs=judge.SIGNS,
        counted=COUNTED,
        rule=judge,
        key=heatmap.key() if found["cells"] else "",
        stiff=list(figures.watched(found["stiff"])) if found["stiff"] else [],
        kinds=figures.kinds(found["stiff"]),
        ensembles=list(ensemble_part(found["ensemble"], groups_of)),
        given=1e3 * ensemble.GIVEN,
        turns=f"{ensemble.TURNS:g}",
        published=list(published_part(found["published"])),
        forms=left_out.table(found["left_out"]),
        omissions=found["omissions"],
        wanted=omissions.WANT,
        states=omissions.STATES,
        methods=list(described_methods(found)),
        failures=[row for row in found["rows"] if row.failure],
    )
