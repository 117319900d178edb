"""
What do 30 digits buy?
======================

Time. Each digit is another ten units or so of a chaotic motion that can be known, and with 30 a
path is right where doubles have long lost it. They cost less than one would think.
"""

from time import perf_counter

import kreisel as kr
import matplotlib.pyplot as plt
import numpy as np

scene = kr.scenes.asymmetric
t = np.linspace(1, 320, 400)
truth = kr.solve(scene, t, digits=30)

figure, axes = plt.subplots(layout="constrained")
for digits in (16, 20):
    begin = perf_counter()
    path = kr.solve(scene, t, "taylor", digits=digits)
    took = 1e3 * (perf_counter() - begin)
    error = np.maximum(kr.attitude_error(path.q, truth.q), 1e-17)
    axes.semilogy(path.t, error, label=f"{digits} digits, {took:.1f} ms")
axes.axhline(1, color="tab:gray", linewidth=0.8)
axes.set(xlabel="time", ylabel="error [rad]", ylim=(1e-16, 10))
axes.legend()
print(f"the truth is itself known to {truth.error:.1e} rad")

# %%
# What doubles leave out stands beside them, so that nothing of it is lost when it is written down:

high, low = truth.q[-1], truth.q_low[-1]
print("w =", high[0], "+", low[0])
