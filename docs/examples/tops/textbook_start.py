"""
How do I enter the initial state of a textbook problem?
=======================================================

Textbooks use Euler's angles and their rates, engineers use degrees or quaternions with the scalar
last, and a sensor measures the angular velocity in the body frame. All these descriptions can
define the same scene:
"""

import kreisel as kr
import numpy as np

body = kr.Body.symmetric(mass=0.5, i1=7.5e-3, i3=6e-4, height=0.12)
first = kr.Scene.from_euler(
    body, angles=(30, 60, 10), rates=(15, 0, 18000), degrees=True, gravity=9.81
)
second = kr.Scene(
    body,
    body_velocity=kr.solve(first, [0.0]).body_velocity[0],
    attitude_xyzw=first.attitude_xyzw,
    gravity=9.81,
)
t = np.linspace(0, 2, 1200)
one, other = kr.solve(first, t), kr.solve(second, t)
print(f"the two differ by {kr.attitude_error(one.q, other.q).max():.1e} rad")
kr.plot(one)

# %%
# The path returns Euler's angles in the same z-x-z convention, and tables can contain these angles:

print(one.euler(degrees=True)[0].round(9))
print(one.to_pandas("nutation", "spin", degrees=True).head(3))

# %%
# A file with the scene can be used in the shell: ``kreisel solve top.toml --t 2 --want nutation``.

print(first.to_toml())
