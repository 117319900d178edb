"""
How do I compute more tops than fit into memory?
================================================

A sweep computes its tops in parts, which are written to a folder. It can be resumed after Ctrl-C,
after a crash, or on another machine. This example has 24,000 tops in small parts. A billion tops
are described in the same way.
"""

from pathlib import Path
from tempfile import TemporaryDirectory

import kreisel as kr
import matplotlib.pyplot as plt
import numpy as np

source = kr.Source.grid(
    kr.scenes.sleeping, spin=np.linspace(0, 8, 200), tilt=np.linspace(0.01, 1.5, 120)
)
folder = TemporaryDirectory()
runs = Path(folder.name) / "runs"
options = {"reduce": {"nutation": ("max", "mean")}, "part_size": 4000}
print(kr.sweep(source, np.linspace(0, 20, 201), folder=runs, parts=range(2), **options))

# %%
# Repeating the call computes only the missing parts. The results do not depend on the order of the
# parts, the workers that compute them, or the number of threads:

sweep = kr.sweep(source, np.linspace(0, 20, 201), folder=runs, **options)
print(sweep)
table = sweep.to_xarray()

figure, axes = plt.subplots(1, 2, figsize=(9, 3.8), sharey=True, layout="constrained")
titles = {"nutation_max": "largest nutation [rad]", "nutation_mean": "mean nutation [rad]"}
for chart, (name, title) in zip(axes, titles.items(), strict=True):
    field = chart.pcolormesh(table.tilt, table.spin, table[name], rasterized=True)
    figure.colorbar(field)
    chart.set(title=title, xlabel="tilt at the start [rad]")
    chart.grid(False)
axes[0].set_ylabel("spin")

# %%
# In a shell, ``kreisel sweep plan.toml --folder runs --parts 0:8`` computes some of the parts, for
# example in one of many jobs. The folder contains Parquet files, which many tools can read.

folder.cleanup()
