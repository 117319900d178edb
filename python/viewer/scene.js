// What is on the stage, as plain data that JSON can hold, and the rules by which it changes.
import { Quaternion, Vector3 } from "three";
import { cuboidOf, measureOf, methods, stage, TICKS, TOPS } from "./core.js";

export const plain = {
  version: 1,
  name: "",
  about: "",
  body: { half: [0.8, 0.8, 1], pivot: [0, 0, -1], density: 1 }, // or { mass, inertia (9), com }
  shape: "free",
  attitude: [1, 0, 0, 0], // w, x, y, z
  momentum: [0.172, -1.862, 1.46],
  second: null, // attitude and momentum (7 numbers) for the tops of the second method, if others
  gravity: 1,
  methods: ["bobenko_suris"], // one or two,
  step: [0.01], // each with one or two steps
  tol: 1e-5, // of adaptive methods: the thesis' Atol = Rtol
  ghost: false,
  distance: 4,
  stop: null,
  speed: 1,
  chart: "energy", // the name of a measure
  log: false,
  shown: Array(TOPS).fill(true), // in the charts, of the tops
  tracks: [], // { name, step, states: base64 of float64 t, q, m }
  corners: false, // move the fixed point
  show: {
    trace: true,
    rod: false,
    axes: false,
    floor: true,
    flat: false,
    opacity: 0.3,
    thickness: 1,
  },
};

// A scene may also say eps for step, and some measures have a shorter name; `fourth` is the fourth
// integral of a body of this kind, which has the kind's name.
const saysStep = ({ eps, ...given }) => (eps === undefined ? given : { step: eps, ...given });
export const chartOf = (name, kind) =>
  ({ vertical: "vertical_momentum", axial: "axial_momentum", fourth: kind })[name] ?? name;

// Each part of a scene must fit one of these.
function listOf(fits, ...lengths) {
  return (x) => Array.isArray(x) && lengths.includes(x.length) && x.every(fits);
}
const within = (low, high) => (x) => typeof x === "number" && x >= low && x <= high;
const [word, flag, size, three] = [
  (x) => typeof x === "string",
  (x) => x === !!x,
  within(-1e12, 1e12),
  listOf(within(-1e12, 1e12), 3),
];
const isStep = within(1 / TICKS, 2000);
const isTrack = (track) => word(track?.name) && word(track.states) && isStep(track.step);
const isShow = ({ opacity, thickness, ...flags }) =>
  within(0, 1)(opacity) && within(0.1, 20)(thickness) && Object.values(flags).every(flag);
const CHECKS = {
  body: (b) => (three(b?.half) ? three(b.pivot) : listOf(size, 9)(b?.inertia) && three(b.com)),
  shape: (x) => word(x) && Object.hasOwn(SIZES, x),
  attitude: listOf(size, 4),
  momentum: three,
  second: (x) => x === null || listOf(size, 7)(x),
  gravity: size,
  methods: listOf(word, 1, 2),
  step: listOf(isStep, 1, 2),
  tol: within(1e-15, 1),
  distance: within(0, 100),
  stop: (x) => x === null || within(1 / TICKS, 1e9)(x),
  speed: within(0, 1e6),
  chart: (x) => word(x) && !!measureOf(chartOf(x, "kowalewski")),
  shown: listOf(flag, TOPS),
  show: isShow,
  tracks: listOf(isTrack, 0, 1),
};
// Completes a scene from anywhere: what it leaves out is as in `plain`, what it has must fit.
export function complete(given) {
  if (given?.constructor !== Object) throw new Error("it is no scene");
  const scene = structuredClone({ ...plain, ...saysStep(given) });
  scene.show = { ...plain.show, ...scene.show };
  if (Array.isArray(scene.tracks)) scene.tracks = scene.tracks.map((t) => saysStep(t ?? {}));
  for (const [key, model] of Object.entries(plain)) {
    const fits = CHECKS[key] ?? ((x) => typeof x === typeof model);
    if (fits(scene[key])) continue;
    throw new Error(`${key} cannot be ${JSON.stringify(scene[key]).slice(0, 60)}`);
  }
  return scene;
}

export const quaternion = ([w, x, y, z]) => new Quaternion(x, y, z, w);
export const wxyz = (q) => [q.w, q.x, q.y, q.z];
export const cornerSigns = (corner) =>
  [corner & 1, corner & 2, corner & 4].map((bit) => (bit ? 1 : -1));

// Returns the tops that a scene asks for, in the order of the stage. `side` is 0 for the first
// method and 1 for what stands beside it; `against` is the top with which it is compared, -1 for
// none.
const COLOURS = ["#d8432e", "#2f6fde", "#e0a100", "#2c9c4b"]; // the thesis' four
const SHARPEST = ["exact", "taylor", "extrap"]; // the first of them that suits is the ghost's
export function topsOf({ step: steps, ghost, second, tracks, methods: names, gravity }, body) {
  const tops = [];
  const sharpest = SHARPEST.find((name) => methods.get(name)?.suits(body, gravity));
  const grey = { role: "ghost", colour: "#8f96a3", side: 0, against: -1 };
  if (ghost) tops.push({ ...grey, method: sharpest, step: steps[0] });
  const first = tops.length;
  names.forEach((method, side) =>
    steps.forEach((step, thin) => {
      const apart = side === 1 && second;
      const against = ghost && !apart ? 0 : thin ? tops.length - 1 : side && !apart ? first : -1;
      const colour = COLOURS[2 * side + thin];
      tops.push({ method, step, side, role: thin ? "thin" : "thick", colour, against });
    }),
  );
  const beside = { side: 1, role: "thick", colour: "#9a4fd0", against: 0 };
  for (const track of tracks) tops.push({ ...beside, track, method: track.name, step: track.step });
  return tops;
}

// A scene has its values at places such as "show.trace". One that is asked for goes to its place;
// some places have rules of their own.
export const valueAt = (scene, place) => place.split(".").reduce((at, key) => at?.[key], scene);
export function assign(scene, place, x) {
  if (rules[place]) return rules[place](scene, x);
  const keys = place.split(".");
  const last = keys.pop();
  keys.reduce((at, key) => at[key], scene)[last] = x;
}
const wholeTicks = (x) => Math.round(x * TICKS) / TICKS;
// Returns the nearest time at which all steps meet.
function meeting(t) {
  const common = stage.common();
  return common ? (Math.max(1, Math.round((t * TICKS) / common)) * common) / TICKS : t;
}
const rules = {
  "step.0": (scene, x) => (scene.step[0] = wholeTicks(x)),
  "step.1": (scene, x) => (scene.step = [scene.step[0], wholeTicks(x)]),
  both: (scene, on) => (scene.step = on ? [scene.step[0], 0.2] : [scene.step[0]]),
  "methods.1"(scene, name) {
    scene.methods = [scene.methods[0], name].filter(Boolean);
    if (!name) scene.second = null;
  },
  stop: (scene, x) => (scene.stop = x > 0 ? meeting(x) : x < 0 ? x : null),
  // The ghost comes before the others.
  ghost: (scene, on) =>
    Object.assign(scene, {
      ghost: on,
      shown: on ? [true, ...scene.shown.slice(0, -1)] : [...scene.shown.slice(1), true],
    }),
  shape(scene, shape) {
    becomeCuboid(scene);
    scene.shape = shape;
    if (shape !== "free") scene.body.pivot = [0, 0, -scene.body.half[2]];
    resize(scene, scene.body.half);
    if (shape === "goryachev_chaplygin") {
      scene.momentum[2] = 0; // else G changes
      if (scene.second) scene.second[6] = 0;
    }
  },
};

// A change by hand works on a cuboid along its own frame: the attitude takes up how it lay.
export function becomeCuboid(scene) {
  if (scene.body.half) return;
  const { half, centre, turn, density } = cuboidOf(scene.body);
  const back = quaternion(turn).conjugate();
  const pivot = new Vector3(...centre).applyQuaternion(back).negate().toArray();
  scene.body = { half, pivot, density };
  scene.attitude = wxyz(quaternion(scene.attitude).multiply(quaternion(turn)));
}
// Each shape allows some sizes, in the order N, B, T (thesis 5.6.5, 5.8.1). They are made from any
// sizes, and of the same volume.
const plate = (ratio) => (n, b, t) => {
  const edge = Math.cbrt((2 * n * b * t) / ratio);
  return [ratio * edge, edge, edge / 2];
};
const SIZES = {
  free: (...half) => half,
  lagrange: (n, b, t) => [Math.sqrt(n * b), Math.sqrt(n * b), t],
  kowalewski: plate(Math.sqrt(3)),
  goryachev_chaplygin: plate(Math.sqrt(7)),
};
// No plate gets thinner than this, and nothing is turned inside out.
const THINNEST = 0.02;
export function resize(scene, half) {
  const old = scene.body;
  const least = THINNEST * Math.max(...half, ...old.half.map((h) => THINNEST * h));
  const fit = SIZES[scene.shape](...half.map((x) => Math.max(x, least)));
  scene.body = { ...old, half: fit, pivot: old.pivot.map((x, i) => (x * fit[i]) / old.half[i]) };
}

export const bytes = (base64) => Uint8Array.from(atob(base64), (c) => c.charCodeAt(0));
