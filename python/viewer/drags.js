// Drags with a mouse or finger. A face or edge turns the body, a corner resizes it or moves the
// fixed point, the green tip sets the momentum, the pen tilts the top with its momentum, a push adds to
// the momentum, and a swipe along the rim of a round top adds to its spin. A drag makes the current
// state the start. A finger drags only tip, pen and rim unless pushing is on; elsewhere it turns the
// view.
import { Plane, Quaternion, Vector3 } from "three";
import { fitArrows } from "./camera.js";
import { convertToCuboid, getCornerSigns, toQuaternion, resizeBody, toWxyz } from "./scene.js";
import { simulation } from "./core.js";
import { changeSpin, computeApex } from "./setters.js";
import { makeArrow, makeHighlight } from "./meshes.js";

// Change of momentum, relative to m, for a push as long as the arrow of m at a lever of length 1.
const PUSH_STRENGTH = 0.35;
const RIM = 0.7; // least distance of the rim from the axis, over the largest one
const NEAR = { mouse: 10, touch: 22 }; // greatest distance of a pointer from the pen [pixels]
const ASIDE = 24; // from the pen to its angle [pixels]
const [SWIPE_SPAN, LEAST_SPAN] = [120, 16]; // of the end of a swipe, which gives its speed [ms]
const REST = 300; // a pointer at rest for this time before its release gives nothing [ms]
const SHOWN = 1500; // how long the momentum of a swipe is shown after it [ms]

export class DragHandler {
  current = null; // the drag in progress
  isPushing = false;
  constructor(view, page) {
    Object.assign(this, {
      view,
      page,
      highlight: makeHighlight(),
      pushArrow: makeArrow("#ffb020", 0.03),
      angle: document.createElement("output"), // beside the pen
    });
    this.angle.id = "angle";
    view.canvas.after(this.angle);
    view.world.add(this.highlight, this.pushArrow);
    this.pushArrow.visible = false;
    const addListener = (name, act, early) =>
      view.canvas.addEventListener(name, act.bind(this), early);
    addListener("pointerdown", this.beginDrag, true); // before the orbit controls
    addListener("pointermove", this.moveDrag);
    addListener("pointerup", this.endDrag);
    addListener("pointercancel", this.endDrag);
  }

  // Return the part under a pointer that a drag would move.
  findPart({ clientX, clientY, pointerType }) {
    const { view, isPushing } = this;
    const hit = view.pick(clientX, clientY);
    const near = NEAR[pointerType] ?? NEAR.touch;
    const hasPen = ({ role, handles }) => role === "thick" && handles.length && view.isRevolution;
    const isNear = (top, i) => {
      const [x, y] = view.project(view.findHandle("pen", i));
      return hasPen(top) && Math.hypot(x - clientX, y - clientY) < near;
    };
    const i = isPushing || hit?.part === "tip" ? -1 : view.tops.findIndex(isNear);
    if (i >= 0) return { part: "pen", i };
    if (hit && isOnRim(view, hit)) hit.part = "rim";
    const looks = pointerType === "touch" && !isPushing && !/^(tip|rim)$/.test(hit?.part);
    return looks ? undefined : hit;
  }
  beginDrag(event) {
    const { view, page } = this;
    // Moves the focus from a field that may be half edited.
    view.canvas.focus({ preventScroll: true });
    const hit = this.current || event.button > 1 ? null : this.findPart(event);
    const moves = event.button === 1 || event.altKey || page.scene.corners;
    const pivot = hit?.part === "corner" && moves;
    if (!hit || (event.button === 1 && !pivot)) return;
    event.preventDefault();
    view.orbit.enabled = false;
    view.canvas.setPointerCapture(event.pointerId);
    const part = pivot ? "pivot" : this.isPushing && hit.part !== "tip" ? "push" : hit.part;
    const wasRunning = page.isRunning;
    if (!/^(push|rim)$/.test(part)) page.setRunning(false);
    // Keep the distance between the pointer and the middle of the handle.
    const isHandle = part !== "push" && !/^(face|rim)$/.test(hit.part);
    const grip = isHandle ? view.findHandle(hit.part, hit.i, hit.corner) : hit.point;
    const plane = makeFacingPlane(view, grip);
    const offset = intersectPlane(view, plane, event)?.sub(grip) ?? new Vector3();
    const { clientX: x, clientY: y, pointerId } = event;
    const top = view.tops[hit.i];
    const place = top.body.worldToLocal(grip.clone());
    this.current = { ...hit, part, top, plane, offset, x, y, pointerId, wasRunning, place };
    if (part === "pen") Object.assign(this.current, findPenGrip(view, grip, top, event));
    if (part === "rim") Object.assign(this.current, { swipe: [], along: findRimMotion(view, hit) });
    view.isPivotMoving = pivot;
    this.setHighlight(isHandle && hit);
  }
  moveDrag(event) {
    const { view, page, current: drag } = this;
    if (!drag && event.pointerType === "mouse" && !event.buttons) this.showHover(event);
    if (drag?.pointerId !== event.pointerId) return;
    if (drag.part === "push") return this.drawPush(event);
    if (drag.part === "rim") return this.drawSwipe(event);
    const at = intersectPlane(view, drag.plane, event)?.sub(drag.offset);
    if (!at) return;
    if (!drag.hasMoved) {
      page.beginChange({ top: page.tops[drag.i] }); // not on a click without a move
      drag.hasMoved = view.isHeld = true;
    }
    page.editScene((scene) => CHANGES[drag.part](view, scene, drag, at, event));
    this.setHighlight(this.highlighted);
    if (drag.part === "pen") this.showAngle(drag.i);
  }
  // Show the tilt of a top beside its pen.
  showAngle(i) {
    const { angle, view } = this;
    const [x, y] = view.project(view.findHandle("pen", i));
    angle.textContent = `tilt ${((180 * simulation.measureTop(i).nutation) / Math.PI).toFixed(1)}°`;
    angle.style.translate = `max(0px, ${x - ASIDE}px - 100%) ${y - ASIDE}px`;
  }
  showHover(event) {
    const hit = this.findPart(event);
    this.view.canvas.style.cursor = hit ? (hit.part === "rim" ? "ew-resize" : "grab") : "";
    this.setHighlight(hit && !/^(face|rim)$/.test(hit.part) && hit);
  }
  // Highlight the handle `hit`, or none.
  setHighlight(hit) {
    const { highlight, view } = this;
    if (!hit && !this.highlighted) return;
    this.highlighted = hit || null;
    highlight.visible = !!hit;
    view.isDirty = true;
    this.updateHighlight();
  }
  // Move the highlight with its handle.
  updateHighlight() {
    const { highlight, highlighted, view } = this;
    if (highlighted && view.isDirty)
      highlight.position.copy(view.findHandle(highlighted.part, highlighted.i, highlighted.corner));
  }
  // Draw the push as an arrow from the held point to the pointer.
  drawPush({ clientX, clientY }) {
    const { view, current: drag, pushArrow } = this;
    const from = view.tops[drag.i].body.localToWorld(drag.place.clone());
    const to = intersectPlane(view, makeFacingPlane(view, from), { clientX, clientY });
    if (!to) return;
    drag.push = { from, by: to.sub(from) };
    pushArrow.position.copy(from);
    pushArrow.pointTo(...drag.push.by);
    pushArrow.visible = view.isDirty = true;
  }
  // Change the momentum by the cross product of lever and push.
  applyPush({ i, push: { from, by } }) {
    const { view, page } = this;
    const top = view.tops[i];
    const lever = from.clone().sub(top.group.position);
    const change = lever.cross(by).multiplyScalar(PUSH_STRENGTH / view.momentumZoom);
    page.pushTop(page.tops[i], (scene) => {
      const now = getPose(scene, { top });
      const m = new Vector3(...now.slice(4)).add(change);
      setPose(scene, { top }, now.slice(0, 4), m.toArray());
    });
  }
  // Draw the momentum that a swipe gives, at the tip of m.
  drawSwipe({ clientX, clientY, timeStamp }) {
    const { view, current: drag, pushArrow } = this;
    const at = intersectPlane(view, drag.plane, { clientX, clientY });
    if (!at) return;
    drag.swipe.push([timeStamp, at.sub(drag.point).dot(drag.along)]);
    const { given, tip } = this.computeSwipe(drag);
    pushArrow.position.copy(tip);
    pushArrow.pointTo(...given.multiplyScalar(view.momentumZoom));
    pushArrow.visible = view.isDirty = true;
  }
  // Return the spin and the momentum after a swipe, the momentum that it gives, and the tip of m
  // before. The swipe gives the spin that the pointer had about the axis, at the pace of the film.
  computeSwipe({ i, top, swipe }) {
    const { view, page } = this;
    const [, ...pose] = simulation.getState(i);
    const m = new Vector3(...pose.slice(4));
    const rate = measureRate(swipe) / (page.scene.speed || 1);
    const add = (spin) => spin + rate;
    const { spin, momentum } = changeSpin(page.scene, pose.slice(0, 4), pose.slice(4), add);
    const tip = m.clone().multiplyScalar(view.momentumZoom).add(top.group.position);
    return { rate, spin, momentum, tip, given: new Vector3(...momentum).sub(m) };
  }
  // Change the spin by a swipe, and tell the momentum that it gives.
  applySwipe(drag) {
    const { page, view, pushArrow } = this;
    const { rate, spin, momentum, given } = this.computeSwipe(drag);
    if (!rate) return;
    page.pushTop(page.tops[drag.i], (scene) => {
      const now = getPose(scene, drag);
      setPose(scene, drag, now.slice(0, 4), momentum);
    });
    const [size, change, now] = [given.length(), rate, spin].map((x) => +x.toPrecision(3));
    const sign = change < 0 ? "−" : "+";
    page.showMessage(
      `Spin ${sign}${Math.abs(change)} to ${now} rad/s, momentum ${sign}${size} N m s`,
    );
    pushArrow.visible = true;
    setTimeout(() => (pushArrow.visible = !(view.isDirty = true)), SHOWN);
  }
  endDrag({ pointerId, type, timeStamp }) {
    const { view, page, current: drag } = this;
    if (drag?.pointerId !== pointerId) return;
    this.current = null;
    this.angle.textContent = "";
    view.isPivotMoving = view.isHeld = this.pushArrow.visible = false;
    if (drag.hasMoved) view.build(page, false);
    view.orbit.enabled = true;
    view.draw();
    this.setHighlight(null);
    if (drag.part === "push") return drag.push && type === "pointerup" && this.applyPush(drag);
    if (drag.part === "rim") {
      const isMoving = timeStamp - drag.swipe.at(-1)?.[0] < REST;
      return type === "pointerup" && isMoving && this.applySwipe(drag);
    }
    if (drag.hasMoved && fitArrows(view))
      page.showMessage("The arrows are now drawn on a smaller scale");
    page.goal === null && page.setRunning(drag.wasRunning);
  }
  // End the drag and undo it.
  cancelDrag() {
    const { current: drag } = this;
    if (drag) this.endDrag(drag);
    if (drag?.hasMoved) this.page.undo();
  }
}

const makeFacingPlane = (view, point) =>
  new Plane().setFromNormalAndCoplanarPoint(view.camera.getWorldDirection(new Vector3()), point);
const intersectPlane = (view, plane, { clientX, clientY }) =>
  view.castRay(clientX, clientY).ray.intersectPlane(plane, new Vector3());
// Return how a pointer holds the pen: its distance in the picture, and whether the pen is on the side
// of its sphere that faces away.
function findPenGrip(view, grip, { group }, { clientX, clientY }) {
  const [x, y] = view.project(grip);
  const away = view.camera.getWorldDirection(new Vector3());
  return { slip: [clientX - x, clientY - y], isBehind: grip.clone().sub(group.position).dot(away) > 0 };
}
// Return the direction from the fixed point to the place of the pen's sphere under a pointer, or to the
// nearest one.
function findPenDirection(view, { top, slip, isBehind }, { clientX, clientY }) {
  const { ray } = view.castRay(clientX - slip[0], clientY - slip[1]);
  const centre = top.group.position;
  const from = ray.closestPointToPoint(centre, new Vector3()).sub(centre);
  const deep = Math.sqrt(Math.max(0, view.traceRadius ** 2 - from.lengthSq()));
  return from.addScaledVector(ray.direction, isBehind ? deep : -deep).normalize();
}
// Return whether a hit lies on the rim of a solid of revolution.
function isOnRim({ tops, isRevolution, revolution }, { part, point, i }) {
  if (part !== "face" || !isRevolution) return false;
  const wide = Math.max(...revolution.profile.map(([, r]) => r));
  const at = tops[i].solid.worldToLocal(point.clone()).setComponent(revolution.axis, 0);
  return at.length() > RIM * wide;
}
// Return the vector in the picture whose product with a motion of the pointer from a place on the
// rim is the angle about the axis.
function findRimMotion(view, { point, i }) {
  const { solid } = view.tops[i];
  const { axis, up } = view.revolution;
  const along = new Vector3().setComponent(axis, up).transformDirection(solid.matrixWorld);
  along.cross(point.clone().sub(solid.getWorldPosition(new Vector3())));
  const radius = along.length();
  return along.projectOnPlane(view.camera.getWorldDirection(new Vector3())).setLength(1 / radius);
}
// Return the rate at the end of a swipe from its times [ms] and angles.
function measureRate(swipe) {
  if (swipe.length < 2) return 0;
  const [last, angle] = swipe.at(-1);
  const recent = swipe.findIndex(([time]) => time > last - SWIPE_SPAN);
  const [first, from] = swipe[Math.min(recent, swipe.length - 2)];
  return (1000 * (angle - from)) / Math.max(last - first, LEAST_SPAN);
}
// The pose of the dragged top: attitude and momentum, 7 numbers.
const isSecond = (scene, { top }) => top.side === 1 && scene.second;
const getPose = (scene, drag) =>
  isSecond(scene, drag) ? scene.second : [...scene.attitude, ...scene.momentum];
function setPose(scene, drag, attitude, momentum) {
  if (isSecond(scene, drag)) scene.second = [...attitude, ...momentum];
  else Object.assign(scene, { attitude, momentum });
}
// Return a point of the world in the frame of the cuboid, seen from the fixed point.
const toBodyFrame = (view, scene, drag, at) => {
  const turn = toQuaternion(getPose(scene, drag)).conjugate();
  const seen = at.sub(drag.top.group.position).applyQuaternion(turn);
  return seen.divideScalar(view.zoom).toArray();
};

// Changes of the scene by the dragged part.
const CHANGES = {
  face(view, scene, drag, at, { clientX, clientY }) {
    const column = (k) => new Vector3().setFromMatrixColumn(view.camera.matrixWorld, k);
    const [right, up] = [column(0), column(1)];
    const turn = new Quaternion().setFromAxisAngle(up, (clientX - drag.x) * 0.008);
    turn.multiply(new Quaternion().setFromAxisAngle(right, (clientY - drag.y) * 0.008));
    const now = getPose(scene, drag);
    setPose(scene, drag, toWxyz(turn.multiply(toQuaternion(now)).normalize()), now.slice(4));
    [drag.x, drag.y] = [clientX, clientY];
  },
  tip(view, scene, drag, at, { shiftKey }) {
    const m = at.sub(drag.top.group.position).divideScalar(view.momentumZoom);
    const now = getPose(scene, drag);
    if (shiftKey) m.projectOnVector(new Vector3(...now.slice(4))); // keep the direction
    setPose(scene, drag, now.slice(0, 4), m.toArray());
  },
  // Turn the momentum with the top.
  pen(view, scene, drag, at, event) {
    const now = getPose(scene, drag);
    const apex = new Vector3(...computeApex(scene, now));
    const turn = new Quaternion().setFromUnitVectors(apex, findPenDirection(view, drag, event));
    const m = new Vector3(...now.slice(4)).applyQuaternion(turn);
    setPose(scene, drag, toWxyz(turn.multiply(toQuaternion(now)).normalize()), m.toArray());
  },
  // Keep the fixed point at its relative place in the body.
  corner(view, scene, drag, at) {
    convertToCuboid(scene);
    const { half, pivot } = scene.body;
    // vector from the fixed point to the corner, over the half edges
    const from = getCornerSigns(drag.corner).map((sign, k) => sign - pivot[k] / half[k]);
    const wanted = toBodyFrame(view, scene, drag, at);
    resizeBody(
      scene,
      half.map((h, k) => (Math.abs(from[k]) > 1e-3 ? wanted[k] / from[k] : h)),
    );
  },
  pivot(view, scene, drag, at) {
    convertToCuboid(scene);
    scene.shape = "free";
    const wanted = toBodyFrame(view, scene, drag, at);
    const signs = getCornerSigns(drag.corner);
    scene.body.pivot = scene.body.half.map((h, k) => h * signs[k] - wanted[k]);
  },
};
