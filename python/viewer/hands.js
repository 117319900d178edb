// Drags: faces and edges turn, corners resize or move the fixed point, the tip of m sets the momentum. They change
// the scene through `page`, which takes the state of the moment as the new start.
import { Plane, Quaternion, Vector3 } from "three";
import { becomeCuboid, cornerSigns, quaternion, resize, wxyz } from "./scene.js";

export function takeHold(view, page) {
  const { canvas } = view;
  const hands = { tipSeen: false, hold: () => drag !== null, cancel };
  let drag = null;

  function take(event) {
    const hit = drag || event.button > 1 ? null : view.pick(event.clientX, event.clientY);
    const move = hit?.kind === "corner" && (event.button === 1 || event.altKey || page.scene.corners);
    if (!hit || (event.button === 1 && !move)) return;
    event.preventDefault();
    page.run(false);
    view.orbit.enabled = false;
    canvas.setPointerCapture(event.pointerId);
    // A finger takes hold beside the middle of a handle: keep that distance.
    const grip = hit.kind === "face" ? hit.point : view.handle(hit.kind, hit.i, hit.corner);
    const plane = new Plane().setFromNormalAndCoplanarPoint(view.camera.getWorldDirection(new Vector3()), grip);
    const offset = meet(view, plane, event)?.sub(grip) ?? new Vector3();
    const { clientX: x, clientY: y, pointerId } = event;
    drag = { ...hit, kind: move ? "pivot" : hit.kind, top: view.tops[hit.i], plane, offset, x, y, pointerId };
    view.moving = move;
    hands.tipSeen ||= hit.kind === "tip";
  }
  function move(event) {
    if (!drag && event.pointerType === "mouse" && !event.buttons)
      canvas.style.cursor = view.pick(event.clientX, event.clientY) ? "grab" : "";
    const at = drag?.pointerId === event.pointerId && meet(view, drag.plane, event)?.sub(drag.offset);
    if (!at) return;
    if (!drag.moved) {
      page.begin({ top: drag.top }); // now that it moves: a click changes nothing
      drag.moved = true;
    }
    page.edit((scene) => moves[drag.kind](view, scene, drag, at, event));
  }
  function end({ pointerId } = drag) {
    if (drag?.pointerId !== pointerId) return;
    drag = null;
    view.moving = false;
    view.orbit.enabled = true;
    view.draw();
    page.tell();
  }
  function cancel() {
    const moved = drag?.moved;
    if (drag) end();
    if (moved) page.undo();
  }
  canvas.addEventListener("pointerdown", take, true); // before the orbit takes it
  canvas.addEventListener("pointermove", move);
  canvas.addEventListener("pointerup", end);
  canvas.addEventListener("pointercancel", end);
  return hands;
}

const meet = (view, plane, { clientX, clientY }) => view.ray(clientX, clientY).ray.intersectPlane(plane, new Vector3());
// Attitude and momentum of the top in hand.
const isSecond = (scene, { top }) => top.side === 1 && scene.second;
const pose = (scene, drag) => (isSecond(scene, drag) ? scene.second : [...scene.attitude, ...scene.momentum]);
function put(scene, drag, attitude, momentum) {
  if (isSecond(scene, drag)) scene.second = [...attitude, ...momentum];
  else Object.assign(scene, { attitude, momentum });
}
// A point of the world as the cuboid sees it, from the fixed point.
const inBody = (view, scene, drag, at) => {
  const turn = quaternion(pose(scene, drag)).conjugate();
  return at.sub(drag.top.group.position).applyQuaternion(turn).divideScalar(view.zoom).toArray();
};

const moves = {
  face(view, scene, drag, at, event) {
    const [right, up] = [0, 1].map((column) => new Vector3().setFromMatrixColumn(view.camera.matrixWorld, column));
    const turn = new Quaternion().setFromAxisAngle(up, (event.clientX - drag.x) * 0.008);
    turn.multiply(new Quaternion().setFromAxisAngle(right, (event.clientY - drag.y) * 0.008));
    const now = pose(scene, drag);
    put(scene, drag, wxyz(turn.multiply(quaternion(now)).normalize()), now.slice(4));
    [drag.x, drag.y] = [event.clientX, event.clientY];
  },
  tip(view, scene, drag, at, event) {
    const m = at.sub(drag.top.group.position).divideScalar(view.momentumZoom);
    const now = pose(scene, drag);
    if (event.shiftKey) m.projectOnVector(new Vector3(...now.slice(4))); // Shift: along itself
    put(scene, drag, now.slice(0, 4), m.toArray());
  },
  // The fixed point stays where it is in the body, in proportion.
  corner(view, scene, drag, at) {
    becomeCuboid(scene);
    const { half, pivot } = scene.body;
    const from = cornerSigns(drag.corner).map((sign, k) => sign - pivot[k] / half[k]); // times half: the corner
    const wanted = inBody(view, scene, drag, at);
    const sizes = half.map((h, k) => (Math.abs(from[k]) > 1e-3 ? wanted[k] / from[k] : h));
    resize(scene, sizes);
  },
  pivot(view, scene, drag, at) {
    becomeCuboid(scene);
    scene.shape = "free";
    const wanted = inBody(view, scene, drag, at);
    scene.body.pivot = scene.body.half.map((h, k) => h * cornerSigns(drag.corner)[k] - wanted[k]);
  },
};
