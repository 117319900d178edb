r"""
Does this satellite stay upright?
=================================

On a circular orbit, the gravity gradient may hold a satellite upright. Whether it does depends on
two ratios of the moments of inertia, as DeBra and Delp showed in 1961. Here each point of their
diagram is a satellite that starts almost upright.
"""

import kreisel as kr
import matplotlib.pyplot as plt
import numpy as np

# %%
# The axes are roll (along the orbit), pitch (along the orbital momentum) and yaw (up). The ratios
# :math:`\sigma_1 = (I_2 - I_3) / I_1` and :math:`\sigma_3 = (I_2 - I_1) / I_3` lie between -1 and
# 1. If the satellite moves by one radian in a unit of time, the gradient is 3.

count = 40
ratios = (np.arange(count) + 0.5) / count * 2 - 1
roll, yaw = np.meshgrid(ratios, ratios, indexing="ij")
moments = np.stack([1 - yaw, 1 - roll * yaw, 1 - roll], axis=-1)
body = kr.Body(1, moments[..., None] * np.eye(3), (0, 0, 0))
nearly_upright = np.array([1, 1e-4, 1e-4, 1e-4]) / np.sqrt(1 + 3e-8)
tops = kr.Scene(body, velocity=(0, 0, 0), attitude=nearly_upright, gradient=3, turning=(0, 1, 0))

# %%
# The largest angle between the yaw axis and the vertical in 15 orbits:

times = np.linspace(0, 30 * np.pi, 301)
tilt = kr.reduce(tops, times, {"nutation": "max"})["nutation"]["max"]

# %%
# Pitch is stable if :math:`\sigma_1 > \sigma_3`, and roll and yaw, which are coupled, if
# :math:`\sigma_1 \sigma_3 > 0` and :math:`1 + 3 \sigma_1 + \sigma_1 \sigma_3 > 4
# \sqrt{\sigma_1 \sigma_3}`. The right diagram shows this condition.

product = roll * yaw
is_stable = (roll > yaw) & (product > 0)
is_stable &= 1 + 3 * roll + product > 4 * np.sqrt(np.maximum(product, 0))
figure, axes = plt.subplots(1, 2, figsize=(7.6, 3.8), layout="constrained", sharey=True)
image = axes[0].pcolormesh(ratios, ratios, np.log10(tilt).T, cmap="viridis")
axes[1].pcolormesh(ratios, ratios, np.where(is_stable, 0.0, 1.0).T, cmap="viridis")
figure.colorbar(image, ax=axes[0], label="log10 of the largest tilt [rad]")
for panel, title in zip(axes, ("computed", "DeBra and Delp"), strict=True):
    panel.set(xlabel=r"$\sigma_1$", title=title, aspect="equal")
axes[0].set_ylabel(r"$\sigma_3$")

# %%
# The largest region has the pitch axis of the largest and the yaw axis of the smallest moment. The
# small region at the lower left was found by DeBra and Delp. Tops beside a boundary grow slowly:

stays = tilt < 0.01
print(f"{(stays == is_stable).mean():.1%} of the satellites behave as the formula says")
