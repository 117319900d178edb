// Drags: faces and edges turn, corners resize or move the fixed point, the tip of m sets the
// momentum. They change the scene through `page`, which makes the state of the moment the start.
import { Plane, Quaternion, Vector3 } from "three";
import { becomeCuboid, cornerSigns, quaternion, resize, wxyz } from "./scene.js";

export class Hands {
  drag = null; // what is held, and how
  tipSeen = false;
  constructor(view, page) {
    Object.assign(this, { view, page });
    const listen = (name, act, early) => view.canvas.addEventListener(name, act.bind(this), early);
    listen("pointerdown", this.grab, true); // before the orbit takes it
    listen("pointermove", this.move);
    listen("pointerup", this.release);
    listen("pointercancel", this.release);
  }

  grab(event) {
    const { view, page } = this;
    const hit = this.drag || event.button > 1 ? null : view.pick(event.clientX, event.clientY);
    const moves = event.button === 1 || event.altKey || page.scene.corners;
    const pivot = hit?.part === "corner" && moves;
    if (!hit || (event.button === 1 && !pivot)) return;
    event.preventDefault();
    page.run(false);
    view.orbit.enabled = false;
    view.canvas.setPointerCapture(event.pointerId);
    // A finger takes hold beside the middle of a handle: keep that distance.
    const grip = hit.part === "face" ? hit.point : view.handle(hit.part, hit.i, hit.corner);
    const forwards = view.camera.getWorldDirection(new Vector3());
    const plane = new Plane().setFromNormalAndCoplanarPoint(forwards, grip);
    const offset = meet(view, plane, event)?.sub(grip) ?? new Vector3();
    const { clientX: x, clientY: y, pointerId } = event;
    const part = pivot ? "pivot" : hit.part;
    this.drag = { ...hit, part, top: view.tops[hit.i], plane, offset, x, y, pointerId };
    view.moving = pivot;
    this.tipSeen ||= hit.part === "tip";
  }
  move(event) {
    const { view, page, drag } = this;
    if (!drag && event.pointerType === "mouse" && !event.buttons)
      view.canvas.style.cursor = view.pick(event.clientX, event.clientY) ? "grab" : "";
    if (drag?.pointerId !== event.pointerId) return;
    const at = meet(view, drag.plane, event)?.sub(drag.offset);
    if (!at) return;
    if (!drag.moved) {
      page.begin({ top: drag.top }); // now that it moves: a click changes nothing
      drag.moved = true;
    }
    page.edit((scene) => changes[drag.part](view, scene, drag, at, event));
  }
  release({ pointerId }) {
    const { view, page, drag } = this;
    if (drag?.pointerId !== pointerId) return;
    this.drag = null;
    view.moving = false;
    view.orbit.enabled = true;
    view.draw();
    page.tell();
  }
  // Lets go, and takes back what was done.
  cancel() {
    const { drag } = this;
    if (drag) this.release(drag);
    if (drag?.moved) this.page.undo();
  }
}

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
