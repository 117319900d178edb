"""
How do I describe a body of my own?
===================================

From parts whose moments are known: a hammer is a cylinder across a rod. Parts are added where they
are; then the whole hangs on a point of its own.
"""

import kreisel as kr
import numpy as np

handle = kr.Body.rod(0.30, pivot=(0, 0, -0.15), mass=0.15)
head = kr.Body.cylinder(radius=0.015, height=0.08, pivot=(0, 0, 0), mass=0.4)
across = head.turned((np.sqrt(0.5), 0, np.sqrt(0.5), 0)).shifted((0, 0, -0.30))
hammer = handle + across
print(hammer)
print("kind", hammer.kind, "moments", np.round(hammer.moments, 6), "kg m^2")

# %%
# Held at the end of its handle, pushed sideways and let go, it swings round; spun about the handle,
# its motion is that of a top without any symmetry. The film shows the box that moves as it does:

scene = kr.Scene.from_euler(
    hammer, angles=(0, 75, 0), rates=(180, 0, 3000), degrees=True, gravity=9.81
)
path = kr.solve(scene, np.linspace(0, 1.5, 900))
path.animate(fps=20, size=320)

# %%
# The way of its handle:

kr.plot(path, degrees=True)

# %%
# What it is not is refused with a reason:

try:
    kr.Body(mass=1, inertia=(1, 1, 3), com=(0, 0, 1))
except ValueError as refusal:
    print(refusal)
