"""
How do I start as my textbook does?
===================================

Textbooks use Euler's angles and their rates, engineers use degrees or quaternions with the scalar
last, and a sensor measures the angular velocity in the body. All describe the same scene.
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
# The path returns the angles as given, z-x-z, and tables can contain them:

print(one.euler(degrees=True)[0].round(9))
print(one.to_pandas("nutation", "spin", degrees=True).head(3))

# %%
# The scene as a file for the shell: ``kreisel solve top.toml --t 2 --want nutation``.

print(first.to_toml())
