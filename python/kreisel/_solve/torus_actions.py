"""Action variables of a top whose motion is confined to a torus.

Let m be the angular momentum, and R the rotation from the body frame to the space frame. The action
of a closed loop on the torus is the integral of the one-form <m, dR R^T> along that loop, divided
by 2 pi. Loops that can be continuously deformed into each other on the torus have the same action.
For each action, a loop is chosen along which one angle on the torus makes a full turn. The integral
is computed by the trapezoidal rule, which converges exponentially because the integrand is periodic
and analytic.

At the end of a loop, a Goryachev-Chaplygin top has not returned to its initial attitude. The
rotation of a Goryachev-Chaplygin top about the vertical is not a function of the two torus angles.
However, the one-form does not depend on the rotation about the vertical if <m, e3> is zero. Vector
components are taken along m/|m|, e3 x m/|m| and e3 instead of the space axes.

Source: Arnold, Mathematical Methods of Classical Mechanics, section 50.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

import numpy as np

from .._utils.validation import Array
from ..quaternion import turn

_FEWEST, _MOST = 64, 16384  # numbers of states on a loop, doubled until the action settles
_SETTLED = 1e-13  # allowed change of an action, relative to the mean modulus of its integrand
_ASIDE = 0.1  # value of the other angle on a loop [turns]; no motion is special there
_AXES: Final = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def compute_torus_action(states_at: Callable[[Array], Array], angle: int, is_level: bool) -> float:
    """Compute the action of the loop along which one torus angle makes a full turn.

    `angle` is the index of the torus angle that makes a full turn. `states_at` computes one state
    for each pair of torus angles [turns]. If `is_level` is True, <m, e3> is zero and the rotation
    about the vertical is arbitrary. Raises ValueError if the trapezoidal rule does not converge.
    """
    n, last = _FEWEST, np.inf
    while n <= _MOST:
        turns = np.full((n, 2), _ASIDE)
        turns[:, angle] = np.arange(n) / n
        action, size = _integrate_action_one_form(states_at(turns), is_level)
        if abs(action - last) <= _SETTLED * size:
            return action
        n, last = 2 * n, action
    raise ValueError(
        "the actions of this motion are not known, because it is too near to a separatrix: "
        f"{_MOST} states on a loop of the torus are not enough"
    )


def _integrate_action_one_form(states: Array, is_level: bool) -> tuple[float, float]:
    """Return the action integral over a closed loop, and the mean absolute value of its integrand.

    Let e_j be the columns of R; then <m, dR R^T> is the sum of (m x e_j) de_j / 2. The derivative
    of the rotation matrix R along the loop is computed by trigonometric interpolation.
    """
    w, x, y, z = states[:, 1:5].T
    momentum = states[:, 5:8]
    columns = np.array([turn((w, x, y, z), axis) for axis in _AXES]).transpose(0, 2, 1)
    if is_level:
        columns, momentum = _resolve_in_momentum_frame(columns, momentum)
    n = len(states)
    order = np.fft.rfftfreq(n, 1.0 / n)
    order[-1] = 0.0  # the derivative of the highest cosine is zero at all states
    change = np.fft.irfft(1j * order[:, None] * np.fft.rfft(columns, axis=1), n, axis=1)
    integrand = 0.5 * (np.cross(momentum, columns) * change).sum(axis=(0, 2))
    return float(integrand.mean()), float(np.abs(integrand).mean())


def _resolve_in_momentum_frame(columns: Array, momentum: Array) -> tuple[Array, Array]:
    """Return the components of vectors along m/|m|, e3 x m/|m| and e3 for a horizontal vector m."""
    size = np.hypot(momentum[:, 0], momentum[:, 1])
    c, s = momentum[:, 0] / size, momentum[:, 1] / size
    x, y, z = columns[..., 0], columns[..., 1], columns[..., 2]
    heading_momentum = np.zeros_like(momentum)
    heading_momentum[:, 0] = size
    return np.stack([c * x + s * y, c * y - s * x, z], axis=-1), heading_momentum
