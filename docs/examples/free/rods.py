"""
What does a top have to do with a bent wire?
============================================

According to Kirchhoff's analogy, the tangent of an elastic rod in equilibrium turns along the rod
as the axis of a top turns in time. Every motion of a top therefore corresponds to the shape of a
rod.
"""

import kreisel as kr
import matplotlib.pyplot as plt
import numpy as np

body = kr.Body.symmetric(mass=1, i1=1, i3=0.6, height=1, unphysical=True)
starts = {
    "helix": kr.Scene.spinning(body, spin=3.2, tilt=1.0, steady=True, gravity=1),
    "loops": kr.Scene.spinning(body, spin=2.5, tilt=0.9, precession=-1.5, gravity=1),
    "cusps": kr.Scene.spinning(body, spin=3.0, tilt=0.9, gravity=1),
    "elastica": kr.Scene(
        body, velocity=(1.3, 0, 0), attitude=(0.2, np.sqrt(0.96), 0, 0), gravity=1
    ),
}
figure, axes = plt.subplots(1, 4, figsize=(9.2, 3.6), layout="constrained")
for chart, (name, scene) in zip(axes, starts.items(), strict=True):
    path = kr.solve(scene, np.linspace(0, 16, 1600))
    kr.rod(path).plot(chart, thickness=0.28, elevation=12, azimuth=35)
    chart.set(title=name, anchor="N")

# %%
# In a plane the rod is Euler's elastica, and the top is a pendulum. The rod of a body without
# symmetry is stiffer in one direction than in the other, so it is drawn with an elliptical
# cross-section. A dot marks the beginning of the rod, and a bar shows the scale:

flat = kr.Body.cuboid(half=(0.9, 0.35, 1), pivot=(0, 0, -1))
path = kr.solve(kr.Scene(flat, momentum=(1.2, -3, 7), gravity=1), np.linspace(0, 14, 900))
rod = kr.rod(path)
print(rod)
rod.plot(elevation=15)

# %%
# The elastic energy of the rod corresponds to the kinetic energy of the top. The sum of the elastic
# energy and the energy of the load is constant along the rod, as the energy of the top is constant
# in time:

print(np.ptp(rod.elastic_energy_density + path.potential) / rod.elastic_energy_density.max())
