"""Sudden changes of the angular momentum, computed without loss of precision.

For precisions above 16 digits, each component of the momentum is the unevaluated sum of two
doubles.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

import numpy as np

from .._utils.validation import Array, Vector
from .body import Body

_Rational = tuple[Fraction, ...]


def add_impulse_to_momentum(momentum: Vector, low: Array, impulse: Vector) -> tuple[Vector, Vector]:
    """Add an angular impulse to a momentum, and return the leading and low-order parts of the sum.

    `low` contains the low-order parts of the components of `momentum`. If the sum
    overflows, its components are infinite or NaN.
    """
    x, y, z = map(_add_with_low_word, momentum, low.tolist(), impulse)
    return (x[0], y[0], z[0]), (x[1], y[1], z[1])


def _add_with_low_word(a: float, low: float, b: float) -> tuple[float, float]:
    """Return a + low + b as the sum of two doubles, using Knuth's two-sum algorithm."""
    total = a + b
    part = total - a
    rest = ((a - (total - part)) + (b - part)) + low
    high = total + rest
    return high, rest - (high - total)


def compute_momentum_after_body_change(
    old: Body, new: Body, attitude: Array, attitude_low: Array, momentum: Array, low: Array
) -> tuple[Vector, Vector]:
    """Return the angular momentum after a change of the body that keeps the angular velocity.

    The momentum is computed in rational arithmetic and rounded once at the end.

    The bodies `old` and `new` have the same attitude, and `momentum` is the angular momentum of
    `old`. `attitude_low` and `low` are the low-order parts (beyond double precision) of the
    attitude and of the momentum. Returns the momentum in double precision, and its low-order part.
    Raises ValueError if the momentum overflows.
    """
    q = _convert_doubles_to_fractions(attitude, attitude_low)
    m = _rotate_rational_vector(
        _conjugate_rational_quaternion(q), _convert_doubles_to_fractions(momentum, low)
    )
    principal_momentum = _rotate_rational_vector(
        _conjugate_rational_quaternion(_convert_doubles_to_fractions(old.axes)), m
    )
    rate = [
        (x - Fraction(rotor)) / Fraction(moment)
        for x, moment, rotor in zip(
            principal_momentum, old.moments, old.principal_rotor, strict=True
        )
    ]
    velocity = _rotate_rational_vector(_convert_doubles_to_fractions(old.axes), rate)
    principal_velocity = _rotate_rational_vector(
        _conjugate_rational_quaternion(_convert_doubles_to_fractions(new.axes)), velocity
    )
    new_momentum = [
        x * Fraction(moment) + Fraction(rotor)
        for x, moment, rotor in zip(
            principal_velocity, new.moments, new.principal_rotor, strict=True
        )
    ]
    return _split_into_high_and_low_words(
        _rotate_rational_vector(
            q, _rotate_rational_vector(_convert_doubles_to_fractions(new.axes), new_momentum)
        )
    )


def _convert_doubles_to_fractions(
    high: Sequence[float] | Array, low: Array | None = None
) -> _Rational:
    """Convert sums of a double and a low-order part to rational numbers."""
    rest = np.zeros(len(high)) if low is None else low
    return tuple(Fraction(float(a)) + Fraction(float(b)) for a, b in zip(high, rest, strict=True))


def _conjugate_rational_quaternion(q: _Rational) -> _Rational:
    w, x, y, z = q
    return w, -x, -y, -z


def _rotate_rational_vector(q: _Rational, v: Sequence[Fraction]) -> _Rational:
    """Return q v q* / |q|^2."""
    w, *u = q
    square = w * w + sum(x * x for x in u)
    dot = sum((x * y for x, y in zip(u, v, strict=True)), Fraction(0))
    factor = w * w - sum(x * x for x in u)
    components = []
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        cross = u[j] * v[k] - u[k] * v[j]
        components.append((factor * v[i] + 2 * dot * u[i] + 2 * w * cross) / square)
    return tuple(components)


def _split_into_high_and_low_words(exact: Sequence[Fraction]) -> tuple[Vector, Vector]:
    """Return the doubles nearest to three rational numbers, and the rounded remainders."""
    try:
        x, y, z = (float(number) for number in exact)
    except OverflowError:
        raise ValueError("the momentum after the change exceeds the range of doubles") from None
    rest = [float(number - Fraction(high)) for number, high in zip(exact, (x, y, z), strict=True)]
    return (x, y, z), (rest[0], rest[1], rest[2])
