"""The chapter of the report that examines the thesis (Bodack 2008)."""

import time
from dataclasses import dataclass
from pathlib import Path

import kreisel as kr
import numpy as np

from ..competitors import machine
from ..parts.result_cache import write_atomic
from ..report import page
from . import (
    errata,
    experiments,
    figures_chapter5,
    figures_chapter6,
    integrals,
    sentences_chapter6,
    sentences_chapters3_to_5,
    sentences_conclusions,
)
from .line_charts import BLUE, ORANGE, draw_scatter
from .scaled_units import h_eps, scaled_units
from .trajectories import HALF, IMPROVED, SCENE, Trajectory, compute_frame_error, solve_truth

HERE = Path(__file__).parent
TEMPLATE = OUTPUT = "thesis.html"
INTERVALS = (0.2, 0.1, 0.01)  # intervals of uniform rotation of the frame (3.4)
FORMS = {
    "extrap": ("rest frame (extrap)", BLUE, "o-"),
    "extrap_kirchhoff": ("body (extrap_kirchhoff)", ORANGE, "s-"),
}


@dataclass(frozen=True)
class ExperimentResults:
    """The results of all experiments in the thesis."""

    four: experiments.FourTops
    failing: experiments.FourTops
    growth: np.ndarray
    timed: experiments.EqualTime
    crossings: list
    by_step: dict
    k: integrals.FourthIntegral
    g: integrals.FourthIntegral
    forms: list
    frozen: dict
    first_steps: dict
    loose: dict


def run_experiments(report):
    report("experiment 6.1, to t = 600")
    four = experiments.run_four_tops()
    report("experiment 6.2, to t = 3200")
    equal_time = experiments.run_equal_time()
    crossings = experiments.find_crossings(equal_time)
    report("experiment 6.3, a failing run, fourth integrals, forms of the equations")
    return ExperimentResults(
        four,
        experiments.run_failing(),
        experiments.measure_growth(),
        equal_time,
        crossings,
        experiments.run_equal_evaluations(),
        integrals.measure_fourth_integral("kowalewski"),
        integrals.measure_fourth_integral("goryachev_chaplygin"),
        integrals.compare_forms(),
        {interval: integrals.frozen_frame_error(interval) for interval in INTERVALS},
        experiments.measure_first_steps(equal_time),
        experiments.measure_loose_tolerances(),
    )


def draw_chapter5(results):
    four = results.four
    end = four.t[-1]
    ends = f"{end:g} is {round(end / four.eps2)} times eps2 and {round(end / four.eps1)} times eps1"
    return [
        *figures_chapter5.draw_special_tops(),
        figures_chapter5.draw_integral("kowalewski", results.k),
        figures_chapter5.draw_integral("goryachev_chaplygin", results.g),
        *figures_chapter5.draw_analogies(),
        *figures_chapter5.draw_comparison(four, ends),
    ]


def draw_chapter6(results):
    four = results.four
    return [
        *figures_chapter6.draw_stills(four),
        figures_chapter6.draw_geodesic(),
        *figures_chapter6.draw_frame_errors(four),
        *figures_chapter6.draw_integrals(four),
        *figures_chapter6.draw_cause(four),
        *figures_chapter6.draw_failing(results.failing, results.growth),
        *figures_chapter6.draw_equal_time(results.timed),
        *figures_chapter6.draw_equal_evaluations(results.by_step),
    ]


def check_sentences(results):
    four, equal_time = results.four, results.timed
    return [
        *sentences_chapters3_to_5.check_chapter3(results.forms, results.frozen),
        *sentences_chapters3_to_5.check_chapter4(four),
        *sentences_chapters3_to_5.check_chapter5(
            results.k, results.g, integrals.compute_k_values()
        ),
        *sentences_chapter6.check_experiment1(four, results.loose),
        *sentences_chapter6.check_failing(results.failing, results.growth),
        *sentences_chapter6.check_settings(equal_time, results.first_steps),
        *sentences_chapter6.check_experiment2(equal_time, results.crossings),
        *sentences_conclusions.check_runge_kutta(results.by_step),
        *sentences_conclusions.check_conclusions(four, equal_time),
    ]


def draw_forms(forms, scene):
    groups = []
    for form, (label, colour, marker) in FORMS.items():
        rows = [row for row in forms if row.scene == scene and row.form == form]
        costs, errors = [row.evaluations for row in rows], [row.error for row in rows]
        groups.append((label, costs, errors, colour, marker))
    return draw_scatter(groups, f"evaluations, {scene}", "attitude error at the end [rad]")


def make_units_table():
    """Return a table of the printed and the corrected units in section 4.2.1."""
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
            f"{h_eps(solve_truth(scaled, [0.0]).path, 0.2)[0]:.6f}",
        ),
    ]


def describe_run(results, seconds):
    """Describe the computer, and how well extrap at tolerance 1e-13 agrees with the reference."""
    equal_time = results.timed
    extrap = Trajectory(kr.solve(SCENE, equal_time.t, method="extrap", tol=1e-13), 0)
    return machine.describe_machine() | {
        "seconds": f"{seconds:.0f}",
        "truth": equal_time.true.path.method,
        "improved": IMPROVED,
        "agreement": f"{compute_frame_error(extrap, equal_time.true).max():.0e}",
    }


def render_chapter(results, seconds):
    sentences = check_sentences(results)
    return page.load_template(TEMPLATE, HERE).render(
        about=describe_run(results, seconds),
        six=draw_chapter6(results),
        five=draw_chapter5(results),
        sentences=sentences,
        errata=errata.compute_errata(),
        held=sum(sentence.holds for sentence in sentences),
        forms=[draw_forms(results.forms, scene) for scene in ("thesis", "asymmetric")],
        rows=results.forms,
        frozen=results.frozen,
        units=make_units_table(),
        timed=results.timed,
        meet=sentences_conclusions.find_overtaking(results.timed),
    )


def main(out):
    begin = time.perf_counter()
    results = run_experiments(lambda message: print(message, flush=True))
    print("figures, sentences, errata", flush=True)
    text = render_chapter(results, time.perf_counter() - begin)
    out.mkdir(parents=True, exist_ok=True)
    write_atomic(out / OUTPUT, text)
    print(f"{out / OUTPUT}: {len(text) / 1e6:.1f} MB in {time.perf_counter() - begin:.0f} s")
    return 0
