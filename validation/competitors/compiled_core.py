"""The compiled core without the Python layer, for comparison with other inner loops.

This is the only file of validation that runs individual tops through private names of kreisel.
"""

from functools import partial
from pathlib import Path

from kreisel import _core

FILE = Path(_core.__file__)


def scene_bytes(scene):
    """Return the bytes of the C struct `kr_scene` for a scene."""
    return scene._block


def make_recording_call(
    block, method, times, *, step=0.0, tol=0.0, digits=0, most=0, leave_heading=False
):
    """Return a prepared call that records one run, for timing.

    The call returns the status, the states (n, 8), their low words (n, 8) or None, and the run's
    costs.
    """
    words = block, method, step, tol, digits, most, leave_heading, times
    return partial(_core.record, *words)
