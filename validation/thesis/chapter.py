"""The chapter of the report that examines the thesis (Bodack 2008)."""

import time
from pathlib import Path
from types import SimpleNamespace

import kreisel as kr

from ..competitors import machine
from ..parts.result_cache import write_atomic
from ..report import page
from . import errata, experiments, figures, integrals
from .line_charts import BLUE, ORANGE, draw_scatter
from .scaled_units import h_eps, scaled_units
from .sentences import check_sentences, find_overtaking
from .trajectories import HALF, IMPROVED, SCENE, Trajectory, compute_frame_error, solve_truth

HERE = Path(__file__).parent
OUTPUT = "thesis.html"  # also the name of the template
INTERVALS = (0.2, 0.1, 0.01)  # intervals of uniform rotation of the frame (3.4)
FORMS = {
    "extrap": ("rest frame (extrap)", BLUE, "o-"),
    "extrap_kirchhoff": ("body (extrap_kirchhoff)", ORANGE, "s-"),
}


def run_experiments(report):
    """Return the results of all experiments in the thesis."""
    report("experiment 6.1, to t = 600")
    four = experiments.run_four_tops()
    report("experiment 6.2, to t = 3200")
    timed = experiments.run_equal_time()
    crossings = experiments.find_crossings(timed)
    report("experiment 6.3, a failing run, fourth integrals, forms of the equations")
    return SimpleNamespace(
        four=four,
        timed=timed,
        crossings=crossings,
        failing=experiments.run_failing(),
        growth=experiments.measure_growth(),
        by_step=experiments.run_equal_evaluations(),
        k=integrals.measure_fourth_integral("kowalewski"),
        g=integrals.measure_fourth_integral("goryachev_chaplygin"),
        forms=integrals.compare_forms(),
        frozen={interval: integrals.frozen_frame_error(interval) for interval in INTERVALS},
        first_steps=experiments.measure_first_steps(timed),
        loose=experiments.measure_loose_tolerances(),
    )


def draw_forms(forms, scene):
    groups = []
    for form, (label, *style) in FORMS.items():
        rows = [row for row in forms if row.scene == scene and row.form == form]
        groups.append(
            (label, [row.evaluations for row in rows], [row.error for row in rows], *style)
        )
    return draw_scatter(groups, f"evaluations, {scene}", "attitude error at the end [rad]")


def make_units_table():
    """Return a table of the printed and the corrected units in section 4.2.1."""
    units = scaled_units(SCENE.body)
    scaled = units.into(SCENE)
    n, _, t = HALF
    i1 = SCENE.body.mass / 3 * (n * n + t * t)
    start = h_eps(solve_truth(scaled, [0.0]).path, 0.2)[0]
    return [
        ("unit of length", f"{t:g}", f"{units.length:g}"),
        ("unit of mass = I1", f"{i1:.4f}", f"{units.mass:.4f}"),
        ("alpha = I3", f"{2 * n * n / (n * n + t * t):.4f}", f"{scaled.body.moments[2]:.4f}"),
        ("p, with the mass", "1", f"{scaled.body.mass * scaled.gravity:.4f}"),
        ("factor of m", f"{1 / i1:.4f}", f"{1 / units.mass:.4f}"),
        ("H_eps of experiment 6.1 at the start, eps = 0.2", "", f"{start:.6f}"),
    ]


def describe_run(results, seconds):
    """Describe the computer, and how well extrap at tolerance 1e-13 agrees with the reference."""
    timed = results.timed
    extrap = Trajectory(kr.solve(SCENE, timed.t, method="extrap", tol=1e-13), 0)
    return machine.describe_machine() | {
        "seconds": f"{seconds:.0f}",
        "truth": timed.true.path.method,
        "improved": IMPROVED,
        "agreement": f"{compute_frame_error(extrap, timed.true).max():.0e}",
    }


def render_chapter(results, seconds):
    sentences = check_sentences(results)
    return page.load_template(OUTPUT, HERE).render(
        about=describe_run(results, seconds),
        five=[
            *figures.draw_special_tops(),
            *figures.draw_fourth_integrals(results),
            *figures.draw_analogies(),
            *figures.draw_comparison(results.four),
        ],
        six=[
            *figures.draw_experiment1(results.four),
            *figures.draw_failing(results.failing, results.growth),
            *figures.draw_equal_time(results.timed),
            *figures.draw_equal_evaluations(results.by_step),
        ],
        sentences=sentences,
        errata=errata.compute_errata(),
        held=sum(sentence["holds"] for sentence in sentences),
        forms=[draw_forms(results.forms, scene) for scene in ("thesis", "asymmetric")],
        rows=results.forms,
        frozen=results.frozen,
        units=make_units_table(),
        timed=results.timed,
        meet=find_overtaking(results.timed),
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
