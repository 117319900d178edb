"""Steps of sets that contain the motion: a Taylor polynomial with the bound of its defect.

A set holds the states mid + Q s with |s_i| <= r_i. On a step of the time h, sigma = 0 .. 1, the
motions satisfy y' = F(y) with F = h f, and DF(y) = A(y) is affine with the derivative B. Let p and
V be polynomials with p(0) = mid and V(0) = 1, and Q'^T Q' nearly 1. The step is proved by

    (1)  |p' - F(p)| <= sum_k d_k sigma^k
    (2)  the largest eigenvalue of the symmetric part of A(y) <= l, l > 0, for |y - p| <= TUBE
    (3)  g |Q| |r| + rest < TUBE,   g = e^l,   rest = g sum_k d_k / (k + 1)
    (4)  |V' - A(p) V| <= e,   error = g (e + |B| (g |Q| |r| + rest) sup |V|)
    (5)  r'_i >= sum_j |Q'^T V Q|_ij r_j + |Q'| (error |Q| |r| + rest)
         plus 2 |Q'^T Q' - 1| times the length of this bound.

The motions then end in the set p(1) + Q' s', |s'_i| <= r'_i. The proof is in
docs/theory/enclosures.md. Bounds are sums of nonnegative floats, multiplied by ROUNDED_UP; matrix
norms are those of Frobenius. Midpoints and coefficients of p are integers times 2^-scale, so that
products of polynomials are exact.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np
from flint import arb, ctx, fmpz_poly

from .._utils.arguments import Array
from .equations import ROUNDED_UP, Ball, Balls, Equations, make_ball, make_vector

TUBE = 2.0**-10  # radius of the tube about p in which the bounds hold
LEAST_GROWTH = 2.0**-20  # least l, so that it is positive
LARGEST_GROWTH = 8.0  # l, beyond which `rest` and `error` would be large
LARGEST_EXPONENT = 10.0  # h |A|, up to which V has enough orders
SLACK = 2.0**-40  # of sums of up to 2^11 rounded products, relative to those of absolute values
TINY = 2.0**-1000  # more than any underflow
LARGEST_NUMBER = 2.0**100  # of coefficients, so that their integers do not overflow as floats
LARGEST_DRIFT = 1e-11  # of Q from an orthogonal matrix
GUARD = 24  # bits beyond those of the series
CORRECTED_BITS = 50  # that each correction of p adds
ORDER_PER_BIT = 0.6
ORDER_OF_DERIVATIVE = 32


def measure(x: Array, axis: int | None = None) -> Any:
    """Return an upper bound of the Euclidean or Frobenius norm. Squares would underflow."""
    scale = np.abs(x).max(axis=axis, keepdims=True) + TINY
    sizes = scale * np.sqrt(((x / scale) ** 2).sum(axis=axis, keepdims=True))
    return sizes.squeeze() * ROUNDED_UP + TINY


def solve_series(
    first: Array, n: int, find_order: Callable[[int, Array], Array], source: Array | None = None
) -> Array:
    """Return the Taylor coefficients 0 .. n of x' = A x - source, with A_k = find_order(k, x_k)."""
    d = len(first)
    A, x = np.zeros((d, n * d)), np.zeros((n + 1, *first.shape))
    x[n] = first  # the last order comes first, so that a sum over orders is one product
    flat = x.reshape(-1, *first.shape[1:])
    for k in range(n):
        A[:, k * d : (k + 1) * d] = find_order(k, x[n - k])
        right = A[:, : (k + 1) * d] @ flat[(n - k) * d :]
        x[n - k - 1] = (right if source is None else right - source[k]) / (k + 1)
    return x[::-1]


def linearize(equations: Equations, c: Array, h: float) -> Array:
    """Return the coefficients of A(p) = h Df(p), where `c` are those of p."""
    d = c.shape[1]
    A: Array = ((h * c) @ equations.bilinear.reshape(d * d, d).T).reshape(len(c), d, d)
    A[0] += h * equations.linear
    return A


def round_to_integers(x: Array, scale: int) -> list[fmpz_poly]:
    """Return the polynomials with coefficients near x 2^scale, for each column of x."""
    limited = np.nan_to_num(np.clip(x, -LARGEST_NUMBER, LARGEST_NUMBER))
    columns = np.rint(np.ldexp(limited, scale)).T.tolist()
    return [fmpz_poly(list(map(int, column))) for column in columns]


def bound_largest_eigenvalue(N: Array) -> float:
    """Return an upper bound for all symmetric matrices with diagonals and sizes as N has.

    For positive v, it is the largest of (N v)_i / v_i (Collatz), as no other element is negative.
    """
    v = np.ones(len(N))
    shift = 1.0 + np.abs(N.diagonal()).max()
    for _ in range(8):
        v = N @ v + shift * v
        v = np.maximum(v / v.max(), 1e-3)
    bounds = (N @ v + SLACK * (np.abs(N) @ v)) / v
    return max(float(bounds.max()), LEAST_GROWTH)


class Polynomial:
    """A polynomial p(sigma) with exact coefficients near the motion, and the bound of its defect.

    It begins with the Taylor series in floats, `c`. The linearized equations give corrections from
    the defect p' - F(p), computed in balls of more and more bits, until only high orders remain.

    coefficients  polynomials with integer coefficients, p 2^scale, for each component
    values        (n + 1, size) floats nearest to the coefficients of p
    defect        (2 n + 1,) upper bounds d_k of the orders of the defect
    """

    def __init__(self, equations: Equations, mid: list[int], c: Array, h: Ball, bits: int) -> None:
        n, final = len(c) - 1, bits + GUARD
        scales = [*range(final, 25, -CORRECTED_BITS)]
        A = linearize(equations, c[:n], float(h))
        p, change, scale, last = [fmpz_poly([0])] * len(mid), c, 0, math.inf
        while True:
            before, scale = scale, scales.pop() if scales else final
            pairs = zip(p, round_to_integers(change, scale), strict=True)
            p = [x * 2 ** (scale - before) + y for x, y in pairs]
            orders = 2 * n + 1 if scale == final else n
            if scale == final:
                p = [x + (m - int(x[0])) for x, m in zip(p, mid, strict=True)]  # p(0) = mid
            with ctx.workprec(min(scale + CORRECTED_BITS + 8, final)):
                defect = equations.find_defect(p, scale, h, orders)
            table = _tabulate(defect, orders)
            total = float(np.abs(table[:n]).sum())
            if scale == final and not 2.0 ** (-bits - 4) < total < 2.0**-8 * last:
                break
            last = total
            offsets = [m - (int(x[0]) << final - scale) for x, m in zip(p, mid, strict=True)]
            first = np.array([x / 2**final for x in offsets])
            change = solve_series(first, n, lambda k, _: A[k], table[:n])
        # the sum of the coefficients has a radius not less than the sum of their radii
        radii = [float(x(1).rad()) for x in defect]
        self.defect = measure(np.abs(table) + radii, axis=1)
        self.coefficients = p
        self.values = np.ldexp(_tabulate(p, n + 1), -final)


def _tabulate(polynomials: list[Any], n: int) -> Array:
    """Return floats near the coefficients of polynomials as columns of n numbers."""
    rows = [[float(x) for x in one.coeffs()] for one in polynomials]
    return np.array([row + [0.0] * (n - len(row)) for row in rows]).T


class ProvedStep(NamedTuple):
    """The numbers of a step that the inequalities (1) to (5) prove, and the set at its end."""

    p: Polynomial
    growth: float  # l
    rest: float
    V: Array
    error: float
    mid: list[int]
    Q: Array
    r: Array


class MovingSet:
    """The set mid 2^-scale + Q s, |s_i| <= r_i, which contains the exact state at the time t."""

    def __init__(self, equations: Equations, start: Balls, bits: int) -> None:
        self.equations, self.bits, self.scale = equations, bits, bits + GUARD
        self.order = max(ORDER_OF_DERIVATIVE, round(ORDER_PER_BIT * bits))
        pairs = (map(int, x.mid().man_exp()) for x in start)
        self.mid = [math.floor(m * Fraction(2) ** (power + self.scale)) for m, power in pairs]
        radii = np.array([float(x.rad()) for x in start])
        self.r = (radii + 2.0**-self.scale) * ROUNDED_UP
        self.Q = np.eye(len(self.mid))
        self.t, self.cap = Fraction(0), math.inf  # cap is less after a step without proof

    def find_box(self) -> Balls:
        """Return balls of the components of the state."""
        radii = (np.abs(self.Q) @ self.r) * ROUNDED_UP
        pairs = zip(self.mid, radii.tolist(), strict=True)
        return make_vector(arb((m, -self.scale)) + arb(0, r) for m, r in pairs)

    def advance(self, end: Fraction) -> bool:
        """Advance to the time `end`; return False if no step could be proved."""
        sign = 1 if end > self.t else -1
        while self.t != end:
            c = self.compute_series()
            # the step for which the last two terms are below 2^-bits (Jorba and Zou)
            size = 2.0**-self.bits * max(1.0, float(np.linalg.norm(c[0])))
            last = [(k, float(np.linalg.norm(c[k]))) for k in (self.order - 1, self.order)]
            longest = LARGEST_EXPONENT / measure(linearize(self.equations, c[:1], 1.0))
            h = min(self.cap, longest, *((size / x) ** (1.0 / k) for k, x in last if x > 0.0))
            if not (h > 0.0 and np.abs(c[0]).max() < LARGEST_NUMBER):
                return False
            for attempt in range(40):
                step = abs(end - self.t)
                if h < step:  # 9 bits, so that times stay short
                    power = math.frexp(h)[1] - 9
                    step = Fraction(int(math.ldexp(h, -power))) * Fraction(2) ** power
                proof = self.prove_step(c, sign * step)
                if proof:
                    self.mid, self.Q, self.r = proof.mid, proof.Q, proof.r
                    self.t += sign * step
                    self.cap = 1.05 * (float(step) if attempt else self.cap)
                    break
                h = 0.75 * float(step)
            else:
                return False
        return True

    def compute_series(self) -> Array:
        """Return the Taylor coefficients of the motion through mid in floats."""
        first = np.array([m / 2**self.scale for m in self.mid])
        linear, half = self.equations.linear, 0.5 * self.equations.bilinear
        flat, shape = half.reshape(-1, len(first)), linear.shape
        return solve_series(
            first, self.order, lambda k, x: (flat @ x).reshape(shape) + (linear if k == 0 else 0)
        )

    def prove_step(self, c: Array, step: Fraction) -> ProvedStep | None:
        """Return a step from the set, near the Taylor series `c`; None if it is not proved."""
        eq, n, nv, h = self.equations, self.order, ORDER_OF_DERIVATIVE, float(step)
        scaled = c * (h ** np.arange(n + 1))[:, None]
        p = Polynomial(eq, self.mid, scaled, make_ball(step), self.bits)
        sizes = np.abs(p.values) * ROUNDED_UP + TINY
        linear, bilinear = abs(h) * eq.linear_bound, abs(h) * eq.bilinear_bound

        # (2): elements of A(y) - A(mid) are at most `spread`
        spread = bilinear @ (sizes[1:].sum(axis=0) + TUBE)
        spread = (spread + SLACK * (linear + bilinear @ (sizes[0] + TUBE) + spread)) * ROUNDED_UP
        A = linearize(eq, p.values[:nv], h)
        N = 0.5 * (np.abs(A[0] + A[0].T) + spread + spread.T)
        np.fill_diagonal(N, A[0].diagonal() + spread.diagonal())
        growth = bound_largest_eigenvalue(N)
        if not growth < LARGEST_GROWTH:
            return None
        g = math.exp(growth) * ROUNDED_UP

        # (3)
        rest = g * float((p.defect / np.arange(1, len(p.defect) + 1)).sum()) * ROUNDED_UP
        radius = measure(self.r) * (1.0 + LARGEST_DRIFT)
        distance = (g * radius + rest) * ROUNDED_UP

        # (4)
        V = solve_series(np.eye(len(self.mid)), nv, lambda k, _: A[k])
        absolute = np.abs(V)
        tails = np.cumsum(sizes[::-1], axis=0)[::-1]  # sums of the orders k and above
        size_of_A = linear + bilinear @ tails[0]
        high = sum(
            (bilinear @ tails[nv - k] if k < nv else size_of_A) @ absolute[k] for k in range(nv + 1)
        )
        truncated = measure(np.asarray(high)) / (nv + 1)
        sup = absolute.sum(axis=0)
        size_of_V = measure(sup)
        if not (distance < TUBE and g * truncated < 1e-4 * size_of_V):
            return None  # the second bound is true, but r would grow for nothing
        rounded = SLACK * measure(size_of_A @ sup)
        error = g * (truncated + rounded + measure(bilinear) * distance * size_of_V)
        error = (error + SLACK * size_of_V) * ROUNDED_UP

        # (5)
        image = V.sum(axis=0) @ self.Q
        new = np.linalg.qr(image)[0]
        drift = measure(new.T @ new - np.eye(len(new))) + 1e-12
        r = np.abs(new.T @ image) @ self.r + (1.0 + LARGEST_DRIFT) * (error * radius + rest)
        r = (r + 2.0 * drift * measure(r)) * ROUNDED_UP + TINY
        if not (drift < LARGEST_DRIFT and np.isfinite(r).all()):
            return None
        mid = [int(x(1)) for x in p.coefficients]
        return ProvedStep(p, growth, rest, V, error, mid, new, r)
