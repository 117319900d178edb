"""Plots of paths and of their differences."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from functools import partial
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from .._results.error import compute_angles_between_attitudes
from .._results.path import Path, list_drawn_paths
from .._utils.arguments import Array, short_repr, validate_type

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from .._plot.charts import AngleBetweenPaths, FigureAxes


def compute_angle_between_paths(a: Path, b: Path) -> AngleBetweenPaths:
    """Return the angle between the attitudes or else apexes of two paths at common times."""
    from .._plot.charts import AngleBetweenPaths

    a, b = _restrict_paths_to_common_times(a, b)
    if all(path.want is None or "q" in path.want for path in (a, b)):
        return AngleBetweenPaths(
            a.t,
            compute_angles_between_attitudes(
                _get_attitudes_with_low_words(a), _get_attitudes_with_low_words(b)
            ),
            "attitudes",
        )
    sines = np.linalg.norm(np.cross(a.apex, b.apex), axis=1)
    return AngleBetweenPaths(a.t, np.arctan2(sines, (a.apex * b.apex).sum(axis=1)), "apexes")


def _restrict_paths_to_common_times(a: Path, b: Path) -> tuple[Path, Path]:
    """Return both paths at common times, or empty paths if their time intervals are disjoint."""
    if np.array_equal(a.t, b.t):
        return a, b
    low, high = max(a.t.min(), b.t.min()), min(a.t.max(), b.t.max())
    part_a, part_b = (path[(path.t >= low) & (path.t <= high)] for path in (a, b))
    alternatives: list[Callable[[], tuple[Path, Path]]] = [
        lambda: (part_a, b(part_a.t)),
        lambda: (a(part_b.t), part_b),
    ]
    for restrict in alternatives if len(part_a) >= len(part_b) else reversed(alternatives):
        with suppress(ValueError):  # a closed form of a map has no states between its steps
            return restrict()
    _, i, j = np.intersect1d(a.t, b.t, return_indices=True)
    return a[i], b[j]


def _get_attitudes_with_low_words(path: Path) -> tuple[Array, Array]:
    has_low = path.want is None or "q_low" in path.want
    return path.q, path.q_low if has_low else np.zeros_like(path.q)


def plot(
    path: Path | Sequence[Path],
    *more: Path | Iterable[Axes] | None,
    axes: Iterable[Axes] | None = None,
    degrees: bool = True,
    time_unit: str = "T",
) -> FigureAxes:
    """Plot the apex trace on a sphere, and nutation and precession over time, using matplotlib.

    Returns three matplotlib axes for each path. A notebook displays the returned axes as an image.

    path       one path or several paths, as a list or as separate arguments, of up to 8 tops in
               total, which are drawn side by side
    axes       the axes to draw in instead of a new figure: three for each path, and for two paths
               optionally a seventh for their difference. It may also be given as the second
               argument without its name
    degrees    False: angles in radians instead of degrees
    time_unit  the unit of time in which the scene is described, for the labels: "s" for seconds

    For two paths, an additional chart shows the angle between their attitudes on a logarithmic
    scale. If a path does not store its attitude, this chart shows the angle between the apex
    directions of the two paths. If the times of the paths differ, one of the paths is recomputed at
    the times of the other.

    Dashed lines mark the least and greatest nutation angles of the motion if they are known in
    closed form. Dots mark the initial state and the events of a path. The precession curve is
    interrupted where the angle jumps because the apex passes close to the vertical. The figure is
    not registered with pyplot; to save it, call `kr.plot(path).figure.savefig("top.png")`.

    If the states are sparser than the motion, the motion between them is computed by calling
    `path(t)`, and the states are marked. Only the states are drawn if the path cannot be evaluated
    between them, as for a kreisel.types.ExactMap, or if the motion has hundreds of turns.

        >>> import kreisel as kr
        >>> path = kr.solve(kr.scenes.cusps, [0.1 * i for i in range(100)])
        >>> sphere, nutation, precession = kr.plot(path, time_unit="s")
        >>> nutation.get_ylabel(), precession.get_xlabel()
        ('nutation [°]', 'time [s]')
        >>> rough = kr.solve(kr.scenes.cusps, path.t, "rk4", step=0.1)
        >>> kr.plot(path, rough)[-1].get_ylabel()
        'difference [°]'

    Raises ValueError for a path without states, and ImportError if matplotlib is not installed.
    """
    paths, axes = _validate_plot_paths_and_axes(path, more, axes)
    for i, one in enumerate(paths):
        validate_type(f"path[{i}]", one, Path)
    paths = list_drawn_paths(*paths)
    from .._plot.charts import plot_paths

    paths_with_events = [(one, one.events.path if len(one.events) else None) for one in paths]
    pair = partial(_compute_angle_between_motions, *paths) if len(paths) == 2 else None
    return plot_paths(paths_with_events, axes, degrees, time_unit, pair)


def _compute_angle_between_motions(a: Path, b: Path) -> AngleBetweenPaths:
    """Return the angle between two paths at the times at which their motions are drawn."""
    from .._plot.dense_motion import evaluate_densely

    lines = [evaluate_densely(path).line for path in (a, b)]
    if any(line is None for line in lines):
        return compute_angle_between_paths(a, b)
    return compute_angle_between_paths(*cast(list[Path], lines))


def _validate_plot_paths_and_axes(
    path: object, more: tuple[object, ...], axes: Iterable[Axes] | None
) -> tuple[Sequence[Path], Any]:
    if isinstance(path, Path) and more and all(isinstance(one, Path) for one in more):
        return [path, *cast(tuple[Path, ...], more)], axes
    if len(more) > 1 or (more and axes is not None):
        raise TypeError("pass the paths as arguments or as one list, and axes as a keyword")
    paths = [path] if isinstance(path, Path) else path
    if not isinstance(paths, (list, tuple)):
        raise TypeError(f"path must be a kreisel.Path or a list of them, not {short_repr(path)}")
    return paths, more[0] if more else axes
