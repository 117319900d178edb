"""The attitudes of any top with 60 digits, by one compiled integrator of heyoka: the truth of what
has 30 digits itself. It takes a scene's doubles as what they are, as kreisel does: the attitude is
a rotation whatever its length, and the moments are those of the principal axes.
"""

import heyoka as hy
import numpy as np

from .equations import NAMES, product

BITS = 220
TOLERANCE = 1e-58


def wide(numbers):
    return np.array([hy.real(float(x), BITS) for x in numbers])


def rates():
    """The seven equations; their parameters are the moments and the lever."""
    variables = hy.make_vars(*NAMES)
    q, w = variables[:4], variables[4:]
    J, lever = [hy.par[i] for i in range(3)], [hy.par[3 + i] for i in range(3)]
    up = [
        2.0 * (q[1] * q[3] - q[0] * q[2]),
        2.0 * (q[2] * q[3] + q[0] * q[1]),
        q[0] * q[0] - q[1] * q[1] - q[2] * q[2] + q[3] * q[3],
    ]
    spinning = [
        ((J[j] - J[k]) * w[j] * w[k] + up[j] * lever[k] - up[k] * lever[j]) / J[i]
        for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1))
    ]
    turning = [0.5 * x for x in product(q, [0.0, *w])]
    return list(zip(variables, turning + spinning, strict=True))


class AnyTop:
    def __init__(self):
        self.top = hy.taylor_adaptive(
            rates(),
            wide((1, 0, 0, 0, 0, 0, 0)),
            tol=hy.real(TOLERANCE, BITS),
            fp_type=hy.real,
            prec=BITS,
            pars=wide([1] * 6),
            compact_mode=True,
        )

    def __call__(self, scene, times):
        """Gives the attitudes, principal axes -> space, at times that go one way from 0."""
        body = scene.body
        q = np.array(product(wide(scene.attitude), wide(body.axes)))
        square = q @ q
        turned = product(product(conjugate(q), [wide([0])[0], *wide(scene.momentum)]), q)
        moments, weight = wide(body.moments), wide([body.mass])[0] * wide([scene.gravity])[0]
        self.top.pars[:] = [*moments, *(weight * wide(body.principal_com))]
        self.top.state[:] = [*unit(q), *(np.array(turned[1:]) / square / moments)]
        self.top.time = wide([0])[0]
        at = []
        for t in times:
            outcome = self.top.propagate_until(wide([t])[0])[0]
            if outcome != hy.taylor_outcome.time_limit:
                raise ArithmeticError(f"heyoka stopped before t = {t}: {outcome}")
            at.append(self.top.state[:4].copy())
        return at


def conjugate(q):
    return [q[0], -q[1], -q[2], -q[3]]


def unit(q):
    return q / (q @ q) ** wide([0.5])[0]


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
        sine, cosine = (turn[1:] @ turn[1:]) ** wide([0.5])[0], abs(float(turn[0]))
        found.append(2.0 * np.arctan2(float(sine), cosine))
    return np.array(found)
