"""Reference solutions by heyoka for tops with rotors, damping, friction and moving supports.

In principal axes, let M be the momentum, u = q* turning q and P = q* e3 q. The angular velocity in
the inertial frame is w = J^-1 (M - rotor). The equations are

    M' = M x w + mass g P x com - D (w - u) + k a,    q' = q (w - u) / 2

with g = gravity - amplitude rate^2 cos(rate t + phase) and the unit vector a along the apex. The
torque k of dry friction is -friction times the sign of the spin <w - u, a>. If the spin is zero,
the torque k has the value that keeps the spin zero, provided that |k| does not exceed the friction.
Three compiled integrators in 128-bit arithmetic serve all tops.
"""

import math

import heyoka as hy
import numpy as np

from .equations import CYCLE, product

FP = hy.real128
TOLERANCE = 1e-33
LEAVE = 1e-6  # time after an event in which no other one is sought
PARAMETERS = 3 + 3 + 3 + 1 + 3 + 3 + 3 + 3 + 2
(MOMENTS, ROTOR, LEVER, GRAVITY, SHAKING, DAMPING, TURNING, APEX, FRICTION, HOLD) = (
    0, 3, 6, 9, 10, 13, 16, 19, 22, 23,
)  # fmt: skip
SLIDING, HELD = 0.0, 1.0


def _cross(a, b):
    return [a[j] * b[k] - a[k] * b[j] for _, j, k in CYCLE]


def _dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _seen_from_body(q, v):
    """Return the components of a space-frame vector along the principal axes."""
    back = [q[0], -q[1], -q[2], -q[3]]
    return product(product(back, [hy.expression(FP(0.0)), *v]), q)[1:]


def _block(first, n=3):
    return [hy.par[first + i] for i in range(n)]


class _Equations:
    """Expressions for the equations of motion, the spin and the torque that keeps it constant."""

    def __init__(self):
        q, M = hy.make_vars("qw", "qx", "qy", "qz"), hy.make_vars("a", "b", "c")
        moments, apex, turning = _block(MOMENTS), _block(APEX), _block(TURNING)
        u = _seen_from_body(q, turning)
        P = _seen_from_body(q, [hy.expression(FP(x)) for x in (0.0, 0.0, 1.0)])
        w = [(m - h) / j for m, h, j in zip(M, _block(ROTOR), moments, strict=True)]
        relative = [x - y for x, y in zip(w, u, strict=True)]
        amplitude, rate, phase = _block(SHAKING)
        g = hy.par[GRAVITY] - amplitude * rate * rate * hy.cos(rate * hy.time + phase)
        drag = [d * x for d, x in zip(_block(DAMPING), relative, strict=True)]
        free = [
            x + g * y - z
            for x, y, z in zip(_cross(M, w), _cross(P, _block(LEVER)), drag, strict=True)
        ]
        # The derivative of w - u along a, without friction: u' = u x (w - u).
        transport = _cross(u, relative)
        change = _dot(apex, [x / j - y for x, j, y in zip(free, moments, transport, strict=True)])
        torque = -change / _dot(apex, [x / j for x, j in zip(apex, moments, strict=True)])
        hold = hy.par[HOLD]
        k = hold * torque + (FP(1.0) - hold) * hy.par[FRICTION]
        attitude_rate = product(q, [hy.expression(FP(0.0)), *[FP(0.5) * x for x in relative]])
        rates = [*attitude_rate, *[x + k * a for x, a in zip(free, apex, strict=True)]]
        self.system = list(zip([*q, *M], rates, strict=True))
        self.spin = _dot(apex, relative)
        self.needed = torque
        self.slip = torque * torque - hy.par[FRICTION] * hy.par[FRICTION]


class SupportIntegrator:
    """A compiled integrator that computes attitudes and momenta for any scene."""

    def __init__(self):
        equations = _Equations()
        common = {
            "state": np.array([FP(1)] + [FP(0)] * 6),
            "tol": FP(TOLERANCE),
            "fp_type": FP,
            "pars": np.array([FP(1)] * PARAMETERS),
            "compact_mode": True,
        }
        # An event is used only to notice a change; both integrators share the equations.
        self.sliding = hy.taylor_adaptive(
            equations.system, t_events=[hy.t_event(equations.spin, fp_type=FP)], **common
        )
        self.held = hy.taylor_adaptive(
            equations.system, t_events=[hy.t_event(equations.slip, fp_type=FP)], **common
        )
        self.smooth = hy.taylor_adaptive(equations.system, **common)
        variables = [name for name, _ in equations.system]
        self._spin = hy.cfunc([equations.spin, equations.needed], vars=variables, fp_type=FP)
        self.stops = []

    def _measure(self, top):
        """Return the spin and the friction torque that would keep a zero spin at zero."""
        spin, torque = self._spin(top.state, pars=top.pars[:FRICTION], time=top.time)
        return float(spin), float(torque)

    def __call__(self, scene, t):
        """Return the attitude of the principal axes, and the momentum in the space frame, at `t`.

        Returns None if the motion backward in time is not unique, because friction holds the spin
        at zero.
        """
        state, pars = _read_scene(scene)
        self.stops = []
        if not scene.friction:
            end = self._run(self.smooth, state, pars, FP(0), t)[0]
            return _to_space(end.state)
        return self._with_friction(scene.friction, state, pars, t)

    def _run(self, top, state, pars, begin, t):
        top.state[:], top.pars[:], top.time = state, pars, begin
        if any(top.t_events if top is not self.smooth else []):
            top.reset_cooldowns()
        outcome = top.propagate_until(FP(t))[0]
        return top, outcome == hy.taylor_outcome.time_limit

    def _with_friction(self, friction, state, pars, t):
        """Integrate piecewise, from each transition between sliding and rest to the next."""
        self.smooth.state[:], self.smooth.pars[:], self.smooth.time = state, pars, FP(0)
        spin, torque = self._measure(self.smooth)
        begin = FP(0)
        while True:
            is_held = spin == 0.0 and abs(torque) <= friction
            if is_held and t < 0.0:
                return None
            # A top that friction cannot hold slides against the friction that would be needed or,
            # backward in time, has come from there.
            sign = math.copysign(1.0, spin if spin else torque if t < 0.0 else -torque)
            pars[HOLD] = FP(HELD if is_held else SLIDING)
            pars[FRICTION] = FP(friction) if is_held else FP(-friction * sign)
            if begin != FP(0):  # leave the event behind
                state, begin = self._leave(state, pars, begin, t)
            top, is_done = self._run(self.held if is_held else self.sliding, state, pars, begin, t)
            state, begin = top.state.copy(), top.time
            if is_done:
                return _to_space(state)
            self.stops.append(float(begin))
            spin, torque = 0.0, self._measure(top)[1]
            if is_held:  # the event is the beginning of a slip
                torque = math.copysign(2.0 * friction, torque)

    def _leave(self, state, pars, begin, t):
        """Return the state and the time shortly after a change between sliding and rest."""
        remaining = float(FP(t) - begin)
        restart = begin + FP(math.copysign(min(LEAVE, 0.5 * abs(remaining)), remaining))
        top, _ = self._run(self.smooth, state, pars, begin, restart)
        return top.state.copy(), top.time


def _read_scene(scene):
    """Return the state in principal axes and the parameters, as 128-bit numbers."""
    body = scene.body
    q = np.array(product(_exact(scene.attitude), _exact(body.axes)))
    q = q / (q @ q) ** FP(0.5)
    back = [q[0], -q[1], -q[2], -q[3]]
    momentum = product(product(back, [FP(0), *_exact(scene.momentum)]), q)[1:]
    pars = np.array([FP(0)] * PARAMETERS)
    lever = FP(body.mass) * _exact(body.principal_com)
    reach = lever @ lever
    apex = lever / reach ** FP(0.5) if reach > 0 else _exact((0.0, 0.0, 1.0))
    for first, numbers in (
        (MOMENTS, _exact(body.moments)),
        (ROTOR, _exact(body.principal_rotor)),
        (LEVER, lever),
        (GRAVITY, _exact((scene.gravity,))),
        (SHAKING, _exact(scene.shaking)),
        (DAMPING, _exact(scene.damping)),
        (TURNING, _exact(scene.turning)),
        (APEX, apex),
    ):
        pars[first : first + len(numbers)] = numbers
    return np.array([*q, *momentum]), pars


def _exact(numbers):
    return np.array([FP(float(x)) for x in numbers])


def _to_space(state):
    """Return the attitude, and the momentum in the space frame."""
    q = np.array(state[:4])
    q = q / (q @ q) ** FP(0.5)
    back = [q[0], -q[1], -q[2], -q[3]]
    return q, np.array(product(product(q, [FP(0), *state[4:]]), back)[1:])


def find_attitude_error(path, q):
    """Return the angle [rad] between the last attitude of a path and `q`."""
    low = path.q_low[-1] if path.digits in (20, 30) else np.zeros(4)
    attitude = np.array(product(_exact(path.q[-1]) + _exact(low), _exact(path.scene.body.axes)))
    difference = product([q[0], -q[1], -q[2], -q[3]], attitude / (attitude @ attitude) ** FP(0.5))
    return 2.0 * math.asin(min(1.0, math.sqrt(sum(float(x) ** 2 for x in difference[1:]))))


def find_momentum_error(path, m):
    """Return the distance between the last momentum of a path and `m` [M L^2 T^-1]."""
    low = path.m_low[-1] if path.digits in (20, 30) else np.zeros(3)
    difference = _exact(path.m[-1]) + _exact(low) - m
    return math.sqrt(sum(float(x) ** 2 for x in difference))
