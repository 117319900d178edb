// Starts given by tilt and spin instead of attitude and momentum.
import { Quaternion } from "three";
import { makeBody } from "./core.js";

const isNumber = (x) => typeof x === "number" && Math.abs(x) <= 1e12;
const isStart = ({ tilt, spin, precession = 0, ...rest }) =>
  isNumber(tilt) &&
  tilt >= 0 &&
  tilt <= 180 &&
  isNumber(spin) &&
  (isNumber(precession) || ["slow", "fast"].includes(precession)) &&
  !Object.keys(rest).length;
// Return attitude and momentum of a start: tilt in degrees, spin about the apex, and precession
// about the vertical, 0 by default. "slow" and "fast" select a steady precession W, a root of I1
// W^2 cos - (I3 spin + rotor) W + mass gravity height = 0 in the inertial frame.
export function computeStart({ body, gravity, rotor, turning = [0, 0, 0] }, start) {
  if (!isStart(start)) throw new Error(`start cannot be ${JSON.stringify(start).slice(0, 60)}`);
  const made = makeBody(body, rotor);
  const { mass, moments, com } = made;
  const [across, , along] = moments;
  const tilt = (start.tilt * Math.PI) / 180;
  const [cos, sin] = [Math.cos(tilt), Math.sin(tilt)];
  const [x, y, about] = turning;
  if (typeof start.precession === "string" && (x || y))
    throw new Error("there is no steady precession on a support that turns in this way");
  // Rates as seen from the inertial frame.
  const [axial, torque] = [along * (start.spin + about * cos) + made.rotor[2], mass * gravity * com[2]];
  const size = Math.sqrt(axial * axial - 4 * across * cos * torque);
  const root = axial < 0 ? axial - size : axial + size;
  const steady = { slow: (2 * torque) / root, fast: root / (2 * across * cos) };
  const rate = steady[start.precession] ?? (start.precession ?? 0) + about;
  if (Number.isNaN(rate)) throw new Error("there is no steady precession at this tilt and spin");
  const level = across * rate * sin;
  // The tilt is about the first axis, so that the axis of the top lies in the plane of the others.
  const more = y * (along - across) * sin * cos;
  const momentum = [
    across * x,
    level * cos - axial * sin + y * (across * cos * cos + along * sin * sin),
    level * sin + axial * cos - more,
  ];
  const [w, ...vector] = made.axes;
  const axes = new Quaternion(...vector, w);
  const q = new Quaternion(Math.sin(tilt / 2), 0, 0, Math.cos(tilt / 2)).multiply(axes.conjugate());
  return { attitude: [q.w, q.x, q.y, q.z], momentum };
}
// Replace the starts of a scene by attitudes and momenta.
export function resolveStarts({ start, second, ...scene }) {
  if (start) Object.assign(scene, computeStart(scene, start));
  if (second === undefined) return scene;
  if (second?.constructor !== Object) return { ...scene, second };
  const { attitude, momentum } = computeStart(scene, second);
  return { ...scene, second: [...attitude, ...momentum] };
}
