"""Compute the motion of a free body with Bullet, from Python."""

import pybullet
from case import write_motion


def simulate(mass, moments, q, w, step, variant):
    pybullet.connect(pybullet.DIRECT)
    pybullet.setGravity(0, 0, 0)
    pybullet.setTimeStep(step)
    shape = pybullet.createCollisionShape(pybullet.GEOM_BOX, halfExtents=[0.5, 0.3, 0.1])
    maximal = int(variant == "maximal")
    body = pybullet.createMultiBody(mass, shape, useMaximalCoordinates=maximal)
    settings = {"linearDamping": 0, "angularDamping": 0, "maxJointVelocity": 1e4}
    sleep = {"activationState": pybullet.ACTIVATION_STATE_DISABLE_SLEEPING}
    pybullet.changeDynamics(body, -1, localInertiaDiagonal=moments, **settings, **sleep)
    pybullet.resetBasePositionAndOrientation(body, (0, 0, 0), (*q[1:], q[0]))
    pybullet.resetBaseVelocity(body, (0, 0, 0), w)
    while True:
        x, y, z, s = pybullet.getBasePositionAndOrientation(body)[1]
        yield (s, x, y, z), pybullet.getBaseVelocity(body)[1]
        pybullet.stepSimulation()


if __name__ == "__main__":
    write_motion(simulate, ("default", "maximal"))
