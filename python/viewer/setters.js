// Setters of scene values by place, such as "show.trace". Some places have a rule, and "tilt" and
// "spin" change the start.
import { Quaternion, Vector3 } from "three";
import {
  computeCuboid,
  computeMomentum,
  findMeasure,
  makeBody,
  measureStart,
  simulation,
  TICKS,
} from "./core.js";
import { computeContact, fitRevolution } from "./revolution.js";
import { convertToCuboid, hasFriction, toQuaternion, resizeBody, toWxyz } from "./scene.js";

export const getValue = (scene, place) => place.split(".").reduce((at, key) => at?.[key], scene);
export function setValue(scene, place, x) {
  const [name, k] = place.split(/\.(?=\d)/);
  const rule = SETTERS[place] ?? SETTERS[name];
  if (rule) return rule(scene, x, +k);
  const keys = place.split(".");
  const last = keys.pop();
  keys.reduce((at, key) => at[key], scene)[last] = x;
}
// Names of places in messages.
const NAMES = {
  "step.1": "Second step",
  tol: "Tolerance",
  stop: "Stop time",
  half: "Size",
  pivot: "Fixed point",
  both: "Second step",
  own: "Step",
};
export function getPlaceName(place) {
  const [, last] = /([a-z]+)[.\d]*$/.exec(place);
  const name = NAMES[place] ?? NAMES[last] ?? last;
  return name[0].toUpperCase() + name.slice(1);
}

const roundToTicks = (x) => Math.round(x * TICKS) / TICKS;
// Return the nearest time at which all steps meet.
export function findMeetingTime(t) {
  const common = simulation.getCommonStep();
  return common ? (Math.max(1, Math.round((t * TICKS) / common)) * common) / TICKS : t;
}
const VERTICAL = new Vector3(0, 0, 1);
// Return the tilt at which the rim meets the floor and the motion ends, or null. Only tops with
// friction end so, if they stand on their tip.
export function findContact(scene, body) {
  const revolution = hasFriction(scene) && fitRevolution(computeCuboid(scene.body));
  const contact = revolution ? computeContact(revolution) : null;
  const isAbove = (attitude) =>
    measureStart(body, scene, attitude, [0, 0, 0]).apex[2] > Math.cos(contact);
  const starts = [scene.attitude, ...(scene.second ? [scene.second.slice(0, 4)] : [])];
  return contact !== null && starts.every(isAbove) ? contact : null;
}
function checkNumber(x, name) {
  if (!Number.isFinite(x)) throw new Error(`${name} cannot be empty`);
  return x;
}
const checkPositive = (x, name) => {
  if (!(x > 0)) throw new Error(`${name} cannot be ${x}: it must be more than 0`);
  return x;
};

// Return the direction of the centre of mass at an attitude.
export const computeApex = ({ body, rotor, ...world }, attitude) =>
  measureStart(makeBody(body, rotor), world, attitude.slice(0, 4), [0, 0, 0]).apex;
// Return the spin, the angular velocity about the apex, after a change by the function `replace`,
// and the momentum with this spin. The rest of the angular velocity is kept.
export function changeSpin(scene, attitude, momentum, replace) {
  const body = makeBody(scene.body, scene.rotor, scene.wheel);
  const start = measureStart(body, scene, attitude, momentum);
  const [apex, velocity] = [start.apex, start.velocity].map((v) => new Vector3(...v));
  const before = velocity.dot(apex);
  const spin = replace(before);
  velocity.addScaledVector(apex, spin - before);
  return { spin, momentum: computeMomentum(body, scene, attitude, velocity.toArray()) };
}

const SETTERS = {
  "step.0": (scene, x) => (scene.step[0] = roundToTicks(x)),
  "step.1": (scene, x) => (scene.step = [scene.step[0], roundToTicks(x)]),
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
  // Copy the methods and steps of another scene, with one start for all.
  "methods.four"(scene, { methods, step, distance, chart, log }) {
    Object.assign(scene, structuredClone({ methods, step, distance, chart, log }));
    Object.assign(scene, { own: false, second: null });
  },
  stop: (scene, x) => (scene.stop = x > 0 || x < 0 ? x : null),
  shape(scene, shape) {
    convertToCuboid(scene);
    scene.shape = shape;
    if (shape !== "free") scene.body.pivot = [0, 0, -scene.body.half[2]];
    resizeBody(scene, scene.body.half);
    if (findMeasure(shape)) {
      scene.integral = shape; // the integral of this shape
      if (findMeasure(scene.chart)?.isConserved) scene.chart = shape;
    }
    if (shape === "goryachev_chaplygin") {
      scene.momentum[2] = 0; // otherwise G is not conserved
      if (scene.second) scene.second[6] = 0;
    }
  },
  // Tilt the apex by degrees from the vertical, and turn the momentum with it.
  tilt(scene, degrees) {
    const apex = new Vector3(...computeApex(scene, scene.attitude));
    const axis = new Vector3().crossVectors(VERTICAL, apex);
    if (axis.length() < 1e-9) axis.set(1, 0, 0);
    checkNumber(degrees, "Tilt");
    if (!(degrees >= 0 && degrees <= 180))
      throw new Error(`Tilt cannot be ${degrees}: from 0 to 180`);
    const angle = (degrees * Math.PI) / 180 - apex.angleTo(VERTICAL);
    const turn = new Quaternion().setFromAxisAngle(axis.normalize(), angle);
    scene.attitude = toWxyz(turn.clone().multiply(toQuaternion(scene.attitude)));
    scene.momentum = new Vector3(...scene.momentum).applyQuaternion(turn).toArray();
  },
  // Set the angular velocity about the apex; keep the rest.
  spin(scene, wanted) {
    checkNumber(wanted, "Spin");
    scene.momentum = changeSpin(scene, scene.attitude, scene.momentum, () => wanted).momentum;
  },
  // Set a component of the rotor's momentum; keep the angular velocity of the body.
  rotor(scene, x, k) {
    const change = new Vector3().setComponent(k, checkNumber(x, "Rotor") - scene.rotor[k]);
    const add = (attitude, momentum) => {
      const turned = change.clone().applyQuaternion(toQuaternion(attitude));
      return turned.add(new Vector3(...momentum)).toArray();
    };
    const { attitude, second } = scene;
    scene.momentum = add(attitude, scene.momentum);
    if (second) scene.second.splice(4, 3, ...add(second.slice(0, 4), second.slice(4)));
    scene.rotor[k] = x;
  },
  // Scale a shape with fixed ratios as a whole.
  "body.half"(scene, x, k) {
    convertToCuboid(scene);
    const half = [...scene.body.half];
    const ratio = checkPositive(x, "Size") / half[k];
    if (scene.shape === "free") half[k] = x;
    else if (scene.shape === "lagrange") (k < 2 ? [0, 1] : [2]).forEach((i) => (half[i] = x));
    else half.forEach((h, i) => (half[i] = h * ratio));
    resizeBody(scene, half);
  },
  "body.pivot"(scene, x, k) {
    convertToCuboid(scene);
    scene.shape = "free";
    scene.body.pivot[k] = checkNumber(x, "Fixed point");
  },
  mass(scene, x) {
    convertToCuboid(scene);
    const [n, b, t] = scene.body.half;
    scene.body.density = checkPositive(x, "Mass") / (8 * n * b * t);
  },
  density(scene, x) {
    convertToCuboid(scene);
    scene.body.density = checkPositive(x, "Density");
  },
};
