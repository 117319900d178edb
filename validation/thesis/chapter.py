"""The chapter on the thesis: runs the experiments and writes thesis.html."""

import time
from dataclasses import dataclass
from pathlib import Path

import kreisel as kr
import numpy as np

from ..parts.store import put_whole
from ..peers import machine
from ..report import page
from . import (
    errata_maps,
    errata_mechanics,
    experiments,
    figures_chapter5,
    figures_chapter6,
    integrals,
    sentences_chapter6,
    sentences_chapters3_to_5,
    sentences_conclusions,
)
from .courses import HALF, IMPROVED, SCENE, Course, frame_error, truth
from .line_charts import BLUE, ORANGE, scatter
from .scaled_units import h_eps, scaled_units

HERE = Path(__file__).parent
TEMPLATE = OUTPUT = "thesis.html"
INTERVALS = (0.2, 0.1, 0.01)  # for which a frame is frozen (3.4)
FORMS = {
    "extrap": ("rest frame (extrap)", BLUE, "o-"),
    "extrap_kirchhoff": ("body (extrap_kirchhoff)", ORANGE, "s-"),
}
ERRATA = (  # 1 .. 15
    errata_maps.third_integral,
    errata_maps.second_form,
    errata_maps.which_rotation,
    errata_maps.moments,
    errata_maps.gravity,
    errata_maps.unit_of_momentum,
    errata_mechanics.rotation_matrix,
    errata_mechanics.products,
    errata_mechanics.curvature,
    errata_mechanics.slips,
    errata_mechanics.rods,
    errata_mechanics.stationary,
    errata_mechanics.kirchhoff,
    errata_mechanics.integral_k,
    errata_maps.first_order,
)


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


def chapter5_figures(results):
    four = results.four
    end = four.t[-1]
    ends = f"{end:g} is {round(end / four.eps2)} times eps2 and {round(end / four.eps1)} times eps1"
    return [
        *figures_chapter5.special(),
        figures_chapter5.integral("kowalewski", results.k),
        figures_chapter5.integral("goryachev_chaplygin", results.g),
        *figures_chapter5.analogies(),
        *figures_chapter5.comparing(four, ends),
    ]


def chapter6_figures(results):
    four = results.four
    return [
        *figures_chapter6.stills(four),
        figures_chapter6.geodesic(),
        *figures_chapter6.frames(four),
        *figures_chapter6.integrals(four),
        *figures_chapter6.cause(four),
        *figures_chapter6.failing(results.failing, results.growth),
        *figures_chapter6.timed(results.timed),
        *figures_chapter6.equal_evaluations(results.by_step),
    ]


def all_sentences(results):
    four, timed = results.four, results.timed
    return [
        *sentences_chapters3_to_5.chapter3(results.forms, results.frozen),
        *sentences_chapters3_to_5.chapter4(four),
        *sentences_chapters3_to_5.chapter5(results.k, results.g, integrals.values_of_k()),
        *sentences_chapter6.experiment1(four, results.loose),
        *sentences_chapter6.strong(results.failing, results.growth),
        *sentences_chapter6.settings(timed, results.first_steps),
        *sentences_chapter6.experiment2(timed, results.crossings),
        *sentences_conclusions.runge_kutta(results.by_step),
        *sentences_conclusions.conclusions(four, timed),
    ]


def all_errata():
    """Computes the errata, by number."""
    return [made() for made in ERRATA]


def forms_chart(forms, scene):
    groups = []
    for form, (label, colour, marker) in FORMS.items():
        rows = [row for row in forms if row.scene == scene and row.form == form]
        costs, errors = [row.evaluations for row in rows], [row.error for row in rows]
        groups.append((label, costs, errors, colour, marker))
    return scatter(groups, f"evaluations, {scene}", "attitude error at the end [rad]")


def units_table():
    """Gives the units of 4.2.1 for the cuboid: text and truth."""
    units = scaled_units(SCENE.body)
    scaled = units.into(SCENE)
    n, _, t = HALF
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
            f"{h_eps(truth(scaled, [0.0]).path, 0.2)[0]:.6f}",
        ),
    ]


def about(results, seconds):
    """Tells with what machine it was made, and how far the truth of experiment 6.2 is from extrap
    at its tightest."""
    timed = results.timed
    extrap = Course(kr.solve(SCENE, timed.t, method="extrap", tol=1e-13), 0)
    return machine.described() | {
        "seconds": f"{seconds:.0f}",
        "truth": timed.true.path.method,
        "improved": IMPROVED,
        "agreement": f"{frame_error(extrap, timed.true).max():.0e}",
    }


def render(results, seconds):
    said = all_sentences(results)
    return page.template(TEMPLATE, HERE).render(
        about=about(results, seconds),
        six=chapter6_figures(results),
        five=chapter5_figures(results),
        sentences=said,
        errata=all_errata(),
        held=sum(sentence.holds for sentence in said),
        forms=[forms_chart(results.forms, scene) for scene in ("thesis", "asymmetric")],
        rows=results.forms,
        frozen=results.frozen,
        units=units_table(),
        timed=results.timed,
        meet=sentences_conclusions.overtaken(results.timed),
    )


def main(out):
    begin = time.perf_counter()
    results = run_all(lambda what: print(what, flush=True))
    print("figures, sentences, errata", flush=True)
    text = render(results, time.perf_counter() - begin)
    out.mkdir(parents=True, exist_ok=True)
    put_whole(out / OUTPUT, text)
    print(f"{out / OUTPUT}: {len(text) / 1e6:.1f} MB in {time.perf_counter() - begin:.0f} s")
    return 0
