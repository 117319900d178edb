"""The chapter: runs the experiments and writes thesis.html.

kreisel report --thesis [--out report]
"""

import time
from dataclasses import dataclass

import kreisel as kr
import numpy as np

from ..peers import machine
from ..report import page
from . import errata, experiments, figures5, figures6, integrals, sentences, sentences6
from .charts import BLUE, ORANGE, scatter
from .runs import IMPROVED, SCENE, Run, frame_error, truth

OUTPUT = "thesis.html"
INTERVALS = (0.2, 0.1, 0.01)  # for which a frame is frozen (3.4)


@dataclass(frozen=True)
class Results:
    """All that is run."""

    four: experiments.Four
    failing: experiments.Four
    growth: np.ndarray
    timed: experiments.Timed
    crossings: list
    by_step: dict
    k: integrals.Fourth
    g: integrals.Fourth
    forms: list
    frozen: dict
    first_steps: dict
    loose: dict


def run_all(say):
    say("experiment 6.1, to t = 600")
    four = experiments.four()
    say("experiment 6.2, to t = 3200")
    timed = experiments.timed()
    crossings = experiments.crossings(timed)
    say("the failing one, 6.3, the fourth integrals, the forms of the equations")
    return Results(
        four,
        experiments.failing(),
        experiments.growth(),
        timed,
        crossings,
        experiments.equal_evaluations(),
        integrals.fourth("kowalewski"),
        integrals.fourth("goryachev_chaplygin"),
        integrals.forms(),
        {interval: integrals.frozen_frame(interval) for interval in INTERVALS},
        experiments.other_first_steps(timed),
        experiments.loose(),
    )


def chapter5_figures(run):
    end, four = run.four.t[-1], run.four
    ends = f"{end:g} is {round(end / four.eps2)} times eps2 and {round(end / four.eps1)} times eps1"
    return [
        *figures5.special(),
        figures5.integral("kowalewski", run.k),
        figures5.integral("goryachev_chaplygin", run.g),
        *figures5.analogies(),
        *figures5.comparing(run.four, ends),
    ]


def chapter6_figures(run):
    stills = list(figures6.stills(run.four))
    return [
        *stills,
        figures6.first(),
        *figures6.frames(run.four),
        *figures6.integrals(run.four),
        *figures6.cause(run.four),
        *figures6.failing(run.failing, run.growth),
        *figures6.timed(run.timed),
        *figures6.equal_evaluations(run.by_step),
    ]


def all_sentences(run):
    return [
        *sentences.chapter3(run.forms, run.frozen),
        *sentences.chapter4(run.four),
        *sentences.chapter5(run.k, run.g, integrals.values_of_k()),
        *sentences6.visual(run.four, run.loose),
        *sentences6.integrals(run.four),
        *sentences6.strong(run.failing, run.growth),
        *sentences6.settings(run.timed, run.first_steps),
        *sentences6.timed(run.timed, run.crossings),
        *sentences6.runge_kutta(run.by_step),
        *sentences6.conclusions(run.four, run.timed),
    ]


def forms_chart(forms, scene):
    looks = {
        "extrap": ("rest frame (extrap)", BLUE, "o-"),
        "extrap_kirchhoff": ("body (extrap_kirchhoff)", ORANGE, "s-"),
    }
    groups = []
    for form, (label, colour, marker) in looks.items():
        rows = [row for row in forms if row.scene == scene and row.form == form]
        groups.append(
            (label, [row.evaluations for row in rows], [row.error for row in rows], colour, marker)
        )
    return scatter(groups, f"evaluations, {scene}", "attitude error at the end [rad]")


def units_table():
    """4.2.1 for the cuboid: text and truth."""
    units = kr.scaled_units(SCENE.body)
    scaled = units.into(SCENE)
    n, _, t = figures5.HALF
    third = SCENE.body.mass / 3
    return [
        ("unit of length", f"{t:g}", f"{units.length:g}"),
        ("unit of mass = I1", f"{third * (n * n + t * t):.4f}", f"{units.mass:.4f}"),
        ("alpha = I3", f"{2 * n * n / (n * n + t * t):.4f}", f"{scaled.body.moments[2]:.4f}"),
        ("p, with the mass", "1", f"{scaled.body.mass * scaled.gravity:.4f}"),
        ("factor of m", f"{1 / (third * (n * n + t * t)):.4f}", f"{1 / units.mass:.4f}"),
        (
            "H_eps of experiment 6.1 at the start, eps = 0.2",
            "",
            f"{kr.h_eps(truth(scaled, [0.0]).path, 0.2)[0]:.6f}",
        ),
    ]


def about(run, seconds):
    """With what: the machine, and how far the truth of experiment 6.2 is from extrap at its tightest."""
    extrap = kr.solve(SCENE, run.timed.t, method="extrap", tol=1e-13)
    return machine.described() | {
        "seconds": f"{seconds:.0f}",
        "truth": run.timed.true.path.method,
        "improved": IMPROVED,
        "agreement": f"{frame_error(Run(extrap, 0), run.timed.true).max():.0e}",
    }


def render(run, seconds):
    said, wrong = all_sentences(run), errata.all_of_them()
    return page.template("thesis.html").render(
        about=about(run, seconds),
        six=chapter6_figures(run),
        five=chapter5_figures(run),
        sentences=said,
        errata=wrong,
        held=sum(sentence.holds for sentence in said),
        forms=[forms_chart(run.forms, scene) for scene in ("thesis", "asymmetric")],
        rows=run.forms,
        frozen=run.frozen,
        units=units_table(),
        timed=run.timed,
        meet=sentences6.overtaken(run.timed),
    )


def main(out):
    begin = time.perf_counter()
    run = run_all(lambda what: print(what, flush=True))
    print("figures, sentences, errata", flush=True)
    text = render(run, time.perf_counter() - begin)
    out.mkdir(parents=True, exist_ok=True)
    (out / OUTPUT).write_text(text)
    print(f"{out / OUTPUT}: {len(text) / 1e6:.1f} MB in {time.perf_counter() - begin:.0f} s")
    return 0
