"""
When exactly is the axis lowest?
================================

Events are roots of the polynomials of the Taylor method. No event is missed, and the times of
events are as accurate as the path.
"""

import kreisel as kr
import numpy as np

top = kr.Body.cone(radius=0.03, height=0.06, pivot=(0, 0, 0), mass=0.1)
scene = kr.Scene.spinning(top, spin=200, tilt=0.5, precession=-8, gravity=9.81)
low, turn = kr.events.nutation(direction=1), kr.events.loop()
path = kr.solve(scene, np.linspace(0, 1, 3000), events=[low, turn])
kr.plot(path)

# %%
# The orange points are the events. The closed form of this top also gives the time of the first
# lowest point and the period:

motion = kr.exact(scene)
lows = path.events.t[path.events.which == 0]
truth = motion.t_greatest + motion.period * np.arange(len(lows))
print(f"{len(lows)} lowest points, largest deviation {np.abs(lows - truth).max():.1e}")
print(f"{(path.events.which == 1).sum()} times the precession reverses: twice in each loop")

# %%
# Any quadratic function of the state can be an event and can end the path. Here the path ends when
# the axis crosses a plane for the third time in the same direction:

east = kr.events.plane((1, 0, 0), of="apex", direction=1, max_count=3, terminal=True)
print(kr.solve(scene, 100, events=east).events.t)
