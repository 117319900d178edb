"""
How do you know that these digits are right?
============================================

An estimate compares two computations, which may err alike. An enclosure is a proof: it contains the
exact motion. The lines show the proved errors of two paths of a chaotic top, the points their
estimates, and the dashed line the radius of the enclosure, below which nothing is known.
"""

import kreisel as kr
import matplotlib.pyplot as plt
import numpy as np

scene, t = kr.scenes.asymmetric, np.linspace(2, 60, 30)
enclosure = kr.enclose(scene, t)

figure, axes = plt.subplots(layout="constrained")
for digits in (16, 30):
    path = kr.solve(scene, t, "taylor", digits=digits)
    (line,) = axes.semilogy(t, enclosure.compare(path).errors, label=f"{digits} digits")
    axes.semilogy(t[4::5], [path[i].error for i in range(4, 30, 5)], "o", color=line.get_color())
axes.semilogy(t, enclosure.radius, "--", color="tab:gray", label="radius")
axes.set(xlabel="time", ylabel="error of the attitude [rad]")
axes.legend()

# %%
# A path can be verified alone:

print(kr.solve(scene, t).verify())
