"""Derivatives of the state by its start and its parameters."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Literal

import numpy as np

from .._core import start as start_top
from .._core import tangents as TANGENTS
from .._model.scene import Ensemble, Scene
from .._options.methods import FALLBACK, Method, has_torus_closed_form
from .._options.options import (
    SolveOptions,
    validate_recording_interval,
    validate_solve_options,
)
from .._options.times import check_resolvable_horizon, time_array
from .._results.path import (
    Path,
    build_path_from_core_result,
    format_progress,
    make_stop_exception,
    report_final_time,
)
from .._results.quantities import TangentData
from .._utils.arguments import Numbers, short_repr, unknown_name_message, validate_type
from .._utils.processes import Progress
from .torus import check_torus_tangent_names

TangentName = Literal[
    "start",
    "moments",
    "com",
    "gravity",
    "mass",
    "damping",
    "rotor",
    "turning",
    "shaking",
    "friction",
]
TangentSpec = TangentName | Iterable[TangentName]


def validate_tangent_names(tangents: object) -> tuple[str, ...]:
    """Return the names of the requested tangents without duplicates, in a fixed order.

    Raises TypeError or ValueError for an unknown name, or if no name is given.
    """
    items = [tangents] if isinstance(tangents, str) else tangents
    if not isinstance(items, Iterable):
        raise TypeError(
            f"tangents must be names, as in tangents='start' or ('start', 'gravity'), not "
            f"{short_repr(tangents)}"
        )
    names = list(items)
    for name in names:
        if not isinstance(name, str) or name not in TANGENTS:
            raise ValueError(unknown_name_message("name in tangents:", str(name), TANGENTS))
    if not names:
        raise ValueError("tangents is empty: leave it out for a path without tangents")
    return tuple(name for name in TANGENTS if name in names)


def refuse_arguments_with_tangents(arguments: Mapping[str, object]) -> None:
    """Raise ValueError for arguments that cannot be combined with tangents."""
    for name, value in arguments.items():
        if value is not None:
            raise ValueError(f"tangents are computed for all states of a path: leave out {name}")


def check_computes_tangents(method: Method) -> None:
    """Raise ValueError unless the method can compute tangents."""
    if method.exact:
        raise ValueError(
            f"the method {method.name!r} computes no tangents, because most changes of the moments "
            "or of com lead to bodies without closed form: use method='taylor' or 'auto'"
        )
    if not method.tangents:
        raise ValueError(
            f"the method {method.name!r} computes no tangents: use method='taylor' or 'auto'"
        )


def validate_tangent_options(
    scene: object,
    method: str,
    tangents: object,
    controls: tuple[object, object, object, object],
    every: object,
    exclusions: Mapping[str, object],
) -> SolveOptions:
    """Return the validated options for computing a path with tangents.

    `controls` contains the arguments step, tol, digits and max_steps. Raises ValueError if an
    argument in `exclusions` is given, or if the method cannot compute the tangents.
    """
    top, names = validate_type("scene", scene, Scene), validate_tangent_names(tangents)
    refuse_arguments_with_tangents(exclusions)
    method_name = FALLBACK if method == "auto" else method
    options = validate_solve_options(top, method_name, *controls, requested_method=method)
    if options.method.exact and has_torus_closed_form(top):
        check_torus_tangent_names(names)
    else:
        check_computes_tangents(options.method)
    refuse_undefined_friction_tangents(top, names)
    validate_recording_interval(options.method, every)
    return replace(options, tangents=names)


def refuse_undefined_friction_tangents(tops: Scene | Ensemble, names: Iterable[str]) -> None:
    """Raise ValueError for tangents by friction if the friction is zero or has no axis."""
    has_friction = np.asarray(tops.friction) > 0.0
    if "friction" in names and not has_friction.all():
        raise ValueError(
            "there are no tangents with respect to a friction of 0, because it cannot decrease: "
            "leave out 'friction'"
        )
    has_no_com = ~np.any(np.asarray(tops.body.com), axis=-1)
    if "com" in names and np.any(has_friction & has_no_com):
        raise ValueError(
            "there are no tangents with respect to com for tops with friction and com = 0, because "
            "com gives the axis of friction: leave out 'com'"
        )


def record_path_with_tangents(
    scene: Scene, options: SolveOptions, t: Numbers, progress: Progress | None
) -> Path:
    """Compute the motion of a scene together with its tangents, and return the path."""
    times = time_array(
        t, options.step, None, options.bytes_per_state + 2 * 48 * options.tangent_column_count
    )
    end = float(times[-1]) if times.size else 0.0
    check_resolvable_horizon(scene, end, options.step)
    status, top = start_top(
        scene._block, *options.core_arguments, end < 0.0, [], options.tangent_bit_mask
    )
    if top is None:
        path = build_path_from_core_result(
            scene, options, (status, scene._start_state.copy(), None, (0, 0, 0, 0), end)
        )
        raise make_stop_exception(status, path, format_progress(path, end))
    result, high, low, rest = top.record_tangents(times, options.has_extended_precision, progress)
    path = build_path_from_core_result(scene, options, result)
    path = replace(
        path, _tangent_data=TangentData.from_flat_arrays(high, low, rest, options.tangents)
    )
    if result[0] != "OK":
        raise make_stop_exception(result[0], path, format_progress(path, end))
    return report_final_time(path, progress)
