// A scene as TOML and as a Python program.
import { computeTensor, makeBody, methods, TICKS } from "./core.js";
import { getSteps } from "./scene.js";

const formatList = (x) => (Array.isArray(x) ? `[${x.map(formatList).join(", ")}]` : x);
const formatRows = (inertia) => formatList([0, 3, 6].map((i) => inertia.slice(i, i + 3)));

const isNonzero = (vector) => vector.some((x) => x !== 0);
// Return the words for what disturbs a top, each with its value.
const listDisturbances = ({ damping, friction, turning, shaking, gradient }) => [
  ...(damping ? [["damping", damping]] : []),
  ...(friction ? [["friction", friction]] : []),
  ...(isNonzero(turning) ? [["turning", formatList(turning)]] : []),
  ...(isNonzero(shaking) ? [["shaking", formatList(shaking)]] : []),
  ...(gradient ? [["gradient", gradient]] : []),
];
// Return the body with the moment that takes part in its rotation: without that of a free wheel.
function findTurningBody({ body, rotor, wheel }) {
  if (!isNonzero(wheel)) return body;
  const made = makeBody(body, rotor, wheel);
  const com = body.com ?? body.pivot.map((x) => -x || 0);
  return { mass: made.mass, inertia: computeTensor(made), com };
}
export function toToml(scene) {
  const { momentum, attitude, gravity, rotor } = scene;
  const { half, pivot, density = 1, mass, inertia, com } = findTurningBody(scene);
  const bodyText = half
    ? `cuboid = { half = ${formatList(half)}, pivot = ${formatList(pivot)}, density = ${density} }`
    : `mass = ${mass}\ninertia = ${formatRows(inertia)}\ncom = ${formatList(com)}\nunphysical = true`;
  return `momentum = ${formatList(momentum)}
attitude = ${formatList(attitude)}
gravity = ${gravity}
${listDisturbances(scene)
  .map(([name, value]) => `${name} = ${value}\n`)
  .join("")}
[body]
${bodyText}
${isNonzero(rotor) ? `rotor = ${formatList(rotor)}\n` : ""}`;
}

const END = 100; // end time of the program
const RESTART = `
def solve_in_steps(scene, method, step, count, tol):
    # As in the viewer, the method starts again after each step.
    for _ in range(count):
        scene = kr.solve(scene, [step], method, tol=tol).end
    return scene

`;
// Return a Python program that computes end states as the viewer does, one line for each method and
// step.
export function toPython(top, contact = null) {
  const { gravity, rotor, methods: names, second, tol } = top;
  const { half, pivot, density = 1, mass, inertia, com } = findTurningBody(top);
  const bodyText = half
    ? `.cuboid(half=${formatList(half)}, pivot=${formatList(pivot)}, density=${density})`
    : `(mass=${mass}, inertia=${formatRows(inertia)}, com=${formatList(com)}, unphysical=True)`;
  const scene = (attitude, momentum) =>
    `kr.Scene(body, momentum=${formatList(momentum)}, attitude=${formatList(attitude)}, ` +
    `gravity=${gravity}${listDisturbances(top).map(([name, x]) => `, ${name}=${x}`).join("")})`;
  const size = Math.hypot(...rotor);
  const rotorText = isNonzero(rotor)
    ? `.with_rotor(spin=${size}, inertia=1, axis=${formatList(rotor)})`
    : "";
  const hasOwnStart = (side) => second && side === 1;
  const writeRun = (name, side) => (step) => {
    const { isAdaptive, isRestarting } = methods.get(name);
    const start = hasOwnStart(side) ? "second" : "scene";
    const count = Math.floor((END * TICKS) / Math.round(step * TICKS));
    if (isRestarting) return `solve_in_steps(${start}, "${name}", ${step}, ${count}, tol=${tol})`;
    const how =
      (isAdaptive
        ? `[${count * step}], "${name}", tol=${tol}`
        : `${END}, "${name}", step=${step}, every=1`) + (contact === null ? "" : ", events=floor");
    return `kr.solve(${start}, ${how}).end`;
  };
  const ends = names.flatMap((name, side) => getSteps(top, side).map(writeRun(name, side)));
  // Restarts know no events: methods with them are not offered for tops with friction.
  const floorText =
    contact === null
      ? ""
      : `# The motion ends when the rim meets the floor.
floor = kr.events.crossing("apex_z", ${Math.cos(contact)}, terminal=True)
`;
  const secondText = second && `second = ${scene(second.slice(0, 4), second.slice(4))}\n`;
  return `import kreisel as kr

body = kr.Body${bodyText}${rotorText}
scene = ${scene(top.attitude, top.momentum)}
${secondText ?? ""}${names.some((name) => methods.get(name).isRestarting) ? RESTART : ""}${floorText}
ends = [
${ends.map((line) => `    ${line},\n`).join("")}]
for end in ends:
    print(end.attitude, end.momentum)
`;
}
