"""Parsing, validation and transformation of inertia tensors."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from .._core import INPUT_RTOL, TENSOR_LEAST
from .._utils.validation import (
    Array,
    Vector,
    as_finite_array,
    as_float,
    as_positive,
    as_three_floats,
    short_repr,
)

_TENSOR_FORM = "3 moments or a symmetric 3x3 matrix"


def validate_inertia_tensor(name: str, value: object) -> Array:
    """Return the 3x3 tensor of inertia described by three moments or a symmetric matrix."""
    tensor = as_finite_array(name, value, _TENSOR_FORM)
    if tensor.shape not in ((3,), (3, 3)):
        raise ValueError(f"{name} must be {_TENSOR_FORM}, not {short_repr(value)}")
    if tensor.ndim == 1:
        return np.diag(tensor)
    with np.errstate(over="ignore"):
        skew = np.abs(tensor - tensor.T).max()
    if skew > INPUT_RTOL * np.abs(tensor).max():
        raise ValueError(f"{name} must be {_TENSOR_FORM}, not {short_repr(value)}")
    return tensor


def convert_tensor_to_moments_or_rows(tensor: Array) -> Vector | tuple[Vector, Vector, Vector]:
    """Return the diagonal elements of a diagonal tensor, and the rows of any other tensor."""
    diagonal = tensor.diagonal()
    if (tensor == np.diag(diagonal)).all():
        i1, i2, i3 = diagonal.tolist()
        return i1, i2, i3
    (a, b, c), (d, e, f), (g, h, i) = tensor.tolist()
    return (a, b, c), (d, e, f), (g, h, i)


def principal_moments(tensor: Array) -> list[float]:
    """Return the principal moments of inertia, which are the eigenvalues of the tensor."""
    diagonal = (tensor == np.diag(tensor.diagonal())).all()
    moments: list[float] = (tensor.diagonal() if diagonal else np.linalg.eigvalsh(tensor)).tolist()
    return moments


def find_ill_conditioned_inertia_error(tensor: Array) -> ValueError | None:
    """Return a ValueError if the least moment of a non-diagonal tensor is too small, else None."""
    least, _, largest = sorted(principal_moments(tensor))
    diagonal = (tensor == np.diag(tensor.diagonal())).all()
    if diagonal or abs(least) >= TENSOR_LEAST * largest:
        return None
    return ValueError(
        f"the smallest principal moment, about {least:.1g}, is less than {TENSOR_LEAST} times the "
        f"largest, {largest:.6g}, so the matrix determines it to fewer than six digits: describe "
        "this body by three moments along its principal axes at the fixed point"
    )


def describe_triangle_violation(tensor: Array, inertia_rtol: float) -> str:
    """Return a description of the condition that the principal moments of inertia violate."""
    moments = principal_moments(tensor)
    least, middle, largest = sorted(moments)
    if not least > 0.0:
        return f"{least!r} is not positive in {moments}"
    excess = largest / (least + middle) - 1.0
    clause = f", with inertia_rtol={inertia_rtol!r}" if inertia_rtol else ""
    hint = (
        f"; inertia_rtol={1.1 * excess:.2g} would accept it" if INPUT_RTOL < excess < 0.01 else ""
    )
    return f"{largest!r} > {least!r} + {middle!r} in {moments}{clause}{hint}"


def describe_unphysical_inertia(mass: float, tensor: Array, com: Vector) -> str:
    """Return a message that explains why no mass distribution has the given inertia."""
    rest = add_point_mass_inertia(tensor, -mass, np.array(com))
    moments = principal_moments(rest) if np.isfinite(rest).all() else [-math.inf]
    return (
        f"no body has this inertia about the fixed point: about its centre of mass the moments "
        f"would be {', '.join(f'{moment:.4g}' for moment in moments)}. Give an inertia about the "
        "centre of mass as inertia_about_com. Pass unphysical=True if mass and com are only "
        "parameters of a model"
    )


def add_point_mass_inertia(tensor: Array, mass: float, lever: Array) -> Array:
    """Add the inertia of a point mass at a = `lever` to a tensor: mass * (|a|^2 1 - a a^t)."""
    with np.errstate(over="ignore", invalid="ignore"):
        products = mass * np.outer(lever, lever)
        xx, yy, zz = products.diagonal()
        np.fill_diagonal(products, 0.0)
        total: Array = tensor + (np.diag((yy + zz, zz + xx, xx + yy)) - products)
    return total


def compute_inertia_displacement_term(mass: float, com: Array, displacement: Array) -> Array:
    """Return the change of the inertia tensor when the body is displaced by `displacement`."""
    with np.errstate(over="ignore", invalid="ignore"):
        outer_product = np.outer(com, displacement)
        products = mass * (outer_product + outer_product.T + np.outer(displacement, displacement))
        term: Array = np.eye(3) * products.trace() - products
    return term


def inertia_at_fixed_point(
    mass: float, inertia: ArrayLike | None, inertia_about_com: ArrayLike | None, com: ArrayLike
) -> Array:
    """Return the tensor of inertia at the fixed point, computed from `inertia_about_com`.

    Raises ValueError if both `inertia` and `inertia_about_com` are given, or neither.
    """
    if (inertia is None) == (inertia_about_com is None):
        correction = "not none" if inertia_about_com is None else "not both"
        raise ValueError(f"give exactly one of inertia and inertia_about_com, {correction}")
    tensor = validate_inertia_tensor("inertia_about_com", inertia_about_com)
    return add_point_mass_inertia(
        tensor, as_positive("mass", mass), np.array(as_three_floats("com", com))
    )


def validate_inertia_tolerance(inertia_rtol: object) -> float:
    """Validate the relative tolerance of the triangle inequality for the principal moments.

    Raises ValueError unless the tolerance is at least 0 and less than 1.
    """
    tolerance = as_float("inertia_rtol", inertia_rtol)
    if not 0.0 <= tolerance < 1.0:
        raise ValueError(
            f"inertia_rtol must be at least 0 and less than 1, not {short_repr(inertia_rtol)}"
        )
    return tolerance
