"""The figures of chapter 5, redrawn."""

import kreisel as kr
import numpy as np

from . import frames, line_charts
from .figure import Figure
from .integrals import STRETCHED, special_scene
from .line_charts import BLUE, GREEN, OCHRE, ORANGE, RED
from .trajectories import HALF, PIVOT, SCENE, solve_truth

NAMES = {"kowalewski": "Kowalewski", "goryachev_chaplygin": "Goryachev-Chaplygin"}
INTEGRALS = {"kowalewski": ("K", "5.5"), "goryachev_chaplygin": ("G", "5.5, for G")}
ROD_END, ROD_STATES = 30.0, 300
TOPS = ("red", "blue", "yellow", "green")


def cuboid_dimensions(kind, half=0.8):
    """Return the half sides of the cuboid, and the position of the fixed point."""
    return (STRETCHED[kind] * half, half, half / 2), (0.0, 0.0, -half / 2)


def compute_rod(scene):
    return kr.rod(solve_truth(scene, np.linspace(0, ROD_END, ROD_STATES)).path)


def draw_special_tops():
    for letter, (kind, name) in zip("ab", NAMES.items(), strict=True):
        scene = special_scene(kind)
        yield Figure(
            f"5.4({letter})",
            f"A {name} top",
            [frames.draw_one_top(scene, *cuboid_dimensions(kind), ORANGE)],
            f"Kind by its moments: {scene.body.kind}. Momentum green, angular velocity blue.",
        )


def draw_integral(kind, fourth):
    letter, number = INTEGRALS[kind]
    series = [("Extrap, tolerance 1e-5", fourth.t, fourth.change, GREEN, "-")]
    return Figure(
        number,
        f"Error of the {NAMES[kind]} integral",
        [line_charts.draw_lines(series, f"{letter}(t) - {letter}(0)")],
        f"{letter}(0) = {fourth.start:.4g} in units with I1 = 1; it changes by "
        f"{fourth.change.min():.1e} .. {fourth.change.max():.1e}.",
    )


def draw_analogies():
    lagrange = solve_truth(SCENE, np.linspace(0, 60, 1500)).path
    rod = compute_rod(SCENE)
    yield Figure(
        "5.6",
        "The tab Rod & Apex Trace",
        [frames.draw_rod(rod, OCHRE), frames.draw_trace(lagrange)],
        "In kreisel: kr.rod(path).plot() and path.plot().",
    )
    yield Figure(
        "5.7",
        "A Lagrange top with its isotropic elastic rod",
        [frames.draw_rod(rod, ORANGE), frames.draw_one_top(SCENE, HALF, PIVOT, ORANGE)],
        f"To t = {ROD_END:g}; its stiffness against bending {rod.stiffness[0]:.4g} in every "
        f"direction, against twist {rod.stiffness[2]:.4g}.",
    )
    yield from draw_anisotropic_rods()
    nutation = kr.apex(lagrange).nutation()
    yield Figure(
        "5.9",
        "The apex trace of a Lagrange top",
        [frames.draw_trace(lagrange)],
        f"From height {np.cos(nutation.least):.4f} to {np.cos(nutation.greatest):.4f} and back in "
        f"{nutation.period:.4f}. It starts upright, so it passes through the vertical each time.",
    )


def draw_anisotropic_rods():
    for letter, (kind, name) in zip("ab", NAMES.items(), strict=True):
        rod = compute_rod(special_scene(kind))
        yield Figure(
            f"5.8({letter})",
            f"The anisotropic rod of the {name} top",
            [frames.draw_rod(rod, ORANGE)],
            f"Stiffness {rod.stiffness[0]:.4g} towards N and {rod.stiffness[1]:.4g} towards B, "
            f"hence {rod.section[1]:.3g} times as thick towards B.",
        )


def draw_comparison(four, equal_ends):
    yield Figure(
        "5.10",
        "A top with its duplicate",
        [frames.draw_two_tops(SCENE, HALF, PIVOT, (RED, OCHRE))],
        "Left by Bobenko-Suris, right by Extrap; at the start.",
    )
    yield Figure(
        "5.11",
        "The Lagrange top mode with eps2",
        [draw_picture(four, 120.0)],
        f"At t = 120: frame errors {four.until('BS', 120):.2g} and {four.until('Ext', 120):.1g} "
        "rad so far.",
    )
    yield Figure("5.12", "The timer", [line_charts.draw_timer()], f"A common end: {equal_ends}.")
    yield Figure(
        "5.13",
        "The tab Eps2: the integrals of motion",
        [],
        f"At t = {four.t[-1]:g}; the change since the start is in brackets.",
        tuple(tabulate_integrals(four)),
    )
    yield draw_diagrams(four)


def draw_diagrams(four):
    is_early = four.t <= 50
    t = four.t[is_early]

    def both(bs, ext, label):
        series = [
            ("Bobenko-Suris, eps 0.2", t, bs[is_early], BLUE, "-"),
            ("Extrap", t, ext[is_early], GREEN, "-"),
        ]
        return line_charts.draw_lines(series, label)

    energy = both(four.blue.energy_error, four.green.energy_error, "E - E0")
    frame = both(four.L["BS text"], four.L["Ext text"], "frame error L [rad]")
    return Figure("5.14", "The tab Diagrams", [energy, frame], "To t = 50.")


def draw_picture(four, t):
    return frames.draw_four_tops({name: getattr(four, name) for name in TOPS}, t, HALF, PIVOT)


def tabulate_integrals(four):
    """Yield the rows of a table with the final values and the changes of conserved quantities."""
    yield "top", "<m, p>", "<m, a>", "E"
    for name in TOPS:
        top = getattr(four, name)
        vertical = top.vertical_momentum * top.path.scene.gravity
        values = vertical, top.axial_momentum, top.path.energy
        yield name, *(f"{value[-1]:.6f} ({value[-1] - value[0]:+.0e})" for value in values)
