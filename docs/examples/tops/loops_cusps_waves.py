"""
Why does a top draw loops, cusps or waves?
==========================================

An axis that is released from rest falls, and comes to rest again in cusps. An axis that is pushed
forwards moves in waves, and one that is pushed backwards moves in loops. Only the initial
precession differs.
"""

import kreisel as kr
import numpy as np

top = kr.Body.cone(radius=0.03, height=0.06, pivot=(0, 0, 0), mass=0.1)


def start_top(precession):
    return kr.Scene.spinning(top, spin=350, tilt=0.5, precession=precession, gravity=9.81)


t = np.linspace(0, 1.3, 3000)
kr.plot([kr.solve(start_top(rate), t) for rate in (-12, 0, 3)], time_unit="s")

# %%
# The dashed lines are the angles between which the axis moves. The closed form provides these
# angles and the type of motion:

for rate in (-12, 0, 3):
    motion = kr.exact(start_top(rate))
    low, high = np.degrees([motion.least_nutation, motion.greatest_nutation])
    print(f"{rate:3} rad/s: {motion.motion_type:6} between {low:.2f} and {high:.2f} degrees")

# %%
# The viewer shows a top that starts with cusps:

kr.view(start_top(0), speed=0.3, open=False)
