"""
When exactly is the axis lowest?
================================

Events are found on the polynomial that each step of the Taylor series is: none is missed, and their
times are as exact as the path.
"""

import kreisel as kr
import numpy as np

scene = kr.scenes.thesis
low, turn = kr.events.nutation(direction=1), kr.events.loop()
path = kr.solve(scene, np.linspace(0, 30, 3000), events=[low, turn])
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
# Any quadratic function of the state can be an event, and end the path:

half = kr.events.crossing("spin", 0.0, terminal=True)
level = kr.events.plane((0, 0, 1), of="apex", terminal=True)
print(kr.solve(scene, 100, events=[half, level]))
