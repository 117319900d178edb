"""Steps of sets that contain the motion: a Taylor polynomial with the bound of its defect.

A set holds the states mid + Q s with |s_i| <= r_i. On a step of the time h, sigma = 0 .. 1, the
motions satisfy y' = F(y) with F = h f, and DF(y) = A(y) is affine. Let p be any polynomial with
p(0) = mid, and |.| the Euclidean norm. If there are numbers with

    (1)  |p' - F(p)| <= sum_k d_k sigma^k
    (2)  the largest eigenvalue of the symmetric part of A(y) <= l, l > 0, for |y - p| <= TUBE
    (3)  g |Q| |r| + rest < TUBE,   g = e^l,   rest = g sum_k d_k / (k + 1)

then all motions from the set stay within (3) of p, and the one from mid ends within `rest` of p(1).
Let V be a polynomial of matrices with V(0) = 1, and B the derivative of A. If

    (4)  |V' - A(p) V| <= e,   error = g (e + |B| (g |Q| |r| + rest) sup |V|)

then the derivative of the motion by its start is within `error` of V(1) on the whole set, and the
motions from the set end in p(1) + (V(1) + E) Q s + x with |E| <= error, |x| <= rest. The set
mid' + Q' s' contains them if, with Q' nearly orthogonal and |Q'^T Q' - 1| <= drift,

    (5)  r'_i >= sum_j |Q'^T V Q|_ij r_j + |Q'| (error |Q| |r| + |p(1) - mid'| + rest)

plus 2 drift times the length of this bound. The proof is in docs/theory/enclosures.md. Bounds are
sums of nonnegative floats, multiplied by ROUNDED_UP; matrix norms are those of Frobenius.
"""

from __future__ import annotations

import math
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np
from flint import arb, arb_poly

from .._utils.arguments import Array
from .equations import ROUNDED_UP, Ball, Balls, Equations, make_ball, make_vector

TUBE = 2.0**-10  # radius of the tube about p in which the bounds hold
LEAST_GROWTH = 2.0**-20  # least l, so that it is positive
SLACK = 2.0**-40  # of sums of up to 2^11 rounded products, relative to those of absolute values
TINY = 2.0**-1000  # more than any underflow
LARGEST_DRIFT = 1e-11  # of Q from an orthogonal matrix
GUARD = 24  # bits beyond those of the series
LONGEST_STEP = 4.0  # in units of time in which rates are below 1
ORDER_PER_BIT = 0.45
ORDER_OF_DERIVATIVE = 16


def measure(x: Array, axis: int | None = None) -> Any:
    """Return an upper bound of the Euclidean or Frobenius norm. Squares would underflow."""
    scale = np.abs(x).max(axis=axis, keepdims=True) + TINY
    sizes = scale * np.sqrt(((x / scale) ** 2).sum(axis=axis, keepdims=True))
    return sizes.squeeze() * ROUNDED_UP + TINY


def solve_linear_series(A: Array, first: Array, source: Array | None, n: int) -> Array:
    """Return the Taylor coefficients 0 .. n of x' = A x - source with x(0) = `first`."""
    x = np.zeros((n + 1, *first.shape))
    x[0] = first
    for k in range(n):
        j = min(k + 1, len(A))
        right = np.einsum("jab,jb...->a...", A[:j], x[k::-1][:j])
        x[k + 1] = (right - source[k] if source is not None else right) / (k + 1)
    return x


def linearize(equations: Equations, c: Array, h: float) -> Array:
    """Return the coefficients of A(p) = h Df(p), where `c` are those of p."""
    A: Array = h * np.einsum("iab,kb->kia", equations.bilinear, c)
    A[0] += h * equations.linear
    return A


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
    the defect p' - F(p), which is computed in balls, until only its highest orders remain.

    coefficients  lists of n + 1 balls with radius 0, for each component
    values        (n + 1, size) floats nearest to the coefficients
    defect        (2 n + 1,) upper bounds d_k of the orders of the defect
    end           balls of p(1)
    """

    def __init__(self, equations: Equations, mid: Balls, c: Array, h: Ball, bits: int) -> None:
        n, size = c.shape[0] - 1, c.shape[1]
        rows = [[start, *map(arb, c[1:, i].tolist())] for i, start in enumerate(mid)]
        A = linearize(equations, c[:n], float(h))
        last = math.inf
        while True:
            p = make_vector(map(arb_poly, rows))
            defect = [x.derivative() - h * f for x, f in zip(p, equations(p), strict=True)]
            low = _tabulate([[float(x) for x in one.coeffs()[:n]] for one in defect], n)
            total = float(np.abs(low).sum())
            if not 2.0 ** (-bits - 4) < total < 2.0**-8 * last:
                break
            last = total
            changes = solve_linear_series(A, np.zeros(size), low, n).T.tolist()
            for row, change in zip(rows, changes, strict=True):
                row[1:] = [(x + d).mid() for x, d in zip(row[1:], change[1:], strict=True)]
        bounds = [[float(x.abs_upper()) for x in one.coeffs()] for one in defect]
        self.defect = measure(_tabulate(bounds, 2 * n + 1), axis=1)
        self.coefficients = rows
        self.values = np.array([[float(x) for x in row] for row in rows]).T
        self.end = [sum(reversed(row), arb(0)) for row in rows]


def _tabulate(rows: list[list[float]], n: int) -> Array:
    """Return rows of up to n numbers as the columns of an array, with zeros at their ends."""
    return np.array([row + [0.0] * (n - len(row)) for row in rows]).T


class ProvedStep(NamedTuple):
    """The numbers of a step that the inequalities (1) to (5) prove, and the set at its end."""

    p: Polynomial
    growth: float  # l
    rest: float
    V: Array
    error: float
    mid: Balls
    Q: Array
    r: Array


class MovingSet:
    """The set mid + Q s, |s_i| <= r_i, of states at one time, which contains the exact state."""

    def __init__(self, equations: Equations, bits: int) -> None:
        self.equations, self.bits = equations, bits
        self.order = max(20, round(ORDER_PER_BIT * bits))
        self.t = Fraction(0)
        self.mid: Balls = make_vector(x.mid() for x in equations.start)
        self.r = np.array([float(x.rad()) * ROUNDED_UP for x in equations.start])
        self.Q = np.eye(len(self.mid))
        self.cap = LONGEST_STEP  # less after a step that could not be proved

    def find_box(self) -> Balls:
        """Return balls of the components of the state."""
        radii = (np.abs(self.Q) @ self.r) * ROUNDED_UP
        return self.mid + make_vector(arb(0, r) for r in radii.tolist())

    def advance(self, end: Fraction) -> bool:
        """Advance to the time `end`; return False if no step could be proved."""
        sign = 1 if end > self.t else -1
        while self.t != end:
            c = self.compute_series()
            # the step for which the last two terms are below 2^-bits (Jorba and Zou)
            size = 2.0**-self.bits * max(1.0, float(np.linalg.norm(c[0])))
            last = [(k, float(np.linalg.norm(c[k]))) for k in (self.order - 1, self.order)]
            h = min((self.cap, *((size / x) ** (1.0 / k) for k, x in last if x > 0.0)))
            if not h > 0.0:
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
                    self.cap = min(LONGEST_STEP, 1.25 * (float(step) if attempt else self.cap))
                    break
                h = float(step) / 2
            else:
                return False
        return True

    def compute_series(self) -> Array:
        """Return the Taylor coefficients of the motion through mid in floats."""
        eq, n = self.equations, self.order
        c = np.zeros((n + 1, len(self.mid)))
        c[0] = [float(x) for x in self.mid]
        B = np.zeros((n, len(self.mid), len(self.mid)))
        for k in range(n):
            B[k] = eq.bilinear @ c[k]
            right = eq.linear @ c[k] + 0.5 * np.einsum("jab,jb->a", B[: k + 1], c[k::-1])
            c[k + 1] = right / (k + 1)
        return c

    def prove_step(self, c: Array, step: Fraction) -> ProvedStep | None:
        """Return a step from the set, near the Taylor series `c`; None if it is not proved."""
        eq, n, nv = self.equations, self.order, ORDER_OF_DERIVATIVE
        h = float(step)
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
        if not growth < 30.0:
            return None
        g = math.exp(growth) * ROUNDED_UP

        # (3)
        rest = g * float((p.defect / np.arange(1, len(p.defect) + 1)).sum()) * ROUNDED_UP
        radius = measure(self.r) * (1.0 + LARGEST_DRIFT)
        distance = (g * radius + rest) * ROUNDED_UP
        if not distance < TUBE:
            return None

        # (4)
        V = solve_linear_series(A, np.eye(len(self.mid)), None, nv)
        absolute = np.abs(V)
        tails = np.cumsum(sizes[::-1], axis=0)[::-1]  # sums of the orders k and above
        size_of_A = linear + bilinear @ tails[0]
        high = sum(
            (bilinear @ tails[nv - k] if k < nv else size_of_A) @ absolute[k] for k in range(nv + 1)
        )
        sup = absolute.sum(axis=0)
        truncated = measure(np.asarray(high)) / (nv + 1)
        size_of_V = measure(sup)
        if not g * truncated < 1e-4 * size_of_V:
            return None  # true bounds, but r would grow for nothing
        rounded = SLACK * measure(size_of_A @ sup)
        error = g * (truncated + rounded + measure(bilinear) * distance * size_of_V)
        error = (error + SLACK * size_of_V) * ROUNDED_UP

        # (5)
        image = V.sum(axis=0) @ self.Q
        new = np.linalg.qr(image)[0]
        drift = measure(new.T @ new - np.eye(len(new))) + 1e-12
        if not drift < LARGEST_DRIFT:
            return None
        mid = make_vector(x.mid() for x in p.end)
        rounding = measure(np.array([float(x.rad()) for x in p.end]))
        lengths = error * radius + rounding + rest
        r = np.abs(new.T @ image) @ self.r + (1.0 + LARGEST_DRIFT) * lengths
        r = (r + 2.0 * drift * measure(r)) * ROUNDED_UP + TINY
        if not np.isfinite(r).all():
            return None
        return ProvedStep(p, growth, rest, V, error, mid, new, r)
