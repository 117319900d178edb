// The picture: three.js draws what the stage holds. It reads the scene and the core, and changes
// neither.
import * as THREE from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import { arrow, axisLines, box, ground, needle, pathLine, rodMesh, sphere } from "./shapes.js";
import { cuboidOf, stage } from "./core.js";
import { cornerSigns, quaternion } from "./scene.js";

const SIDES = [
  new THREE.Vector3(0, -1, 0),
  new THREE.Vector3(1, 0, 0),
  new THREE.Vector3(0, -1e-3, 1),
];
const rank = ({ object }) => ["tip", "corner", "face"].indexOf(object.userData.part);

export class View {
  constructor(parent) {
    this.renderer = new THREE.WebGLRenderer({ antialias: true, preserveDrawingBuffer: true });
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.canvas = this.renderer.domElement;
    parent.prepend(this.canvas);
    const label = "The top, its momentum in green and its angular velocity in blue";
    Object.assign(this.canvas, { tabIndex: 0, role: "img", ariaLabel: label });
    this.world = new THREE.Scene();
    this.floor = ground(this.world);
    const flat = new THREE.OrthographicCamera(-1, 1, 1, -1, -100, 200);
    this.cameras = [new THREE.PerspectiveCamera(30, 1, 0.1, 200), flat];
    for (const camera of this.cameras) camera.up.set(0, 0, 1);
    this.cameras[0].position.set(5.4, -9.6, 4.4);
    this.cameras[1].position.set(0, -12, 0);
    this.orbit = new OrbitControls(this.cameras[0], this.canvas);
    Object.assign(this.orbit, { minDistance: 3, minZoom: 0.2, maxZoom: 10 });
    this.orbit.addEventListener("change", () => (this.dirty = true));
    this.canvas.addEventListener("webglcontextrestored", () => (this.dirty = true));
    this.tops = [];
    const resize = ([{ contentRect }]) => this.size(contentRect.width, contentRect.height);
    new ResizeObserver(resize).observe(parent);
    this.size(parent.clientWidth, parent.clientHeight);
  }
  get camera() {
    return this.orbit.object;
  }

  size(w, h) {
    const [wide, flat] = this.cameras;
    wide.aspect = w / h;
    const across = 2 * THREE.MathUtils.RAD2DEG * Math.atan((Math.tan(Math.PI / 12) * h) / w);
    wide.fov = w > h ? 30 : Math.min(60, across);
    const [x, y] = w > h ? [(3 * w) / h, 3] : [3, (3 * h) / w];
    Object.assign(flat, { left: -x, right: x, top: y, bottom: -y });
    for (const camera of this.cameras) camera.updateProjectionMatrix();
    this.renderer.setSize(w, h);
    this.pixels = [w, h];
    this.dirty = true;
    this.render(); // at once: a canvas of another size is empty
    this.dirty = true;
  }

  // Makes the picture anew for a scene. With `fit` it chooses the scales of length and arrows too,
  // as for a scene just loaded.
  build(page, fit) {
    this.page = page;
    this.world.background.setStyle(getComputedStyle(document.body).backgroundColor);
    this.body = cuboidOf(page.scene.body);
    const { half, centre } = this.body;
    this.reach = Math.hypot(...half.map((h, i) => h + Math.abs(centre[i])));
    if (fit || !this.zoom) this.fit();
    // The way of the apex is drawn on a sphere of this radius.
    this.trail = this.zoom * Math.max(2 * Math.hypot(...centre), 0.85 * this.reach);
    for (const top of this.tops) {
      this.world.remove(top.group);
      top.group.traverse((part) => part.geometry?.dispose());
    }
    this.tops = page.tops.map((top, i) => this.makeTop(top, i));
    this.show(page.scene);
  }
  fit() {
    const { tops, scene } = this.page;
    const [momentum, velocity] = stage.reach(0);
    this.zoom = 2.4 / this.reach;
    [this.momentumZoom, this.velocityZoom] = [3.2 / momentum, 2.4 / velocity];
    this.orbit.target.set(0, 0, -0.1);
    const wide = this.pixels[0] > 1.1 * this.pixels[1] ? 1 : 1.6;
    const beside = tops.some((top) => top.side);
    const far = 12.6 + (beside ? scene.distance * wide : scene.show.rod ? 5 : 0);
    this.orbit.maxDistance = 2.5 * far;
    this.cameras[0].position.setLength(far);
    this.cameras[1].zoom = 12.6 / far;
    this.cameras[1].updateProjectionMatrix();
    Object.assign(this.world.fog, { near: far, far: 6 * far });
  }
  makeTop(top, i) {
    const [thick, ghost] = [top.role === "thick", top.role === "ghost"];
    const { scene } = this.page;
    const [group, body, cuboid] = [new THREE.Group(), new THREE.Group(), box(this.body, top)];
    cuboid.position.set(...this.body.centre).multiplyScalar(this.zoom);
    cuboid.quaternion.copy(quaternion(this.body.turn));
    cuboid.scale.setScalar(this.zoom);
    const line = pathLine(top.colour, this.world.background);
    const parts = { ...top, group, body, cuboid, line, handles: [] };
    this.world.add(group.add(body.add(cuboid), line));
    if (ghost) return parts;
    parts.m = arrow("#1f9d4d", thick ? 0.028 : 0.014);
    parts.w = arrow("#3566e0", thick ? 0.028 : 0.014);
    group.add(parts.m, parts.w);
    parts.m.tip.userData.part = "tip";
    parts.handles = top.track ? [] : [parts.m.tip, ...cuboid.children];
    for (const { userData } of parts.handles) userData.i = i;
    if (!thick) return parts;
    parts.globe = sphere(this.trail);
    parts.rod = rodMesh(top.colour);
    parts.axes = axisLines(this.page.body, this.zoom, this.reach);
    parts.p = arrow("#8a93a6", 0.02, 0.6);
    // It stays in sight, however strong gravity is.
    parts.p.point(0, 0, (2.4 * scene.gravity) / (4 + Math.abs(scene.gravity)));
    parts.p.visible = scene.gravity !== 0;
    body.add(parts.axes);
    group.add(parts.globe, parts.rod, parts.p, needle());
    return parts;
  }
  // Shows what of a scene is looks alone. The first method stands left, what is beside it right.
  show({ show, distance }) {
    const beside = this.tops.some((top) => top.side);
    for (const top of this.tops) {
      top.group.position.x = beside ? (top.side - 0.5) * distance : 0;
      top.cuboid.look(show.opacity, show.thickness);
      const apart = distance > 0 || !top.side; // else the faces of two would mix
      top.cuboid.children[0].visible = top.role === "thick" && apart;
    }
    this.floor.visible = show.floor;
    this.orbit.object = this.cameras[+show.flat];
    this.orbit.update();
    this.camera.updateMatrixWorld();
    this.draw();
  }

  draw() {
    const { show } = this.page.scene;
    this.tops.forEach((top, i) => {
      const [, w, x, y, z, ...m] = stage.state(i);
      top.body.quaternion.set(x, y, z, w);
      top.m?.point(...m.map((each) => each * this.momentumZoom));
      top.w?.point(...stage.velocity(i).map((each) => each * this.velocityZoom));
      top.line.visible = show.trace && top.role !== "ghost";
      if (top.line.visible) top.line.follow(i, this.trail, show.thickness);
      if (top.role !== "thick") return;
      top.globe.visible = show.trace;
      top.axes.visible = show.axes || !!this.moving;
      top.rod.visible = show.rod;
      if (show.rod) top.rod.follow(i, 0.5 * this.zoom, 0.08 * show.thickness);
    });
    this.dirty = true;
  }
  render() {
    if (!this.dirty && !this.recording) return;
    this.dirty = false;
    this.renderer.render(this.world, this.camera);
  }

  // Looks from the front, the right, above, and again. All is in sight, whatever became of it.
  turn() {
    this.side = ((this.side ?? -1) + 1) % SIDES.length;
    this.build(this.page, true);
    const far = this.camera.position.length();
    this.camera.position.copy(SIDES[this.side]).setLength(far).add(this.orbit.target);
    this.orbit.update();
  }

  // Finds what is under a point of the window: a tip before a corner before a face or edge.
  pick(x, y) {
    const handles = this.tops.flatMap((top) => top.handles);
    const hits = this.ray(x, y).intersectObjects(handles, false);
    hits.sort((a, b) => rank(a) - rank(b) || a.distance - b.distance);
    return hits[0] && { ...hits[0].object.userData, point: hits[0].point };
  }
  ray(x, y) {
    const ray = new THREE.Raycaster();
    const [w, h] = this.pixels;
    ray.setFromCamera(new THREE.Vector2((2 * x) / w - 1, 1 - (2 * y) / h), this.camera);
    return ray;
  }
  // Returns where a point of the world is in the window, in pixels.
  project(point) {
    this.camera.updateMatrixWorld();
    const p = point.clone().project(this.camera);
    return [((p.x + 1) / 2) * this.pixels[0], ((1 - p.y) / 2) * this.pixels[1]];
  }
  // Returns where a handle is: the tip of m, a corner (0 .. 7), the middle of a face or an edge in
  // front.
  handle(part, i, number = 0) {
    this.world.updateMatrixWorld(true);
    const top = this.tops[i];
    if (part === "tip") return top.m.tip.getWorldPosition(new THREE.Vector3());
    const signs = { face: [0, -1, 0], edge: [1, -1, 0], corner: cornerSigns(number) }[part];
    const place = signs.map((sign, k) => sign * this.body.half[k]);
    return top.cuboid.localToWorld(new THREE.Vector3(...place));
  }
}
