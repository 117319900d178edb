// What a control may set: each value has its place in a scene, such as "show.trace", and some
// places have rules of their own. Tilt and spin are places too, of the start.
import { Quaternion, Vector3 } from "three";
import { makeBody, measureOf, stage, TICKS } from "./core.js";
import { becomeCuboid, quaternion, resize, wxyz } from "./scene.js";

export const valueAt = (scene, place) => place.split(".").reduce((at, key) => at?.[key], scene);
export function assign(scene, place, x) {
  const [name, k] = place.split(/\.(?=\d)/);
  const rule = rules[place] ?? rules[name];
  if (rule) return rule(scene, x, +k);
  const keys = place.split(".");
  const last = keys.pop();
  keys.reduce((at, key) => at[key], scene)[last] = x;
}
// A name as a user reads it at the control.
const NAMES = {
  "step.1": "Second step",
  tol: "Tolerance",
  stop: "Stop time",
  half: "Size",
  pivot: "Fixed point",
  both: "Second step",
  own: "Step",
};
export function nameOf(place) {
  const [, last] = /([a-z]+)[.\d]*$/.exec(place);
  const name = NAMES[place] ?? NAMES[last] ?? last;
  return name[0].toUpperCase() + name.slice(1);
}

const wholeTicks = (x) => Math.round(x * TICKS) / TICKS;
// Returns the nearest time at which all steps meet.
export function meeting(t) {
  const common = stage.common();
  return common ? (Math.max(1, Math.round((t * TICKS) / common)) * common) / TICKS : t;
}
const VERTICAL = new Vector3(0, 0, 1);
// Returns the axis from the fixed point to the centre of mass, as the body was described; along the
// third principal axis if they are one point.
function apexOf(body) {
  const com = new Vector3(...body.com);
  return com.length() ? com.normalize() : VERTICAL.clone().applyQuaternion(quaternion(body.axes));
}
function ofNumber(x, name) {
  if (!Number.isFinite(x)) throw new Error(`${name} cannot be empty`);
  return x;
}
const above = (x, name) => {
  if (!(x > 0)) throw new Error(`${name} cannot be ${x}: it is more than 0`);
  return x;
};

const rules = {
  "step.0": (scene, x) => (scene.step[0] = wholeTicks(x)),
  "step.1": (scene, x) => (scene.step = [scene.step[0], wholeTicks(x)]),
  both(scene, on) {
    Object.assign(scene, { step: on ? [scene.step[0], 0.2] : [scene.step[0]], own: false });
  },
  own(scene, on) {
    scene.own = on;
    if (on && scene.step.length < 2) scene.step.push(0.2);
  },
  methods(scene, name, k) {
    scene.methods[k] = name;
    scene.methods = scene.methods.filter(Boolean);
    if (scene.methods.length < 2) scene.second = null;
  },
  // Puts the methods and steps of another scene on the top of this one, all from one start.
  "methods.four"(scene, { methods, step, distance, chart, log }) {
    Object.assign(scene, structuredClone({ methods, step, distance, chart, log }));
    Object.assign(scene, { own: false, second: null });
  },
  stop: (scene, x) => (scene.stop = x > 0 ? meeting(x) : x < 0 ? x : null),
  shape(scene, shape) {
    becomeCuboid(scene);
    scene.shape = shape;
    if (shape !== "free") scene.body.pivot = [0, 0, -scene.body.half[2]];
    resize(scene, scene.body.half);
    if (measureOf(shape)) {
      scene.integral = shape; // the one that this shape has beside the others
      if (measureOf(scene.chart)?.kept) scene.chart = shape;
    }
    if (shape === "goryachev_chaplygin") {
      scene.momentum[2] = 0; // else G changes
      if (scene.second) scene.second[6] = 0;
    }
  },
  // The apex is tilted so many degrees from the vertical, and all that turns, turns with it.
  tilt(scene, degrees) {
    const apex = apexOf(makeBody(scene.body)).applyQuaternion(quaternion(scene.attitude));
    const axis = new Vector3().crossVectors(VERTICAL, apex);
    if (axis.length() < 1e-9) axis.set(1, 0, 0);
    const angle = (ofNumber(degrees, "Tilt") * Math.PI) / 180 - apex.angleTo(VERTICAL);
    const turn = new Quaternion().setFromAxisAngle(axis.normalize(), angle);
    scene.attitude = wxyz(turn.clone().multiply(quaternion(scene.attitude)));
    scene.momentum = new Vector3(...scene.momentum).applyQuaternion(turn).toArray();
  },
  // The angular velocity about the apex becomes this; what is across it stays.
  spin(scene, wanted) {
    const body = makeBody(scene.body);
    const frame = quaternion(scene.attitude).multiply(quaternion(body.axes)); // principal axes
    const back = frame.clone().conjugate();
    const apex = apexOf(body).applyQuaternion(quaternion(scene.attitude)).applyQuaternion(back);
    const momentum = new Vector3(...scene.momentum).applyQuaternion(back);
    const moments = new Vector3(...body.moments);
    const change = ofNumber(wanted, "Spin") - momentum.clone().divide(moments).dot(apex);
    momentum.addScaledVector(apex.multiply(moments), change).applyQuaternion(frame);
    scene.momentum = momentum.toArray();
  },
  // A shape that ties its edges to each other is made larger or smaller as a whole.
  "body.half"(scene, x, k) {
    becomeCuboid(scene);
    const half = [...scene.body.half];
    const ratio = above(x, "Size") / half[k];
    if (scene.shape === "free") half[k] = x;
    else if (scene.shape === "lagrange") (k < 2 ? [0, 1] : [2]).forEach((i) => (half[i] = x));
    else half.forEach((h, i) => (half[i] = h * ratio));
    resize(scene, half);
  },
  "body.pivot"(scene, x, k) {
    becomeCuboid(scene);
    scene.shape = "free";
    scene.body.pivot[k] = ofNumber(x, "Fixed point");
  },
  mass(scene, x) {
    becomeCuboid(scene);
    const [n, b, t] = scene.body.half;
    scene.body.density = above(x, "Mass") / (8 * n * b * t);
  },
  density(scene, x) {
    becomeCuboid(scene);
    scene.body.density = above(x, "Density");
  },
};
