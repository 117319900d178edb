"""Reference solutions by Taylor series in decimal arithmetic, for every top that kreisel knows.

In the frame in which the body is described, let M be the momentum, u = q* turning q and
P = q* e3 q. The angular velocity in the inertial frame is w = J^-1 (M - rotor). The equations are

    M' = M x w + P x (mass g com + gradient J P) - D (w - u) + k a,    q' = q (w - u) / 2

with g = gravity - amplitude rate^2 cos(rate t + phase) and the unit vector a along the apex. The
damping coefficients in D refer to the principal axes. The torque k of dry friction is -friction
times the sign of the spin <w - u, a>. If the spin is zero, k keeps it zero, provided that |k| does
not exceed the friction.

A scene is a dictionary of the arguments of kr.Scene, in which `body` is a dictionary of the
arguments of kr.Body. Its numbers are taken as exact.
"""

import math
from decimal import Decimal, localcontext
from itertools import pairwise
from operator import mul

import mpmath as mp

from .quadrature import product as multiply

DIGITS = 44
CYCLE = ((0, 1, 2), (1, 2, 0), (2, 0, 1))
SAMPLES = 16  # of a step, among which the spin must not change its sign twice
NONE = (0, 0, 0)


def conjugate(q):
    return [q[0], -q[1], -q[2], -q[3]]


def normalize(v):
    size = dot(v, v).sqrt()
    return [x / size for x in v]


def turn(q, v):
    """Rotate the vector `v` by the unit quaternion `q`."""
    return multiply(multiply(q, [Decimal(0), *v]), conjugate(q))[1:]


def dot(a, b):
    return sum(map(mul, a, b), Decimal(0))


def to_decimals(numbers):
    return [x if isinstance(x, Decimal) else Decimal(float(x)) for x in numbers]


def to_matrix(inertia):
    """Return the inertia as a matrix, given its diagonal or all its rows."""
    if isinstance(inertia[0], list | tuple):
        return [to_decimals(row) for row in inertia]
    diagonal = to_decimals(inertia)
    return [[diagonal[i] if i == j else Decimal(0) for j in range(3)] for i in range(3)]


def invert(matrix):
    rows = [
        [matrix[j][m] * matrix[k][n] - matrix[j][n] * matrix[k][m] for _, m, n in CYCLE]
        for _, j, k in CYCLE
    ]
    determinant = dot(matrix[0], rows[0])
    return [[rows[j][i] / determinant for j in range(3)] for i in range(3)]


def make_damping(inertia, damping):
    """Return the damping matrix. Each principal axis belongs to the nearest axis of description."""
    values = to_decimals([damping] * 3 if isinstance(damping, float | int) else damping)
    if len(set(values)) == 1 or not any(map(any, (row[i + 1 :] for i, row in enumerate(inertia)))):
        return to_matrix(values)
    with mp.workdps(2 * DIGITS):
        vectors = mp.eigsy(mp.matrix([[mp.mpf(str(x)) for x in row] for row in inertia]))[1]
        axes = [[vectors[i, k] for i in range(3)] for k in range(3)]
        axes.sort(key=lambda axis: max(range(3), key=lambda i: abs(axis[i])))
        axes = [[Decimal(mp.nstr(x, 2 * DIGITS)) for x in axis] for axis in axes]
    return [
        [sum(d * e[i] * e[j] for d, e in zip(values, axes, strict=True)) for j in range(3)]
        for i in range(3)
    ]


def product(a, b, n):
    """Return the n-th coefficient of the product of two series."""
    return sum(map(mul, a, b[n::-1]), Decimal(0))


def cross(a, b, n):
    """Return the n-th coefficients of the cross product of two series of vectors."""
    return [product(a[j], b[k], n) - product(a[k], b[j], n) for _, j, k in CYCLE]


def cosine_and_sine(x, digits):
    """Return the cosine and the sine of an angle."""
    with mp.workdps(2 * digits):
        angle = mp.mpf(str(x))
        return [Decimal(mp.nstr(f(angle), digits + 10)) for f in (mp.cos, mp.sin)]


def evaluate(row, t):
    """Return the value of a power series."""
    value = Decimal(0)
    for coefficient in reversed(row):
        value = value * t + coefficient
    return value


def sign_of(x):
    return (x > 0) - (x < 0)


class Series:
    """The motion of a scene, forward or backward in time from its initial state.

    `mode` is the sign of the spin, which is zero while friction holds the top. `stops` are the
    times at which friction begins or ends to hold it, and `steps` counts the steps.
    """

    def __init__(self, scene, digits=DIGITS):
        body, self.digits, self.order = scene["body"], digits, digits * 6 // 5
        self.t, self.stops, self.steps = Decimal(0), [], 0
        with localcontext() as context:
            context.prec = digits + 5
            inertia, com = to_matrix(body["inertia"]), to_decimals(body["com"])
            self.inverse, (mass,) = invert(inertia), to_decimals([body["mass"]])
            (gradient,) = to_decimals([scene.get("gradient", 0)])
            self.steep = [[gradient * x for x in row] for row in inertia]
            self.damping = make_damping(inertia, scene.get("damping", 0))
            self.rotor = to_decimals(body.get("rotor", NONE))
            self.lever = [mass * x for x in com]
            self.apex = normalize(com) if any(com) else to_decimals((0, 0, 1))
            self.gravity, self.friction = to_decimals([scene["gravity"], scene.get("friction", 0)])
            self.turning = to_decimals(scene.get("turning", NONE))
            self.shaking = to_decimals(scene.get("shaking", NONE))
            self.q = normalize(to_decimals(scene["attitude"]))
            self.m = turn(conjugate(self.q), to_decimals(scene["momentum"]))
            self.pliancy = dot(self.apex, self._apply(self.inverse, self.apex))
        self.mode = None

    @staticmethod
    def _apply(matrix, v):
        return [sum(a * x for a, x in zip(row, v, strict=True) if a) for row in matrix]

    def _pull(self):
        """Return the Taylor coefficients of the effective gravity."""
        amplitude, rate, phase = self.shaking
        pull = [self.gravity] + [Decimal(0)] * self.order
        if amplitude:
            cosine, sine = cosine_and_sine(rate * self.t + phase, self.digits)
            factor = -amplitude * rate * rate
            for n in range(self.order + 1):
                pull[n] += factor * (cosine, -sine, -cosine, sine)[n % 4]
                factor *= rate / (n + 1)
        return pull

    def _expand(self, order):
        """Return the Taylor coefficients of q, M, the spin and the torque of friction.

        While the top slides, the last row holds the torque that would keep the spin constant.
        """
        m, q, half = [[x] for x in self.m], [[x] for x in self.q], Decimal("0.5")
        up = to_decimals((0, 0, 1))
        p, u = ([[x] for x in turn(conjugate(self.q), v)] for v in (up, self.turning))
        start = self._apply(self.inverse, [x - h for x, h in zip(self.m, self.rotor, strict=True)])
        w, v = [[x] for x in start], [[x - y[0]] for x, y in zip(start, u, strict=True)]
        pull, heavy, needed = self._pull(), [[], [], []], []
        tilted, has_gradient = [[], [], []], any(map(any, self.steep))
        is_turning, is_shaking = any(self.turning), any(self.shaking)
        for n in range(order):
            for i in range(3):
                heavy[i].append(product(p[i], pull, n) if is_shaking else self.gravity * p[i][n])
            torque = cross(m, w, n)
            drag = self._apply(self.damping, [x[n] for x in v])
            for i, j, k in CYCLE:
                torque[i] += heavy[j][n] * self.lever[k] - heavy[k][n] * self.lever[j] - drag[i]
            if has_gradient:
                for row, x in zip(tilted, self._apply(self.steep, [x[n] for x in p]), strict=True):
                    row.append(x)
                torque = [x + y for x, y in zip(torque, cross(p, tilted, n), strict=True)]
            new_u = cross(u, v, n) if is_turning else to_decimals(NONE)
            if self.friction:
                change = dot(self.apex, self._apply(self.inverse, torque)) - dot(self.apex, new_u)
                needed.append(-change / self.pliancy)
                slide = -self.friction * self.mode if n == 0 else Decimal(0)
                force = slide if self.mode else needed[n]
                torque = [x + force * a for x, a in zip(torque, self.apex, strict=True)]
            new_p, (a, x, y, z) = cross(p, v, n), q
            new_q = [
                -product(x, v[0], n) - product(y, v[1], n) - product(z, v[2], n),
                product(a, v[0], n) + product(y, v[2], n) - product(z, v[1], n),
                product(a, v[1], n) + product(z, v[0], n) - product(x, v[2], n),
                product(a, v[2], n) + product(x, v[1], n) - product(y, v[0], n),
            ]
            new_w = self._apply(self.inverse, torque)
            for i in range(3):
                m[i].append(torque[i] / (n + 1))
                w[i].append(new_w[i] / (n + 1))
                p[i].append(new_p[i] / (n + 1))
                u[i].append(new_u[i] / (n + 1))
                v[i].append(w[i][-1] - u[i][-1])
            for i in range(4):
                q[i].append(half * new_q[i] / (n + 1))
        spin = [dot(self.apex, column) for column in zip(*v, strict=True)]
        return q, m, spin, needed

    def _find_mode(self, spin, torque, direction):
        """Return the sign of the spin after this moment, or before it if `direction` is -1."""
        if spin:
            return sign_of(spin)
        if abs(torque) <= self.friction:
            if direction < 0:
                raise ValueError("a top that friction holds has no unique past")
            return 0
        return -direction * sign_of(torque)

    def _choose_step(self, q, m):
        """Return a step size for which the last two Taylor terms of q and m are negligible."""
        span = math.inf
        for rows in (q, m):
            size = max(abs(row[0]) for row in rows) or Decimal(1)
            for n in (self.order - 1, self.order):
                last = max(abs(row[n]) for row in rows) / size
                if last > 0:
                    span = min(span, 10 ** ((-self.digits - float(last.log10())) / n))
        return Decimal(0.8 * span)

    def _find_change(self, spin, needed, span):
        """Return the first time in the step at which the mode ends, or None."""

        def keeps(t):
            if self.mode:
                return sign_of(evaluate(spin, t)) == self.mode
            return abs(evaluate(needed, t)) <= self.friction

        times = [span * i / SAMPLES for i in range(SAMPLES + 1)]
        for before, after in pairwise(times):
            if not keeps(after):
                for _ in range(4 * self.digits):
                    middle = (before + after) / 2
                    before, after = (middle, after) if keeps(middle) else (before, middle)
                if not before:
                    raise ArithmeticError("friction changes twice at the same time")
                return before
        return None

    def to(self, t):
        """Integrate to the time `t`, and return the attitude and momentum in the space frame."""
        with localcontext() as context:
            context.prec = self.digits + 5
            (goal,) = to_decimals([t])
            direction = sign_of(goal - self.t)
            while self.t != goal:
                if self.friction and self.mode is None:
                    self.mode = 0
                    _, _, spin, needed = self._expand(1)
                    self.mode = self._find_mode(spin[0], needed[0], direction)
                self._step(goal, direction)
            return self.q, turn(self.q, self.m)

    def _step(self, goal, direction):
        q, m, spin, needed = self._expand(self.order)
        remaining, self.steps = goal - self.t, self.steps + 1
        span = min(self._choose_step(q, m), abs(remaining)).copy_sign(remaining)
        change = self._find_change(spin, needed, span) if self.friction else None
        if change is not None:
            span = change
        self.t = goal if span == remaining else self.t + span
        self.q, self.m = (
            normalize([evaluate(row, span) for row in q]),
            [evaluate(row, span) for row in m],
        )
        if change is not None:
            self.stops.append(self.t)
            torque = evaluate(needed, span)
            was_held, self.mode = not self.mode, 0
            if not was_held:
                torque = self._expand(1)[3][0]
            self.mode = (
                -direction * sign_of(torque)
                if was_held
                else self._find_mode(Decimal(0), torque, direction)
            )
