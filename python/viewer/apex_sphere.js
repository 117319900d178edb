// The sphere on which the apex draws its trace. If limits of the tilt are known, two circles and
// the zone between them are drawn, else parallels.
import * as THREE from "three";
import { writeCorners, Line, makeStrip } from "./wide_lines.js";

const INK = "#7c8698";
const makeFilm = (color, opacity) =>
  new THREE.MeshBasicMaterial({ color, transparent: true, opacity, depthWrite: false });
// A circle of a smaller angle [rad] is a point and is hidden.
const SMALLEST_ANGLE = 0.01;

// All circles share one geometry of radius 1, which is never disposed.
const CIRCLE_PIECES = 128;
const CIRCLE = makeStrip(CIRCLE_PIECES + 1);
const turns = Array.from(
  { length: CIRCLE_PIECES + 1 },
  (_, i) => (2 * Math.PI * i) / CIRCLE_PIECES,
);
const listPoints = (point) => turns.flatMap(point);
writeCorners(
  listPoints((turn) => [Math.cos(turn), Math.sin(turn), 0]),
  CIRCLE_PIECES + 1,
  CIRCLE.places.array,
);
writeCorners(
  listPoints(() => new THREE.Color(INK).toArray()),
  CIRCLE_PIECES + 1,
  CIRCLE.shades.array,
);
CIRCLE.dispose = () => {};
function makeCircle() {
  const line = new Line(CIRCLE, { width: 1.6, opacity: 0.9 });
  line.setAngle = (angle) => {
    line.scale.setScalar(Math.sin(angle));
    line.position.z = Math.cos(angle);
    line.visible = Math.sin(angle) > SMALLEST_ANGLE;
  };
  return line;
}

// Make parallels, 30 degrees apart.
function makeParallels() {
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

// Make a zone of the sphere between two angles from the vertical. `setLimits` moves its points.
const [COLUMNS, ROWS] = [48, 24];
function makeZone(color, opacity) {
  const shape = new THREE.SphereGeometry(1, COLUMNS, ROWS, 0, 2 * Math.PI, 1, 1);
  const points = shape.attributes.position;
  const mesh = new THREE.Mesh(shape, makeFilm(color, opacity));
  mesh.frustumCulled = false;
  let [low, high] = [1, 2];
  mesh.setLimits = (from, to) => {
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

// Make a sphere of radius 1. `update` takes the limits of the tilt, or null, and the height of the
// floor. If there are limits, only their circles and the zone between them are visible.
export function makeApexSphere() {
  const [sphere, band] = [makeZone(INK, 0.07), makeZone("#e0a100", 0.1)];
  const [net, ...circles] = [makeParallels(), makeCircle(), makeCircle()];
  sphere.add(net, ...circles, band);
  sphere.update = (limits, floor) => {
    sphere.setLimits(0, Math.acos(Math.max(-1, Math.min(1, floor))));
    net.visible = sphere.material.visible = !limits;
    const { least, greatest } = limits ?? { least: 0, greatest: 0 };
    band.visible = greatest - least >= SMALLEST_ANGLE;
    if (band.visible) band.setLimits(least, greatest);
    circles[0].setAngle(least);
    circles[1].setAngle(greatest === least ? 0 : greatest);
  };
  return sphere;
}
