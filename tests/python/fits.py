"""Tops, simulated measurements, and the reported parameters of fits as functions of a scene."""

import kreisel as kr
import numpy as np
from scipy.spatial.transform import Rotation

SIGMA = 0.02
ANGLES = ("nutation", "precession_angle", "spin_angle")
PLACE = (0.4, -0.7, 0.5)
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


def solve_at(scene, t, quantity):
    """Return a quantity at increasing times, which may be negative."""
    parts = []
    for times, order in ((t[t < 0.0][::-1], -1), (t[t >= 0.0], 1)):
        if len(times):
            path = kr.solve(scene, times)
            is_force = quantity == "specific_force"
            values = path.specific_force(PLACE) if is_force else getattr(path, quantity)
            parts.append(np.asarray(values)[::order])
    return np.concatenate(parts)


def measure(scene, t, quantity, settings):
    """Return what an instrument shows at the times `t` of its clock.

    settings  its bias, scale, mounting and delay by the names in fits, as "bias[0].spin"
    """
    parts = {"bias": [], "scale": [], "mounting": [], "delay": []}
    for name, value in settings.items():
        word, _, rest = name.partition("[")
        if "." not in rest or f".{quantity}" in rest:
            parts[word].append(value)
    whole, _, axis = quantity.rpartition("_")
    is_component = axis in ("x", "y", "z")
    values = solve_at(scene, t - np.sum(parts["delay"]), whole if is_component else quantity)
    turn = Rotation.from_rotvec(parts["mounting"] or np.zeros(3))
    if quantity == "q":
        return np.roll((to_rotation(values) * turn).as_quat(), 1, axis=1)
    if parts["mounting"]:
        values = turn.inv().apply(values)
    values = values[:, "xyz".index(axis)] if is_component else values
    rows = values.reshape(len(t), -1) * (parts["scale"] or 1.0) + (parts["bias"] or 0.0)
    return rows.reshape(values.shape)


def add_noise(values, quantity, sigma, rng):
    """Return measured values; the errors of attitudes are small rotations."""
    if quantity == "q":
        turns = Rotation.from_rotvec(sigma * rng.normal(size=(len(values), 3)))
        return np.roll((to_rotation(values) * turns).as_quat(), 1, axis=1)
    return values + sigma * rng.normal(size=values.shape)


def simulate(scene, t, sigmas, seed=0, noise=1.0, settings=None, **words):
    """Return a record of the quantities in `sigmas`, with errors of `noise` times their sigma.

    The instrument has the given `settings`, which are free parameters of the record.
    """
    rng, settings = np.random.default_rng(seed), settings or {}
    values = {
        name: add_noise(measure(scene, t, name, settings), name, noise * sigma, rng)
        for name, sigma in sigmas.items()
    }
    words = {"free": {name.partition("[")[0] for name in settings}, "sigma": sigmas} | words
    point = PLACE if "specific_force" in sigmas else None
    return kr.Record(t, values, point=point, **words)


def simulate_gyroscope(scene=HEAVY, n=300, end=3.0, seed=0, sigma=SIGMA, **words):
    """Return noisy measurements of the angular velocity in the body frame."""
    return simulate(scene, np.linspace(0.0, end, n), {"body_velocity": sigma}, seed, **words)


def compute_ratios(scene):
    """Return the parameter ratios that can be determined from gyroscope data."""
    moments, com = np.array(scene.body.moments), np.array(scene.body.com)
    weight = scene.body.mass * scene.gravity
    return np.concatenate((moments[:2], com * weight)) / moments[2]


def to_rotation(q):
    """Return a SciPy rotation for quaternions whose scalar comes first."""
    return Rotation.from_quat(np.roll(q, -1, axis=-1))


def list_vectors(scene):
    """Return the vectors and triples of a scene by the names in fits."""
    rate = kr.solve(scene, [0.0]).body_velocity[0]
    body = scene.body
    return {
        "body_velocity_": (rate, "xyz"),
        "com_": (body.com, "xyz"),
        "rotor_": (body.rotor, "xyz"),
        "turning_": (scene.turning, "xyz"),
        "I": (body.moments, "123"),
        "damping_": (scene.damping, "123"),
        "shaking_": (scene.shaking, ("amplitude", "rate", "phase")),
    }


def read_parameters(scene):
    """Return the parameters of a scene by the names in fits, except its attitude."""
    found = {"lever": float(np.linalg.norm(scene.body.com)), "mass": scene.body.mass}
    axes = to_rotation(np.array(scene.body.axes)).as_rotvec(), "xyz"
    for head, (values, parts) in (list_vectors(scene) | {"axes_": axes}).items():
        found |= {f"{head}{part}": float(x) for part, x in zip(parts, values, strict=True)}
    return found | {"gravity": scene.gravity, "friction": scene.friction}


def change_parameters(scene, changes):
    """Return a scene whose parameters, by the names in fits, are changed.

    Attitude and principal axes are turned by rotation vectors in the frame of the body and of the
    axes. The other vectors have the same components in the frame of the body as before.
    """
    values = {head: np.array(v, dtype=float) for head, (v, _) in list_vectors(scene).items()}
    plain = {name: 0.0 for name in ("lever", "gravity", "mass", "friction")}
    turns = {"attitude_": np.zeros(3), "axes_": np.zeros(3)}
    places = {f"{head}{x}": (turns[head], k) for head in turns for k, x in enumerate("xyz")}
    for head, (_, parts) in list_vectors(scene).items():
        places |= {f"{head}{part}": (values[head], k) for k, part in enumerate(parts)}
    for names, change in changes.items():
        for name in names.split(" = "):
            if name in plain:
                plain[name] = change
            else:
                array, k = places[name]
                array[k] += change
    body, com = scene.body, values["com_"]
    length = np.linalg.norm(com)
    com = com * (1.0 + plain["lever"] / length) if length else com
    axes = to_rotation(np.array(body.axes)) * Rotation.from_rotvec(turns["axes_"])
    inertia = axes.as_matrix() @ np.diag(values["I"]) @ axes.as_matrix().T
    is_diagonal = abs(body.axes[0]) == 1.0 and not turns["axes_"].any()
    new = kr.Body(
        body.mass + plain["mass"],
        values["I"] if is_diagonal else 0.5 * (inertia + inertia.T),
        com,
        rotor=values["rotor_"],
        unphysical=True,
    )
    # The principal axes of the new body may be in another order.
    order = ((to_rotation(np.array(new.axes)).inv() * axes).as_matrix()) ** 2
    turned = to_rotation(np.array(scene.attitude)) * Rotation.from_rotvec(turns["attitude_"])
    return kr.Scene(
        new,
        attitude=np.roll(turned.as_quat(), 1),
        body_velocity=values["body_velocity_"],
        gravity=scene.gravity + plain["gravity"],
        damping=order @ values["damping_"],
        friction=scene.friction + plain["friction"],
        turning=values["turning_"],
        shaking=values["shaking_"],
    )


def subtract(quantity, values, base):
    """Return differences of values, of angles without full turns, of attitudes as rotations."""
    if quantity == "q":
        return (to_rotation(base).inv() * to_rotation(values)).as_rotvec()
    difference = values - base
    return np.angle(np.exp(1j * difference)) if quantity in ANGLES else difference


def differentiate(function, x, h=1e-4):
    """Return the derivatives of a function by each number of x, along the last axis."""
    steps = h * np.eye(len(x))
    columns = [(function(x + step) - function(x - step)) / (2.0 * h) for step in steps]
    return np.stack([column.ravel() for column in columns], axis=-1)


def differentiate_record(scene, t, names, quantity, settings):
    """Return the derivatives of what an instrument shows by the parameters in `names`."""
    base = measure(scene, t, quantity, settings)

    def compute_change(x):
        changes = dict(zip(names, x, strict=True))
        moved = {name: value + changes[name] for name, value in settings.items()}
        mounting = [name for name in settings if name.startswith("mounting")]
        turns = [[values[name] for name in mounting] for values in (settings, changes)]
        if mounting:
            first, second = map(Rotation.from_rotvec, turns)
            moved |= dict(zip(mounting, (first * second).as_rotvec(), strict=True))
        other = change_parameters(scene, {n: d for n, d in changes.items() if n not in moved})
        return subtract(quantity, measure(other, t, quantity, moved), base)

    return differentiate(compute_change, np.zeros(len(names)))


def find_difference(fit, truth, names):
    """Return the differences of fitted parameters from those of a scene, in the order of `names`.

    Those of the attitude and of the axes are small rotations.
    """
    true = read_parameters(truth)
    found = {n: fit.values[n] - true.get(n.split(" = ")[0], 0.0) for n in names}
    axes = Rotation.from_rotvec([fit.values.get(f"axes_{x}", 0.0) for x in "xyz"])
    for head, old, new in (
        ("attitude", truth.attitude, to_rotation(np.array(fit.scene.attitude))),
        ("axes", truth.body.axes, axes),
    ):
        turn = (to_rotation(np.array(old)).inv() * new).as_rotvec()
        found |= {f"{head}_{x}": angle for x, angle in zip("xyz", turn, strict=True)}
    return np.array([found[name] for name in names])


def is_near(fit, expected, most=4.0):
    """Return True if the fitted values are within `most` standard errors of the expected ones."""
    return all(abs(fit.values[n] - v) < most * fit.error[n] for n, v in dict(expected).items())
