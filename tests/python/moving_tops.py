"""The equations of motion of docs/theory/supports.md, for SciPy and for values of quantities.

They are written in axes that turn with the support. Only the parameters are taken from a scene.
"""

import kreisel as kr
import numpy as np

from validation.references.radau import cross

turn, turn_back, multiply = kr.quaternion.turn, kr.quaternion.turn_back, kr.quaternion.multiply


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
