// The picture: three.js draws the simulation. The view reads the scene and the core and changes
// neither.
import * as THREE from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import { computeCuboid, simulation, TRACE_POINTS } from "./core.js";
import { Floor, NORTH } from "./floor.js";
import { makeApexSphere } from "./apex_sphere.js";
import { Labels } from "./labels.js";
import { setPictureSize } from "./wide_lines.js";
import { computeRoomAngle, findGlobeAxis, findNorthAngle } from "./scene.js";
import { getCornerSigns, hasFriction } from "./scene.js";
import { isOnTurntable, isRodAlone, isTurning, toQuaternion, SECTIONS } from "./scene.js";
import {
  makeArrow,
  makeAxes,
  makeBox,
  makeDropLines,
  makeFaintTrace,
  makeTrace,
  makeMomentumTrace,
  makeRod,
  makeSleeve,
  makeStand,
  makeRevolutionMesh,
  makeThing,
} from "./meshes.js";
import { fitRevolution, fitRoundThing } from "./revolution.js";
import { computeApex } from "./setters.js";
import { fitThing, THINGS } from "./things.js";

const SIDES = [
  new THREE.Vector3(0, -1, 0),
  new THREE.Vector3(1, 0, 0),
  new THREE.Vector3(0, -1e-3, 1),
];
const HOME = new THREE.Vector3(5.4, -9.6, 3.4);
const EAST = new THREE.Vector3(10, -4.2, 3); // from which the axis of a globe is seen at length
const SOUTH = new THREE.Vector3(2, -10.6, 2.4); // from which an orbit is seen
const BELOW = 24; // from an arrow to a label below it [pixels]
const ASIDE = (2 * Math.PI) / 3; // from a leaning axis to the camera, about the vertical
const FRONT = new THREE.Vector3(0, -11, 4.4); // equally far from tops side by side
// Colours. Readers without red or green cones distinguish the torque from m.
const [TORQUE, ROTOR] = ["#9333ea", "#7c3aed"];
const WEIGHTS = ["#111827", "#f3f4f6"]; // on light and dark ground; both stand out from a red top
const [WEIGHT_LENGTH, TORQUE_LENGTH] = [1.1, 1.5]; // in the picture; torque of a horizontal lever
const VERTICAL = "the vertical, as long as gravity is strong";
const ROD = "#2f7f86"; // colour of the rod beside a red top
const FLOOR = -2.7; // lowest height of the floor
const FRONT_ROOM = 1.2; // in front of a turntable, or of a top that may lie on the floor
const NEAR_FLOOR = -0.02; // height of a floor at the tip, which it does not cover
const ARROW_REACH = 3.4; // from a fixed point to the end of its longest arrow
const TABLE = 2.4; // radius of a turntable with one top
const GLOBE = 2; // radius of a globe
const ABOVE_ARCH = 0.7; // room above the fixed point of a thing that hangs
const LARGE_FOOTER = 0.12; // of the picture's height
const isShown = (part) => part.visible && part.parent.visible;
const rankPart = ({ object }) => ["tip", "corner", "face"].indexOf(object.userData.part);

export class View {
  requestFrame = () => {}; // requests a frame
  constructor(parent) {
    this.renderer = new THREE.WebGLRenderer({
      antialias: true,
      preserveDrawingBuffer: true,
      stencil: true, // for shadows
    });
    this.renderer.debug.checkShaderErrors = false; // checking would wait for the graphics driver
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.canvas = this.renderer.domElement;
    parent.prepend(this.canvas);
    const label =
      "The top, its angular momentum in green and its angular velocity in blue. " +
      "Arrow keys turn the view.";
    Object.assign(this.canvas, { tabIndex: 0, role: "application", ariaLabel: label });
    this.world = new THREE.Scene();
    this.world.fog = new THREE.Fog("#000");
    this.world.background = this.world.fog.color;
    this.floor = new Floor(this.world);
    this.labels = new Labels(parent);
    const flat = new THREE.OrthographicCamera(-1, 1, 1, -1, -100, 200);
    this.cameras = [new THREE.PerspectiveCamera(30, 1, 0.1, 200), flat];
    for (const camera of this.cameras) camera.up.set(0, 0, 1);
    this.orbit = new OrbitControls(this.cameras[0], this.canvas);
    Object.assign(this.orbit, { minDistance: 3, minZoom: 0.2, maxZoom: 10 });
    this.orbit.addEventListener("change", () => (this.isDirty = true));
    this.orbit.addEventListener("start", () => (this.isHome = false));
    this.canvas.addEventListener("webglcontextrestored", () => (this.isDirty = true));
    this.tops = [];
    this.footer = this.covered = 0;
    this.updateBackground();
    const resize = ([{ contentRect }]) => this.setSize(contentRect.width, contentRect.height);
    new ResizeObserver(resize).observe(parent);
    this.setSize(parent.clientWidth, parent.clientHeight);
  }
  get camera() {
    return this.orbit.object;
  }
  // A stale picture requests a frame.
  get isDirty() {
    return this.needsRender;
  }
  set isDirty(on) {
    this.needsRender = on;
    if (on) this.requestFrame();
  }

  // Take the background colour of the page.
  updateBackground() {
    this.world.background.setStyle(getComputedStyle(document.body).backgroundColor);
  }
  isDark() {
    return this.world.background.r < 0.2;
  }
  setSize(w, h) {
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
    setPictureSize(w, h);
    this.moveAboveFooter();
    if (this.page) this.render(); // at once, because a resized canvas is empty
  }
  // Set the height in pixels of the footer, which covers the lower part of the picture.
  setFooter(height) {
    this.footer = height;
    if (this.computeCovered() !== this.covered) this.moveAboveFooter();
  }
  // Return the height in pixels of the part of the picture that a large footer covers.
  computeCovered() {
    return this.footer > LARGE_FOOTER * this.pixels[1] ? this.footer : 0;
  }
  // Move the picture up, between the numbers and a large footer.
  moveAboveFooter() {
    const [w, h] = this.pixels;
    this.covered = this.computeCovered();
    for (const camera of this.cameras) camera.setViewOffset(w, h, 0, 0.31 * this.covered, w, h);
    if (this.isHome) this.moveHome();
    this.isDirty = true;
  }

  // Build the picture of a scene. With `fit` choose new scales of lengths and arrows.
  build(page, fit) {
    this.page = page;
    this.body = computeCuboid(page.scene.body);
    this.revolution = fitRevolution(this.body);
    const isStanding = page.contact !== null; // on a floor that ends the motion
    const solid = isStanding ? "top" : page.scene.show.solid;
    this.chooseThing(solid);
    const isRound = solid === "top" || !!this.thing?.isRound;
    const isRevolution = !!this.revolution && isRound;
    if (isRevolution && this.thing)
      this.revolution = fitRoundThing(this.thing, this.revolution, this.body.half);
    this.isRevolution = isRevolution;
    const { half, centre } = this.body;
    this.bodySize = Math.hypot(...half.map((h, i) => h + Math.abs(centre[i])));
    const sides = Math.max(...page.tops.map((top) => top.side)) + 1;
    const more = sides > (this.sides ?? 1); // which do not fit into the picture
    this.sides = sides;
    if (fit || more || !this.zoom) this.fitScales();
    // The trace of the apex lies on a sphere of this radius.
    const [lever, least] = [Math.hypot(...centre), 0.85 * this.bodySize];
    const ends = isRevolution ? this.revolution.profile.map(([z]) => z) : [2 * lever];
    this.traceRadius =
      this.zoom *
      Math.max((isRevolution ? 1.04 : 1) * Math.max(...ends), isRevolution ? 1.1 * least : least);
    // The floor stays still during a drag.
    const height = this.isHeld ? this.floor.height : this.findFloorHeight();
    const partsKey = this.describeParts(height);
    if (partsKey !== this.partsKey) this.makeTops(height);
    this.partsKey = partsKey;
    this.tops.forEach((top, i) => this.updateTop(top, page.tops[i]));
    const labels = [...this.tops.flatMap((top) => this.listLabels(top)), ...this.listRoomLabels()];
    this.labels.setLabels(labels, page.isProjector ? 1.6 : 1);
    const isLower = this.isHome && height < this.lookedAt; // than at the last home view
    if (this.isNew || isLower) this.moveHome();
    this.isNewRoom = this.isNew; // a camera at home keeps its place
    this.isNew = false;
    this.showScene(page.scene);
    this.isNewRoom = false;
  }
  // Choose the thing to be drawn, if it can be: a round one for a symmetric body, one with a wheel if
  // the rotor turns about the axle of the wheel.
  chooseThing(name) {
    const { body, revolution } = this;
    this.thing = this.wheel = null;
    if (!THINGS[name] || (THINGS[name].isRound && !revolution)) return;
    const { edges, signs, wheel } = fitThing(THINGS[name], body.half, revolution);
    if (wheel) {
      const axle = new THREE.Vector3().setComponent(edges[wheel.axis], signs[wheel.axis]);
      axle.applyQuaternion(toQuaternion(body.turn));
      const rotor = new THREE.Vector3(...this.page.scene.rotor);
      if (rotor.clone().cross(axle).length() > 1e-6 * rotor.length()) return;
      const own = Math.hypot(...this.page.scene.wheel);
      const moment = own || wheel.moment * this.page.body.mass;
      this.wheel = { axle, isFree: !!own, rate: rotor.dot(axle) / moment };
    }
    this.thing = THINGS[name];
  }
  // Return the angular velocities of a body and of its wheel about the axle, or about the axis of the
  // body, as seen from the support. A free wheel keeps its rate in space.
  findRates(i) {
    const { turning } = this.page.scene;
    const velocity = new THREE.Vector3(...simulation.getVelocity(i));
    if (!this.wheel) return [simulation.measureTop(i).spin, 0];
    const [, w, x, y, z] = simulation.getState(i);
    const axle = this.wheel.axle.clone().applyQuaternion(new THREE.Quaternion(x, y, z, w));
    const about = velocity.dot(axle);
    const { isFree, rate } = this.wheel;
    return [about, isFree ? rate - about - axle.dot(new THREE.Vector3(...turning)) : rate];
  }
  // Return a key of everything that meshes are made from. While it stays equal, `updateTop`,
  // `showScene` and `draw` update the existing meshes.
  describeParts(height) {
    const words = ({ colour, role, side, track }) => [colour, role, side, !!track];
    const tops = this.page.tops.map(words);
    const revolution = this.isRevolution && [this.revolution, this.traceRadius / this.zoom];
    const thing = this.thing && [this.thing.name, this.revolution?.axis, this.revolution?.up];
    const paper = this.world.background.getHex();
    const stand = [height, this.findCup()];
    return JSON.stringify([tops, revolution, thing, paper, this.isArrowVisible, stand]);
  }
  // Choose the scales of lengths and arrows.
  fitScales() {
    const [momentum, velocity] = simulation.getReach(0);
    this.zoom = 2.4 / this.bodySize;
    // Arrows of spinning solids get a scale at which they reach out of every body.
    const now = Math.hypot(...this.page.readLiveState().slice(5));
    const least = Math.min(
      ...this.page.tops.map((_, i) => Math.hypot(...simulation.getState(i).slice(5))),
    );
    this.isArrowVisible = this.isRevolution && now > momentum / 4 && least > 0.8 * now;
    const long = this.isArrowVisible ? now : momentum;
    this.momentumZoom = (this.isRevolution ? 3 : 3.2) / long;
    this.velocityZoom = (this.isRevolution ? 3.35 : 2.4) / velocity;
    this.home = this.chooseHome();
    this.isNew = true;
  }
  // Return the direction of the camera at home. The axis leans aside and away at the start, so that
  // the tip, m and the torque are all seen as the axis precesses.
  chooseHome() {
    const { attitude, momentum, gravity } = this.page.scene;
    const { axes, com } = this.page.body;
    const axis = new THREE.Vector3(...com).applyQuaternion(toQuaternion(axes));
    axis.applyQuaternion(toQuaternion(attitude));
    const spin = axis.dot(new THREE.Vector3(...momentum));
    axis.setZ(0);
    const isLeaning = axis.length() > 0.05 * this.bodySize;
    if (findGlobeAxis(this.page.scene)) return this.page.scene.gradient ? SOUTH : EAST;
    if (!isLeaning || findNorthAngle(this.page.scene) !== null) return HOME;
    const turn = spin * gravity < 0 ? ASIDE : -ASIDE;
    const level = Math.hypot(HOME.x, HOME.y);
    return axis
      .setLength(level)
      .applyAxisAngle(HOME.clone().set(0, 0, 1), turn)
      .setZ(HOME.z);
  }
  // Move the camera to the home position, which shows everything from the floor to the top of the
  // sphere. It adapts to the window until the user moves the camera.
  moveHome() {
    const { scene } = this.page;
    const hasRoom = this.page.contact !== null || findNorthAngle(scene) !== null;
    const [low, high] = this.findHeights(hasRoom ? FRONT_ROOM : 0);
    const wide = this.pixels[0] > 1.1 * this.pixels[1] ? 1 : 1.6;
    const far = Math.max(10.5, 2.05 * (high - low) + 2.1);
    const more =
      (this.sides - 1) * scene.distance * wide || (scene.show.rod && !isRodAlone(scene) ? 5 : 0);
    const { fov, aspect } = this.cameras[0];
    const breadth = ((this.sides - 1) * scene.distance) / 2 + ARROW_REACH;
    const away = breadth / (aspect * Math.tan((fov * Math.PI) / 360));
    const free = 1 - this.covered / this.pixels[1] / 1.6; // the numbers at the top need room as well
    const distance = Math.max((far + more) / free, away);
    this.orbit.target.set(0, 0, (low + high) / 2 - (this.isRevolution ? 0 : 0.1));
    this.orbit.maxDistance = 2.5 * distance;
    const from = this.sides > 1 ? FRONT : this.home;
    this.cameras[0].position.copy(from).setLength(distance).add(this.orbit.target);
    this.cameras[1].position.set(0, -12, 0).add(this.orbit.target);
    this.cameras[1].zoom = 12.6 / distance;
    this.cameras[1].updateProjectionMatrix();
    Object.assign(this.world.fog, { near: distance, far: 6 * distance });
    this.orbit.update();
    Object.assign(this, { isHome: true, lookedAt: this.floor.height });
  }
  // Return the lowest and the highest place to be seen at home. Seen from the room, everything goes
  // round the globe.
  findHeights(room) {
    const { height } = this.floor;
    const { scene } = this.page;
    const high = this.thing?.hangsOn === "arch" ? ABOVE_ARCH : Math.max(this.traceRadius, 2.4);
    if (!findGlobeAxis(scene)) return [height - room, high];
    const reach = high - height + GLOBE;
    return scene.show.room && !scene.gradient
      ? [height - GLOBE - reach, height - GLOBE + reach]
      : [height - 2.1 * GLOBE, high];
  }
  makeTops(height) {
    for (const top of this.tops) {
      this.world.remove(top.group);
      top.group.traverse((part) => part.geometry?.dispose());
    }
    this.floor.setHeight(height, this.isDark());
    this.tops = this.page.tops.map((top, i) => this.makeTop(top, i));
    this.floor.castShadows(this.tops.filter((top) => top.role === "thick"));
  }
  // Copy the data of a top from `this.page` and update the shape of its parts.
  updateTop(top, words) {
    Object.assign(top, words);
    const { body, zoom, traceRadius } = this;
    top.solid.position.set(...body.centre).multiplyScalar(zoom);
    top.solid.quaternion.copy(toQuaternion(body.turn));
    top.solid.scale.setScalar(zoom);
    if (top.role !== "thick") return;
    const { gravity } = this.page.scene;
    top.sphere.update(top.limits, this.floor.height / traceRadius);
    top.sphere.scale.setScalar(traceRadius);
    top.axes.update(this.page.body, zoom, 0.8 * this.bodySize * zoom);
    // Bounded, so that it fits into the picture for any gravity.
    top.p.pointTo(0, 0, (2.4 * gravity) / (9.81 + Math.abs(gravity)));
    const isHeld = gravity !== 0 || this.findCup() > 0;
    top.stand.visible = isHeld && this.page.scene.show.solid !== "none";
  }
  // Return how far below the fixed point a cup holds the frame of a thing, or 0 without a cup.
  findCup() {
    const { page, thing, zoom, body, revolution } = this;
    const isBalanced = !page.scene.gravity && !page.body.com.some(Boolean);
    if (!thing?.frame || !isBalanced || !isOnTurntable(page.scene)) return 0;
    return zoom * thing.frame * Math.max(...fitThing(thing, body.half, revolution).stretch);
  }
  // Return the height of the floor: at the tip, or lower if the body needs room.
  findFloorHeight() {
    if (this.page.contact !== null) return NEAR_FLOOR;
    if (!this.isRevolution) return FLOOR;
    const limits = this.page.tops.map((top) => top.limits?.greatest ?? Math.PI);
    const findDepth = (angle) => {
      const [c, s] = [Math.cos(angle), Math.sin(angle)];
      return Math.max(...this.revolution.profile.map(([z, r]) => s * r - c * z));
    };
    const lowest = Math.max(...limits.map(findDepth));
    return Math.max(FLOOR, Math.min(NEAR_FLOOR, -this.zoom * lowest - 0.1));
  }
  makeSolid(colour, role) {
    const pen = this.traceRadius / this.zoom;
    if (this.thing) return makeThing(this.thing, { colour, role }, this.revolution);
    if (this.isRevolution) return makeRevolutionMesh(this.revolution, { colour, role }, pen);
    return makeBox({ colour, role });
  }
  makeTop(top, i) {
    const { colour, role, side, track } = top;
    const [thick, ghost] = [role === "thick", role === "ghost"];
    const [group, body] = [new THREE.Group(), new THREE.Group()];
    const line = makeTrace(colour, this.world.background);
    const solid = this.makeSolid(colour, role);
    const parts = { role, group, body, line, solid, handles: [] };
    this.world.add(group.add(body.add(solid), line));
    if (!ghost) {
      parts.m = makeArrow("#0d9678", thick ? 0.028 : 0.014, 1, this.isArrowVisible);
      parts.w = makeArrow("#3566e0", thick ? 0.028 : 0.014, 1, this.isArrowVisible);
      group.add(parts.m, parts.w);
      parts.m.tip.userData.part = "tip";
    }
    if (!ghost && !track) parts.handles = [parts.m.tip, ...solid.handles];
    for (const { userData } of parts.handles) userData.i = i;
    return thick ? this.addCompanions(parts, side ? colour : ROD) : parts;
  }
  // Add the parts that only the first top of a method has.
  addCompanions(parts, colour) {
    parts.sphere = makeApexSphere();
    parts.axes = makeAxes();
    parts.rod = makeRod(colour);
    parts.p = makeArrow("#7c8698", 0.02, 0.6);
    parts.drops = makeDropLines();
    parts.stand = makeStand(-this.floor.height, this.thing?.hangsOn, this.findCup());
    parts.sleeve = makeSleeve(-this.floor.height);
    parts.weight = makeArrow(WEIGHTS[+this.isDark()], 0.02);
    parts.torque = makeArrow(TORQUE, 0.028);
    parts.h = makeArrow(ROTOR, 0.04);
    parts.momentumTrace = makeMomentumTrace("#0d9678");
    const { group, rod, p, drops, weight, torque, momentumTrace } = parts;
    group.add(
      parts.sphere,
      rod,
      p,
      drops,
      parts.stand,
      parts.sleeve,
      weight,
      torque,
      momentumTrace,
    );
    parts.body.add(parts.axes, parts.h);
    return parts;
  }
  // Apply the looks of a scene. Methods stand side by side from left to right.
  showScene({ show, distance }) {
    for (const top of this.tops) {
      top.group.position.x = (top.side - (this.sides - 1) / 2) * distance;
      top.solid.setLooks(this.body.half, show.opacity, show.thickness);
      top.solid.visible = show.solid !== "none";
      const apart = distance > 0 || !top.side; // otherwise their faces would overlap
      top.solid.handles[0].visible = top.role === "thick" && apart;
    }
    this.floor.visible = show.floor;
    const { scene } = this.page;
    const isTable = show.floor && isOnTurntable(scene);
    this.floor.showTable(TABLE + ((this.sides - 1) * distance) / 2, isTable, findNorthAngle(scene));
    this.floor.showGlobe(GLOBE, show.floor ? findGlobeAxis(scene) : null, !scene.gradient);
    if (this.isHome && show.room !== this.isInRoom && findGlobeAxis(scene)) this.moveHome();
    this.isInRoom = show.room;
    this.floor.showShadows(show.solid !== "none", show.rod);
    this.orbit.object = this.cameras[+show.flat];
    // Keep the camera from sinking far below the floor.
    this.orbit.maxPolarAngle = show.floor && !show.flat ? 1.64 : Math.PI;
    this.orbit.update();
    this.camera.updateMatrixWorld();
    this.draw();
  }

  draw() {
    const { show } = this.page.scene;
    const [time] = simulation.getState(0);
    // A picture of a running motion is exposed since the last one.
    const passed = time - (this.drawnTime ?? 0);
    const exposure = this.page.isRunning ? Math.max(0, passed) : 0;
    this.drawnTime = time;
    this.turnRoom(computeRoomAngle(this.page.scene, time));
    this.turnGlobe(time);
    this.tops.forEach((top, i) => {
      const [at, w, x, y, z, ...m] = simulation.getState(i);
      this.liftSupport(top, at);
      top.body.quaternion.set(x, y, z, w);
      top.m?.pointTo(...m.map((each) => each * this.momentumZoom));
      top.w?.pointTo(...simulation.getVelocity(i).map((each) => each * this.velocityZoom));
      const [about, ofWheel] = this.findRates(i);
      top.wheelAngle = passed < 0 ? 0 : ((top.wheelAngle ?? 0) + ofWheel * passed) % (2 * Math.PI);
      top.solid.turnWheel(top.wheelAngle);
      top.solid.setBlur(exposure * about, exposure * (about + ofWheel));
      top.line.visible = show.trace && top.role !== "ghost";
      if (top.line.visible) top.line.update(i, this.traceRadius, show.thickness);
      this.drawPreviousTrace(top, this.page.previousMotion?.ways[i], show.thickness);
      const { arrows } = show;
      if (top.m)
        [top.m.visible, top.w.visible] = [arrows && show.momentum, arrows && show.velocity];
      if (top.role !== "thick") return;
      this.drawTorque(top, i);
      top.h.visible = arrows && this.page.scene.rotor.some((x) => x !== 0);
      top.h.position.set(...this.body.centre).multiplyScalar(this.zoom);
      top.h.pointTo(...this.page.scene.rotor.map((x) => x * this.momentumZoom));
      top.p.visible = arrows && show.vertical && this.page.scene.gravity !== 0;
      top.sphere.visible = show.trace;
      top.axes.visible = show.axes || !!this.isPivotMoving;
      top.drops.visible = show.drops || !!this.isHeld;
      if (top.drops.visible) this.updateDrops(top);
      top.rod.visible = show.rod;
      const power = SECTIONS[show.section];
      const isAlone = isRodAlone(this.page.scene);
      if (show.rod) top.rod.update(i, 0.5 * this.zoom, 0.08 * show.thickness, power, isAlone);
    });
    this.isDirty = true;
  }
  // Turn the room, and with it a camera that stands in the room.
  turnRoom(angle) {
    const { orbit, camera, floor } = this;
    const change = angle - (this.roomAngle ?? 0);
    this.roomAngle = angle;
    floor.room.rotation.set(0, 0, angle);
    if (!change || this.isNewRoom || !this.page.scene.show.room) return;
    camera.position.sub(orbit.target).applyAxisAngle(camera.up, change).add(orbit.target);
    orbit.update();
  }
  // Move a shaken support to its height at a time.
  liftSupport({ group, stand, sleeve }, time) {
    const [amplitude, rate, phase] = this.page.scene.shaking;
    const height = this.zoom * amplitude * Math.cos(rate * time + phase);
    group.position.z = height;
    if (!stand) return;
    stand.scale.z = this.thing?.hangsOn ? 1 : 1 - height / this.floor.height;
    sleeve.visible = stand.visible && amplitude !== 0;
    sleeve.position.z = this.floor.height - height;
  }
  // Turn the globe below an orbit. On turning ground, the whole world turns about the axis of the globe
  // as seen from the room, where the light stays.
  turnGlobe(time) {
    const { world, floor, page } = this;
    const { turning, gradient, show } = page.scene;
    const [axis, angle] = [findGlobeAxis(page.scene), Math.hypot(...turning) * time];
    floor.globe.turning.rotation.z = gradient ? -angle : 0;
    const isSeen = axis && !gradient && show.room;
    const turn = new THREE.Quaternion();
    if (isSeen) turn.setFromAxisAngle(axis, angle);
    world.quaternion.copy(turn);
    const centre = new THREE.Vector3(0, 0, floor.height - GLOBE);
    world.position.copy(centre).sub(centre.clone().applyQuaternion(turn));
    if (axis && !gradient) floor.room.quaternion.setFromAxisAngle(axis, -angle);
  }
  // Draw the weight at the centre of mass, and at the tip of m the torque about the fixed point,
  // the rate of change of m.
  drawTorque({ weight, torque, momentumTrace, m, body }, i) {
    const { scene } = this.page;
    const { com, mass } = this.page.body;
    const force = new THREE.Vector3(0, 0, -mass * scene.gravity);
    const isShown = scene.show.arrows && scene.show.torque && force.z !== 0;
    weight.visible = isShown;
    torque.visible = momentumTrace.visible = isShown && scene.show.momentum; // at the tip of m
    if (!isShown) return;
    const axes = toQuaternion(this.page.body.axes);
    const lever = new THREE.Vector3(...com).applyQuaternion(axes).applyQuaternion(body.quaternion);
    const largest = lever.length() * Math.abs(force.z) || 1;
    weight.position.copy(lever).multiplyScalar(this.zoom);
    weight.pointTo(0, 0, Math.sign(force.z) * WEIGHT_LENGTH);
    torque.position.set(0, 0, m.tip.position.z).applyQuaternion(m.quaternion);
    torque.pointTo(...lever.cross(force).multiplyScalar(TORQUE_LENGTH / largest));
    momentumTrace.update(i, this.momentumZoom, scene.show.thickness);
  }
  // Draw the trace of the motion before a change.
  drawPreviousTrace(top, way, thickness) {
    if (way && !top.before) top.group.add((top.before = makeFaintTrace(top.colour)));
    if (!top.before) return;
    top.before.visible = !!way && top.line.visible;
    if (top.before.visible) top.before.update(way, this.traceRadius, thickness);
  }
  // Return the points of a trace on a sphere of radius 1.
  getTrace(i) {
    const points = new Float32Array(3 * TRACE_POINTS);
    return points.slice(0, 3 * simulation.fillTrace(i, 1, points));
  }
  updateDrops({ group, m, body, solid, drops }) {
    const tip = new THREE.Vector3(0, 0, m.tip.position.z).applyQuaternion(m.quaternion);
    drops.update(
      this.floor.height - group.position.z,
      tip,
      solid.position.clone().applyQuaternion(body.quaternion),
    );
  }
  render() {
    if (!this.isDirty && !this.recording) return;
    this.isDirty = false;
    this.world.updateMatrixWorld();
    this.floor.updateShadows();
    this.renderer.render(this.world, this.camera);
    this.labels.placeLabels(this.pixels, this.covered);
  }
  // Render a square picture with sides of `size` pixels, call `use`, and restore the size.
  renderSquare(size, use) {
    const { pixels, footer } = this;
    const ratio = this.renderer.getPixelRatio();
    this.renderer.setPixelRatio(1);
    this.footer = 0;
    this.setSize(size, size);
    use();
    this.renderer.setPixelRatio(ratio);
    this.footer = footer;
    this.setSize(...pixels);
  }
  // Return the labels of a top: at its arrows, circles and name.
  listLabels(top) {
    if (top.role !== "thick") return [];
    const { m, torque } = top;
    const nameArrow = (words, arrow, about, colour = arrow.colour) => {
      const place = () => {
        if (!arrow.visible || !arrow.hasLength()) return null;
        const [x, y] = this.project(arrow.getEnd());
        if (!torque.visible || (arrow !== m && arrow !== torque)) return [x, y];
        // The torque begins at the tip of m: its label stands beyond its tip, that of m opposite,
        // or below both arrows where they point to the same side.
        const other = this.project((arrow === m ? torque : m).getEnd())[0];
        if (arrow === torque) return [x, y, other > x];
        const begin = this.project(top.group.position);
        const isAlong = (x - begin[0]) * (other - x) > 0 && Math.abs(x - begin[0]) > begin[1] - y;
        return isAlong ? [x, y + BELOW, other < x] : [x, y, other >= x];
      };
      return { words, colour, about, at: place };
    };
    const isAlone = this.sides === 1; // two tops have no room for words
    return [
      nameArrow(isAlone ? "momentum m" : "m", m, "angular momentum"),
      nameArrow(isAlone ? "rotation axis ω" : "ω", top.w, "angular velocity"),
      nameArrow(isAlone ? "vertical p" : "p", top.p, VERTICAL, "var(--faint)"),
      nameArrow("h", top.h, "momentum of the rotor"),
      nameArrow("weight", top.weight, "the weight, at the centre of mass"),
      nameArrow("torque", torque, this.describeTorque()),
      ...this.listCircleLabels(top),
      ...this.listNames(top),
    ];
  }
  // The torque of the weight is the rate of change of m, unless friction, damping or a turning
  // support contributes.
  describeTorque() {
    const { scene } = this.page;
    const isAlone = !hasFriction(scene) && !isTurning(scene);
    return `torque of the weight${isAlone ? ": the rate of change of m" : ""}`;
  }
  // Return the label of the mark N.
  listRoomLabels() {
    if (findNorthAngle(this.page.scene) === null) return [];
    const place = () => (this.page.scene.show.floor ? this.project(this.floor.findNorth()) : null);
    const about = isOnTurntable(this.page.scene)
      ? "north in the room, which turns as seen from the turntable"
      : "north, along the axis of the turning ground";
    return [{ words: "N", colour: NORTH, about, at: place }];
  }
  // Return the labels with method names, if the methods differ.
  listNames({ group, side, track, method }) {
    const others = this.page.tops.filter((top) => top.side !== side);
    if (!others.length || others.some((top) => top.method === method && !track && !top.track))
      return [];
    const place = () => group.position.clone().setZ(this.floor.height - 0.25);
    const words = track ? `the path: ${method}` : method;
    return [{ words, colour: "", at: () => this.project(place()) }];
  }
  listCircleLabels({ limits, sphere, group }) {
    if (!limits) return [];
    const degrees = (angle) => `${((180 * angle) / Math.PI).toFixed(1)}°`;
    const side = (angle) => () => {
      if (!sphere.visible || this.page.scene.show.torque) return null;
      if (Math.sin(angle) < 0.02) return null; // the circle is a point
      const right = new THREE.Vector3().setFromMatrixColumn(this.camera.matrixWorld, 0).setZ(0);
      right.setLength(Math.sin(angle)).setZ(Math.cos(angle));
      return this.project(right.multiplyScalar(this.traceRadius).add(group.position));
    };
    const { least, greatest } = limits;
    const one = greatest - least < 0.005;
    const words = one ? [""] : ["highest ", "lowest "];
    return words.map((word, i) => {
      const angle = i ? greatest : least;
      return { words: word + degrees(angle), colour: "", at: side(angle) };
    });
  }

  // Show the scene from the front, from the right, and from above in turn.
  showNextSide() {
    this.side = ((this.side ?? -1) + 1) % SIDES.length;
    this.build(this.page, true);
    const far = this.camera.position.length();
    this.camera.position.copy(SIDES[this.side]).setLength(far).add(this.orbit.target);
    this.isHome = false;
    this.orbit.update();
  }

  // Return the part under a point of the window. Tips come before corners, corners before faces.
  pick(x, y) {
    const handles = this.tops.flatMap((top) => top.handles.filter(isShown));
    const hits = this.castRay(x, y).intersectObjects(handles, false);
    hits.sort((a, b) => rankPart(a) - rankPart(b) || a.distance - b.distance);
    return hits[0] && { ...hits[0].object.userData, point: hits[0].point };
  }
  castRay(x, y) {
    const ray = new THREE.Raycaster();
    const [w, h] = this.pixels;
    ray.setFromCamera(new THREE.Vector2((2 * x) / w - 1, 1 - (2 * y) / h), this.camera);
    return ray;
  }
  // Return the position of a point of the world in the window, in pixels.
  project(point) {
    this.camera.updateMatrixWorld();
    const p = point.clone().project(this.camera);
    return [((p.x + 1) / 2) * this.pixels[0], ((1 - p.y) / 2) * this.pixels[1]];
  }
  // Return the position of a handle: the tip of m, the pen at the end of the axis, corner 0 to 7, or the middle of the front face
  // or edge.
  findHandle(part, i, number = 0) {
    this.world.updateMatrixWorld(true);
    const top = this.tops[i];
    if (part === "tip") return top.m.tip.getWorldPosition(new THREE.Vector3());
    if (part === "pen") {
      const apex = computeApex(this.page.scene, simulation.getState(i).slice(1));
      return new THREE.Vector3(...apex).multiplyScalar(this.traceRadius).add(top.group.position);
    }
    const signs = { face: [0, -1, 0], edge: [1, -1, 0], corner: getCornerSigns(number) }[part];
    const place = signs.map((sign, k) => sign * this.body.half[k]);
    return top.solid.localToWorld(new THREE.Vector3(...place));
  }
}
