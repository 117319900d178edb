"""
What does an integrable map do between its steps?
=================================================

The map of Bobenko and Suris is not only near a top: it is a top's equal, with integrals and a
closed form of its own. Even with steps as long as a nutation its points stay on a smooth curve,
where those of another method wander.
"""

import kreisel as kr
import matplotlib.pyplot as plt
import numpy as np

scene, step = kr.scenes.cusps, 0.4
figure, axes = plt.subplots(1, 3, figsize=(9.4, 3.6), sharex=True, sharey=True)
for chart, name in zip(axes, ("bobenko_suris", "strang", "implicit_midpoint"), strict=True):
    path = kr.solve(scene, 4000 * step, name, step=step, every=1)
    x, y, _ = path.apex.T
    chart.scatter(x, y, s=0.7, linewidths=0)
    chart.set(title=name, aspect="equal")
    chart.grid(False)

# %%
# The closed form of the map gives its state after any number of steps at once, here a billion:

map = kr.exact(scene, map="bobenko_suris", step=step)
print(map(10**9).apex)
steps = np.arange(0, 4001)
walked = kr.solve(scene, 4000 * step, "bobenko_suris", step=step, every=1)
print(f"walked and jumped, apart by {kr.attitude_error(walked.q, map(steps).q).max():.1e} rad")

# %%
# Side by side with the true top in the page; press *run*:

kr.view(scene, methods=["bobenko_suris", "strang"], step=0.4, open=False)
