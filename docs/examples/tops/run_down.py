r"""
When does a wheel stop?
=======================

Air drag alone never stops a spin, because it vanishes with the spin. The dry friction of a bearing
does not vanish, and stops the wheel in a finite time.
"""

import kreisel as kr
import matplotlib.pyplot as plt
import numpy as np

wheel = kr.Body.cylinder(radius=0.03, height=0.01, pivot=(0, 0, -0.04), mass=0.1)
hanging = kr.Scene.spinning(wheel, spin=300, tilt=np.radians(160), gravity=9.81)
drag, friction = 2e-7, 1e-5  # [kg m^2 / s], [kg m^2 / s^2]
bearings = {
    "drag": {"damping": drag},
    "friction": {"friction": friction},
    "drag and friction": {"damping": drag, "friction": friction},
}
figure, (above, below) = plt.subplots(2, 1, sharex=True, figsize=(7.6, 5), layout="constrained")
for name, words in bearings.items():
    scene = hanging.replace(**words)
    end = kr.solve(scene, 3000, events=kr.events.stopped(terminal=True))
    verdict = "stops after" if end.events.t.size else "still turns after"
    print(f"{name}: {verdict} {end.t[-1]:.6f} s")
    path = kr.solve(scene, np.linspace(0, 1600, 3000), want=("spin", "nutation"))
    above.plot(path.t, path.spin, label=name)
    below.plot(path.t, np.degrees(path.nutation), linewidth=0.7)
above.legend()
above.set_ylabel("spin [rad/s]")
below.set(xlabel="time [s]", ylabel="nutation [degrees]")

# %%
# The only torques about the axis are drag and friction, :math:`I_3 \dot\omega_3 = - d\,\omega_3 -
# f`. The wheel therefore stops after :math:`I_3\,\omega_3 / f` without drag, and with drag after
# :math:`(I_3 / d) \ln(1 + d\,\omega_3 / f)`:

moment = wheel.moments[2]
print(f"friction: {moment * 300 / friction:.6f} s")
print(f"drag and friction: {moment / drag * np.log1p(drag * 300 / friction):.6f} s")

# %%
# Friction acts only about the axis, so it does not stop the swinging of the wheel. A wheel without
# spin is a spherical pendulum.
