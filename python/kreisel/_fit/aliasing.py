"""Alternative spins that fit sparsely sampled measurements equally well.

Measured attitudes cannot distinguish motions that differ by a full turn between samples.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from .._utils.validation import Array
from .parameters import FitPoint, FreeParameters
from .records import Record

_FEW = 4.0  # samples per turn from which an angular velocity is determined


def list_spin_aliases_of_point(
    parameters: FreeParameters, point: FitPoint, records: Sequence[Record]
) -> list[FitPoint]:
    """Return parameters whose motion differs by one full turn between successive measurements.

    Returns an empty list if the body rotates so slowly that the measurements resolve every turn. If
    the measurements contain fewer than two samples per turn of the body, the returned list also
    contains a faster rotation in the same direction. If the moments of inertia are free parameters,
    the list also contains motions with another moment of inertia but the same angular momentum.
    """
    pauses = [np.diff(np.unique(record.t)) for record in records]
    interval = min((float(np.median(p)) for p in pauses if p.size), default=0.0)
    if not (interval > 0.0 and parameters.can_vary("velocity")):
        return []
    turn, aliases = 2.0 * np.pi / interval, []
    for axis, rate in _yield_fast_rotation_axes(point, turn / _FEW):
        reverse_rate = rate - math.copysign(turn, rate)
        for other_rate in (
            (reverse_rate, 2.0 * rate - reverse_rate) if abs(rate) > 0.5 * turn else (reverse_rate,)
        ):
            alias = replace(point, rate=point.rate + (other_rate - rate) * axis)
            aliases.append(alias)
            aliases += _rescale_moment_for_same_momentum(
                parameters, alias, axis, rate / other_rate if other_rate else 0.0
            )
    return aliases


def _yield_fast_rotation_axes(point: FitPoint, least: float) -> Iterator[tuple[Array, float]]:
    """Yield each axis about which the body rotates fast, together with the rotation rate."""
    rate = float(np.linalg.norm(point.rate))
    if rate > least:
        yield point.rate / rate, rate
    for axis, component in zip(np.eye(3), point.rate, strict=True):
        if abs(component) > least:
            yield axis, float(component)


def _rescale_moment_for_same_momentum(
    p: FreeParameters, alias: FitPoint, axis: Array, factor: float
) -> list[FitPoint]:
    """Return a list with one point whose moment about `axis` is rescaled, or an empty list."""
    k = int(np.abs(axis).argmax())
    is_principal = abs(axis[k]) == 1.0 and float(p.moments[:, p.moments[k].argmax()].sum()) == 1.0
    if not (p.can_vary("moments") and is_principal and 0.0 < factor < np.inf):
        return []
    moments = alias.moments.copy()
    moments[k] *= factor
    densities = 0.5 * moments.sum() - moments
    return [replace(alias, densities=densities)] if densities.min() >= 0.0 else []


def describe_alternative_spin(point: FitPoint, alias: FitPoint) -> str:
    """Return a sentence that describes another initial angular velocity that fits equally well."""
    speed, alias_speed = (float(np.linalg.norm(one.rate)) for one in (point, alias))
    return (
        f"the spin: the records have fewer than {_FEW:g} samples per turn, and the angular "
        f"velocity {alias_speed:.4g} instead of {speed:.4g} fits equally well"
    )
