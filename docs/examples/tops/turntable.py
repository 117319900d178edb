r"""
What does a spinning wheel do on a turntable?
=============================================

A balanced wheel that is free to turn in all directions keeps its direction in the inertial frame.
If the bearings of its frame have friction, they drag the wheel along. Its axle then rises until it
is parallel to the axis of the turntable.
"""

import kreisel as kr
import matplotlib.pyplot as plt
import numpy as np

frame = kr.Body(2.0, (0.05, 0.05, 0.08), (0, 0, 0))
wheel = frame.with_rotor(spin=40, inertia=0.08, axis=(0, 0, 1))
lying = (np.sqrt(0.5), np.sqrt(0.5), 0, 0)  # the axle is horizontal
t = np.linspace(0, 60, 3000)
figure, axes = plt.subplots(figsize=(7.6, 3.6), layout="constrained")
for turning, drag in ((1.0, 0.0), (1.0, 0.1), (2.0, 0.1), (-2.0, 0.1)):
    scene = kr.Scene(
        wheel,
        attitude=lying,
        body_velocity=(0, 0, 0),
        gravity=0,
        damping=drag,
        turning=(0, 0, turning),
    )
    path = kr.solve(scene, t)
    elevation = np.degrees(np.arcsin(path.frame[:, 2, 2]))
    axes.plot(t, elevation, label=f"{turning:+.0f} rad/s, drag {drag}")
axes.set(xlabel="time [s]", ylabel="elevation of the axle [degrees]")
axes.legend()

# %%
# Seen from the turntable, the wheel first turns backwards. The drag on this motion is a vertical
# torque, which changes the vertical component of the momentum :math:`h` of the wheel,
# :math:`h\,\dot\alpha \cos\alpha = d\,\Omega \cos^2\alpha`, so the axle rises at the rate
# :math:`d\,\Omega / h` at first. The axle turns towards the axis of rotation, as a gyrocompass
# turns to the north.

momentum = wheel.rotor[2]
slow = kr.Scene(
    wheel, attitude=lying, body_velocity=(0, 0, 0), gravity=0, damping=0.1, turning=(0, 0, 0.2)
)
path = kr.solve(slow, np.linspace(0, 20, 200))
rate = np.polyfit(path.t[20:], np.arcsin(path.frame[20:, 2, 2]), 1)[0]
print(f"the axle rises at {rate:.2e} rad/s; expected {0.1 * 0.2 / momentum:.2e} rad/s")
