"""The equations of motion as quadratic polynomials with coefficients in ball arithmetic.

The state y has the angular velocity W and the vertical P along the principal axes as `body.axes`
rounds them, the attitude q of these axes, the angular velocity O of a turning support along them,
and cosine c and sine s of the phase of a shaken support. With the relative velocity U = W - O,

    J W' = M x W - D U + P x (weight + push c + k J P),   M = J W + h
    q' = q U / 2,   P' = P x U,   O' = O x W,   c' = -rate s,   s' = rate c.

J and D are full matrices, because the axes are rounded. Each right-hand side is a polynomial of
degree two without a constant term. The lengths of q, P, O and (c, s) are conserved.

Vectors and matrices are arrays of objects: of balls, or of polynomials with balls as coefficients.
"""

from __future__ import annotations

import copyreg
import itertools
import math
from collections.abc import Iterable
from fractions import Fraction
from typing import Any

import numpy as np
from flint import acb_mat, arb

from .._model.scene import Scene
from .._utils.arguments import Array
from ..quaternion import conjugate, multiply, turn, turn_back

Ball = Any  # flint.arb, which has no annotations
Balls = Any  # an array of balls or polynomials
ROUNDED_UP = 1.0 + 2.0**-40  # corrects nonnegative floats after up to 2^11 roundings
_Q, _P = slice(3, 7), slice(7, 10)


def make_vector(values: Iterable[Any]) -> Balls:
    """Return the array of any objects. NumPy would take polynomials for sequences."""
    return np.fromiter(values, object)


def make_ball(x: float | Fraction, power: int = 0) -> Ball:
    """Return a ball that contains x * 2^power. The denominator of x is a power of two."""
    x = Fraction(x)
    return arb(x.numerator) * arb(2) ** (power + 1 - x.denominator.bit_length())


def make_balls(values: Iterable[float], power: int = 0) -> Balls:
    return make_vector(make_ball(x, power) for x in values)


def load_ball(m: int, power: int, radius: int, radius_power: int) -> Ball:
    """Return the pickled ball with a midpoint m * 2^power and at least such a radius."""
    return arb(arb((m, power)), arb((radius, radius_power)))


copyreg.pickle(arb, lambda x: (load_ball, (*map(int, x.mid().man_exp() + x.rad().man_exp()),)))


def compute_length(v: Balls) -> Ball:
    """Return a ball that contains the lengths of the vectors in balls."""
    square = v @ v
    return square.sqrt() if square > 0 else arb(0).union(square.abs_upper().sqrt())


def normalize(v: Balls) -> Balls:
    return v / compute_length(v)


def cross(a: Balls, b: Balls) -> Balls:
    return np.roll(a, -1) * np.roll(b, -2) - np.roll(a, -2) * np.roll(b, -1)


class Equations:
    """The equations y' = f(y) of a scene, and its start in balls.

    Times are in units of 2^-`time`, moments of 2^`moment` of the user's. Slender bodies have large
    coefficients in the equations of W, which has `units` in which each angular velocity depends on
    the other numbers about as strongly as they depend on it.

    The derivative of f is Df(y) = linear + bilinear y. The bounds of the absolute values of these
    floats are also 2^52 times as large as their errors beyond rounding.
    """

    def __init__(self, scene: Scene) -> None:
        body, moments = scene.body, np.array(scene.body.moments)
        amplitude, rate, phase = scene.shaking
        speed = float(np.linalg.norm(scene._core_scenes.values("inertial_velocity")))
        drag = float((np.array(scene.damping) / moments).max())
        self.time = time = math.frexp(max(scene._rotation_rate, speed, drag) or 1.0)[1]
        self.moment = moment = math.frexp(moments.max())[1]
        self.units = np.ones(3)

        # the body along the axes
        self.axes = normalize(make_balls(body.axes))
        turned = np.array([turn(self.axes, (x, y, z)) for x, y, z in np.eye(3).tolist()])
        half = np.array([make_balls(row, -moment - 1) for row in body._tensors])
        self.inertia: Balls = turned @ (half + half.T) @ turned.T
        cofactors = [cross(self.inertia[i - 2], self.inertia[i - 1]) for i in range(3)]
        self.inverse: Balls = np.array(cofactors) / (self.inertia[0] @ cofactors[0])
        self.rotor = turned @ make_balls(body.rotor, -time - moment)
        lever = turned @ make_balls(body.com) * make_ball(body.mass, -2 * time - moment)

        # its surroundings
        self.weight = lever * make_ball(scene.gravity)
        self.push = lever * (-make_ball(amplitude) * make_ball(rate) * make_ball(rate))
        self.rate = make_ball(rate, -time)
        self.damping = np.diag(make_balls(scene.damping, -time - moment))
        if any(body.axes[1:]) and len({*scene.damping}) > 1:
            self.damping = _turn_to_axes(self.damping.diagonal(), self.inertia, moments)
        self.is_damped = any(scene.damping)
        self.gradient = make_ball(scene.gradient, -2 * time)
        self.is_shaken = bool(amplitude) and any(body.com)
        self.is_pulled = bool(scene.gradient or (any(body.com) and scene.gravity)) or self.is_shaken
        self.is_turning = any(scene.turning)

        # the start
        q: Balls = normalize(make_vector(multiply(make_balls(scene.attitude), self.axes)))
        m = make_vector(turn_back(q, make_balls(scene.momentum, -time - moment)))
        parts = [self.inverse @ (m - self.rotor), q]
        if self.is_pulled:
            parts.append(make_vector(turn_back(q, make_balls((0.0, 0.0, 1.0)))))
        if self.is_turning:
            parts.append(make_vector(turn_back(q, make_balls(scene.turning, -time))))
        if self.is_shaken:
            parts.append(make_vector((make_ball(phase).cos(), make_ball(phase).sin())))
        self.start: Balls = np.concatenate(parts)
        self._differentiate()
        sizes = self.linear_bound + self.bilinear_bound.sum(axis=2)
        np.fill_diagonal(sizes, 0.0)
        ratios = sizes.sum(axis=1)[:3] / np.maximum(sizes.sum(axis=0)[:3], 1.0)
        self.units = 2.0 ** np.round(0.5 * np.log2(np.maximum(ratios, 1.0)))
        self.inverse = self.inverse / self.units[:, None]
        self.start[:3] /= self.units
        self._differentiate()

    def __call__(self, y: Balls) -> Balls:
        """Return f(y), for balls or for polynomials."""
        w, q, p, c, s = self.units * y[:3], y[_Q], y[_P], y[-2:-1], y[-1:]
        after = 10 if self.is_pulled else 7
        o = y[after : after + 3]
        u = w - o if self.is_turning else w
        torque = cross(self.inertia @ w + self.rotor, w)
        if self.is_damped:
            torque = torque - self.damping @ u
        parts = [make_vector(multiply(q, (arb(0), *u))) * 0.5]
        if self.is_pulled:
            pull = self.weight + self.push * c if self.is_shaken else self.weight
            if self.gradient != 0:
                pull = pull + self.inertia @ p * self.gradient
            torque = torque + cross(p, pull)
            parts.append(cross(p, u))
        if self.is_turning:
            parts.append(cross(o, w))
        if self.is_shaken:
            parts += [s * -self.rate, c * self.rate]
        return np.concatenate([self.inverse @ torque, *parts])

    def _differentiate(self) -> None:
        """Compute the coefficients of Df from values of f at sums of unit vectors."""
        n = len(self.start)
        basis = [make_vector(map(arb, row)) for row in np.eye(n).tolist()]
        values = [self(e) for e in basis]
        linear, bilinear = np.zeros((2, n, n)), np.zeros((2, n, n, n))
        for i, k in itertools.combinations_with_replacement(range(n), 2):
            mixed = self(basis[i] + basis[k]) - values[i] - values[k]
            bilinear[:, :, i, k] = bilinear[:, :, k, i] = _round(mixed)
            linear[:, :, i] = _round(values[i] - mixed / 2) if i == k else linear[:, :, i]
        self.linear, self.linear_bound = linear
        self.bilinear, self.bilinear_bound = bilinear

    def find_state(self, y: Balls) -> tuple[list[Ball], list[Ball]]:
        """Return attitude and momentum in the user's frame and units."""
        m = (self.inertia @ (self.units * y[:3]) + self.rotor) * arb(2) ** (self.time + self.moment)
        return list(multiply(y[_Q], conjugate(self.axes))), list(turn(y[_Q], m))


def _turn_to_axes(values: Balls, inertia: Balls, moments: Array) -> Balls:
    """Return the matrix with three eigenvalues about the exact principal axes of `inertia`."""
    try:
        found = acb_mat(inertia.tolist()).eig()
    except ValueError:
        raise ValueError("damping: the principal axes of inertia are not unique") from None
    roots = sorted((x.real for x in found), key=lambda x: float(x.mid()))
    a, b, c = (roots[i] for i in moments.argsort().argsort())
    factors = [inertia - np.diag(make_vector((x, x, x))) for x in (a, b, c)]
    scales = (b - a) * (c - a), (c - b) * (a - b), (a - c) * (b - c)
    parts = (factors[i - 2] @ factors[i - 1] * (values[i] / scales[i]) for i in range(3))
    return sum(parts)


def _round(balls: Balls) -> Array:
    """Return floats near the numbers in balls, and the bounds of their absolute values."""
    bounds = [float(x.abs_upper()) + 2.0**52 * float(x.rad()) for x in balls]
    return np.array([[float(x.mid()) for x in balls], np.array(bounds) * ROUNDED_UP])
