"""Quantitative statements of the thesis in section 3.4 and chapters 4 and 5, with checks."""

import kreisel as kr
import numpy as np

from . import su2
from .experiments import time_grid
from .figures_chapter5 import compute_rod
from .integrals import FORMS, special_scene
from .scaled_units import scaled_units
from .sentence import Sentence
from .trajectories import HALF, SCENE, solve_fixed_step, solve_theorem42, solve_truth

OMEGA, ROOT = "\N{GREEK SMALL LETTER OMEGA}", "\N{SQUARE ROOT}"
SQUARE, INVERSE = "\N{SUPERSCRIPT TWO}", "\N{SUPERSCRIPT MINUS}\N{SUPERSCRIPT ONE}"
SPECIAL = {  # the construction in the text, and (each of the equal moments) / (third moment)
    "kowalewski": (f"Kowalewski: C_T = C_B / 2, C_N = {ROOT}3 C_B gives moments 1 : 2 : 2", 2),
    "goryachev_chaplygin": (
        f"Goryachev-Chaplygin: C_T = C_B / 2, C_N = {ROOT}7 C_B gives 1 : 4 : 4",
        4,
    ),
}


def check_chapter3(forms, frozen):
    """Yield the statements in section 3.4 of the thesis on two forms of the equations of motion.

    The dictionary `frozen` maps lengths of time intervals to results of `frozen_frame_error`.
    """

    def at_tolerance(form, tol=1e-8):
        return next(r for r in forms if (r.scene, r.form, r.tol) == ("thesis", form, tol))

    rest, body = map(at_tolerance, FORMS)
    least, most = min(frozen.values()), max(frozen.values())
    yield Sentence(
        "3.4",
        f"In body frame formulation, the frame is integrated just using {OMEGA}(t): knowledge "
        "within the interval is lost",
        f"frame advanced once per {min(frozen):g} .. {max(frozen):g}, with exact M and P: "
        f"{least:.0e} .. {most:.0e} rad at t = 100; rest frame, tolerance 1e-8: {rest.error:.0e}",
        least > 10 * rest.error,
    )
    yield Sentence(
        "3.4",
        "The twelve rest-frame equations yield far better results than Kirchhoff's",
        f"at tolerance 1e-8 and t = 100 rest frame {rest.error:.0e} rad in {rest.evaluations} "
        f"evaluations; body {body.error:.0e} in {body.evaluations}, "
        f"{rest.seconds / body.seconds:.1f} times as fast",
        rest.error < 0.5 * body.error,
        "only for a frame that is not integrated with the other variables; if the rest frame as "
        "seen from the body is integrated too, the body form is more accurate",
    )


def check_chapter4(four):
    per = four.green.evaluations / (len(four.t) - 1)
    yield Sentence(
        "4.1",
        "Numerical discretizations evaluate the equations several times in [t, t + eps]: much more "
        "demanding",
        f"Extrap takes {per:.1f} evaluations in each 0.2, Bobenko-Suris 1",
        per > 2,
    )
    body, (n, _, t) = SCENE.body, HALF
    alpha = body.moments[2] / body.moments[0]
    yield Sentence(
        "4.2.1",
        f"I3 = 2 C_N{SQUARE} / (C_N{SQUARE} + C_T{SQUARE}) in units with I1 = 1: 0.780",
        f"{alpha:.4f}",
        abs(alpha - 2 * n * n / (n * n + t * t)) < 1e-3,
        "erratum 4: the parallel-axis term is missing",
    )
    lever = body.mass * body.com[2] / body.moments[0]
    yield Sentence(
        "4.2.1",
        "p = g / C_T: 1",
        f"{lever:.4f}",
        abs(lever - 1) < 1e-3,
        "erratum 5: the unit of mass is not the mass",
    )
    residual = compute_map_residual()
    yield Sentence(
        "4.2.3",
        f"Theorem 4.1: m' = m + eps [p, a], a' = (1 + eps m') a (1 + eps m'){INVERSE}",
        f"kreisel's bobenko_suris does it to {residual:.0e}",
        residual < 1e-13,
    )


def compute_map_residual(eps=0.2):
    """Return the deviation of the Bobenko-Suris method from theorem 4.1 as the thesis states it."""
    scaled = scaled_units(SCENE.body).into(SCENE)
    path = solve_fixed_step(scaled, "bobenko_suris", eps, 20.0).path
    g = scaled.body.mass * scaled.gravity
    before = zip(path.m[:-1], path.apex[:-1], strict=True)
    states = [su2.make_step(m, a, eps, g) for m, a in before]
    return max(
        np.abs(np.array([m for m, _ in states]) - path.m[1:]).max(),
        np.abs(np.array([a for _, a in states]) - path.apex[1:]).max(),
    )


def check_special_tops():
    for kind, (statement, ratio) in SPECIAL.items():
        i1, i2, i3 = special_scene(kind).body.moments
        yield Sentence(
            "5.6.6",
            statement,
            f"1 : {i2 / i1:.12g} : {i3 / i1:.12g}; the odd axis is N",
            abs(i2 / i1 - ratio) + abs(i3 / i1 - ratio) < 1e-12,
        )


def check_chapter5(k, g, values):
    yield from check_counts()
    yield from check_special_tops()
    yield from check_fourth_integrals(k, g, values)
    yield from check_rods()
    yield from check_traces()
    rk4, extrap = compare_with_rk4()
    yield Sentence(
        "6.1.1",
        "Extrap showed a better performance than Runge-Kutta",
        f"for 1e-3 rad at t = 100: Extrap {extrap} evaluations, rk4 {rk4}",
        extrap < rk4,
    )


def check_counts():
    c_n, c_b, c_t = HALF
    moment = 8 * c_n * c_b * c_t / 3 * (c_b**2 + 4 * c_t**2)
    yield Sentence(
        "5.6.2",
        f"I_N = M/3 (C_B{SQUARE} + (2 C_T){SQUARE})",
        f"{moment:.6f} and {SCENE.body.moments[0]:.6f}",
        abs(moment / SCENE.body.moments[0] - 1) < 1e-12,
    )
    points = len(solve_theorem42(SCENE, 0.02, 1.0).t)
    yield Sentence(
        "5.6.5", "[0, 1] with eps = 0.02: N = 50 time points", f"{points - 1} steps", points == 51
    )


def check_fourth_integrals(k, g, values):
    measurements = "; ".join(
        f"{value:.3g} (C_B = {half:g}, {units})" for (half, units), value in values.items()
    )
    yield Sentence(
        "5.6.6",
        "The total value of K was approximately 0.5",
        measurements,
        abs(k.start - 0.5) < 0.1,
        "not with the startup size; C_B = 1 is closest",
    )
    worst = abs(k.change).max() / k.start
    yield Sentence(
        "5.6.6", "K: a small error (figure 5.5)", f"{worst:.0e} of K by t = 300", worst < 1e-3
    )
    yield Sentence(
        "5.6.6",
        "The integral G shows a similar behaviour",
        f"{abs(g.change).max():.0e} of the unit, K {abs(k.change).max():.0e}; "
        f"G is {g.start:.1e} at the start",
        abs(g.change).max() < 1e-3,
    )


def measure_discrete_rod(eps=0.05, end=20.0):
    """Return the distance of the discrete rod from the continuous centre line for two step sizes.

    The distance between the two curves is measured at the end of the rod. Between successive frames
    of the discrete rod, the centre line advances by the step size along the tangent T.
    """
    errors = []
    for h in (eps, eps / 2):
        rod = kr.rod(solve_truth(SCENE, time_grid(h, end)).path)
        errors.append(np.linalg.norm(h * rod.frame[:-1, 2].sum(axis=0) - rod.centre[-1]))
    return errors


def check_rods():
    coarse, fine = measure_discrete_rod()
    yield Sentence(
        "5.7.1",
        "Moving the frame by eps to the direction of T gives a discrete elastic rod",
        f"error at its end {coarse:.2g} for eps = 0.05 and {fine:.2g} for half of it",
        1.5 < coarse / fine < 3,
    )
    special = [compute_rod(special_scene(kind)) for kind in SPECIAL]
    half, quarter = (rod.stiffness[1] / rod.stiffness[0] for rod in special)
    yield Sentence(
        "5.7.2",
        "The bending energy of the rod is half / quarter about the long axis",
        f"{half:.12g} and {quarter:.12g}",
        abs(half - 0.5) + abs(quarter - 0.25) < 1e-12,
    )
    half, quarter = (rod.section[1] for rod in special)
    yield Sentence(
        "5.7.2",
        "This corresponds to half / quarter the thickness",
        f"{half:.4f} and {quarter:.4f}",
        abs(half - 0.5) + abs(quarter - 0.25) < 1e-3,
        "the stiffnesses of a rectangle are as the squares of its sides",
    )


def check_traces():
    apex = kr.apex(solve_truth(SCENE, np.linspace(0, 60, 6001)).path)
    period, height = apex.nutation().period, apex.height
    is_low = (height[1:-1] < height[:-2]) & (height[1:-1] < height[2:])
    intervals = np.diff(apex.t[1:-1][is_low])
    yield Sentence(
        "5.7.3",
        "Two periodic motions: nutation and precession",
        f"nutation in {period:.5f}, each of {len(intervals)} within 0.01 of it; the lowest points "
        "go round",
        bool(np.abs(intervals - period).max() < 0.011),
    )


def compare_with_rk4(target=1e-3, end=100.0):
    """Return how many torque evaluations rk4 and extrap each need to reach the same accuracy."""
    true = solve_truth(SCENE, [end]).path.q[-1]

    def evaluations(settings):
        for setting in settings:
            path = kr.solve(SCENE, [end], **setting)
            if 0.5 * kr.attitude_error(path.q[-1], true) < target:
                return path.stats.evaluations

    return (
        evaluations({"method": "rk4", "step": end / round(500 * 1.1**k)} for k in range(50)),
        evaluations({"method": "extrap", "tol": 10.0**-k} for k in range(3, 12)),
    )
