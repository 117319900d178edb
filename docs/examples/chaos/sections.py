"""
What do regular and chaotic motions look like?
==============================================

A Poincaré section consists of the states in which the apex is lowest. A regular motion meets it on
a curve, a chaotic one in an area. Under weak gravity the body is nearly free, which is regular; as
gravity grows, chaos spreads between the islands.
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
# missed, because the points are roots of the polynomial of each step. MEGNO tells the chaotic tops
# from the regular ones. A verdict is in doubt if MEGNO is near the threshold:

for gravity, section in sections.items():
    megno = kr.megno(section.tops, 1500)
    print(f"gravity {gravity}: {megno}")
section.plot(indicator=megno, y="axial_momentum")

# %%
# Spin angle and axial momentum are conjugate, so the section preserves areas in this plane. The
# chaotic motions in the curves of the indicator leave the line to which regular motions tend:

megno.plot()
