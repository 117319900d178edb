r"""
Which parameter of my model matters most?
=========================================

A motion depends on its initial state, on gravity, on the moments and on the centre of mass. The
Taylor method computes the derivatives with respect to all these parameters together with the path,
without finite differences.
"""

import kreisel as kr
import matplotlib.pyplot as plt
import numpy as np

book = kr.Body.cuboid(half=(0.10, 0.14, 0.02), pivot=(-0.10, -0.14, -0.02), density=600)
scene = kr.Scene.from_euler(book, angles=(0, 40, 0), rates=(3, 1, 20), gravity=9.81)
t = np.linspace(0, 2, 200)
path = kr.solve(scene, t, tangents=("start", "moments", "com", "gravity"))
print(path.tangents.shape)

# %%
# The first three rows of a tangent are the rotation of the attitude. A column multiplied by one per
# cent of its parameter tells how far this change of the parameter rotates the body:

turn = np.linalg.norm(path.tangents[:, :3], axis=1)
scale = 0.01 * np.abs([*book.moments, *book.principal_com, scene.gravity])
names = ["$I_1$", "$I_2$", "$I_3$", "com $x$", "com $y$", "com $z$", "gravity"]

figure, axes = plt.subplots(layout="constrained")
for column, factor, name in zip(turn.T[6:], scale, names, strict=True):
    style = "-" if name.startswith("$I") else "--" if name.startswith("com") else ":"
    axes.semilogy(t, np.degrees(factor * column), style, label=name)
axes.set(xlabel="time [s]", ylabel="turn of the body by 1 % [degrees]", ylim=(1e-3, None))
axes.legend(ncol=2)

# %%
# A finite difference of two runs agrees with the tangent, up to the error of the difference:

other = kr.solve(scene.replace(gravity=9.81 + 1e-6), t)
angle = kr.attitude_error(other.q, kr.solve(scene, t).q) / 1e-6
print(f"the difference deviates by {np.abs(angle[1:] / turn[1:, 12] - 1).max():.1e}")
