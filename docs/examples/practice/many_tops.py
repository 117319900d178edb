"""
How do I sweep over more tops than memory holds?
================================================

A sweep writes part after part into a folder, and goes on where it was ended: by Ctrl-C, by a
crash, on another machine. Here are 60,000 tops in small parts; a billion are told as easily.
"""

from pathlib import Path
from tempfile import TemporaryDirectory

import kreisel as kr
import matplotlib.pyplot as plt
import numpy as np

source = kr.Source.grid(
    kr.scenes.sleeping, spin=np.linspace(0, 8, 300), tilt=np.linspace(0.01, 1.5, 200)
)
folder = TemporaryDirectory()
runs = Path(folder.name) / "runs"
asked = {"reduce": {"nutation": ("max", "mean")}, "part": 10000}
print(kr.sweep(source, np.linspace(0, 20, 201), to=runs, parts=range(2), **asked))

# %%
# The same call makes what is missing, and nothing twice. The bits do not depend on who makes which
# part, when, or on how many threads:

done = kr.sweep(source, np.linspace(0, 20, 201), to=runs, **asked)
print(done)
table = done.to_xarray()

figure, axes = plt.subplots(1, 2, figsize=(9, 3.8), sharey=True, layout="constrained")
named = {"nutation_max": "largest nutation [rad]", "nutation_mean": "its mean [rad]"}
for chart, (name, title) in zip(axes, named.items(), strict=True):
    shown = chart.pcolormesh(table.tilt, table.spin, table[name], rasterized=True)
    figure.colorbar(shown)
    chart.set(title=title, xlabel="tilt at the start [rad]")
    chart.grid(False)
axes[0].set_ylabel("spin")

# %%
# The same from the shell, job by job: ``kreisel sweep plan.toml --to runs --parts 0:8``. What is in
# the folder is Parquet, which any tool reads.

folder.cleanup()
