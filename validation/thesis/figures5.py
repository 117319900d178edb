"""The figures of chapter 5, drawn again."""

from dataclasses import dataclass

import kreisel as kr
import numpy as np

from . import charts, pictures
from .charts import BLUE, GREEN, OCHRE, ORANGE, RED
from .integrals import adjusted
from .runs import HALF, PIVOT, SCENE, truth

STRETCHED = {"kowalewski": 3**0.5, "goryachev_chaplygin": 7**0.5}
NAMES = {"kowalewski": "Kowalewski", "goryachev_chaplygin": "Goryachev-Chaplygin"}
ROD_END, ROD_STATES = 30.0, 300


@dataclass(frozen=True)
class Figure:
    """A numbered figure of the thesis, as pictures in SVG, with what is to be seen and what is true."""

    number: str
    title: str
    pictures: list
    caption: str
    rows: tuple = ()


def cuboid_of(kind, half=0.8):
    """Quader coordinates and the fixed point, seen from the centre."""
    return (STRETCHED[kind] * half, half, half / 2), (0.0, 0.0, -half / 2)


def rod_of(scene):
    return kr.rod(truth(scene, np.linspace(0, ROD_END, ROD_STATES)).path)


def special():
    for letter, (kind, name) in zip("ab", NAMES.items()):
        scene = adjusted(kind)
        yield Figure(
            f"5.4({letter})",
            f"A {name} top",
            [pictures.one_top(scene, *cuboid_of(kind), ORANGE)],
            f"Kind by its moments: {scene.body.kind}. Momentum green, angular velocity blue.",
        )


def integral(kind, fourth):
    letter, name = {"kowalewski": ("K", "5.5"), "goryachev_chaplygin": ("G", "5.5, for G")}[kind]
    chart = charts.lines(
        [("Extrap, tolerance 1e-5", fourth.t, fourth.change, GREEN, "-")],
        f"{letter}(t) - {letter}(0)",
    )
    return Figure(
        name,
        f"Error of the {NAMES[kind]} integral",
        [chart],
        f"{letter}(0) = {fourth.start:.4g} in units with I1 = 1; it changes by {fourth.change.min():.1e} .. "
        f"{fourth.change.max():.1e}.",
    )


def analogies():
    lagrange = truth(SCENE, np.linspace(0, 60, 1500)).path
    rod = rod_of(SCENE)
    yield Figure(
        "5.6",
        "What the tab Rod & Apex Trace offered",
        [pictures.rod(rod, OCHRE), pictures.trace(lagrange)],
        "Here it is typed: kr.rod(path).plot() and path.plot().",
    )
    yield Figure(
        "5.7",
        "A Lagrange top with its isotropic elastic rod",
        [pictures.rod(rod, ORANGE), pictures.one_top(SCENE, HALF, PIVOT, ORANGE)],
        f"To t = {ROD_END:g}; its stiffness against bending {rod.stiffness[0]:.4g} towards every side, against twist "
        f"{rod.stiffness[2]:.4g}.",
    )
    for letter, (kind, name) in zip("ab", NAMES.items()):
        rod = rod_of(adjusted(kind))
        yield Figure(
            f"5.8({letter})",
            f"The anisotropic rod of the {name} top",
            [pictures.rod(rod, ORANGE)],
            f"Stiffness {rod.stiffness[0]:.4g} towards N and {rod.stiffness[1]:.4g} towards B, hence "
            f"{rod.section[1]:.3g} times as thick towards B.",
        )
    nutation = kr.apex(lagrange).nutation()
    yield Figure(
        "5.9",
        "The apex trace of a Lagrange top",
        [pictures.trace(lagrange)],
        f"From height {nutation.highest:.4f} to {nutation.lowest:.4f} and back in {nutation.period:.4f}. It begins "
        "upright, so it comes back through the vertical each time.",
    )


def comparing(four, equal_ends):
    pair = [pictures.two_tops(SCENE, HALF, PIVOT, (RED, OCHRE))]
    yield Figure(
        "5.10",
        "A top with its duplicate",
        pair,
        "Left by Bobenko-Suris, right by Extrap; at the start.",
    )
    yield Figure(
        "5.11",
        "The Lagrange top mode with eps2",
        [picture(four, 120.0)],
        f"At t = 120: frame errors {four.until('BS', 120):.2g} and {four.until('Ext', 120):.1g} rad so far.",
    )
    yield Figure("5.12", "The timer", [charts.timer()], f"A common end: {equal_ends}.")
    yield Figure(
        "5.13",
        "The tab Eps2: the integrals of motion",
        [],
        f"At t = {four.t[-1]:g}; in brackets the change since the start.",
        tuple(integrals_of(four)),
    )
    shown = four.t <= 50
    energy = charts.lines(
        [
            ("Bobenko-Suris, eps 0.2", four.t[shown], four.blue.energy_error[shown], BLUE, "-"),
            ("Extrap", four.t[shown], four.green.energy_error[shown], GREEN, "-"),
        ],
        "E - E0",
    )
    frame = charts.lines(
        [
            ("Bobenko-Suris, eps 0.2", four.t[shown], four.L["BS text"][shown], BLUE, "-"),
            ("Extrap", four.t[shown], four.L["Ext text"][shown], GREEN, "-"),
        ],
        "frame error L [rad]",
    )
    yield Figure("5.14", "The tab Diagrams", [energy, frame], "To t = 50.")


def picture(four, t, half=HALF, pivot=PIVOT):
    return pictures.four_tops(
        {name: getattr(four, name) for name in ("red", "blue", "yellow", "green")}, t, half, pivot
    )


def integrals_of(four):
    """What the tab showed: the values at the end, and how far they have gone."""
    yield "top", "<m, p>", "<m, a>", "E"
    for name in ("red", "blue", "yellow", "green"):
        path = getattr(four, name).path
        values = path.vertical_momentum * path.scene.gravity, path.axial_momentum, path.energy
        yield name, *(f"{value[-1]:.6f} ({value[-1] - value[0]:+.0e})" for value in values)
