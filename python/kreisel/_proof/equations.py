"""The equations of motion as quadratic polynomials with coefficients in ball arithmetic.

The state y has the angular velocity U of the body relative to the support and the vertical P along
the principal axes as `body.axes` rounds them, the attitude q of these axes, the angular velocity O
of a turning support along them, and cosine c and sine s of the phase of a shaken support. With the
angular velocity W = U + O,

    J (U' + O x U) = M x W - D U + P x (weight + push c + k J P),   M = J W + h
    q' = q U / 2,   P' = P x U,   O' = O x U,   c' = -rate s,   s' = rate c.

J and D are full matrices, because the axes are rounded. Each right-hand side is a polynomial of
degree two without a constant term. The lengths of q, P, O and (c, s) are conserved. P, O or (c, s)
are left out if the motion does not depend on them.

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
from flint import acb_mat, arb, arb_poly, fmpz_poly

from .._model.scene import Scene
from .._utils.arguments import Array
from ..quaternion import conjugate, multiply, turn, turn_back

Ball = Any  # flint.arb, which has no annotations
Balls = Any  # an array of balls or polynomials
ROUNDED_UP = 1.0 + 2.0**-40  # corrects nonnegative floats after up to 2^11 roundings
_Q, _O = slice(3, 7), slice(10, 13)
# sums of any two are different, also of two equal ones (Mian and Chowla)
_POWERS = 1, 3, 7, 12, 20, 30, 44, 65, 80, 96, 122, 147, 181, 203, 251


def make_vector(values: Iterable[Any]) -> Balls:
    """Return the array of any objects. NumPy would take polynomials for sequences."""
    return np.fromiter(values, object)


def make_ball(x: float | Fraction, power: int = 0) -> Ball:
    """Return a ball that contains x * 2^power. The denominator of x is a power of two."""
    x = Fraction(x)
    return arb(x.numerator) * arb(2) ** (power + 1 - x.denominator.bit_length())


def make_balls(values: Iterable[float], power: int = 0) -> Balls:
    return make_vector(make_ball(x, power) for x in values)


# a ball is pickled as the mantissas and exponents of its midpoint and radius
copyreg.pickle(arb, lambda x: (arb, (*((*map(int, y.man_exp()),) for y in (x.mid(), x.rad())),)))


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
    coefficients in the equations of U, which has `units` in which each angular velocity depends on
    the other numbers about as strongly as they depend on it.

    With 1 as the last number of y, f_a is the sum of x y_i y_k over (i, k, column) in `terms` and
    (a, x) in `column`. The derivative is Df(y) = linear + bilinear y. The bounds of the absolute
    values of these floats are also 2^52 times as large as their errors beyond rounding.
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
        pairs = {*zip(body.moments, scene.damping, strict=True)}
        if len({*scene.damping}) > 1 and np.any(body._tensors != np.diag(body._tensors.diagonal())):
            if len({*body.moments}) < len(pairs):
                raise ValueError("damping: the principal axes of inertia are not unique")
            self.damping = _turn_to_axes(self.damping.diagonal(), self.inertia, moments)
        self.gradient = make_ball(scene.gradient, -2 * time)

        # the start
        q: Balls = normalize(make_vector(multiply(make_balls(scene.attitude), self.axes)))
        m = make_vector(turn_back(q, make_balls(scene.momentum, -time - moment)))
        p, o = turn_back(q, make_balls((0, 0, 1))), turn_back(q, make_balls(scene.turning, -time))
        u = self.inverse @ (m - self.rotor) - make_vector(o)
        is_shaken = bool(amplitude) and any(body.com)
        is_pulled = is_shaken or bool(scene.gradient or (any(body.com) and scene.gravity))
        is_used = [True] * 7 + [is_pulled] * 3 + [any(scene.turning)] * 3 + [is_shaken] * 2
        self.used = np.flatnonzero(is_used)
        y = make_vector((*u, *q, *p, *o, make_ball(phase).cos(), make_ball(phase).sin()))
        self.start: Balls = y[self.used]
        self._find_terms()
        sizes = self.linear_bound + self.bilinear_bound.sum(axis=2)
        np.fill_diagonal(sizes, 0.0)
        ratios = sizes.sum(axis=1)[:3] / np.maximum(sizes.sum(axis=0)[:3], 1.0)
        self.units = 2.0 ** np.round(0.5 * np.log2(np.maximum(ratios, 1.0)))
        self.inverse = self.inverse / self.units[:, None]
        self.start[:3] /= self.units
        self._find_terms()

    def __call__(self, y: Balls) -> Balls:
        """Return f(y), for balls or for polynomials."""
        y = self._fill(y)
        u, q, p, o, c, s = self.units * y[:3], y[_Q], y[7:10], y[_O], y[13:14], y[14:]
        w, turned = u + o, cross(o, u)
        pull = self.weight + self.push * c + self.inertia @ p * self.gradient
        torque = cross(self.inertia @ w + self.rotor, w) - self.damping @ u + cross(p, pull)
        acceleration = self.inverse @ torque - turned * (1.0 / self.units)
        spin = make_vector(multiply(q, (arb(0), *u))) * 0.5
        parts = acceleration, spin, cross(p, u), turned, s * -self.rate, c * self.rate
        return np.concatenate(parts)[self.used]

    def _fill(self, y: Balls) -> Balls:
        """Return all numbers of a state, with zeros for those that are left out."""
        full = make_vector([arb(0)] * 15)
        full[self.used] = y
        return full

    def _find_terms(self) -> None:
        """Compute the coefficients of f, from its value at powers of one variable."""
        n = len(self.start)
        powers = *_POWERS[:n], 0
        y = make_vector(arb_poly([0] * k + [1]) for k in powers[:n])
        rows = [x.coeffs() + [arb(0)] * (2 * _POWERS[-1] + 1) for x in self(y)]
        linear, bilinear = np.zeros((2, n, n)), np.zeros((2, n, n, n))
        self.terms: list[tuple[int, int, list[tuple[int, Ball]]]] = []
        for i, k in itertools.combinations_with_replacement(range(n + 1), 2):
            column = [row[powers[i] + powers[k]] for row in rows]
            if k < n:
                mixed = _round([x * (1 + (i == k)) for x in column])
                bilinear[:, :, i, k] = bilinear[:, :, k, i] = mixed
            elif i < n:
                linear[:, :, i] = _round(column)
            if found := [(a, x) for a, x in enumerate(column) if x.abs_upper() > 0]:
                self.terms.append((i, k, found))
        self.linear, self.linear_bound = linear
        self.bilinear, self.bilinear_bound = bilinear

    def find_defect(self, p: list[fmpz_poly], scale: int, h: Ball, n: int) -> list[arb_poly]:
        """Return the first n orders of y' - h f(y) in balls, for y = p / 2^scale."""
        factors = [*p, fmpz_poly([2**scale])]
        unit = arb(2) ** -scale
        defect = [arb_poly(x.derivative()) * unit for x in p]
        for i, k, column in self.terms:
            product = arb_poly(factors[i].mul_low(factors[k], n)) * unit * unit
            for a, x in column:
                defect[a] -= product * (h * x)
        return defect

    def find_state(self, y: Balls) -> tuple[list[Ball], list[Ball]]:
        """Return attitude and momentum in the user's frame and units."""
        y = self._fill(y)
        m = self.inertia @ (self.units * y[:3] + y[_O]) + self.rotor
        m = turn(y[_Q], m * arb(2) ** (self.time + self.moment))
        return list(multiply(y[_Q], conjugate(self.axes))), list(m)


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
