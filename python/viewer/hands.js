// Drags: faces and edges turn, corners resize or move the fixed point, the tip of m sets the momentum. They change
// the scene through `page`, which takes the state of the moment as the new start.
import { Plane, Quaternion, Vector3 } from "three";
import { becomeCuboid, cornerSigns, quaternion, resize, wxyz } from "./scene.js";

export function takeHold(view, page) {
  let drag = null;
  const canvas = view.canvas;

  canvas.addEventListener(
    "pointerdown",
    (event) => {
      const hit = drag ? null : view.pick(event.clientX, event.clientY);
      if (!hit || event.button > 1) return;
      const move = hit.kind === "corner" && (event.button === 1 || event.altKey || page.cornersMove());
      if (event.button === 1 && !move) return;
      event.preventDefault();
      page.run(false);
      view.enable(false);
      canvas.setPointerCapture(event.pointerId);
      const top = view.tops[hit.i];
      // A finger takes hold beside the middle of a handle: keep that distance.
      const grip = hit.kind === "face" ? hit.point : view.handle(hit.kind, hit.i, hit.corner);
      const facing = view.camera.getWorldDirection(new Vector3());
      const plane = new Plane().setFromNormalAndCoplanarPoint(facing, grip);
      const offset = meet(view, plane, event.clientX, event.clientY)?.sub(grip) ?? new Vector3();
      const kind = move ? "pivot" : hit.kind;
      drag = { ...hit, kind, top, plane, offset, x: event.clientX, y: event.clientY };
      view.moving = move;
      page.seen(hit.kind);
    },
    true,
  );

  canvas.addEventListener("pointermove", (event) => {
    if (!drag) {
      if (event.pointerType === "mouse" && !event.buttons)
        canvas.style.cursor = view.pick(event.clientX, event.clientY) ? "grab" : "";
      return;
    }
    if (!drag.before) {
      page.begin(drag.top); // now that it moves: a click changes nothing
      drag.before = structuredClone(page.scene);
    }
    const at = meet(view, drag.plane, event.clientX, event.clientY)?.sub(drag.offset);
    if (!at) return;
    page.edit((scene) => moves[drag.kind](view, scene, drag, at, event));
  });

  const end = () => {
    if (!drag) return;
    drag = null;
    view.moving = false;
    view.enable(true);
    view.draw();
    page.tell();
  };
  canvas.addEventListener("pointerup", end);
  canvas.addEventListener("pointercancel", end);
  return {
    cancel() {
      if (!drag) return false;
      const { before } = drag;
      end();
      if (before) page.replace(before);
      return true;
    },
  };
}

const meet = (view, plane, x, y) => view.ray(x, y).ray.intersectPlane(plane, new Vector3());
// A point of the world as the cuboid sees it, from the fixed point.
const inBody = (view, scene, drag, at) => {
  const turn = quaternion(scene.attitude).conjugate();
  return at.sub(drag.top.group.position).applyQuaternion(turn).divideScalar(view.zoom).toArray();
};

const moves = {
  face(view, scene, drag, at, event) {
    const [right, up] = [0, 1].map((column) => new Vector3().setFromMatrixColumn(view.camera.matrixWorld, column));
    const turn = new Quaternion().setFromAxisAngle(up, (event.clientX - drag.x) * 0.008);
    turn.multiply(new Quaternion().setFromAxisAngle(right, (event.clientY - drag.y) * 0.008));
    scene.attitude = wxyz(turn.multiply(quaternion(scene.attitude)).normalize());
    [drag.x, drag.y] = [event.clientX, event.clientY];
  },
  tip(view, scene, drag, at, event) {
    const m = at.sub(drag.top.group.position).divideScalar(view.momentumZoom);
    const key = drag.top.side && scene.second ? "second" : "momentum";
    if (event.shiftKey) m.projectOnVector(new Vector3(...scene[key])); // Shift: along itself
    scene[key] = m.toArray();
  },
  // The fixed point stays where it is in the body, in proportion.
  corner(view, scene, drag, at) {
    becomeCuboid(scene);
    const { half, pivot } = scene.body;
    const signs = cornerSigns(drag.corner);
    const wanted = inBody(view, scene, drag, at);
    const sizes = half.map((h, k) => {
      const from = signs[k] - pivot[k] / h; // the corner lies at half times this
      return Math.abs(from) > 1e-3 ? Math.max(wanted[k] / from, 0.05) : h;
    });
    if (scene.shape === "free" || scene.shape === "lagrange") return resize(scene, sizes);
    const ratio = Math.hypot(...wanted) / Math.hypot(...half.map((h, k) => h * signs[k] - pivot[k]));
    const alike = half.map((h) => h * ratio);
    return resize(scene, alike);
  },
  pivot(view, scene, drag, at) {
    becomeCuboid(scene);
    scene.shape = "free";
    const wanted = inBody(view, scene, drag, at);
    scene.body.pivot = scene.body.half.map((h, k) => h * cornerSigns(drag.corner)[k] - wanted[k]);
  },
};
