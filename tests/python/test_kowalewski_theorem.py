"""Proof of the theorems behind the closed form of the Kowalewski top (docs/theory/closed_form.md).

Each statement is an identity of polynomials in the state p, q, r, g1, g2, g3, where g is e3 in the
body frame. It holds for all states if its remainder modulo |g| = 1 is zero in exact arithmetic.
"""

import pytest

flint = pytest.importorskip("flint")
RING = flint.fmpq_mpoly_ctx.get(("W", "g3", "p", "q", "r", "g1", "g2"), flint.Ordering.lex)
W, g3, p, q, r, g1, g2 = RING.gens()
HALF = flint.fmpq(1, 2)
OMEGA, UP = (p, q, r), (g1, g2, g3)
SPHERE = g1**2 + g2**2 + g3**2 - 1

# The constants of motion, and the polynomial Q w^2 + 2 R12 w + R1 with the zeros w1 and w2.
h = p**2 + q**2 + HALF * r**2 - g1
l = 2 * p * g1 + 2 * q * g2 + r * g3  # noqa: E741, the name in the literature
xi_1, xi_2 = p**2 - q**2 + g1, 2 * p * q + g2
k2 = xi_1**2 + xi_2**2
c, y, Q = 1 - k2, p**2 + q**2, 4 * q**2
R12 = 2 * h * y - y**2 + 2 * l * p + c
R1 = 2 * h * c - l**2 - 2 * h * y**2 - 4 * c * p**2 - 4 * l * p * y


def derive(f):
    """Return the derivative of f by time."""
    field = {"p": HALF * q * r, "q": -HALF * (p * r + g3), "r": g2}
    field |= {"g1": g2 * r - g3 * q, "g2": g3 * p - g1 * r, "g3": g1 * q - g2 * p}
    return sum((f.derivative(name) * rate for name, rate in field.items()), 0 * p)


def dot(a, b):
    return sum((x * y for x, y in zip(a, b, strict=True)), 0 * p)


def cross(a, b):
    return [a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3] for i in range(3)]


def turn_of(a):
    """Return |a_h|^2 for the horizontal part of a body vector, and |a_h|^2 times its turn rate."""
    rate = [derive(x) + v for x, v in zip(a, cross(OMEGA, a), strict=True)]
    return dot(a, a) - dot(a, UP) ** 2, dot(UP, cross(a, rate))


def assert_zero(f):
    """Assert that f is zero for |g| = 1 and for both W = Q w1 and W = Q w2."""
    assert f % (W**2 + 2 * R12 * W + Q * R1) % SPHERE == 0


def test_the_variables_separate():
    for constant in (h, l, k2, SPHERE):
        assert_zero(derive(constant))
    # (w1 - w2)^2 w'^2 = F(w)^2, times Q^7, where w' = -(Q' w^2 + 2 R12' w + R1')/(Q (w1 - w2))
    rate = derive(Q) * W**2 + 2 * derive(R12) * Q * W + derive(R1) * Q**2
    phi = 2 * (W + Q * h) * (W**2 + Q**2 * c) - Q**3 * l**2
    assert_zero(rate**2 - Q * (Q**2 * k2 - W**2) * phi)


def test_the_heading_of_C_separates():
    S = g3 + p * r
    C = [-q * (r * S + q * g2), HALF * (S**2 - q**2 * r**2) + q**2 * g1, q * (p * S + q**2 * r)]
    square, turn = turn_of(C)
    # q^4 (w1^2 + c)(w2^2 + c) = q^4 (w1 w2 - c)^2 + q^4 c (w1 + w2)^2, and l q^4 (c - w1 w2)
    assert_zero(16 * square - (R1 - Q * c) ** 2 - 4 * c * R12**2)
    assert_zero(16 * turn - l * Q * (Q * c - R1))


def test_the_heading_of_B_separates():
    S, H = g3 + p * r, h - HALF * l**2
    B = [
        -g2 * r * S - 2 * q * (g2**2 + 2 * p * (p * g1 + q * g2)),
        S * (r * g1 - 2 * p * g3) + 2 * q * (g1 * g2 - q * l),
        2 * p * g2 * S - q * r * (l + 2 * p * g1),
    ]
    square, turn = turn_of(B)
    # -4 q^2 (w1 + H)(w2 + H), and -2 l q^2 (k^2 + w1 w2 + H (w1 + w2))
    assert_zero(square + R1 - 2 * H * R12 + Q * H**2)
    assert_zero(2 * turn + l * (Q * k2 + R1 - 2 * H * R12))


def test_sums_of_the_two_variables_are_their_rates():
    """Check the partial fractions that turn both rates of headings into sums over w1 and w2."""
    w1, w2, C, H, K2 = p, q, r, g1, g2
    assert w1 * (w2**2 + C) - w2 * (w1**2 + C) == (w1 - w2) * (C - w1 * w2)
    one, two = (K2 - w1**2) * (w2 + H), (K2 - w2**2) * (w1 + H)
    assert one - two == -(w1 - w2) * (K2 + w1 * w2 + H * (w1 + w2))


def test_the_headings_of_C_and_B_differ_by_arguments():
    """Check d arg(l u + iF) = l w dw/((w^2 + c) F) + l u ds/((2 s - l^2) F), u = k^2 - w^2."""
    s, u, w, L = p, q, r, g1
    square = u * (2 * s * (1 - u) - L**2)  # F^2
    assert L**2 * u**2 + square == u * (1 - u) * (2 * s - L**2)
    change = square.derivative("p") - 2 * w * square.derivative("q")  # by s
    turn = HALF * u * change + 2 * w * square
    assert turn == w * u * (2 * s - L**2) + u**2 * (1 - u)


def test_the_formulas_of_the_state():
    z, z_2 = (g3 + p * r, q * r), ((g3 + p * r) ** 2 - (q * r) ** 2, 2 * (g3 + p * r) * q * r)
    assert_zero(dot(z, z) - R12)
    assert_zero(2 * dot(z_2, (xi_1, xi_2)) + Q * k2 + R1)
    assert_zero(2 * (p * g1 + q * g2) - (l - r * g3))
    assert_zero(p * g2 - q * g1 + derive(g3))
