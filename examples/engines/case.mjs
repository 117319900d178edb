// The command line of the adaptors in JavaScript: a case of the suite in, the motion as CSV out.
// node ENGINE.mjs CASE [STEP] [VARIANT]
import { readFile } from "node:fs/promises";

const cross = ([a, b, c], [x, y, z]) => [b * z - c * y, c * x - a * z, a * y - b * x];

/** Returns q v q* for a quaternion (w, x, y, z). */
function turn([w, ...u], v) {
  const s = cross(u, v).map((x) => 2 * x);
  return cross(u, s).map((x, i) => v[i] + w * s[i] + x);
}

/** Prints the motion that `simulate(mass, moments, q, w, step, variant)` yields: the attitude
 * (w, x, y, z) and the angular velocity in space, at the start and after each step. */
export async function writeMotion(simulate) {
  const [file, step = "0.016666666666666666", variant = "default"] = process.argv.slice(2);
  const { name, parameters, initial, states } = JSON.parse(await readFile(file, "utf8"));
  const { mass, inertia, center_of_mass: _, gravity = 0, ...others } = parameters;
  if (gravity || Object.keys(others).length || inertia.flat().length !== 3)
    throw new Error(`${name} is not a free body with its principal axes along those of the body`);
  const q = initial.attitude.map((x) => x / Math.hypot(...initial.attitude));
  const count = Math.round(states.at(-1)[0] / step);
  const velocity = turn(q, initial.angular_velocity);
  const motion = await simulate(mass, inertia, q, velocity, +step, variant);
  let text = "t,qw,qx,qy,qz,wx,wy,wz\n";
  for (let i = 0; i <= count; i++) {
    const { q, w } = motion.next().value;
    text += `${[i * step, ...q, ...turn([q[0], -q[1], -q[2], -q[3]], w)]}\n`;
  }
  process.stdout.write(text, () => process.exit());
}
