r"""
What is conserved where nothing seems to be?
============================================

The apex of Kowalewski's top looks lawless. But her top has a fourth integral,
:math:`K = |(\omega_1 + i \omega_2)^2 + c\,(\gamma_1 + i \gamma_2)|^2`, and is as ordered as any.
"""

import kreisel as kr
import matplotlib.pyplot as plt
import numpy as np

scene = kr.scenes.kowalewski
t = np.linspace(0, 200, 8000)
path = kr.solve(scene, t)
kr.plot(path)

# %%
# The integral, beside the apex' momentum, which only a Lagrange top keeps:

figure, (above, below) = plt.subplots(2, 1, sharex=True, figsize=(7.6, 4), layout="constrained")
above.plot(t, path.axial_momentum, linewidth=0.7)
above.set_ylabel("<m, apex>")
below.plot(t, path.kowalewski / path.kowalewski[0] - 1, linewidth=0.7, color="tab:orange")
below.set(xlabel="time", ylabel="K, relative change")

# %%
# Nearby starts part linearly, as those of ordered motions do: MEGNO goes to 2, or to 0
# where they do not part at all. In Goryachev and
# Chaplygin's case there is such an integral only where the vertical momentum is zero:

print(f"Kowalewski: {kr.megno(scene, 20000).value:.3f}")
case = kr.scenes.goryachev_chaplygin
print(f"Goryachev and Chaplygin: {kr.megno(case, 20000).value:.3f}")
x, y, _ = case.momentum
print(f"with a vertical momentum: {kr.megno(case.replace(momentum=(x, y, 1.5)), 20000).value:.1f}")

# %%
# Her top in the page, which draws the chart of K as well:

kr.view(scene, open=False)
