"""Random tops of several families, including fast, slow and nearly symmetric tops."""

import kreisel as kr
import numpy as np

KINDS = "lagrange", "kowalewski", "goryachev_chaplygin", "asymmetric", "free", "nearly symmetric"


def random_body(rng, kind):
    half = np.exp(rng.normal(0.0, 0.35, 3))
    if kind in ("lagrange", "nearly symmetric"):
        half[1] = half[0] * (1.0 + (kind != "lagrange") * 10 ** rng.uniform(-12, -2))
        pivot = (0.0, 0.0, -half[2] * rng.uniform(0.2, 1.2))
    elif kind in ("kowalewski", "goryachev_chaplygin"):
        half = np.array([3**0.5 if kind == "kowalewski" else 7**0.5, 1.0, 0.5]) * np.exp(
            rng.normal(0.0, 0.3)
        )
        pivot = (0.0, 0.0, -half[2])
    else:
        pivot = -half * rng.uniform(-1.0, 1.0, 3) * (kind != "free")
    return kr.Body.cuboid(half=tuple(half), pivot=tuple(pivot))


def any_body(rng):
    """Draw a random top of any kind.

    One top in five starts with its third axis nearly vertical. One top in ten rotates ten
    times faster than usual, and one in ten a hundred times slower.
    """
    body = random_body(rng, KINDS[rng.integers(len(KINDS))])
    q = rng.normal(size=4)
    if rng.random() < 0.2:
        q[1:3] = rng.normal(size=2) * 10 ** rng.uniform(-8, -2)
        if rng.random() < 0.5:
            q = np.array([q[1], q[0], q[3], q[2]])
    speed = rng.choice([1.0, 10.0, 0.01], p=[0.8, 0.1, 0.1])
    momentum = rng.normal(0.0, 1.0, 3) * max(body.moments) * np.exp(rng.normal(0.0, 0.7)) * speed
    return kr.Scene(body, momentum=momentum, attitude=q / np.linalg.norm(q), gravity=1)


def place_near_upright(rng, body, speed):
    """Return a scene in which the centre of mass is almost above the fixed point."""
    com = np.array(body.com)
    half = com / np.linalg.norm(com) + [0.0, 0.0, 1.0]
    tilt = rng.normal(size=3) * 10 ** rng.uniform(-9, -2)
    q = np.array(kr.quaternion.multiply((1.0, *tilt), (0.0, *(half / np.linalg.norm(half)))))
    momentum = rng.normal(size=3) * max(body.moments) * speed
    return kr.Scene(body, momentum=momentum, attitude=q / np.linalg.norm(q), gravity=1)


def draw_heavy_body(rng):
    return random_body(rng, ("lagrange", "kowalewski", "asymmetric")[rng.integers(3)])


def at_rest(rng):
    return place_near_upright(rng, draw_heavy_body(rng), 0.0)


def almost_at_rest(rng):
    return place_near_upright(rng, draw_heavy_body(rng), 10 ** rng.uniform(-10, -3))


def any_body_at_rest(rng):
    return any_body(rng).replace(momentum=(0.0, 0.0, 0.0))


def sleeping(rng):
    """Draw an upright symmetric top with up to twice the spin that stability requires."""
    scene = place_near_upright(rng, random_body(rng, "lagrange"), 0.0)
    moments, lever = scene.body.moments, scene.body.mass * abs(scene.body.com[2])
    spin = rng.uniform(0.0, 2.0) * 2.0 * np.sqrt(lever * moments[0])
    return scene.replace(momentum=(0.0, 0.0, spin))


def middle_axis(rng):
    """Draw a free body whose axis of rotation is close to its intermediate principal axis."""
    half = np.sort(np.exp(rng.normal(0.0, 0.5, 3)))
    body = kr.Body.cuboid(half=tuple(half), pivot=(0.0, 0.0, 0.0))
    momentum = rng.normal(size=3) * 10 ** rng.uniform(-9, -2)
    momentum[1] += rng.normal() + 2.0
    return kr.Scene(body, momentum=momentum * max(body.moments), gravity=0.0)


def near_a_rod(rng):
    """Draw a slow top with one very small moment of inertia and two almost equal ones."""
    least, asymmetry = 10 ** rng.uniform(-5, -1), 10 ** rng.uniform(-14, -6) * (rng.random() < 0.5)
    body = kr.Body(1.0, (1.0, 1.0 + asymmetry * least, least), (0.0, 0.0, 1.0), unphysical=True)
    speed = 10 ** rng.uniform(-8, 0)
    q = rng.normal(size=4)
    momentum = rng.normal(size=3) * (1.0, 1.0, least)
    return kr.Scene(body, body_momentum=momentum * speed, attitude=q / np.linalg.norm(q), gravity=1)


def nearly_flipping(rng):
    """Draw an asymmetric top with about the energy that is needed to flip over."""
    body = random_body(rng, "asymmetric")
    lever = body.mass * np.linalg.norm(body.com)
    momentum = rng.normal(size=3) * np.sqrt(lever * max(body.moments))
    q = rng.normal(size=4)
    return kr.Scene(body, momentum=momentum, attitude=q / np.linalg.norm(q), gravity=1)


def fast(rng):
    scene = any_body(rng)
    return scene.replace(momentum=tuple(rng.uniform(10.0, 100.0) * m for m in scene.momentum))


def nearly_symmetric(rng):
    """Draw a nearly symmetric or nearly spherical top.

    The moments of inertia or the centre of mass of the body deviate from exact symmetry by relative
    amounts between 1e-16 and 1e-11.
    """
    first, second = 10 ** rng.uniform(-16, -11, 2) * rng.choice([-1.0, 1.0], 2)
    deviations = (first, 0.0), (0.0, second), (first, second)
    difference, offset = deviations[rng.integers(3)]
    if rng.random() < 0.3:
        body = kr.Body(
            1.0, (1.0, 1.0 + first, 1.0 + second), tuple(rng.normal(size=3)), unphysical=True
        )
    else:
        body = kr.Body(
            1.0, (1.0, 1.0 + difference, rng.uniform(0.1, 1.9)), (offset, 0.0, 1.0), unphysical=True
        )
    q = rng.normal(size=4) * (1.0, *(10 ** rng.uniform(-8, 0, 2)), 1.0)
    gravity = float(rng.choice([1.0, 0.0], p=[0.8, 0.2]))
    momentum = rng.normal(size=3) * 10 ** rng.uniform(-1, 1)
    return kr.Scene(body, momentum=momentum, attitude=q / np.linalg.norm(q), gravity=gravity)


FAMILIES = (
    any_body,
    at_rest,
    almost_at_rest,
    any_body_at_rest,
    sleeping,
    middle_axis,
    near_a_rod,
    nearly_flipping,
    fast,
    nearly_symmetric,
)
