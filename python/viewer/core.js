// The C core as WebAssembly. Structures of kreisel.h go through its memory as rows of doubles: a
// body has 12, a state 8 (t, q, m), a scene 24 (body, gravity, start, damping), as csrc/viewer/wasm.c
// asserts.
import binary from "kreisel.wasm";

const unpacked = new Blob([binary]).stream().pipeThrough(new DecompressionStream("deflate"));
const { instance } = await WebAssembly.instantiate(await new Response(unpacked).arrayBuffer(), {});
const C = instance.exports;
C._initialize();

// Fixed places for what goes in and out: a scene, and three arguments.
const scratch = C.malloc(8 * 64);
const [SCENE, FIRST, SECOND, THIRD] = [0, 24, 36, 40].map((offset) => scratch + 8 * offset);

const doubles = (pointer, n) => new Float64Array(C.memory.buffer, pointer, n);
const put = (pointer, numbers) => (doubles(pointer, numbers.length).set(numbers), pointer);
const putBody = ({ mass, moments, com, axes }) =>
  put(SCENE, [mass, ...moments, ...com, ...axes, 0]);
function putScene(body, gravity, q, m) {
  put(putBody(body) + 8 * 12, [gravity, 0, ...q, ...m, 0, 0, 0]);
  return SCENE;
}
const list = (length, made) => Array.from({ length }, (_, i) => made(i));

function text(pointer) {
  const bytes = new Uint8Array(C.memory.buffer, pointer);
  return new TextDecoder().decode(bytes.subarray(0, bytes.indexOf(0)));
}
function check(status) {
  if (status) throw new Error(text(C.kr_status_text(status)));
}

export const TICKS = C.kr_page_ticks(); // to the unit of time
export const TOPS = C.kr_page_tops(); // that a stage has room for
export const WAY_POINTS = C.kr_page_way_points();
export const [ROD_RINGS, ROD_SIDES] = [C.kr_page_rod_rings(), C.kr_page_rod_sides()];

export const methods = new Map(
  list(C.kr_method_count(), (i) => {
    const pointer = C.kr_method_at(i);
    const name = text(C.kr_method_name(pointer));
    const adaptive = !!C.kr_page_adaptive(pointer);
    const restarts = !!C.kr_page_restarts(pointer); // the stage starts it again after each step
    const suits = (body, gravity) =>
      !!C.kr_method_suits(pointer, putScene(body, gravity, [1, 0, 0, 0], [0, 0, 0]));
    return [name, { pointer, adaptive, restarts, suits, text: text(C.kr_method_text(pointer)) }];
  }),
);

// These are measured of a top: quantities of its state, integrals among them (`kept`), the frame
// error against another top, "error", and "modified_energy", which one method keeps.
export const measures = list(C.kr_page_measures(), (number) => ({
  number,
  name: text(C.kr_page_measure_name(number)),
  text: text(C.kr_page_measure_text(number)),
  kept: !!C.kr_page_measure_kept(number),
}));
export const measureOf = (name) => measures.find((measure) => measure.name === name);

// Makes the core's body of one as its user describes it.
export function makeBody(body) {
  const { half, pivot, density = 1, mass, inertia, com } = body;
  if (half) check(C.kr_body_cuboid(density, put(FIRST, half), put(SECOND, pivot), SCENE));
  else check(C.kr_body_from_tensor(mass, put(FIRST, inertia), put(THIRD, com), SCENE));
  const [own, ...row] = Array.from(doubles(SCENE, 11));
  return { mass: own, moments: row.slice(0, 3), com: row.slice(3, 6), axes: row.slice(6, 10) };
}
export const kindOf = (body) => text(C.kr_page_kind(putBody(body)));

// Tells how the axis of a symmetric top moves from a start on: between which nutations, how fast
// about the vertical on the mean, with what period, beyond which spin it would sleep, and its own
// spin at the start. null for other tops.
export function limitsOf(body, gravity, q, m) {
  const told = C.kr_page_limits(putScene(body, gravity, q, m));
  if (!told) return null;
  const [least, greatest, critical, precession, period, spin] = doubles(told, 6);
  const course = text(C.kr_page_course(SCENE));
  return { least, greatest, critical, precession, period, spin, course };
}

// Finds the cuboid as which a body is drawn: its half edges, its centre seen from the fixed point,
// its turn in the frame in which the body was described.
export function cuboidOf(body) {
  const { half, pivot, density = 1 } = body;
  if (half) return { half, centre: pivot.map((x) => -x || 0), turn: [1, 0, 0, 0], density };
  const row = Array.from(doubles(C.kr_page_box(putBody(makeBody(body))), 11));
  return {
    half: row.slice(0, 3),
    centre: row.slice(3, 6),
    turn: row.slice(6, 10),
    density: row[10],
  };
}

// Reads one number of each row of the record, from its place in the first row.
function column(first) {
  const [rows, width] = [C.kr_page_rows(), C.kr_page_row_doubles()];
  const all = doubles(first, rows && width * (rows - 1) + 1);
  return list(rows, (row) => all[width * row]);
}

const tracks = [];
function points(n, into) {
  into.set(new Float32Array(C.memory.buffer, C.kr_page_points(), 3 * n));
  return n;
}
export const stage = {
  clear() {
    C.kr_page_clear();
    for (const pointer of tracks.splice(0)) C.free(pointer);
  },
  add(body, gravity, q, m, { pointer, adaptive }, step, tol, against) {
    const scene = putScene(body, gravity, q, m);
    check(C.kr_page_add(scene, pointer, step, adaptive ? tol : 0, against));
  },
  addTrack(body, gravity, states, step, against) {
    const room = put(C.malloc(8 * states.length), states);
    tracks.push(room);
    const [, w, x, y, z, ...m] = states.subarray(0, 8);
    const scene = putScene(body, gravity, [w, x, y, z], m);
    check(C.kr_page_add_track(scene, room, states.length / 8, step, against));
  },
  advance: (target, most) => C.kr_page_advance(target, most),
  late: () => C.kr_page_late() !== 0, // whether a top is too fast to have come to its next step
  common: () => C.kr_page_common(),
  state: (i) => doubles(C.kr_page_state(i), 8), // t, q, m
  velocity: (i) => Array.from(doubles(C.kr_page_velocity(i), 3)),
  reach: (i) => doubles(C.kr_page_reach(i), 2), // how long momentum and velocity get
  failure: (i) => (C.kr_page_status(i) ? text(C.kr_status_text(C.kr_page_status(i))) : ""),
  way: (i, radius, into) => points(C.kr_page_way(i, radius), into),
  rod: (i, scale, radius, power, into) =>
    points(C.kr_page_rod(i, scale, radius, power), into),
  // Returns what is measured of top i now, by name; NaN is not to be had.
  measure(i) {
    const now = doubles(C.kr_page_measure(i), measures.length);
    return Object.fromEntries(measures.map(({ name, number }) => [name, now[number]]));
  },
  rows: () => C.kr_page_rows(),
  time: () => column(C.kr_page_times()),
  // Returns a measure of top i on its way; for `side` -1 and 1 its least and its greatest since the
  // row before.
  record: (i, name, side = 0) => column(C.kr_page_record(i, measureOf(name).number, side)),
};
