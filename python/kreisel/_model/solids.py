"""Homogeneous solids that a surface bounds, and the bodies of model files.

The integrals of 1, x and x x^t over a solid are sums over its surface. For a triangle a, b, c of a
mesh, the tetrahedron with the corners 0, a, b, c has the volume v = a . (b x c) / 6, and with
s = a + b + c the integrals v s / 4 and v (a a^t + b b^t + c c^t + s s^t) / 20. For an edge of the
profile of a solid of revolution, the frustum between its ends has the volume pi int r^2 dz, the
integrals pi int r^2 z^k dz of z^k, and the moment (pi / 2) int r^4 dz about the axis.

Both sums are taken about the centre of mass, after a first sum that finds it.
"""

from __future__ import annotations

import math
import os
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from .._utils import arguments
from .._utils.arguments import Array, short_repr
from ..quaternion import multiply

_RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_HEAD = 84  # bytes of a binary STL file before its triangles
_ROUNDING = 1e-15  # relative, of a sum over triangles
_FLAT = 1e-10  # a surface that encloses less than this part of its tetrahedra has no volume


class Solid(NamedTuple):
    """A homogeneous solid of unit density."""

    volume: float
    com: Array  # (3,)
    inertia: Array  # about the centre of mass, of unit mass: (3,) moments or (3, 3)


def read_mesh(mesh: object, scale: object) -> Array:
    """Return the triangles (n, 3, 3) of an array or a file, multiplied by `scale`."""
    factor = arguments.as_positive("scale", scale)
    if isinstance(mesh, str | os.PathLike):
        path = Path(mesh)
        if path.suffix.lower() == ".stl":
            triangles = _parse_stl(path)
        else:
            with arguments.optional_dependency("trimesh"):
                import trimesh
            triangles = np.asarray(trimesh.load_mesh(path).triangles, dtype=np.float64)
    else:
        triangles = arguments.as_array("mesh", mesh, "a file name or an array of triangles")
    if triangles.ndim != 3 or triangles.shape[1:] != (3, 3) or not len(triangles):
        raise ValueError(f"mesh must have the shape (n, 3, 3), not {triangles.shape}")
    if not np.isfinite(triangles).all():
        raise ValueError("mesh must have finite corners")
    return factor * triangles


def _parse_stl(path: Path) -> Array:
    data = path.read_bytes()
    count = int.from_bytes(data[_HEAD - 4 : _HEAD], "little")
    if len(data) == _HEAD + count * _RECORD.itemsize and len(data) > _HEAD:
        return np.frombuffer(data, _RECORD, offset=_HEAD)["corners"].astype(np.float64)
    words = data.split()
    at = [i for i, word in enumerate(words) if word == b"vertex"]
    try:
        corners = np.array([words[i + 1 : i + 4] for i in at], dtype=np.float64)
        return corners.reshape(-(-len(at) // 3) or 1, 3, 3)
    except ValueError:
        raise ValueError(f"{path} is not an STL file, or is cut off") from None


def integrate_mesh(triangles: Array) -> Solid:
    """Integrate over the solid that a closed surface of triangles (n, 3, 3) bounds.

    Raises ValueError if an edge does not belong to two triangles that pass it in opposite
    directions, or if the surface encloses no volume.
    """
    _, names = np.unique(triangles.reshape(-1, 3), axis=0, return_inverse=True)
    corners = names.reshape(-1, 3)
    edges = np.stack((corners, np.roll(corners, -1, axis=1)), axis=-1).reshape(-1, 2)
    edges = edges[edges[:, 0] != edges[:, 1]]
    forward, back = (
        np.sort(edges[:, i].astype(np.int64) * names.size + edges[:, 1 - i]) for i in (0, 1)
    )
    if not np.array_equal(forward, back):
        open_edges = len(np.setxor1d(forward, back)) // 2
        what = f"{open_edges} edges have" if open_edges > 1 else "an edge has"
        raise ValueError(
            f"mesh is not a closed surface with one outside: {what} no triangle on the other side. "
            "Corners that coincide must be equal to the last digit"
        )
    origin = triangles.mean(axis=(0, 1))
    for _ in range(2):
        a, b, c = np.moveaxis(triangles - origin, 1, 0)
        s = a + b + c
        with np.errstate(over="ignore", invalid="ignore"):
            v = (a * np.cross(b, c)).sum(axis=1) / 6.0
        volume = float(v.sum())
        if not _FLAT * np.abs(v).sum() < abs(volume) < math.inf:
            raise ValueError("mesh encloses no volume")
        shift = v @ s / (4.0 * volume)
        origin = origin + shift
    products = sum((x * v[:, None]).T @ x for x in (a, b, c, s)) / (20.0 * volume)
    products = products - np.outer(shift, shift)
    # Rounding errors must not turn the principal axes of a symmetric mesh.
    products = np.where(np.abs(products) < _ROUNDING * np.trace(products), 0.0, products)
    return Solid(
        abs(volume), origin, np.trace(products) * np.eye(3) - 0.5 * (products + products.T)
    )


def integrate_profile(profile: object) -> Solid:
    """Integrate over the solid that a closed polygon of corners (radius, z) makes by revolution.

    Raises ValueError for a negative radius, for edges that cross, and for a polygon without area.
    """
    corners = arguments.as_finite_array("profile", profile, "an array of pairs (radius, z)")
    if corners.ndim != 2 or corners.shape[1:] != (2,) or len(corners) < 3:
        raise ValueError(f"profile must be at least 3 pairs (radius, z), not {short_repr(profile)}")
    if (corners[:, 0] < 0.0).any():
        raise ValueError("profile must not have negative radii")
    _refuse_crossings(corners)
    r, z = corners.T
    q, height = np.roll(r, -1), np.roll(z, -1) - z
    centre = z.mean()
    with np.errstate(over="ignore", invalid="ignore"):
        squares = math.pi * height * (r * r + r * q + q * q) / 3.0
    volume = float(squares.sum())
    if not _FLAT * np.abs(squares).sum() < abs(volume) < math.inf:
        raise ValueError(
            "profile encloses no volume: begin and end on the axis, at radius 0, for a solid, or "
            "go round the section of a ring"
        )
    for _ in range(2):
        y = z - centre
        first = squares * y + math.pi * height**2 * (r * r + 2.0 * r * q + 3.0 * q * q) / 12.0
        shift = float(first.sum()) / volume
        centre += shift
    # int r^2 z^2 dz with z = y + height u and r = r + (q - r) u
    linear, square = r * r + 2.0 * r * q + 3.0 * q * q, r * r + 3.0 * r * q + 6.0 * q * q
    second = y * y * squares + math.pi * height**2 * (y * linear / 6.0 + height * square / 30.0)
    fourth = (r**4 + r**3 * q + r * r * q * q + r * q**3 + q**4) / 5.0
    along = 0.5 * math.pi * float((height * fourth).sum()) / volume
    across = 0.5 * along + float(second.sum()) / volume - shift * shift
    com = np.array([0.0, 0.0, centre])
    return Solid(abs(volume), com, np.array([across, across, along]))


def _refuse_crossings(corners: Array) -> None:
    """Raise ValueError if two edges of a closed polygon cross."""
    ends = np.roll(corners, -1, axis=0)

    def get_side(a: Array, b: Array, p: Array) -> Array:
        along, to = b - a, p - a
        return np.sign(along[..., 0] * to[..., 1] - along[..., 1] * to[..., 0])

    for i, (a, b) in enumerate(zip(corners, ends, strict=True)):
        is_between = get_side(a, b, corners) * get_side(a, b, ends) < 0.0
        is_crossed = get_side(corners, ends, a) * get_side(corners, ends, b) < 0.0
        if (hits := np.flatnonzero(is_between & is_crossed)).size:
            raise ValueError(f"profile crosses itself: its edges {i} and {hits[0]} meet")


class Inertial(NamedTuple):
    """Mass, inertia and place of a link in a model file."""

    mass: float
    inertia: Array  # about the centre of mass, in axes of its own: (3,) moments or (3, 3)
    attitude: tuple[float, float, float, float]  # of these axes in the frame of the link
    com: Array  # (3,), in the frame of the link


def read_model(path: str | os.PathLike[str], name: str | None) -> Inertial:
    """Return the inertial data of a link of a URDF, or of a body of a model of MuJoCo (MJCF).

    Raises ValueError if the file has no body of this name, or several bodies and no name is given,
    or if the body has no inertial data.
    """
    import xml.etree.ElementTree as ElementTree  # imported here to keep `import kreisel` fast

    try:
        root = ElementTree.parse(path).getroot()
    except ElementTree.ParseError as error:
        raise ValueError(f"{path} is neither a URDF nor a model of MuJoCo: {error}") from None
    is_urdf = root.tag == "robot"
    if not is_urdf and root.tag != "mujoco":
        raise ValueError(f"{path} is neither a URDF nor a model of MuJoCo: its root is {root.tag}")
    bodies = {one.get("name", ""): one for one in root.iter("link" if is_urdf else "body")}
    if name is None:
        having = [key for key, one in bodies.items() if one.find("inertial") is not None]
        if len(having) != 1:
            raise ValueError(f"{path} has {len(having)} bodies with inertial data: give a name")
        (name,) = having
    if arguments.validate_type("name", name, str) not in bodies:
        raise ValueError(arguments.unknown_name_message("body", name, bodies))
    inertial = bodies[name].find("inertial")
    if inertial is None:
        raise ValueError(f"{name} in {path} has no inertial data")
    try:
        return _read_urdf(inertial) if is_urdf else _read_mjcf(inertial)
    except (KeyError, ValueError) as error:
        raise ValueError(f"the inertial data of {name} in {path}: {error}") from None


def _read_numbers(element: Any, key: str, n: int, default: str | None = None) -> Array:
    text = None if element is None else element.get(key, default)
    numbers = np.array((text or default or "").split(), dtype=np.float64)
    if numbers.shape != (n,):
        raise ValueError(f"{key} must have {n} numbers, not {text!r}")
    return numbers


def _make_symmetric(xx: float, yy: float, zz: float, xy: float, xz: float, yz: float) -> Array:
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def _read_urdf(inertial: Any) -> Inertial:
    origin, tensor = inertial.find("origin"), inertial.find("inertia")
    mass = float(_read_numbers(inertial.find("mass"), "value", 1)[0])
    keys = "ixx", "iyy", "izz", "ixy", "ixz", "iyz"
    inertia = _make_symmetric(*(float(_read_numbers(tensor, key, 1)[0]) for key in keys))
    com, angles = (_read_numbers(origin, key, 3, "0 0 0") for key in ("xyz", "rpy"))
    # roll, pitch and yaw about the fixed axes x, y and z
    roll, pitch, yaw = (
        (math.cos(angle / 2.0), *(math.sin(angle / 2.0) * axis).tolist())
        for angle, axis in zip(angles.tolist(), np.eye(3), strict=True)
    )
    return Inertial(mass, inertia, multiply(yaw, multiply(pitch, roll)), com)


def _read_mjcf(inertial: Any) -> Inertial:
    for key in "axisangle", "euler", "xyaxes", "zaxis":
        if inertial.get(key) is not None:
            raise ValueError(f"give the orientation as quat, not as {key}")
    mass, com = float(_read_numbers(inertial, "mass", 1)[0]), _read_numbers(inertial, "pos", 3)
    if inertial.get("fullinertia") is not None:
        inertia = _make_symmetric(*_read_numbers(inertial, "fullinertia", 6))
        return Inertial(mass, inertia, (1.0, 0.0, 0.0, 0.0), com)
    q = _read_numbers(inertial, "quat", 4, "1 0 0 0")
    if not (length := np.linalg.norm(q)):
        raise ValueError("quat must not be zero")
    w, x, y, z = (q / length).tolist()
    return Inertial(mass, _read_numbers(inertial, "diaginertia", 3), (w, x, y, z), com)
