"""What the page tells of each scene: what moves there, and where its centre of mass goes."""

import kreisel as kr
import numpy as np

from ..drawing import sphere_plots
from .formatting import format_brief

ABOUT = {
    "thesis": """The top of the thesis: an upright box, 1.6 by 1.6 by 2, that stands on the middle
        of its lower face. It is a <em>Lagrange top</em>: two moments of inertia are equal and the
        centre of mass lies on the third axis. Let go, it falls, swings through below and comes up
        again, over and over, while it circles about the vertical: a regular motion.""",
    "kowalewski": """A flat box, 3.5 by 2 by 1, held in the middle of a large face, with sides
        chosen such that two moments of inertia are equal and the third is half of them: the
        <em>Kowalewski top</em>. Its motion is regular too, but nothing about it looks so; methods
        for symmetric tops only do not apply.""",
    "goryachev_chaplygin": """Another flat box, whose third moment is a quarter of the equal two:
        the <em>Goryachev-Chaplygin top</em>, regular only while its angular momentum has no
        vertical part. Beside such a motion lie chaotic ones.""",
    "asymmetric": """A box, 1.2 by 1.6 by 2, held at a point beside the middle of its lower face:
        three different moments of inertia and no symmetry. Its motion is <em>chaotic</em>: small
        errors grow exponentially. By t = 100, one rounding of the data moves the attitude a million
        times as far as by t = 30, hence the full comparison ends at t = 30.""",
    "asymmetric_regular": """A box of three different sides, held in the middle of its lower face,
        that spins fast enough to be regular.""",
    "fast": """The top of the thesis, spinning so fast that it hardly moves its axis. What is fast
        is simple, what is hard is slow: methods that turn a free body exactly take far larger steps
        here than those that follow each turn.""",
    "strong_gravity": """The top of the thesis, pulled ten times as much and spinning little: a
        heavy pendulum that circles.""",
}
OWN = "A scene of yours, of a body of kind {body.kind}, gravity {gravity:g}."
SHOWN, SEEN = 30.0, 3000  # of the path drawn: turns or so, and how many states


def describe_scene(problem):
    scene = problem.user
    return OWN.format(body=scene.body, gravity=scene.gravity) if scene else ABOUT[problem.name]


def scene_context(problem, end):
    """Gives a scene in words and in a picture, and how often it turns to the end."""
    shown = end if end * problem.rate < 6 * SHOWN else 6 * SHOWN / problem.rate
    path = kr.solve(problem.to_scene(), t=np.linspace(0, shown, SEEN))
    turns = np.linalg.norm(path.velocity, axis=1).mean() / (2 * np.pi)  # in a unit of time
    return {
        "name": problem.name,
        "end": f"{end:.4g}",
        "about": describe_scene(problem),
        "shown": f"{shown:.3g}",
        "turns": format_brief(turns * end),
        "apex": sphere_plots.draw_apex_path(path.apex),
    }
