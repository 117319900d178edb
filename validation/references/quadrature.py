"""Closed-form solutions of Lagrange and Euler tops by multiprecision quadrature.

The computation is independent of csrc/exact, which uses theta functions. The motion of the axis is
given by Jacobi's elliptic functions. The remaining Euler angles are computed from elliptic
integrals of the third kind. Elliptic integrals are computed from Carlson's functions R_F and R_J.
The number of digits is sufficient even if two roots of the cubic polynomial under the square root
nearly coincide.
"""

import mpmath as mp

DIGITS = 50


def product(p, q):
    w, x, y, z = p
    a, b, c, d = q
    return [
        w * a - x * b - y * c - z * d,
        w * b + x * a + y * d - z * c,
        w * c - x * d + y * a + z * b,
        w * d + x * c - y * b + z * a,
    ]


def conjugate(q):
    return [q[0], -q[1], -q[2], -q[3]]


def rotate(q, v):
    """Rotate the vector v by the unit quaternion q."""
    return product(product(q, [0, *v]), conjugate(q))[1:]


def dot(a, b):
    return sum(x * y for x, y in zip(a, b, strict=True))


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def normalize(q):
    q = [mp.mpf(x) for x in q]
    norm = mp.sqrt(dot(q, q))
    return [x / norm for x in q]


def attitude_of_axes(n, b, t):
    """Return the attitude in which the body axes point in the directions n, b and t."""
    sizes = [
        1 + n[0] + b[1] + t[2],
        1 + n[0] - b[1] - t[2],
        1 - n[0] + b[1] - t[2],
        1 - n[0] - b[1] + t[2],
    ]
    rows = [
        [sizes[0], b[2] - t[1], t[0] - n[2], n[1] - b[0]],
        [b[2] - t[1], sizes[1], n[1] + b[0], n[2] + t[0]],
        [t[0] - n[2], n[1] + b[0], sizes[2], b[2] + t[1]],
        [n[1] - b[0], n[2] + t[0], b[2] + t[1], sizes[3]],
    ]
    return normalize(max(zip(sizes, rows, strict=True), key=lambda row: row[0])[1])


def cubic_roots(c2, c1, c0, digits=DIGITS):
    """Return the three real roots of x^3 + c2 x^2 + c1 x + c0 in ascending order."""
    with mp.workdps(3 * digits):
        p, q = c1 - c2**2 / 3, c2 * (2 * c2**2 - 9 * c1) / 27 + c0
        size = 2 * mp.sqrt(max(-p / 3, 0))
        angle = mp.acos(min(1, max(-1, 3 * q / (p * size)))) / 3 if size else mp.mpf(0)
        return sorted(size * mp.cos(angle - 2 * mp.pi * k / 3) - c2 / 3 for k in range(3))


class Quadrature:
    """Integrals of rational functions of sn^2, where sn is one of Jacobi's elliptic functions.

    The argument x is scaled so that sn has the period 4 K.
    """

    def __init__(self, k2, v0, rising):
        self.k2, self.quarter, self.nome, self.known = k2, mp.ellipk(k2), mp.qfrom(m=k2), {}
        self.start = mp.sqrt(v0) * mp.elliprf(1 - v0, 1 - k2 * v0, 1) * (1 if rising else -1)

    def functions(self, x):
        """Return sn, cn and dn at start + x, and the integer n nearest to (start + x) / (2 K).

        The argument is reduced by start + x = x' + 2 n K with |x'| <= K.
        """
        x += self.start
        n = int(mp.nint(x / (2 * self.quarter)))
        rest, sign = x - 2 * n * self.quarter, -1 if n % 2 else 1
        sn, cn, dn = (mp.ellipfun(f, rest, q=self.nome) for f in ("sn", "cn", "dn"))
        return sign * sn, sign * abs(cn), dn, n  # cn >= 0 for |x'| <= K, in spite of rounding

    def third(self, x, a, b):
        """Integrate dx / (a + b sn^2) from the initial value to x, where a > 0 and a + b > 0."""

        def incomplete(s, c, d):
            s2 = s * s
            return (
                s
                / a
                * (
                    mp.elliprf(c * c, d * d, 1)
                    - b / a * s2 / 3 * mp.elliprj(c * c, d * d, 1, 1 + b / a * s2)
                )
            )

        if (a, b) not in self.known:
            whole = (
                2
                / a
                * (
                    mp.elliprf(0, 1 - self.k2, 1)
                    - b / a / 3 * mp.elliprj(0, 1 - self.k2, 1, 1 + b / a)
                )
            )
            self.known[a, b] = whole, incomplete(*self.functions(mp.mpf(0))[:3])
        whole, start = self.known[a, b]
        sn, cn, dn, n = self.functions(x)
        sign = -1 if n % 2 else 1
        return incomplete(sign * sn, sign * cn, dn) - start + n * whole


class Lagrange:
    """The motion of a Lagrange top as a function of time.

    The symmetry axis and the centre of mass lie along the third body axis, and lever = mass *
    gravity * com. The symmetry axis must not rest in a vertical position.
    """

    def __init__(self, i1, i3, lever, q, m, digits=DIGITS):
        self.digits = digits
        with mp.workdps(digits):
            self.i1, self.i3, self.lower_bound = mp.mpf(i1), mp.mpf(i3), lever < 0
            q, m = normalize(q), [mp.mpf(x) for x in m]
            if self.lower_bound:
                q, m = product([0, 1, 0, 0], q), [m[0], -m[1], -m[2]]
            self.q, self.m = q, m
            self.g = 2 * abs(mp.mpf(lever)) / self.i1
            self._integrals()

    def _integrals(self):
        a, w = rotate(self.q, [0, 0, 1]), [x / self.i1 for x in self.m]
        self.wz, self.w3, u = w[2], dot(w, a), a[2]
        self.climb = cross(w, a)[2]
        e = dot(w, w) + self.g * u
        if self.g:  # u'^2 = (e - g u - w3^2)(1 - u^2) - (wz - w3 u)^2, a cubic in u over g
            with mp.workdps(3 * self.digits):
                h, g = e - self.w3**2, self.g
                u1, u2, u3 = cubic_roots(
                    -(h + self.w3**2) / g,
                    (2 * self.wz * self.w3 - g) / g,
                    (h - self.wz**2) / g,
                    self.digits,
                )
                self.u1, self.d, self.g31, k2 = u1, u2 - u1, g * (u3 - u1), (u2 - u1) / (u3 - u1)
                v = min(1, max(0, (u - u1) / self.d)) if self.d else mp.mpf(0)
        else:
            square = dot(w, w)
            middle, half = (
                self.wz * self.w3 / square,
                mp.sqrt((1 - self.w3**2 / square) * (1 - self.wz**2 / square)),
            )
            self.u1, self.d, self.g31, k2 = middle - half, 2 * half, square, mp.mpf(0)
            v = min(1, max(0, (u - self.u1) / self.d))
        self.rate, self.curve = mp.sqrt(self.g31) / 2, Quadrature(k2, v, self.climb >= 0)
        (w, x, y, z), (dw, dx, dy, dz) = (
            self.q,
            product([0, *(c / 2 for c in self.m)], self.q),
        )  # the direction of motion at a pole
        self.phases = [
            mp.arg(mp.mpc(w, z) or mp.mpc(dw, dz)),
            mp.arg(mp.mpc(x, y) or mp.mpc(dx, dy)),
        ]

    def _integrate_angle(self, x, weight, a, b, at_bottom):
        """Integrate weight / (2 rate (a + b sn^2)) from the initial value to `x`.

        If `weight` is zero, the angle is constant, except that it jumps by half a turn whenever the
        axis passes through the vertical. Only half-turn jumps after the initial time are added to
        the angle.
        """
        if weight:
            return weight / (2 * self.rate) * self.curve.third(x, a, b)
        start, end = (
            y / (2 * self.curve.quarter) for y in (self.curve.start, self.curve.start + x)
        )
        if abs(a if at_bottom else a + b) > mp.mpf(10) ** (5 - self.digits):
            return mp.mpf(0)  # the pole is not reached
        shift = mp.mpf(10) ** -10 - (0 if at_bottom else mp.mpf(1) / 2)
        return mp.pi * (mp.floor(end + shift) - mp.floor(start + shift))

    def __call__(self, t):
        """Return the attitude and the momentum at time `t`.

        The symmetry axis must not be vertical at this time.
        """
        with mp.workdps(self.digits):
            x = self.rate * mp.mpf(t)
            sn, cn, dn, _ = self.curve.functions(x)
            plus, minus = 1 + self.u1 + self.d * sn**2, 1 - self.u1 - self.d * sn**2
            spin = (self.i1 / self.i3 - 1) * self.w3 / 2 * mp.mpf(t)
            first = self._integrate_angle(x, self.wz + self.w3, 1 + self.u1, self.d, True)
            second = self._integrate_angle(x, self.wz - self.w3, 1 - self.u1, -self.d, False)
            alpha = mp.sqrt(plus / 2) * mp.expj(self.phases[0] + first + spin)
            beta = mp.sqrt(minus / 2) * mp.expj(self.phases[1] + second - spin)
            m = self._momentum(alpha, beta, 2 * self.d * sn * cn * dn * self.rate)
            q = [alpha.real, beta.real, beta.imag, alpha.imag]
            return (product([0, -1, 0, 0], q), [m[0], -m[1], -m[2]]) if self.lower_bound else (q, m)

    def _momentum(self, alpha, beta, climb):
        u, apex_xy = abs(alpha) ** 2 - abs(beta) ** 2, mp.mpc(0, -2) * alpha * beta
        horizontal = mp.mpc(self.w3 - self.wz * u, -climb) / (1 - u * u) * apex_xy
        return [self.i1 * horizontal.real, self.i1 * horizontal.imag, self.i1 * self.wz]


class Euler:
    """The motion of a free asymmetric body as a function of time.

    The motion must not be a permanent rotation. More digits are needed if the axis of rotation is
    close to the intermediate principal axis.
    """

    def __init__(self, inertia, q, m, digits=DIGITS):
        self.digits = digits
        with mp.workdps(digits):
            self.q, self.m = normalize(q), [mp.mpf(x) for x in m]
            self.size = mp.sqrt(dot(self.m, self.m))
            body = rotate(conjugate(self.q), self.m)
            self._order_axes([mp.mpf(x) for x in inertia], body)
            w, x, y, z = [
                self.m[2] + self.size,
                self.m[1],
                -self.m[0],
                mp.mpf(0),
            ]  # a rotation that takes m to e3
            self.upright = (
                normalize([w, x, y, z]) if w else [mp.mpf(0), mp.mpf(1), mp.mpf(0), mp.mpf(0)]
            )
            self._integrals(rotate(conjugate(self.relabel), body))

    def _order_axes(self, inertia, body):
        """Order the axes so that the second has the intermediate moment of inertia and M3 >= 0.

        The attribute `relabel` is the rotation from the axes in this order to the original body
        axes.
        """
        low, middle, high = sorted(range(3), key=lambda i: inertia[i])
        excess = sum(body[i] ** 2 / inertia[i] * (inertia[middle] - inertia[i]) for i in range(3))
        first, third = (low, high) if excess < 0 else (high, low)
        sign = 1 if body[third] >= 0 else -1
        second, axis = (
            [int(i == middle) for i in range(3)],
            [sign * int(i == third) for i in range(3)],
        )
        self.inertia = [inertia[first], inertia[middle], inertia[third]]
        self.relabel = attitude_of_axes(cross(second, axis), second, axis)

    def _integrals(self, body):
        one, two, three = self.inertia
        twice = sum(x * x / i for x, i in zip(body, self.inertia, strict=True))
        d3, d1 = abs(twice * three - self.size**2), abs(self.size**2 - twice * one)
        self.most = [
            mp.sqrt(one * d3 / abs(three - one)),
            mp.sqrt(two * d3 / abs(three - two)),
            mp.sqrt(three * d1 / abs(three - one)),
        ]
        k2 = abs(two - one) * d3 / (abs(three - two) * d1)
        self.rate = mp.sqrt(abs(three - two) * d1 / (one * two * three))
        # M1, M2 and M3 are cn, way * sn and dn, each multiplied by its maximum
        self.way = 1 if three > one else -1
        v = min(1, (body[1] / self.most[1]) ** 2)
        self.turned = body[0] < 0  # shift by half a period: M1, M2 -> -M1, -M2
        sign = -1 if self.turned else 1
        self.curve = Quadrature(k2, v, sign * self.way * body[1] >= 0)
        self.base = self.size / three
        self.extra = self.size * (twice - self.size**2 / three)
        self.start = self._angles(mp.mpf(0))

    def _angles(self, t):
        """Return the attitude relative to the angular momentum, and half the precession angle."""
        x = self.rate * mp.mpf(t)
        sn, cn, dn, n = self.curve.functions(x)
        even = -1 if n % 2 else 1
        sign = -1 if self.turned else 1
        body = [sign * self.most[0] * cn, sign * self.way * self.most[1] * sn, self.most[2] * dn]
        square = self.size**2 - self.most[2] ** 2
        angle = self.base * mp.mpf(t) + self.extra / self.rate * self.curve.third(
            x, square, self.most[2] ** 2 * self.curve.k2
        )
        tilt = mp.atan2(mp.hypot(body[0], body[1]), body[2]) / 2
        spin = (
            mp.arg(mp.mpc(even * body[1], even * body[0])) / 2 - self.way * n * mp.pi / 2
        )  # continuous in time
        return product(
            [mp.cos(tilt), mp.sin(tilt), 0, 0], [mp.cos(spin), 0, 0, mp.sin(spin)]
        ), angle / 2

    def __call__(self, t):
        with mp.workdps(self.digits):
            rotation, angle = self._angles(t)
            first = product(
                product(self.upright, product(self.q, self.relabel)), conjugate(self.start[0])
            )  # a first rotation about e3
            q = product([mp.cos(angle), 0, 0, mp.sin(angle)], product(first, rotation))
            return product(product(conjugate(self.upright), q), conjugate(self.relabel)), self.m
