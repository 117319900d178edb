"""Scenes and simulated measurements for the tests of kreisel.fit."""

import kreisel as kr
import numpy as np

HEAVY = kr.Scene(
    kr.Body(1.0, (1.0, 1.3, 0.6), com=(0.05, 0.1, 0.4), unphysical=True),
    attitude=(0.9, 0.3, 0.1, 0.3) / np.linalg.norm((0.9, 0.3, 0.1, 0.3)),
    body_velocity=(3.0, 2.0, 12.0),
    gravity=9.81,
)
SYMMETRIC = kr.Scene.spinning(
    kr.Body.symmetric(1.0, 1.0, 0.6, 0.4, unphysical=True),
    spin=20.0,
    tilt=0.8,
    precession=1.5,
    gravity=9.81,
)
GUESS = kr.Scene(
    kr.Body(1.0, (1.0, 1.1, 1.2), com=(0.0, 0.0, 0.3), unphysical=True),
    momentum=(0, 0, 1),
    gravity=9.81,
)
SYMMETRIC_GUESS = kr.Scene(
    kr.Body.symmetric(1.0, 1.7, 1.5, 0.4, unphysical=True), momentum=(0, 0, 1), gravity=9.81
)
SIGMA = 0.02


def gyroscope(scene=HEAVY, n=300, end=3.0, seed=0, sigma=SIGMA, **words):
    """Return noisy measurements of the angular velocity in the body frame."""
    t = np.linspace(0.0, end, n)
    noise = sigma * np.random.default_rng(seed).normal(size=(n, 3))
    values = kr.solve(scene, t).body_velocity + noise
    return kr.Record(t, {"body_velocity": values}, sigma=sigma or None, **words)


def tip(seed=0, n=200, end=4.0, sigma=0.005):
    """Return noisy measurements of the apex of a symmetric top."""
    t = np.linspace(0.0, end, n)
    noise = sigma * np.random.default_rng(seed).normal(size=(n, 3))
    return kr.Record(t, {"apex": kr.solve(SYMMETRIC, t).apex + noise}, sigma=sigma)


def ratios(scene):
    """Return the parameter ratios that can be determined from gyroscope data."""
    moments, com = np.array(scene.body.moments), np.array(scene.body.com)
    weight = scene.body.mass * scene.gravity
    return np.concatenate((moments[:2], com * weight)) / moments[2]
