"""kreisel.view: an interactive viewer of a scene, as one HTML file that needs no other file."""

from __future__ import annotations

import base64
import html
import json
import os
import re
import sys
import tempfile
import warnings
from dataclasses import dataclass
from pathlib import Path as File
from typing import Any

import numpy as np

from ._model.scene import Scene
from ._options.methods import resolve_method
from ._results.path import Path
from ._utils.arguments import as_positive, short_repr
from ._utils.files import atomic_write, check_file_is_writable
from .scenes import about, name_of

_PAGE = File(__file__).with_name("viewer.html")
_PLACE = re.compile(r'(<script type="application/json" id="scene">)null(</script>)')
_SAME = "attitude", "momentum", "gravity", "friction", "turning", "shaking", "gradient"
_TICK = 1e-6  # the viewer counts time in multiples of this [T]


@dataclass(frozen=True)
class View:
    """An interactive viewer of a scene, which a notebook displays as the result of a cell.

    scene  the data of the scene, in the format of the viewer's JSON export
    """

    scene: dict[str, Any]

    @property
    def html(self) -> str:
        """The viewer as HTML text. Raises FileNotFoundError if the viewer is not installed."""
        if not _PAGE.exists():
            raise FileNotFoundError(
                f"this kreisel was installed without its viewer, {_PAGE}: run `make viewer` in the "
                "source folder (it needs npm), then `pip install .` again"
            )
        data = json.dumps(self.scene).replace("<", "\\u003c")
        return _PLACE.sub(
            lambda place: place[1] + data + place[2], _PAGE.read_text(encoding="utf-8"), count=1
        )

    def save(self, file: str | os.PathLike[str]) -> None:
        """Write the viewer to an HTML file, which a browser can open without network access."""
        atomic_write(file, self.html.encode())

    def open(self) -> File:
        """Open the viewer in a browser, and return the file that contains the viewer.

        The file is overwritten by the next viewer of a scene with the same name. Issues a warning
        if no browser was found.
        """
        file, is_open = open_viewer(self)
        if not is_open:
            warnings.warn(f"no browser was found to open the viewer: {file}", stacklevel=2)
        return file

    def _repr_html_(self) -> str:
        style = "width:100%;height:600px;border:0"
        attributes = f'srcdoc="{html.escape(self.html)}" style="{style}"'
        return f'<iframe {attributes} title="kreisel: the top"></iframe>'


def open_viewer(page: View) -> tuple[File, bool]:
    """Write the viewer to a file, and open it in a browser if one is found.

    The folder is in the user's cache or, if that fails, a temporary one.
    """
    import webbrowser  # imported here to keep `import kreisel` fast

    name, text = page.scene["name"], page.html  # fails before the folder is created
    home = os.path.expanduser("~")
    base = {
        "win32": os.environ.get("LOCALAPPDATA") or home,
        "darwin": os.path.join(home, "Library", "Caches"),
    }.get(sys.platform) or os.environ.get("XDG_CACHE_HOME")
    folder = File(base or os.path.join(home, ".cache"), "kreisel").absolute()
    try:
        folder.mkdir(parents=True, exist_ok=True)
        check_file_is_writable(folder / "top.html")
    except OSError:
        folder = File(tempfile.mkdtemp(prefix="kreisel-"))
    file = folder / f"{name if name in about else 'top'}.html"
    atomic_write(file, text.encode())
    return file, webbrowser.open(file.as_uri())


def view(
    what: Scene | Path,
    *,
    methods: str | list[str] | None = None,
    step: float | None = None,
    speed: float = 1.0,
    open: bool = True,
) -> View:
    """Show a scene or a path in an interactive viewer.

    In a notebook, the viewer appears in the output of the cell. Outside notebooks, the viewer is
    opened in a browser.

    methods  one to three methods that the viewer starts with; default: taylor for rotors, damping,
             friction, gravity gradients and moving supports, bobenko_suris for other Lagrange tops,
             else strang
    step     step of these methods, a multiple of 1e-6 [T]; default: the path's step or the interval
             between its states, and 0.01 for a scene
    speed    units of time per second
    open     False: only build the viewer, for `.save("top.html")`

    The states of a path must begin at t = 0 and lie at equal intervals, a multiple of 1e-6, as with
    every=n. Opening the viewer raises FileNotFoundError if it is not installed. Raises TypeError or
    ValueError for invalid arguments, and AttributeError for a path without states.
    """
    if not isinstance(what, (Scene, Path)):
        raise TypeError(f"view needs a kreisel.Scene or a kreisel.Path, not {short_repr(what)}")
    if what.shape:
        raise ValueError(f"the viewer shows one top: select it by its index, not {what!r}")
    scene: Scene = what if isinstance(what, Scene) else what.scene
    body = scene.body
    if len(set(scene.damping)) > 1:
        raise ValueError("the viewer has one damping for all axes: use path.plot()")
    tracks = []
    if isinstance(what, Path):
        n, interval = len(what), float(what.t[-1]) / (len(what) - 1) if len(what) > 1 else 0.0
        late = np.abs(what.t - np.arange(n) * interval)
        if not (_is_whole_millionths(interval) and late.max() < 0.01 * _TICK):
            raise ValueError(
                "the viewer plays states at equal intervals of whole millionths from t = 0 on: "
                "solve with step=0.01, every=10, or with t=np.arange(n) * 0.1"
            )
        data = base64.b64encode(np.ascontiguousarray(what.states, dtype="<f8").tobytes()).decode()
        tracks = [{"name": what.method, "step": _round_step(interval), "states": data}]
        if step is None:
            step = what.step if what.step and _is_whole_millionths(what.step) else interval
    if body.inertia_rtol:
        raise ValueError(
            "the viewer does not support a tolerance of the inertia: view a body without "
            f"inertia_rtol={body.inertia_rtol!r}"
        )
    inertia = np.asarray(body.inertia)
    rows, wheel = np.diag(inertia) if inertia.ndim == 1 else inertia, np.zeros(3)
    if len(body._used_wheels) == 1 and body._used_wheels[0][3]:
        # The moment of a wheel that is the only rotor, along its axle, as the page draws it.
        *axis, rate, _ = body._used_wheels[0]
        wheel = np.dot(body.rotor, axis) / rate * np.array(axis)
        rows = rows + np.outer(wheel, axis)
    name, starts = name_of(scene), _validate_viewer_methods(methods, scene)
    page = View(
        {
            "version": 1,
            "name": name or "a scene from Python",
            "about": about.get(name, ""),
            "body": {"mass": body.mass, "inertia": rows.ravel().tolist(), "com": body.com},
            **{name: getattr(scene, name) for name in _SAME},
            "damping": scene.damping[0],
            "rotor": body.rotor,
            "wheel": wheel.tolist(),
            "methods": starts,
            "step": [_round_step(0.01 if step is None else step)],
            "speed": as_positive("speed", speed),
            "tol": 1e-15 if scene._has_disturbances else 1e-5,
            "tracks": tracks,
        }
    )
    shell = sys.modules["IPython"].get_ipython() if "IPython" in sys.modules else None
    if open and type(shell).__name__ != "ZMQInteractiveShell":  # outside a notebook
        page.open()
    return page


def _validate_viewer_methods(names: str | list[str] | None, scene: Scene) -> list[str]:
    if names is None and (scene._has_disturbances or any(scene.body.rotor)):
        return ["taylor"]
    if names is None:
        return ["bobenko_suris" if scene.body.kind == "lagrange" else "strang"]
    if not isinstance(names, (str, list, tuple)):
        raise TypeError(f"methods must be a name or a list of names, not {short_repr(names)}")
    method_names = [names] if isinstance(names, str) else list(names)
    if not 1 <= len(method_names) <= 3:
        raise ValueError(
            f"the viewer shows one to three methods side by side, not {short_repr(method_names)}"
        )
    for name in method_names:
        if resolve_method(name, scene).name.startswith("gsl_") or name == "auto":
            raise ValueError(f"the viewer has no {name!r}: view a path that this method computed")
    return method_names


def _is_whole_millionths(step: float) -> bool:
    ticks = step / _TICK
    return 0.5 < ticks < 2**31 and abs(ticks - round(ticks)) < 1e-6 * ticks


def _round_step(step: float) -> float:
    """Return a step as a whole number of millionths; raise ValueError if it is none."""
    length = as_positive("step", step)
    if not _is_whole_millionths(length):
        raise ValueError(
            f"the viewer needs a step of whole millionths that is at most 2147, not step = {step!r}"
        )
    return round(length / _TICK) / 1e6
