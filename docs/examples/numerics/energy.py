"""
Does my simulation lose energy?
===============================

With the classical Runge-Kutta method, it loses energy steadily. With symplectic methods, the energy
error oscillates. The integrable map of Bobenko and Suris conserves a modified energy exactly.
"""

import kreisel as kr
import matplotlib.pyplot as plt
import numpy as np

scene, step = kr.scenes.thesis, 0.1
scale = scene.body.mass * scene.gravity * np.linalg.norm(scene.body.com)

figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.8), layout="constrained")
for name in ("rk4", "strang", "bobenko_suris2", "veselov4"):
    path = kr.solve(scene, 3000.0, name, step=step, every=7)
    left.loglog(
        path.t[1:], np.maximum.accumulate(np.abs(path.energy / path.energy[0] - 1))[1:], label=name
    )
left.set(xlabel="time", ylabel="largest relative change of the energy so far")
left.legend()

path = kr.solve(scene, 60.0, "bobenko_suris", step=step, every=1)
right.plot(path.t, path.energy / scale, label="energy")
right.plot(path.t, path.modified_energy(step) / scale, label="modified energy")
right.set(xlabel="time", title="bobenko_suris", ylim=(1.07, 1.24))
right.legend()

# %%
# The modified energy of the Bobenko-Suris map, :math:`E + \tfrac{h}{2 I_1} \langle p \times a, m
# \rangle M`, is constant up to rounding errors after any number of steps:

path = kr.solve(scene, 30000.0, "bobenko_suris", step=step, every=1000)
modified_energy = path.modified_energy(step)
print(f"{path.stats.steps} steps: {np.ptp(modified_energy) / abs(modified_energy[0]):.1e}")
