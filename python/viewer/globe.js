// The globe on which the apex writes. Where a closed form knows between which circles that is, they
// are drawn with the zone between them; elsewhere the parallels are.
import * as THREE from "three";
import { fourfold, Line, strip } from "./lines.js";

const INK = "#7c8698";
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
function circle() {
  const line = new Line(CIRCLE, { width: 1.6, opacity: 0.9 });
  line.at = (angle) => {
    line.scale.setScalar(Math.sin(angle));
    line.position.z = Math.cos(angle);
    line.visible = Math.sin(angle) > POINT;
  };
  return line;
}

// The parallels, each 30 degrees from the next.
function parallels() {
  const places = [1, 2, 3, 4, 5].flatMap((row) => {
    const [out, up] = [Math.sin((row * Math.PI) / 6), Math.cos((row * Math.PI) / 6)];
    const point = (turn) => [out * Math.cos(turn), out * Math.sin(turn), up];
    return turns.slice(1).flatMap((end, k) => [...point(turns[k]), ...point(end)]);
  });
  const shape = new THREE.BufferGeometry();
  shape.setAttribute("position", new THREE.Float32BufferAttribute(places, 3));
  const paint = new THREE.LineBasicMaterial({ color: INK, transparent: true, opacity: 0.3 });
  return new THREE.LineSegments(shape, paint);
}

// A zone of the sphere, between two angles from above. Its points move when these change.
const [COLUMNS, ROWS] = [48, 24];
function zone(color, opacity) {
  const shape = new THREE.SphereGeometry(1, COLUMNS, ROWS, 0, 2 * Math.PI, 1, 1);
  const points = shape.attributes.position;
  const mesh = new THREE.Mesh(shape, film(color, opacity));
  mesh.frustumCulled = false;
  let [low, high] = [1, 2];
  mesh.between = (from, to) => {
    if (from === low && to === high) return;
    [low, high] = [from, to];
    for (let k = 0; k < points.count; k++) {
      const turn = (2 * Math.PI * (k % (COLUMNS + 1))) / COLUMNS;
      const angle = from + ((to - from) * Math.floor(k / (COLUMNS + 1))) / ROWS;
      const out = Math.sin(angle);
      points.setXYZ(k, out * Math.cos(turn), out * Math.sin(turn), Math.cos(angle));
    }
    points.needsUpdate = true;
  };
  return mesh;
}

// Makes a globe of radius 1. It follows the limits, null where none are known, and the height of
// the floor. Where there are limits, only their zone is shown.
export function globe() {
  const [bowl, band] = [zone(INK, 0.07), zone("#e0a100", 0.1)];
  const [net, ...circles] = [parallels(), circle(), circle()];
  bowl.add(net, ...circles, band);
  bowl.follow = (limits, floor) => {
    bowl.between(0, Math.acos(Math.max(-1, Math.min(1, floor))));
    net.visible = bowl.material.visible = !limits;
    const { least, greatest } = limits ?? { least: 0, greatest: 0 };
    band.visible = greatest - least >= POINT;
    if (band.visible) band.between(least, greatest);
    circles[0].at(least);
    circles[1].at(greatest === least ? 0 : greatest);
  };
  return bowl;
}
