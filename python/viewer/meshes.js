// Meshes of the picture.
import * as THREE from "three";
import { ROD_RINGS, ROD_SIDES, simulation, TRACE_POINTS } from "./core.js";
import { writeCorners, Line, makeStrip, writePiece } from "./wide_lines.js";
import { getCornerSigns, toQuaternion } from "./scene.js";
import { makeSurface } from "./revolution.js";
import { fitThing } from "./things.js";

const makeVector = (...numbers) => new THREE.Vector3(...numbers);
const makeMesh = (shape, paint) => new THREE.Mesh(shape, paint);
const makeFlatMaterial = (look) => new THREE.MeshBasicMaterial({ transparent: true, ...look });
const makeShinyMaterial = (look) => new THREE.MeshPhongMaterial({ transparent: true, ...look });
const turnUpright = (shape) => shape.rotateX(Math.PI / 2); // three.js builds along y
const UNITS = [makeVector(1, 0, 0), makeVector(0, 1, 0), makeVector(0, 0, 1)];
const ROD = new THREE.CylinderGeometry(1, 1, 1, 16);
const BALL = new THREE.SphereGeometry(1, 20, 14);
const addPart = (group, part, userData = {}) => (
  group.add(part),
  Object.assign(part, { userData })
);

// Make the stand below the fixed point, a needle, or a cone if the floor is near. A thing hangs on a
// rope, or below an arch on a globe, or lies in a cup at some distance below the fixed point.
const [ROPE, SPAN, DEEPER] = [8, 1.25, 0.5]; // length, half the width, and depth below the floor
export function makeStand(depth, hangsOn, cup) {
  if (hangsOn) {
    const paint = makeShinyMaterial({ color: "#8a7f6a", transparent: false });
    const [thin, low] = hangsOn === "rope" ? [0.02, 0] : [0.045, -depth - DEEPER];
    const makePole = (x, high) => {
      const pole = turnUpright(new THREE.CylinderGeometry(thin, thin, high - low, 12));
      return makeMesh(pole.translate(x, 0, (high + low) / 2), paint);
    };
    if (hangsOn === "rope") return makePole(0, ROPE);
    const bar = new THREE.CylinderGeometry(thin, thin, 2 * SPAN, 12).rotateZ(Math.PI / 2);
    return new THREE.Group().add(makePole(-SPAN, 0), makePole(SPAN, 0), makeMesh(bar, paint));
  }
  const [top, base] = cup ? [0.4, 0.55] : [0.012, 0.05 + 0.025 * depth];
  const cone = turnUpright(new THREE.CylinderGeometry(top, base, depth - cup, 32));
  return makeMesh(
    cone.translate(0, 0, -(depth + cup) / 2),
    makeShinyMaterial({ color: "#9a9389", transparent: false }),
  );
}

// Make the sleeve in which a shaken stand moves up and down.
export function makeSleeve(depth) {
  const height = 0.6 * depth;
  const tube = turnUpright(new THREE.CylinderGeometry(0.12, 0.16, height, 32));
  return makeMesh(tube.translate(0, 0, height / 2), makeShinyMaterial({ color: "#5b6675" }));
}

const [MARK, SECTOR] = [3.6, Math.PI / 3]; // begin and angle of the mark that shows the spin [rad]
const [WOOD, STEEL, CREAM] = ["#c99a5b", "#aab2bd", "#f7ecd2"].map((name) => new THREE.Color(name));
// Return for how much of the time the mark covers a place, at an angle from its begin, while it turns
// by `blur` to where it is now.
function findCover(angle, blur) {
  if (!blur) return +(angle <= SECTOR);
  const [behind, length] = [blur < 0 ? angle : SECTOR - angle, Math.abs(blur)];
  let covered = 0;
  for (let end = behind; end - SECTOR < length; end += 2 * Math.PI)
    covered += Math.max(0, Math.min(end, length) - Math.max(end - SECTOR, 0));
  return covered / length;
}
// Make a mesh of revolution, with a coarse one inside that casts the shadow.
const [PIECES, PLAIN, COARSE] = [96, 40, 20]; // round the axis, with a mark, without one, in a shadow
function makeTurned(revolution, pieces, paint) {
  const caster = makeMesh(makeSurface(revolution, COARSE));
  caster.visible = false;
  return makeMesh(makeSurface(revolution, pieces), paint).add(caster);
}
const findCaster = (mesh) => mesh.children[0] ?? mesh;
// Make a painted surface of revolution with a mark. `setBlur` spreads the mark over the angle by
// which it turns while a picture is exposed: a sharp mark would seem to turn backwards.
function makeMarkedMesh(revolution, colour, look, hasGrain) {
  const mesh = makeTurned(revolution, PIECES, makeShinyMaterial({ ...look, vertexColors: true }));
  const shape = mesh.geometry;
  const colours = new Float32Array(shape.attributes.position.array.length);
  shape.setAttribute("color", new THREE.BufferAttribute(colours, 3));
  const [paints, mixed] = [
    { paint: new THREE.Color(colour), mark: CREAM, wood: WOOD },
    new THREE.Color(),
  ];
  let drawn = null;
  mesh.setBlur = (blur) => {
    const rounded = Math.abs(blur) < 0.02 ? 0 : +blur.toFixed(2);
    if (rounded === drawn) return;
    drawn = rounded;
    for (let i = 0; i <= PIECES; i++) {
      const angle = (2 * Math.PI * i) / PIECES - MARK;
      const cover = findCover(angle < 0 ? angle + 2 * Math.PI : angle, rounded);
      const grain = 1 - 0.04 * ((i * 7) % 5);
      shape.looks.forEach((name, j) => {
        mixed.copy(paints[name]);
        if (name === "paint") mixed.lerp(CREAM, cover);
        if (name === "wood" && hasGrain) mixed.multiplyScalar(grain);
        mixed.toArray(colours, 3 * (i * shape.looks.length + j));
      });
    }
    shape.attributes.color.needsUpdate = true;
  };
  mesh.setBlur(0);
  return mesh;
}
const findLook = (role) => ({
  shininess: 60,
  specular: "#4c453e",
  transparent: role !== "thick",
  ...(role === "thick" ? {} : { opacity: 0.35, depthWrite: false }),
});
// Make the axle of a round body. It has a tip at its lower end, and its upper end touches the apex
// sphere.
function makeAxle(low, high, thin, look) {
  const paint = makeShinyMaterial({ ...look, color: STEEL });
  const length = high - low - 6 * thin;
  const rod = new THREE.CylinderGeometry(thin, thin, length, 20).translate(0, high - length / 2, 0);
  const tip = new THREE.ConeGeometry(thin, 6 * thin, 20)
    .rotateX(Math.PI)
    .translate(0, low + 3 * thin, 0);
  return [makeMesh(rod, paint), makeMesh(tip, paint)];
}
// Make a solid of revolution with its axle. Lengths are in units of the body.
export function makeRevolutionMesh(revolution, { colour, role }, pen) {
  const group = new THREE.Group();
  const { axis, up, height, profile } = revolution;
  const thin = 0.028 * Math.max(...profile.map(([, r]) => r));
  const surface = makeMarkedMesh(revolution, colour, findLook(role), true);
  const [low, high] = height ? [-height, pen - height] : [-pen, pen];
  for (const part of [surface, ...makeAxle(low, high, thin, findLook(role))])
    addPart(group, part, { part: "face", density: +(part === surface) });
  group.quaternion.setFromUnitVectors(UNITS[1], UNITS[axis].clone().multiplyScalar(up));
  return Object.assign(new THREE.Group().add(group), {
    shadowCasters: group.children.map(findCaster),
    handles: group.children,
    setLooks() {},
    setBlur: surface.setBlur,
    turnWheel() {},
  });
}
// Add straight spokes to a wheel. Spokes that turn fast become a veil.
function addSpokes(group, { count, inner: [radius, side], outer, at }, look) {
  const ends = Array.from({ length: count }, (_, k) => {
    const [c, s] = [Math.cos, Math.sin].map((f) => f((2 * Math.PI * k) / count));
    return [radius * c, radius * s, k % 2 ? side : -side, outer * c, outer * s, 0];
  });
  const shape = new THREE.BufferGeometry();
  shape.setAttribute("position", new THREE.Float32BufferAttribute(ends.flat(), 3));
  const faint = { ...look, color: STEEL, transparent: true, depthWrite: false };
  const lines = new THREE.LineSegments(
    shape,
    new THREE.LineBasicMaterial({ color: STEEL, transparent: true, depthWrite: false }),
  );
  const veil = makeMesh(
    new THREE.RingGeometry(radius, outer, 64),
    makeShinyMaterial({ ...faint, side: 2 }),
  );
  for (const part of [lines, veil]) addPart(group, part).position.set(...at);
  return (blur) => {
    const share = Math.min(1, (count * Math.abs(blur)) / (2 * Math.PI));
    lines.material.opacity = 1 - share;
    veil.material.opacity = 0.3 * share;
  };
}
// Make a thing from its solids (things.js). `setLooks` stretches it along the edges of the cuboid of
// the body. Its third axis is that of the revolution, if there is one.
export function makeThing(given, { colour, role }, revolution) {
  const { solids, spokes, isRound } = given;
  const look = findLook(role);
  const [thing, wheel, marked] = [new THREE.Group(), new THREE.Group(), []];
  const axle = solids.find((solid) => solid.isWheel);
  if (axle) wheel.position.set(...axle.at);
  const makePart = ({ profile, half, isWheel, colour: own }) => {
    const surface = { profile, height: 0 };
    if (isWheel || (isRound && !own)) return makeMarkedMesh(surface, own ?? colour, look);
    const paint = makeShinyMaterial({ ...look, color: own ?? colour });
    return half ? makeMesh(CUBE, paint) : makeTurned(surface, PLAIN, paint);
  };
  const handles = solids.map((solid) => {
    const { half, axis, at, isWheel, density } = solid;
    const mesh = makePart(solid);
    if (half) mesh.scale.set(...half);
    else mesh.quaternion.setFromUnitVectors(UNITS[1], UNITS[axis]);
    if (!isWheel) mesh.position.set(...at); // a wheel turns about its centre
    if (mesh.setBlur) marked.push(mesh);
    return addPart(isWheel ? wheel : thing, mesh, { part: "face", density });
  });
  const spread = spokes && addSpokes(thing, spokes, look);
  const frame = new THREE.Group().add(thing.add(wheel));
  return Object.assign(new THREE.Group().add(frame), {
    shadowCasters: handles.map(findCaster),
    handles,
    setLooks(half) {
      const { edges, signs, stretch, centre } = fitThing(given, half, revolution);
      const columns = edges.map((k, i) => UNITS[k].clone().multiplyScalar(signs[i]));
      frame.quaternion.setFromRotationMatrix(new THREE.Matrix4().makeBasis(...columns));
      thing.scale.set(...stretch);
      thing.position.set(...centre.map((x, i) => -x * stretch[i]));
    },
    setBlur(blur, ofWheel) {
      for (const mesh of marked) mesh.setBlur(mesh.parent === wheel ? ofWheel : blur);
      spread?.(blur);
    },
    turnWheel: (angle) => axle && wheel.quaternion.setFromAxisAngle(UNITS[axle.axis], angle),
  });
}

// Make a cuboid with translucent faces, and with edges and corners to drag. All cuboids share the
// geometries, so that a drag only moves and scales parts.
const CUBE = new THREE.BoxGeometry(2, 2, 2);
export function makeBox({ colour: color, role }) {
  const group = new THREE.Group();
  const glass = makeShinyMaterial({ color, side: 2, depthWrite: false });
  const opacity = role === "ghost" ? 0.55 : 1;
  const solid = makeShinyMaterial({ color, transparent: opacity < 1, opacity, shininess: 40 });
  const faces = addPart(group, makeMesh(CUBE, glass), { part: "face" });
  const [corners, edges] = [[], []];
  for (let i = 0; i < 8; i++) {
    const at = makeVector(...getCornerSigns(i));
    corners.push({
      part: addPart(group, makeMesh(BALL, solid), { part: "corner", corner: i }),
      at,
    });
    for (const k of [0, 1, 2].filter((k) => !((i >> k) & 1))) {
      const part = addPart(group, makeMesh(ROD, solid), { part: "face" });
      part.quaternion.setFromUnitVectors(UNITS[1], UNITS[k]);
      edges.push({ part, k, at: at.clone().setComponent(k, 0) });
    }
  }
  group.shadowCasters = [faces];
  group.handles = group.children;
  group.setBlur = group.turnWheel = () => {};
  group.setLooks = (half, opacity, times) => {
    Object.assign(glass, { opacity, transparent: opacity < 1, depthWrite: opacity === 1 });
    const size = Math.cbrt(half[0] * half[1] * half[2]);
    const thin = times * size * (role === "thick" ? 0.026 : 0.013);
    faces.scale.set(...half);
    for (const { part, at } of [...corners, ...edges]) part.position.copy(at).multiply(faces.scale);
    for (const { part } of corners) part.scale.setScalar(2.6 * thin);
    for (const { part, k } of edges) part.scale.set(thin, 2 * half[k], thin);
  };
  return group;
}

const SHAFT = turnUpright(new THREE.CylinderGeometry(1, 1, 1, 16)).translate(0, 0, 0.5);
const HEAD = turnUpright(new THREE.ConeGeometry(3, 8, 24));
// Make an arrow. Without `depthTest` it is drawn over the body, inside which it begins.
export function makeArrow(color, radius, opacity = 1, depthTest = false) {
  const group = new THREE.Group();
  const paint = makeShinyMaterial({ color, depthTest, opacity, transparent: !depthTest });
  const [shaft, tip] = [makeMesh(SHAFT, paint), makeMesh(HEAD, paint)];
  for (const part of [shaft, tip]) part.scale.setScalar(radius);
  const target = makeMesh(BALL, new THREE.MeshBasicMaterial({ visible: false }));
  target.scale.setScalar(Math.max(radius * 5, 0.12));
  shaft.renderOrder = tip.renderOrder = 10;
  group.add(shaft, tip, target);
  group.tip = target; // larger than the visible tip, for fingers
  group.colour = color;
  group.hasLength = () => shaft.visible;
  group.getEnd = () => tip.getWorldPosition(makeVector());
  group.pointTo = (...v) => {
    const [direction, length] = [makeVector(...v), Math.hypot(...v) || 1e-9];
    shaft.visible = tip.visible = length > 1e-3; // the zero vector has no direction
    group.quaternion.setFromUnitVectors(UNITS[2], direction.divideScalar(length));
    shaft.scale.z = tip.position.z = target.position.z = length;
  };
  return group;
}

// Make vertical lines from the tip of m and the centre of mass to the floor, each with a spot at
// its end.
export function makeDropLines() {
  const group = new THREE.Group();
  const drops = ["#0d9678", "#7c8698"].map((color) => {
    const [line, spot] = [SHAFT, BALL].map((shape) =>
      makeMesh(shape, makeFlatMaterial({ color, opacity: 0.8 })),
    );
    spot.scale.set(0.07, 0.07, 0.004);
    return new THREE.Group().add(line, spot);
  });
  group.add(...drops);
  group.update = (floor, ...points) =>
    drops.forEach((drop, k) => {
      const { x, y, z } = points[k];
      drop.position.set(x, y, floor);
      drop.visible = z > floor;
      drop.children[0].scale.set(0.012, 0.012, z - floor);
    });
  return group;
}

// Make the highlight of a handle.
export function makeHighlight() {
  const light = makeMesh(
    BALL,
    makeFlatMaterial({ color: "#ffb020", opacity: 0.45, depthTest: false }),
  );
  light.scale.setScalar(0.16);
  light.renderOrder = 12;
  light.visible = false;
  return light;
}

// Make the trace of the apex. Its newest point comes first, in the strongest colour. The newest
// part is drawn a second time, over the rest.
const FRESH_POINTS = 256; // pieces of the newest part
export function makeTrace(colour, ground) {
  const [shape, part] = [makeStrip(TRACE_POINTS), new THREE.BufferGeometry()];
  Object.assign(part, { attributes: shape.attributes, index: shape.index });
  const [line, fresh] = [new Line(shape, { depthWrite: false }), new Line(part)];
  const points = new Float32Array(3 * TRACE_POINTS);
  const [paint, mixed] = [new THREE.Color(colour), new THREE.Color()];
  for (let i = 0; i < TRACE_POINTS; i++) {
    const strength = Math.max(0.2, 1 - (0.9 * i) / TRACE_POINTS);
    mixed.lerpColors(ground, paint, strength).toArray(points, 3 * i);
  }
  writeCorners(points, TRACE_POINTS, shape.shades.array);
  [line.renderOrder, fresh.renderOrder] = [1, 2]; // after solids, the newest part last
  fresh.material.transparent = true; // opaque parts are drawn first, whatever their order
  line.add(fresh);
  line.update = (i, radius, thickness) => {
    line.width = fresh.width = 2.4 * thickness;
    const n = simulation.fillTrace(i, radius, points);
    writeCorners(points, n, shape.places.array);
    shape.places.needsUpdate = true;
    line.showPieces(n - 1);
    fresh.showPieces(Math.min(n - 1, FRESH_POINTS));
  };
  return line;
}

// Make the trace of the tip of m, dashed. Dashes alternate along circles about the vertical and along
// rays, so that they rest while the trace grows.
const DASH = 0.11; // length of a dash at a distance of one from the vertical
export function makeMomentumTrace(colour) {
  const line = new Line(makeStrip(TRACE_POINTS), { opacity: 0.7, depthWrite: false });
  const { places, shades, index } = line.geometry;
  const points = new Float32Array(3 * TRACE_POINTS);
  const shade = new THREE.Color(colour).toArray();
  writeCorners(Array(TRACE_POINTS).fill(shade).flat(), TRACE_POINTS, shades.array);
  line.update = (i, scale, thickness) => {
    line.width = 2 * thickness;
    const n = simulation.fillMomentumTrace(i, scale, points);
    writeCorners(points, n, places.array);
    places.needsUpdate = index.needsUpdate = true;
    let pieces = 0;
    for (let k = 0; k < n - 1; k++) {
      const [x, y, z] = points.subarray(3 * k, 3 * k + 3);
      const place = Math.atan2(y, x) + Math.hypot(x, y, z);
      if (Math.floor(place / DASH) % 2 === 0) writePiece(k, index.array, pieces++);
    }
    line.showPieces(pieces);
  };
  return line;
}

// Make the faint trace of the motion before a change.
export function makeFaintTrace(colour) {
  const line = new Line(makeStrip(TRACE_POINTS), { opacity: 0.35, depthWrite: false });
  const { places, shades } = line.geometry;
  const shade = new THREE.Color(colour).toArray();
  writeCorners(Array(TRACE_POINTS).fill(shade).flat(), TRACE_POINTS, shades.array);
  let drawn = null;
  line.update = (points, radius, thickness) => {
    line.width = 1.6 * thickness;
    line.scale.setScalar(radius);
    if (drawn === points) return;
    drawn = points;
    writeCorners(points, points.length / 3, places.array);
    places.needsUpdate = true;
    line.showPieces(points.length / 3 - 1);
  };
  return line;
}

// Make the elastic rod from rings of points about its centre line. Long rods are scaled down to fit
// into the picture.
const ROD_REACH = 3.4; // largest coordinate, from the fixed point
const [LONE_REACH, LONE_ZOOM] = [2.4, 2.2]; // largest ones of a rod alone: from its middle, and zoom
const FACES = Array.from({ length: (ROD_RINGS - 1) * ROD_SIDES }, (_, a) => {
  const b = a % ROD_SIDES === ROD_SIDES - 1 ? a + 1 - ROD_SIDES : a + 1;
  return [a, b, a + ROD_SIDES, b, b + ROD_SIDES, a + ROD_SIDES];
}).flat();
export function makeRod(color) {
  const geometry = new THREE.BufferGeometry();
  const places = new THREE.BufferAttribute(new Float32Array(3 * ROD_RINGS * ROD_SIDES), 3);
  geometry.setAttribute("position", places);
  geometry.setIndex(FACES);
  const rod = makeMesh(
    geometry,
    makeShinyMaterial({ color, transparent: false, side: 2, shininess: 40 }),
  );
  rod.frustumCulled = false;
  rod.update = (i, scale, radius, power, isAlone) => {
    const n = simulation.fillRod(i, scale, radius, power, places.array);
    geometry.setDrawRange(0, 6 * (n - ROD_SIDES));
    const box = new THREE.Box3().setFromArray(places.array.subarray(0, 3 * n));
    const middle = isAlone ? box.getCenter(makeVector()) : makeVector();
    const far = Math.max(
      ...[box.min, box.max].flatMap((end) => end.sub(middle).toArray().map(Math.abs)),
    );
    rod.scale.setScalar(
      isAlone ? Math.min(LONE_ZOOM, LONE_REACH / far) : Math.min(1, ROD_REACH / far),
    );
    rod.position.copy(middle).multiply(rod.scale).negate();
    places.needsUpdate = true;
    geometry.computeVertexNormals();
  };
  return rod;
}

// Make the principal axes N, B, T at the fixed point, and a dot at the centre of mass.
export function makeAxes() {
  const frame = new THREE.Group();
  const colours = ["#e07a2e", "#a94fd0", "#1797a6"];
  const axes = colours.map((colour) => addPart(frame, makeArrow(colour, 0.014)));
  const dot = addPart(
    frame,
    makeMesh(BALL, makeFlatMaterial({ color: "#ffb020", depthTest: false })),
  );
  dot.scale.setScalar(0.07);
  dot.renderOrder = 11;
  frame.update = (body, zoom, length) => {
    frame.quaternion.copy(toQuaternion(body.axes));
    axes.forEach((axis, k) => axis.pointTo(...UNITS[k].clone().multiplyScalar(length)));
    dot.position.set(...body.com).multiplyScalar(zoom);
  };
  return frame;
}
