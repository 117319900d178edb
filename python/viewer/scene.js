// Scenes as plain data for JSON: defaults, checks, and the tops that a scene describes.
import { Quaternion, Vector3 } from "three";
import { computeCuboid, findMeasure, methods, TICKS, MAX_TOPS } from "./core.js";
import { resolveStarts } from "./starts.js";
import { makeThingBody, THINGS } from "./things.js";

export const DEFAULTS = {
  version: 1,
  name: "",
  about: "",
  body: { half: [0.8, 0.8, 1], pivot: [0, 0, -1], density: 1 }, // or { mass, inertia (9), com }
  shape: "free",
  attitude: [1, 0, 0, 0], // w, x, y, z
  momentum: [0.172, -1.862, 1.46],
  second: null, // 7 numbers: attitude and momentum of the second method, if it has its own start
  taken: null, // time of the motion from which the start was taken
  gravity: 1,
  damping: 0, // torque over angular velocity, about each axis
  friction: 0, // dry friction: a torque of this size against the spin
  turning: [0, 0, 0], // angular velocity of the support
  heading: 0, // angle of the room about the vertical at the start, as seen from a turntable
  shaking: [0, 0, 0], // amplitude, rate and phase of the support, along the vertical
  gradient: 0, // of gravity along the vertical, 3 n² for a satellite with the orbital rate n
  rotor: [0, 0, 0], // momentum of a rotor in the body, in the frame of description
  // Moment of a rotor on a free axle, along it: then `rotor` is its momentum in space about the axle.
  wheel: [0, 0, 0],
  methods: ["bobenko_suris"], // one to three
  step: [0.01], // one or two steps for each method
  own: false, // the first step for the first method, the second for the others
  tol: 1e-5, // of adaptive methods; Atol = Rtol of the thesis
  ghost: false,
  distance: 4,
  stop: null,
  speed: 1,
  chart: "nutation", // the name of a measure
  integral: "energy", // measure whose change is shown
  log: false, // scale of changes and errors
  shown: Array(MAX_TOPS).fill(true), // one for each top in the charts
  tracks: [], // { name, step, states: base64 of float64 t, q, m }
  corners: false, // whether corners move the fixed point
  show: {
    trace: true,
    rod: false,
    axes: false,
    floor: true,
    flat: false,
    section: "stiff", // cross section of the rod, one of SECTIONS
    drops: false, // vertical lines to the floor
    arrows: true, // whether any arrow is shown
    momentum: true, // the arrow m
    velocity: true, // the arrow omega
    vertical: true, // the arrow p
    room: false, // whether the camera stands in the room around a turntable
    torque: false, // weight, torque, and the trace of the tip of m
    solid: "top", // "top", "box", "none", or a thing
    opacity: 0.3,
    thickness: 1,
  },
};

// Scenes may use "eps" for "step" and short names of measures. "fourth" is the fourth integral,
// which has the name of the kind.
const renameEps = ({ eps, ...given }) => (eps === undefined ? given : { step: eps, ...given });
export const getMeasureName = (name, kind) =>
  ({ vertical: "vertical_momentum", axial: "axial_momentum", fourth: kind })[name] ?? name;

// Checks of the parts of a scene. `range` describes the valid values.
function makeListCheck(fits, ...lengths) {
  const all = (x) => Array.isArray(x) && lengths.includes(x.length) && x.every(fits);
  return Object.assign(all, { range: fits.range });
}
const makeRangeCheck = (low, high) =>
  Object.assign((x) => typeof x === "number" && x >= low && x <= high, {
    range: `from ${low} to ${high}`,
  });
const allowNull = (fits) => Object.assign((x) => x === null || fits(x), { range: fits.range });
const [isText, isBoolean, isSize, isVector] = [
  (x) => typeof x === "string",
  (x) => x === !!x,
  makeRangeCheck(-1e12, 1e12),
  makeListCheck(makeRangeCheck(-1e12, 1e12), 3),
];
const isStep = makeRangeCheck(1 / TICKS, 2000);
const isTrack = (track) => isText(track?.name) && isText(track.states) && isStep(track.step);
// Exponents of the moments that give the sides of the rod's cross section.
export const SECTIONS = { stiff: 0.5, thesis: 1, round: 0 };
const isShow = ({ opacity, thickness, solid, section, ...flags }) =>
  makeRangeCheck(0, 1)(opacity) &&
  makeRangeCheck(0.1, 20)(thickness) &&
  Object.hasOwn(SECTIONS, section) &&
  (["top", "box", "none"].includes(solid) || Object.hasOwn(THINGS, solid)) &&
  Object.values(flags).every(isBoolean);
const isMeasure = (x) => isText(x) && !!findMeasure(getMeasureName(x, "kowalewski"));
const CHECKS = {
  version: Object.assign((x) => x === DEFAULTS.version, {
    range: `this page reads ${DEFAULTS.version}`,
  }),
  body: (b) =>
    isVector(b?.half) ? isVector(b.pivot) : makeListCheck(isSize, 9)(b?.inertia) && isVector(b.com),
  shape: (x) => isText(x) && Object.hasOwn(SIZES, x),
  attitude: makeListCheck(isSize, 4),
  momentum: isVector,
  second: allowNull(makeListCheck(isSize, 7)),
  taken: allowNull(makeRangeCheck(0, 1e9)),
  gravity: isSize,
  damping: makeRangeCheck(0, 1e12),
  friction: makeRangeCheck(0, 1e12),
  turning: isVector,
  heading: isSize,
  shaking: Object.assign((x) => isVector(x) && (x[0] === 0 || x[1] > 0), {
    range: "three numbers, with a positive rate",
  }),
  gradient: isSize,
  rotor: isVector,
  wheel: isVector,
  methods: makeListCheck(isText, 1, 2, 3),
  step: makeListCheck(isStep, 1, 2),
  tol: makeRangeCheck(1e-15, 1),
  distance: makeRangeCheck(0, 100),
  stop: allowNull(makeRangeCheck(1 / TICKS, 1e9)),
  speed: makeRangeCheck(0, 1e6),
  chart: isMeasure,
  integral: isMeasure,
  shown: makeListCheck(isBoolean, MAX_TOPS),
  show: isShow,
  tracks: makeListCheck(isTrack, 0, 1),
};
// Replace a body that is given as a thing, as {"thing": "wheel"}, by its cuboid, and show the thing.
const resolveThing = (given) =>
  Object.hasOwn(THINGS, given.body?.thing ?? "")
    ? {
        ...given,
        body: makeThingBody(given.body),
        show: { solid: given.body.thing, ...given.show },
      }
    : given;
// Complete and check a scene. Missing parts get their defaults, unknown parts are dropped. Throws
// an Error for invalid parts.
export function completeScene(given) {
  if (given?.constructor !== Object) throw new Error("it is not a scene");
  const scene = structuredClone(resolveStarts({ ...DEFAULTS, ...resolveThing(renameEps(given)) }));
  scene.show = { ...DEFAULTS.show, ...scene.show };
  if (Array.isArray(scene.tracks)) scene.tracks = scene.tracks.map((t) => renameEps(t ?? {}));
  for (const [key, model] of Object.entries(DEFAULTS)) {
    const fits = CHECKS[key] ?? ((x) => typeof x === typeof model);
    if (fits(scene[key])) continue;
    const shown = JSON.stringify(scene[key]).slice(0, 60);
    throw new Error(`${key} cannot be ${shown}${fits.range ? `: ${fits.range}` : ""}`);
  }
  return Object.fromEntries(Object.keys(DEFAULTS).map((key) => [key, scene[key]]));
}
// Return the valid values at a place, as text.
export const getRange = (place) => CHECKS[place.split(".")[0]]?.range;

export const toQuaternion = ([w, x, y, z]) => new Quaternion(x, y, z, w);
export const toWxyz = (q) => [q.w, q.x, q.y, q.z];
export const getCornerSigns = (corner) =>
  [corner & 1, corner & 2, corner & 4].map((bit) => (bit ? 1 : -1));

// Return the steps of the method number `side`.
export const getSteps = ({ step, own }, side) =>
  own ? [step[Math.min(side, step.length - 1)]] : step;
// Return the tops of a scene in the order of the simulation. `side` counts the methods from left to
// right, `comparedWith` is the index of the reference. References come last and are hidden or drawn
// as ghosts. Each method has two colours, for its two steps; readers without red or green cones
// distinguish red and violet.
export const COLOURS = ["#c73237", "#c37801", "#b02fe8", "#299d80", "#586cb7", "#087583"];
const REFERENCE_METHODS = ["exact", "taylor", "extrap"]; // the first suitable one
const [NO_REFERENCE, IS_REFERENCE] = [-1, -2];
export const findSuitable = (names, scene, body) =>
  names.find((name) => methods.get(name)?.isSuitable(body, scene));
export function listTops(scene, body) {
  const { step, ghost, second, tracks, methods: names } = scene;
  const sharpest = findSuitable(REFERENCE_METHODS, scene, body);
  const tops = names.flatMap((method, side) =>
    getSteps(scene, side).map((step, thin) => {
      const colour = COLOURS[2 * side + thin];
      return { method, step, side, role: thin ? "thin" : "thick", colour };
    }),
  );
  const beside = { side: 1, role: "thick", colour: COLOURS[4] };
  for (const track of tracks) tops.push({ ...beside, track, method: track.name, step: track.step });
  const first = tops.length;
  const hasOwnStart = (top) => second && top.side === 1 && !top.track;
  for (const top of tops)
    top.comparedWith =
      top.method === "exact" && !top.track ? NO_REFERENCE : first + +!!hasOwnStart(top);
  const reference = {
    colour: "#7d8491",
    method: sharpest,
    step: step[0],
    comparedWith: IS_REFERENCE,
  };
  tops.push({ ...reference, side: 0, role: ghost ? "ghost" : "reference" });
  if (second) tops.push({ ...reference, side: 1, role: "reference" });
  return tops;
}
// Return the name of a top's method with its step. A closed form has none: the step of its scene is
// the interval between two pictures.
export const formatMethod = ({ method, step }) =>
  method === "exact" ? method : `${method} ${step}`;
// Return whether friction takes energy from the top.
export const hasFriction = ({ damping, friction }) => damping > 0 || friction > 0;
// Return whether the support turns about the vertical. Any other turning is that of the ground.
export const isOnTurntable = ({ turning: [x, y, rate] }) => !x && !y && rate !== 0;
// Return the angle about the vertical of the mark N: of a direction in the room around a turntable,
// or of the axis of the turning ground. Other supports have none: null.
export function findNorthAngle(scene) {
  const [x, y] = scene.turning;
  if (scene.gradient) return null; // an orbit
  return isOnTurntable(scene) ? 0 : x || y ? Math.atan2(x, -y) : null;
}
// Return the angle about the vertical of the room, as seen from a turntable, at a time.
export const computeRoomAngle = (scene, t) =>
  isOnTurntable(scene) ? (scene.heading - scene.turning[2] * t) % (2 * Math.PI) : 0;
// Return whether the elastic rod is shown without a body.
export const isRodAlone = ({ show }) => show.rod && show.solid === "none";
// Return the axis of a globe below the top: of turning ground, or of an orbit about the Earth.
export function findGlobeAxis({ turning, gradient }) {
  const axis = new Vector3(...turning);
  const isGround = turning[0] !== 0 || turning[1] !== 0;
  if (gradient) return axis.length() ? axis.normalize() : new Vector3(0, 1, 0);
  return isGround ? axis.normalize() : null;
}
export const isTurning = ({ turning }) => turning.some((x) => x !== 0);

// Replace a body given by numbers with its cuboid. The attitudes absorb the rotation between them.
export function convertToCuboid(scene) {
  if (scene.body.half) return;
  const { half, centre, turn, density } = computeCuboid(scene.body);
  const back = toQuaternion(turn).conjugate();
  const pivot = new Vector3(...centre).applyQuaternion(back).negate().toArray();
  scene.body = { half, pivot, density };
  const turnAttitude = (q) => toWxyz(toQuaternion(q).multiply(toQuaternion(turn)));
  scene.attitude = turnAttitude(scene.attitude);
  scene.second?.splice(0, 4, ...turnAttitude(scene.second));
  for (const key of ["rotor", "wheel"])
    scene[key] = new Vector3(...scene[key]).applyQuaternion(back).toArray();
}
// Sizes N, B, T that a shape allows (thesis 5.6.5, 5.8.1), from any sizes and of equal volume.
const makePlate = (ratio) => (n, b, t) => {
  const edge = Math.cbrt((2 * n * b * t) / ratio);
  return [ratio * edge, edge, edge / 2];
};
const SIZES = {
  free: (...half) => half,
  lagrange: (n, b, t) => [Math.sqrt(n * b), Math.sqrt(n * b), t],
  kowalewski: makePlate(Math.sqrt(3)),
  goryachev_chaplygin: makePlate(Math.sqrt(7)),
};
// Smallest relative thickness, also while a drag turns the body inside out.
const THINNEST = 0.02;
export function resizeBody(scene, half) {
  const old = scene.body;
  const least = THINNEST * Math.max(...half, ...old.half.map((h) => THINNEST * h));
  const fit = SIZES[scene.shape](...half.map((x) => Math.max(x, least)));
  scene.body = { ...old, half: fit, pivot: old.pivot.map((x, i) => (x * fit[i]) / old.half[i]) };
}

export function decodeBase64(base64) {
  try {
    return Uint8Array.from(atob(base64), (c) => c.charCodeAt(0));
  } catch {
    throw new Error("the states of the path cannot be read: they are not base64");
  }
}
