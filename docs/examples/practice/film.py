"""
How do I make a film of my top?
===============================

``path.animate()`` draws the moving body with the trace of its axis. A notebook displays the
animation, and ``path.animate("top.gif")`` writes it to a file.
"""

import kreisel as kr
import numpy as np

body = kr.Body.cone(radius=0.03, height=0.06, pivot=(0, 0, 0), mass=0.1)
scene = kr.Scene.spinning(body, spin=200, tilt=0.6, gravity=9.81)
path = kr.solve(scene, np.linspace(0, 0.5, 900))
path.animate(fps=15, size=360, time_unit="s")

# %%
# ``kr.plot`` draws a still picture of the same path:

kr.plot(path, time_unit="s")

# %%
# In the animation the spin looks too slow, because the top turns more than once between two frames.
# The viewer shows the motion at any speed, and lets you drag the top:

kr.view(scene, speed=0.05, open=False)
