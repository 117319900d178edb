"""A Taylor-series solution of the equations of motion in decimal arithmetic.

The equations of motion are written in the body frame. Along the principal axes, the momentum M, the
vertical P, the angular velocity w and the angular velocity u of the support satisfy

    M' = M x w + (mass gravity + s) P x com - D (w - u),    P' = P x (w - u),    u' = u x (w - u)

Here s = -mass amplitude rate^2 cos(rate t + phase) is the contribution of a shaken support. The
solution shares no code with the library and serves as an independent reference.
"""

import math
from decimal import Decimal, localcontext
from functools import cache
from operator import mul

import kreisel as kr

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


def product(a, b, n):
    """Return the n-th coefficient of the product of two series."""
    return sum(map(mul, a, b[n::-1]), Decimal(0))


def cross(a, b, n):
    """Return the n-th coefficients of the cross product of two series of vectors."""
    pairs = ((1, 2), (2, 0), (0, 1))
    return [product(a[j], b[k], n) - product(a[k], b[j], n) for j, k in pairs]


def cosine_and_sine(x):
    """Return the cosine and sine of an angle up to 100 rad, computed with extra digits."""
    sums, n = [Decimal(0), Decimal(0)], 0
    with localcontext() as context:
        context.prec = 3 * DIGITS
        term = Decimal(1)
        while n < 2 * abs(x) or abs(term) > Decimal(10) ** (-2 * DIGITS):
            sums[n % 2] += term if n % 4 < 2 else -term
            n += 1
            term *= x / n
    return sums


class Series:
    """The motion of a scene, forward or backward in time from its initial state.

    The time steps become shorter as the requested number of digits increases.
    """

    def __init__(self, scene, digits=DIGITS):
        body, self.digits = scene.body, digits
        with localcontext() as context:
            context.prec = digits
            self.axes = unit(decimals(body.axes))
            self.moments = decimals(body.moments)
            self.damping, self.rotor = decimals(scene.damping), decimals(body.principal_rotor)
            self.lever = [Decimal(body.mass) * c for c in decimals(body.principal_com)]
            self.gravity, self.turning = Decimal(scene.gravity), decimals(scene.turning)
            self.shaking = decimals(scene.shaking)
            self.t = Decimal(0)
            self.q = unit(multiply(unit(decimals(scene.attitude)), self.axes))
            self.m = turn(conjugate(self.q), decimals(scene.momentum))

    def _pull(self):
        """Return the Taylor coefficients of the effective gravity on a shaken support."""
        amplitude, rate, phase = self.shaking
        pull = [self.gravity] + [Decimal(0)] * ORDER
        if amplitude:
            cosine, sine = cosine_and_sine(rate * self.t + phase)
            factor = -amplitude * rate * rate
            for n in range(ORDER + 1):
                pull[n] += factor * (cosine, -sine, -cosine, sine)[n % 4]
                factor *= rate / (n + 1)
        return pull

    def _momentum_rates(self, m, w, p, v, n):
        """Return the n-th Taylor coefficients of the time derivative of the angular momentum.

        `w` is the angular velocity, and `v` is the angular velocity relative to the support. `p` is
        the vertical unit vector multiplied by the effective gravity.
        """
        torque = cross(m, w, n)
        for i in range(3):
            j, k = (i + 1) % 3, (i + 2) % 3
            torque[i] += p[j][n] * self.lever[k] - p[k][n] * self.lever[j]
            torque[i] -= self.damping[i] * v[i][n]
        return torque

    def _expand(self):
        """Return the Taylor coefficients of the attitude and of the momentum in the body frame."""
        m, q, half = [[x] for x in self.m], [[x] for x in self.q], Decimal("0.5")
        p, u = (
            [[x] for x in turn(conjugate(self.q), vector)]
            for vector in (decimals((0, 0, 1)), self.turning)
        )
        w, pull, heavy = [[x] for x in self._velocity()], self._pull(), [[], [], []]
        v = [[x[0] - y[0]] for x, y in zip(w, u, strict=True)]
        for n in range(ORDER):
            for i in range(3):
                heavy[i].append(product(p[i], pull, n))
            torque = self._momentum_rates(m, w, heavy, v, n)
            new_p = cross(p, v, n)
            new_u = cross(u, v, n) if any(self.turning) else self.turning
            a, x, y, z = q
            new_q = [
                -product(x, v[0], n) - product(y, v[1], n) - product(z, v[2], n),
                product(a, v[0], n) + product(y, v[2], n) - product(z, v[1], n),
                product(a, v[1], n) + product(z, v[0], n) - product(x, v[2], n),
                product(a, v[2], n) + product(x, v[1], n) - product(y, v[0], n),
            ]
            for i in range(3):
                m[i].append(torque[i] / (n + 1))
                w[i].append(m[i][-1] / self.moments[i])
                p[i].append(new_p[i] / (n + 1))
                u[i].append(new_u[i] / (n + 1))
                v[i].append(w[i][-1] - u[i][-1])
            for i in range(4):
                q[i].append(half * new_q[i] / (n + 1))
        return q, m

    def _choose_step(self, q, m):
        """Return a step size for which the last two Taylor terms of q and m are negligible."""
        span = math.inf
        for rows in (q, m):
            size = max(abs(row[0]) for row in rows) or Decimal(1)
            for n in (ORDER - 1, ORDER):
                last = max(abs(row[n]) for row in rows) / size
                if last > 0:
                    span = min(span, 10 ** ((-self.digits - float(last.log10())) / n))
        return Decimal(0.8 * span)

    def to(self, t):
        """Integrate to the time `t`, and return the attitude and momentum in the space frame."""
        with localcontext() as context:
            context.prec = self.digits
            goal = Decimal(float(t))
            while self.t != goal:
                q, m = self._expand()
                remaining = goal - self.t
                span = min(self._choose_step(q, m), abs(remaining)).copy_sign(remaining)
                self.t = goal if span == remaining else self.t + span
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
    """Return the angle between the reference attitude `q` and the attitude `high` + `low`."""
    with localcontext() as context:
        context.prec = DIGITS
        attitude = [a + b for a, b in zip(decimals(high), decimals(low), strict=True)]
        difference = multiply(conjugate(q), unit(attitude))
        return 2.0 * float(sum((c * c for c in difference[1:]), Decimal(0)).sqrt())


@cache
def compute_states(scene, *times):
    """Return the attitude and momentum of `scene` at each time."""
    series = Series(scene)
    return [series.to(t) for t in times]


def decimal_error(scene, t, digits):
    """Return the attitude error at time `t` of a Taylor solution with the given precision."""
    path = kr.solve(scene, [0.0, t], "taylor", digits=digits)
    low = path.q_low[-1] if digits else (0, 0, 0, 0)
    return attitude_error(compute_states(scene, t)[0][0], path.q[-1], low)
