"""Reference solutions for undamped tops, computed by heyoka in 60-digit arithmetic.

The 60-digit solutions are used to check computations in 30-digit arithmetic. The double-precision
parameters of a scene are taken as exact numbers. A quaternion need not have unit length.
"""

import heyoka as hy
import numpy as np

from .equations import COEFFICIENTS, build_general_system, coefficients_from, product

BITS = 220
TOLERANCE = 1e-58


def to_real(x):
    return hy.real(float(x), BITS)


def to_reals(numbers):
    return np.array([to_real(x) for x in numbers])


class MultiprecisionIntegrator:
    def __init__(self):
        self.top = hy.taylor_adaptive(
            build_general_system(to_real),
            to_reals((1, 0, 0, 0, 0, 0, 0)),
            tol=hy.real(TOLERANCE, BITS),
            fp_type=hy.real,
            prec=BITS,
            pars=to_reals([0] * COEFFICIENTS),
            compact_mode=True,
        )

    def __call__(self, scene, times):
        """Return principal-axis attitudes at `times`, which must be sorted by distance from 0."""
        body = scene.body
        q = np.array(product(to_reals(scene.attitude), to_reals(body.axes)))
        square = q @ q
        momentum = product(product(conjugate(q), [to_real(0), *to_reals(scene.momentum)]), q)
        moments, weight = to_reals(body.moments), to_real(body.mass) * to_real(scene.gravity)
        self.top.pars[:] = coefficients_from(moments, weight * to_reals(body.principal_com))
        self.top.state[:] = [*normalize(q), *(np.array(momentum[1:]) / square / moments)]
        self.top.time = to_real(0)
        attitudes = []
        for t in times:
            outcome = self.top.propagate_until(to_real(t))[0]
            if outcome != hy.taylor_outcome.time_limit:
                raise ArithmeticError(f"heyoka stopped before t = {t}: {outcome}")
            attitudes.append(self.top.state[:4].copy())
        return attitudes


def conjugate(q):
    return [q[0], -q[1], -q[2], -q[3]]


def normalize(q):
    return q / (q @ q) ** to_real(0.5)


def path_attitudes(path):
    """Return the attitudes of the principal axes along a path in multiprecision."""
    low = path.q_low if path.digits in (20, 30) else np.zeros_like(path.q)
    axes = to_reals(path.scene.body.axes)
    return [
        normalize(np.array(product(to_reals(high) + to_reals(rest), axes)))
        for high, rest in zip(path.q, low, strict=True)
    ]


def rotation_angles(one, other):
    """Return the angles [rad] between pairs of attitudes; even small angles are accurate."""
    angles = []
    for p, q in zip(one, other, strict=True):
        turn = np.array(product(conjugate(p), q))
        sine, cosine = (turn[1:] @ turn[1:]) ** to_real(0.5), abs(float(turn[0]))
        angles.append(2.0 * np.arctan2(float(sine), cosine))
    return np.array(angles)
