// Camera moves without a mouse, and the home view.
import { Spherical, Vector3 } from "three";
import { simulation } from "./core.js";

// Show the whole scene from the home position.
export function showHomeView(view) {
  view.side = undefined;
  view.build(view.page, true);
  view.orbit.update();
}
// Turn the camera about its target by angles in radians.
export function orbitBy(view, across, up) {
  const { orbit, camera } = view;
  const seen = camera.position.clone().sub(orbit.target);
  // Spherical coordinates of three.js have their pole at y.
  const at = new Spherical().setFromVector3(new Vector3(seen.y, seen.z, seen.x));
  at.theta += across;
  at.phi = Math.min(Math.max(at.phi - up, 0.01), orbit.maxPolarAngle);
  const { x, y, z } = new Vector3().setFromSpherical(at);
  camera.position.set(z, x, y).add(orbit.target);
  view.isHome = false;
  orbit.update();
}
// Multiply the distance to the target by `factor`.
export function zoomBy(view, factor) {
  const { orbit, camera } = view;
  if (camera.isOrthographicCamera) camera.zoom = Math.min(10, Math.max(0.2, camera.zoom / factor));
  else camera.position.sub(orbit.target).multiplyScalar(factor).add(orbit.target);
  camera.updateProjectionMatrix();
  orbit.update();
  view.isHome = false;
  view.isDirty = true;
}
export function panBy(view, part) {
  const { orbit, camera } = view;
  const right = new Vector3().setFromMatrixColumn(camera.matrixWorld, 0);
  right.multiplyScalar(part * camera.position.distanceTo(orbit.target));
  for (const place of [camera.position, orbit.target]) place.add(right);
  view.isHome = false;
  orbit.update();
}
// Shrink arrows whose tips left the picture. Return whether any did.
export function fitArrows(view) {
  const [w, h] = view.pixels;
  const isOut = (arrow) => {
    const [x, y] = view.project(arrow.tip.getWorldPosition(new Vector3()));
    return x < 0 || y < 0 || x > w || y > h;
  };
  view.world.updateMatrixWorld(true);
  const [momentum, velocity] = simulation.getReach(0);
  const out = (part) => view.tops.some((top) => top[part] && isOut(top[part]));
  const [longMomentum, longVelocity] = [out("m"), out("w")];
  if (longMomentum) view.momentumZoom = 3.2 / momentum;
  if (longVelocity) view.velocityZoom = 2.4 / velocity;
  if (longMomentum || longVelocity) view.draw();
  return longMomentum || longVelocity;
}
