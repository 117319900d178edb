"""
Which method is cheapest at a given error?
==========================================

``kr.compare`` runs methods against a reference solution with 20 digits and reports errors and run
times. Here a method of each family computes a top without a closed form.
"""

import kreisel as kr
import matplotlib.pyplot as plt
import numpy as np

scene = kr.scenes.asymmetric_regular
steps, tols = [0.1, 0.05, 0.025, 0.0125, 0.00625], [1e-3, 1e-5, 1e-7, 1e-9, 1e-11, 1e-13]
names = ["strang", "takahashi_imada4", "kahan_li6", "veselov4", "rk4", "taylor", "extrap"]
table = kr.compare(scene, 20.0, names, steps, tols, repeats=3)

figure, axes = plt.subplots(layout="constrained")
for name in names:
    rows = [row for row in table if row.method == name and not row.failure]
    error, seconds = np.array([(row.attitude_error, row.seconds) for row in rows]).T
    axes.loglog(1e3 * seconds, error, "o-", markersize=3, label=name)
axes.set(xlabel="run time [ms]", ylabel="attitude error [rad]", ylim=(1e-14, 10))
axes.legend(loc="upper right", ncol=2)

# %%
# Methods at the lower left are better. The Taylor series is fastest at every useful error. The
# structure-preserving methods are for runs so long that conserved quantities matter more than the
# exact attitude (see the next examples). Given an error bound, kreisel chooses a
# structure-preserving method and its step, and explains the choice:

path = kr.solve(scene, 20.0, "geometric", error=1e-4)
print(path.plan)
