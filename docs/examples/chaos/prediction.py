"""
How long can a chaotic top be predicted?
========================================

Two tops that start a billionth of a radian apart move completely differently after some time. The
Lyapunov exponent predicts this time: the logarithm of their distance grows at the rate of the
exponent.
"""

import kreisel as kr
import matplotlib.pyplot as plt
import numpy as np

scene = kr.scenes.asymmetric
t = np.linspace(0.5, 250, 500)
truth = kr.solve(scene, t, digits=30)
exponent = kr.chaos(scene, 2000).lyapunov
print(f"exponent {exponent:.3f}")

figure, axes = plt.subplots(layout="constrained")
for offset in (1e-3, 1e-9, 1e-15):
    turn = np.array([1.0, 0.5 * offset, 0.0, 0.0])
    w, x, y, z = scene.attitude
    q = np.array([w - turn[1] * x, x + turn[1] * w, y + turn[1] * z, z - turn[1] * y])
    path = kr.solve(scene.replace(attitude=q / np.linalg.norm(q)), t)
    axes.semilogy(t, kr.attitude_error(path.q, truth.q), linewidth=0.9, label=f"{offset:.0e} rad")
axes.semilogy(
    t, np.minimum(1e-15 * np.exp(exponent * t), 3), "k--", linewidth=0.8, label="exponent"
)
axes.set(xlabel="time", ylabel="angle between both tops [rad]", ylim=(1e-16, 10))
axes.legend(title="distance at the start", loc="lower right")

# %%
# The reference has 30 digits, so its rounding errors are smaller than all errors in the figure. In
# double precision, no method can predict this top for more than a few hundred units of time. This
# limit is a property of the motion. A regular top remains predictable:

calm = kr.scenes.asymmetric_regular
for one in (scene, calm):
    print(f"error of doubles at t = 200: {kr.solve(one, [200.0]).error:.1e} rad")
