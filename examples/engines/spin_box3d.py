"""Compute the motion of a free body with Box3D, which the package robox3d contains."""

import numpy as np
import robox3d
from case import write_motion


def simulate(mass, moments, q, w, step, variant):
    with robox3d.World(gravity=(0, 0, 0), substeps=4, enable_sleep=False) as world:
        body = world.create_body(rotation=(*q[1:], q[0]))
        body.add_sphere(0.1)
        body.set_mass_data(mass, (0, 0, 0), np.diag(moments))
        body.angular_velocity = w
        while True:
            x, y, z, s = body.rotation
            yield (s, x, y, z), body.angular_velocity
            world.step(step)


if __name__ == "__main__":
    write_motion(simulate)
