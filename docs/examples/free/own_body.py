"""
How do I describe a body of my own?
===================================

Compose the body of parts with known moments. For example, a hammer is a cylinder mounted across the
end of a rod. Place the parts relative to the fixed point of the whole body, and add them.
"""

import kreisel as kr
import numpy as np

handle = kr.Body.rod(0.30, pivot=(0, 0, -0.15), mass=0.15)
head = kr.Body.cylinder(radius=0.015, height=0.08, pivot=(0, 0, 0), mass=0.4)
crosswise_head = head.turn((np.sqrt(0.5), 0, np.sqrt(0.5), 0)).shift((0, 0, -0.30))
hammer = handle + crosswise_head
print(hammer)
print("kind", hammer.kind, "moments", np.round(hammer.moments, 6), "kg m^2")

# %%
# The hammer is held at the end of its handle, spun about the handle, pushed sideways and released.
# It moves like a top without symmetry. The animation shows a box with the same moments:

scene = kr.Scene.from_euler(
    hammer, angles=(0, 75, 0), rates=(180, 0, 3000), degrees=True, gravity=9.81
)
path = kr.solve(scene, np.linspace(0, 1.5, 900))
path.animate(fps=15, size=320)

# %%
# A plot shows the path of the handle:

kr.plot(path)

# %%
# Bodies that are physically impossible are refused with a reason:

try:
    kr.Body(mass=1, inertia=(1, 1, 3), com=(0, 0, 1))
except ValueError as refusal:
    print(refusal)
