"""The equations of motion as heyoka takes them, in any of its precisions, and where they start.

    J w' = J w x w + (q* e3 q) x lever,    q' = q w / 2        w: angular velocity, seen from the body

Seven equations: attitude and angular velocity (the fastest form for heyoka); or attitude and angular momentum in the
body, which the truth is checked with. Constants are folded in the precision of the run.
"""
import heyoka as hy
import mpmath as mp
import numpy as np

NAMES = ("qw", "qx", "qy", "qz", "a", "b", "c")


def product(p, q):
    (a, b, c, d), (w, x, y, z) = p, q
    return [a * w - b * x - c * y - d * z, a * x + b * w + c * z - d * y,
            a * y - b * z + c * w + d * x, a * z + b * y - c * x + d * w]


def start(problem, form="velocity", digits=40):
    """The unit attitude, and the angular velocity or momentum in the body, as mpmath numbers."""
    with mp.workdps(digits):
        q = [mp.mpf(x) for x in problem.attitude]
        norm = mp.sqrt(sum(x * x for x in q))
        q = [x / norm for x in q]
        back = [q[0]] + [-x for x in q[1:]]
        m = product(product(back, [0, *map(mp.mpf, problem.momentum)]), q)[1:]
        return q + ([x / mp.mpf(J) for x, J in zip(m, problem.inertia)] if form == "velocity" else m)


def in_precision(numbers, fp):
    return np.array([fp(mp.nstr(x, 38)) for x in numbers], dtype=fp)


def system(problem, fp=float, form="velocity"):
    """Equations and start for heyoka.taylor_adaptive."""
    variables = hy.make_vars(*NAMES)
    q, s = variables[:4], variables[4:]                     # s: velocity or momentum, in the body
    J, lever = [fp(x) for x in problem.inertia], [fp(x) for x in problem.lever]
    w = s if form == "velocity" else [s[i] / J[i] for i in range(3)]
    up = [2 * (q[1] * q[3] - q[0] * q[2]), 2 * (q[2] * q[3] + q[0] * q[1]),
          q[0] * q[0] - q[1] * q[1] - q[2] * q[2] + q[3] * q[3]]
    turning = [fp(0.5) * x for x in product(q, [fp(0.0), *w])]
    spinning = []
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        unit = J[i] if form == "velocity" else fp(1.0)
        pair = (J[j] - J[k]) / unit if form == "velocity" else fp(1.0) / J[k] - fp(1.0) / J[j]
        terms = [pair * (s[j] * s[k])]
        terms += [lever[k] / unit * up[j]] if lever[k] != 0 else []
        terms += [-lever[j] / unit * up[k]] if lever[j] != 0 else []
        spinning.append(sum(terms[1:], terms[0]))
    return list(zip(variables, turning + spinning)), in_precision(start(problem, form), fp)
