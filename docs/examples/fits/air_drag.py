"""
How strongly does the air slow a spinning top?
==============================================

A top spins upright for 20 seconds. A tachometer measures its spin twice a second with an error of 1
rad/s, and a camera measures the tilt of its axis with an error of 2 mrad. The spin decays
exponentially, and the fit determines the damping about the axis to a few parts in a thousand. The
damping perpendicular to the axis affects only the small nutations, and is determined much less
accurately.
"""

import kreisel as kr
import numpy as np

body = kr.Body.symmetric(mass=0.1, i1=8e-5, i3=2.5e-5, height=0.02)  # kilogram, metre, second
truth = kr.Scene.spinning(body, spin=400, tilt=0.02, gravity=9.81, damping=(4e-6, 4e-6, 1.7e-6))

rng = np.random.default_rng(2)
t = np.arange(0, 20, 0.5)
path = kr.solve(truth, t)
tachometer = kr.Record(t, {"spin": path.spin + rng.normal(size=len(t))}, sigma=1)
camera = kr.Record(t, {"nutation": path.nutation + 0.002 * rng.normal(size=len(t))}, sigma=0.002)

# %%
# Parameters that are equal in the guess remain equal in the fit. The guess has one damping
# perpendicular to the axis and another about it.

guess = truth.replace(damping=(2e-6, 2e-6, 1e-6))
fit = kr.fit(guess, [tachometer, camera], free=("start", "damping"))
print(fit)
name = fit.names[-1]
print(f"about the axis: {fit.values[name]:.3e} +- {fit.error[name]:.1e}, truth 1.7e-06")

fit.plot(time_unit="s")
