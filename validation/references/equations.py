"""The equations of motion of a rigid body, in the form that heyoka integrates.

In terms of the angular velocity w in the body frame, the equations are

    J w' = J w x w + (q* e3 q) x lever - D w,    q' = q w / 2

The diagonal matrix D contains the damping coefficients about the principal axes.

Four of the seven equations describe the attitude, and three describe the angular velocity or the
angular momentum. All coefficients are computed with 40 digits and then rounded. The coefficients
can be compiled as constants or passed as parameters. If the coefficients are passed as parameters,
a single compiled integrator can be used for all tops.
"""

import heyoka as hy
import mpmath as mp
import numpy as np

from .quadrature import product

NAMES = ("qw", "qx", "qy", "qz", "a", "b", "c")
COEFFICIENTS, DAMPED_COEFFICIENTS = 12, 15
CYCLE = ((0, 1, 2), (1, 2, 0), (2, 0, 1))


def start_state(problem, form="velocity", digits=40):
    """Return the initial values of the equations of motion in multiprecision."""
    with mp.workdps(digits):
        q = [mp.mpf(x) for x in problem.attitude]
        norm = mp.sqrt(sum(x * x for x in q))
        q = [x / norm for x in q]
        back = [q[0]] + [-x for x in q[1:]]
        m = product(product(back, [0, *map(mp.mpf, problem.momentum)]), q)[1:]
        if form == "velocity":
            m = [x / mp.mpf(J) for x, J in zip(m, problem.inertia, strict=True)]
        return q + m


def round_to(numbers, fp):
    return np.array([fp(mp.nstr(x, 38)) for x in numbers], dtype=fp)


def compute_coefficients(problem, form="velocity", digits=40):
    """Return the coefficients of the equations of motion in multiprecision."""
    with mp.workdps(digits):
        J, lever = [mp.mpf(x) for x in problem.inertia], [mp.mpf(x) for x in problem.lever]
        decay = [mp.mpf(d) / j for d, j in zip(problem.damping, J, strict=True)]
        return coefficients_from(J, lever, form) + (decay if problem.is_damped else [])


def coefficients_from(J, lever, form="velocity"):
    """Return the coefficients of the equations of motion for given moments of inertia."""
    one = J[0] / J[0]
    velocity = form == "velocity"
    to_velocity = [one if velocity else one / x for x in J]
    pairs = [(J[j] - J[k]) / J[i] if velocity else one / J[k] - one / J[j] for i, j, k in CYCLE]
    torque = [x / (J[i] if velocity else one) for i, j, k in CYCLE for x in (lever[k], -lever[j])]
    return to_velocity + pairs + torque


def build_equations(numbers, fp):
    """Return the seven equations of motion as pairs of a variable and its time derivative."""
    variables = hy.make_vars(*NAMES)
    q, s = variables[:4], variables[4:]  # s: velocity or momentum, in the body
    up = [
        2 * (q[1] * q[3] - q[0] * q[2]),
        2 * (q[2] * q[3] + q[0] * q[1]),
        q[0] * q[0] - q[1] * q[1] - q[2] * q[2] + q[3] * q[3],
    ]

    def times(number, expression):
        if isinstance(number, hy.expression):
            return number * expression
        return None if number == 0 else expression if number == 1 else number * expression

    w = [times(numbers[i], s[i]) for i in range(3)]
    turning = [fp(0.5) * x for x in product(q, [fp(0.0), *w])]
    spinning = []
    for i, j, k in CYCLE:
        terms = [
            times(numbers[3 + i], s[j] * s[k]),
            times(numbers[6 + 2 * i], up[j]),
            times(numbers[7 + 2 * i], up[k]),
        ]
        if len(numbers) == DAMPED_COEFFICIENTS:
            terms.append(times(-numbers[COEFFICIENTS + i], s[i]))
        terms = [term for term in terms if term is not None]
        spinning.append(sum(terms[1:], terms[0]) if terms else hy.expression(fp(0.0)))
    return list(zip(variables, turning + spinning, strict=True))


def build_system(problem, fp=float, form="velocity"):
    """Return the equations of motion and the initial values of one top."""
    coefficients = round_to(compute_coefficients(problem, form), fp)
    return build_equations(coefficients, fp), round_to(start_state(problem, form), fp)


def build_general_system(fp, coefficients=COEFFICIENTS):
    """Return the equations of motion with the coefficients as parameters."""
    return build_equations([hy.par[i] for i in range(coefficients)], fp)
