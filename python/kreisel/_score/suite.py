"""The cases of the suite: scenes in SI units whose true motion other programs are tested against.

suite.toml lists them, and suite/make.py writes their files.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path as File
from typing import Any

import numpy as np

from .._model.scene import Scene, build_scene_from_table
from .._model.toml import parse_toml_tables
from .._results.path import Path
from .._solve.run import start
from .._utils.arguments import Array


@dataclass(frozen=True, eq=False)
class Case:
    """A scene in SI units with its duration, impulses, instruments and levels of error.

    impulses       rows (t, x, y, z): angular impulses in space [s], [N m s]
    point          place of an accelerometer in the body [m], or None
    has_integrals  True if the instruments integrate over the intervals between the states
    wheel          arguments of Body.with_wheel, if the body has a wheel
    engine         attitude error [rad] of a good program for games
    science        attitude error [rad] of a good program in double precision
    """

    name: str
    text: str
    scene: Scene
    end: float
    states: int = 51
    impulses: tuple[tuple[float, ...], ...] = ()
    point: tuple[float, ...] | None = None
    has_integrals: bool = False
    wheel: dict[str, Any] | None = None
    engine: float = 0.1
    science: float = 1e-9

    @property
    def times(self) -> Array:
        """The times of the states in the files [s]."""
        return np.linspace(0.0, self.end, self.states).round(9)

    def solve(self, times: Array, digits: int | None = None) -> list[Path]:
        """Return the true motion at ascending times, as one path for each time between impulses.

        A state at the time of an impulse is that before it.
        """
        run, pieces = start(self.scene, digits=digits), []
        for t, *impulse in (*self.impulses, (np.inf,)):
            pieces.append(run.to(times[(times <= t) & (times > run.t - (run.t == 0.0))]))
            if impulse:
                run.to(t)
                run.push(impulse)
        return pieces


def join(pieces: list[Path], quantity: str) -> Array:
    """Return the values of a quantity along consecutive paths."""
    return np.concatenate([getattr(path, quantity) for path in pieces])


@cache
def load_cases() -> dict[str, Case]:
    """Return all cases by name."""
    text = File(__file__).with_suffix(".toml").read_text(encoding="utf-8")
    cases: dict[str, Any] = {}
    for name, table in parse_toml_tables(text).items():
        words: Any = dict(table)  # type: ignore[call-overload]
        own = {key: words.pop(key) for key in [*words] if key in Case.__dataclass_fields__}
        wheel = words["body"].get("wheel")
        cases[name] = Case(name=name, wheel=wheel, scene=build_scene_from_table(words), **own)
    return cases
