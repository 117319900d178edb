// The parts of which the picture is made.
import * as THREE from "three";
import { Line2 } from "three/addons/lines/Line2.js";
import { LineGeometry } from "three/addons/lines/LineGeometry.js";
import { LineMaterial } from "three/addons/lines/LineMaterial.js";
import { ROD_RINGS, ROD_SIDES, stage, WAY_POINTS } from "./core.js";
import { cornerSigns, quaternion } from "./scene.js";

const FLOOR = -2.7;
const vector = (...numbers) => new THREE.Vector3(...numbers);
const mesh = (shape, paint) => new THREE.Mesh(shape, paint);
const flat = (look) => new THREE.MeshBasicMaterial({ transparent: true, ...look });
const shiny = (look) => new THREE.MeshPhongMaterial({ transparent: true, ...look });
const upright = (shape) => shape.rotateX(Math.PI / 2); // what three.js makes along y
const UNITS = [vector(1, 0, 0), vector(0, 1, 0), vector(0, 0, 1)];
const ROD = new THREE.CylinderGeometry(1, 1, 1, 16);
const BALL = new THREE.SphereGeometry(1, 20, 14);
const put = (group, part, userData = {}) => (group.add(part), Object.assign(part, { userData }));

export function ground(world) {
  const sun = new THREE.DirectionalLight("#fff4e0", 2.2);
  sun.position.set(3, -5, 8);
  const grid = upright(new THREE.PolarGridHelper(14, 24, 14, 128));
  const look = { color: "#808894", transparent: true, opacity: 0.6 };
  grid.material = new THREE.LineBasicMaterial(look);
  grid.position.z = FLOOR;
  world.fog = new THREE.Fog("#000");
  world.background = world.fog.color;
  world.add(new THREE.HemisphereLight("#ffffff", "#8d93a5", 2), sun, grid);
  return grid;
}
// The fixed point stands on a needle.
export function needle() {
  const cone = upright(new THREE.CylinderGeometry(0.008, 0.05, -FLOOR, 16));
  return mesh(cone.translate(0, 0, FLOOR / 2), shiny({ color: "#848a98", opacity: 0.5 }));
}

// A cuboid has translucent faces, and edges and corners to take hold of.
export function box({ half }, { colour: color, role }) {
  const group = new THREE.Group();
  const glass = shiny({ color, side: 2, depthWrite: false });
  const opacity = role === "ghost" ? 0.55 : 1;
  const solid = shiny({ color, transparent: opacity < 1, opacity, shininess: 40 });
  const faces = new THREE.BoxGeometry(...half.map((h) => 2 * h));
  put(group, mesh(faces, glass), { part: "face" });
  for (let i = 0; i < 8; i++) {
    const ball = { part: "corner", corner: i, stretch: [2.6, 2.6, 2.6], length: 0 };
    const corner = put(group, mesh(BALL, solid), ball);
    corner.position.set(...cornerSigns(i).map((sign, k) => sign * half[k]));
    for (const k of [0, 1, 2].filter((k) => !((i >> k) & 1))) {
      const rod = { part: "face", stretch: [1, 0, 1], length: 2 * half[k] };
      const edge = put(group, mesh(ROD, solid), rod);
      edge.position.copy(corner.position).setComponent(k, 0);
      edge.quaternion.setFromUnitVectors(UNITS[1], UNITS[k]);
    }
  }
  const thickness = Math.cbrt(half[0] * half[1] * half[2]) * (role === "thick" ? 0.026 : 0.013);
  group.look = (opacity, times) => {
    glass.opacity = opacity;
    for (const { scale, userData } of group.children.slice(1)) {
      scale.set(...userData.stretch).multiplyScalar(times * thickness);
      scale.y += userData.length;
    }
  };
  return group;
}

// An arrow is drawn last and through everything, for it begins inside the body.
export function arrow(color, radius, opacity = 1) {
  const group = new THREE.Group();
  const paint = shiny({ color, depthTest: false, opacity });
  const rod = upright(new THREE.CylinderGeometry(radius, radius, 1, 16));
  const shaft = mesh(rod.translate(0, 0, 0.5), paint);
  const tip = mesh(upright(new THREE.ConeGeometry(radius * 3, radius * 8, 24)), paint);
  const target = mesh(BALL, new THREE.MeshBasicMaterial({ visible: false }));
  target.scale.setScalar(Math.max(radius * 5, 0.12));
  shaft.renderOrder = tip.renderOrder = 10;
  group.add(shaft, tip, target);
  group.tip = target; // larger than the tip, for fingers
  group.point = (...v) => {
    const [direction, length] = [vector(...v), Math.hypot(...v) || 1e-9];
    group.quaternion.setFromUnitVectors(UNITS[2], direction.divideScalar(length));
    shaft.scale.z = tip.position.z = target.position.z = length;
  };
  return group;
}

// The apex moves on a faint sphere with parallels, which are edges that bend by more than ten
// degrees.
const GLOBE = new THREE.SphereGeometry(1, 48, 32);
const PARALLELS = upright(new THREE.EdgesGeometry(new THREE.SphereGeometry(1, 96, 6), 10));
export function sphere(radius) {
  const color = "#8a93a6";
  const globe = mesh(GLOBE, flat({ color, opacity: 0.09, depthWrite: false }));
  globe.scale.setScalar(radius);
  const paint = new THREE.LineBasicMaterial({ color, transparent: true, opacity: 0.3 });
  return globe.add(new THREE.LineSegments(PARALLELS, paint));
}

// The way of the apex begins with the newest point, which is strongest in colour. Each point ends
// one piece and begins the next.
export function pathLine(colour, ground) {
  const geometry = new LineGeometry();
  geometry.boundingSphere = new THREE.Sphere(); // else it is asked of points that are not there yet
  const numbers = () => new Float32Array(3 * WAY_POINTS);
  const interleaved = () => new THREE.InstancedInterleavedBuffer(numbers(), 3, 1);
  const [places, shades] = [interleaved(), interleaved()];
  for (const [name, buffer] of Object.entries({ instance: places, instanceColor: shades })) {
    geometry.setAttribute(`${name}Start`, new THREE.InterleavedBufferAttribute(buffer, 3, 0));
    geometry.setAttribute(`${name}End`, new THREE.InterleavedBufferAttribute(buffer, 3, 3));
  }
  const [paint, mixed] = [new THREE.Color(colour), new THREE.Color()];
  for (let i = 0; i < WAY_POINTS; i++) {
    const strength = Math.max(0.2, 1 - (0.9 * i) / WAY_POINTS);
    mixed.lerpColors(ground, paint, strength).toArray(shades.array, 3 * i);
  }
  const line = new Line2(geometry, new LineMaterial({ vertexColors: true }));
  line.frustumCulled = false;
  line.follow = (i, radius, thickness) => {
    line.material.linewidth = 2.4 * thickness;
    geometry.instanceCount = stage.way(i, radius, places.array) - 1;
    places.needsUpdate = true;
  };
  return line;
}

// The elastic rod is made of rings of points about its centre line.
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
  rod.follow = (i, scale, radius) => {
    const n = stage.rod(i, scale, radius, places.array);
    geometry.setDrawRange(0, 6 * (n - ROD_SIDES));
    places.needsUpdate = true;
    geometry.computeVertexNormals();
  };
  return rod;
}

// Draws the principal axes N, B, T at the fixed point, and the centre of mass.
export function axisLines({ axes, com }, zoom, reach) {
  const frame = new THREE.Group();
  frame.quaternion.copy(quaternion(axes));
  ["#e07a2e", "#a94fd0", "#1797a6"].forEach((colour, k) => {
    const end = UNITS[k].clone().multiplyScalar(reach * zoom * 0.8);
    put(frame, arrow(colour, 0.014)).point(...end);
  });
  const dot = put(frame, mesh(BALL, flat({ color: "#ffb020", depthTest: false })));
  dot.scale.setScalar(0.07);
  dot.renderOrder = 11;
  dot.position.set(...com).multiplyScalar(zoom);
  return frame;
}
