"""
Why does a tumbling satellite turn over?
========================================

A free body that spins about the axis of its middle moment flips over periodically. Examples are the
cosmonaut Dzhanibekov's nut, a tennis racket, and a satellite that has lost its thrusters.
"""

import kreisel as kr
import matplotlib.pyplot as plt
import numpy as np

scene = kr.scenes.dzhanibekov  # a box 2 x 1.2 x 0.4, spun about its middle axis, off by 1 in 3000
motion = kr.exact(scene)
t = np.linspace(0, 40, 2000)
path = motion(t)

figure, axes = plt.subplots(figsize=(7.6, 3.2), layout="constrained")
for values, name in zip(
    path.body_velocity.T, ("long axis", "middle axis", "short axis"), strict=True
):
    axes.plot(t, values, label=name)
axes.set(xlabel="time", ylabel="angular velocity, seen from the body")
axes.legend(loc="upper right", ncol=3)
axes.set_ylim(-3.5, 4.5)

# %%
# Between two flips the motion seems steady. The time between flips grows with the logarithm of the
# inverse of the initial deviation. The closed form gives this time even for deviations that are too
# small for numerical integration:

for offset in (1e-1, 1e-3, 1e-6, 1e-9):
    one = kr.exact(scene.replace(body_velocity=(offset, 3.0, 0.0)))
    print(f"off by {offset:.0e}: turns over every {one.period:7.3f}")

kr.view(scene, open=False)
