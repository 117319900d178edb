// What is on the stage, as plain data that JSON can hold, and the rules by which it changes. No drawing here.
import { Quaternion, Vector3 } from "three";
import { makeBody, methods } from "./core.js";

export const plain = {
  version: 1,
  name: "",
  about: "",
  body: { half: [0.8, 0.8, 1], pivot: [0, 0, -1], density: 1 }, // or { mass, inertia: 9 numbers, com }
  shape: "free",
  attitude: [1, 0, 0, 0], // w, x, y, z
  momentum: [0.172, -1.862, 1.46],
  second: null, // another momentum, for the tops of the second method
  gravity: 1,
  methods: ["bobenko_suris"], // one or two,
  eps: [0.01], // each with one or two steps
  tol: 1e-5, // of adaptive methods: the thesis' Atol = Rtol
  ghost: false,
  distance: 4,
  stop: null,
  speed: 1,
  chart: "energy", // or vertical, axial, fourth
  tracks: [], // { name, eps, states: base64 of float64 t, q, m }
  show: { trace: true, rod: false, axes: false, floor: true, flat: false, opacity: 0.3, thickness: 1 },
};
export const complete = (given) => ({
  ...structuredClone({ ...plain, ...given }),
  show: { ...plain.show, ...given.show },
});

export const quaternion = ([w, x, y, z]) => new Quaternion(x, y, z, w);
export const cornerSigns = (corner) => [corner & 1, corner & 2, corner & 4].map((bit) => (bit ? 1 : -1));
export const wxyz = (q) => [q.w, q.x, q.y, q.z];

// The tops that a scene asks for, in the order of the stage. `side`: 0 the first method, 1 what stands beside it.
export function cast(scene) {
  const tops = [];
  const ghost = { eps: scene.eps[0], side: 0, role: "ghost", colour: "#8f96a3", against: -1 };
  if (scene.ghost) tops.push({ method: truth(scene), ...ghost });
  const first = tops.length;
  scene.methods.forEach((method, side) =>
    scene.eps.forEach((eps, second) => {
      const apart = side === 1 && scene.second;
      const against = scene.ghost && !apart ? 0 : second ? tops.length - 1 : side && !apart ? first : -1;
      tops.push({ method, eps, side, role: second ? "thin" : "thick", colour: COLOURS[2 * side + second], against });
    }),
  );
  scene.tracks.forEach((track, i) =>
    tops.push({
      track,
      method: track.name,
      eps: track.eps,
      side: 1,
      role: "thick",
      colour: TRACKS[i % 2],
      against: 0,
    }),
  );
  return tops;
}
const COLOURS = ["#d8432e", "#2f6fde", "#e0a100", "#2c9c4b"]; // red, blue, yellow, green: the thesis'
const TRACKS = ["#9a4fd0", "#d0508f"];
const SHARPEST = ["exact", "taylor", "extrap"]; // the first of them that the core has, and that applies
export function truth(scene) {
  const block = makeBody(scene.body);
  return SHARPEST.find((name) => methods.some((m) => m.name === name && m.suits(block, scene.gravity)));
}

// How a body is drawn: a cuboid with half edges, its centre seen from the fixed point, its turn in the body's frame.
export function picture(body) {
  if (body.half) {
    return {
      half: body.half,
      centre: body.pivot.map((x) => -x || 0),
      turn: [1, 0, 0, 0],
      density: body.density ?? 1,
    };
  }
  const found = cuboidOf(body, body.mass);
  if (found) return { ...found, density: body.mass / (8 * found.half[0] * found.half[1] * found.half[2]) };
  // Mass and lever as they are often made up fit no body. Only their product moves it: take a body of density 1.
  const excess = (mass) => {
    const box = cuboidOf(body, mass);
    return box ? 8 * box.half[0] * box.half[1] * box.half[2] - mass : -1;
  };
  let low = body.mass * 4096;
  while (low > body.mass / 4096 && excess(low) < 0) low /= 1.01;
  let high = low * 1.01;
  for (let i = 0; i < 50; i++) {
    const middle = (low + high) / 2;
    if (excess(middle) < 0) high = middle;
    else low = middle;
  }
  return { ...(cuboidOf(body, low) ?? { half: [1, 1, 1], centre: [0, 0, 0], turn: [1, 0, 0, 0] }), density: 1 };
}
// The cuboid of this mass with the body's inertia and the same lever; none if no body has them.
function cuboidOf(body, mass) {
  const c = body.com.map((x) => (x * body.mass) / mass);
  const square = c[0] ** 2 + c[1] ** 2 + c[2] ** 2;
  const inertia = body.inertia.map((x, i) => x - mass * ((i % 4 ? 0 : square) - c[i % 3] * c[(i / 3) | 0]));
  try {
    const [, x, y, z, , , , ...turn] = makeBody({ mass, inertia, com: [0, 0, 0] });
    const squares = [y + z - x, z + x - y, x + y - z].map((sum) => (1.5 * sum) / mass);
    if (!squares.every((s) => s > 1e-9 * square)) return null;
    return { half: squares.map(Math.sqrt), centre: c, turn };
  } catch {
    return null;
  }
}

// A change by hand works on a cuboid along its own frame: the attitude takes up how it lay.
export function becomeCuboid(scene) {
  if (scene.body.half) return;
  const { half, centre, turn, density } = picture(scene.body);
  const back = quaternion(turn).conjugate();
  scene.body = { half, pivot: new Vector3(...centre).applyQuaternion(back).negate().toArray(), density };
  scene.attitude = wxyz(quaternion(scene.attitude).multiply(quaternion(turn)));
}

// Sizes in the order N, B, T that each shape allows, nearest to those given (thesis 5.6.5, 5.8.1).
const SHAPES = {
  free: (half) => half,
  lagrange: ([n, b, t]) => [Math.sqrt(n * b), Math.sqrt(n * b), t],
  kowalewski: ([n, b]) => ((b = Math.sqrt((n / Math.sqrt(3)) * b)), [Math.sqrt(3) * b, b, b / 2]),
  goryachev_chaplygin: ([n, b]) => ((b = Math.sqrt((n / Math.sqrt(7)) * b)), [Math.sqrt(7) * b, b, b / 2]),
};
export function resize(scene, half) {
  const old = scene.body;
  const fit = SHAPES[scene.shape](half.map((x) => Math.min(Math.max(x, 0.05), 50)));
  scene.body = { ...old, half: fit, pivot: old.pivot.map((x, i) => (x * fit[i]) / old.half[i]) };
}
export function takeShape(scene, shape) {
  becomeCuboid(scene);
  scene.shape = shape;
  if (shape !== "free") scene.body.pivot = [0, 0, -scene.body.half[2]];
  resize(scene, scene.body.half);
  if (shape === "goryachev_chaplygin") scene.momentum[2] = 0; // else G is not constant
}

const list = (numbers) => `[${numbers.join(", ")}]`;
export function toToml(scene, { body } = scene) {
  const box = () =>
    `cuboid = { half = ${list(body.half)}, pivot = ${list(body.pivot)}, density = ${body.density ?? 1} }`;
  const rows = () => [0, 3, 6].map((i) => list(body.inertia.slice(i, i + 3))).join(", ");
  const any = () => `mass = ${body.mass}\ninertia = [${rows()}]\ncom = ${list(body.com)}`;
  return `momentum = ${list(scene.momentum)}\nattitude = ${list(scene.attitude)}\ngravity = ${scene.gravity}\n
[body]\n${body.half ? box() : any()}\n`.replace(/(?<![\w.])(-?\d+)(?![\w.])/g, "$1.0");
}
export function toPython(scene, { body } = scene) {
  const rows = () => [0, 3, 6].map((i) => list(body.inertia.slice(i, i + 3))).join(", ");
  const made = body.half
    ? `kr.Body.cuboid(half=${list(body.half)}, pivot=${list(body.pivot)}, density=${body.density ?? 1})`
    : `kr.Body(mass=${body.mass}, inertia=[${rows()}], com=${list(body.com)})`;
  const adaptive = (name) => methods.find((m) => m.name === name).adaptive;
  const solves = scene.methods.flatMap((name) =>
    adaptive(name)
      ? [`path = kr.solve(scene, t=100, method="${name}", tol=${scene.tol})`]
      : scene.eps.map((eps) => `path = kr.solve(scene, t=100, method="${name}", step=${eps}, every=1)`),
  );
  return `import kreisel as kr

body = ${made}
scene = kr.Scene(body, momentum=${list(scene.momentum)}, attitude=${list(scene.attitude)}, gravity=${scene.gravity})
${solves.join("\n")}
print(path.t[-1], path.q[-1], path.apex[-1], path.energy_error)
`;
}

// As text for a link: UTF-8 in base64 without the signs that links mind.
export const toLink = (scene) =>
  btoa(String.fromCharCode(...new TextEncoder().encode(JSON.stringify(scene))))
    .replace(/\+/g, "-")
    .replace(/\//g, "_");
export const fromLink = (words) =>
  JSON.parse(new TextDecoder().decode(bytes(words.replace(/-/g, "+").replace(/_/g, "/"))));
export const bytes = (base64) => Uint8Array.from(atob(base64), (c) => c.charCodeAt(0));
