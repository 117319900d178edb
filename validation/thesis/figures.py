"""The figures of chapters 5 and 6 of the thesis (Bodack 2008), redrawn."""

from dataclasses import dataclass

import kreisel as kr
import numpy as np

from ..drawing.spheres import draw_apex_path
from . import frames, line_charts
from .integrals import STRETCHED, special_scene
from .line_charts import BLUE, GREEN, IMPROVED, INK, OCHRE, ORANGE, RED
from .trajectories import HALF, PIVOT, SCENE, compute_frame_error, largest_until, solve_truth

NAMES = {"kowalewski": "Kowalewski", "goryachev_chaplygin": "Goryachev-Chaplygin"}
METHODS = ("Bobenko-Suris", "Extrap")
TIMES, PI = "\N{MULTIPLICATION SIGN}", "\N{GREEK SMALL LETTER PI}"
FRAME, LARGEST = "frame error L [rad]", "largest L so far [rad]"


@dataclass(frozen=True)
class Figure:
    number: str
    title: str
    pictures: list  # drawings in SVG
    caption: str  # describes the computed result
    rows: tuple = ()  # rows of a table


def draw_pair(t, pair, ylabel, end=np.inf, names=METHODS, colours=(BLUE, GREEN)):
    """Plot two functions of time until `end`."""
    shown = t <= end * (1 + 1e-9)
    lines = zip(names, pair, colours, strict=True)
    series = [(name, t[shown], values[shown], colour, "-") for name, values, colour in lines]
    return line_charts.draw_lines(series, ylabel)


def draw_maxima(t, curves, improved, ylabel, end=np.inf, floor=None):
    """Plot the running maxima of errors on a logarithmic scale.

    `curves` contains tuples (label, errors, colour). The errors of improved methods are dashed.
    """
    shown = t <= end * (1 + 1e-9)
    both = [(label, error, colour, "-") for label, error, colour in curves]
    both += [(name, error, IMPROVED[name], "--") for name, error in improved.items()]
    series = [
        (label, t[shown], np.maximum.accumulate(abs(error))[shown], *style)
        for label, error, *style in both
    ]
    return line_charts.draw_lines(series, ylabel, log=True, floor=floor)


def describe_largest(experiment, t):
    bs, ext = experiment.until("BS", t), experiment.until("Ext", t)
    return f"Bobenko-Suris {bs:.2g}, Extrap {ext:.1g} rad"


def compute_rod(scene):
    return kr.rod(solve_truth(scene, np.linspace(0, 30.0, 300)).path)


def draw_special_tops():
    for letter, (kind, name) in zip("ab", NAMES.items(), strict=True):
        scene, half = special_scene(kind), 0.8
        sides, pivot = (STRETCHED[kind] * half, half, half / 2), (0.0, 0.0, -half / 2)
        yield Figure(
            f"5.4({letter})",
            f"A {name} top",
            [frames.draw_starts(scene, sides, pivot, [ORANGE])],
            f"Kind by its moments: {scene.body.kind}. Momentum green, angular velocity blue.",
        )


def draw_fourth_integrals(results):
    for letter, kind, number in (
        ("K", "kowalewski", "5.5"),
        ("G", "goryachev_chaplygin", "5.5, for G"),
    ):
        fourth = getattr(results, letter.lower())
        change = fourth.change
        series = [("Extrap, tolerance 1e-5", fourth.t, change, GREEN, "-")]
        yield Figure(
            number,
            f"Error of the {NAMES[kind]} integral",
            [line_charts.draw_lines(series, f"{letter}(t) - {letter}(0)")],
            f"{letter}(0) = {fourth.start:.4g} in units with I1 = 1; it changes by "
            f"{change.min():.1e} .. {change.max():.1e}.",
        )


def draw_analogies():
    lagrange, rod = solve_truth(SCENE, np.linspace(0, 60, 1500)).path, compute_rod(SCENE)
    trace = draw_apex_path(lagrange.apex, 3.2)
    yield Figure(
        "5.6",
        "The tab Rod & Apex Trace",
        [frames.draw_rod(rod, OCHRE), trace],
        "In kreisel: kr.rod(path).plot() and path.plot().",
    )
    yield Figure(
        "5.7",
        "A Lagrange top with its isotropic elastic rod",
        [frames.draw_rod(rod, ORANGE), frames.draw_starts(SCENE, HALF, PIVOT, [ORANGE])],
        f"To t = {rod.s[-1]:g}; its stiffness against bending {rod.stiffness[0]:.4g} in every "
        f"direction, against twist {rod.stiffness[2]:.4g}.",
    )
    for letter, (kind, name) in zip("ab", NAMES.items(), strict=True):
        own = compute_rod(special_scene(kind))
        yield Figure(
            f"5.8({letter})",
            f"The anisotropic rod of the {name} top",
            [frames.draw_rod(own, ORANGE)],
            f"Stiffness {own.stiffness[0]:.4g} towards N and {own.stiffness[1]:.4g} towards B, "
            f"hence {own.section[1]:.3g} times as thick towards B.",
        )
    nutation = kr.apex(lagrange).nutation()
    yield Figure(
        "5.9",
        "The apex trace of a Lagrange top",
        [trace],
        f"From height {np.cos(nutation.least):.4f} to {np.cos(nutation.greatest):.4f} and back in "
        f"{nutation.period:.4f}. It starts upright, so it passes through the vertical each time.",
    )


def draw_comparison(four):
    end, names = four.t[-1], ("Bobenko-Suris, eps 0.2", "Extrap")
    yield Figure(
        "5.10",
        "A top with its duplicate",
        [frames.draw_starts(SCENE, HALF, PIVOT, (RED, OCHRE))],
        "Left by Bobenko-Suris, right by Extrap; at the start.",
    )
    yield Figure(
        "5.11",
        "The Lagrange top mode with eps2",
        [frames.draw_four_tops(four.tops, 120.0, HALF, PIVOT)],
        f"At t = 120: frame errors {four.until('BS', 120):.2g} and {four.until('Ext', 120):.1g} "
        "rad so far.",
    )
    yield Figure(
        "5.12",
        "The timer",
        [line_charts.draw_timer()],
        f"A common end: {end:g} is {round(end / four.eps2)} times eps2 and "
        f"{round(end / four.eps1)} times eps1.",
    )
    yield Figure(
        "5.13",
        "The tab Eps2: the integrals of motion",
        [],
        f"At t = {end:g}; the change since the start is in brackets.",
        tuple(tabulate_integrals(four)),
    )
    energies = four.blue.energy_error, four.green.energy_error
    errors = four.L["BS text"], four.L["Ext text"]
    pictures = [
        draw_pair(four.t, energies, "E - E0", 50, names),
        draw_pair(four.t, errors, FRAME, 50, names),
    ]
    yield Figure("5.14", "The tab Diagrams", pictures, "To t = 50.")


def tabulate_integrals(four):
    """Yield the rows of a table with the final values and the changes of conserved quantities."""
    yield "top", "<m, p>", "<m, a>", "E"
    for name, top in four.tops.items():
        vertical = top.vertical_momentum * top.path.scene.gravity
        values = vertical, top.axial_momentum, top.path.energy
        yield name, *(f"{value[-1]:.6f} ({value[-1] - value[0]:+.0e})" for value in values)


def draw_experiment1(four):
    for number, t in {"6.1": 300, "6.2": 50, "6.3": 300, "6.4": 600}.items():
        yield Figure(
            number,
            f"Four tops, t = {t}",
            [frames.draw_four_tops(four.tops, t, HALF, PIVOT)],
            f"Largest frame errors so far: {describe_largest(four, t)}.",
        )
    yield Figure(
        "6.5",
        "L(E) is the length of the geodesic from E to N",
        [line_charts.draw_geodesic()],
        f"E and its negative are one attitude: hence |a1|, and L of at most {PI}/2. In kreisel the "
        "attitude error is the angle of the rotation, 2 L.",
    )
    yield from draw_frame_errors(four)
    yield from draw_integrals(four)


def draw_frame_errors(four):
    t, L = four.t, four.L
    errors = {name: compute_frame_error(own, four.true) for name, own in four.improved.items()}
    names = "Bobenko-Suris, eps 0.2 against 0.01", "Extrap, 0.2 against 0.01"
    curves = [("Bobenko-Suris (theorem 4.2)", L["BS"], BLUE), ("Extrap", L["Ext"], GREEN)]
    for number, end in (("6.6", 50), ("6.7", 300), ("6.8", 600)):
        largest = (f"{name} {largest_until(t, own, end):.2g}" for name, own in errors.items())
        yield Figure(
            number,
            f"Errors in the body frame to t = {end}",
            [
                draw_pair(t, (L["BS text"], L["Ext text"]), FRAME, end, names),
                draw_maxima(t, curves, errors, LARGEST, end, np.pi / 2),
            ],
            f"Against the truth at most: Bobenko-Suris {four.until('BS', end):.3g}, Extrap "
            f"{four.until('Ext', end):.2g} rad. In the same steps: {'; '.join(largest)}.",
        )


def draw_integrals(four):
    t, blue, green = four.t, four.blue, four.green
    label = "<m,apex> - <m,apex>(0)"
    yield Figure(
        "6.9",
        f"{label} for eps = 0.2",
        [draw_pair(t, (blue.axial_error, green.axial_error), label)],
        f"At t = 600: Bobenko-Suris {abs(blue.axial_error).max():.0e} at most, Extrap "
        f"{green.axial_error[-1]:.1e}.",
    )
    pair, early = (blue.energy_error, four.red.energy_error), t <= 50 * (1 + 1e-9)
    ratio = np.ptp(pair[0][early]) / np.ptp(pair[1][early])
    yield Figure(
        "6.10",
        "Error in the energy, Bobenko-Suris",
        [draw_pair(t, pair, "E - E0", 50, ("eps 0.2", "eps 0.01"), (BLUE, RED))],
        f"The ratio of the ranges is {ratio:.2f}, that of the steps 20.",
    )
    errors = {name: course.energy_error for name, course in four.improved.items()}
    pair = blue.energy_error, green.energy_error
    curves = list(zip(METHODS, pair, (BLUE, GREEN), strict=True))
    yield Figure(
        "6.11",
        "Error in the energy for eps = 0.2",
        [
            draw_pair(t, pair, "E - E0"),
            draw_maxima(t, curves, errors, "largest |E - E0| so far"),
        ],
        f"Bobenko-Suris {pair[0].min():.3f} .. {pair[0].max():.3f}, Extrap at most "
        f"{abs(pair[1]).max():.1e}; E0 = {blue.path.energy[0]:.3f}.",
    )
    shown, error = t <= 60, blue.energy_error
    values, colours = (error[shown], four.L["BS"][shown]), (ORANGE, BLUE)
    series = [
        ("E - E0", t[shown], error[shown], ORANGE, "-"),
        ("the term", t[shown], four.term[shown], INK, ":"),
    ]
    yield Figure(
        "6.12",
        "Error in the energy, opposed to the error in the frame",
        [
            line_charts.draw_two_scales(t[shown], *values, ("E - E0", "L [rad]"), colours),
            line_charts.draw_lines(series, "energy"),
        ],
        f"E - E0 is the term -I1 eps/2 <a {TIMES} m, p>, less its start, to "
        f"{abs(four.term - error).max():.0e}.",
    )


def draw_failing(four, rows):
    error, L = four.blue.energy_error, four.L["BS"]
    yield Figure(
        "6.13",
        "g = 10, m = (5, 0, 0): t = 20",
        [frames.draw_four_tops(four.tops, 20.0, HALF, PIVOT)],
        f"L = {L[-1]:.2f} rad now and {L.max():.2f} at most; Extrap {four.L['Ext'].max():.0e}.",
    )
    pair, names = (error, four.green.energy_error), ("Bobenko-Suris, eps 0.2", "Extrap")
    yield Figure(
        "6.14",
        "Error in the energy, g = 10, m = (5, 0, 0)",
        [draw_pair(four.t, pair, "E - E0", names=names)],
        f"{error.min():.1f} .. {error.max():+.1f} on {four.blue.path.energy[0]:.1f}.",
    )
    groups = [
        (f"m times {factor:g}", *rows[rows[:, 1] == factor][:, 2:].T, colour, "o-")
        for factor, colour in zip(np.unique(rows[:, 1]), (BLUE, ORANGE, GREEN, RED), strict=True)
    ]
    term = f"largest |I1 eps/2 <a {TIMES} m, p>| to t = 20"
    yield Figure(
        "6.14, more",
        "How the error grows with the term (6.1.5)",
        [line_charts.draw_scatter(groups, term, "largest L [rad]")],
        "Each line: g = 0.5, 1, 2, 5, 10; eps = 0.2.",
    )


def draw_equal_time(experiment):
    t, L = experiment.t, experiment.L
    for number, end in (("6.15", 200), ("6.16", 600), ("6.17", 1000), ("6.18", 3200)):
        yield Figure(
            number,
            f"Four tops in experiment 6.2, t = {end}",
            [frames.draw_four_tops(experiment.tops, float(end), HALF, PIVOT)],
            f"Largest frame errors so far: {describe_largest(experiment, end)}. Yellow is the "
            "truth.",
        )
    errors = {name: L[name] for name in experiment.improved}
    names = (
        "Bobenko-Suris, 166 sub-steps",
        "Extrap, tolerance 2e-8",
        f"Bobenko-Suris, {experiment.substeps}: equal time here",
    )
    three = L["BS"], L["Ext"], L["equal"]
    curves = list(zip(names, three, (BLUE, GREEN, OCHRE), strict=True))
    for number, end in (("6.19", 400), ("6.20", 1000), ("6.21", 3200)):
        bs, equal, ext = (experiment.until(name, end) for name in ("BS", "equal", "Ext"))
        yield Figure(
            number,
            f"Errors in the body frame to t = {end}, experiment 6.2",
            [
                draw_pair(t, three[:2], FRAME, end, names[:2]),
                draw_maxima(t, curves, errors, LARGEST, end, np.pi / 2),
            ],
            f"Bobenko-Suris {bs:.2g}, with equal time {equal:.2g}; Extrap {ext:.2g} rad.",
        )
    pair = experiment.blue.energy_error, experiment.green.energy_error
    for number, end in (("6.22", 1000), ("6.23", 3200)):
        shown = t <= end
        blue, green = pair[0][shown], pair[1][shown]
        alone = [("Extrap", t[shown], green, GREEN, "-")]
        yield Figure(
            number,
            f"Error in the energy to t = {end}, experiment 6.2",
            [
                draw_pair(t, pair, "E - E0", end),
                line_charts.draw_lines(alone, "E - E0, Extrap alone"),
            ],
            f"Bobenko-Suris {blue.min():.3f} .. {blue.max():.3f}, Extrap at most "
            f"{abs(green).max():.0e}.",
        )


def draw_equal_evaluations(by_step):
    equal, names, colours = by_step[0.2], ("Runge-Kutta", "Bobenko-Suris"), (OCHRE, BLUE)
    rk4, bs = equal.rk4.energy_error, equal.bs.energy_error
    yield Figure(
        "6.24",
        "Error in the energy to t = 30, equal evaluations",
        [draw_pair(equal.t, (rk4, bs), "E - E0", names=names, colours=colours)],
        f"Runge-Kutta {rk4.min():.3f}, Bobenko-Suris within {np.ptp(bs):.2f}.",
    )
    rk4, bs = equal.L["rk4"], equal.L["BS"]
    series = [
        (name, np.array(list(by_step)), [each.L[key].max() for each in by_step.values()], *style)
        for name, key, style in zip(
            names, ("rk4", "BS"), ((OCHRE, "o-"), (BLUE, "s-")), strict=True
        )
    ]
    yield Figure(
        "6.25",
        "Errors in the frame to t = 30, equal evaluations",
        [
            draw_pair(equal.t, (rk4, bs), FRAME, names=names, colours=colours),
            line_charts.draw_lines(series, "largest L to t = 30 [rad]", log=True, xlabel="eps2"),
        ],
        f"For eps2 = 0.2: Runge-Kutta {rk4.max():.2g}, Bobenko-Suris {bs.max():.2g} rad. "
        "Right: all eps2.",
    )
