"""The time scale of tops, to which limits on waiting times and durations refer."""

from __future__ import annotations

import numpy as np

from .._model.scene import Ensemble
from .._utils.validation import Array


def estimate_turn_times(tops: Ensemble) -> Array:
    """Estimate how long each top takes for one turn about the axis of its largest moment [T].

    The times are computed as 2 pi / rate. The rate is the larger of (|m| + |h|) / I and sqrt(mass
    |gravity| |com| / I). Here I is the largest moment, and h the momentum of the rotor. The first
    value is the rate of a rotation, the second the angular frequency of a pendulum. Gravity
    includes the largest acceleration of a shaken support. The time is 1 for a top at rest without
    torque.
    """
    body = tops.body
    largest = np.max(body.moments, axis=-1)
    momentum = np.linalg.norm(tops.momentum, axis=-1) + np.linalg.norm(body.rotor, axis=-1)
    rate = momentum / largest
    amplitude, shaking = tops.shaking[..., 0], tops.shaking[..., 1]
    largest_pull = np.abs(tops.gravity) + np.abs(amplitude) * shaking**2
    torque = body.mass * largest_pull * np.linalg.norm(body.com, axis=-1)
    rate = np.broadcast_to(np.maximum(rate, np.sqrt(torque / largest)), tops.shape).reshape(-1)
    turns: Array = np.divide(2.0 * np.pi, rate, out=np.ones(tops.size), where=rate > 0.0)
    return turns
