"""Compute the motion of a free body with DART."""

import dartpy
import numpy as np
from case import write_motion


def simulate(mass, moments, q, w, step, variant):
    world = dartpy.simulation.World()
    world.setGravity([0, 0, 0])
    world.setTimeStep(step)
    skeleton = dartpy.dynamics.Skeleton()
    joint, body = skeleton.createFreeJointAndBodyNodePair()
    body.setInertia(dartpy.dynamics.Inertia(mass, np.zeros(3), np.diag(moments)))
    start = dartpy.math.Isometry3()
    start.set_quaternion(dartpy.math.Quaternion(*q))
    joint.setRelativeTransform(start)
    joint.setRelativeSpatialVelocity(
        np.concatenate([w, np.zeros(3)]), dartpy.dynamics.Frame.World()
    )
    world.addSkeleton(skeleton)
    while True:
        yield body.getTransform().quaternion().wxyz(), body.getAngularVelocity()
        world.step()


if __name__ == "__main__":
    write_motion(simulate)
