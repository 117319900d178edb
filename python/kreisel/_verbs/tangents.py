"""Tangents: a path with the derivatives of its states, by its start and by what its body is."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import Literal

from .._core import start as start_top
from .._core import tangents as TANGENTS
from .._ground.arguments import Numbers, instance, shown
from .._ground.refusals import unknown
from .._model.scene import Scene
from .._recording.carried import Carried
from .._recording.path import Path, path_of, stopped, way
from .._recording.recording import told
from .._request.methods import ELSE
from .._request.request import Progress, checked_every, checked_progress, request
from .._request.times import listed, refuse_endless

TangentName = Literal["start", "moments", "com", "gravity", "mass"]
_LEFT_OUT = "error", "want", "events", "threads", "executor", "reduce", "out"
Tangents = TangentName | Iterable[TangentName]


def checked_tangents(tangents: object) -> tuple[str, ...]:
    """What is to be derived by, each once, in the order of the core's table."""
    given = [tangents] if isinstance(tangents, str) else tangents
    if not isinstance(given, Iterable):
        raise TypeError(
            f"tangents must be names, as in tangents='start' or ('start', 'gravity'), not "
            f"{shown(tangents)}"
        )
    names = list(given)
    for name in names:
        if not isinstance(name, str) or name not in TANGENTS:
            raise ValueError(unknown("name in tangents:", str(name), TANGENTS))
    if not names:
        raise ValueError("tangents names nothing to derive by; leave it out for a path alone")
    return tuple(name for name in TANGENTS if name in names)


def solve_with_tangents(
    top: object,
    t: Numbers,
    method: str,
    tangents: object,
    steering: tuple[object, object, object, object],
    every: object,
    others: tuple[object, ...],
    progress: Progress | None,
) -> Path:
    """The path of a scene in the words of kreisel.solve, with tangents; `steering` is step, tol,
    digits and max_steps, and none of the `others` may be given."""
    scene, by = instance("scene", top, Scene), checked_tangents(tangents)
    for word, value in zip(_LEFT_OUT, others, strict=True):
        if value is not None:
            raise ValueError(f"tangents ride along with all states of a path: leave {word} out")
    name = ELSE if method == "auto" else method
    asked = request(scene, name, *steering, None, method)
    if not asked.method.tangents:
        raise ValueError(
            f"the method {name!r} carries no tangents: that is for method='taylor', or 'auto'"
        )
    checked_every(asked.method, every)
    callback = checked_progress(progress)
    columns = sum(TANGENTS[word][1] for word in by)
    times = listed(t, asked.step, None, asked.size + 2 * 48 * columns)
    end = float(times[-1]) if times.size else 0.0
    refuse_endless(scene, end, asked.step)
    bits = sum(TANGENTS[word][0] for word in by)
    status, top = start_top(scene._block, *asked.core, end < 0.0, [], bits)
    if top is None:
        path = path_of(scene, asked, (status, scene._start.copy(), None, (0, 0, 0, 0), end))
        raise stopped(status, path, way(path, end))
    came, high, low, rest = top.record_tangents(times, asked.low, callback)
    path = replace(path_of(scene, asked, came), _carried=Carried.of(high, low, rest, by))
    if came[0] != "OK":
        raise stopped(came[0], path, way(path, end))
    return told(path, callback)
