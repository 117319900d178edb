"""
How can a free body tumble?
===========================

Seen from the body, the angular momentum of a free body stays on a sphere, because its size is
constant, and on an ellipsoid, because the energy is constant. The intersections of the sphere and
the ellipsoid are Poinsot's polhodes, which represent all possible motions.
"""

import kreisel as kr
import matplotlib.pyplot as plt
import numpy as np

body = kr.Body.cuboid(half=(1.0, 0.6, 0.2), pivot=(0, 0, 0))
size = np.mean(body.moments)
angles = np.linspace(0.0, np.pi / 2, 9)[1:-1]
short, long = np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0])
middle = np.array([0.0, 1.0, 0.0])

figure = plt.figure(figsize=(5.6, 5.2))
axes = figure.add_subplot(projection="3d", computed_zorder=False)
u, v = np.mgrid[0 : 2 * np.pi : 60j, 0 : np.pi : 30j]
ball = 0.985 * np.array([np.cos(u) * np.sin(v), np.sin(u) * np.sin(v), np.cos(v)])
axes.plot_surface(*ball, color="#e9eef5", linewidth=0, zorder=0, shade=False)
eye = np.array([np.cos(0.5) * np.cos(0.7), np.cos(0.5) * np.sin(0.7), np.sin(0.5)])
axes.view_init(elev=np.degrees(0.5), azim=np.degrees(0.7))

for pole, colour in ((short, "tab:blue"), (long, "tab:green")):
    for angle in angles:
        for sign in (1, -1):
            start = sign * np.cos(angle) * pole + np.sin(angle) * middle
            motion = kr.exact(kr.Scene(body, body_momentum=size * start, gravity=0.0))
            m = motion(np.linspace(0, 2 * motion.period, 600)).body_momentum / size
            axes.plot(*np.where((m @ eye)[:, None] > -0.05, m, np.nan).T, color=colour, linewidth=1)
for sign in (1, -1):
    for offset in (1e-7, -1e-7):
        scene = kr.Scene(body, body_momentum=size * (sign * middle + offset * long), gravity=0.0)
        motion = kr.exact(scene)
        m = motion(np.linspace(0, motion.period, 4000)).body_momentum / size
        axes.plot(*np.where((m @ eye)[:, None] > -0.05, m, np.nan).T, color="tab:orange")
axes.set_box_aspect((1, 1, 1), zoom=1.4)
axes.set_axis_off()

# %%
# Blue curves surround the axis of the largest moment, and green curves the axis of the smallest
# moment. The orange separatrix divides them and crosses itself at the unstable middle axis. At a
# given magnitude of the momentum, the energy determines the curve:

for axis, name in ((long, "long"), (middle, "middle"), (short, "short")):
    scene = kr.Scene(body, body_momentum=size * axis, gravity=0.0)
    print(f"about the {name} axis: energy {kr.solve(scene, [0.0]).energy[0]:.4f}")
