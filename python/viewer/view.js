// The picture: three.js draws what the stage holds. Reads the scene and the core, changes neither.
import * as THREE from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import { applyTheme, arrow, axisLines, box, ground, needle, pathLine, rodMesh, sphere } from "./shapes.js";
import { stage, TICKS, velocity } from "./core.js";
import { cornerSigns, picture, quaternion } from "./scene.js";

const SIDES = [new THREE.Vector3(0, -1, 0), new THREE.Vector3(1, 0, 0), new THREE.Vector3(0, -1e-3, 1)];
const dark = matchMedia("(prefers-color-scheme: dark)");

export class View {
  constructor(parent) {
    this.renderer = new THREE.WebGLRenderer({ antialias: true, preserveDrawingBuffer: true });
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.canvas = parent.appendChild(this.renderer.domElement);
    this.canvas.tabIndex = 0;
    this.canvas.setAttribute("role", "img");
    this.canvas.setAttribute("aria-label", "The top, its momentum in green and its angular velocity in blue");
    this.world = new THREE.Scene();
    this.floor = ground(this.world);
    const flat = new THREE.OrthographicCamera(-1, 1, 1, -1, -100, 200);
    this.cameras = [new THREE.PerspectiveCamera(30, 1, 0.1, 200), flat];
    for (const camera of this.cameras) camera.up.set(0, 0, 1);
    this.cameras[0].position.set(5.4, -9.6, 4.4);
    this.cameras[1].position.set(0, -12, 0);
    this.orbits = this.cameras.map((camera) => {
      const orbit = new OrbitControls(camera, this.canvas);
      orbit.target.set(0, 0, -0.1);
      orbit.minDistance = 2;
      orbit.maxDistance = 60;
      orbit.addEventListener("change", () => (this.dirty = true));
      orbit.update();
      return orbit;
    });
    this.tops = [];
    this.flat = false;
    dark.addEventListener("change", () => this.theme());
    this.theme();
  }
  theme() {
    applyTheme(this.world, this.floor, dark.matches);
    this.dirty = true;
  }
  get camera() {
    return this.cameras[+this.flat];
  }
  get orbit() {
    return this.orbits[+this.flat];
  }
  enable(on) {
    this.held = !on;
    this.orbits.forEach((orbit, i) => (orbit.enabled = on && i === +this.flat));
  }

  // The free part of the window is beside the panel, on a phone above it.
  size(width, height, right, bottom) {
    this.renderer.setSize(width, height);
    const [w, h] = [width - right, height - bottom];
    const [wide, flat] = this.cameras;
    // The picture is w by h; the window sees more of it to the right and below.
    wide.aspect = w / h;
    wide.fov = w > h ? 30 : Math.min(60, 2 * THREE.MathUtils.RAD2DEG * Math.atan((Math.tan(Math.PI / 12) * h) / w));
    const [x, y] = w > h ? [(3 * w) / h, 3] : [3, (3 * h) / w];
    [flat.left, flat.right, flat.top, flat.bottom] = [-x, x, y, -y];
    for (const camera of this.cameras) {
      camera.setViewOffset(w, h, 0, 0, width, height);
      camera.updateProjectionMatrix();
    }
    this.pixels = [width, height];
    this.dirty = true;
  }

  // Anew for a scene. `fit`: choose the scales of length and arrows too, as for a scene just loaded.
  build(scene, tops, block, fit) {
    this.scene = scene;
    this.block = block;
    this.body = picture(scene.body);
    const { half, centre } = this.body;
    this.reach = Math.hypot(...half.map((h, i) => h + Math.abs(centre[i])));
    if (fit || !this.zoom) this.fit(scene, block);
    for (const top of this.tops) {
      this.world.remove(top.group);
      top.group.traverse((part) => part.geometry?.dispose());
    }
    this.tops = tops.map((top, i) => this.makeTop(top, i));
    this.show(scene);
  }
  fit(scene, block) {
    this.zoom = 2.4 / this.reach;
    // Arrows at the length of the body at most: |m|^2 / 2 I <= kinetic energy now + what the fall can give.
    const [mass, ...moments] = block.slice(0, 4);
    const omega = velocity(block, scene.gravity, scene.attitude, scene.momentum);
    const doubled = omega.reduce((sum, w, k) => sum + w * scene.momentum[k], 0);
    const energy = doubled + 4 * mass * Math.abs(scene.gravity) * Math.hypot(...block.slice(4, 7));
    this.momentumZoom = 3.2 / Math.max(Math.hypot(...scene.momentum), Math.sqrt(energy * Math.max(...moments)));
    this.velocityZoom = 2.4 / Math.max(Math.hypot(...omega), Math.sqrt(energy / Math.max(...moments)));
    const far = 12.6 + (scene.methods.length > 1 || scene.tracks.length ? scene.distance : scene.show.rod ? 3 : 0);
    this.cameras[0].position.setLength(far);
    this.cameras[1].zoom = 12.6 / far;
    [this.world.fog.near, this.world.fog.far] = [far, 2.1 * far];
    this.cameras[1].updateProjectionMatrix();
    this.orbits.forEach((orbit) => orbit.update());
    this.cameras.forEach((camera) => camera.updateMatrixWorld());
  }
  makeTop(top, i) {
    const thin = top.role !== "thick";
    const group = this.world.add(new THREE.Group()).children.at(-1);
    const body = box(this.body, top.colour, thin, top.role === "ghost");
    body.scale.setScalar(this.zoom);
    const parts = { group, body, line: pathLine(top.colour), ...top };
    group.add(body, parts.line);
    if (top.role !== "ghost") {
      parts.m = arrow("#1f9d4d", thin ? 0.014 : 0.028);
      parts.w = arrow("#3566e0", thin ? 0.014 : 0.028);
      group.add(parts.m, parts.w);
      parts.m.tip.userData = { kind: "tip", i };
      body.traverse((part) => part.userData.kind && (part.userData.i = i));
    }
    if (top.role === "thick") {
      parts.globe = sphere(this.trail() * this.zoom);
      parts.rod = rodMesh(top.colour);
      parts.axes = axisLines(this.block, this.zoom, this.reach);
      body.add(parts.axes);
      parts.axes.scale.setScalar(1 / this.zoom);
      parts.p = arrow("#8a93a6", 0.02, 0.6);
      group.add(parts.globe, parts.rod, parts.p, needle());
      const { gravity } = this.scene;
      parts.p.point(new THREE.Vector3(0, 0, (2.4 * gravity) / (4 + Math.abs(gravity)))); // in sight, however strong
      parts.p.visible = gravity !== 0;
    }
    return parts;
  }
  // What of a scene is looks alone. The first method stands left, what is beside it right.
  show(scene) {
    const beside = this.tops.some((top) => top.side);
    for (const top of this.tops) {
      top.group.position.x = beside ? (top.side - 0.5) * scene.distance : 0;
      top.body.look(scene.show.opacity, scene.show.thickness);
    }
    this.floor.visible = scene.show.floor;
    this.flat = scene.show.flat;
    this.enable(!this.held);
    this.draw();
  }
  // From the fixed point through the centre of mass: the apex; how far from there.
  apex() {
    const c = this.block.slice(4, 7);
    const length = Math.hypot(...c);
    const axis = length ? new THREE.Vector3(...c).divideScalar(length) : new THREE.Vector3(0, 0, 1);
    return axis.applyQuaternion(quaternion(this.block.slice(7)));
  }
  trail() {
    const { centre } = this.body;
    return Math.max(2 * Math.hypot(...centre), 0.85 * this.reach);
  }

  draw() {
    const { show } = this.scene;
    this.tops.forEach((top, i) => {
      const [, w, x, y, z, ...m] = stage.state(i);
      top.body.quaternion.set(x, y, z, w);
      const steps = stage.steps(i);
      if (top.role !== "ghost") {
        top.m.point(new THREE.Vector3(...m).multiplyScalar(this.momentumZoom));
        const omega = velocity(this.block, this.scene.gravity, [w, x, y, z], m);
        top.w.point(new THREE.Vector3(...omega).multiplyScalar(this.velocityZoom));
      }
      top.line.visible = show.trace && top.role !== "ghost";
      const trace = stage.trace(i);
      const apex = this.apex();
      if (top.line.visible) top.line.follow(trace, steps, apex, this.trail() * this.zoom, show.thickness, dark.matches);
      if (top.role !== "thick") return;
      top.globe.visible = show.trace;
      top.axes.visible = show.axes || !!this.moving;
      top.rod.visible = show.rod;
      if (show.rod) top.rod.follow(trace, steps, top.eps / TICKS, apex, this.block, this.zoom, show.thickness);
    });
    this.dirty = true;
  }
  render() {
    if (!this.dirty) return;
    this.dirty = false;
    this.renderer.render(this.world, this.camera);
  }

  // From the front, the right, above; and again.
  turn() {
    this.side = ((this.side ?? -1) + 1) % SIDES.length;
    const { target } = this.orbit;
    const far = this.camera.position.distanceTo(target);
    this.camera.position.copy(SIDES[this.side]).setLength(far).add(target);
    this.orbit.update();
  }

  // What is under a point of the window: a tip before a corner before a face or edge.
  pick(x, y) {
    const ray = this.ray(x, y);
    const rank = { tip: 0, corner: 1, face: 2 };
    return ray
      .intersectObjects(
        this.tops.map((top) => top.group),
        true,
      )
      .filter((hit) => hit.object.userData.kind && this.tops[hit.object.userData.i])
      .map((hit) => ({ ...hit.object.userData, corner: hit.instanceId, point: hit.point, distance: hit.distance }))
      .sort((a, b) => rank[a.kind] - rank[b.kind] || a.distance - b.distance)[0];
  }
  ray(x, y) {
    const ray = new THREE.Raycaster();
    const [w, h] = this.pixels;
    ray.setFromCamera(new THREE.Vector2((2 * x) / w - 1, 1 - (2 * y) / h), this.camera);
    return ray;
  }
  // Where a point of the world is in the window, in pixels.
  project(point) {
    const p = point.clone().project(this.camera);
    return [((p.x + 1) / 2) * this.pixels[0], ((1 - p.y) / 2) * this.pixels[1]];
  }
  // Where a handle is: the tip of m, a corner (0 .. 7), the middle of a face or an edge in front.
  handle(kind, i, number = 0) {
    this.world.updateMatrixWorld(true);
    const top = this.tops[i];
    if (kind === "tip") return top.m.tip.getWorldPosition(new THREE.Vector3());
    const { half } = this.body;
    const at = (...signs) => top.body.children[0].localToWorld(new THREE.Vector3(...half.map((h, k) => h * signs[k])));
    if (kind === "face") return at(0, -1, 0);
    if (kind === "edge") return at(1, -1, 0);
    return at(...cornerSigns(number));
  }
}
