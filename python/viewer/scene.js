// What is on the stage, as plain data that JSON can hold, and the rules by which it changes. No drawing here.
import { Quaternion, Vector3 } from "three";
import { cuboidOf, methods, stage, TICKS } from "./core.js";

export const plain = {
  version: 1,
  name: "",
  about: "",
  body: { half: [0.8, 0.8, 1], pivot: [0, 0, -1], density: 1 }, // or { mass, inertia: 9 numbers, com }
  shape: "free",
  attitude: [1, 0, 0, 0], // w, x, y, z
  momentum: [0.172, -1.862, 1.46],
  second: null, // another attitude and momentum, for the tops of the second method: 7 numbers
  gravity: 1,
  methods: ["bobenko_suris"], // one or two,
  eps: [0.01], // each with one or two steps
  tol: 1e-5, // of adaptive methods: the thesis' Atol = Rtol
  ghost: false,
  distance: 4,
  stop: null,
  speed: 1,
  chart: "energy", // or vertical, axial, fourth
  log: false,
  shown: Array(8).fill(true), // in the charts, of the tops
  tracks: [], // { name, eps, states: base64 of float64 t, q, m }
  corners: false, // move the fixed point
  show: { trace: true, rod: false, axes: false, floor: true, flat: false, opacity: 0.3, thickness: 1 },
};
// What each may be.
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
const isShow = ({ opacity, thickness, ...flags }) =>
  within(0, 1)(opacity) && within(0.1, 20)(thickness) && Object.values(flags).every(flag);
const CHECKS = {
  body: (b) => (three(b?.half) ? three(b.pivot) : listOf(size, 9)(b?.inertia) && three(b.com)),
  shape: (x) => word(x) && Object.hasOwn(SHAPES, x),
  attitude: listOf(size, 4),
  momentum: three,
  second: (x) => x === null || listOf(size, 7)(x),
  gravity: size,
  methods: listOf(word, 1, 2),
  eps: listOf(within(1 / TICKS, 2000), 1, 2),
  tol: within(1e-15, 1),
  distance: within(0, 100),
  stop: (x) => x === null || within(1 / TICKS, 1e9)(x),
  speed: within(0, 1e6),
  chart: (x) => word(x) && /^(energy|vertical|axial|fourth)$/.test(x),
  shown: listOf(flag, 8),
  show: isShow,
  tracks: listOf((track) => word(track?.name) && word(track.states) && within(1 / TICKS, 2000)(track.eps), 0, 1),
};
// What is left out is as above; what is there must be of the same kind.
export function complete(given) {
  if (given?.constructor !== Object) throw new Error("it is no scene");
  const scene = structuredClone({ ...plain, ...given, show: { ...plain.show, ...given.show } });
  for (const [key, model] of Object.entries(plain)) {
    const fits = CHECKS[key] ?? ((x) => typeof x === typeof model);
    if (!fits(scene[key])) throw new Error(`${key} cannot be ${JSON.stringify(scene[key]).slice(0, 60)}`);
  }
  return scene;
}

export const quaternion = ([w, x, y, z]) => new Quaternion(x, y, z, w);
export const wxyz = (q) => [q.w, q.x, q.y, q.z];
export const cornerSigns = (corner) => [corner & 1, corner & 2, corner & 4].map((bit) => (bit ? 1 : -1));

// The tops that a scene asks for, in the order of the stage. `side`: 0 the first method, 1 what stands beside it;
// `against`: the top with which it is compared, -1 none.
const COLOURS = ["#d8432e", "#2f6fde", "#e0a100", "#2c9c4b"]; // red, blue, yellow, green: the thesis'
const SHARPEST = ["exact", "taylor", "extrap"]; // the first of them that the core has, and that applies
export function cast({ eps: steps, ghost, second, tracks, methods: names, gravity }, block) {
  const tops = [];
  const sharpest = SHARPEST.find((name) => methods.get(name)?.suits(block, gravity));
  const grey = { role: "ghost", colour: "#8f96a3", side: 0, against: -1 };
  if (ghost) tops.push({ ...grey, method: sharpest, eps: steps[0] });
  const first = tops.length;
  names.forEach((method, side) =>
    steps.forEach((eps, thin) => {
      const apart = side === 1 && second;
      const against = ghost && !apart ? 0 : thin ? tops.length - 1 : side && !apart ? first : -1;
      tops.push({ method, eps, side, role: thin ? "thin" : "thick", colour: COLOURS[2 * side + thin], against });
    }),
  );
  const look = { side: 1, role: "thick", colour: "#9a4fd0", against: 0 };
  for (const track of tracks) tops.push({ ...look, track, method: track.name, eps: track.eps });
  return tops;
}

// A value that was asked for goes to its place, such as "show.trace"; some say how.
export const look = (scene, place) => place.split(".").reduce((at, key) => at?.[key], scene);
export function take(scene, place, x) {
  if (rules[place]) return rules[place](scene, x);
  const keys = place.split(".");
  const last = keys.pop();
  keys.reduce((at, key) => at[key], scene)[last] = x;
}
const ticks = (x) => Math.round(x * TICKS) / TICKS;
// The nearest time at which all steps meet.
function meeting(t) {
  const common = stage.common();
  return common ? (Math.max(1, Math.round((t * TICKS) / common)) * common) / TICKS : t;
}
const rules = {
  "eps.0": (scene, x) => (scene.eps[0] = ticks(x)),
  "eps.1": (scene, x) => (scene.eps = [scene.eps[0], ticks(x)]),
  both: (scene, on) => (scene.eps = on ? [scene.eps[0], 0.2] : [scene.eps[0]]),
  "methods.1"(scene, name) {
    scene.methods = [scene.methods[0], name].filter(Boolean);
    if (!name) scene.second = null;
  },
  stop: (scene, x) => (scene.stop = x > 0 ? meeting(x) : x < 0 ? x : null),
  // The ghost comes before the others.
  ghost: (scene, on) =>
    Object.assign(scene, {
      ghost: on,
      shown: on ? [true, ...scene.shown.slice(0, 7)] : [...scene.shown.slice(1), true],
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
  const pivot = new Vector3(...centre).applyQuaternion(quaternion(turn).conjugate()).negate().toArray();
  scene.body = { half, pivot, density };
  scene.attitude = wxyz(quaternion(scene.attitude).multiply(quaternion(turn)));
}
// Sizes in the order N, B, T that each shape allows, of the volume of those given (thesis 5.6.5, 5.8.1).
const plate = (ratio) => (n, b, t) => ((b = Math.cbrt((2 * n * b * t) / ratio)), [ratio * b, b, b / 2]);
const SHAPES = {
  free: (...half) => half,
  lagrange: (n, b, t) => [Math.sqrt(n * b), Math.sqrt(n * b), t],
  kowalewski: plate(Math.sqrt(3)),
  goryachev_chaplygin: plate(Math.sqrt(7)),
};
export function resize(scene, half) {
  const old = scene.body;
  const least = 0.02 * Math.max(...half, ...old.half.map((h) => 0.02 * h)); // no plate thinner, nothing inside out
  const fit = SHAPES[scene.shape](...half.map((x) => Math.max(x, least)));
  scene.body = { ...old, half: fit, pivot: old.pivot.map((x, i) => (x * fit[i]) / old.half[i]) };
}

// The scene in words: of a file, and of a program.
const list = (x) => (Array.isArray(x) ? `[${x.map(list).join(", ")}]` : x);
const rows = (inertia) => list([0, 3, 6].map((i) => inertia.slice(i, i + 3)));
export function toToml({ body: { half, pivot, density = 1, mass, inertia, com }, momentum, attitude, gravity }) {
  const cuboid = `cuboid = { half = ${list(half)}, pivot = ${list(pivot)}, density = ${density} }`;
  const made = half ? cuboid : `mass = ${mass}\ninertia = ${rows(inertia ?? [])}\ncom = ${list(com)}`;
  return `momentum = ${list(momentum)}\nattitude = ${list(attitude)}\ngravity = ${gravity}\n\n[body]\n${made}\n`;
}
export function toPython({ body, momentum, attitude, gravity, methods: names, eps: steps, tol }) {
  const { half, pivot, density = 1, mass, inertia, com } = body;
  const cuboid = `.cuboid(half=${list(half)}, pivot=${list(pivot)}, density=${density})`;
  const made = half ? cuboid : `(mass=${mass}, inertia=${rows(inertia ?? [])}, com=${list(com)})`;
  const how = (name) => (methods.get(name).adaptive ? [`tol=${tol}`] : steps.map((eps) => `step=${eps}, every=1`));
  const solve = (name) =>
    how(name)
      .map((by) => `path = kr.solve(scene, t=100, method="${name}", ${by})`)
      .join("\n");
  return `import kreisel as kr

body = kr.Body${made}
scene = kr.Scene(body, momentum=${list(momentum)}, attitude=${list(attitude)}, gravity=${gravity})
${names.map(solve).join("\n")}
print(path.t[-1], path.q[-1], path.apex[-1], path.energy_error)
`;
}
export const bytes = (base64) => Uint8Array.from(atob(base64), (c) => c.charCodeAt(0));
