"""The motion of spinning tops: rigid bodies that turn about a fixed point under gravity.

    import kreisel as kr
    body = kr.Body.cuboid(half=(.8, .8, 1), pivot=(0, 0, -1))
    scene = kr.Scene(body, momentum=(.172, -1.862, 1.46))
    path = kr.solve(scene, t=300, method="bobenko_suris", step=.01, every=10)
    path.t, path.q, path.apex, path.energy

Attitudes are unit quaternions (w, x, y, z), scalar first, from the body into space. Vectors are
seen from space. Units are any consistent set, given as [M L T]. See kreisel.conventions(),
kreisel.methods and kreisel.scenes.
"""

from . import events, quaternion, scenes
from ._analysis.apex import Apex, Nutation, apex
from ._analysis.compare import CompareInterrupted, Row, Table, compare
from ._analysis.frequencies import Frequencies, frequencies
from ._analysis.plot import plot
from ._analysis.rod import Rod, rod
from ._analysis.units import Units, h_eps, scaled_units
from ._core import version as __version__
from ._ground.names import MethodName, QuantityName
from ._model.bodies import Bodies
from ._model.body import Body
from ._model.scene import Ensemble, Scene
from ._model.starts import starts
from ._recording.growing import Indicator
from ._recording.many_events import ManyEvents
from ._recording.path import Error, Events, Interrupted, Path, Stats
from ._recording.paths import Paths
from ._recording.reduced import Reduced
from ._recording.section import Section
from ._request.methods import Method, methods
from ._request.plan import Choice, Plan
from ._showing.view import View, view
from ._sweeping.source import Source
from ._sweeping.sweep import SweepInterrupted, sweep
from ._sweeping.swept import Swept, read_sweep
from ._verbs.chaos import lyapunov, megno, oli
from ._verbs.exact import Exact, ExactKowalewski, ExactMap, exact
from ._verbs.exact_many import ExactEnsemble
from ._verbs.load import load
from ._verbs.plans import ManyPlan, plan
from ._verbs.run import Run, resume
from ._verbs.section import section
from ._verbs.solve import solve
from ._verbs.start import start
from ._verbs.stream import stream
from .events import Event
from .quaternion import attitude_error, conventions, from_rotation

__all__ = [
    "Apex",
    "Bodies",
    "Body",
    "Choice",
    "CompareInterrupted",
    "Ensemble",
    "Error",
    "Event",
    "Events",
    "Exact",
    "ExactEnsemble",
    "ExactKowalewski",
    "ExactMap",
    "Frequencies",
    "Indicator",
    "Interrupted",
    "ManyEvents",
    "ManyPlan",
    "Method",
    "MethodName",
    "Nutation",
    "Path",
    "Paths",
    "Plan",
    "QuantityName",
    "Reduced",
    "Rod",
    "Row",
    "Run",
    "Scene",
    "Section",
    "Source",
    "Stats",
    "SweepInterrupted",
    "Swept",
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
    "frequencies",
    "from_rotation",
    "h_eps",
    "load",
    "lyapunov",
    "megno",
    "methods",
    "oli",
    "plan",
    "plot",
    "quaternion",
    "read_sweep",
    "resume",
    "rod",
    "scaled_units",
    "scenes",
    "section",
    "solve",
    "start",
    "starts",
    "stream",
    "sweep",
    "view",
]
