"""Typical rotation times of tops, used to scale limits on waiting times and durations."""

from __future__ import annotations

import numpy as np

from .._model.scene import Ensemble
from .._utils.validation import Array


def estimate_turn_durations(tops: Ensemble) -> Array:
    """Estimate the time [T] that each top takes to turn once.

    The time is 2 pi / w, where w is the larger of the angular velocity (|m| + |h|) / I and the
    pendulum frequency sqrt(mass |gravity| |com| / I). Here, I is the largest moment of inertia, and
    h the angular momentum of the rotor. For a shaken support, its largest acceleration is added to
    |gravity|. For a torque-free top at rest, which never turns, the returned time is 1.
    """
    body = tops.body
    largest = np.max(body.moments, axis=-1)
    # Unlike the root of a sum of squares, hypot does not overflow for momenta above 1e154.
    momentum = np.hypot.reduce(tops.momentum, axis=-1) + np.hypot.reduce(body.rotor, axis=-1)
    rate = momentum / largest
    amplitude, shaking = tops.shaking[..., 0], tops.shaking[..., 1]
    largest_pull = np.abs(tops.gravity) + np.abs(amplitude) * shaking**2
    torque = body.mass * largest_pull * np.linalg.norm(body.com, axis=-1)
    rate = np.broadcast_to(np.maximum(rate, np.sqrt(torque / largest)), tops.shape).reshape(-1)
    turns: Array = np.divide(2.0 * np.pi, rate, out=np.ones(tops.size), where=rate > 0.0)
    return turns
