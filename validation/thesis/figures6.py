"""The figures of chapter 6, drawn again. Left as the thesis has them, right on a logarithmic scale with the truth's
verdict on more methods, where that tells more."""

import numpy as np

from . import charts
from .charts import BLUE, GREEN, IMPROVED, INK, OCHRE, ORANGE, RED
from .figures5 import Figure, picture
from .runs import frame_error, largest

HALF_PI = np.pi / 2


def until(t, values, end):
    kept = t <= end * (1 + 1e-9)
    return t[kept], values[kept]


def first():
    """The settings, told by figure 6.1, and the sketch 6.5."""
    return Figure(
        "6.5",
        "L(E) is the length of the geodesic from E to N",
        [charts.geodesic()],
        "E and its negative are one attitude: hence |a1|, and L of at most \N{GREEK SMALL LETTER PI}/2. In "
        "kreisel the attitude error is the angle of the rotation, 2 L.",
    )


def stills(four):
    said = {"6.1": 300, "6.2": 50, "6.3": 300, "6.4": 600}
    for number, t in said.items():
        yield Figure(
            number,
            f"Four tops, t = {t}",
            [picture(four, t)],
            f"Largest frame errors so far: Bobenko-Suris {four.until('BS', t):.2g}, Extrap "
            f"{four.until('Ext', t):.1g} rad.",
        )


def frame_chart(t, L, named, end):
    series = [(label, *until(t, L[name], end), colour, "-") for name, label, colour in named]
    return charts.lines(series, "frame error L [rad]")


def frame_log(t, L, named, improved, end):
    """Running maxima: as logarithms the moments where an error passes through zero would hide it."""
    both = [(label, L[name], colour, "-") for name, label, colour in named]
    both += [(name, error, IMPROVED[name], "--") for name, error in improved.items()]
    series = [
        (label, *until(t, np.maximum.accumulate(error), end), colour, style)
        for label, error, colour, style in both
    ]
    return charts.lines(series, "largest L so far [rad]", log=True, floor=HALF_PI)


def frames(four):
    improved = {name: frame_error(run, four.true) for name, run in four.improved.items()}
    text = [
        ("BS text", "Bobenko-Suris, eps 0.2 against 0.01", BLUE),
        ("Ext text", "Extrap, 0.2 against 0.01", GREEN),
    ]
    true = [("BS", "Bobenko-Suris (theorem 4.2)", BLUE), ("Ext", "Extrap", GREEN)]
    for number, end in (("6.6", 50), ("6.7", 300), ("6.8", 600)):
        also = "; ".join(
            f"{name} {largest(four.t, error, end):.2g}" for name, error in improved.items()
        )
        yield Figure(
            number,
            f"Errors in the body frame to t = {end}",
            [
                frame_chart(four.t, four.L, text, end),
                frame_log(four.t, four.L, true, improved, end),
            ],
            f"Against the truth at most: Bobenko-Suris {four.until('BS', end):.3g}, Extrap "
            f"{four.until('Ext', end):.2g} "
            f"rad. In the same steps: {also}.",
        )


def integrals(four):
    t, green = four.t, four.green
    yield Figure(
        "6.9",
        "<m,a> - <m,a>(0) for eps = 0.2",
        [
            charts.lines(
                [
                    ("Bobenko-Suris", t, four.blue.change("axial_momentum"), BLUE, "-"),
                    ("Extrap", t, green.change("axial_momentum"), GREEN, "-"),
                ],
                "<m,a> - <m,a>(0)",
            )
        ],
        f"At t = 600: Bobenko-Suris {abs(four.blue.change('axial_momentum')).max():.0e} at most, Extrap "
        f"{green.change('axial_momentum')[-1]:.1e}.",
    )
    end = 50
    yield Figure(
        "6.10",
        "Error in the energy, Bobenko-Suris",
        [
            charts.lines(
                [
                    ("eps 0.2", *until(t, four.blue.energy_error, end), BLUE, "-"),
                    ("eps 0.01", *until(t, four.red.energy_error, end), RED, "-"),
                ],
                "E - E0",
            )
        ],
        f"The ranges are as {np.ptp(four.blue.energy_error) / np.ptp(four.red.energy_error):.2f} to 1, the steps "
        "as 20.",
    )
    improved = [
        (name, t, np.maximum.accumulate(abs(run.energy_error)), IMPROVED[name], "--")
        for name, run in four.improved.items()
    ]
    both = [("Bobenko-Suris", four.blue, BLUE), ("Extrap", four.green, GREEN)]
    yield Figure(
        "6.11",
        "Error in the energy for eps = 0.2",
        [
            charts.lines(
                [(label, t, run.energy_error, colour, "-") for label, run, colour in both], "E - E0"
            ),
            charts.lines(
                [
                    (label, t, np.maximum.accumulate(abs(run.energy_error)), colour, "-")
                    for label, run, colour in both
                ]
                + improved,
                "largest |E - E0| so far",
                log=True,
            ),
        ],
        f"Bobenko-Suris {four.blue.energy_error.min():.3f} .. {four.blue.energy_error.max():.3f}, Extrap at most "
        f"{abs(four.green.energy_error).max():.1e}; E0 = {four.blue.path.energy[0]:.3f}.",
    )


def cause(four):
    kept = four.t <= 60
    t = four.t[kept]
    yield Figure(
        "6.12",
        "Error in the energy, opposed to the error in the frame",
        [
            charts.two_scales(
                t,
                four.blue.energy_error[kept],
                four.L["BS"][kept],
                ("E - E0", "L [rad]"),
                (ORANGE, BLUE),
            ),
            charts.lines(
                [
                    ("E - E0", t, four.blue.energy_error[kept], ORANGE, "-"),
                    ("the term", t, four.term[kept], INK, ":"),
                ],
                "energy",
            ),
        ],
        "E - E0 is the term -I1 eps/2 <a \N{MULTIPLICATION SIGN} m, p>, less its start, to "
        f"{abs(four.term - four.blue.energy_error).max():.0e}.",
    )


def failing(four, rows):
    yield Figure(
        "6.13",
        "g = 10, m = (5, 0, 0): t = 20",
        [picture(four, 20.0)],
        f"L = {four.L['BS'][-1]:.2f} rad now and {four.L['BS'].max():.2f} at most; Extrap {four.L['Ext'].max():.0e}.",
    )
    yield Figure(
        "6.14",
        "Error in the energy, g = 10, m = (5, 0, 0)",
        [
            charts.lines(
                [
                    ("Bobenko-Suris, eps 0.2", four.t, four.blue.energy_error, BLUE, "-"),
                    ("Extrap", four.t, four.green.energy_error, GREEN, "-"),
                ],
                "E - E0",
            )
        ],
        f"{four.blue.energy_error.min():.1f} .. {four.blue.energy_error.max():+.1f} on "
        f"{four.blue.path.energy[0]:.1f}.",
    )
    groups = [
        (f"m times {factor:g}", *rows[rows[:, 1] == factor][:, 2:].T, colour, "o-")
        for factor, colour in zip(sorted(set(rows[:, 1])), (BLUE, ORANGE, GREEN, RED))
    ]
    yield Figure(
        "6.14, more",
        "How the error grows with the term (6.1.5)",
        [
            charts.scatter(
                groups,
                "largest |I1 eps/2 <a \N{MULTIPLICATION SIGN} m, p>| to t = 20",
                "largest L [rad]",
            )
        ],
        "Each line: g = 0.5, 1, 2, 5, 10; eps = 0.2.",
    )


def timed(run):
    improved = {name: run.L[name] for name in run.improved}
    named = [
        ("BS", "Bobenko-Suris, 166 sub-steps", BLUE),
        ("Ext", "Extrap, tolerance 2e-8", GREEN),
        ("equal", f"Bobenko-Suris, {run.substeps}: equal time here", OCHRE),
    ]
    tops = type(
        "Tops", (), {"red": run.red, "blue": run.blue, "yellow": run.true, "green": run.green}
    )
    for number, t in (("6.15", 200), ("6.16", 600), ("6.17", 1000), ("6.18", 3200)):
        yield Figure(
            number,
            f"Four tops in experiment 6.2, t = {t}",
            [picture(tops, float(t))],
            f"Largest frame errors so far: Bobenko-Suris {run.until('BS', t):.2g}, Extrap "
            f"{run.until('Ext', t):.1g} rad. "
            "Yellow is the truth.",
        )
    for number, t in (("6.19", 400), ("6.20", 1000), ("6.21", 3200)):
        yield Figure(
            number,
            f"Errors in the body frame to t = {t}, experiment 6.2",
            [frame_chart(run.t, run.L, named[:2], t), frame_log(run.t, run.L, named, improved, t)],
            f"Bobenko-Suris {run.until('BS', t):.2g}, with equal time {run.until('equal', t):.2g}; Extrap "
            f"{run.until('Ext', t):.2g} rad.",
        )
    for number, t in (("6.22", 1000), ("6.23", 3200)):
        series = [
            (label, *until(run.t, each.energy_error, t), colour, "-")
            for label, each, colour in (
                ("Bobenko-Suris", run.blue, BLUE),
                ("Extrap", run.green, GREEN),
            )
        ]
        yield Figure(
            number,
            f"Error in the energy to t = {t}, experiment 6.2",
            [charts.lines(series, "E - E0"), charts.lines(series[1:], "E - E0, Extrap alone")],
            f"Bobenko-Suris {run.blue.energy_error.min():.3f} .. {run.blue.energy_error.max():.3f}, Extrap at most "
            f"{abs(until(run.t, run.green.energy_error, t)[1]).max():.0e}.",
        )


def equal_evaluations(by_step):
    run = by_step[0.2]
    named = (("Runge-Kutta", "rk4", run.rk4, OCHRE), ("Bobenko-Suris", "BS", run.bs, BLUE))
    yield Figure(
        "6.24",
        "Error in the energy to t = 30, equal evaluations",
        [
            charts.lines(
                [
                    (label, run.t, each.energy_error, colour, "-")
                    for label, _, each, colour in named
                ],
                "E - E0",
            )
        ],
        f"Runge-Kutta {run.rk4.energy_error.min():.3f}, Bobenko-Suris within {np.ptp(run.bs.energy_error):.2f}.",
    )
    steps = np.array(list(by_step))
    series = [
        ("Runge-Kutta", steps, [each.L["rk4"].max() for each in by_step.values()], OCHRE, "o-"),
        ("Bobenko-Suris", steps, [each.L["BS"].max() for each in by_step.values()], BLUE, "s-"),
    ]
    yield Figure(
        "6.25",
        "Errors in the frame to t = 30, equal evaluations",
        [
            charts.lines(
                [(label, run.t, run.L[name], colour, "-") for label, name, _, colour in named],
                "frame error L [rad]",
            ),
            charts.lines(series, "largest L to t = 30 [rad]", log=True, xlabel="eps2"),
        ],
        f"For eps2 = 0.2: Runge-Kutta {run.L['rk4'].max():.2g}, Bobenko-Suris {run.L['BS'].max():.2g} rad. Right: "
        "all eps2.",
    )
