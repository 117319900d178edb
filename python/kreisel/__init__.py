"""kreisel: the motion of spinning tops.

    import kreisel as kr
    body = kr.Body.cuboid(half=(.8, .8, 1), pivot=(0, 0, -1))
    scene = kr.Scene(body, momentum=(.172, -1.862, 1.46))
    path = kr.solve(scene, t=300, method="bobenko_suris", step=.01, every=10)
    path.t, path.q, path.apex, path.energy

Attitudes are unit quaternions (w, x, y, z), scalar first, from the body into space; vectors are seen from space; any
consistent units do, given as [M L T]. See kreisel.conventions(), kreisel.methods, kreisel.scenes.
"""
from . import events, quaternion, scenes
from ._core import version as __version__
from .apex import Apex, Nutation, apex
from .body import Body
from .compare import Row, Table, compare
from .errors import Error, Interrupted
from .events import Event, Events
from .exact import Exact, ExactEnsemble, ExactMap, exact
from .methods import Method, methods
from .path import Path
from .plan import Choice, Plan, plan
from .quaternion import attitude_error, conventions, from_rotation
from .rod import Rod, rod
from .scene import Scene
from .run import Run, resume, start, stream
from .solve import solve
from .states import Stats
from .units import Units, h_eps, scaled_units
from .view import View, view

__all__ = [
    "Apex",
    "Body",
    "Choice",
    "Error",
    "Event",
    "Events",
    "Exact",
    "ExactEnsemble",
    "ExactMap",
    "Interrupted",
    "Method",
    "Nutation",
    "Path",
    "Plan",
    "Rod",
    "Row",
    "Run",
    "Scene",
    "Stats",
    "Table",
    "Units",
    "View",
    "__version__",
    "apex",
    "attitude_error",
    "compare",
    "conventions",
    "events",
    "exact",
    "from_rotation",
    "h_eps",
    "methods",
    "plan",
    "quaternion",
    "resume",
    "rod",
    "scaled_units",
    "scenes",
    "solve",
    "start",
    "stream",
    "view",
]
