"""Reference solutions for strongly damped tops, by Radau collocation in extended precision.

The angular velocity w, the damping D and the rotor momentum h refer to the principal axes. The
support turns with O and shakes, so that gravity is multiplied by g:

    J w' = (J w + h) x w + g (q* e3 q) x lever - D (w - q* O q),    q' = (q w - O q) / 2
    g = 1 - amplitude rate^2 cos(rate t + phase) / gravity

The integrator is the Radau IIA method of order 17 (Hairer and Wanner, Solving Ordinary Differential
Equations II, section IV.5). The Radau method damps fast modes at any step size, so that steps can
be as long as the slow motion allows. The implicit equations are solved by Newton's method. The
Newton matrices are computed in double precision, and the residuals in extended precision. The step
size is controlled by the last coefficient of a Legendre expansion, which estimates the truncation
error.
"""

from functools import cache

import mpmath as mp
import numpy as np

from .equations import start_state

Real = np.longdouble
STAGES, SIZE = 9, 7
NEWTON_MOST = 12
EPS = float(np.finfo(Real).eps)
GROWTH = 3.0  # largest ratio of successive steps
NEGLIGIBLE = 1e-12
TOL, FINER_TOL = 1e-15, 1e-16
NONE, Z = (0.0, 0.0, 0.0), np.array((0.0, 0.0, 1.0))


@cache
def radau_table():
    """Return the matrix of the Radau method, and the weights of its error estimate.

    The error estimate is the last coefficient of the collocation polynomial in a Legendre
    expansion.
    """
    with mp.workdps(60):
        high, low = legendre_coefficients(STAGES), [*legendre_coefficients(STAGES - 1), 0]
        difference = [a - b for a, b in zip(high, low, strict=True)]
        nodes = sorted(mp.polyroots(difference, maxsteps=200, extraprec=200, asc=True))
        powers = mp.matrix(STAGES)
        integrals = mp.matrix(STAGES)
        for i, x in enumerate(nodes):
            for k in range(STAGES):
                powers[i, k] = x**k
                integrals[i, k] = x ** (k + 1) / (k + 1)
        inverse = powers**-1
        matrix = integrals * inverse
        last = inverse[STAGES - 1, :] / legendre_coefficients(STAGES - 1)[-1]
        return (
            np.array([[real(matrix[i, j]) for j in range(STAGES)] for i in range(STAGES)]),
            np.array([real(last[j]) for j in range(STAGES)]),
        )


def legendre_coefficients(n):
    """Return the coefficients of the shifted Legendre polynomial P_n(2x - 1) in ascending order."""
    return [(-1) ** (n + k) * mp.binomial(n, k) * mp.binomial(n + k, k) for k in range(n + 1)]


def real(x):
    """Round a multiprecision number to extended precision."""
    return Real(mp.nstr(x, 25))


class TopEquations:
    """The equations of motion for the attitude q and the angular velocity w."""

    def __init__(self, problem, rotor=NONE, turning=NONE, shaking=NONE):
        self.turning, self.shaking = np.array(turning, Real), np.array(shaking, Real)
        self.rotor = np.array(rotor, Real)
        self.inertia = np.array(problem.inertia, Real)
        self.lever = np.array(problem.lever, Real)
        self.damping = np.array(problem.damping, Real)
        self.start = np.array([real(x) for x in start_state(problem)])
        self.start[4:] -= self.rotor / self.inertia
        self.up_forms, self.turning_forms = (
            derive_fixed_in_space(np.array(v, float)) for v in (Z, turning)
        )

    def levers(self, times):
        """Return the lever arm times the ratio of apparent to constant gravity at each time."""
        amplitude, rate, phase = self.shaking
        return np.outer(1 - amplitude * rate**2 * np.cos(rate * times + phase), self.lever)

    def rates(self, states, times):
        """Return the time derivatives of `states` at `times`, with shape (n, 7)."""
        q, w = states[:, :4], states[:, 4:]
        own = self.inertia * w + self.rotor
        torque = cross(own, w) + cross(fixed_in_space(q, Z), self.levers(times))
        torque -= self.damping * (w - fixed_in_space(q, self.turning))
        turn = np.empty_like(q)
        turn[:, 0] = -(q[:, 1:] * (w - self.turning)).sum(1)
        turn[:, 1:] = q[:, :1] * (w - self.turning) + cross(q[:, 1:], w + self.turning)
        return np.concatenate([turn / 2, torque / self.inertia], axis=1)

    def jacobians(self, states, times):
        """Return the Jacobian matrices of the time derivatives, with shape (n, 7, 7)."""
        states, turning = states.astype(float), self.turning.astype(float)
        inertia, damping = self.inertia.astype(float), self.damping.astype(float)
        levers = self.levers(times).astype(float)
        matrices = np.zeros((len(states), SIZE, SIZE))
        q, w = states[:, :4], states[:, 4:]
        up, own = ((q @ forms).reshape(-1, 4, 3) for forms in (self.up_forms, self.turning_forms))
        torque = cross(up, levers[:, None]) + damping * own
        matrices[:, 4:, :4] = (torque / inertia).transpose(0, 2, 1)
        matrices[:, 0, 1:4], matrices[:, 1:4, 0] = (turning - w) / 2, (w - turning) / 2
        matrices[:, 1:4, 1:4] = -cross_matrix(w + turning) / 2
        matrices[:, 0, 4:] = -q[:, 1:] / 2
        matrices[:, 1:4, 4:] = (q[:, :1, None] * np.eye(3) + cross_matrix(q[:, 1:])) / 2
        push = cross_matrix(inertia * w + self.rotor.astype(float)) - cross_matrix(w) * inertia
        matrices[:, 4:, 4:] = (push - np.diag(damping)) / inertia[:, None]
        return matrices


def cross(a, b):
    """Return the cross products of vectors, faster than numpy.cross for few vectors."""
    return a[..., [1, 2, 0]] * b[..., [2, 0, 1]] - a[..., [2, 0, 1]] * b[..., [1, 2, 0]]


def fixed_in_space(q, v):
    """Return q* v q for quaternions of any length."""
    size = (q[:, :1] ** 2 - (q[:, 1:] ** 2).sum(1)[:, None]) * v
    projection = 2 * (q[:, 1:] @ v)[:, None] * q[:, 1:]
    return size + projection - 2 * q[:, :1] * cross(q[:, 1:], v)


def derive_fixed_in_space(v):
    """Return a matrix whose product with q is the derivative of q* v q, with shape (4, 12)."""
    unit = np.eye(4)
    central = [  # exact, because q* v q is of degree two in q
        (fixed_in_space(unit + step, v) - fixed_in_space(unit - step, v)) / 2 for step in unit
    ]
    return np.hstack(central)


def cross_matrix(v):
    """Return the matrices of the cross products with the vectors `v`."""
    matrices = np.zeros((len(v), 3, 3))
    matrices[:, 0, 1], matrices[:, 0, 2], matrices[:, 1, 2] = -v[:, 2], v[:, 1], -v[:, 0]
    return matrices - matrices.transpose(0, 2, 1)


def solve_stages(top, start, t, step):
    """Return the states at the Radau nodes of a step, or None if Newton's method fails."""
    matrix, _ = radau_table()
    times = t + step * matrix.sum(1)
    stages = np.tile(start, (STAGES, 1))
    before = np.inf
    for _ in range(NEWTON_MOST):
        slopes = top.rates(stages, times)
        residual = start + step * (matrix @ slopes) - stages
        blocks = top.jacobians(stages, times)
        system = np.eye(STAGES * SIZE) - float(step) * np.einsum(
            "ij,jab->iajb", matrix.astype(float), blocks
        ).reshape(STAGES * SIZE, STAGES * SIZE)
        rows = 1 / np.abs(system).max(axis=1)
        change = np.linalg.solve(rows[:, None] * system, rows * residual.ravel().astype(float))
        stages = stages + change.reshape(STAGES, SIZE)
        size = np.abs(change.reshape(STAGES, SIZE)[:, :4]).max()
        if size < 4 * EPS or (before < 1e-15 and size >= before / 2):
            return stages
        before = size
    return None


def first_step(top):
    """Return an initial step size that resolves the fastest mode."""
    rate = np.abs(top.start[4:]).max() + (top.damping / top.inertia).max()
    fall = np.sqrt(np.abs(top.lever).max() / top.inertia.max())
    return Real(0.1) / max(rate, fall)


def integrate(problem, times, tol=TOL, **effects):
    """Return attitudes (n, 4) and body-frame momenta (n, 3) at positive times in ascending order.

    The argument `tol` limits the relative truncation error of each step. The optional keyword
    arguments are the angular momentum `rotor` of a rotor, the angular velocity `turning` of the
    support, and `shaking`. The tuple `shaking` contains the ratio of amplitude to gravity, the rate
    and the phase. Raises ArithmeticError if the step size becomes too small.
    """
    top, (_, last) = TopEquations(problem, **effects), radau_table()
    state, t, step, states = top.start, Real(0), first_step(top), []
    for end in map(Real, times):
        while t < end:
            h = min(step, end - t)
            stages = solve_stages(top, state, t, h)
            error = np.inf if stages is None else truncation_size(top, last @ stages, stages)
            if error > tol:
                step = (
                    h / 4 if stages is None else h * max(0.2, 0.8 * (tol / error) ** (1 / STAGES))
                )
                if t + step == t:
                    raise ArithmeticError(f"no step is small enough at t = {float(t):g}")
                continue
            state, t = stages[-1], t + h if h < end - t else end
            growth = 0.8 * (tol / max(error, 1e-30)) ** (1 / STAGES)
            step = max(step, h * min(GROWTH, growth)) if h < step else h * min(GROWTH, growth)
        q = state[:4] / np.sqrt((state[:4] ** 2).sum())
        states.append(np.concatenate([q, state[4:] * top.inertia + top.rotor]))
    return np.array(states)[:, :4], np.array(states)[:, 4:]


def truncation_size(top, term, stages):
    """Return the truncation error of a step relative to the size of the state.

    Errors are not measured relative to an angular velocity that has decayed almost to zero.
    """
    least = max(NEGLIGIBLE * np.abs(top.start[4:]).max(), 1e-300)
    scale = max(np.abs(stages[:, 4:]).max(), least)
    return float(max(np.abs(term[:4]).max(), np.abs(term[4:]).max() / scale))
