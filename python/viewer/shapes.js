// What the picture is made of.
import * as THREE from "three";
import { Line2 } from "three/addons/lines/Line2.js";
import { LineGeometry } from "three/addons/lines/LineGeometry.js";
import { LineMaterial } from "three/addons/lines/LineMaterial.js";
import { stage } from "./core.js";
import { cornerSigns, quaternion } from "./scene.js";

const FLOOR = -2.7;
const vector = (...numbers) => new THREE.Vector3(...numbers);
const AXES = [vector(1, 0, 0), vector(0, 1, 0), vector(0, 0, 1)];
const ROD = new THREE.CylinderGeometry(1, 1, 1, 16);
const BALL = new THREE.SphereGeometry(1, 20, 14);
const put = (group, part, userData = {}) => (group.add(part), Object.assign(part, { userData }));

export function ground(world) {
  const sun = new THREE.DirectionalLight("#fff4e0", 2.2);
  sun.position.set(3, -5, 8);
  const grid = new THREE.PolarGridHelper(14, 24, 14, 128);
  grid.material = new THREE.LineBasicMaterial({ color: "#808894", transparent: true, opacity: 0.6 });
  grid.rotation.x = Math.PI / 2;
  grid.position.z = FLOOR;
  world.fog = new THREE.Fog("#000");
  world.background = world.fog.color;
  world.add(new THREE.HemisphereLight("#ffffff", "#8d93a5", 2), sun, grid);
  return grid;
}
// What the fixed point stands on.
export function needle() {
  const paint = new THREE.MeshPhongMaterial({ color: "#848a98", transparent: true, opacity: 0.5 });
  const cone = new THREE.CylinderGeometry(0.008, 0.05, -FLOOR, 16).rotateX(Math.PI / 2);
  return new THREE.Mesh(cone.translate(0, 0, FLOOR / 2), paint);
}

// A cuboid: translucent faces, edges and corners to take hold of.
export function box({ half }, { colour: color, role }) {
  const group = new THREE.Group();
  const glass = new THREE.MeshPhongMaterial({ color, transparent: true, side: 2, depthWrite: false });
  const opacity = role === "ghost" ? 0.55 : 1;
  const solid = new THREE.MeshPhongMaterial({ color, transparent: opacity < 1, opacity, shininess: 40 });
  put(group, new THREE.Mesh(new THREE.BoxGeometry(...half.map((h) => 2 * h)), glass), { kind: "face" });
  for (let i = 0; i < 8; i++) {
    const ball = { kind: "corner", corner: i, stretch: [2.6, 2.6, 2.6], length: 0 };
    const corner = put(group, new THREE.Mesh(BALL, solid), ball);
    corner.position.set(...cornerSigns(i).map((sign, k) => sign * half[k]));
    for (const k of [0, 1, 2].filter((k) => !((i >> k) & 1))) {
      const edge = put(group, new THREE.Mesh(ROD, solid), { kind: "face", stretch: [1, 0, 1], length: 2 * half[k] });
      edge.position.copy(corner.position).setComponent(k, 0);
      edge.quaternion.setFromUnitVectors(AXES[1], AXES[k]);
    }
  }
  group.look = (opacity, thickness) => {
    glass.opacity = opacity;
    const radius = thickness * Math.cbrt(half[0] * half[1] * half[2]) * (role === "thick" ? 0.026 : 0.013);
    for (const { scale, userData } of group.children.slice(1)) {
      scale.set(...userData.stretch).multiplyScalar(radius);
      scale.y += userData.length;
    }
  };
  return group;
}

// Drawn last and through everything: arrows begin inside the body.
export function arrow(colour, radius, opacity = 1) {
  const group = new THREE.Group();
  const paint = new THREE.MeshPhongMaterial({ color: colour, depthTest: false, transparent: true, opacity });
  const rod = new THREE.CylinderGeometry(radius, radius, 1, 16).rotateX(Math.PI / 2);
  const shaft = new THREE.Mesh(rod.translate(0, 0, 0.5), paint);
  const tip = new THREE.Mesh(new THREE.ConeGeometry(radius * 3, radius * 8, 24).rotateX(Math.PI / 2), paint);
  const target = new THREE.Mesh(BALL, new THREE.MeshBasicMaterial({ visible: false }));
  target.scale.setScalar(Math.max(radius * 5, 0.12));
  shaft.renderOrder = tip.renderOrder = 10;
  group.add(shaft, tip, target);
  group.tip = target; // larger than the tip, for fingers
  group.point = (...v) => {
    const [direction, length] = [vector(...v), Math.hypot(...v) || 1e-9];
    group.quaternion.setFromUnitVectors(AXES[2], direction.divideScalar(length));
    shaft.scale.z = tip.position.z = target.position.z = length;
  };
  return group;
}

// The faint sphere on which the apex moves, with its parallels: edges that bend by more than ten degrees.
const GLOBE = new THREE.SphereGeometry(1, 48, 32);
const PARALLELS = new THREE.EdgesGeometry(new THREE.SphereGeometry(1, 96, 6), 10).rotateX(Math.PI / 2);
export function sphere(radius) {
  const faint = { color: "#8a93a6", transparent: true };
  const globe = new THREE.Mesh(GLOBE, new THREE.MeshBasicMaterial({ ...faint, opacity: 0.09, depthWrite: false }));
  globe.scale.setScalar(radius);
  return globe.add(new THREE.LineSegments(PARALLELS, new THREE.LineBasicMaterial({ ...faint, opacity: 0.3 })));
}

// The way of the apex, newest point first and strongest in colour. Each point ends one piece and begins the next.
const POINTS = 2048;
export function pathLine(colour, ground) {
  const geometry = new LineGeometry();
  geometry.boundingSphere = new THREE.Sphere(); // else it is asked of points that are not there yet
  const interleaved = () => new THREE.InstancedInterleavedBuffer(new Float32Array(3 * POINTS), 3, 1);
  const [places, shades] = [interleaved(), interleaved()];
  for (const [name, buffer] of Object.entries({ instance: places, instanceColor: shades })) {
    geometry.setAttribute(`${name}Start`, new THREE.InterleavedBufferAttribute(buffer, 3, 0));
    geometry.setAttribute(`${name}End`, new THREE.InterleavedBufferAttribute(buffer, 3, 3));
  }
  const [paint, mixed] = [new THREE.Color(colour), new THREE.Color()];
  for (let i = 0; i < POINTS; i++)
    mixed.lerpColors(ground, paint, Math.max(0.2, 1 - (0.9 * i) / POINTS)).toArray(shades.array, 3 * i);
  const line = new Line2(geometry, new LineMaterial({ vertexColors: true }));
  line.frustumCulled = false;
  line.follow = (i, radius, thickness) => {
    line.material.linewidth = 2.4 * thickness;
    geometry.instanceCount = stage.way(i, radius, places.array) - 1;
    places.needsUpdate = true;
  };
  return line;
}

// The elastic rod: rings of points about its centre line.
const RINGS = 400;
const SIDES = 12;
const FACES = Array.from({ length: (RINGS - 1) * SIDES }, (_, a) => {
  const b = a % SIDES === SIDES - 1 ? a + 1 - SIDES : a + 1;
  return [a, b, a + SIDES, b, b + SIDES, a + SIDES];
}).flat();
export function rodMesh(colour) {
  const geometry = new THREE.BufferGeometry();
  const places = new THREE.BufferAttribute(new Float32Array(3 * RINGS * SIDES), 3);
  geometry.setAttribute("position", places);
  geometry.setIndex(FACES);
  const mesh = new THREE.Mesh(geometry, new THREE.MeshPhongMaterial({ color: colour, side: 2, shininess: 40 }));
  mesh.frustumCulled = false;
  mesh.follow = (i, scale, radius) => {
    const n = stage.rod(i, scale, radius, places.array);
    geometry.setDrawRange(0, 6 * (n - SIDES));
    places.needsUpdate = true;
    geometry.computeVertexNormals();
  };
  return mesh;
}

// Principal axes N, B, T at the fixed point, and the centre of mass.
export function axisLines(block, zoom, reach) {
  const frame = new THREE.Group();
  frame.quaternion.copy(quaternion(block.slice(7)));
  ["#e07a2e", "#a94fd0", "#1797a6"].forEach((colour, k) => {
    put(frame, arrow(colour, 0.014)).point(...AXES[k].clone().multiplyScalar(reach * zoom * 0.8));
  });
  const paint = new THREE.MeshBasicMaterial({ color: "#ffb020", depthTest: false, transparent: true });
  const dot = put(frame, new THREE.Mesh(BALL, paint));
  dot.scale.setScalar(0.07);
  dot.renderOrder = 11;
  dot.position.set(...block.slice(4, 7)).multiplyScalar(zoom);
  return frame;
}
