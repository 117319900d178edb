"""
When exactly is the axis lowest?
================================

Events are found on the polynomial that each step of the Taylor series is: none is missed, and their
times are as exact as the path.
"""

import kreisel as kr
import numpy as np

top = kr.Body.cone(radius=0.03, height=0.06, pivot=(0, 0, 0), mass=0.1)
scene = kr.Scene.spinning(top, spin=200, tilt=0.5, precession=-8, gravity=9.81)
low, turn = kr.events.nutation(direction=1), kr.events.loop()
path = kr.solve(scene, np.linspace(0, 1, 3000), events=[low, turn])
kr.plot(path, degrees=True)

# %%
# The orange points are the events. The closed form of this top knows when it is lowest, and how
# long it takes from there to the next time:

motion = kr.exact(scene)
lows = path.events.t[path.events.which == 0]
truth = motion.t_greatest + motion.period * np.arange(len(lows))
print(f"{len(lows)} lowest points, off by {np.abs(lows - truth).max():.1e}")
print(f"{(path.events.which == 1).sum()} times the apex turns back: two for each loop")

# %%
# Any quadratic function of the state can be an event, and end the path: here the third time at
# which the axis goes through a plane from one side to the other.

east = kr.events.plane((1, 0, 0), of="apex", direction=1, most=3, terminal=True)
print(kr.solve(scene, 100, events=east).events.t)
