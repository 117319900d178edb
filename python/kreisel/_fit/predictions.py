"""Predictions of measurable quantities and their derivatives with respect to the parameters.

The C library computes derivatives with respect to the attributes of a scene, which the chain rule
converts to derivatives with respect to the fit parameters. Components of body-fixed vectors refer
to the frame in which the user describes the body.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .._core import derivatives, values
from .._core import tangents as TANGENTS
from .._results.specific_force import SPECIFIC_FORCE, specific_force
from .._utils.validation import Array
from .measurable import MEASURABLE, SEEN_FROM_BODY
from .parameters import FitPoint, FreeParameters
from .rotations import (
    conjugate_quaternions,
    cross_matrix,
    multiply_quaternions,
    rotation_matrix,
)

_POLE = 1e-9  # least distance from a pole at which an angle about the vertical has a derivative
_START, _SHAKING = TANGENTS["start"][0], TANGENTS["shaking"][0]
_EULER = ("precession_angle", "nutation", "spin_angle")


class Prediction(NamedTuple):
    """Predicted values of a quantity and, if requested, their derivatives.

    by    (n, k, size) by the free parameters of the motion
    rate  (n, k) by time
    """

    values: Array
    by: Array
    rate: Array


@dataclass(frozen=True, eq=False)
class QuantityPredictor:
    """The states of a motion in principal axes, and their derivatives (tangents).

    block      the scene of the point, for the core
    states     (n, 8)
    tangents   (n, 6, c) by the numbers of the scene, or (n, 6, 0)
    bits the flags of the tangents, which select these numbers
    transform  (c, size) derivatives of these numbers with respect to the free parameters
    has_rate   True if time derivatives are needed
    origin     the time of the motion at which the scene begins
    """

    parameters: FreeParameters
    point: FitPoint
    block: bytes
    states: Array
    tangents: Array
    bits: int
    transform: Array
    has_rate: bool
    origin: float = 0.0

    @property
    def q(self) -> Array:
        return self.states[:, 1:5]

    @cached_property
    def rotation_from_principal_axes(self) -> Array:
        return rotation_matrix(self.point.axes)

    @property
    def _is_described_in_principal_axes(self) -> bool:
        return abs(self.point.axes[0]) == 1.0 and not self.parameters.can_vary("axes")

    @cached_property
    def attitude_jacobian(self) -> Array:
        """Derivatives of the attitude, expressed as rotation vectors."""
        jacobian: Array = self.tangents[:, :3] @ self.transform
        return jacobian

    @cached_property
    def state_time_derivatives(self) -> Array:
        """Time derivatives of the attitude (as a rotation vector) and of the angular momentum."""
        rotation, m = rotation_matrix(self.q), self.states[:, 5:]
        rate = values("body_velocity", self.block, self.states)
        change = values("body_acceleration", self.block, self.states)
        # the velocity of the support, seen from the body, changes by the rotation of the body
        change += np.cross(self.point.turning @ rotation, rate)
        body_momentum = (m[:, None] @ rotation)[:, 0]
        gain = self.point.moments * change + np.cross(rate, body_momentum)
        return np.concatenate((rate, (rotation @ gain[:, :, None])[:, :, 0]), axis=1)

    def predict_quantity(self, name: str, place: Array | None = None) -> Prediction:
        """Predict the values of a quantity along the motion."""
        if name == SPECIFIC_FORCE.name:
            assert place is not None
            return self._predict_specific_force(place)
        if name == "spin_angle" and not self._is_described_in_principal_axes:
            return self._predict_spin_angle()
        prediction = self._predict_quantity_of_core(name)
        return (
            self._transform_to_user_body_frame(prediction) if name in SEEN_FROM_BODY else prediction
        )

    def _predict_quantity_of_core(self, name: str) -> Prediction:
        n = len(self.states)
        quantities = values(name, self.block, self.states).reshape(n, MEASURABLE[name].doubles)
        jacobian, rate = np.empty((n, 0, 0)), np.empty((n, 0))
        if self.tangents.shape[2]:
            jacobian = self._differentiate_quantity(name, self.bits, self.tangents) @ self.transform
        if self.has_rate:
            rate = self._differentiate_quantity_by_time(name)
        return Prediction(quantities, jacobian, rate)

    def _differentiate_quantity_by_time(self, name: str) -> Array:
        pace = float(self.point.shaking[1]) if self.point.shaking[0] else 0.0
        directions = np.zeros((len(self.states), 6, 9 if pace else 6))
        directions[:, :, 0] = self.state_time_derivatives
        jacobian = self._differentiate_quantity(
            name, _START | (_SHAKING if pace else 0), directions
        )
        # time changes a quantity by the state and by the phase of the shaking
        return jacobian[:, :, 0] + pace * jacobian[:, :, 8] if pace else jacobian[:, :, 0]

    def _differentiate_quantity(self, name: str, bits: int, tangents: Array) -> Array:
        """Differentiate a quantity, replacing undefined derivatives by zero."""
        n, _, c = tangents.shape
        jacobian = derivatives(name, self.block, self.states, bits, tangents).reshape(
            n, MEASURABLE[name].doubles, c
        )
        if name in _EULER:
            jacobian[self._is_at_pole] = 0.0
        jacobian[np.isnan(jacobian)] = 0.0  # by com, if it is zero
        return jacobian

    @cached_property
    def _is_at_pole(self) -> NDArray[np.bool_]:
        apex = values("apex", self.block, self.states)
        is_at_pole: NDArray[np.bool_] = np.hypot(apex[:, 0], apex[:, 1]) < _POLE
        return is_at_pole

    def _transform_to_user_body_frame(self, prediction: Prediction) -> Prediction:
        """Transform a vector from the principal axes to the user's body frame."""
        if self._is_described_in_principal_axes:
            return prediction
        jacobian = (
            self.rotation_from_principal_axes @ prediction.by
            if prediction.by.size
            else prediction.by
        )
        if jacobian.size and self.parameters.can_vary("axes"):
            jacobian[:, :, self.parameters.get_parameter_slice("axes")] -= (
                self.rotation_from_principal_axes @ cross_matrix(prediction.values)
            )
        rate = (
            prediction.rate @ self.rotation_from_principal_axes.T
            if prediction.rate.size
            else prediction.rate
        )
        return Prediction(prediction.values @ self.rotation_from_principal_axes.T, jacobian, rate)

    def _predict_specific_force(self, place: Array) -> Prediction:
        """Return W' x r + W x (W x r) + g V at the position r, where V is the vertical."""
        change = self._transform_to_user_body_frame(self._predict_angular_acceleration())
        rate = self.predict_quantity("inertial_velocity")
        vertical = self._transform_to_user_body_frame(
            self._predict_quantity_of_core("body_vertical")
        )
        t = self.origin + self.states[:, 0]
        weight = self.point.compute_effective_gravity(t)
        force = specific_force(change.values, rate.values, vertical.values, weight, place)
        change_jacobian = -cross_matrix(place)
        w = rate.values
        rate_jacobian = (
            w[:, :, None] * place
            - 2.0 * place[:, None] * w[:, None]
            + (w @ place)[:, None, None] * np.eye(3)
        )
        jacobian, rates = np.empty((len(w), 0, 0)), np.empty((len(w), 0))
        if change.by.size:
            jacobian = (
                change_jacobian @ change.by
                + rate_jacobian @ rate.by
                + weight[:, None, None] * vertical.by
            )
            for name, gain in self._differentiate_effective_gravity(t):
                jacobian[:, :, self.parameters.get_parameter_slice(name)] += (
                    vertical.values[:, :, None] * gain[:, None]
                )
        if self.has_rate:
            rates = change.rate @ change_jacobian.T + weight[:, None] * vertical.rate
            rates += (rate_jacobian @ rate.rate[:, :, None])[:, :, 0]
            amplitude, pace, phase = self.point.shaking
            rates += (amplitude * pace**3 * np.sin(pace * t + phase))[:, None] * vertical.values
        return Prediction(force, jacobian, rates)

    def _differentiate_effective_gravity(self, t: Array) -> Iterator[tuple[str, Array]]:
        """Yield the derivatives of the acceleration along -e3, one for each free parameter."""
        if self.parameters.can_vary("gravity"):
            yield "gravity", np.ones((len(t), 1))
        if self.parameters.can_vary("shaking"):
            amplitude, pace, phase = self.point.shaking
            angle = pace * t + phase
            sine, cosine = amplitude * pace**2 * np.sin(angle), np.cos(angle)
            rate_derivative = t * sine - 2.0 * amplitude * pace * cosine
            yield "shaking", np.stack((-(pace**2) * cosine, rate_derivative, sine), axis=-1)

    @property
    def _is_on_turning_support(self) -> bool:
        return self.parameters.can_vary("turning") or self.point.is_support_turning

    @cached_property
    def _support_angular_velocity(self) -> Prediction:
        """The angular velocity of the support, in principal-axis components."""
        rotation = rotation_matrix(self.q)
        velocity, jacobian = self.point.turning @ rotation, np.empty((len(rotation), 0, 0))
        if self.tangents.shape[2]:
            jacobian = cross_matrix(velocity) @ self.attitude_jacobian
            if self.parameters.can_vary("turning"):
                jacobian[:, :, self.parameters.get_parameter_slice("turning")] += np.swapaxes(
                    rotation, 1, 2
                )
        rate = (
            np.cross(velocity, self.state_time_derivatives[:, :3])
            if self.has_rate
            else np.empty((len(rotation), 0))
        )
        return Prediction(velocity, jacobian, rate)

    def _predict_angular_acceleration(self) -> Prediction:
        """Predict the angular acceleration relative to the inertial frame."""
        relative = self._predict_quantity_of_core("body_acceleration")
        if not self._is_on_turning_support:
            return relative
        (u, u_jacobian, u_rate), (o, o_jacobian, o_rate) = (
            self._predict_quantity_of_core("body_velocity"),
            self._support_angular_velocity,
        )
        acceleration, jacobian, rate = relative
        if jacobian.size:
            jacobian = jacobian + cross_matrix(o) @ u_jacobian - cross_matrix(u) @ o_jacobian
        if rate.size:
            rate = rate + np.cross(o, u_rate) + np.cross(o_rate, u)
        return Prediction(acceleration + np.cross(o, u), jacobian, rate)

    def _predict_spin_angle(self) -> Prediction:
        """Predict the spin angle if the user's body frame differs from the principal axes."""
        p, axes, n = self.parameters, self.rotation_from_principal_axes, len(self.states)
        body = p.to_scene(self.point)
        states = self.states.copy()
        states[:, 1:5] = multiply_quaternions(self.q, conjugate_quaternions(self.point.axes)[None])
        predictor = QuantityPredictor(
            p, self.point, body._block, states, self.tangents, 0, self.transform, False
        )
        predictor.__dict__["_is_at_pole"] = self._is_at_pole
        identity = np.zeros((n, 6, 9))
        identity[:, range(6), range(6)] = 1.0
        gradient = predictor._differentiate_quantity(
            "spin_angle", _START | TANGENTS["com"][0], identity
        )
        turn_jacobian = gradient[:, :, :3] @ axes
        com_jacobian = gradient[:, :, 6:] @ rotation_matrix(np.array(body.body.axes)).T @ axes
        angle = values("spin_angle", body._block, states)[:, None]
        jacobian, rate = np.empty((n, 0, 0)), np.empty((n, 0))
        if self.tangents.shape[2]:
            jacobian = turn_jacobian @ self.attitude_jacobian
            if p.can_vary("com"):
                jacobian[:, :, p.get_parameter_slice("com")] += com_jacobian
            if p.can_vary("lever"):
                jacobian[:, :, p.get_parameter_slice("lever")] += com_jacobian @ p.lever[:, None]
            if p.can_vary("axes"):
                jacobian[:, :, p.get_parameter_slice("axes")] -= (
                    turn_jacobian + com_jacobian @ cross_matrix(self.point.com)
                )
        if self.has_rate:
            rate = (turn_jacobian @ self.state_time_derivatives[:, :3, None])[:, :, 0]
        return Prediction(angle, jacobian, rate)
