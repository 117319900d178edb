// The C core. Structures go through its memory: a kr_scene is 20 doubles (body 11, gravity, state 8), see kreisel.h.
import binary from "kreisel.wasm";

const unpacked = new Blob([binary]).stream().pipeThrough(new DecompressionStream("deflate"));
const { instance } = await WebAssembly.instantiate(await new Response(unpacked).arrayBuffer(), {});
const C = instance.exports;
C._initialize();

export const TICKS = 1e6;
const scratch = C.malloc(8 * 64); // fixed places for what goes in and out
const [SCENE, IN, IN2, IN3] = [0, 20, 32, 36].map((offset) => scratch + 8 * offset);

const doubles = (pointer, n) => new Float64Array(C.memory.buffer, pointer, n);
const put = (pointer, numbers) => (doubles(pointer, numbers.length).set(numbers), pointer);
const putScene = (block, gravity, q, m) => put(SCENE, [...block, gravity, 0, ...q, ...m]);

function text(pointer) {
  const bytes = new Uint8Array(C.memory.buffer, pointer);
  return new TextDecoder().decode(bytes.subarray(0, bytes.indexOf(0)));
}
function check(status) {
  if (status) throw new Error(text(C.kr_status_text(status)));
}

export const methods = new Map(
  Array.from({ length: C.kr_method_count() }, (_, i) => {
    const pointer = C.kr_method_at(i);
    const suits = (block, gravity) => !!C.kr_method_suits(pointer, putScene(block, gravity, [1, 0, 0, 0], [0, 0, 0]));
    const what = { adaptive: !!(C.kr_method_flags(pointer) & 4), text: text(C.kr_method_text(pointer)) };
    return [text(C.kr_method_name(pointer)), { pointer, suits, ...what }];
  }),
);

// A body as its user describes it -> kr_body: mass, moments (3), centre of mass (3), principal axes (w, x, y, z).
export function makeBody(body) {
  if (body.half) check(C.kr_body_cuboid(body.density ?? 1, put(IN, body.half), put(IN2, body.pivot), SCENE));
  else check(C.kr_body_from_tensor(body.mass, put(IN, body.inertia), put(IN3, body.com), SCENE));
  return Array.from(doubles(SCENE, 11));
}
export const kind = (block) =>
  ["general", "euler", "lagrange", "kowalewski", "goryachev_chaplygin"][C.kr_body_kind(put(SCENE, block), 1e-12)];

export const fourth = (kind) => ({ kowalewski: "K", goryachev_chaplygin: "G" })[kind]; // the integral of that name

// How a body is drawn: a cuboid with half edges, its centre seen from the fixed point, its turn in the body's frame.
export function cuboidOf(body) {
  const { half, pivot, density } = body;
  if (half) return { half, centre: pivot.map((x) => -x || 0), turn: [1, 0, 0, 0], density: density ?? 1 };
  const [a, b, c, x, y, z, ...rest] = doubles(C.kr_page_box(put(SCENE, makeBody(body))), 11);
  return { half: [a, b, c], centre: [x, y, z], turn: rest.slice(0, 4), density: rest[4] };
}

// Of the record: of each row (time, measures of 8 tops, and their extremes twice) one number.
function column(k) {
  const first = C.kr_page_row(0);
  const width = (C.kr_page_row(1) - first) / 8;
  const all = doubles(first, width * C.kr_page_rows());
  return Array.from({ length: C.kr_page_rows() }, (_, row) => all[width * row + k]);
}

const tracks = [];
const points = (n, into) => (into.set(new Float32Array(C.memory.buffer, C.kr_page_points(), 3 * n)), n);
export const stage = {
  clear() {
    C.kr_page_clear();
    for (const pointer of tracks.splice(0)) C.free(pointer);
  },
  add(block, gravity, q, m, { pointer, adaptive }, eps, tol, against) {
    check(C.kr_page_add(putScene(block, gravity, q, m), pointer, eps, adaptive ? tol : 0, against));
  },
  addTrack(block, gravity, states, eps, against) {
    const room = put(C.malloc(8 * states.length), states);
    tracks.push(room);
    const [, w, x, y, z, ...m] = states.subarray(0, 8);
    check(C.kr_page_add_track(putScene(block, gravity, [w, x, y, z], m), room, states.length / 8, eps, against));
  },
  advance: (target, most) => C.kr_page_advance(target, most),
  common: () => C.kr_page_common(),
  state: (i) => doubles(C.kr_page_state(i), 8), // t, q, m
  velocity: (i) => Array.from(doubles(C.kr_page_velocity(i), 3)),
  reach: (i) => doubles(C.kr_page_reach(i), 2), // how long momentum and velocity get
  failure: (i) => (C.kr_page_status(i) ? text(C.kr_status_text(C.kr_page_status(i))) : ""),
  way: (i, radius, into) => points(C.kr_page_way(i, radius), into),
  rod: (i, scale, radius, into) => points(C.kr_page_rod(i, scale, radius), into),
  measure: (i) => Array.from(doubles(C.kr_page_measure(i), 5)), // energy, <m,p>/g, <m,a>/|a|, K or G, frame error
  rows: () => C.kr_page_rows(),
  time: () => column(0),
  record: (i, what, kind = 0) => column(1 + 40 * kind + 5 * i + what), // 1, 2: least and greatest since the row before
};
