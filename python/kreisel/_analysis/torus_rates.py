"""Mean rates of a top that moves on an invariant torus, computed from its closed-form solution.

Let chi1 and chi2 be the angle coordinates on the torus, and w1 and w2 their rates of change. Let z
be the projection of a body axis onto the horizontal plane. Up to a rotation about the vertical with
a known mean rate, the projection z is a function of the angles chi1 and chi2. Its argument grows at
the mean rate

    w1 n1 + w2 n2,

where n1 is the mean number of turns of z about 0 along loops on which chi1 makes a turn, and n2
likewise. If z has no zeros on the torus, its mean winding numbers n1 and n2 are integers. The body
axis is vertical where z is zero. The winding number of z along a loop changes by one when the loop
is moved across a zero. If the function z has zeros on the torus, its mean winding numbers depend on
where these zeros lie. If z has zeros on the torus, the mean rate is generally not an integer
combination of w1 and w2.

Source: Weyl, Mean motion, American Journal of Mathematics 60 (1938) 889.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from .._solve.exact import ExactTorus
from .._utils.validation import Array
from ..quaternion import turn
from .turns import Indices, Waves

_GRIDS = 64, 128, 256, 512  # points in each angle, until two grids have as many zeros
_OFFSET = 0.3  # of the grid [intervals]; motions are symmetric about multiples of a quarter turn
_ROUNDS = 30  # largest number of Newton steps
_STEP = 1e-6  # of differences of z [turns]
_SETTLED = 1e-13  # size of the last Newton step [turns]


class TorusRates(NamedTuple):
    """Mean rates of precession and spin, and the nutation frequency."""

    precession_rate: float
    nutation: float
    spin_angle_rate: float


class _BodyAxisAtTorusAngles(NamedTuple):
    """The direction of a body axis, as a function of the two angles on the torus.

    z       projection of the axis onto the horizontal plane, without the heading
    about   sin(nutation) exp(i spin_angle)
    height  cosine of the nutation
    """

    z: Waves
    about: Waves
    height: Array


def compute_torus_rates(form: ExactTorus) -> TorusRates | None:
    """Compute the mean precession and spin rates and the nutation frequency.

    Returns None if the motion is too close to a separatrix.
    """
    rates, cell_count = np.array(form.frequencies), -1
    for n in _GRIDS:
        turns = (np.arange(n) + _OFFSET) / n
        grid = np.stack(np.meshgrid(turns, turns, indexing="ij"), axis=-1)
        signals = _compute_body_axis_at_torus_angles(form, grid)
        cells, index = _find_grid_cells_with_zeros(signals.z)
        if len(cells) == cell_count:
            break
        cell_count = len(cells)
    else:
        return None
    zeros = np.array(
        [_refine_zero_by_newton(form, (cell + _OFFSET + 0.5) / n, n) for cell in cells]
    )
    zeros = zeros.reshape(-1, 2)
    if not np.isfinite(zeros).all():
        return None
    offsets = zeros - _OFFSET / n
    # Only the sum of precession and spin is smooth at the upper pole, only the difference at the
    # lower one.
    side = -np.sign(_compute_body_axis_at_torus_angles(form, zeros).height)
    precession = _compute_mean_windings(signals.z, offsets, index) @ rates[:2]
    spin = _compute_mean_windings(signals.about, offsets, side * index) @ rates[:2]
    return TorusRates(
        float(rates[2] + precession), _find_rate_of_strongest_harmonic(signals, rates), float(spin)
    )


def _compute_body_axis_at_torus_angles(form: ExactTorus, turns: Array) -> _BodyAxisAtTorusAngles:
    """Compute the direction of the body axis at given pairs of torus angles [turns]."""
    states = form._compute_states_at_angles(turns.reshape(-1, 2))
    w, x, y, z = states[:, 1:5].T
    axis = np.array(form.scene.body.com)
    axis /= np.linalg.norm(axis)
    first = np.cross(axis, np.eye(3)[np.abs(axis).argmin()])
    first /= np.linalg.norm(first)
    apex, one, two = (
        turn((w, x, y, z), (v[0], v[1], v[2])) for v in (axis, first, np.cross(axis, first))
    )
    level = apex[0] + 1j * apex[1]
    if form.scene.body.kind == "goryachev_chaplygin":  # the heading is that of the momentum
        level = level * np.exp(-1j * np.arctan2(states[:, 6], states[:, 5]))
    shape = turns.shape[:-1]
    spin_signal = two[2] + 1j * one[2]
    return _BodyAxisAtTorusAngles(
        level.reshape(shape), spin_signal.reshape(shape), apex[2].reshape(shape)
    )


def _find_grid_cells_with_zeros(z: Waves) -> tuple[Indices, Array]:
    """Find the grid cells around which a complex function has a nonzero winding number."""
    one, two = _compute_grid_phase_differences(z, 0), _compute_grid_phase_differences(z, 1)
    circulation = one + np.roll(two, -1, axis=0) - np.roll(one, -1, axis=1) - two
    index = np.rint(circulation / math.tau)
    cells = np.argwhere(index)
    return cells, index[tuple(cells.T)]


def _compute_grid_phase_differences(z: Waves, axis: int) -> Array:
    """Return the phase differences between adjacent points of a complex grid along one axis."""
    steps: Array = np.angle(np.roll(z, -1, axis=axis) * z.conj())
    return steps


def _refine_zero_by_newton(form: ExactTorus, guess: Array, n: int) -> Array:
    """Refine a guess of the torus angles [turns] at a zero of z; return NaN if no zero is found."""
    angles = guess
    offsets = _STEP * np.array([(0, 0), (1, 0), (-1, 0), (0, 1), (0, -1)])
    for _ in range(_ROUNDS):
        z = _compute_body_axis_at_torus_angles(form, angles + offsets).z
        one, two = (z[1] - z[2]) / (2.0 * _STEP), (z[3] - z[4]) / (2.0 * _STEP)
        area = float((one.conjugate() * two).imag)
        if area == 0.0:
            break
        # The steps a and b solve one * a + two * b = -z.
        step = np.array([(two.conjugate() * z[0]).imag, -(one.conjugate() * z[0]).imag]) / area
        angles = angles + step
        if np.abs(angles - guess).max() > 1.5 / n:
            break
        if np.abs(step).max() <= _SETTLED:
            return angles
    return np.full(2, np.nan)


def _compute_mean_windings(z: Waves, offsets: Array, index: Array) -> Array:
    """Return the mean winding numbers of z along the two angles of the torus.

    `offsets` contains the torus angles of the zeros of z [turns], measured from the first grid
    point.
    """
    first = round(float(_compute_grid_phase_differences(z, 0)[:, 0].sum()) / math.tau)
    second = round(float(_compute_grid_phase_differences(z, 1)[0].sum()) / math.tau)
    one = first - float((index * (1.0 - offsets[:, 1])).sum())
    two = second + float((index * (1.0 - offsets[:, 0])).sum())
    return np.array([one, two])


def _find_rate_of_strongest_harmonic(signals: _BodyAxisAtTorusAngles, rates: Array) -> float:
    strengths = np.abs(np.fft.fft2(signals.height))
    strengths[0, 0] = 0.0
    n = len(strengths)
    orders = np.array(np.unravel_index(int(strengths.argmax()), strengths.shape))
    orders = np.where(2 * orders > n, orders - n, orders)
    return abs(float(orders @ rates[:2]))
