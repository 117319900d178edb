"""Problems with moving supports and friction, and SciPy solutions for comparison.

The equations of docs/theory/supports.md are integrated in axes that turn with the support. Only the
parameters and initial values are taken from a scene; SciPy integrates the equations of motion.
"""

import kreisel as kr
import numpy as np
import pytest

from validation.references.radau import cross

turn, turn_back, multiply = kr.quaternion.turn, kr.quaternion.turn_back, kr.quaternion.multiply

START = {"momentum": (0.4, -0.5, 0.9), "attitude": (0.5, 0.5, -0.5, 0.5), "gravity": 1.3}
ROTOR = (0.3, -0.4, 0.8)
TENSOR = [[1.3, 0.1, 0.2], [0.1, 1.8, -0.1], [0.2, -0.1, 2.0]]
BODIES = {
    "general": kr.Body(1.2, (1.3, 2.1, 1.7), (0.2, -0.3, 0.4), unphysical=True),
    "largest N": kr.Body(1.2, (2.1, 1.3, 1.7), (0.2, -0.3, 0.4), unphysical=True),
    "tensor": kr.Body(1.2, TENSOR, (0.2, -0.3, 0.4), unphysical=True, rotor=ROTOR),
    "free": kr.Body(1.2, (1.3, 2.1, 1.7), (0, 0, 0), rotor=ROTOR),
    "free symmetric": kr.Body(1.2, (1.7, 1.3, 1.3), (0, 0, 0)),
    "lagrange": kr.Body(1.2, (1.3, 1.7, 1.3), (0, 0.4, 0), unphysical=True),
    "axial rotor": kr.Body(1.2, (1.3, 1.3, 1.7), (0, 0, 0.4), unphysical=True, rotor=(0, 0, 0.7)),
    "kowalewski": kr.Body(1, (2, 2, 1), (0.7, 0, 0), unphysical=True),
    "spherical": kr.Body(1.2, (1.3, 1.3, 1.3), (0.3, 0.4, 0.5), unphysical=True),
}


def make_scene(name, **words):
    return kr.Scene(BODIES[name], **START, **words)


def list_unsupported_calls(scene, path):
    """Return calls that must raise an exception if the support moves or friction acts."""
    return (
        lambda: kr.exact(scene),
        lambda: kr.solve(scene, 1.0, "exact"),
        lambda: kr.solve(scene, 1.0, "strang", step=0.1),
        lambda: kr.solve(scene, 1.0, "geometric", error=1e-3),
        lambda: kr.lyapunov(scene, 10.0),
        lambda: kr.megno(scene.vary(mass=[1.0, 2.0]), 10.0),
        lambda: kr.rod(path),
        lambda: kr.frequencies(path),
    )


class Motion:
    """The equations of motion in the support frame, for the state y = (attitude, momentum)."""

    def __init__(self, scene):
        body = scene.body
        tensor = np.array(body.inertia)
        self.scene, self.rotor, self.com = scene, np.array(body.rotor), np.array(body.com)
        self.inverse = np.linalg.inv(np.diag(tensor) if tensor.ndim == 1 else tensor)
        axes = np.array([turn(body.axes, e) for e in np.eye(3)])
        self.drag = axes.T @ np.diag(scene.damping) @ axes
        reach = np.linalg.norm(self.com)
        self.apex = self.com / reach if reach else axes[2]

    def see_from_body(self, y):
        """Return the top's momentum and the support's angular velocity in the body frame."""
        q = tuple(y[:4])
        return np.array(turn_back(q, tuple(y[4:]))), np.array(turn_back(q, self.scene.turning))

    def relative(self, y):
        """Return the angular velocity relative to the support, in the body frame."""
        own, turning = self.see_from_body(y)
        return self.inverse @ (own - self.rotor) - turning

    def spin(self, y):
        return self.relative(y) @ self.apex

    def torque(self, t, y):
        """Return the torque in the body frame, excluding dry friction."""
        amplitude, rate, phase = self.scene.shaking
        pull = self.scene.gravity - amplitude * rate**2 * np.cos(rate * t + phase)
        up = np.array(turn_back(tuple(y[:4]), (0.0, 0.0, 1.0)))
        return self.scene.body.mass * pull * cross(up, self.com) - self.drag @ self.relative(y)

    def find_holding(self, t, y):
        """Return the friction torque that keeps the spin constant."""
        (own, turning), relative = self.see_from_body(y), self.relative(y)
        change = self.torque(t, y) - cross(relative + turning, own)
        change = self.inverse @ change - cross(turning, relative)
        return -(self.apex @ change) / (self.apex @ self.inverse @ self.apex)

    def rates(self, t, y, friction):
        """Return the time derivative of the state for a friction torque about the top's axis."""
        q = tuple(y[:4])
        torque = np.array(turn(q, tuple(self.torque(t, y) + friction * self.apex)))
        torque -= cross(np.array(self.scene.turning), y[4:])
        return [*(0.5 * np.array(multiply(q, (0, *self.relative(y))))), *torque]


def integrate_with_stops(scene, end):
    """Return the final state, and the times at which friction switches between slip and stick."""
    solve_ivp = pytest.importorskip("scipy.integrate").solve_ivp
    motion, friction = Motion(scene), scene.friction
    y, t, stop_times = np.array([*scene.attitude, *scene.momentum]), 0.0, []
    sign = np.sign(motion.spin(y)) if friction else 0.0
    while t != end:
        if friction and not sign:

            def rates(t, y):
                return motion.rates(t, y, motion.find_holding(t, y))

            def change(t, y):
                return abs(motion.find_holding(t, y)) - friction

        else:

            def rates(t, y, sign=sign):
                return motion.rates(t, y, -sign * friction)

            def change(_, y, sign=sign):
                return sign * motion.spin(y)

        change.terminal, change.direction = True, -1.0 if sign else 1.0
        events = change if friction and end > 0.0 else None
        part = solve_ivp(rates, (t, end), y, "DOP853", rtol=1e-12, atol=1e-13, events=events)
        t, y = part.t[-1], part.y[:, -1]
        stop_times += [t] if part.status == 1 else []
        force = motion.find_holding(t, y)
        sign = 0.0 if sign and abs(force) <= friction else -np.sign(force)
    return y[:4] / np.linalg.norm(y[:4]), y[4:], stop_times


def integrate(scene, t):
    """Return the attitude and momentum at time `t`."""
    return integrate_with_stops(scene, t)[:2]


def compare_methods(scene, end, fewest):
    """Check the results of all applicable methods against a SciPy solution."""
    q, m = integrate(scene, end)
    tolerance = {0: 3e-9, 1: 0.03, 2: 3e-5, 4: 1e-8, 6: 1e-9, 8: 1e-9}
    methods = [method for method in kr.methods.values() if method.suits(scene)]
    assert fewest <= {method.name for method in methods}
    for method in methods:
        step = {} if method.adaptive or method.exact else {"step": 0.005}
        path = kr.solve(scene, [0.0, end], method.name, **step)
        limit = tolerance[method.order]
        assert kr.attitude_error(path.q[-1], q) < limit, method.name
        assert np.abs(path.m[-1] - m).max() < limit, method.name


def integral_of(values, t):
    """Integrate samples at an odd number of equally spaced times by Simpson's rule."""
    return ((values[1:-1:2] * 4 + values[:-2:2] + values[2::2]) * (t[1] - t[0]) / 3).sum()


def check_members(tops, t, **options):
    """Check that each ensemble member agrees bitwise with the solution for a single top."""
    paths = kr.solve(tops, t, "taylor", **options)
    assert not paths.status.any()
    for i, path in enumerate(paths):
        alone = kr.solve(tops[i], t, "taylor", **options)
        assert path.states.tobytes() == alone.states.tobytes()
        assert path.energy.tobytes() == alone.energy.tobytes()


def check_resumed(scene, words, t=(0.7, 1.6)):
    """Check that interrupted, resumed and streamed runs agree with kr.solve."""
    for options in words:
        run, first = kr.start(scene, **options), t[0]
        run.to([first])
        again = kr.resume(run.checkpoint)
        assert again.scene == scene
        rest = run.to([t[1]])
        assert rest.states.tobytes() == again.to([t[1]]).states.tobytes()
        whole = kr.solve(scene, t, **options)
        assert np.abs(rest.q[-1] - whole.q[-1]).max() < 1e-13
        states = [path.states for path in kr.stream(scene, list(t), **options)]
        assert np.abs(np.concatenate(states) - whole.states).max() < 1e-13


def compare_tangents(scene, end, columns, digits=16, step=1e-6):
    """Compare the tangents of a path with central differences.

    Each pair in `columns` contains a tangent's name and a function that returns a perturbed scene.
    """
    names = tuple(dict.fromkeys(name for name, _ in columns))
    path = kr.solve(scene, [0.0, end], "taylor", tangents=names, digits=digits)
    plain = kr.solve(scene, [0.0, end], "taylor", digits=digits)
    assert path.states.tobytes() == plain.states.tobytes()
    back = tuple(plain.q[-1] * (1, -1, -1, -1))
    expected = []
    for _, change in columns:
        one, other = (kr.solve(change(s * step), [0.0, end], "taylor") for s in (1.0, -1.0))
        rotation = 2 * np.array(multiply(back, tuple((one.q[-1] - other.q[-1]) / (2 * step))))[1:]
        expected.append([*rotation, *((one.m[-1] - other.m[-1]) / (2 * step))])
    assert np.abs(path.tangents[-1] - np.array(expected).T).max() < 1e-7


def unit_changes(scene, name, tangent=None):
    """Return pairs: the name of a tangent, and a function that changes one parameter component."""
    value = np.atleast_1d(getattr(scene, name))

    def change(k):
        def vary(increment):
            vector = value + increment * np.eye(len(value))[k]
            return scene.replace(**{name: vector if len(value) > 1 else float(vector[0])})

        return vary

    return [(tangent or name, change(k)) for k in range(len(value))]
