// Computes the motion of a free body with Rapier.
import RAPIER from "@dimforge/rapier3d-compat";
import { writeMotion } from "./case.mjs";

await RAPIER.init();
await writeMotion(function* (mass, moments, q, w, step) {
  const world = new RAPIER.World({ x: 0, y: 0, z: 0 });
  world.timestep = step;
  const vector = ([x, y, z]) => ({ x, y, z });
  const quaternion = ([w, x, y, z]) => ({ w, x, y, z });
  const centre = vector([0, 0, 0]);
  const axes = quaternion([1, 0, 0, 0]);
  const body = world.createRigidBody(
    RAPIER.RigidBodyDesc.dynamic()
      .setRotation(quaternion(q))
      .setAngvel(vector(w))
      .setCanSleep(false)
      .setAdditionalMassProperties(mass, centre, vector(moments), axes),
  );
  for (;;) {
    const r = body.rotation();
    const v = body.angvel();
    yield { q: [r.w, r.x, r.y, r.z], w: [v.x, v.y, v.z] };
    world.step();
  }
});
