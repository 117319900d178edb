"""
Why does a top draw loops, cusps or waves?
==========================================

Let go from rest, the axis falls, and comes to rest again in cusps. Pushed forwards it goes in
waves, pushed backwards it loops. Only the start of the precession differs.
"""

import kreisel as kr
import numpy as np

top = kr.Body.cone(radius=0.03, height=0.06, pivot=(0, 0, 0), mass=0.1)


def begun(precession):
    return kr.Scene.spinning(top, spin=200, tilt=0.5, precession=precession, gravity=9.81)


t = np.linspace(0, 1.5, 3000)
kr.plot([kr.solve(begun(rate), t) for rate in (-8, 0, 8)], degrees=True)

# %%
# The broken lines are the angles between which the axis stays. They come from the closed form, not
# from the path, and so does the name of the course:

for rate in (-8, 0, 8):
    motion = kr.exact(begun(rate))
    low, high = np.degrees([motion.least_nutation, motion.greatest_nutation])
    print(f"{rate:3} rad/s: {motion.course:6} between {low:.2f} and {high:.2f} degrees")

# %%
# A live one, begun with cusps:

kr.view(begun(0), speed=0.3, open=False)
