"""
What do regular and chaotic motions look like?
==============================================

This Poincaré section consists of the states in which the apex is lowest. The points of a regular
motion lie on a curve, and those of a chaotic motion fill an area. Under weak gravity the body is
nearly free, and its motion is regular. As gravity increases, chaos spreads between the islands.
"""

import kreisel as kr
import matplotlib.pyplot as plt

body = kr.Body.cuboid(half=(1.0, 0.7, 0.4), pivot=(0.0, 0.0, -0.4), mass=1.0)
figure, axes = plt.subplots(
    1, 3, figsize=(9.6, 3.9), sharex=True, sharey=True, layout="constrained"
)
sections = {}
for chart, gravity in zip(axes, (0.05, 2.0, 4.0), strict=True):
    tops = kr.starts(body, energy=2.0, vertical=1.0, n=40, seed=3, gravity=gravity)
    sections[gravity] = kr.section(tops, n=400)
    sections[gravity].plot(chart)
    chart.set_title(f"gravity {gravity}")

# %%
# Each colour is one top. Every motion that is not steady meets this section, and no point is
# missed, because the points are roots of the polynomial of each step. MEGNO distinguishes chaotic
# tops from regular ones. The classification is doubtful if MEGNO is near the threshold:

for gravity, section in sections.items():
    chaos = kr.chaos(section.scene, 1500)
    print(f"gravity {gravity}: {chaos}")
section.plot(chaos=chaos, y="axial_momentum")

# %%
# The spin angle and the axial momentum are conjugate, so the Poincaré map preserves areas in this
# plane. In a plot of the indicator over time, the curves of regular motions tend to a common value,
# and those of chaotic motions grow:

chaos.plot()
