// What is on the stage, as plain data that JSON can hold, and the rules by which it changes.
import { Quaternion, Vector3 } from "three";
import { cuboidOf, measureOf, methods, TICKS, TOPS } from "./core.js";
import { begun } from "./starts.js";

export const plain = {
  version: 1,
  name: "",
  about: "",
  body: { half: [0.8, 0.8, 1], pivot: [0, 0, -1], density: 1 }, // or { mass, inertia (9), com }
  shape: "free",
  attitude: [1, 0, 0, 0], // w, x, y, z
  momentum: [0.172, -1.862, 1.46],
  second: null, // attitude and momentum (7 numbers) for the tops of the second method, if others
  taken: null, // the time at which the start was taken out of a motion
  gravity: 1,
  methods: ["bobenko_suris"], // one to three,
  step: [0.01], // each with one or two steps,
  own: false, // or each with its own: the first with the first, the others with the second
  tol: 1e-5, // of adaptive methods: the thesis' Atol = Rtol
  ghost: false,
  distance: 4,
  stop: null,
  speed: 1,
  chart: "nutation", // the name of a measure
  integral: "energy", // the measure whose change tells of the computation
  log: false, // of changes and errors
  shown: Array(TOPS).fill(true), // in the charts, of the tops
  tracks: [], // { name, step, states: base64 of float64 t, q, m }
  corners: false, // move the fixed point
  show: {
    trace: true,
    rod: false,
    axes: false,
    floor: true,
    flat: false,
    section: "stiff", // of the rod, one of SECTIONS
    drops: false, // lines down to the floor
    solid: "top", // or "box": how a symmetric body is drawn, others are boxes; or "none"
    opacity: 0.3,
    thickness: 1,
  },
};

// A scene may also say eps for step, and some measures have a shorter name; `fourth` is the fourth
// integral of a body of this kind, which has the kind's name.
const saysStep = ({ eps, ...given }) => (eps === undefined ? given : { step: eps, ...given });
export const chartOf = (name, kind) =>
  ({ vertical: "vertical_momentum", axial: "axial_momentum", fourth: kind })[name] ?? name;

// Each part of a scene must fit one of these. What has a range says so when it refuses.
function listOf(fits, ...lengths) {
  const all = (x) => Array.isArray(x) && lengths.includes(x.length) && x.every(fits);
  return Object.assign(all, { range: fits.range });
}
const within = (low, high) =>
  Object.assign((x) => typeof x === "number" && x >= low && x <= high, {
    range: `from ${low} to ${high}`,
  });
const orNone = (fits) => Object.assign((x) => x === null || fits(x), { range: fits.range });
const [word, flag, size, three] = [
  (x) => typeof x === "string",
  (x) => x === !!x,
  within(-1e12, 1e12),
  listOf(within(-1e12, 1e12), 3),
];
const isStep = within(1 / TICKS, 2000);
const isTrack = (track) => word(track?.name) && word(track.states) && isStep(track.step);
// The sides of a rod's section are to each other as the body's moments to these powers.
export const SECTIONS = { stiff: 0.5, thesis: 1, round: 0 };
const isShow = ({ opacity, thickness, solid, section, ...flags }) =>
  within(0, 1)(opacity) &&
  within(0.1, 20)(thickness) &&
  Object.hasOwn(SECTIONS, section) &&
  ["top", "box", "none"].includes(solid) &&
  Object.values(flags).every(flag);
const isMeasure = (x) => word(x) && !!measureOf(chartOf(x, "kowalewski"));
const CHECKS = {
  version: Object.assign((x) => x === plain.version, { range: `this page reads ${plain.version}` }),
  body: (b) => (three(b?.half) ? three(b.pivot) : listOf(size, 9)(b?.inertia) && three(b.com)),
  shape: (x) => word(x) && Object.hasOwn(SIZES, x),
  attitude: listOf(size, 4),
  momentum: three,
  second: orNone(listOf(size, 7)),
  taken: orNone(within(0, 1e9)),
  gravity: size,
  methods: listOf(word, 1, 2, 3),
  step: listOf(isStep, 1, 2),
  tol: within(1e-15, 1),
  distance: within(0, 100),
  stop: orNone(within(1 / TICKS, 1e9)),
  speed: within(0, 1e6),
  chart: isMeasure,
  integral: isMeasure,
  shown: listOf(flag, TOPS),
  show: isShow,
  tracks: listOf(isTrack, 0, 1),
};
// Completes a scene from anywhere. Parts that it leaves out are those of `plain`; parts that it has
// must fit; parts that no scene has, as the tries of a preset, are dropped.
export function complete(given) {
  if (given?.constructor !== Object) throw new Error("it is no scene");
  const scene = structuredClone(begun({ ...plain, ...saysStep(given) }));
  scene.show = { ...plain.show, ...scene.show };
  if (Array.isArray(scene.tracks)) scene.tracks = scene.tracks.map((t) => saysStep(t ?? {}));
  for (const [key, model] of Object.entries(plain)) {
    const fits = CHECKS[key] ?? ((x) => typeof x === typeof model);
    if (fits(scene[key])) continue;
    const shown = JSON.stringify(scene[key]).slice(0, 60);
    throw new Error(`${key} cannot be ${shown}${fits.range ? `: ${fits.range}` : ""}`);
  }
  return Object.fromEntries(Object.keys(plain).map((key) => [key, scene[key]]));
}
// Returns what a place of a scene may hold, in words.
export const rangeOf = (place) => CHECKS[place.split(".")[0]]?.range;

export const quaternion = ([w, x, y, z]) => new Quaternion(x, y, z, w);
export const wxyz = (q) => [q.w, q.x, q.y, q.z];
export const cornerSigns = (corner) =>
  [corner & 1, corner & 2, corner & 4].map((bit) => (bit ? 1 : -1));

// Returns the steps of a method.
export const stepsOf = ({ step, own }, side) =>
  own ? [step[Math.min(side, step.length - 1)]] : step;
// Returns the tops that a scene asks for, in the order of the stage. `side` counts the methods from
// left to right; `against` is the truth with which a top is compared. A truth stands behind the
// others and is drawn as a ghost or not at all.
// Two for each method, for its first and its second step. Red and violet differ for every eye.
const COLOURS = ["#c73237", "#c37801", "#b02fe8", "#299d80", "#586cb7", "#087583"];
const SHARPEST = ["exact", "taylor", "extrap"]; // the first of them that suits is the truth
const [ALONE, TRUTH] = [-1, -2];
export function topsOf(scene, body) {
  const { step, ghost, second, tracks, methods: names, gravity } = scene;
  const sharpest = SHARPEST.find((name) => methods.get(name)?.suits(body, gravity));
  const tops = names.flatMap((method, side) =>
    stepsOf(scene, side).map((step, thin) => {
      const colour = COLOURS[2 * side + thin];
      return { method, step, side, role: thin ? "thin" : "thick", colour };
    }),
  );
  const beside = { side: 1, role: "thick", colour: COLOURS[4] };
  for (const track of tracks) tops.push({ ...beside, track, method: track.name, step: track.step });
  const first = tops.length;
  const isApart = (top) => second && top.side === 1 && !top.track;
  for (const top of tops)
    top.against = top.method === "exact" && !top.track ? ALONE : first + +!!isApart(top);
  const truth = { colour: "#7d8491", method: sharpest, step: step[0], against: TRUTH };
  tops.push({ ...truth, side: 0, role: ghost ? "ghost" : "truth" });
  if (second) tops.push({ ...truth, side: 1, role: "truth" });
  return tops;
}

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

export function bytes(base64) {
  try {
    return Uint8Array.from(atob(base64), (c) => c.charCodeAt(0));
  } catch {
    throw new Error("the states of the path cannot be read: they are no base64");
  }
}
