"""
What do regular and chaotic motions look like?
==============================================

A Poincaré section consists of the states in which the apex is lowest. A regular motion meets it on
a curve, a chaotic one in an area. Under weak gravity the body is nearly free, which is regular; as
gravity grows, chaos spreads between the islands.
"""

import kreisel as kr
import matplotlib.pyplot as plt
import numpy as np

body = kr.Body.cuboid(half=(1.0, 0.7, 0.4), pivot=(0.0, 0.0, -0.4), mass=1.0)
figure, axes = plt.subplots(
    1, 3, figsize=(9.6, 3.9), sharex=True, sharey=True, layout="constrained"
)
for chart, gravity in zip(axes, (0.05, 2.0, 4.0), strict=True):
    tops = kr.starts(body, energy=2.0, vertical=1.0, n=40, seed=3, gravity=gravity)
    cuts = kr.section(tops, n=400)
    colour = plt.get_cmap("twilight_shifted")(cuts.top / tops.size)
    chart.scatter(cuts.spin_angle, cuts.apex[:, 2], c=colour, s=0.6, linewidths=0)
    chart.set_title(f"gravity {gravity}")
    chart.set_xlabel("spin angle [rad]")
    chart.grid(False)
axes[0].set_ylabel("height of the lowest point")

# %%
# Each colour is one top. Every motion that is not steady meets this section, and no point is
# missed, because the points are roots of the polynomial of each step. MEGNO identifies the chaotic
# tops:

for gravity in (0.05, 2.0, 4.0):
    tops = kr.starts(body, energy=2.0, vertical=1.0, n=40, seed=3, gravity=gravity)
    share = np.mean(kr.megno(tops, 1500).value > 4)
    print(f"gravity {gravity}: {share:.0%} of the tops are chaotic")
