// A scene as text: a TOML file, and a program in Python.
import { methods, TICKS } from "./core.js";
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

const END = 100; // time at which the program stops
const RESTART = `
def solve_in_steps(scene, method, step, count, tol):
    # As in the page, the method starts again after each step.
    for _ in range(count):
        scene = kr.solve(scene, [step], method, tol=tol).end
    return scene

`;
// Returns a program in Python that computes the same states as the page, a line for each top.
export function toPython(top) {
  const { body, gravity, methods: names, second, tol } = top;
  const { half, pivot, density = 1, mass, inertia, com } = body;
  const made = half
    ? `.cuboid(half=${list(half)}, pivot=${list(pivot)}, density=${density})`
    : `(mass=${mass}, inertia=${rows(inertia)}, com=${list(com)}, unphysical=True)`;
  const scene = (attitude, momentum) =>
    `kr.Scene(body, momentum=${list(momentum)}, attitude=${list(attitude)}, gravity=${gravity})`;
  const isApart = (side) => second && side === 1;
  const end = (name, side) => (step) => {
    const { adaptive, restarts } = methods.get(name);
    const start = isApart(side) ? "second" : "scene";
    const count = Math.floor((END * TICKS) / Math.round(step * TICKS));
    if (restarts) return `solve_in_steps(${start}, "${name}", ${step}, ${count}, tol=${tol})`;
    const how = adaptive
      ? `[${count * step}], "${name}", tol=${tol}`
      : `${END}, "${name}", step=${step}, every=1`;
    return `kr.solve(${start}, ${how}).end`;
  };
  const ends = names.flatMap((name, side) => stepsOf(top, side).map(end(name, side)));
  const apart = second && `second = ${scene(second.slice(0, 4), second.slice(4))}\n`;
  return `import kreisel as kr

body = kr.Body${made}
scene = ${scene(top.attitude, top.momentum)}
${apart ?? ""}${names.some((name) => methods.get(name).restarts) ? RESTART : ""}
ends = [
${ends.map((line) => `    ${line},\n`).join("")}]
for end in ends:
    print(end.attitude, end.momentum)
`;
}
