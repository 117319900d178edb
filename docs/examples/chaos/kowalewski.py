r"""
What is conserved in the motion of Kowalewski's top?
====================================================

The apex of Kowalewski's top seems to move irregularly. However, her top has a fourth integral,
:math:`K = |(\omega_1 + i \omega_2)^2 + c\,(\gamma_1 + i \gamma_2)|^2`, and its motion is regular.
"""

import kreisel as kr
import matplotlib.pyplot as plt
import numpy as np

scene = kr.scenes.kowalewski
t = np.linspace(0, 200, 8000)
path = kr.solve(scene, t)
kr.plot(path)

# %%
# The lower chart shows that the integral is constant. The upper chart shows the momentum about the
# axis, which only a Lagrange top conserves:

figure, (above, below) = plt.subplots(2, 1, sharex=True, figsize=(7.6, 4), layout="constrained")
above.plot(t, path.axial_momentum, linewidth=0.7)
above.set_ylabel("<m, apex>")
below.plot(t, path.kowalewski / path.kowalewski[0] - 1, linewidth=0.7, color="tab:orange")
below.set(xlabel="time", ylabel="K, relative change")

# %%
# Nearby initial states separate linearly, as in any regular motion. MEGNO then tends to 2, or to 0
# if they do not separate at all. In the case of Goryachev and Chaplygin, the additional integral
# exists only if the vertical momentum is zero:

print(f"Kowalewski: {kr.chaos(scene, 20000).megno:.3f}")
case = kr.scenes.goryachev_chaplygin
print(f"Goryachev and Chaplygin: {kr.chaos(case, 20000).megno:.3f}")
x, y, _ = case.momentum
print(f"with a vertical momentum: {kr.chaos(case.replace(momentum=(x, y, 1.5)), 20000).megno:.1f}")

# %%
# The viewer shows Kowalewski's top and can also draw a chart of K:

kr.view(scene, open=False)
