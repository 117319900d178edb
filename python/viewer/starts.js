// Starts in the words of textbooks: tilt and spin instead of an attitude and a momentum.
import { makeBody } from "./core.js";

const isNumber = (x) => typeof x === "number" && Math.abs(x) <= 1e12;
const isStart = ({ tilt, spin, precession = 0, ...rest }) =>
  isNumber(tilt) &&
  tilt >= 0 &&
  tilt <= 180 &&
  isNumber(spin) &&
  (isNumber(precession) || ["slow", "fast"].includes(precession)) &&
  !Object.keys(rest).length;
// Returns the attitude and the momentum of a start: the angle with the vertical in degrees, the
// angular velocity about the apex, the rate about the vertical, 0 if it is left out, or "slow" or
// "fast" for the two that keep the tilt. They solve I1 W^2 cos - I3 spin W + mass gravity height =
// 0.
export function startOf({ body, gravity }, start) {
  if (!isStart(start)) throw new Error(`start cannot be ${JSON.stringify(start).slice(0, 60)}`);
  const { mass, moments, com } = makeBody(body);
  const [across, , along] = moments;
  const tilt = (start.tilt * Math.PI) / 180;
  const [cos, sin] = [Math.cos(tilt), Math.sin(tilt)];
  const [axial, torque] = [along * start.spin, mass * gravity * com[2]];
  const root = axial + Math.sqrt(axial * axial - 4 * across * cos * torque);
  const steady = { slow: (2 * torque) / root, fast: root / (2 * across * cos) };
  const rate = steady[start.precession] ?? start.precession ?? 0;
  if (Number.isNaN(rate)) throw new Error("no precession is steady at this tilt and spin");
  const level = across * rate * sin;
  const momentum = [0, level * cos - axial * sin, level * sin + axial * cos];
  return { attitude: [Math.cos(tilt / 2), Math.sin(tilt / 2), 0, 0], momentum };
}
// Puts attitudes and momenta in place of the starts of a scene.
export function begun({ start, second, ...scene }) {
  if (start) Object.assign(scene, startOf(scene, start));
  if (second === undefined) return scene;
  if (second?.constructor !== Object) return { ...scene, second };
  const { attitude, momentum } = startOf(scene, second);
  return { ...scene, second: [...attitude, ...momentum] };
}
