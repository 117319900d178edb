"""The Lie algebra su(2), the group SU(2), and theorem 4.2 in the notation of the thesis."""

import numpy as np

from .trajectories import solve_truth

ID = np.eye(2, dtype=complex)
E1 = 0.5 * np.array([[0, -1j], [-1j, 0]])
E2 = 0.5 * np.array([[0, -1], [1, 0]], dtype=complex)
E3 = 0.5 * np.array([[-1j, 0], [0, 1j]])
BASIS = (E1, E2, E3)


def to_matrix(x):
    """Return the matrix in su(2) that represents a vector."""
    return x[0] * E1 + x[1] * E2 + x[2] * E3


def to_vector(X):
    """Return the vector of a matrix X in su(2), whose components are -2 tr(X e_i)."""
    return np.array([-2 * np.trace(X @ e).real for e in BASIS])


def rotate(Phi, x):
    """Return the vector of the su(2) matrix Phi^-1 X Phi, where X is the su(2) matrix of `x`."""
    return to_vector(np.linalg.inv(Phi) @ to_matrix(x) @ Phi)


def rotation_matrix(axis, angle):
    """Return Phi of theorem 3.4, with the omitted factor 2: Phi^-1 X Phi turns X by -angle."""
    return np.cos(angle / 2) * ID + 2 * np.sin(angle / 2) * to_matrix(axis)


def to_quaternion(G):
    """Convert a matrix w Id + 2 hat(x, y, z) to the quaternion (w, x, y, z)."""
    return np.array([np.trace(G).real / 2, *(to_vector(G) / 2)])


def from_quaternion(q):
    return q[0] * ID + 2 * to_matrix(q[1:])


def compute_xi(form, m, a, b, c, alpha, eps, second=None):
    """Return xi_k of theorem 4.2 from m = m_(k+1), a = a_k and b = a_(k+1)."""
    middle = (b + a) / (1 + a @ b)
    if form == 1:
        return m + c * (1 - alpha) / alpha * middle
    factor = 2 / eps if second is None else second
    return factor * np.cross(a, b) / (1 + a @ b) + c / alpha * middle


def make_step(m, a, eps, g):
    """Return m and a after one step of the map in theorem 4.1, with p = g e3."""
    m = m + eps * np.cross((0.0, 0.0, g), a)
    X = ID + eps * to_matrix(m)
    return m, to_vector(X @ to_matrix(a) @ np.linalg.inv(X))


def run_theorem42(scaled, eps, end, c_of="a", side="left", form=1):
    """Return the final attitude computed with theorem 4.2 of the thesis.

    `c_of` names the vector in the formula for c: 'p' as printed, or 'a' as corrected. `side` tells
    from where g is multiplied by w_k; if it is 'inverse', g rotates from space to body.
    """
    alpha = scaled.body.moments[2]
    g = scaled.body.mass * scaled.gravity
    G, m = from_quaternion(np.array(scaled.attitude)), np.array(scaled.momentum)
    a = to_vector(G @ E3 @ np.linalg.inv(G))
    if side == "inverse":
        G = np.linalg.inv(G)
    for _ in range(round(end / eps)):
        before = a
        m, a = make_step(m, a, eps, g)
        c = m @ before if c_of == "a" else g * m[2]
        w = ID + eps * to_matrix(compute_xi(form, m, before, a, c, alpha, eps))
        w = w / np.sqrt(np.linalg.det(w).real)
        G = G @ w if side == "right" else w @ G
    return to_quaternion(np.linalg.inv(G) if side == "inverse" else G)


def exact_attitude(scene, end):
    """Return the exact final attitude as a quaternion (w, x, y, z)."""
    return solve_truth(scene, [end]).path.q[-1]
