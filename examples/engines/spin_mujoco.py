"""Compute the motion of a free body with MuJoCo; the variants are its integrators."""

import mujoco
from case import turn, write_motion

MODEL = """
<mujoco>
  <option gravity="0 0 0" timestep="{step}" integrator="{integrator}"/>
  <worldbody>
    <body>
      <freejoint/>
      <inertial pos="0 0 0" mass="{mass}" diaginertia="{moments}"/>
    </body>
  </worldbody>
</mujoco>"""


def simulate(mass, moments, q, w, step, variant):
    text = " ".join(map(repr, moments))
    model = MODEL.format(step=step, integrator=variant, mass=mass, moments=text)
    model = mujoco.MjModel.from_xml_string(model)
    data = mujoco.MjData(model)
    data.qpos[3:] = q
    data.qvel[3:] = turn(q * [1, -1, -1, -1], w)  # along the axes of the body
    while True:
        yield data.qpos[3:].copy(), turn(data.qpos[3:], data.qvel[3:])
        mujoco.mj_step(model, data)
        if data.warning[mujoco.mjtWarning.mjWARN_BADQACC].number:
            return  # MuJoCo found a number that is not finite, and returned to the start


if __name__ == "__main__":
    write_motion(simulate, ("Euler", "implicit", "implicitfast", "RK4"))
