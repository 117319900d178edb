// The globe on which the apex writes. Where a closed form knows between which circles that is, they
// are drawn with the zone between them; elsewhere the parallels are.
import * as THREE from "three";
import { fourfold, Line, strip } from "./lines.js";

const INK = "#7c8698";
const upright = (shape) => shape.rotateX(Math.PI / 2); // what three.js makes along y
let lines = null; // the parallels, made when they are first asked for
const parallels = () =>
  (lines ??= upright(new THREE.EdgesGeometry(new THREE.SphereGeometry(1, 96, 6), 10)));
const film = (color, opacity) =>
  new THREE.MeshBasicMaterial({ color, transparent: true, opacity, depthWrite: false });
// Below this angle a circle is a point.
const POINT = 0.01;

// All circles are this one, made smaller. Globes come and go, and share it.
const ROUND = 128; // pieces
const CIRCLE = strip(ROUND + 1);
const turns = Array.from({ length: ROUND + 1 }, (_, i) => (2 * Math.PI * i) / ROUND);
const round = (point) => turns.flatMap(point);
fourfold(round((turn) => [Math.cos(turn), Math.sin(turn), 0]), ROUND + 1, CIRCLE.places.array);
fourfold(round(() => new THREE.Color(INK).toArray()), ROUND + 1, CIRCLE.shades.array);
CIRCLE.dispose = () => {};
const part = (columns, rows, from, angle) =>
  upright(new THREE.SphereGeometry(1, columns, rows, 0, 2 * Math.PI, from, angle));
// Bowls by the height of their rim: a drag asks for the same one again and again.
const bowls = new Map();
function bowlOf(floor) {
  const rim = Math.acos(Math.max(-1, Math.min(1, floor)));
  if (!bowls.has(rim)) bowls.clear(), bowls.set(rim, part(48, 24, 0, rim));
  return bowls.get(rim);
}

// Makes a globe of radius 1 above a level floor; `limits` may be null.
export function globe(limits, floor) {
  const all = new THREE.Mesh(bowlOf(floor), film(INK, 0.07));
  if (!limits) {
    const color = { color: INK, transparent: true, opacity: 0.3 };
    return all.add(new THREE.LineSegments(parallels(), new THREE.LineBasicMaterial(color)));
  }
  const { least, greatest } = limits;
  for (const angle of new Set([least, greatest]))
    if (Math.sin(angle) > POINT) all.add(circle(angle));
  if (greatest - least < POINT) return all;
  const zone = part(48, 2 + Math.ceil(7 * (greatest - least)), least, greatest - least);
  all.add(new THREE.Mesh(zone, film("#e0a100", 0.1)));
  return all;
}
function circle(angle) {
  const line = new Line(CIRCLE, { width: 1.6, opacity: 0.9 });
  line.scale.setScalar(Math.sin(angle));
  line.position.z = Math.cos(angle);
  return line;
}
