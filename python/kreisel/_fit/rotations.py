"""Vectorized rotations: exponential map, logarithms, and their derivatives.

Source: Sola, Deray and Atchuthan, A micro Lie theory for state estimation in robotics, 2018
(arXiv:1812.01537).
"""

from __future__ import annotations

import numpy as np

from .._utils.validation import Array

_SMALL = 1e-4  # smaller angles use the limit of the series [rad]


def cross_matrix(v: Array) -> Array:
    """Return the matrices, of shape (..., 3, 3), that map a vector w to v x w."""
    matrix = np.zeros((*v.shape, 3))
    x, y, z = v[..., 0], v[..., 1], v[..., 2]
    matrix[..., 0, 1], matrix[..., 0, 2], matrix[..., 1, 2] = -z, y, -x
    matrix[..., 1, 0], matrix[..., 2, 0], matrix[..., 2, 1] = z, -y, x
    return matrix


def multiply_quaternions(a: Array, b: Array) -> Array:
    """Return the products a b of two arrays of quaternions."""
    aw, ax, ay, az = a[..., 0], a[..., 1], a[..., 2], a[..., 3]
    bw, bx, by, bz = b[..., 0], b[..., 1], b[..., 2], b[..., 3]
    product = np.empty(np.broadcast_shapes(a.shape, b.shape))
    product[..., 0] = aw * bw - ax * bx - ay * by - az * bz
    product[..., 1] = aw * bx + ax * bw + ay * bz - az * by
    product[..., 2] = aw * by - ax * bz + ay * bw + az * bx
    product[..., 3] = aw * bz + ax * by - ay * bx + az * bw
    return product


def conjugate_quaternions(q: Array) -> Array:
    """Return the conjugates of an array of quaternions."""
    conjugate: Array = q * np.array([1.0, -1.0, -1.0, -1.0])
    return conjugate


def normalize_quaternion(q: Array) -> Array:
    unit: Array = q / np.linalg.norm(q)
    return unit


def compute_rotation_quaternions(v: Array) -> Array:
    """Return the unit quaternions that correspond to rotation vectors [rad]."""
    angle = np.sqrt((v * v).sum(axis=-1, keepdims=True))
    return np.concatenate((np.cos(0.5 * angle), 0.5 * np.sinc(angle / (2.0 * np.pi)) * v), axis=-1)


def compute_rotation_vectors(q: Array) -> Array:
    """Return the rotation vectors, of length 0 to pi [rad], that correspond to unit quaternions."""
    q = np.where(q[..., :1] < 0.0, -q, q)
    sine = np.sqrt((q[..., 1:] ** 2).sum(axis=-1, keepdims=True))
    angle = 2.0 * np.arctan2(sine, q[..., :1])
    factor: Array = np.where(sine > 1e-9, angle / np.maximum(sine, 1e-9), 2.0)
    return factor * q[..., 1:]


def rotation_matrix(q: Array) -> Array:
    """Return the rotation matrices that correspond to unit quaternions."""
    w, x, y, z = q[..., 0], q[..., 1], q[..., 2], q[..., 3]
    matrix = np.empty((*q.shape[:-1], 3, 3))
    matrix[..., 0, 0] = 1.0 - 2.0 * (y * y + z * z)
    matrix[..., 1, 1] = 1.0 - 2.0 * (z * z + x * x)
    matrix[..., 2, 2] = 1.0 - 2.0 * (x * x + y * y)
    matrix[..., 0, 1], matrix[..., 1, 0] = 2.0 * (x * y - w * z), 2.0 * (x * y + w * z)
    matrix[..., 0, 2], matrix[..., 2, 0] = 2.0 * (x * z + w * y), 2.0 * (x * z - w * y)
    matrix[..., 1, 2], matrix[..., 2, 1] = 2.0 * (y * z - w * x), 2.0 * (y * z + w * x)
    return matrix


def convert_matrix_to_quaternion(matrix: Array) -> Array:
    """Return the unit quaternion of a rotation matrix.

    The quaternion is an eigenvector of a symmetric matrix; this method is accurate for all rotation
    angles. Source: Bar-Itzhack, Journal of Guidance, Control, and Dynamics 23 (2000) 1085.
    """
    m, k = matrix, np.zeros((4, 4))
    k[0, 0] = np.trace(m)
    k[0, 1:] = k[1:, 0] = m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]
    k[1:, 1:] = m + m.T - np.trace(m) * np.eye(3)
    quaternion: Array = np.linalg.eigh(k)[1][:, -1]
    return quaternion if quaternion[0] >= 0.0 else -quaternion


def compute_rotations_from_vertical(direction: Array) -> Array:
    """Return the quaternions of the smallest rotations that take e3 to the given unit vectors."""
    x, y, z = direction[..., 0], direction[..., 1], direction[..., 2]
    sine = np.hypot(x, y)
    is_vertical = sine == 0.0
    factor = np.arctan2(sine, z) / np.where(is_vertical, 1.0, sine)
    rotations = compute_rotation_quaternions(
        np.stack((-y * factor, x * factor, np.zeros_like(x)), axis=-1)
    )
    rotations[is_vertical & (z < 0.0)] = [0.0, 1.0, 0.0, 0.0]
    return rotations


def inverse_left_jacobian(v: Array) -> Array:
    """Return the matrices L that satisfy log(exp(d) exp(v)) = v + L d for small vectors d."""
    angle = np.sqrt((v * v).sum(axis=-1))[..., None, None]
    k = cross_matrix(v)
    safe = np.maximum(angle, _SMALL)
    factor = 1.0 / safe**2 - 0.5 / (safe * np.tan(0.5 * safe))
    inverse: Array = np.eye(3) - 0.5 * k + np.where(angle > _SMALL, factor, 1.0 / 12.0) * (k @ k)
    return inverse


def wrap_angle(angle: Array) -> Array:
    """Return angles reduced to [-pi, pi) [rad]."""
    return (angle + np.pi) % (2.0 * np.pi) - np.pi
