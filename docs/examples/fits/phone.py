"""
What can a phone learn about itself when it is thrown into the air?
===================================================================

A phone that is thrown into the air is a free body. Its gyroscope measures the angular velocity a
hundred times a second. The fit determines the ratios of the moments of inertia to a few parts in a
thousand, but not the moments: if all moments were doubled, the phone would rotate in the same way.
"""

import kreisel as kr
import numpy as np

phone = kr.Body.cuboid(half=(0.036, 0.075, 0.004), pivot=(0, 0, 0), mass=0.19)  # metre, kilogram
toss = kr.Scene(phone, body_velocity=(14, 0.6, 0.8), gravity=0)

t = np.arange(0, 0.9, 0.01)
noise = np.random.default_rng(5).normal(size=(len(t), 3))
velocity = kr.solve(toss, t).body_velocity + 0.05 * noise + (0.03, -0.05, 0.02)

# %%
# The fit also estimates the unknown bias of the gyroscope. The noise is estimated from the
# residuals.

record = kr.Record(t, {"body_velocity": velocity}, free="bias")
guess = kr.Scene(kr.Body(1, (2, 1, 2.5), com=(0, 0, 0)), body_velocity=(1, 1, 1), gravity=0)
fit = kr.fit(guess, record)
print(fit)

# %%
# The ratios agree with those of a cuboid. The phone is almost a plate, because its largest moment
# is nearly the sum of the other two.

for name, (value, error) in fit.moment_ratios.items():
    i, j = int(name[1]) - 1, int(name[6]) - 1
    exact = phone.moments[i] / phone.moments[j]
    print(f"{name} = {value:.4f} +- {error:.4f}, cuboid {exact:.4f}")

fit.plot(time_unit="s")
