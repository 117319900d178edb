"""Compute the motion of a free body with Drake, in discrete or in continuous time.

The variant "accurate" asks for ten digits; "continuous" has the default accuracy, three digits.
"""

import numpy as np
from case import write_motion
from pydrake.common.eigen_geometry import Quaternion
from pydrake.math import RigidTransform
from pydrake.multibody.math import SpatialVelocity
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.multibody.tree import SpatialInertia, UnitInertia
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder


def simulate(mass, moments, q, w, step, variant):
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, step if variant == "discrete" else 0.0)
    inertia = UnitInertia(*(np.array(moments) / mass))
    body = plant.AddRigidBody("body", SpatialInertia(mass, np.zeros(3), inertia))
    plant.mutable_gravity_field().set_gravity_vector(np.zeros(3))
    plant.Finalize()
    simulator = Simulator(builder.Build())
    if variant == "accurate":
        simulator.get_mutable_integrator().set_target_accuracy(1e-10)
    context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    plant.SetFreeBodyPose(context, body, RigidTransform(Quaternion(q), np.zeros(3)))
    plant.SetFreeBodySpatialVelocity(context, body, SpatialVelocity(w, np.zeros(3)))
    for i in range(10**9):
        simulator.AdvanceTo(i * step)
        velocity = plant.EvalBodySpatialVelocityInWorld(context, body).rotational()
        yield plant.EvalBodyPoseInWorld(context, body).rotation().ToQuaternion().wxyz(), velocity


if __name__ == "__main__":
    write_motion(simulate, ("discrete", "continuous", "accurate"))
