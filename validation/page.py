"""The page: for somebody who has not read the thesis."""
from pathlib import Path

import jinja2
import numpy as np

import kreisel as kr

from . import contenders, figures, tables
from .scenes import load
from .truth import stored
from .workprecision import LUCK, by_method

ABOUT = {
    "thesis": """The top of the thesis: an upright box, 1.6 by 1.6 by 2, that stands on the middle of its lower face. It is a
        <em>Lagrange top</em>: two moments of inertia are equal and the centre of mass lies on the third axis. Let go, it
        falls, swings through below and comes up again, over and over, while it circles about the vertical: a regular
        motion.""",
    "kowalewski": """A flat box, 3.5 by 2 by 1, held in the middle of a large face, with sides chosen such that two moments
        of inertia are equal and the third is half of them: the <em>Kowalewski top</em>. Its motion is regular too, but
        nothing about it looks so; methods for symmetric tops only do not apply.""",
    "asymmetric": """A box, 1.2 by 1.6 by 2, held at a point beside the middle of its lower face: three different moments of
        inertia and no symmetry. Its motion is <em>chaotic</em>: small errors grow exponentially. By t = 100, one rounding
        of the data moves the attitude a million times as far as by t = 30, hence the full comparison ends at t = 30.""",
}
QUANTITIES = {"attitude_error": "attitude error at the end [rad]", "energy_error": "energy error, relative"}
SHOWN, SEEN = 30.0, 3000        # of the apex: time, and how many states


def apex(name, end):
    """Where the centre of mass goes, and how often the body turns in a unit of time."""
    path = kr.solve(load(name).scene(), t=np.linspace(0, end, SEEN))
    return path.apex, np.linalg.norm(path.velocity, axis=1).mean() / (2 * np.pi)


def scene_part(rows, scene, end, look):
    path, turns = apex(scene, min(end, SHOWN))
    groups = by_method(rows, scene)
    floor = stored(scene, end)["conditioning"]
    return {"name": scene, "end": f"{end:g}", "about": ABOUT[scene], "shown": f"{min(end, SHOWN):g}",
            "turns": f"{turns * end:.0f}", "apex": figures.apex_path(path),
            "figures": [{"label": label, "svg": figures.error_against_time(
                groups, quantity, label, look, floor if quantity == "attitude_error" else None)}
                for quantity, label in QUANTITIES.items()],
            "times": list(tables.times(rows, scene))}


def described_methods(rows):
    """Name, order, what it is and where it comes from, for each that ran."""
    ran = {row.method for row in rows}
    for name, method in kr.methods.items():
        if name in ran:
            yield {"name": name, "order": method.order or "varies", "text": method.text,
                   "reference": method.reference}
    for peer in contenders.PEERS:
        yield {"name": peer.name, "order": peer.order, "text": peer.text, "reference": "for comparison"}


def template(name):
    templates = jinja2.FileSystemLoader(Path(__file__).with_name("templates"))
    return jinja2.Environment(loader=templates, autoescape=True, undefined=jinja2.StrictUndefined,
                              trim_blocks=True, lstrip_blocks=True).get_template(name)


def render(rows, about, ends, checks, setup):
    look = figures.looks(kr.methods)
    return template("report.html").render(
        about=about, checks=checks, setup=setup, setting=tables.setting, luck=f"{LUCK:g}",
        scenes=[scene_part(rows, scene, end, look) for scene, end in ends.items()],
        summary=list(tables.summary(rows, ends)), references=tables.references(rows),
        targets=[tables.power(target) for target in tables.TARGETS],
        methods=list(described_methods(rows)), failures=[row for row in rows if row.failure])
