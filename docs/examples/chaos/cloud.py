"""
Where will a top be if its initial state is uncertain?
======================================================

A thousand tops, whose initial momenta differ by about one per cent or less, form a cloud of states.
Ensemble weather forecasts study how clouds of initial states spread.
"""

import kreisel as kr
import matplotlib.pyplot as plt
import numpy as np

times = [1.0, 6.0, 20.0, 100.0]
figure, axes = plt.subplots(
    2, 4, figsize=(9.4, 4.9), subplot_kw={"xticks": [], "yticks": []}, layout="constrained"
)
angles = np.linspace(0, 2 * np.pi, 200)
for row, name in zip(axes, ("asymmetric_regular", "asymmetric"), strict=True):
    cloud = kr.scenes.get_scene(name).scatter(1000, seed=1, momentum=0.02)
    paths = kr.solve(cloud, t=times, want=("apex",))
    for chart, apex, t in zip(row, np.moveaxis(paths.apex, 1, 0), times, strict=True):
        chart.plot(np.cos(angles), np.sin(angles), color="lightgray", linewidth=0.8)
        chart.scatter(apex[:, 0], apex[:, 1], s=1.2, alpha=0.5, linewidths=0)
        chart.set(aspect="equal", title=f"t = {t:g}", frame_on=False)
    row[0].set_ylabel(name.replace("_", ", "))

# %%
# Each dot is the axis of one top, seen from above. The regular cloud stretches along its path and
# remains narrow, while the chaotic cloud spreads everywhere. To the last bit, the results for a top
# do not depend on the other tops, even where chaos amplifies the last bit:

few = kr.solve(cloud[7:9], times)
print("bitwise equal in a smaller ensemble:", np.array_equal(few.apex[0], paths.apex[7]))
