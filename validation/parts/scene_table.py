"""Descriptions and pictures of the scenes in the report."""

import kreisel as kr
import numpy as np

from ..drawing.spheres import draw_apex_path
from ..references.problems import TABLES
from .formatting import format_brief

SHOWN, SEEN = 30.0, 3000  # approximate number of turns, and number of states, of the path
DOT = 0.03  # radius of the dot at the start, on a sphere of radius 1


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
        "user": problem.user,
        "about": None if problem.user else TABLES["scenes"][problem.name]["about"],
        "end": f"{end:.4g}",
        "shown": f"{path.t[-1]:.3g}",
        "is_hidden": np.linalg.norm(path.apex - path.apex[0], axis=1).max() < DOT,
        "turns": format_brief(count_turns(path, end)),
        "apex": draw_apex_path(path.apex),
    }
