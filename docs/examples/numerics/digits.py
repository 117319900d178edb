"""
What are 30 digits good for?
============================

More digits extend the time over which a motion can be predicted. For this chaotic top, each digit
adds about fifteen units of time or more. At a moderate cost, a path with 30 digits remains accurate
long after double precision has become useless.
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
    milliseconds = 1e3 * (perf_counter() - begin)
    error = np.maximum(kr.attitude_error(path.q, truth.q), 1e-17)
    axes.semilogy(path.t, error, label=f"{digits} digits, {milliseconds:.1f} ms")
axes.axhline(1, color="tab:gray", linewidth=0.8)
axes.set(xlabel="time", ylabel="error [rad]", ylim=(1e-16, 10))
axes.legend()
print(f"estimated error of the reference: {truth.error:.1e} rad")

# %%
# ``path.q_low`` contains the digits that do not fit into the doubles of ``path.q``:

high, low = truth.q[-1], truth.q_low[-1]
print("w =", high[0], "+", low[0])
