"""
How do I make a film of my top?
===============================

``path.animate()`` draws the body in motion, with the trace of its axis; a notebook shows it, and
``path.animate("top.gif")`` makes a file.
"""

import kreisel as kr
import numpy as np

body = kr.Body.cone(radius=0.03, height=0.06, pivot=(0, 0, 0), mass=0.1)
scene = kr.Scene.spinning(body, spin=200, tilt=0.6, gravity=9.81)
path = kr.solve(scene, np.linspace(0, 0.5, 900))
path.animate(fps=20, size=360)

# %%
# A still picture of the same path:

kr.plot(path, degrees=True)

# %%
# Its spin looks slower than it is, for it turns further than once from one frame to the next. The
# page shows it with any speed, and can be taken by hand:

kr.view(scene, speed=0.05, open=False)
