"""Redrawn figures of chapter 6 of the thesis (Bodack 2008).

The left panels show the same curves as the figures in the thesis. Some figures have a right panel
with further results, such as additional methods on a logarithmic scale.
"""

import numpy as np

from . import line_charts
from .figure import Figure
from .figures_chapter5 import draw_picture
from .frames import draw_four_tops
from .line_charts import BLUE, GREEN, IMPROVED, INK, OCHRE, ORANGE, RED
from .trajectories import HALF, PIVOT, compute_frame_error, largest_until

HALF_PI = np.pi / 2
TIMES, PI = "\N{MULTIPLICATION SIGN}", "\N{GREEK SMALL LETTER PI}"


def cut_at(t, values, end):
    is_early = t <= end * (1 + 1e-9)
    return t[is_early], values[is_early]


def draw_geodesic():
    """Draw figure 6.5."""
    return Figure(
        "6.5",
        "L(E) is the length of the geodesic from E to N",
        [line_charts.draw_geodesic()],
        f"E and its negative are one attitude: hence |a1|, and L of at most {PI}/2. In kreisel the "
        "attitude error is the angle of the rotation, 2 L.",
    )


def draw_stills(four):
    for number, t in {"6.1": 300, "6.2": 50, "6.3": 300, "6.4": 600}.items():
        yield Figure(
            number,
            f"Four tops, t = {t}",
            [draw_picture(four, t)],
            f"Largest frame errors so far: Bobenko-Suris {four.until('BS', t):.2g}, Extrap "
            f"{four.until('Ext', t):.1g} rad.",
        )


def draw_frame_chart(t, L, curves, end):
    series = [(label, *cut_at(t, L[name], end), colour, "-") for name, label, colour in curves]
    return line_charts.draw_lines(series, "frame error L [rad]")


def draw_frame_log(t, L, curves, errors, end):
    """Plot the running maxima of errors on a logarithmic scale."""
    both = [(label, L[name], colour, "-") for name, label, colour in curves]
    both += [(name, error, IMPROVED[name], "--") for name, error in errors.items()]
    series = [
        (label, *cut_at(t, np.maximum.accumulate(error), end), colour, style)
        for label, error, colour, style in both
    ]
    return line_charts.draw_lines(series, "largest L so far [rad]", log=True, floor=HALF_PI)


def draw_frame_errors(four):
    errors = {
        name: compute_frame_error(course, four.true) for name, course in four.improved.items()
    }
    text = [
        ("BS text", "Bobenko-Suris, eps 0.2 against 0.01", BLUE),
        ("Ext text", "Extrap, 0.2 against 0.01", GREEN),
    ]
    true = [("BS", "Bobenko-Suris (theorem 4.2)", BLUE), ("Ext", "Extrap", GREEN)]
    for number, end in (("6.6", 50), ("6.7", 300), ("6.8", 600)):
        remark = "; ".join(
            f"{name} {largest_until(four.t, error, end):.2g}" for name, error in errors.items()
        )
        yield Figure(
            number,
            f"Errors in the body frame to t = {end}",
            [
                draw_frame_chart(four.t, four.L, text, end),
                draw_frame_log(four.t, four.L, true, errors, end),
            ],
            f"Against the truth at most: Bobenko-Suris {four.until('BS', end):.3g}, Extrap "
            f"{four.until('Ext', end):.2g} rad. In the same steps: {remark}.",
        )


def draw_integrals(four):
    yield draw_axial_momentum(four)
    yield draw_energy_by_step(four)
    yield draw_energy_by_method(four)


def draw_axial_momentum(four):
    blue, green = four.blue.axial_error, four.green.axial_error
    series = [
        ("Bobenko-Suris", four.t, blue, BLUE, "-"),
        ("Extrap", four.t, green, GREEN, "-"),
    ]
    return Figure(
        "6.9",
        "<m,apex> - <m,apex>(0) for eps = 0.2",
        [line_charts.draw_lines(series, "<m,apex> - <m,apex>(0)")],
        f"At t = 600: Bobenko-Suris {abs(blue).max():.0e} at most, Extrap {green[-1]:.1e}.",
    )


def draw_energy_by_step(four):
    t, blue = cut_at(four.t, four.blue.energy_error, 50)
    _, red = cut_at(four.t, four.red.energy_error, 50)
    series = [("eps 0.2", t, blue, BLUE, "-"), ("eps 0.01", t, red, RED, "-")]
    return Figure(
        "6.10",
        "Error in the energy, Bobenko-Suris",
        [line_charts.draw_lines(series, "E - E0")],
        f"The ratio of the ranges is {np.ptp(blue) / np.ptp(red):.2f}, that of the steps 20.",
    )


def draw_energy_by_method(four):
    t, blue, green = four.t, four.blue.energy_error, four.green.energy_error
    both = [("Bobenko-Suris", blue, BLUE, "-"), ("Extrap", green, GREEN, "-")]
    more = [
        (name, course.energy_error, IMPROVED[name], "--") for name, course in four.improved.items()
    ]
    maxima = [
        (label, t, np.maximum.accumulate(abs(error)), colour, style)
        for label, error, colour, style in both + more
    ]
    return Figure(
        "6.11",
        "Error in the energy for eps = 0.2",
        [
            line_charts.draw_lines([(label, t, *rest) for label, *rest in both], "E - E0"),
            line_charts.draw_lines(maxima, "largest |E - E0| so far", log=True),
        ],
        f"Bobenko-Suris {blue.min():.3f} .. {blue.max():.3f}, Extrap at most "
        f"{abs(green).max():.1e}; E0 = {four.blue.path.energy[0]:.3f}.",
    )


def draw_cause(four):
    is_early = four.t <= 60
    t, error = four.t[is_early], four.blue.energy_error
    labels, colours = ("E - E0", "L [rad]"), (ORANGE, BLUE)
    yield Figure(
        "6.12",
        "Error in the energy, opposed to the error in the frame",
        [
            line_charts.draw_two_scales(
                t, error[is_early], four.L["BS"][is_early], labels, colours
            ),
            line_charts.draw_lines(
                [
                    ("E - E0", t, error[is_early], ORANGE, "-"),
                    ("the term", t, four.term[is_early], INK, ":"),
                ],
                "energy",
            ),
        ],
        f"E - E0 is the term -I1 eps/2 <a {TIMES} m, p>, less its start, to "
        f"{abs(four.term - error).max():.0e}.",
    )


def draw_failing(four, rows):
    error, L = four.blue.energy_error, four.L["BS"]
    yield Figure(
        "6.13",
        "g = 10, m = (5, 0, 0): t = 20",
        [draw_picture(four, 20.0)],
        f"L = {L[-1]:.2f} rad now and {L.max():.2f} at most; Extrap {four.L['Ext'].max():.0e}.",
    )
    series = [
        ("Bobenko-Suris, eps 0.2", four.t, error, BLUE, "-"),
        ("Extrap", four.t, four.green.energy_error, GREEN, "-"),
    ]
    yield Figure(
        "6.14",
        "Error in the energy, g = 10, m = (5, 0, 0)",
        [line_charts.draw_lines(series, "E - E0")],
        f"{error.min():.1f} .. {error.max():+.1f} on {four.blue.path.energy[0]:.1f}.",
    )
    factors = sorted(set(rows[:, 1]))
    groups = [
        (f"m times {factor:g}", *rows[rows[:, 1] == factor][:, 2:].T, colour, "o-")
        for factor, colour in zip(factors, (BLUE, ORANGE, GREEN, RED), strict=True)
    ]
    term = f"largest |I1 eps/2 <a {TIMES} m, p>| to t = 20"
    yield Figure(
        "6.14, more",
        "How the error grows with the term (6.1.5)",
        [line_charts.draw_scatter(groups, term, "largest L [rad]")],
        "Each line: g = 0.5, 1, 2, 5, 10; eps = 0.2.",
    )


def draw_equal_time(experiment):
    yield from draw_equal_time_stills(experiment)
    yield from draw_equal_time_frames(experiment)
    yield from draw_equal_time_energies(experiment)


def draw_equal_time_stills(experiment):
    tops = {
        "red": experiment.red,
        "blue": experiment.blue,
        "yellow": experiment.true,
        "green": experiment.green,
    }
    for number, t in (("6.15", 200), ("6.16", 600), ("6.17", 1000), ("6.18", 3200)):
        yield Figure(
            number,
            f"Four tops in experiment 6.2, t = {t}",
            [draw_four_tops(tops, float(t), HALF, PIVOT)],
            f"Largest frame errors so far: Bobenko-Suris {experiment.until('BS', t):.2g}, Extrap "
            f"{experiment.until('Ext', t):.1g} rad. Yellow is the truth.",
        )


def draw_equal_time_frames(experiment):
    errors = {name: experiment.L[name] for name in experiment.improved}
    curves = [
        ("BS", "Bobenko-Suris, 166 sub-steps", BLUE),
        ("Ext", "Extrap, tolerance 2e-8", GREEN),
        ("equal", f"Bobenko-Suris, {experiment.substeps}: equal time here", OCHRE),
    ]
    for number, end in (("6.19", 400), ("6.20", 1000), ("6.21", 3200)):
        bs, equal, ext = (experiment.until(name, end) for name in ("BS", "equal", "Ext"))
        yield Figure(
            number,
            f"Errors in the body frame to t = {end}, experiment 6.2",
            [
                draw_frame_chart(experiment.t, experiment.L, curves[:2], end),
                draw_frame_log(experiment.t, experiment.L, curves, errors, end),
            ],
            f"Bobenko-Suris {bs:.2g}, with equal time {equal:.2g}; Extrap {ext:.2g} rad.",
        )


def draw_equal_time_energies(experiment):
    for number, end in (("6.22", 1000), ("6.23", 3200)):
        t, blue = cut_at(experiment.t, experiment.blue.energy_error, end)
        _, green = cut_at(experiment.t, experiment.green.energy_error, end)
        series = [("Bobenko-Suris", t, blue, BLUE, "-"), ("Extrap", t, green, GREEN, "-")]
        alone = line_charts.draw_lines(series[1:], "E - E0, Extrap alone")
        yield Figure(
            number,
            f"Error in the energy to t = {end}, experiment 6.2",
            [line_charts.draw_lines(series, "E - E0"), alone],
            f"Bobenko-Suris {blue.min():.3f} .. {blue.max():.3f}, Extrap at most "
            f"{abs(green).max():.0e}.",
        )


def draw_equal_evaluations(by_step):
    equal = by_step[0.2]
    t, rk4, bs = equal.t, equal.rk4.energy_error, equal.bs.energy_error
    energies = [("Runge-Kutta", t, rk4, OCHRE, "-"), ("Bobenko-Suris", t, bs, BLUE, "-")]
    yield Figure(
        "6.24",
        "Error in the energy to t = 30, equal evaluations",
        [line_charts.draw_lines(energies, "E - E0")],
        f"Runge-Kutta {rk4.min():.3f}, Bobenko-Suris within {np.ptp(bs):.2f}.",
    )
    rk4, bs = equal.L["rk4"], equal.L["BS"]
    frames = [("Runge-Kutta", t, rk4, OCHRE, "-"), ("Bobenko-Suris", t, bs, BLUE, "-")]
    steps, of_all = np.array(list(by_step)), by_step.values()
    largest_of_all = [
        ("Runge-Kutta", steps, [each.L["rk4"].max() for each in of_all], OCHRE, "o-"),
        ("Bobenko-Suris", steps, [each.L["BS"].max() for each in of_all], BLUE, "s-"),
    ]
    yield Figure(
        "6.25",
        "Errors in the frame to t = 30, equal evaluations",
        [
            line_charts.draw_lines(frames, "frame error L [rad]"),
            line_charts.draw_lines(
                largest_of_all, "largest L to t = 30 [rad]", log=True, xlabel="eps2"
            ),
        ],
        f"For eps2 = 0.2: Runge-Kutta {rk4.max():.2g}, Bobenko-Suris {bs.max():.2g} rad. "
        "Right: all eps2.",
    )
