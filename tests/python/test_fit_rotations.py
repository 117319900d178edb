"""Tests of the rotations of fits against scipy and against definitions."""

import numpy as np
import pytest
from kreisel._fit import rotations

Rotation = pytest.importorskip("scipy.spatial.transform").Rotation

RNG = np.random.default_rng(5)
VECTORS = RNG.normal(size=(4, 3))
UNITS = VECTORS / np.linalg.norm(VECTORS, axis=1)[:, None]
ANGLES = (0.0, 1e-12, 1e-8, 3e-5, 2e-4, 0.3, 1.7, 3.1)


def to_scipy(q):
    return Rotation.from_quat(np.roll(q, -1, axis=-1))


def test_the_cross_matrix_is_the_cross_product():
    w = RNG.normal(size=3)
    assert np.allclose(rotations.cross_matrix(VECTORS) @ w, np.cross(VECTORS, w), atol=1e-15)
    assert rotations.cross_matrix(VECTORS[0]).shape == (3, 3)


def test_products_and_inverses_of_quaternions_are_those_of_matrices():
    q = RNG.normal(size=(5, 4))
    q /= np.linalg.norm(q, axis=1)[:, None]
    matrices = to_scipy(q).as_matrix()
    assert np.allclose(rotations.rotation_matrix(q), matrices, atol=1e-15)
    assert np.allclose(rotations.rotation_matrix(q[0]), matrices[0], atol=1e-15)
    product = rotations.multiply_quaternions(q[:1], q)
    assert np.allclose(rotations.rotation_matrix(product), matrices[0] @ matrices, atol=1e-15)
    again = rotations.multiply_quaternions(product, rotations.conjugate_quaternions(q))
    assert np.allclose(again, q[:1], atol=1e-15)
    assert np.allclose(rotations.normalize_quaternion(3.0 * q[2]), q[2], atol=1e-15)


@pytest.mark.parametrize("angle", ANGLES)
def test_rotation_vectors_and_quaternions_are_inverse(angle):
    v = angle * UNITS
    q = rotations.compute_rotation_quaternions(v)
    expected = np.column_stack((np.full(4, np.cos(angle / 2.0)), np.sin(angle / 2.0) * UNITS))
    assert np.allclose(q, expected, rtol=1e-13, atol=1e-30)
    for sign in (1.0, -1.0):
        found = rotations.compute_rotation_vectors(sign * q)
        assert np.allclose(found, v, rtol=1e-13, atol=1e-30)
    assert np.allclose(rotations.compute_rotation_vectors(q[0]), v[0], rtol=1e-13, atol=1e-30)


def test_half_turns_have_length_pi_along_the_quaternion():
    q = np.array(((0.0, 0.6, 0.0, -0.8), (0.0, -1.0, 0.0, 0.0)))
    assert np.allclose(rotations.compute_rotation_vectors(q), np.pi * q[:, 1:], rtol=1e-15)


@pytest.mark.parametrize("angle", [0.0, 1e-9, 0.4, 2.0, 3.1, np.pi])
def test_a_matrix_determines_its_quaternion(angle):
    for axis in UNITS:
        matrix = Rotation.from_rotvec(angle * axis).as_matrix()
        q = rotations.convert_matrix_to_quaternion(matrix)
        assert q[0] >= 0.0 and np.linalg.norm(q) == pytest.approx(1.0, abs=1e-15)
        assert np.allclose(to_scipy(q).as_matrix(), matrix, atol=1e-14)


def test_the_smallest_rotation_takes_the_vertical_to_a_direction():
    directions = np.concatenate((UNITS, np.eye(3), -np.eye(3), [[1e-9, 0.0, 1.0]]))
    q = rotations.compute_rotations_from_vertical(directions)
    assert np.allclose(to_scipy(q).apply((0.0, 0.0, 1.0)), directions, atol=1e-15)
    angles = np.arccos(np.clip(directions[:, 2], -1.0, 1.0))
    assert np.allclose(to_scipy(q).magnitude(), angles, atol=1e-8)
    assert q[-2].tolist() == [0.0, 1.0, 0.0, 0.0] and q[6].tolist() == [1.0, 0.0, 0.0, 0.0]
    assert q[-1, 2] == pytest.approx(0.5e-9, rel=1e-12)


@pytest.mark.parametrize("angle", ANGLES)
def test_the_inverse_jacobian_is_that_of_a_product_of_rotations(angle):
    """Compare log(exp(d) exp(v)) = v + L d with finite differences of rotation vectors."""
    v = angle * UNITS
    inverse = rotations.inverse_left_jacobian(v)
    for k, unit in enumerate(np.eye(3)):
        step = Rotation.from_rotvec(1e-4 * unit)
        ends = [(way * Rotation.from_rotvec(v)).as_rotvec() for way in (step, step.inv())]
        assert np.allclose((ends[0] - ends[1]) / 2e-4, inverse[:, :, k], atol=3e-6)
    # The series 1 - v x / 2 + (v x)^2 / 12 has an error of about |v|^4 / 720.
    if angle < 1.0:
        k = rotations.cross_matrix(v)
        error = inverse - (np.eye(3) - 0.5 * k + k @ k / 12.0)
        assert np.abs(error).max() < angle**4 / 500.0 + 1e-15


def test_angles_are_reduced_to_one_turn():
    angles = np.array((-np.pi, np.pi, 3.5, -3.5, 0.0, 7.0))
    expected = [-np.pi, -np.pi, 3.5 - 2.0 * np.pi, 2.0 * np.pi - 3.5, 0.0, 7.0 - 2.0 * np.pi]
    assert np.allclose(rotations.wrap_angle(angles), expected, atol=1e-14)
