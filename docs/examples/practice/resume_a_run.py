"""
How do I continue a run tomorrow?
=================================

A run can be saved at any time and resumed later. The results are bitwise identical to those of an
uninterrupted run. The memory of a run does not grow with its length.
"""

from pathlib import Path
from tempfile import TemporaryDirectory

import kreisel as kr
import matplotlib.pyplot as plt
import numpy as np

folder = TemporaryDirectory()
file = Path(folder.name) / "run.kreisel"
run = kr.start(kr.scenes.asymmetric)
today = run.to(np.linspace(0.1, 40, 400))
run.save(file)

tomorrow = kr.resume(file).to(np.linspace(40.1, 80, 400))
at_once = kr.solve(kr.scenes.asymmetric, np.concatenate([today.t, tomorrow.t]), "taylor")
same = np.array_equal(np.vstack([today.states, tomorrow.states]), at_once.states)
print(f"bitwise equal to one run: {same}")

figure, axes = plt.subplots(figsize=(7.6, 3), layout="constrained")
for path, name in ((today, "today"), (tomorrow, "tomorrow")):
    axes.plot(path.t, path.nutation, label=name)
axes.set(xlabel="time", ylabel="nutation [rad]")
figure.legend(loc="outside upper right", ncol=2)

# %%
# A stream yields paths of bounded size, so its memory is constant for runs of any length:

highest = 0.0
for piece in kr.stream(kr.scenes.asymmetric, 2000.0, "strang", step=0.01, every=10):
    highest = max(highest, piece.apex[:, 2].max())
print(f"highest in 200,000 steps: {highest:.6f}")
folder.cleanup()
