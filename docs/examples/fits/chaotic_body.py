"""
Can a chaotic motion be fitted?
===============================

The attitudes of a chaotic top are measured with an error of 0.01 rad for 15 Lyapunov times, in
which errors grow by a factor of three million. No trajectory from a guessed initial state fits all
measurements. The fit therefore divides the motion into pieces whose ends must meet. Errors grow
little within each piece, and the fit determines the ratios of the moments to about one part in a
thousand.
"""

import kreisel as kr
import matplotlib.pyplot as plt
import numpy as np

top = kr.scenes.asymmetric
end = 15 / kr.chaos(top, 2000).lyapunov
t = np.linspace(0, end, 900)
path = kr.solve(top, t)

rng = np.random.default_rng(3)
half_rotation = 0.005 * rng.normal(size=(3, len(t)))  # half of a small rotation vector
error = (np.sqrt(1 - (half_rotation**2).sum(axis=0)), *half_rotation)
attitudes = np.stack(kr.quaternion.multiply(tuple(path.q.T), error), axis=-1)

# %%
# The guess has moments that are wrong by up to 50 % and a wrong initial state.

moments = np.array(top.body.moments)
guess = top.replace(
    body=kr.Body(mass=1, inertia=moments * (1.5, 0.9, 1.05), com=top.body.com, unphysical=True),
    velocity=(0, 0, 1),
)
fit = kr.fit(guess, kr.Record(t, {"q": attitudes}, sigma=0.01), free=("start", "moments", "com"))
print(fit)
for name, (value, sigma) in fit.moment_ratios.items():
    i, j = int(name[1]) - 1, int(name[6]) - 1
    print(f"{name} = {value:.5f} +- {sigma:.5f}, truth {moments[i] / moments[j]:.5f}")

# %%
# The fitted pieces follow the measurements to the end. A motion from the fitted initial state alone
# departs from the measurements when the error of this state has grown to the size of the motion.

alone = kr.solve(fit.scene, t)
figure, axes = plt.subplots()
axes.semilogy(t, kr.attitude_error(fit.path.q, path.q), label="pieces that meet")
axes.semilogy(t, kr.attitude_error(alone.q, path.q), label="from the start alone")
axes.set(xlabel="time", ylabel="attitude error [rad]")
axes.legend()
