"""The motion of spinning tops: rigid bodies that rotate about a fixed point under gravity.

    import kreisel as kr
    body = kr.Body.cuboid(half=(.8, .8, 1), pivot=(0, 0, -1))
    scene = kr.Scene(body, momentum=(.172, -1.862, 1.46), gravity=9.81)
    path = kr.solve(scene, t=300, method="bobenko_suris", step=.01, every=10)
    path.t, path.q, path.apex, path.energy

Attitudes are unit quaternions (w, x, y, z), scalar first, that rotate vectors from the body frame
to the space frame. Vector components refer to the space frame unless stated otherwise. Any
consistent set of units can be used; dimensions are given in terms of mass, length and time [M L T].
See also kreisel.quaternion.conventions(), kreisel.methods, kreisel.scenes and kreisel.types.
"""

import sys
from typing import TYPE_CHECKING

from . import events, quaternion, scenes, types
from ._analysis.citation import citation
from ._analysis.compare import compare
from ._analysis.curves import Apex, apex, plot, rod
from ._analysis.frequencies import Frequencies, frequencies
from ._analysis.steady import steady
from ._core import version as __version__
from ._model.body import Body
from ._model.scene import Scene
from ._model.starts import starts
from ._options.methods import Method, methods
from ._options.plan import Plan
from ._results.path import Events, Path, Reductions
from ._results.results import Error, Interrupted
from ._solve.chaos import Chaos, chaos
from ._solve.exact import Exact, ExactTorus, exact
from ._solve.run import Run, resume, start
from ._solve.section import Section, section
from ._solve.solve import load, plan, reduce, solve, stream
from ._utils.arguments import explain_public_names
from ._view import view
from .events import Event
from .quaternion import attitude_error, from_rotation

if TYPE_CHECKING:  # beside the core: imported on first access
    from ._fit.fit import fit
    from ._fit.records import Record
    from ._fit.result import Fit
    from ._proof.enclosure import Enclosure, Verification, enclose
    from ._score.score import Score, score
    from ._sweep.source import Source
    from ._sweep.sweep import SweepResult, read_sweep, sweep

__all__ = [
    "Apex",
    "Body",
    "Chaos",
    "Enclosure",
    "Error",
    "Event",
    "Events",
    "Exact",
    "ExactTorus",
    "Fit",
    "Frequencies",
    "Interrupted",
    "Method",
    "Path",
    "Plan",
    "Record",
    "Reductions",
    "Run",
    "Scene",
    "Score",
    "Section",
    "Source",
    "SweepResult",
    "Verification",
    "__version__",
    "apex",
    "attitude_error",
    "chaos",
    "citation",
    "compare",
    "enclose",
    "events",
    "exact",
    "fit",
    "frequencies",
    "from_rotation",
    "load",
    "methods",
    "plan",
    "plot",
    "quaternion",
    "read_sweep",
    "reduce",
    "resume",
    "rod",
    "scenes",
    "score",
    "section",
    "solve",
    "start",
    "starts",
    "steady",
    "stream",
    "sweep",
    "view",
]


def __dir__() -> list[str]:
    """List the public names."""
    return sorted(__all__)


for _module in (events, quaternion, scenes, types):
    explain_public_names(_module)
explain_public_names(
    sys.modules[__name__],
    constructible=("Event", "Record"),
    later={
        "Enclosure": "._proof.enclosure",
        "Fit": "._fit.result",
        "Record": "._fit.records",
        "Score": "._score.score",
        "Source": "._sweep.source",
        "SweepResult": "._sweep.sweep",
        "Verification": "._proof.enclosure",
        "enclose": "._proof.enclosure",
        "fit": "._fit.fit",
        "read_sweep": "._sweep.sweep",
        "score": "._score.score",
        "sweep": "._sweep.sweep",
    },
)
