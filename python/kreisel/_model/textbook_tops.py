"""Constructors of ensembles from Euler's angles, their rates, and steady precession.

The formulas and their bits are those of the constructors of one scene.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from .._core import KIND_RTOL
from .._ground.arguments import Array, boolean
from ..quaternion import conjugate, multiply
from .bodies import Bodies
from .body import Body
from .columns import Word, in_blocks, parts, vectors, word
from .textbook import (
    cos,
    half_turn,
    moments_about_axis,
    sin,
    steady_words,
    turned_by,
    velocity_of,
)
from .tops import S, Tops, agreed, bodies_of, dampings_of, momenta_of, refusal_at

Three = tuple[Array, Array, Array]
_DEGREE = math.pi / 180.0


class TextbookTops(Tops[S]):
    """Constructors of kr.Ensemble from Euler's angles and rates."""

    @classmethod
    def from_euler(
        cls,
        body: Body | Bodies,
        angles: ArrayLike,
        rates: ArrayLike = (0.0, 0.0, 0.0),
        *,
        degrees: bool = False,
        gravity: ArrayLike = 1.0,
        damping: ArrayLike | None = None,
    ) -> Self:
        """Build tops from Euler's angles z-x-z and their rates, as Scene.from_euler does.

        `angles` and `rates` are (..., 3): precession, nutation and spin, in radians and [T^-1];
        gravity and damping are as in Ensemble.

        >>> import kreisel as kr
        >>> body = kr.Body.cone(radius=1, height=2, pivot=(0, 0, 0), mass=1)
        >>> kr.Ensemble.from_euler(body, [(0, 1, 0), (0, 2, 0)], rates=(0, 0, 5)).shape
        (2,)
        """
        bodies, in_degrees = bodies_of(body), boolean("degrees", degrees)
        at, by = word("angles", angles, (3,)), word("rates", rates, (3,))
        make = partial(cls._one.from_euler, degrees=in_degrees)
        turned, turning = (three(radians(each.values, in_degrees)) for each in (at, by))
        return cls._turned(bodies, [at, by], turned, turning, gravity, damping, make)

    @classmethod
    def _turned(
        cls,
        body: Body | Bodies,
        told: list[Word],
        angles: Three,
        rates: Three,
        gravity: ArrayLike,
        damping: ArrayLike | None,
        one: Callable[..., S],
    ) -> Self:
        """Build the tops with these angles and rates, which come from the parameters `told`."""
        down, (drag, along) = word("gravity", gravity), dampings_of(damping)
        agreed(body, [*told, down, drag])
        turned, own = vectors(*turned_by(angles)), cls._own_turns(body)
        both = np.broadcast_shapes(turned.shape[:-1], own.shape[:-1])
        q = in_blocks(lambda a, b: multiply(a, conjugate(b)), both, 4, turned, own)
        with np.errstate(all="ignore"):
            start = Word("velocity", vectors(*velocity_of(angles, rates)), (3,))
        columns = {
            "momentum": momenta_of(body, start, q),
            "attitude": q,
            "gravity": down.values,
            "damping": along,
        }
        return cls.__new__(cls)._fill(body, [*told, down, drag], columns, one)

    @classmethod
    def _own_turns(cls, body: Body | Bodies) -> Array:
        """Return the (..., 4) quaternions of Euler's angles of the bodies as described."""
        unturned = cls(body, momentum=(0.0, 0.0, 0.0))
        names = "precession_angle", "nutation", "spin_angle"
        angles = [unturned._tops.values(name).reshape(unturned.shape) for name in names]
        return vectors(*turned_by((angles[0], angles[1], angles[2])))

    @classmethod
    def spinning(
        cls,
        body: Body | Bodies,
        spin: ArrayLike,
        tilt: ArrayLike = 0.0,
        precession: ArrayLike | None = None,
        *,
        steady: bool = False,
        fast: bool = False,
        degrees: bool = False,
        gravity: ArrayLike = 1.0,
        damping: ArrayLike | None = None,
    ) -> Self:
        """Build symmetric tops that spin about their axes, as Scene.spinning does.

        spin, tilt, precession and gravity are numbers or arrays, damping is as in Ensemble; steady,
        fast and degrees apply to all tops.

        >>> import kreisel as kr
        >>> body = kr.Body.cone(radius=1, height=2, pivot=(0, 0, 0), mass=1)
        >>> tops = kr.Ensemble.spinning(body, spin=[[20], [40]], tilt=[0.1, 0.2, 0.3])
        >>> tops.shape, tops.axes
        ((2, 3), ('spin', 'tilt'))
        """
        bodies, in_degrees = bodies_of(body), boolean("degrees", degrees)
        one: Any = partial(cls._one.spinning, degrees=in_degrees)
        told = [word("spin", spin), tilts(tilt, in_degrees)]
        rate, angle = (radians(each.values, in_degrees) for each in told)
        about_axes(bodies)
        if steady_words(steady, fast, precession, damping):
            one = partial(one, steady=True, fast=fast)
            turning = steady_rates(bodies, [*told, word("gravity", gravity)], in_degrees, fast, one)
        else:
            told.append(word("precession", 0.0 if precession is None else precession))
            turning = radians(told[-1].values, in_degrees)
        agreed(bodies, told)
        nothing = np.zeros(())
        with np.errstate(all="ignore"):
            rates = turning, nothing, rate - turning * cos(angle)
        return cls._turned(bodies, told, (nothing, angle, nothing), rates, gravity, damping, one)


def radians(values: Array, degrees: bool) -> Array:
    """Return angles or rates in radians, with the bits of math.radians."""
    return values * _DEGREE if degrees else values


def three(vector: Array) -> Three:
    """Split vectors into three components."""
    x, y, z = parts(vector)
    return x, y, z


def tilts(given: ArrayLike, degrees: bool) -> Word:
    """Build the parameter of angles with the vertical."""
    made = word("tilt", given)
    angle = radians(made.values, degrees)
    made.refused(~((angle >= 0.0) & (angle <= math.pi)), lambda _, one: half_turn(one, degrees))
    return made


def about_axes(body: Body | Bodies) -> tuple[Array, Array]:
    """Return the moments across and along the axes of symmetric bodies."""
    if isinstance(body, Body):
        across, along = moments_about_axis(body)
        return np.asarray(across), np.asarray(along)
    m, com = body.moments, np.abs(body.principal_com)
    reach, largest = com.max(axis=-1), m.max(axis=-1)
    within = KIND_RTOL * largest
    off = np.where(reach[..., None] > 0.0, com > KIND_RTOL * reach[..., None], [False, False, True])
    k = off.argmax(axis=-1)
    i, j, lone = (np.take_along_axis(m, ((k + d) % 3)[..., None], -1)[..., 0] for d in (2, 1, 0))
    is_round = largest - m.min(axis=-1) <= within
    bad = ~(is_round | ((off.sum(axis=-1) == 1) & (np.abs(i - j) <= within)))
    if bad.any():
        at = tuple(map(int, np.unravel_index(int(bad.argmax()), bad.shape)))
        try:
            moments_about_axis(body._member(at))
        except ValueError as error:
            raise ValueError(f"body{list(at)}: {error}") from None
    return np.where(is_round, m[..., 2], 0.5 * (i + j)), np.where(is_round, m[..., 2], lone)


def steady_rates(
    body: Body | Bodies, told: Sequence[Word], degrees: bool, fast: bool, one: Callable[..., object]
) -> Array:
    """Return the rates of steady precession of the parameters spin, tilt and gravity.

    Raises ValueError with the index of the first member that has none.
    """
    shape = agreed(body, told)
    spin, tilt, gravity = (each.values for each in told)
    rate, angle = radians(spin, degrees), radians(tilt, degrees)
    across, along = about_axes(body)
    x, y, z = parts(np.asarray(body.com))
    with np.errstate(all="ignore"):
        lever = np.hypot(np.hypot(x, y), z) if isinstance(body, Bodies) else math.hypot(x, y, z)
        torque = np.asarray(body.mass) * gravity * lever
        cosine = cos(angle)
        a = np.where(np.abs(cosine) > 1e-15, across * cosine, 0.0)
        b = along * rate
        root = 2.0 * np.sqrt(np.abs(a)) * np.sqrt(np.abs(torque))
        hangs, size = a * torque <= 0.0, np.abs(b)
        apart = np.sqrt(np.maximum(size - root, 0.0)) * np.sqrt(size + root)
        larger = 0.5 * np.copysign(size + np.where(hangs, np.hypot(b, root), apart), b)
        rates = larger / a if fast else np.where(larger != 0.0, torque / larger, 0.0)
        none = ~hangs & (size < root * (1.0 - 1e-12)) | (larger == 0.0) & (torque != 0.0)
        bad = none | (a == 0.0) if fast else none
    at_pole = np.abs(sin(angle)) < 1e-15
    bad = np.broadcast_to(bad & ~at_pole, shape)
    if bad.any():
        at = tuple(map(int, np.unravel_index(int(bad.argmax()), shape)))
        raise refusal_at(body, told, one, shape, at)
    return np.where(at_pole, 0.0, rates)
