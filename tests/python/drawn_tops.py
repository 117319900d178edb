"""Strategies that draw tops of every kind, motions and options; truths and comparisons."""

from dataclasses import replace

import kreisel as kr
import numpy as np
from hypothesis import HealthCheck, Phase, assume, settings
from hypothesis import strategies as st

LAWS = settings(
    max_examples=60,
    derandomize=True,
    deadline=None,
    database=None,
    phases=(Phase.generate,),
    suppress_health_check=list(HealthCheck),
)
ANGLE, RATE, ANGULAR_MOMENTUM = (0, 0, 0), (0, 0, -1), (1, 2, -1)  # powers of M, L and T
UNITS = {  # of the columns of each group of tangents
    "start": [ANGLE] * 3 + [ANGULAR_MOMENTUM] * 3,
    "moments": [(1, 2, 0)] * 3,
    "com": [(0, 1, 0)] * 3,
    "gravity": [(0, 1, -2)],
    "mass": [(1, 0, 0)],
    "damping": [ANGULAR_MOMENTUM] * 3,
    "rotor": [ANGULAR_MOMENTUM] * 3,
    "turning": [RATE] * 3,
    "shaking": [(0, 1, 0), RATE, ANGLE],
    "friction": [(1, 2, -2)],
}
EVENTS = (
    kr.events.nutation(),
    kr.events.loop(),
    kr.events.plane((1, 0.3, -0.2), 0.1),
    kr.events.crossing({"m_x*apex_y": 1, "m_y*apex_x": -1}),
    kr.events.crossing({"q_w": 1, "q_y": 0.3}),
    kr.events.extremum({"body_velocity_y": 1, "spin*apex_x": 0.5}),
    kr.events.crossing("body_momentum_y"),
)
DERIVED = (
    "energy",
    "nutation",
    "apex",
    "spin",
    "body_velocity",
    "frame",
    "torque",
    "body_acceleration",
)
QUANTITIES = ("q", "m", *DERIVED)
EXACT_ONLY = "kowalewski", "goryachev-chaplygin"  # kinds without closed form after rounding
DAMPING = (0.3, (0.1, 0.3, 0.05), (0.2, 0.0, 0.0), (40.0, 20.0, 0.5))  # the last one is stiff
EFFECTS = ("rotor", "damping", "friction", "turning", "shaking")


def draw_moments(rng):
    a, b, c = rng.uniform(0.2, 2.0, 3)
    return np.array([b + c, c + a, a + b])


def draw_symmetric_moments(rng):
    a, c = rng.uniform(1.0, 2.0), rng.uniform(0.3, 1.9)
    return np.array([a, a, c])


KINDS = {  # functions that draw the moments and the centre of mass
    "general": lambda rng: (draw_moments(rng), rng.normal(size=3)),
    "axial": lambda rng: (draw_moments(rng), np.array([0.0, 0.0, rng.uniform(-1, 1)])),
    "lagrange": lambda rng: (draw_symmetric_moments(rng), np.array([0, 0, rng.uniform(0.2, 1)])),
    "spherical": lambda rng: (np.full(3, rng.uniform(0.5, 2.0)), rng.normal(size=3)),
    "free": lambda rng: (draw_moments(rng), np.zeros(3)),
    "free symmetric": lambda rng: (draw_symmetric_moments(rng), np.zeros(3)),
    "kowalewski": lambda rng: (np.array([2.0, 2.0, 1.0]), np.array([rng.uniform(0.3, 1), 0, 0])),
    "goryachev-chaplygin": lambda rng: (np.array([4.0, 4.0, 1.0]), np.array([-0.5, 0, 0])),
}


@st.composite
def tops(draw, kinds=tuple(KINDS), effects=EFFECTS):
    """Draw a scene; the effects occur in half of the scenes, each of them in half of these."""
    rng = np.random.default_rng(draw(st.integers(0, 2**20)))
    kind, is_plain = draw(st.sampled_from(kinds)), draw(st.booleans())
    present = {name for name in effects if not is_plain and draw(st.booleans())}
    moments, com = KINDS[kind](rng)
    order = rng.permutation(3)
    rotor = np.zeros(3)
    if "rotor" in present:
        is_axial = draw(st.booleans())
        axis = com if is_axial and com.any() else np.eye(3)[2] if is_axial else rng.normal(size=3)
        rotor = draw(st.sampled_from((1.0, 1.0, 6.0, 1e-9, 1e-300))) * rng.normal() * axis
    mass = rng.uniform(0.5, 2.0)
    body = kr.Body(mass, moments[order], com[order], rotor=rotor[order], unphysical=True)
    if kind not in EXACT_ONLY and draw(st.booleans()):
        body = body.turn(draw_attitude(rng))
    words = {"gravity": draw(st.sampled_from((1.0, -2.5, 9.81, 0.0)))}
    if "damping" in present:
        words["damping"] = draw(st.sampled_from(DAMPING))
    if "friction" in present:
        words["friction"] = rng.uniform(0.02, 0.5)
    if "turning" in present:
        words["turning"] = draw(st.sampled_from(((0.0, 0.0, 0.4), (0.2, -0.3, 0.4))))
    if "shaking" in present:
        words["shaking"] = rng.uniform(0.05, 0.2), rng.uniform(2, 9), rng.uniform(-3, 3)
    momentum = rng.normal(size=3) * draw(st.sampled_from((1.0, 4.0)))
    if kind == "goryachev-chaplygin":
        momentum[2] = 0.0
    return kr.Scene(body, momentum=momentum, attitude=draw_attitude(rng), **words)


def draw_attitude(rng):
    q = rng.normal(size=4)
    return q / np.linalg.norm(q)


def has_past(scene):
    """Return False if friction leaves the past open, or stiff damping makes it too fast."""
    return not scene.friction and max(scene.damping) < 1.0


@st.composite
def motions(draw, scenes=None, n=6):
    """Draw a scene and increasing times, or decreasing ones if the motion has one past."""
    scene = draw(tops() if scenes is None else scenes)
    rng = np.random.default_rng(draw(st.integers(0, 2**20)))
    t = np.sort(rng.uniform(0.0, draw(st.sampled_from((0.5, 3.0, 10.0))), n))
    if draw(st.booleans()):
        t[:2] = 0.0, t[2]  # the start, and a time that occurs twice
    t.sort()
    if has_past(scene) and draw(st.integers(0, 2)) == 0:
        t = -t / (4.0 if any(scene.damping) else 1.0)  # a damped top gains energy
    return scene, t


@st.composite
def numerics(draw, scene, t, kinds=("auto", "taylor", "closed", "any")):
    """Draw a method that suits the scene, and the options that control its steps."""
    kind, names = draw(st.sampled_from(kinds)), list_methods(scene)
    if kind == "any":
        name = draw(st.sampled_from(names))
    else:
        name = "exact" if kind == "closed" and "exact" in names else "taylor"
    if name == "taylor":
        more = draw(st.sampled_from(({}, {"tol": 1e-6}, {"digits": 20}, {"digits": 30})))
        return {"method": "auto" if kind == "auto" else name, **more}
    if kr.methods[name].adaptive:
        return {"method": name}
    step = min(max(abs(t[-1]), 0.1) / draw(st.sampled_from((3, 8, 50))), 0.2)
    return {"method": name, "step": float(step)}


def list_methods(*scenes):
    return [name for name, m in kr.methods.items() if all(m.suits(scene) for scene in scenes)]


@st.composite
def event_lists(draw, is_terminal=False):
    """Draw events; the first one may end the motion if `is_terminal` is True."""
    events = [
        replace(
            draw(st.sampled_from(EVENTS)),
            direction=draw(st.sampled_from((0, 1, -1))),
            max_count=draw(st.sampled_from((None, None, 1, 2))),
        )
        for _ in range(draw(st.integers(1, 3)))
    ]
    events[0] = replace(events[0], terminal=is_terminal and draw(st.booleans()))
    return events


@st.composite
def outputs(draw, method):
    """Draw quantities and, for Taylor series, events."""
    want = draw(st.none() | st.lists(st.sampled_from(QUANTITIES), min_size=1, unique=True))
    can_watch = method in ("auto", "taylor") and draw(st.booleans())
    return {"want": want, "events": draw(event_lists(is_terminal=True)) if can_watch else None}


def solve_or_skip(*arguments, **words):
    """Return the result of kreisel.solve; skip steps that are too long for the method."""
    try:
        return kr.solve(*arguments, **words)
    except (kr.Error, ValueError):
        assume("step" not in words)
        raise


def scale_scene(scene, scale):
    """Return the same top in other units: `scale` maps powers of M, L and T to a factor."""
    body = scene.body
    other = kr.Body(
        body.mass * scale((1, 0, 0)),
        np.array(body.inertia) * scale((1, 2, 0)),
        np.array(body.com) * scale((0, 1, 0)),
        rotor=np.array(body.rotor) * scale(ANGULAR_MOMENTUM),
        unphysical=True,
    )
    numbers = {
        name: np.array(getattr(scene, name)) * scale(unit)
        for name, unit in {
            "momentum": ANGULAR_MOMENTUM,
            "gravity": (0, 1, -2),
            "damping": ANGULAR_MOMENTUM,
            "friction": (1, 2, -2),
            "turning": RATE,
        }.items()
    }
    shaking = np.array(scene.shaking) * [scale((0, 1, 0)), scale(RATE), 1.0]
    return kr.Scene(other, attitude=scene.attitude, shaking=shaking, **numbers)


def get_parameter(scene, name):
    """Return the numbers of a scene to which a group of tangents refers."""
    if name == "start":
        return scene.attitude
    return getattr(scene.body if name in ("moments", "com", "mass", "rotor") else scene, name)


def change_body(scene, **changes):
    """Return the scene with some arguments of its body changed."""
    body = scene.body
    words = {name: np.array(getattr(body, name)) for name in ("mass", "inertia", "com", "rotor")}
    return scene.replace(body=kr.Body(**words | changes, unphysical=True))


def change_parameter(scene, name, k, step):
    """Return the scene with component `k` of a parameter changed by `step`."""
    if name == "start" and k >= 3:
        return scene.replace(momentum=scene.momentum + step * np.eye(3)[k - 3])
    if name == "start":
        half = 0.5 * step * np.eye(3)[k]
        turned = kr.quaternion.multiply(scene.attitude, (np.sqrt(1.0 - half @ half), *half))
        return scene.replace(attitude=np.array(turned) / np.linalg.norm(turned))
    if name in ("gravity", "friction"):
        return scene.replace(**{name: getattr(scene, name) + step})
    if name in ("damping", "turning", "shaking"):
        return scene.replace(**{name: getattr(scene, name) + step * np.eye(3)[k]})
    if name == "mass":
        return change_body(scene, mass=scene.body.mass + step)
    axis = np.array(kr.quaternion.turn(scene.body.axes, np.eye(3)[k]))
    if name == "moments":
        inertia = np.array(scene.body.inertia)
        inertia = np.diag(inertia) if inertia.ndim == 1 else inertia
        return change_body(scene, inertia=inertia + step * np.outer(axis, axis))
    return change_body(scene, **{name: getattr(scene.body, name) + step * axis})


def subtract_paths(one, other):
    """Return the rotation vectors, seen from the body, and the changes of momentum."""
    dq, v = (one.q - other.q) + (one.q_low - other.q_low), other.q[:, 1:]
    turn = other.q[:, :1] * dq[:, 1:] - dq[:, :1] * v - np.cross(v, dq[:, 1:])
    return np.hstack([2.0 * turn, (one.m - other.m) + (one.m_low - other.m_low)])


class Truth:
    """The motion in 20 digits, and the attitude error that rounding of the scene explains.

    Motions that doubles do not resolve are skipped.
    """

    def __init__(self, scene, t):
        names = [name for name in UNITS if np.any(get_parameter(scene, name))]
        self.path = kr.solve(scene, t, digits=20)
        self.allowed = 5e-14 + 10.0 * kr.solve(scene, t, tangents=names).conditioning
        assume(self.allowed.max() < 1e-5)

    def judge(self, q):
        """Return the largest attitude error, divided by the allowed one."""
        return float((kr.attitude_error(q, self.path.q) / self.allowed).max(initial=0.0))


def measure_angle(one, other):
    """Return the largest angle between the attitudes of two paths, with all their digits."""
    difference = (one.q - other.q) + (one.q_low - other.q_low)
    if np.abs(difference).max() > 1e-6:
        return kr.attitude_error(one.q, other.q).max()
    difference -= other.q * (difference * other.q).sum(axis=1, keepdims=True)
    return 2.0 * np.linalg.norm(difference, axis=1).max()


def assert_same_bits(one, other, name=""):
    """Assert that arrays are equal in every bit, so that 0.0 differs from -0.0."""
    arrays = [np.asarray(x) for x in (one, other)]
    assert arrays[0].shape == arrays[1].shape, name
    first, second = (np.where(np.isnan(x), np.nan, x).tobytes() for x in arrays)
    assert first == second, name


def join(parts, name):
    return np.concatenate([getattr(part, name) for part in parts])


def assert_same_path(parts, whole):
    """Assert that consecutive paths have the numbers, events and costs of a single path."""
    for name in ("t", *(whole.want or ("states", "q_low", "m_low"))):
        assert_same_bits(join(parts, name), getattr(whole, name), name)
    found = [part.events for part in parts]
    for name in ("t", "which", "direction") + ("states",) * bool(len(whole.events)):
        assert_same_bits(join(found, name), getattr(whole.events, name), name)
    assert parts[-1].stats == whole.stats and parts[-1].want == whole.want
