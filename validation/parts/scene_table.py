"""Descriptions and pictures of the scenes in the report."""

import kreisel as kr
import numpy as np

from ..drawing import sphere_plots
from .formatting import format_brief

ABOUT = {
    "thesis": """The top of the thesis: an upright cuboid, 1.6 by 1.6 by 2, with the centre of its
        lower face fixed. It is a <em>Lagrange top</em>: two moments of inertia are equal and the
        centre of mass lies on the third axis. After its release it falls, swings through the
        lowest point and rises again, repeatedly, while it moves about the vertical. The motion is
        regular.""",
    "kowalewski": """A flat cuboid, 3.5 by 2 by 1, held at the centre of a large face, with sides
        such that two moments of inertia are equal and the third is half of them: the
        <em>Kowalewski top</em>. Its motion is regular too, although it looks irregular. Methods
        for symmetric tops do not apply.""",
    "goryachev_chaplygin": """A flat cuboid whose third moment is a quarter of the equal two: the
        <em>Goryachev-Chaplygin top</em>, whose motion is regular only if the vertical component of
        its angular momentum vanishes. Neighbouring motions are chaotic.""",
    "asymmetric": """A cuboid, 1.2 by 1.6 by 2, held at a point beside the centre of its lower face:
        three different moments of inertia and no symmetry. Its motion is <em>chaotic</em>: small
        errors grow exponentially. One rounding of the data moves the attitude at t = 100 a million
        times as far as at t = 30. The comparison therefore ends at t = 30.""",
    "asymmetric_regular": """A cuboid with three different sides, held at the centre of its lower
        face, whose spin is fast enough for a regular motion.""",
    "fast": """The top of the thesis with a spin so fast that its axis hardly moves. Methods that
        rotate a free body exactly can take far larger steps here than methods that resolve each
        turn.""",
    "strong_gravity": """The top of the thesis with ten times the gravity and little spin: a heavy
        spherical pendulum.""",
}
OWN = "Your scene, with a body of kind {body.kind} and gravity {gravity:g}."
SHOWN, SEEN = 30.0, 3000  # approximate number of turns, and number of states, of the path
DOT = 0.03  # radius of the dot at the start, on a sphere of radius 1


def describe_scene(problem):
    scene = problem.user
    return OWN.format(body=scene.body, gravity=scene.gravity) if scene else ABOUT[problem.name]


def trace_path(problem, end):
    """Compute the path that is shown in the figure of a scene."""
    length = end if end * problem.rate < 6 * SHOWN else 6 * SHOWN / problem.rate
    return kr.solve(problem.to_scene(), t=np.linspace(0, length, SEEN))


def count_turns(path, end):
    """Estimate the number of turns until `end` from the mean angular velocity."""
    return np.linalg.norm(path.velocity, axis=1).mean() / (2 * np.pi) * end


def scene_context(problem, end):
    """Return a scene's description, its apex path as a picture, and the number of turns."""
    path = trace_path(problem, end)
    return {
        "name": problem.name,
        "end": f"{end:.4g}",
        "about": describe_scene(problem),
        "shown": f"{path.t[-1]:.3g}",
        "is_hidden": np.linalg.norm(path.apex - path.apex[0], axis=1).max() < DOT,
        "turns": format_brief(count_turns(path, end)),
        "apex": sphere_plots.draw_apex_path(path.apex),
    }
