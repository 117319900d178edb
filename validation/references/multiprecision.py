"""The attitudes of any top without damping with 60 digits, by one compiled integrator of heyoka:
the truth of what has 30 digits itself. It takes a scene's doubles as what they are, as kreisel
does: the attitude is a rotation whatever its length, and the moments are those of the principal
axes.
"""

import heyoka as hy
import numpy as np

from .equations import COEFFICIENTS, coefficients_of, general, product

BITS = 220
TOLERANCE = 1e-58


def number(x):
    return hy.real(float(x), BITS)


def wide(numbers):
    return np.array([number(x) for x in numbers])


class AnyTop:
    def __init__(self):
        self.top = hy.taylor_adaptive(
            general(number),
            wide((1, 0, 0, 0, 0, 0, 0)),
            tol=hy.real(TOLERANCE, BITS),
            fp_type=hy.real,
            prec=BITS,
            pars=wide([0] * COEFFICIENTS),
            compact_mode=True,
        )

    def __call__(self, scene, times):
        """Gives the attitudes, principal axes -> space, at times that go one way from 0."""
        body = scene.body
        q = np.array(product(wide(scene.attitude), wide(body.axes)))
        square = q @ q
        turned = product(product(conjugate(q), [number(0), *wide(scene.momentum)]), q)
        moments, weight = wide(body.moments), number(body.mass) * number(scene.gravity)
        self.top.pars[:] = coefficients_of(moments, weight * wide(body.principal_com))
        self.top.state[:] = [*unit(q), *(np.array(turned[1:]) / square / moments)]
        self.top.time = number(0)
        at = []
        for t in times:
            outcome = self.top.propagate_until(number(t))[0]
            if outcome != hy.taylor_outcome.time_limit:
                raise ArithmeticError(f"heyoka stopped before t = {t}: {outcome}")
            at.append(self.top.state[:4].copy())
        return at


def conjugate(q):
    return [q[0], -q[1], -q[2], -q[3]]


def unit(q):
    return q / (q @ q) ** number(0.5)


def attitudes(path):
    """Those of a path, principal axes -> space, with what its doubles leave out."""
    low = path.q_low if path.digits in (20, 30) else np.zeros_like(path.q)
    axes = wide(path.scene.body.axes)
    return [
        unit(np.array(product(wide(high) + wide(rest), axes)))
        for high, rest in zip(path.q, low, strict=True)
    ]


def angles(one, other):
    """Gives the angles of the rotations between attitudes [rad], small ones to all digits."""
    found = []
    for p, q in zip(one, other, strict=True):
        turn = np.array(product(conjugate(p), q))
        sine, cosine = (turn[1:] @ turn[1:]) ** number(0.5), abs(float(turn[0]))
        found.append(2.0 * np.arctan2(float(sine), cosine))
    return np.array(found)
