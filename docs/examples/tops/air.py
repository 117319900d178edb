r"""
Why does every top fall in the end?
===================================

Air drag slows the spin. The top stands while its spin exceeds the critical spin, and falls soon
after the spin has dropped below the critical spin.
"""

import kreisel as kr
import matplotlib.pyplot as plt
import numpy as np

cone = kr.Body.cone(radius=0.03, height=0.06, pivot=(0, 0, 0), mass=0.1)
upright = kr.Scene.spinning(cone, spin=400, tilt=np.radians(1), gravity=9.81)
critical = kr.exact(upright).critical_spin
drag = 4e-7  # [kg m^2 / s]
falls = kr.events.crossing("apex_z", 0.0, direction=-1, terminal=True)  # the axis is level
end = kr.solve(upright.replace(damping=drag), 300, events=falls)
path = end(np.linspace(0, end.t[-1], 4000))
print(f"its axis is level after {end.t[-1]:.2f} s")

figure, (above, below) = plt.subplots(2, 1, sharex=True, figsize=(7.6, 5), layout="constrained")
above.plot(path.t, path.spin)
above.axhline(critical, color="tab:gray", linestyle="--")
above.text(0.5, critical + 8, "critical spin", color="tab:gray")
above.set_ylabel("spin [rad/s]")
below.plot(path.t, np.degrees(path.nutation), linewidth=0.7)
below.set(xlabel="time [s]", ylabel="nutation [degrees]")

# %%
# A damped top has no closed form, so ``auto`` uses the Taylor series. The polynomials of the series
# determine the time of the final event to the last digit. The only torque about the axis is the
# drag, :math:`I_3 \dot\omega_3 = - d\, \omega_3`, so the spin decays exponentially:

rate = drag / cone.moments[2]
print("spin, largest relative deviation from an exponential:", end="")
print(f" {np.abs(path.spin / (400 * np.exp(-rate * path.t)) - 1).max():.1e}")
