// The parts of which the picture is made.
import * as THREE from "three";
import { ROD_RINGS, ROD_SIDES, stage, WAY_POINTS } from "./core.js";
import { fourfold, Line, strip } from "./lines.js";
import { cornerSigns, quaternion } from "./scene.js";
import { hull, surface } from "./turned.js";

const vector = (...numbers) => new THREE.Vector3(...numbers);
const mesh = (shape, paint) => new THREE.Mesh(shape, paint);
const flat = (look) => new THREE.MeshBasicMaterial({ transparent: true, ...look });
const shiny = (look) => new THREE.MeshPhongMaterial({ transparent: true, ...look });
const upright = (shape) => shape.rotateX(Math.PI / 2); // what three.js makes along y
const UNITS = [vector(1, 0, 0), vector(0, 1, 0), vector(0, 0, 1)];
const ROD = new THREE.CylinderGeometry(1, 1, 1, 16);
const BALL = new THREE.SphereGeometry(1, 20, 14);
const put = (group, part, userData = {}) => (group.add(part), Object.assign(part, { userData }));

// The fixed point stands on a needle, or on a little cone where the floor is near.
export function stand(depth) {
  const cone = upright(new THREE.CylinderGeometry(0.012, 0.05 + 0.025 * depth, depth, 32));
  return mesh(cone.translate(0, 0, -depth / 2), shiny({ color: "#9a9389", opacity: 0.8 }));
}

// A turned top is lacquered, with a painted sector by which its spin is seen; its axle goes from
// the tip to the pen, which writes on the globe. Lengths are the body's own.
const SECTOR = 1 / 6; // of a whole turn
const STEEL = "#aab2bd";
const CREAM = "#f7ecd2";
export function turnedTop(turned, { colour, role }, pen) {
  const group = new THREE.Group();
  const faint = role === "thick" ? {} : { opacity: 0.35, depthWrite: false };
  const look = { shininess: 60, specular: "#4c453e", transparent: role !== "thick", ...faint };
  const satin = (color) => shiny({ color, ...look });
  const part = (shape, color) => put(group, mesh(shape, satin(color)), { part: "face" });
  const { axis, up, height, profile } = turned;
  const wide = Math.max(...profile.map(([, r]) => r));
  part(surface(turned, 0, 1 - SECTOR), colour);
  part(surface(turned, 1 - SECTOR, SECTOR), CREAM);
  const thin = 0.028 * wide;
  const [low, high] = height ? [-height, pen - height] : [-pen, pen];
  const length = high - low - 6 * thin;
  const rod = new THREE.CylinderGeometry(thin, thin, length, 20);
  part(rod.translate(0, high - length / 2, 0), STEEL);
  const tip = new THREE.ConeGeometry(thin, 6 * thin, 20).rotateX(Math.PI);
  part(tip.translate(0, low + 3 * thin, 0), STEEL);
  group.quaternion.setFromUnitVectors(UNITS[1], UNITS[axis].clone().multiplyScalar(up));
  const handles = [...group.children];
  const caster = put(group, mesh(surface(hull(turned), 0, 1)));
  caster.visible = false;
  return Object.assign(new THREE.Group().add(group), { shading: [caster], handles, look() {} });
}

// A cuboid has translucent faces, and edges and corners to take hold of. All cuboids are these few
// shapes, put in their places: a hand that pulls at one makes nothing anew.
const CUBE = new THREE.BoxGeometry(2, 2, 2);
export function box({ colour: color, role }) {
  const group = new THREE.Group();
  const glass = shiny({ color, side: 2, depthWrite: false });
  const opacity = role === "ghost" ? 0.55 : 1;
  const solid = shiny({ color, transparent: opacity < 1, opacity, shininess: 40 });
  const faces = put(group, mesh(CUBE, glass), { part: "face" });
  const [corners, edges] = [[], []];
  for (let i = 0; i < 8; i++) {
    const at = vector(...cornerSigns(i));
    corners.push({ part: put(group, mesh(BALL, solid), { part: "corner", corner: i }), at });
    for (const k of [0, 1, 2].filter((k) => !((i >> k) & 1))) {
      const part = put(group, mesh(ROD, solid), { part: "face" });
      part.quaternion.setFromUnitVectors(UNITS[1], UNITS[k]);
      edges.push({ part, k, at: at.clone().setComponent(k, 0) });
    }
  }
  group.shading = [faces];
  group.handles = group.children;
  group.look = (half, opacity, times) => {
    Object.assign(glass, { opacity, transparent: opacity < 1, depthWrite: opacity === 1 });
    const size = Math.cbrt(half[0] * half[1] * half[2]);
    const thin = times * size * (role === "thick" ? 0.026 : 0.013);
    faces.scale.set(...half);
    for (const { part, at } of [...corners, ...edges]) part.position.copy(at).multiply(faces.scale);
    for (const { part } of corners) part.scale.setScalar(2.6 * thin);
    for (const { part, k } of edges) part.scale.set(thin, 2 * half[k], thin);
  };
  return group;
}

const SHAFT = upright(new THREE.CylinderGeometry(1, 1, 1, 16)).translate(0, 0, 0.5);
const HEAD = upright(new THREE.ConeGeometry(3, 8, 24));
// An arrow is drawn last and through everything, for it begins inside the body; with `depthTest` it
// comes out of the body.
export function arrow(color, radius, opacity = 1, depthTest = false) {
  const group = new THREE.Group();
  const paint = shiny({ color, depthTest, opacity });
  const [shaft, tip] = [mesh(SHAFT, paint), mesh(HEAD, paint)];
  for (const part of [shaft, tip]) part.scale.setScalar(radius);
  const target = mesh(BALL, new THREE.MeshBasicMaterial({ visible: false }));
  target.scale.setScalar(Math.max(radius * 5, 0.12));
  shaft.renderOrder = tip.renderOrder = 10;
  group.add(shaft, tip, target);
  group.tip = target; // larger than the tip, for fingers
  group.colour = color;
  group.end = () => tip.getWorldPosition(vector());
  group.point = (...v) => {
    const [direction, length] = [vector(...v), Math.hypot(...v) || 1e-9];
    shaft.visible = tip.visible = length > 1e-3; // nothing has no direction
    group.quaternion.setFromUnitVectors(UNITS[2], direction.divideScalar(length));
    shaft.scale.z = tip.position.z = target.position.z = length;
  };
  return group;
}

// Lines from the tip of m and from the centre of mass straight down to the floor, each with a spot
// where it ends: else an eye cannot tell how far off they are.
export function dropLines() {
  const group = new THREE.Group();
  const drops = ["#0d9678", "#7c8698"].map((color) => {
    const [line, spot] = [SHAFT, BALL].map((shape) => mesh(shape, flat({ color, opacity: 0.8 })));
    spot.scale.set(0.07, 0.07, 0.004);
    return new THREE.Group().add(line, spot);
  });
  group.add(...drops);
  group.follow = (floor, ...points) =>
    drops.forEach((drop, k) => {
      const { x, y, z } = points[k];
      drop.position.set(x, y, floor);
      drop.visible = z > floor;
      drop.children[0].scale.set(0.012, 0.012, z - floor);
    });
  return group;
}

// Light about a handle.
export function halo() {
  const light = mesh(BALL, flat({ color: "#ffb020", opacity: 0.45, depthTest: false }));
  light.scale.setScalar(0.16);
  light.renderOrder = 12;
  light.visible = false;
  return light;
}

// The way of the apex begins with the newest point, which is strongest in colour. No older piece
// covers a fresh one.
const FRESH = 256; // points
export function pathLine(colour, ground) {
  const [shape, part] = [strip(WAY_POINTS), new THREE.BufferGeometry()];
  Object.assign(part, { attributes: shape.attributes, index: shape.index });
  const [line, fresh] = [new Line(shape, { depthWrite: false }), new Line(part)];
  const points = new Float32Array(3 * WAY_POINTS);
  const [paint, mixed] = [new THREE.Color(colour), new THREE.Color()];
  for (let i = 0; i < WAY_POINTS; i++) {
    const strength = Math.max(0.2, 1 - (0.9 * i) / WAY_POINTS);
    mixed.lerpColors(ground, paint, strength).toArray(points, 3 * i);
  }
  fourfold(points, WAY_POINTS, shape.shades.array);
  [line.renderOrder, fresh.renderOrder] = [1, 2]; // after what is solid, and the fresh one last
  line.add(fresh);
  line.follow = (i, radius, thickness) => {
    line.width = fresh.width = 2.4 * thickness;
    const n = stage.way(i, radius, points);
    fourfold(points, n, shape.places.array);
    shape.places.needsUpdate = true;
    line.show(n - 1);
    fresh.show(Math.min(n - 1, FRESH));
  };
  return line;
}

// A way that has ended: that of the motion before a push.
export function faintLine(colour) {
  const line = new Line(strip(WAY_POINTS), { opacity: 0.35, depthWrite: false });
  const { places, shades } = line.geometry;
  const shade = new THREE.Color(colour).toArray();
  fourfold(Array(WAY_POINTS).fill(shade).flat(), WAY_POINTS, shades.array);
  let drawn = null;
  line.follow = (points, radius, thickness) => {
    line.width = 1.6 * thickness;
    line.scale.setScalar(radius);
    if (drawn === points) return;
    drawn = points;
    fourfold(points, points.length / 3, places.array);
    places.needsUpdate = true;
    line.show(points.length / 3 - 1);
  };
  return line;
}

// The elastic rod is made of rings of points about its centre line. The longer it gets, the smaller
// it is drawn, so that it stays in the picture.
const ROOM = 3.4; // from the fixed point
const FACES = Array.from({ length: (ROD_RINGS - 1) * ROD_SIDES }, (_, a) => {
  const b = a % ROD_SIDES === ROD_SIDES - 1 ? a + 1 - ROD_SIDES : a + 1;
  return [a, b, a + ROD_SIDES, b, b + ROD_SIDES, a + ROD_SIDES];
}).flat();
export function rodMesh(color) {
  const geometry = new THREE.BufferGeometry();
  const places = new THREE.BufferAttribute(new Float32Array(3 * ROD_RINGS * ROD_SIDES), 3);
  geometry.setAttribute("position", places);
  geometry.setIndex(FACES);
  const rod = mesh(geometry, shiny({ color, transparent: false, side: 2, shininess: 40 }));
  rod.frustumCulled = false;
  rod.follow = (i, scale, radius, power) => {
    const n = stage.rod(i, scale, radius, power, places.array);
    geometry.setDrawRange(0, 6 * (n - ROD_SIDES));
    let far = ROOM;
    for (let k = 0; k < 3 * n; k++) far = Math.max(far, Math.abs(places.array[k]));
    rod.scale.setScalar(ROOM / far);
    places.needsUpdate = true;
    geometry.computeVertexNormals();
  };
  return rod;
}

// Draws the principal axes N, B, T at the fixed point, and the centre of mass.
export function axisLines() {
  const frame = new THREE.Group();
  const colours = ["#e07a2e", "#a94fd0", "#1797a6"];
  const axes = colours.map((colour) => put(frame, arrow(colour, 0.014)));
  const dot = put(frame, mesh(BALL, flat({ color: "#ffb020", depthTest: false })));
  dot.scale.setScalar(0.07);
  dot.renderOrder = 11;
  frame.follow = (body, zoom, length) => {
    frame.quaternion.copy(quaternion(body.axes));
    axes.forEach((axis, k) => axis.point(...UNITS[k].clone().multiplyScalar(length)));
    dot.position.set(...body.com).multiplyScalar(zoom);
  };
  return frame;
}
