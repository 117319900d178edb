// Starts given by tilt and spin instead of attitude and momentum.
import { Quaternion } from "three";
import { computeMomentum, computeSteadyPrecession, makeBody } from "./core.js";

const isNumber = (x) => typeof x === "number" && Math.abs(x) <= 1e12;
const isStart = ({ tilt, spin, precession = 0, ...rest }) =>
  isNumber(tilt) &&
  tilt >= 0 &&
  tilt <= 180 &&
  isNumber(spin) &&
  (isNumber(precession) || ["slow", "fast"].includes(precession)) &&
  !Object.keys(rest).length;
// Return attitude and momentum of a start: tilt of the third axis in degrees, spin about that axis,
// and precession about the vertical, 0 by default, both as seen from the support. "slow" and "fast"
// select a steady precession.
export function computeStart({ body, gravity, rotor, wheel, turning: [x, y, about] }, start) {
  if (!isStart(start)) throw new Error(`start cannot be ${JSON.stringify(start).slice(0, 60)}`);
  const made = makeBody(body, rotor, wheel);
  const world = { gravity, turning: [x, y, about] };
  const tilt = (start.tilt * Math.PI) / 180;
  const [cos, sin] = [Math.cos(tilt), Math.sin(tilt)];
  let { spin, precession = 0 } = start;
  if (typeof precession === "string") {
    if (x || y) throw new Error("there is no steady precession on a support that turns in this way");
    const isFast = precession === "fast";
    precession = computeSteadyPrecession(made, world, spin + about * cos, tilt, isFast) - about;
  }
  const [w, ...vector] = made.axes;
  const axes = new Quaternion(...vector, w);
  // The tilt is about the first axis, so that the axis of the top lies in the plane of the others.
  const turned = new Quaternion(Math.sin(tilt / 2), 0, 0, Math.cos(tilt / 2));
  const q = turned.multiply(axes.conjugate());
  const attitude = [q.w, q.x, q.y, q.z];
  const own = spin - precession * cos; // the rotation beside the precession
  const momentum = computeMomentum(made, world, attitude, [0, -own * sin, precession + own * cos]);
  return { attitude, momentum };
}
// Replace the starts of a scene by attitudes and momenta.
export function resolveStarts({ start, second, ...scene }) {
  if (start) Object.assign(scene, computeStart(scene, start));
  if (second === undefined) return scene;
  if (second?.constructor !== Object) return { ...scene, second };
  const { attitude, momentum } = computeStart(scene, second);
  return { ...scene, second: [...attitude, ...momentum] };
}
