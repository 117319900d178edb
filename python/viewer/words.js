// A scene in words: of a file, and of a program.
import { methods } from "./core.js";
import { stepsOf } from "./scene.js";

const list = (x) => (Array.isArray(x) ? `[${x.map(list).join(", ")}]` : x);
const rows = (inertia) => list([0, 3, 6].map((i) => inertia.slice(i, i + 3)));

export function toToml({ body, momentum, attitude, gravity }) {
  const { half, pivot, density = 1, mass, inertia, com } = body;
  const made = half
    ? `cuboid = { half = ${list(half)}, pivot = ${list(pivot)}, density = ${density} }`
    : `mass = ${mass}\ninertia = ${rows(inertia)}\ncom = ${list(com)}`;
  return `momentum = ${list(momentum)}
attitude = ${list(attitude)}
gravity = ${gravity}

[body]
${made}
`;
}

export function toPython(top) {
  const { body, momentum, attitude, gravity, methods: names, tol } = top;
  const { half, pivot, density = 1, mass, inertia, com } = body;
  const made = half
    ? `.cuboid(half=${list(half)}, pivot=${list(pivot)}, density=${density})`
    : `(mass=${mass}, inertia=${rows(inertia)}, com=${list(com)})`;
  const ways = (name, side) =>
    methods.get(name).adaptive
      ? [`tol=${tol}`]
      : stepsOf(top, side).map((h) => `step=${h}, every=1`);
  const solve = (name, side) =>
    ways(name, side).map((way) => `    kr.solve(scene, t=100, method="${name}", ${way}),`);
  const start = `momentum=${list(momentum)}, attitude=${list(attitude)}, gravity=${gravity}`;
  return `import kreisel as kr

body = kr.Body${made}
scene = kr.Scene(body, ${start})
paths = [
${names.flatMap(solve).join("\n")}
]
for path in paths:
    print(path.method, path.step, path.t[-1], path.q[-1], path.apex[-1], path.energy_error)
`;
}
