// What the picture is made of.
import * as THREE from "three";
import { Line2 } from "three/addons/lines/Line2.js";
import { LineGeometry } from "three/addons/lines/LineGeometry.js";
import { LineMaterial } from "three/addons/lines/LineMaterial.js";
import { cornerSigns, quaternion } from "./scene.js";

const FLOOR = -2.7;
const vector = (...numbers) => new THREE.Vector3(...numbers);
const AXES = [vector(1, 0, 0), vector(0, 1, 0), vector(0, 0, 1)];

export function ground(world) {
  const sky = new THREE.HemisphereLight("#ffffff", "#8d93a5", 2);
  const sun = new THREE.DirectionalLight("#fff4e0", 2.2);
  sun.position.set(3, -5, 8);
  const grid = new THREE.PolarGridHelper(14, 24, 14, 128);
  grid.rotation.x = Math.PI / 2;
  grid.position.z = FLOOR;
  grid.material = new THREE.LineBasicMaterial({ transparent: true });
  world.fog = new THREE.Fog("#000");
  world.background = new THREE.Color();
  world.add(sky, sun, grid);
  return grid;
}
// What the fixed point stands on.
export function needle() {
  const paint = new THREE.MeshPhongMaterial({ color: "#848a98", transparent: true, opacity: 0.5 });
  const cone = new THREE.CylinderGeometry(0.008, 0.05, -FLOOR, 16).rotateX(Math.PI / 2);
  return new THREE.Mesh(cone.translate(0, 0, FLOOR / 2), paint);
}
export function applyTheme(world, grid, dark) {
  world.background.set(dark ? "#11141b" : "#f4f3ef");
  world.fog.color.copy(world.background);
  grid.material.color.set(dark ? "#5a6578" : "#a9aba8");
  grid.material.opacity = dark ? 0.55 : 0.7;
}

// A cuboid: translucent faces, edges and corners to take hold of. Thin ones have edges only: two bodies at one place
// would mix their colours.
export function box({ half, centre, turn }, colour, thin, ghost) {
  const group = new THREE.Group();
  const body = group.add(new THREE.Group()).children[0];
  body.position.set(...centre);
  body.quaternion.copy(quaternion(turn));
  const paint = { color: colour, transparent: ghost, opacity: ghost ? 0.55 : 1, shininess: 40 };
  const faces = new THREE.Mesh(
    new THREE.BoxGeometry(...half.map((h) => 2 * h)),
    new THREE.MeshPhongMaterial({ ...paint, transparent: true, side: 2, depthWrite: false }),
  );
  faces.visible = !thin;
  const solid = new THREE.MeshPhongMaterial(paint);
  const edges = new THREE.InstancedMesh(new THREE.CylinderGeometry(1, 1, 1, 10), solid, 12);
  const corners = new THREE.InstancedMesh(new THREE.SphereGeometry(2.6, 20, 14), solid, 8);
  if (!ghost) {
    corners.userData.kind = "corner";
    edges.userData.kind = faces.userData.kind = "face";
  }
  body.add(faces, edges, corners);
  group.look = (opacity, thickness) => {
    faces.material.opacity = opacity;
    const radius = thickness * Math.max(...half) * (thin ? 0.012 : 0.024);
    for (let i = 0; i < 12; i++) {
      const k = i >> 2;
      const side = (j) => (j === k ? 0 : (i >> +(j !== (k + 1) % 3)) & 1 ? 1 : -1);
      const at = vector(...half.map((h, j) => h * side(j)));
      const along = new THREE.Quaternion().setFromUnitVectors(AXES[1], AXES[k]);
      edges.setMatrixAt(i, new THREE.Matrix4().compose(at, along, vector(radius, 2 * half[k], radius)));
    }
    for (let i = 0; i < 8; i++) {
      const at = vector(...cornerSigns(i).map((sign, k) => sign * half[k]));
      corners.setMatrixAt(i, new THREE.Matrix4().makeScale(radius, radius, radius).setPosition(at));
    }
    for (const mesh of [edges, corners]) [mesh.instanceMatrix.needsUpdate, mesh.boundingSphere] = [true, null];
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
  const unseen = new THREE.MeshBasicMaterial({ visible: false });
  const target = new THREE.Mesh(new THREE.SphereGeometry(Math.max(radius * 5, 0.12)), unseen);
  shaft.renderOrder = tip.renderOrder = 10;
  group.add(shaft, tip, target);
  group.tip = target; // larger than the tip, for fingers
  group.point = (v) => {
    const length = v.length() || 1e-9;
    group.quaternion.setFromUnitVectors(vector(0, 0, 1), v.divideScalar(length));
    shaft.scale.z = length;
    tip.position.z = target.position.z = length;
  };
  return group;
}

// The faint sphere on which the apex moves.
export function sphere(radius) {
  const faint = { color: "#8a93a6", transparent: true };
  const paint = new THREE.MeshBasicMaterial({ ...faint, opacity: 0.09, depthWrite: false });
  const globe = new THREE.Mesh(new THREE.SphereGeometry(radius, 48, 32), paint);
  const circle = new THREE.BufferGeometry().setFromPoints(
    Array.from({ length: 129 }, (_, i) => vector(Math.cos((i * Math.PI) / 64), Math.sin((i * Math.PI) / 64), 0)),
  );
  const line = new THREE.LineBasicMaterial({ ...faint, opacity: 0.3 });
  for (let i = -2; i <= 2; i++) {
    const ring = new THREE.Line(circle, line);
    ring.scale.setScalar(radius * Math.cos((i * Math.PI) / 6));
    ring.position.z = radius * Math.sin((i * Math.PI) / 6);
    globe.add(ring);
  }
  return globe;
}

// The last steps of a ring buffer of attitudes, oldest first.
function* last(trace, steps, most, stride = 1) {
  const size = trace.length / 4;
  const n = Math.min(Math.floor(Math.min(steps, size - 1) / stride), most - 1);
  const q = new THREE.Quaternion();
  for (let j = n; j >= 0; j--) {
    const k = 4 * ((steps - j * stride) % size);
    yield [n - j, n, q.set(trace[k + 1], trace[k + 2], trace[k + 3], trace[k])];
  }
}

const POINTS = 2048;
export function pathLine(colour) {
  const geometry = new LineGeometry();
  geometry.setPositions(new Float32Array(3 * POINTS));
  geometry.setColors(new Float32Array(3 * POINTS));
  const line = new Line2(geometry, new LineMaterial({ vertexColors: true }));
  line.frustumCulled = false;
  const place = geometry.attributes.instanceStart.data;
  const shade = geometry.attributes.instanceColorStart.data;
  const [paint, back, mixed, p] = [new THREE.Color(colour), new THREE.Color(), new THREE.Color(), vector()];
  line.follow = (trace, steps, apex, radius, thickness, dark) => {
    line.material.linewidth = 2.4 * thickness;
    back.set(dark ? "#2a303c" : "#dddcd8");
    for (const [i, n, q] of last(trace, steps, POINTS, steps < POINTS ? 1 : 2)) {
      const age = (n - i) / POINTS; // the newer lies above the older
      p.copy(apex)
        .applyQuaternion(q)
        .multiplyScalar(radius * (1 - 0.02 * age))
        .toArray(place.array, 6 * i);
      mixed.lerpColors(back, paint, Math.max(0.15, 1 - 0.9 * age)).toArray(shade.array, 6 * i);
      if (i) {
        place.array.copyWithin(6 * i - 3, 6 * i, 6 * i + 3);
        shade.array.copyWithin(6 * i - 3, 6 * i, 6 * i + 3);
      }
      geometry.instanceCount = n;
    }
    place.needsUpdate = shade.needsUpdate = true;
  };
  return line;
}

// The elastic rod: each step shifts the origins before it by -eps T (thesis 5.7). Its cross-section is that of the
// bending stiffnesses: thick across the axis about which the body is hard to turn.
const RINGS = 400;
const SIDES = 10;
export function rodMesh(colour) {
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(3 * RINGS * SIDES), 3));
  const faces = [];
  for (let r = 0; r + 1 < RINGS; r++)
    for (let s = 0; s < SIDES; s++) {
      const [a, b] = [r * SIDES + s, r * SIDES + ((s + 1) % SIDES)];
      faces.push(a, b, a + SIDES, b, b + SIDES, a + SIDES);
    }
  geometry.setIndex(faces);
  const mesh = new THREE.Mesh(geometry, new THREE.MeshPhongMaterial({ color: colour, side: 2, shininess: 40 }));
  mesh.frustumCulled = false;
  mesh.follow = (trace, steps, eps, apex, block, zoom, thickness) => {
    const stride = Math.max(1, Math.round(0.05 / eps));
    const [u, v, ru, rv] = crossSection(apex, block);
    const radius = 0.08 * thickness;
    const places = geometry.attributes.position;
    const [at, p, side] = [vector(), vector(), vector()];
    const kept = Array.from(last(trace, steps, RINGS, stride), ([, , q]) => q.clone());
    for (let ring = kept.length - 1; ring >= 0; ring--) {
      const q = kept[ring];
      for (let s = 0; s < SIDES; s++) {
        const angle = (2 * Math.PI * s) / SIDES;
        side.copy(u).multiplyScalar(radius * ru * Math.cos(angle));
        side.addScaledVector(v, radius * rv * Math.sin(angle));
        p.copy(side).applyQuaternion(q).add(at);
        places.setXYZ(ring * SIDES + s, p.x, p.y, p.z);
      }
      at.addScaledVector(p.copy(apex).applyQuaternion(q), -eps * stride * zoom * 0.5);
    }
    geometry.setDrawRange(0, 6 * SIDES * Math.max(0, kept.length - 1));
    places.needsUpdate = true;
    geometry.computeVertexNormals();
  };
  return mesh;
}
// Two directions of the body across the apex, and how thick the rod is along each: 1, or the ratio of the moments.
function crossSection(apex, block) {
  const moments = block.slice(1, 4);
  const turn = quaternion(block.slice(7));
  const axes = AXES.map((e) => e.clone().applyQuaternion(turn));
  const along = axes.map((axis) => Math.abs(axis.dot(apex)));
  const k = along.indexOf(Math.max(...along));
  const [i, j] = [(k + 1) % 3, (k + 2) % 3];
  const most = Math.max(moments[i], moments[j]);
  return [axes[i], axes[j], moments[j] / most, moments[i] / most];
}

// Principal axes N, B, T at the fixed point, and the centre of mass.
export function axisLines(block, zoom, reach) {
  const group = new THREE.Group();
  const frame = group.add(new THREE.Group()).children[0];
  frame.quaternion.copy(quaternion(block.slice(7)));
  ["#e07a2e", "#a94fd0", "#1797a6"].forEach((colour, k) => {
    const line = arrow(colour, 0.014);
    line.point(AXES[k].clone().multiplyScalar(reach * zoom * 0.8));
    frame.add(line);
  });
  const paint = new THREE.MeshBasicMaterial({ color: "#ffb020", depthTest: false, transparent: true });
  const dot = new THREE.Mesh(new THREE.SphereGeometry(0.07, 20, 14), paint);
  dot.renderOrder = 11;
  dot.position.set(...block.slice(4, 7)).multiplyScalar(zoom);
  frame.add(dot);
  return group;
}
