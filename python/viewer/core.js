// The C core as WebAssembly. Structures of kreisel.h are rows of doubles in its memory: a body has
// 30, a state 8 (t, q, m), and a scene 62 (body, gravity, start, damping, turning, shaking,
// friction, three wheels, and the gravity gradient). The file csrc/viewer/wasm.c asserts these sizes.
// A `world` has the gravity, the damping, the turning, the shaking, the friction and the gradient of
// a scene.
import { Quaternion, Vector3 } from "three";
import binary from "kreisel.wasm";

const unpacked = new Blob([binary]).stream().pipeThrough(new DecompressionStream("deflate"));
const core = await WebAssembly.compile(await new Response(unpacked).arrayBuffer());
let C; // the functions of the instance in use
// Use a new instance. Return the address of its scratch memory, which is the same in each.
function startInstance() {
  C = new WebAssembly.Instance(core).exports;
  C._initialize();
  return C.malloc(8 * 99);
}
// Fixed addresses for arguments and results: one scene and three small arrays.
const scratch = startInstance();
const [SCENE, FIRST, SECOND, THIRD] = [0, 63, 75, 79].map((offset) => scratch + 8 * offset);

const viewDoubles = (pointer, n) => new Float64Array(C.memory.buffer, pointer, n);
const writeDoubles = (pointer, numbers) => (
  viewDoubles(pointer, numbers.length).set(numbers),
  pointer
);
const NOT_GIVEN = Array(15).fill(0); // the numbers along the principal axes are those of the user
const writeBody = ({ mass, moments, com, axes, rotor }) =>
  writeDoubles(SCENE, [mass, ...moments, ...com, ...axes, 0, ...rotor, ...NOT_GIVEN]);
const NO_WHEELS = Array(12).fill(0); // a wheel on a free axle is part of the rotor
function writeScene(body, { gravity, damping, turning, shaking, friction, gradient }, q, m) {
  const support = [damping, damping, damping, ...turning, ...(shaking ?? [0, 0, 0]), friction];
  support.push(...NO_WHEELS, gradient ?? 0);
  writeDoubles(writeBody(body) + 8 * 30, [gravity, 0, ...q, ...m, ...support]);
  return SCENE;
}
// Call `work` with an empty simulation, beside that of the viewer.
export function computeApart(work) {
  const inUse = C;
  try {
    startInstance();
    return work();
  } finally {
    C = inUse;
  }
}
const CUBOID = 0; // KR_SHAPE_CUBOID
const makeList = (length, makeItem) => Array.from({ length }, (_, i) => makeItem(i));

function readText(pointer) {
  const bytes = new Uint8Array(C.memory.buffer, pointer);
  return new TextDecoder().decode(bytes.subarray(0, bytes.indexOf(0)));
}
function checkStatus(status) {
  if (status) throw new Error(readText(C.kr_status_text(status)));
}

export const TICKS = C.kr_page_ticks(); // per unit of time
export const MAX_TOPS = C.kr_page_tops(); // in one simulation
export const TRACE_POINTS = C.kr_page_way_points();
export const [ROD_RINGS, ROD_SIDES] = [C.kr_page_rod_rings(), C.kr_page_rod_sides()];

const methodPointers = [];
for (let pointer; (pointer = C.kr_method_at(methodPointers.length));) methodPointers.push(pointer);
export const methods = new Map(
  methodPointers.map((pointer) => {
    const name = readText(C.kr_page_method_name(pointer));
    const isAdaptive = !!C.kr_page_adaptive(pointer);
    // The simulation restarts the method after each step.
    const isRestarting = !!C.kr_page_restarts(pointer);
    const isSuitable = (body, world) =>
      !!C.kr_method_suits(pointer, writeScene(body, world, [1, 0, 0, 0], [0, 0, 0]));
    return [
      name,
      {
        pointer,
        isAdaptive,
        isRestarting,
        isSuitable,
        description: readText(C.kr_page_method_text(pointer)),
      },
    ];
  }),
);

// Measures of a top: quantities of its state, the attitude error "error" against another top, and
// "modified_energy", which only one method conserves.
export const measures = makeList(C.kr_page_measures(), (number) => ({
  number,
  name: readText(C.kr_page_measure_name(number)),
  description: readText(C.kr_page_measure_text(number)),
  isConserved: !!C.kr_page_measure_kept(number),
}));
export const findMeasure = (name) => measures.find((measure) => measure.name === name);

const turnBack = ([w, x, y, z], v) =>
  new Vector3(...v).applyQuaternion(new Quaternion(-x, -y, -z, w)).toArray();
// Build a body in principal axes from a body as its user describes it, from the momentum of its rotor
// in the same frame, and from the moment of a wheel on a free axle, which does not take part in the
// rotation of the body about this axle.
export function makeBody(body, rotor = [0, 0, 0], wheel = [0, 0, 0]) {
  const { half, pivot, density = 1, mass, inertia, com } = body;
  if (half) {
    const [edges, centre] = [writeDoubles(FIRST, half), writeDoubles(SECOND, pivot)];
    const all = C.kr_shape_mass(CUBOID, edges, density);
    checkStatus(C.kr_body_shape(CUBOID, edges, all, centre, SCENE));
  } else {
    const [tensor, centre] = [writeDoubles(FIRST, inertia), writeDoubles(THIRD, com)];
    checkStatus(C.kr_body_from_tensor(mass, tensor, centre, 0, SCENE));
  }
  const [own, ...row] = Array.from(viewDoubles(SCENE, 11));
  const axes = row.slice(6, 10);
  const along = turnBack(axes, rotor);
  const made = { mass: own, moments: row.slice(0, 3), com: row.slice(3, 6), axes, rotor: along };
  const about = Math.hypot(...wheel);
  if (!about) return made;
  const rest = computeTensor(made).map(
    (x, i) => x - (wheel[i % 3] * wheel[Math.floor(i / 3)]) / about,
  );
  const [w, ...vector] = axes;
  const described = turnBack([w, ...vector.map((x) => -x)], made.com);
  return makeBody({ mass: own, inertia: rest, com: described }, rotor);
}
// Compute the inertia tensor in the frame of description, by rows.
export function computeTensor({ moments, axes: [w, x, y, z] }) {
  const turn = new Quaternion(x, y, z, w);
  const columns = [0, 1, 2].map((k) =>
    new Vector3().setComponent(k, 1).applyQuaternion(turn).toArray(),
  );
  const sum = (i, j) => columns.reduce((all, axis, k) => all + moments[k] * axis[i] * axis[j], 0);
  return makeList(9, (i) => sum(Math.floor(i / 3), i % 3));
}
// Compute the angular velocity as seen from the support, the direction of the centre of mass and the
// kinetic energy of a start.
export function measureStart(body, world, q, m) {
  const scene = writeScene(body, world, q, m);
  const start = scene + 8 * 31;
  C.kr_state_velocity(FIRST, scene, start);
  C.kr_state_apex(SECOND, scene, start);
  const [velocity, apex] = [FIRST, SECOND].map((pointer) => Array.from(viewDoubles(pointer, 3)));
  return { velocity, apex, kinetic: C.kr_state_kinetic(scene, start) };
}
// Compute the momentum of a start from its angular velocity as seen from the support.
export function computeMomentum(body, world, q, velocity) {
  const scene = writeScene(body, world, q, [0, 0, 0]);
  C.kr_scene_set_velocity(scene, writeDoubles(FIRST, velocity));
  return Array.from(viewDoubles(scene + 8 * 36, 3));
}
// Compute the steady precession of a symmetric top from spin and tilt of its third axis, as seen
// from the inertial frame.
export function computeSteadyPrecession(body, world, spin, tilt, isFast) {
  const scene = writeScene({ ...body, rotor: [0, 0, 0] }, world, [1, 0, 0, 0], [0, 0, 0]);
  const [x, y, z] = body.com;
  // The core knows no rotor, and measures from the apex, which a hanging top has on the other side.
  const axial = spin + body.rotor[2] / body.moments[2];
  const isAside = Math.max(Math.abs(x), Math.abs(y)) > 1e-9 * Math.abs(z);
  const given = z < 0 ? [-axial, Math.PI - tilt] : [axial, tilt];
  if (isAside || C.kr_scene_steady_precession(scene, ...given, isFast, FIRST, SECOND))
    throw new Error("there is no steady precession at this tilt and spin");
  return viewDoubles(FIRST, 1)[0];
}
export const findKind = (body) => readText(C.kr_page_kind(writeBody(body)));

// Compute the limits of the tilt, the mean precession, the period, the critical spin and the spin
// of a symmetric top. Returns null for other bodies, for tops with damping or friction, in a gravity
// gradient, and if the support is shaken or turns about another axis. On a support that turns about
// the vertical the precession is that seen from the support, and the type of motion "".
export function computeLimits(body, world, q, m) {
  const [x, y, about] = world.turning;
  const pointer = C.kr_page_limits(writeScene(body, { ...world, turning: [0, 0, 0] }, q, m));
  if (!pointer || x || y || world.shaking?.[0] || world.gradient) return null;
  const [least, greatest, critical, precession, period, spin] = viewDoubles(pointer, 6);
  const motionType = about ? "" : readText(C.kr_page_course(SCENE));
  const seen = about && !world.gravity ? NaN : precession - about; // a free body turns about m
  return { least, greatest, critical, precession: seen, period, spin, motionType };
}

// Compute the cuboid that represents a body: half edges, centre seen from the fixed point, and its
// rotation in the frame of description.
export function computeCuboid(body) {
  const { half, pivot, density = 1 } = body;
  if (half) return { half, centre: pivot.map((x) => -x || 0), turn: [1, 0, 0, 0], density };
  const row = Array.from(viewDoubles(C.kr_page_box(writeBody(makeBody(body))), 11));
  return {
    half: row.slice(0, 3),
    centre: row.slice(3, 6),
    turn: row.slice(6, 10),
    density: row[10],
  };
}

// Read one number from each row of the record. `first` is its address in the first row.
function readColumn(first) {
  const [rows, width] = [C.kr_page_rows(), C.kr_page_row_doubles()];
  const all = viewDoubles(first, rows && width * (rows - 1) + 1);
  return makeList(rows, (row) => all[width * row]);
}

const tracks = [];
function copyPoints(n, into) {
  into.set(new Float32Array(C.memory.buffer, C.kr_page_points(), 3 * n));
  return n;
}
export const simulation = {
  clear() {
    C.kr_page_clear();
    for (const pointer of tracks.splice(0)) C.free(pointer);
  },
  addTop(body, world, q, m, { pointer, isAdaptive }, step, tol, comparedWith) {
    const scene = writeScene(body, world, q, m);
    checkStatus(C.kr_page_add(scene, pointer, step, isAdaptive ? tol : 0, comparedWith));
  },
  // Let the last top end where its nutation exceeds an angle, at which its rim meets the floor.
  setFloor: (angle) => C.kr_page_set_floor(Math.cos(angle)),
  // Return the time at which the rim of a top met the floor, or NaN.
  getEnd: (i) => C.kr_page_stood(i),
  hasEnded: (i) => C.kr_page_status(i) !== 0 || !Number.isNaN(C.kr_page_stood(i)),
  addTrack(body, world, states, step, comparedWith) {
    const room = writeDoubles(C.malloc(8 * states.length), states);
    tracks.push(room);
    const [, w, x, y, z, ...m] = states.subarray(0, 8);
    const scene = writeScene(body, world, [w, x, y, z], m);
    checkStatus(C.kr_page_add_track(scene, room, states.length / 8, step, comparedWith));
  },
  advance: (target, most) => C.kr_page_advance(target, most),
  isLate: () => C.kr_page_late() !== 0, // whether a top needs more calls to finish its step
  getCommonStep: () => C.kr_page_common(),
  getState: (i) => viewDoubles(C.kr_page_state(i), 8), // t, q, m
  getVelocity: (i) => Array.from(viewDoubles(C.kr_page_velocity(i), 3)),
  getReach: (i) => viewDoubles(C.kr_page_reach(i), 2), // largest possible |m| and |w|
  getFailure: (i) => (C.kr_page_status(i) ? readText(C.kr_status_text(C.kr_page_status(i))) : ""),
  fillTrace: (i, radius, into) => copyPoints(C.kr_page_way(i, radius), into),
  fillMomentumTrace: (i, scale, into) => copyPoints(C.kr_page_momentum_way(i, scale), into),
  fillRod: (i, scale, radius, power, into) =>
    copyPoints(C.kr_page_rod(i, scale, radius, power), into),
  // Return the current measures of top `i` by name. NaN means undefined.
  measureTop(i) {
    const now = viewDoubles(C.kr_page_measure(i), measures.length);
    return Object.fromEntries(measures.map(({ name, number }) => [name, now[number]]));
  },
  countRows: () => C.kr_page_rows(),
  getTimes: () => readColumn(C.kr_page_times()),
  // Return the recorded values of a measure. `side` -1 and 1 select the least and the greatest
  // value since the previous row.
  getRecord: (i, name, side = 0) => readColumn(C.kr_page_record(i, findMeasure(name).number, side)),
};
