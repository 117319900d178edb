"""Arrays of unit quaternions (w, x, y, z), rotation vectors [rad] and rotation matrices."""

from __future__ import annotations

import numpy as np

from .. import quaternion
from .._utils.arguments import Array

_SMALL = 1e-4  # smaller angles use the limit of the series [rad]
UNTURNED = np.array([1.0, 0.0, 0.0, 0.0])


def cross(v: Array) -> Array:
    """Return the matrices, of shape (..., 3, 3), that map a vector w to v x w."""
    matrix = np.zeros((*v.shape, 3))
    x, y, z = v[..., 0], v[..., 1], v[..., 2]
    matrix[..., 0, 1], matrix[..., 0, 2], matrix[..., 1, 2] = -z, y, -x
    matrix[..., 1, 0], matrix[..., 2, 0], matrix[..., 2, 1] = z, -y, x
    return matrix


def multiply(a: Array, b: Array) -> Array:
    first, second = (tuple(np.moveaxis(q, -1, 0)) for q in (a, b))
    product: Array = np.stack(quaternion.multiply(first, second), axis=-1)
    return product


def conjugate(q: Array) -> Array:
    conjugated: Array = q * np.array([1.0, -1.0, -1.0, -1.0])
    return conjugated


def normalize(vectors: Array) -> Array:
    """Return vectors or quaternions divided by their lengths."""
    unit: Array = vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
    return unit


def turn(q: Array, v: Array) -> Array:
    """Return unit quaternions, turned in their own frames by the rotation vectors v."""
    return normalize(multiply(q, from_vector(v)))


def from_vector(v: Array) -> Array:
    angle = np.sqrt((v * v).sum(axis=-1, keepdims=True))
    return np.concatenate((np.cos(0.5 * angle), 0.5 * np.sinc(angle / (2.0 * np.pi)) * v), axis=-1)


def to_vector(q: Array) -> Array:
    """Return the rotation vectors, of length 0 to pi."""
    q = np.where(q[..., :1] < 0.0, -q, q)
    sine = np.sqrt((q[..., 1:] ** 2).sum(axis=-1, keepdims=True))
    angle = 2.0 * np.arctan2(sine, q[..., :1])
    factor: Array = np.where(sine > 1e-9, angle / np.maximum(sine, 1e-9), 2.0)
    return factor * q[..., 1:]


def difference(a: Array, b: Array) -> Array:
    """Return the rotation vectors, in the frames of a, that turn the attitudes a into b."""
    return to_vector(multiply(conjugate(a), b))


def to_matrix(q: Array) -> Array:
    k = cross(q[..., 1:])
    matrix: Array = np.eye(3) + 2.0 * (q[..., :1, None] * k + k @ k)
    return matrix


def from_matrix(m: Array) -> Array:
    """Return the unit quaternion of one matrix, accurately for all angles.

    Source: Bar-Itzhack, Journal of Guidance, Control, and Dynamics 23 (2000) 1085.
    """
    k = np.zeros((4, 4))
    k[0, 1:] = k[1:, 0] = m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]
    k[0, 0], k[1:, 1:] = np.trace(m), m + m.T - np.trace(m) * np.eye(3)
    q: Array = np.linalg.eigh(k)[1][:, -1]
    return q if q[0] >= 0.0 else -q


def from_vertical(direction: Array) -> Array:
    """Return the smallest rotations that take e3 to the given unit vectors."""
    x, y, z = np.moveaxis(direction, -1, 0)
    q = np.stack((1.0 + z, -y, x, np.zeros_like(x)), axis=-1)
    q[np.linalg.norm(q, axis=-1) < 1e-12] = [0.0, 1.0, 0.0, 0.0]
    return normalize(q)


def inverse_left_jacobian(v: Array) -> Array:
    """Return the matrices L that satisfy log(exp(d) exp(v)) = v + L d for small vectors d."""
    angle = np.sqrt((v * v).sum(axis=-1))[..., None, None]
    k = cross(v)
    safe = np.maximum(angle, _SMALL)
    factor = 1.0 / safe**2 - 0.5 / (safe * np.tan(0.5 * safe))
    inverse: Array = np.eye(3) - 0.5 * k + np.where(angle > _SMALL, factor, 1.0 / 12.0) * (k @ k)
    return inverse


def wrap(angle: Array) -> Array:
    """Return angles reduced to [-pi, pi)."""
    return (angle + np.pi) % (2.0 * np.pi) - np.pi
