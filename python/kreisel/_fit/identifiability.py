"""Descriptions of parameter changes that the measurements cannot detect.

A list of known symmetries is compared with the directions in parameter space that leave all
residuals unchanged. A direction that belongs to no symmetry is described by its largest
components.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from .._core import values
from .._utils.validation import Array
from .parameters import FitPoint, FreeParameters
from .rotations import rotation_matrix

_ALIKE = 0.999  # cosine from which a generator lies in the blind directions
_LARGEST = 4  # components that describe an unknown direction
_SMALL = 0.1  # smaller components are not described
_ROUNDING = 1e-4
_LEVEL = 1e-3  # horizontal part of an angular velocity that a heading turns, relative to its size

Blocks = Mapping[str, Array]


def describe_undetermined_directions(
    parameters: FreeParameters, point: FitPoint, natural: Array, blind: Array, names: list[str]
) -> tuple[str, ...]:
    """Describe each direction in parameter space that the residuals do not determine."""
    sentences: list[str] = []
    basis, described = blind, np.zeros((blind.shape[0], 0))
    for sentence, change in _yield_unobservable_changes(parameters, point):
        if not basis.shape[1]:
            break
        length = float(np.linalg.norm(change / natural))
        if not length > _ROUNDING**2:
            continue
        unit = change / natural / length
        # A symmetry near to a described one, as of a nearly upright top, needs its own direction.
        rest = unit - described @ (described.T @ unit)
        rest_length = float(np.linalg.norm(rest))
        coords = basis.T @ unit
        is_apart = np.linalg.norm(coords) > max(_ROUNDING, _ALIKE * rest_length)
        if np.linalg.norm(blind.T @ unit) > _ALIKE and is_apart:
            sentences += [sentence] if sentence not in sentences else []
            coords /= np.linalg.norm(coords)
            described = np.column_stack((described, basis @ coords))
            complement = np.linalg.svd(np.eye(len(coords)) - np.outer(coords, coords))[0]
            basis = basis @ complement[:, :-1]
    reported = _convert_to_reported_values(parameters, point, natural, basis)
    return (*sentences, *(_describe_parameter_direction(column, names) for column in reported.T))


def describe_half_turn(k: int) -> str:
    """Return a sentence about a half turn of the body about the principal axis k that fits."""
    return f"a half turn of the body, with its com and its start, about principal axis {k + 1}"


def _convert_to_reported_values(
    parameters: FreeParameters, point: FitPoint, natural: Array, directions: Array
) -> Array:
    """Return unit vectors along the changes of the reported values, in their natural units."""
    jacobian = parameters.list_user_parameters_and_jacobian(point)[3] * natural
    changes = jacobian @ directions / np.linalg.norm(jacobian, axis=1)[:, None]
    reported: Array = changes / np.linalg.norm(changes, axis=0)
    return reported


def _describe_parameter_direction(direction: Array, names: list[str]) -> str:
    largest = np.argsort(-np.abs(direction))[:_LARGEST]
    terms = [f"{direction[k]:+.2f} {names[k]}" for k in largest if abs(direction[k]) > _SMALL]
    if len(terms) == 1:
        return names[int(largest[0])]
    return f"a combination of parameters: {' '.join(terms)}, in natural units"


def _yield_unobservable_changes(p: FreeParameters, point: FitPoint) -> Iterator[tuple[str, Array]]:
    """Yield parameter changes that leave some measurements unchanged, and their descriptions."""
    yield from _yield_unobservable_scalings(p, point)
    vertical = rotation_matrix(point.attitude)[2]
    turning_change = np.cross([0.0, 0.0, 1.0], point.turning)
    if np.linalg.norm(turning_change) > _LEVEL * np.linalg.norm(point.turning):
        heading = "the heading: a rotation of the start and of turning about the vertical"
        yield from _yield_change_if_all_free(
            p, heading, {"attitude": vertical, "turning": turning_change}
        )
    heading = "the heading: a rotation of the start about the vertical"
    yield from _yield_change_if_all_free(p, heading, {"attitude": vertical})
    if not _has_gravity_or_shaking_torque(point):
        for axis in np.eye(3):
            sentence = "the attitude in space, which a body without torque does not show"
            yield from _yield_change_if_all_free(p, sentence, {"attitude": axis})
            velocity_change = -np.cross(point.inertial_velocity - point.rate, axis)
            yield from _yield_change_if_all_free(
                p, sentence, {"attitude": axis, "velocity": velocity_change}
            )
    yield from _yield_unobservable_axial_changes(p, point)
    yield from _yield_unobservable_clock_changes(p, point)


def _yield_change_if_all_free(
    p: FreeParameters, sentence: str, blocks: Blocks
) -> Iterator[tuple[str, Array]]:
    """Yield `sentence` and the vector of the changes in `blocks` if all its parameters are free."""
    if not all(p.can_vary(name) for name in blocks):
        return
    change = np.zeros(p.size)
    for name, value in blocks.items():
        change[p.get_parameter_slice(name)] = value
    yield sentence, change


def _average_tied_components(columns: Array, values: Array) -> Array:
    """Return the mean of each group of values, as marked by one column of `columns`."""
    mean: Array = columns.T @ values / columns.sum(axis=0)
    return mean


def _has_gravity_or_shaking_torque(point: FitPoint) -> bool:
    amplitude, rate, _ = point.shaking
    return bool((point.gravity or amplitude * rate) and point.com.any())


def _yield_unobservable_scalings(p: FreeParameters, point: FitPoint) -> Iterator[tuple[str, Array]]:
    rescalings = _get_rescalings_by_torque_factor(p, point)
    size: dict[str, Array] = {"moments": _average_tied_components(p.moments, point.densities)}
    others, is_scalable = ["damping"], p.can_vary("damping") or not point.damping.any()
    if p.can_vary("damping"):
        size["damping"] = _average_tied_components(p.damping, point.damping)
    for name, value in (("friction", np.array([point.friction])), ("rotor", point.rotor)):
        if p.can_vary(name):
            size[name] = value
            others.append(name)
        elif value.any():
            is_scalable = False
    if is_scalable and not _has_gravity_or_shaking_torque(point):
        words = " and ".join(others)
        sentence = f"the scale of the moments: only their ratios, and {words} over moments, matter"
        yield from _yield_change_if_all_free(p, sentence, size)
    elif is_scalable:
        words = ", ".join(others)
        for name, blocks in rescalings.items():
            sentence = (
                f"the scale of the moments: moments, {words} and {name} have an unknown "
                "common factor"
            )
            yield from _yield_change_if_all_free(p, sentence, {**size, **blocks})
    for first, second in (("gravity", "com"), ("gravity", "lever"), ("mass", "com"),
                          ("mass", "lever"), ("gravity", "mass")):  # fmt: skip
        sentence = f"{first} against {second}: only mass * gravity * com counts"
        opposite = {name: -value for name, value in rescalings[second].items()}
        yield from _yield_change_if_all_free(p, sentence, {**rescalings[first], **opposite})


def _get_rescalings_by_torque_factor(
    p: FreeParameters, point: FitPoint
) -> dict[str, dict[str, Array]]:
    """Return the parameter changes that rescale each factor of the gravitational torque."""
    rescalings = {
        "com": {"com": point.com},
        "lever": {"lever": np.array([float(point.com @ p.lever)])},
        "gravity": {"gravity": np.array([point.gravity])},
        "mass": {"mass": np.array([point.mass])},
    }
    if p.can_vary("shaking"):
        rescalings["gravity"]["shaking"] = np.array([point.shaking[0], 0.0, 0.0])
    return rescalings


def _yield_unobservable_axial_changes(
    p: FreeParameters, point: FitPoint
) -> Iterator[tuple[str, Array]]:
    length = float(np.linalg.norm(point.com))
    axis = point.com / length if length > 0.0 else np.array([0.0, 0.0, 1.0])
    sentence = "the spin angle: a rotation of the start about the axis"
    yield from _yield_change_if_all_free(p, sentence, {"attitude": axis})
    blocks = {"attitude": axis, "velocity": -np.cross(axis, point.rate)}
    yield from _yield_change_if_all_free(p, sentence, blocks)
    k = int(np.argmax(np.abs(axis)))
    unit = np.eye(3)[k]
    moments = point.moments[k] * unit
    densities = 0.5 * moments.sum() - moments
    spin = {
        "moments": np.linalg.lstsq(p.moments, densities, rcond=None)[0],
        "velocity": -point.rate[k] * unit,
    }
    sentence = "the moment about the axis against the spin: only their product counts"
    yield from _yield_change_if_all_free(p, sentence, spin)
    if p.can_vary("damping"):
        drag = p.damping.T @ (point.damping * unit)
        yield from _yield_change_if_all_free(p, sentence, {**spin, "damping": drag})
    sentence = "the rotor against the spin: only the momentum about the axis counts"
    rotor_change = {"velocity": -unit, "rotor": point.moments[k] * unit}
    yield from _yield_change_if_all_free(p, sentence, rotor_change)
    sentence = "the rotor against the moment about its axis: only the momentum counts"
    heavier = {"moments": spin["moments"], "rotor": -point.moments[k] * point.rate[k] * unit}
    yield from _yield_change_if_all_free(p, sentence, heavier)
    difference = np.array([0.0, 1.0, -1.0])
    sentence = "damping across the axis, one way against the other: only their mean counts"
    yield from _yield_change_if_all_free(
        p, sentence, {"damping": _average_tied_components(p.damping, np.roll(difference, k))}
    )


def _yield_unobservable_clock_changes(
    p: FreeParameters, point: FitPoint
) -> Iterator[tuple[str, Array]]:
    """Yield parameter changes that delay the clocks of all records or rotate the principal axes."""
    scene = point.to_scene()
    [change] = values("body_acceleration", scene._block, scene._start_state)
    delays = [part for (name, _, _), part in p.slices.items() if name == "delay"]
    if delays and len(delays) == len(p.records):
        sentence = "the delay against the start: a shift in time"
        blocks = {"attitude": point.rate, "velocity": change}
        if p.can_vary("shaking"):
            blocks["shaking"] = np.array([0.0, 0.0, point.shaking[1]])
        for _, step in _yield_change_if_all_free(p, sentence, blocks):
            for part in delays:
                step[part] = 1.0
            yield sentence, step
    for axis in np.eye(3):
        sentence = "the principal axes against the start"
        rotation = {"axes": axis, "attitude": axis}
        yield from _yield_change_if_all_free(p, sentence, rotation)
        yield from _yield_change_if_all_free(
            p, sentence, {**rotation, "velocity": -np.cross(axis, point.rate)}
        )
