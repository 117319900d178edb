"""Colour contrast and simulated colour blindness, for tests of charts and the viewer.

Colour vision without one type of cone is simulated in linear RGB. Source: Machado, Oliveira and
Fernandes, IEEE Transactions on Visualization and Computer Graphics 15 (2009), full dichromacy.
"""

import numpy as np

VISION = {
    "normal": np.eye(3),
    "protanopia": [
        [0.152286, 1.052583, -0.204868],
        [0.114503, 0.786281, 0.099216],
        [-0.003882, -0.048116, 1.051998],
    ],
    "deuteranopia": [
        [0.367322, 0.860646, -0.227968],
        [0.280085, 0.672501, 0.047413],
        [-0.011820, 0.042940, 0.968881],
    ],
}
TO_XYZ = np.array(
    [
        [0.4124564, 0.3575761, 0.1804375],
        [0.2126729, 0.7151522, 0.0721750],
        [0.0193339, 0.1191920, 0.9503041],
    ]
)
WHITE = TO_XYZ.sum(axis=1)


def to_linear(colour):
    """Convert a colour #rrggbb to linear RGB values."""
    part = np.array([int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)])
    return np.where(part <= 0.04045, part / 12.92, ((part + 0.055) / 1.055) ** 2.4)


def compute_contrast(one, other):
    """Return the contrast ratio of two colours, as defined in WCAG 2.2."""
    low, high = sorted(TO_XYZ[1] @ to_linear(colour) for colour in (one, other))
    return (high + 0.05) / (low + 0.05)


def to_lab(colour, vision):
    """Return the CIELAB coordinates of a colour, as seen with the given kind of vision."""
    part = TO_XYZ @ np.clip(np.array(VISION[vision]) @ to_linear(colour), 0, 1) / WHITE
    x, y, z = np.where(part > 216 / 24389, np.cbrt(part), (24389 / 27 * part + 16) / 116)
    return np.array([116 * y - 16, 500 * (x - y), 200 * (y - z)])


def lab_distance(one, other, vision):
    """Return the distance between two colours in CIELAB."""
    return np.linalg.norm(to_lab(one, vision) - to_lab(other, vision))
