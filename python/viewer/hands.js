// Drags: faces and edges turn, corners resize or move the fixed point, the tip of m sets the
// momentum, and a push gives it a jerk. They change the scene through `page`, which makes the state
// of the moment the start; a top that stood still for the hand goes on. A finger holds the tip
// alone, and looks around on the body, unless it may push.
import { Plane, Quaternion, Vector3 } from "three";
import { fitArrows } from "./camera.js";
import { becomeCuboid, cornerSigns, quaternion, resize, wxyz } from "./scene.js";
import { arrow, halo } from "./shapes.js";

// An arrow of m as long as the way of a push changes by so much of that, at the largest lever.
const STRENGTH = 0.35;

export class Hands {
  drag = null; // what is held, and how
  pushes = false;
  constructor(view, page) {
    Object.assign(this, { view, page, halo: halo(), band: arrow("#ffb020", 0.03) });
    view.world.add(this.halo, this.band);
    this.band.visible = false;
    const listen = (name, act, early) => view.canvas.addEventListener(name, act.bind(this), early);
    listen("pointerdown", this.grab, true); // before the orbit takes it
    listen("pointermove", this.move);
    listen("pointerup", this.release);
    listen("pointercancel", this.release);
  }

  // Returns what a pointer would hold.
  under({ clientX, clientY, pointerType }) {
    const hit = this.view.pick(clientX, clientY);
    const looks = pointerType === "touch" && !this.pushes && hit?.part !== "tip";
    return looks ? undefined : hit;
  }
  grab(event) {
    const { view, page } = this;
    view.canvas.focus({ preventScroll: true }); // keys are for it now, and no field is half typed
    const hit = this.drag || event.button > 1 ? null : this.under(event);
    const moves = event.button === 1 || event.altKey || page.scene.corners;
    const pivot = hit?.part === "corner" && moves;
    if (!hit || (event.button === 1 && !pivot)) return;
    event.preventDefault();
    view.orbit.enabled = false;
    view.canvas.setPointerCapture(event.pointerId);
    const part = pivot ? "pivot" : this.pushes && hit.part !== "tip" ? "push" : hit.part;
    const goesOn = page.running;
    if (part !== "push") page.run(false);
    // A finger takes hold beside the middle of a handle: keep that distance.
    const isHandle = part !== "push" && hit.part !== "face";
    const grip = isHandle ? view.handle(hit.part, hit.i, hit.corner) : hit.point;
    const plane = facing(view, grip);
    const offset = meet(view, plane, event)?.sub(grip) ?? new Vector3();
    const { clientX: x, clientY: y, pointerId } = event;
    const top = view.tops[hit.i];
    const place = top.body.worldToLocal(grip.clone());
    this.drag = { ...hit, part, top, plane, offset, x, y, pointerId, goesOn, place };
    view.moving = pivot;
    this.light(isHandle && hit);
  }
  move(event) {
    const { view, page, drag } = this;
    if (!drag && event.pointerType === "mouse" && !event.buttons) this.hover(event);
    if (drag?.pointerId !== event.pointerId) return;
    if (drag.part === "push") return this.stretch(event);
    const at = meet(view, drag.plane, event)?.sub(drag.offset);
    if (!at) return;
    if (!drag.moved) {
      page.begin({ top: page.tops[drag.i] }); // now that it moves: a click changes nothing
      drag.moved = view.held = true;
    }
    page.edit((scene) => changes[drag.part](view, scene, drag, at, event));
    this.light(this.lit);
  }
  hover(event) {
    const hit = this.under(event);
    this.view.canvas.style.cursor = hit ? "grab" : "";
    this.light(hit && hit.part !== "face" && hit);
  }
  // A handle that is held, or could be, lights up.
  light(hit) {
    const { halo, view } = this;
    if (!hit && !this.lit) return;
    this.lit = hit || null;
    halo.visible = !!hit;
    view.dirty = true;
    this.follow();
  }
  // The light stays at a handle that moves.
  follow() {
    const { halo, lit, view } = this;
    if (lit && view.dirty) halo.position.copy(view.handle(lit.part, lit.i, lit.corner));
  }
  // A push is drawn as a band from where the body is held to the pointer.
  stretch({ clientX, clientY }) {
    const { view, drag, band } = this;
    const from = view.tops[drag.i].body.localToWorld(drag.place.clone());
    const to = meet(view, facing(view, from), { clientX, clientY });
    if (!to) return;
    drag.band = { from, by: to.sub(from) };
    band.position.copy(from);
    band.point(...drag.band.by);
    band.visible = view.dirty = true;
  }
  // Gives the jerk: the momentum changes by lever and way of the push.
  push({ i, band: { from, by } }) {
    const { view, page } = this;
    const top = view.tops[i];
    const lever = from.clone().sub(top.group.position);
    const change = lever.cross(by).multiplyScalar(STRENGTH / view.momentumZoom);
    page.push(page.tops[i], (scene) => {
      const now = pose(scene, { top });
      const m = new Vector3(...now.slice(4)).add(change);
      setPose(scene, { top }, now.slice(0, 4), m.toArray());
    });
  }
  release({ pointerId, type }) {
    const { view, page, drag } = this;
    if (drag?.pointerId !== pointerId) return;
    this.drag = null;
    view.moving = view.held = this.band.visible = false;
    if (drag.moved) view.build(page, false);
    view.orbit.enabled = true;
    view.draw();
    this.light(null);
    if (drag.part === "push") return drag.band && type === "pointerup" && this.push(drag);
    if (drag.moved && fitArrows(view)) page.say("The arrows are now drawn on a smaller scale");
    page.goal === null && page.run(drag.goesOn);
  }
  // Lets go, and takes back what was done.
  cancel() {
    const { drag } = this;
    if (drag) this.release(drag);
    if (drag?.moved) this.page.undo();
  }
}

const facing = (view, point) =>
  new Plane().setFromNormalAndCoplanarPoint(view.camera.getWorldDirection(new Vector3()), point);
const meet = (view, plane, { clientX, clientY }) =>
  view.ray(clientX, clientY).ray.intersectPlane(plane, new Vector3());
// The pose of the top in hand is its attitude and momentum, 7 numbers.
const isSecond = (scene, { top }) => top.side === 1 && scene.second;
const pose = (scene, drag) =>
  isSecond(scene, drag) ? scene.second : [...scene.attitude, ...scene.momentum];
function setPose(scene, drag, attitude, momentum) {
  if (isSecond(scene, drag)) scene.second = [...attitude, ...momentum];
  else Object.assign(scene, { attitude, momentum });
}
// Returns a point of the world as the cuboid sees it, from the fixed point.
const inBody = (view, scene, drag, at) => {
  const turn = quaternion(pose(scene, drag)).conjugate();
  const seen = at.sub(drag.top.group.position).applyQuaternion(turn);
  return seen.divideScalar(view.zoom).toArray();
};

// These are what a drag does to the scene, by what is held.
const changes = {
  face(view, scene, drag, at, { clientX, clientY }) {
    const column = (k) => new Vector3().setFromMatrixColumn(view.camera.matrixWorld, k);
    const [right, up] = [column(0), column(1)];
    const turn = new Quaternion().setFromAxisAngle(up, (clientX - drag.x) * 0.008);
    turn.multiply(new Quaternion().setFromAxisAngle(right, (clientY - drag.y) * 0.008));
    const now = pose(scene, drag);
    setPose(scene, drag, wxyz(turn.multiply(quaternion(now)).normalize()), now.slice(4));
    [drag.x, drag.y] = [clientX, clientY];
  },
  tip(view, scene, drag, at, { shiftKey }) {
    const m = at.sub(drag.top.group.position).divideScalar(view.momentumZoom);
    const now = pose(scene, drag);
    if (shiftKey) m.projectOnVector(new Vector3(...now.slice(4))); // along itself
    setPose(scene, drag, now.slice(0, 4), m.toArray());
  },
  // The fixed point stays where it is in the body, in proportion.
  corner(view, scene, drag, at) {
    becomeCuboid(scene);
    const { half, pivot } = scene.body;
    // times half: from the fixed point to the corner
    const from = cornerSigns(drag.corner).map((sign, k) => sign - pivot[k] / half[k]);
    const wanted = inBody(view, scene, drag, at);
    resize(
      scene,
      half.map((h, k) => (Math.abs(from[k]) > 1e-3 ? wanted[k] / from[k] : h)),
    );
  },
  pivot(view, scene, drag, at) {
    becomeCuboid(scene);
    scene.shape = "free";
    const wanted = inBody(view, scene, drag, at);
    const signs = cornerSigns(drag.corner);
    scene.body.pivot = scene.body.half.map((h, k) => h * signs[k] - wanted[k]);
  },
};
