// Computes the motion of a free body with Jolt; the variant "gyroscopic" switches its term on.
import initJolt from "jolt-physics";
import { writeMotion } from "./case.mjs";

const Jolt = await initJolt();
await writeMotion(function* (mass, moments, q, w, step, variant) {
  const settings = new Jolt.JoltSettings();
  settings.mMaxWorkerThreads = 1;
  settings.mObjectLayerPairFilter = new Jolt.ObjectLayerPairFilterTable(1);
  const layers = new Jolt.BroadPhaseLayerInterfaceTable(1, 1);
  layers.MapObjectToBroadPhaseLayer(0, new Jolt.BroadPhaseLayer(0));
  settings.mBroadPhaseLayerInterface = layers;
  settings.mObjectVsBroadPhaseLayerFilter = new Jolt.ObjectVsBroadPhaseLayerFilterTable(
    layers, 1, settings.mObjectLayerPairFilter, 1,
  );
  const engine = new Jolt.JoltInterface(settings);
  const system = engine.GetPhysicsSystem();
  system.SetGravity(new Jolt.Vec3(0, 0, 0));
  const shape = new Jolt.BoxShape(new Jolt.Vec3(0.5, 0.3, 0.1), 0);
  const start = [new Jolt.RVec3(0, 0, 0), new Jolt.Quat(q[1], q[2], q[3], q[0])];
  const description = new Jolt.BodyCreationSettings(shape, ...start, Jolt.EMotionType_Dynamic, 0);
  description.mLinearDamping = description.mAngularDamping = 0;
  description.mAllowSleeping = false;
  description.mMaxAngularVelocity = 1000;
  description.mApplyGyroscopicForce = variant === "gyroscopic";
  const body = system.GetBodyInterface().CreateBody(description);
  const motion = body.GetMotionProperties();
  motion.SetInverseMass(1 / mass);
  motion.SetInverseInertia(new Jolt.Vec3(...moments.map((x) => 1 / x)), new Jolt.Quat(0, 0, 0, 1));
  system.GetBodyInterface().AddBody(body.GetID(), Jolt.EActivation_Activate);
  body.SetAngularVelocity(new Jolt.Vec3(...w));
  for (;;) {
    const r = body.GetRotation();
    const v = body.GetAngularVelocity();
    yield { q: [r.GetW(), r.GetX(), r.GetY(), r.GetZ()], w: [v.GetX(), v.GetY(), v.GetZ()] };
    engine.Step(step, 1);
  }
});
