"""A Taylor-series solution of the equations of motion in decimal arithmetic.

The equations are those in the body frame. The solution shares no code with the library, and serves
as a reference for the results of the library.
"""

import math
from decimal import Decimal, localcontext

DIGITS, ORDER = 45, 40


def multiply(a, b):
    """Return the product of two quaternions."""
    w, x, y, z = a
    p, q, r, s = b
    return [
        w * p - x * q - y * r - z * s,
        w * q + x * p + y * s - z * r,
        w * r + y * p + z * q - x * s,
        w * s + z * p + x * r - y * q,
    ]


def conjugate(q):
    return [q[0], -q[1], -q[2], -q[3]]


def unit(q):
    size = sum((c * c for c in q), Decimal(0)).sqrt()
    return [c / size for c in q]


def turn(q, v):
    """Rotate the vector `v` from the body frame to the space frame. `q` is the attitude."""
    return multiply(multiply(q, [Decimal(0), *v]), conjugate(q))[1:]


def decimals(numbers):
    return [Decimal(float(x)) for x in numbers]


class Series:
    """The motion of a scene, forward or backward from its start."""

    def __init__(self, scene):
        body = scene.body
        with localcontext() as context:
            context.prec = DIGITS
            self.axes = unit(decimals(body.axes))
            self.moments = decimals(body.moments)
            self.damping, self.rotor = decimals(scene.damping), decimals(body.principal_rotor)
            weight = Decimal(body.mass) * Decimal(scene.gravity)
            self.lever = [weight * c for c in decimals(body.principal_com)]
            self.t = Decimal(0)
            self.q = unit(multiply(unit(decimals(scene.attitude)), self.axes))
            self.m = turn(conjugate(self.q), decimals(scene.momentum))

    def _momentum_rates(self, m, w, p, n):
        """Return the n-th Taylor coefficients of the time derivative of the body momentum."""
        torque = []
        for i in range(3):
            j, k = (i + 1) % 3, (i + 2) % 3
            turning = sum(
                (m[j][a] * w[k][n - a] - m[k][a] * w[j][n - a] for a in range(n + 1)), Decimal(0)
            )
            weight = p[j][n] * self.lever[k] - p[k][n] * self.lever[j]
            torque.append(turning + weight - self.damping[i] * w[i][n])
        return torque

    def _expand(self):
        """Return the Taylor coefficients of the attitude and of the momentum in the body frame."""
        m, q, half = [[x] for x in self.m], [[x] for x in self.q], Decimal("0.5")
        p = [[x] for x in turn(conjugate(self.q), decimals((0, 0, 1)))]
        w = [[x] for x in self._velocity()]

        def product(a, b, n):
            return sum((a[k] * b[n - k] for k in range(n + 1)), Decimal(0))

        for n in range(ORDER):
            torque = self._momentum_rates(m, w, p, n)
            new_p = [
                product(p[(i + 1) % 3], w[(i + 2) % 3], n)
                - product(p[(i + 2) % 3], w[(i + 1) % 3], n)
                for i in range(3)
            ]
            a, x, y, z = q
            new_q = [
                -product(x, w[0], n) - product(y, w[1], n) - product(z, w[2], n),
                product(a, w[0], n) + product(y, w[2], n) - product(z, w[1], n),
                product(a, w[1], n) + product(z, w[0], n) - product(x, w[2], n),
                product(a, w[2], n) + product(x, w[1], n) - product(y, w[0], n),
            ]
            for i in range(3):
                m[i].append(torque[i] / (n + 1))
                w[i].append(m[i][-1] / self.moments[i])
                p[i].append(new_p[i] / (n + 1))
            for i in range(4):
                q[i].append(half * new_q[i] / (n + 1))
        return q, m

    def _choose_step(self, q, m):
        """Return a step for which the last two terms of each series are below the last digit."""
        span = math.inf
        for rows in (q, m):
            size = max(abs(row[0]) for row in rows) or Decimal(1)
            for n in (ORDER - 1, ORDER):
                last = max(abs(row[n]) for row in rows) / size
                if last > 0:
                    span = min(span, 10 ** ((-DIGITS - float(last.log10())) / n))
        return Decimal(0.8 * span)

    def to(self, t):
        """Advance to the time `t`, and return attitude and momentum in space as decimals."""
        with localcontext() as context:
            context.prec = DIGITS
            goal = Decimal(float(t))
            while self.t != goal:
                q, m = self._expand()
                left = goal - self.t
                span = min(self._choose_step(q, m), abs(left)).copy_sign(left)
                self.t = goal if span == left else self.t + span
                powers = [span**n for n in range(ORDER + 1)]

                def end(row, powers=powers):
                    return sum((c * h for c, h in zip(row, powers, strict=True)), Decimal(0))

                self.q, self.m = unit([end(row) for row in q]), [end(row) for row in m]
            return multiply(self.q, conjugate(self.axes)), turn(self.q, self.m)

    def _velocity(self):
        return [(m - h) / i for m, h, i in zip(self.m, self.rotor, self.moments, strict=True)]

    def velocity(self):
        """Return the components of the angular velocity along the principal axes."""
        return [float(w) for w in self._velocity()]


def attitude_error(q, high, low=(0, 0, 0, 0)):
    """Return the angle between the decimal attitude `q` and the attitude `high` + `low`."""
    with localcontext() as context:
        context.prec = DIGITS
        there = [a + b for a, b in zip(decimals(high), decimals(low), strict=True)]
        off = multiply(conjugate(q), unit(there))
        return 2.0 * float(sum((c * c for c in off[1:]), Decimal(0)).sqrt())
