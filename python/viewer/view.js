// The picture: three.js draws what the stage holds. It reads the scene and the core, and changes
// neither.
import * as THREE from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import { cuboidOf, stage, WAY_POINTS } from "./core.js";
import { Floor, light } from "./floor.js";
import { globe } from "./globe.js";
import { Letters } from "./letters.js";
import { setWindow } from "./lines.js";
import { cornerSigns, quaternion, SECTIONS } from "./scene.js";
import {
  arrow,
  axisLines,
  box,
  dropLines,
  faintLine,
  pathLine,
  rodMesh,
  stand,
  turnedTop,
} from "./shapes.js";
import { turnedOf } from "./turned.js";

const SIDES = [
  new THREE.Vector3(0, -1, 0),
  new THREE.Vector3(1, 0, 0),
  new THREE.Vector3(0, -1e-3, 1),
];
const HOME = new THREE.Vector3(5.4, -9.6, 4.4);
const FRONT = new THREE.Vector3(0, -11, 4.4); // from there tops side by side are equally far
const ROD = "#2f7f86"; // what else is drawn of a first top is red
const FLOOR = -2.7; // the lowest that it lies
const LARGE_FOOTER = 0.12; // of the picture's height
const isShown = (part) => part.visible && part.parent.visible;
const rank = ({ object }) => ["tip", "corner", "face"].indexOf(object.userData.part);

export class View {
  wake = () => {}; // asks for a frame
  constructor(parent) {
    this.renderer = new THREE.WebGLRenderer({ antialias: true, preserveDrawingBuffer: true });
    this.renderer.debug.checkShaderErrors = false; // that would wait for the graphics
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.canvas = this.renderer.domElement;
    parent.prepend(this.canvas);
    const label = "The top, its angular momentum in green and its angular velocity in blue. "
      + "Arrow keys turn the view.";
    Object.assign(this.canvas, { tabIndex: 0, role: "application", ariaLabel: label });
    this.world = new THREE.Scene();
    this.world.fog = new THREE.Fog("#000");
    this.world.background = this.world.fog.color;
    light(this.world);
    this.floor = new Floor(this.world);
    this.letters = new Letters(parent);
    const flat = new THREE.OrthographicCamera(-1, 1, 1, -1, -100, 200);
    this.cameras = [new THREE.PerspectiveCamera(30, 1, 0.1, 200), flat];
    for (const camera of this.cameras) camera.up.set(0, 0, 1);
    this.orbit = new OrbitControls(this.cameras[0], this.canvas);
    Object.assign(this.orbit, { minDistance: 3, minZoom: 0.2, maxZoom: 10 });
    this.orbit.addEventListener("change", () => (this.dirty = true));
    this.orbit.addEventListener("start", () => (this.isHome = false));
    this.canvas.addEventListener("webglcontextrestored", () => (this.dirty = true));
    this.tops = [];
    this.footer = this.covered = 0;
    this.paint();
    const resize = ([{ contentRect }]) => this.size(contentRect.width, contentRect.height);
    new ResizeObserver(resize).observe(parent);
    this.size(parent.clientWidth, parent.clientHeight);
  }
  get camera() {
    return this.orbit.object;
  }
  // What is to be drawn anew wakes the page.
  get dirty() {
    return this.needsRender;
  }
  set dirty(on) {
    this.needsRender = on;
    if (on) this.wake();
  }

  // Takes the colour of the page, on which all is drawn.
  paint() {
    this.world.background.setStyle(getComputedStyle(document.body).backgroundColor);
  }
  size(w, h) {
    if (w === this.pixels?.[0] && h === this.pixels[1]) return;
    const [wide, flat] = this.cameras;
    wide.aspect = w / h;
    const across = 2 * THREE.MathUtils.RAD2DEG * Math.atan((Math.tan(Math.PI / 12) * h) / w);
    wide.fov = w > h ? 30 : Math.min(60, across);
    const [x, y] = w > h ? [(3 * w) / h, 3] : [3, (3 * h) / w];
    Object.assign(flat, { left: -x, right: x, top: y, bottom: -y });
    for (const camera of this.cameras) camera.updateProjectionMatrix();
    this.renderer.setSize(w, h);
    this.pixels = [w, h];
    setWindow(w, h);
    this.moveAboveFooter();
    if (this.page) this.render(); // at once: a canvas of another size is empty
  }
  // Takes the height in pixels of the footer, which covers the lower part of the picture.
  setFooter(height) {
    this.footer = height;
    this.moveAboveFooter();
  }
  // Moves the picture up between the numbers and a large footer.
  moveAboveFooter() {
    const [w, h] = this.pixels;
    this.covered = this.footer > LARGE_FOOTER * h ? this.footer : 0;
    for (const camera of this.cameras) camera.setViewOffset(w, h, 0, this.covered / 4, w, h);
    if (this.isHome) this.home();
    this.dirty = true;
  }

  // Makes the picture anew for a scene. With `fit` it chooses the scales of length and arrows too,
  // as for a scene just loaded.
  build(page, fit) {
    this.page = page;
    this.body = cuboidOf(page.scene.body);
    this.turned = turnedOf(this.body);
    const asTop = !!this.turned && page.scene.show.solid === "top";
    this.asTop = asTop;
    const { half, centre } = this.body;
    this.reach = Math.hypot(...half.map((h, i) => h + Math.abs(centre[i])));
    const sides = Math.max(...page.tops.map((top) => top.side)) + 1;
    const more = sides > (this.sides ?? 1); // than fit into the picture
    this.sides = sides;
    if (fit || more || !this.zoom) this.fit();
    // The way of the apex is drawn on a sphere of this radius.
    const [lever, least] = [Math.hypot(...centre), 0.85 * this.reach];
    this.trail = this.zoom * Math.max((asTop ? 1.7 : 2) * lever, asTop ? 1.1 * least : least);
    const height = this.held ? this.floor.height : this.ground(); // it stays while a hand moves
    const made = this.makings(height);
    if (made !== this.made) this.makeTops(height);
    this.made = made;
    this.tops.forEach((top, i) => this.settle(top, page.tops[i]));
    const letters = this.tops.flatMap((top) => this.lettersOf(top));
    this.letters.set(letters, page.big ? 1.6 : 1);
    const isLower = this.isHome && height < this.lookedAt; // than when it looked from home
    if (this.fresh || isLower) this.home();
    this.fresh = false;
    this.show(page.scene);
  }
  // Tells all that tops are made of, in one word: while it stays, so do they, and all else that
  // becomes of them is told to them by `settle`, `show` and `draw`.
  makings(height) {
    const words = ({ colour, role, side, track }) => [colour, role, side, !!track];
    const tops = this.page.tops.map(words);
    const turned = this.asTop && [this.turned, this.trail / this.zoom];
    const paper = this.world.background.getHex();
    return JSON.stringify([tops, turned, paper, this.comesOut, height]);
  }
  // Chooses the scales and looks from home.
  fit() {
    const [momentum, velocity] = stage.reach(0);
    this.zoom = 2.4 / this.reach;
    // Out of turned tops that spin it looks by its own length, if it does so out of all of them; or
    // it would not be seen.
    const now = Math.hypot(...this.page.leader().slice(5));
    const least = Math.min(...this.page.tops.map((_, i) => Math.hypot(...stage.state(i).slice(5))));
    this.comesOut = this.asTop && now > momentum / 4 && least > 0.8 * now;
    const long = this.comesOut ? now : momentum;
    this.momentumZoom = (this.asTop ? 3 : 3.2) / long;
    this.velocityZoom = (this.asTop ? 3.35 : 2.4) / velocity;
    this.fresh = true;
  }
  // Looks at all there is from the usual side: from the floor to the globe's top. It stays so in
  // windows of other sizes, until somebody looks elsewhere.
  home() {
    const { scene } = this.page;
    const [low, high] = [this.floor.height, Math.max(this.trail, 2.4)];
    const wide = this.pixels[0] > 1.1 * this.pixels[1] ? 1 : 1.6;
    const far = Math.max(10.5, 2.05 * (high - low) + 2.1);
    const more = (this.sides - 1) * scene.distance * wide || (scene.show.rod ? 5 : 0);
    const { fov, aspect } = this.cameras[0];
    const breadth = ((this.sides - 1) * scene.distance) / 2 + 2.6; // from the middle
    const away = breadth / (aspect * Math.tan((fov * Math.PI) / 360));
    const free = 1 - this.covered / this.pixels[1] / 2; // numbers above need room, too
    const distance = Math.max((far + more) / free, away);
    this.orbit.target.set(0, 0, (low + high) / 2 - (this.asTop ? 0 : 0.1));
    this.orbit.maxDistance = 2.5 * distance;
    const from = this.sides > 1 ? FRONT : HOME;
    this.cameras[0].position.copy(from).setLength(distance).add(this.orbit.target);
    this.cameras[1].position.set(0, -12, 0).add(this.orbit.target);
    this.cameras[1].zoom = 12.6 / distance;
    this.cameras[1].updateProjectionMatrix();
    Object.assign(this.world.fog, { near: distance, far: 6 * distance });
    this.orbit.update();
    Object.assign(this, { isHome: true, lookedAt: low });
  }
  makeTops(height) {
    for (const top of this.tops) {
      this.world.remove(top.group);
      top.group.traverse((part) => part.geometry?.dispose());
    }
    this.floor.place(height, this.world.background.r < 0.2);
    this.tops = this.page.tops.map((top, i) => this.makeTop(top, i));
    this.floor.cast(this.tops.filter((top) => top.role === "thick"));
  }
  // Gives a top the words of its twin in the page, and the shape and the surroundings of now.
  settle(top, words) {
    Object.assign(top, words);
    const { body, zoom, trail } = this;
    top.solid.position.set(...body.centre).multiplyScalar(zoom);
    top.solid.quaternion.copy(quaternion(body.turn));
    top.solid.scale.setScalar(zoom);
    if (top.role !== "thick") return;
    const { gravity } = this.page.scene;
    top.globe.follow(top.limits, this.floor.height / trail);
    top.globe.scale.setScalar(trail);
    top.axes.follow(this.page.body, zoom, 0.8 * this.reach * zoom);
    // It stays in sight, however strong gravity is.
    top.p.point(0, 0, (2.4 * gravity) / (4 + Math.abs(gravity)));
    top.p.visible = gravity !== 0;
    top.stand.visible = gravity !== 0 && this.page.scene.show.solid !== "none";
  }
  // Finds the height of the floor: that of the tip, or as much lower as the body needs.
  ground() {
    if (!this.asTop) return FLOOR;
    const limits = this.page.tops.map((top) => top.limits?.greatest ?? Math.PI);
    const deepest = (angle) => {
      const [c, s] = [Math.cos(angle), Math.sin(angle)];
      return Math.max(...this.turned.profile.map(([z, r]) => s * r - c * z));
    };
    const lowest = Math.max(...limits.map(deepest));
    return Math.max(FLOOR, Math.min(-0.02, -this.zoom * lowest - 0.1));
  }
  makeTop(top, i) {
    const { colour, role, side, track } = top;
    const [thick, ghost] = [role === "thick", role === "ghost"];
    const [group, body] = [new THREE.Group(), new THREE.Group()];
    const line = pathLine(colour, this.world.background);
    const solid = this.asTop
      ? turnedTop(this.turned, { colour, role }, this.trail / this.zoom)
      : box({ colour, role });
    const parts = { role, group, body, line, solid, handles: [] };
    this.world.add(group.add(body.add(solid), line));
    if (!ghost) {
      parts.m = arrow("#0d9678", thick ? 0.028 : 0.014, 1, this.comesOut);
      parts.w = arrow("#3566e0", thick ? 0.028 : 0.014, 1, this.comesOut);
      group.add(parts.m, parts.w);
      parts.m.tip.userData.part = "tip";
    }
    if (!ghost && !track) parts.handles = [parts.m.tip, ...solid.handles];
    for (const { userData } of parts.handles) userData.i = i;
    return thick ? this.furnish(parts, side ? colour : ROD) : parts;
  }
  // Gives a top what only the first of its method has.
  furnish(parts, colour) {
    parts.globe = globe();
    parts.axes = axisLines();
    parts.rod = rodMesh(colour);
    parts.p = arrow("#7c8698", 0.02, 0.6);
    parts.drops = dropLines();
    parts.stand = stand(-this.floor.height);
    const { group, rod, p, drops } = parts;
    group.add(parts.globe, rod, p, drops, parts.stand);
    parts.body.add(parts.axes);
    return parts;
  }
  // Shows what of a scene is looks alone. Methods stand beside each other from left to right.
  show({ show, distance }) {
    for (const top of this.tops) {
      top.group.position.x = (top.side - (this.sides - 1) / 2) * distance;
      top.solid.look(this.body.half, show.opacity, show.thickness);
      top.solid.visible = show.solid !== "none";
      const apart = distance > 0 || !top.side; // else the faces of two would mix
      top.solid.handles[0].visible = top.role === "thick" && apart;
    }
    this.floor.visible = show.floor;
    this.floor.showShadows(show.solid !== "none", show.rod);
    this.orbit.object = this.cameras[+show.flat];
    this.orbit.maxPolarAngle = show.floor && !show.flat ? 1.64 : Math.PI; // above the floor
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
      this.drawBefore(top, this.page.before?.ways[i], show.thickness);
      if (top.role !== "thick") return;
      top.globe.visible = show.trace;
      top.axes.visible = show.axes || !!this.moving;
      top.drops.visible = show.drops || !!this.held;
      if (top.drops.visible) this.drop(top);
      top.rod.visible = show.rod;
      const power = SECTIONS[show.section];
      if (show.rod) top.rod.follow(i, 0.5 * this.zoom, 0.08 * show.thickness, power);
    });
    this.dirty = true;
  }
  // Draws the trace of the motion before a push.
  drawBefore(top, way, thickness) {
    if (way && !top.before) top.group.add((top.before = faintLine(top.colour)));
    if (!top.before) return;
    top.before.visible = !!way && top.line.visible;
    if (top.before.visible) top.before.follow(way, this.trail, thickness);
  }
  // Returns the points of a top's trace, on a sphere of radius 1.
  wayOf(i) {
    const points = new Float32Array(3 * WAY_POINTS);
    return points.slice(0, 3 * stage.way(i, 1, points));
  }
  drop({ m, body, solid, drops }) {
    const tip = new THREE.Vector3(0, 0, m.tip.position.z).applyQuaternion(m.quaternion);
    drops.follow(this.floor.height, tip, solid.position.clone().applyQuaternion(body.quaternion));
  }
  render() {
    if (!this.dirty && !this.recording) return;
    this.dirty = false;
    this.world.updateMatrixWorld();
    this.floor.follow();
    this.renderer.render(this.world, this.camera);
    this.letters.follow(this.pixels, this.covered);
  }
  // Returns the letters at a top's arrows, and at the circles between which its apex stays.
  lettersOf(top) {
    if (top.role !== "thick") return [];
    const at = (arrow) => () => arrow.visible && this.project(arrow.end());
    const letter = (words, arrow, about) => ({ words, colour: arrow.colour, about, at: at(arrow) });
    return [
      letter("m", top.m, "angular momentum"),
      letter("ω", top.w, "angular velocity"),
      letter("p", top.p, "the vertical, as long as gravity is strong"),
      ...this.circlesOf(top),
      ...this.namesOf(top),
    ];
  }
  // Tops side by side have names on the floor, if those tell them apart.
  namesOf({ group, side, track, method }) {
    const others = this.page.tops.filter((top) => top.side !== side);
    if (!others.length || others.some((top) => top.method === method && !track && !top.track))
      return [];
    const place = () => group.position.clone().setZ(this.floor.height - 0.25);
    const words = track ? `the path: ${method}` : method;
    return [{ words, colour: "", at: () => this.project(place()) }];
  }
  circlesOf({ limits, globe: sphere, group }) {
    if (!limits) return [];
    const degrees = (angle) => `${((180 * angle) / Math.PI).toFixed(1)}°`;
    const side = (angle) => () => {
      if (!sphere.visible) return null;
      if (Math.sin(angle) < 0.02) return null; // a point, on the axis
      const right = new THREE.Vector3().setFromMatrixColumn(this.camera.matrixWorld, 0).setZ(0);
      right.setLength(Math.sin(angle)).setZ(Math.cos(angle));
      return this.project(right.multiplyScalar(this.trail).add(group.position));
    };
    const { least, greatest } = limits;
    const one = greatest - least < 0.005;
    const words = one ? [""] : ["highest ", "lowest "];
    return words.map((word, i) => {
      const angle = i ? greatest : least;
      return { words: word + degrees(angle), colour: "", at: side(angle) };
    });
  }

  // Looks from the front, the right, above, and again. All is in sight, whatever became of it.
  turn() {
    this.side = ((this.side ?? -1) + 1) % SIDES.length;
    this.build(this.page, true);
    const far = this.camera.position.length();
    this.camera.position.copy(SIDES[this.side]).setLength(far).add(this.orbit.target);
    this.isHome = false;
    this.orbit.update();
  }

  // Finds what is under a point of the window: a tip before a corner before a face or edge.
  pick(x, y) {
    const handles = this.tops.flatMap((top) => top.handles.filter(isShown));
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
    return top.solid.localToWorld(new THREE.Vector3(...place));
  }
}
