r"""
Where does the motion of Kowalewski's top change qualitatively?
===============================================================

In units in which the moments are 2, 2, 1 and mass, gravity and lever arm are 1, the motion of a
Kowalewski top has three constants: the energy :math:`h`, the vertical momentum :math:`l`, and
:math:`k = \sqrt K` from Kowalewski's integral. Her variables :math:`w_1, w_2` move between zeros of

.. math:: (k^2 - w^2)\,\varphi(w), \qquad \varphi(w) = 2 (w + h)(w^2 + 1 - k^2) - l^2.

The motion changes qualitatively where two zeros coincide. There it belongs to one of Appelrot's
classes: it is steady or periodic, or approaches a steady or periodic motion. The lines below show
where two zeros of phi coincide (solid), where a zero of phi is k or -k (dashed), and where k = -k.
"""

import kreisel as kr
import matplotlib.pyplot as plt
import numpy as np

body = kr.Body(mass=1, inertia=(2, 2, 1), com=(1, 0, 0), unphysical=True)


def draw_curves(chart, vertical):
    w = -np.geomspace(1e-4, 50, 4000)  # phi and its derivative vanish at w
    for root in (vertical, -vertical):
        h = -w + root / (2 * np.sqrt(-w))
        k = np.sqrt(np.maximum(1 + w**2 + 2 * w * (w + h), 0))
        is_met = (k > 0) & (h > vertical**2 / 2 - k)  # no top has less energy
        chart.plot(h[is_met], k[is_met], "black", linewidth=0.9)
    corner = k[is_met].min()
    for side, most in ((-1, corner), (1, 4)):  # phi vanishes at k or -k
        line = np.array([0, most])
        h = vertical**2 / 2 + side * line
        chart.plot(h, line, "black", linewidth=0.9, linestyle=(0, (5, 2)))
    chart.axhline(0, color="black", linewidth=1.5)  # k and -k meet: Delone's class


# %%
# The points are random tops with the same vertical momentum. Their colour is the ratio of the two
# frequencies of the motion seen from the body, which the closed form provides:


def draw_tops(chart, vertical):
    rows = []
    least = vertical**2 / 4 - 1  # the energy of a hanging top that turns about the vertical
    for i, energy in enumerate(np.linspace(least, 3, 71)[1:]):
        tops = kr.starts(body, energy=energy, vertical=vertical, n=11, seed=i, gravity=1)
        k = np.sqrt(kr.solve(tops, [0.0], want=("kowalewski",)).kowalewski[:, 0])
        for j in range(tops.size):
            try:
                first, second, _ = kr.exact(tops[j]).frequencies
            except ValueError:  # the zeros are too near to each other
                continue
            rows.append((energy, k[j], second / first))
    h, k, ratio = np.transpose(rows)
    return chart.scatter(
        h, k, c=np.log2(ratio), s=14, linewidths=0, cmap="viridis", vmin=-2, vmax=3
    )


figure, charts = plt.subplots(
    1, 3, figsize=(9.6, 4.2), sharex=True, sharey=True, layout="constrained"
)
for chart, vertical in zip(charts, (0.3, 0.8, 1.3), strict=True):
    points = draw_tops(chart, vertical)
    draw_curves(chart, vertical)
    chart.set(title=f"l = {vertical}", xlabel="energy h", xlim=(-1.3, 3), ylim=(-0.05, 3))
    chart.grid(False)
charts[0].set_ylabel("k")
figure.colorbar(points, label="log2 of the ratio of frequencies")

# %%
# Within a region the ratio changes smoothly. At a separatrix one period becomes infinite, but only
# as the logarithm of the distance from the separatrix. The tori on the two sides of a separatrix
# differ, so the colour jumps there.
