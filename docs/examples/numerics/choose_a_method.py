"""
Which method is the cheapest for the error that I allow?
========================================================

``kr.compare`` runs methods beside each other, against a truth with 20 digits, and tells error and
run time. Here is a top without a closed form, by all the families.
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
# To the left and down is better. The Taylor series wins at every error worth having; the
# structure-preserving methods are for runs so long that what they keep counts for more than where
# the top is (see the next examples). Asked to meet an error, kreisel chooses one of these and its
# step by itself, and says why:

path = kr.solve(scene, 20.0, "geometric", error=1e-4)
print(path.plan)
