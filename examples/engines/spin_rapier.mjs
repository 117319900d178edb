// Computes the motion of a free body with Rapier.
import RAPIER from "@dimforge/rapier3d-compat";
import { writeMotion } from "./case.mjs";

await RAPIER.init();
await writeMotion(function* (mass, moments, q, w, step) {
  const world = new RAPIER.World({ x: 0, y: 0, z: 0 });
  world.timestep = step;
  const vector = ([x, y, z]) => ({ x, y, z });
  const attitude = { w: q[0], x: q[1], y: q[2], z: q[3] };
  const body = world.createRigidBody(
    RAPIER.RigidBodyDesc.dynamic()
      .setRotation(attitude)
      .setAngvel(vector(w))
      .setCanSleep(false)
      .setAdditionalMassProperties(mass, vector([0, 0, 0]), vector(moments), { w: 1, x: 0, y: 0, z: 0 }),
  );
  for (;;) {
    const r = body.rotation();
    const v = body.angvel();
    yield { q: [r.w, r.x, r.y, r.z], w: [v.x, v.y, v.z] };
    world.step();
  }
});
