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

function text(pointer) {
  const bytes = new Uint8Array(C.memory.buffer, pointer);
  return new TextDecoder().decode(bytes.subarray(0, bytes.indexOf(0)));
}
function check(status) {
  if (status) throw new Error(text(C.kr_status_text(status)));
}

export const version = text(C.kr_version());

export const methods = Array.from({ length: C.kr_method_count() }, (_, i) => {
  const pointer = C.kr_method_at(i);
  const flags = C.kr_method_flags(pointer);
  return {
    pointer,
    name: text(C.kr_method_name(pointer)),
    text: text(C.kr_method_text(pointer)),
    adaptive: !!(flags & 4),
    suits: (block, gravity) => !!C.kr_method_suits(pointer, put(SCENE, [...block, gravity, 0, 1, 0, 0, 0, 0, 0, 0])),
  };
});

// A body as its user describes it -> kr_body: mass, moments (3), centre of mass (3), principal axes (w, x, y, z).
export function makeBody(body) {
  if (body.half) check(C.kr_body_cuboid(body.density ?? 1, put(IN, body.half), put(IN2, body.pivot), SCENE));
  else check(C.kr_body_from_tensor(body.mass, put(IN, body.inertia), put(IN3, body.com), SCENE));
  return Array.from(doubles(SCENE, 11));
}
export const kind = (block) =>
  ["general", "euler", "lagrange", "kowalewski", "goryachev_chaplygin"][C.kr_body_kind(put(SCENE, block), 1e-12)];

export function velocity(block, gravity, q, m) {
  put(SCENE, [...block, gravity, 0, ...q, ...m]);
  C.kr_state_velocity(IN, SCENE, SCENE + 8 * 12);
  return Array.from(doubles(IN, 3));
}

const tracks = [];
export const stage = {
  clear() {
    C.kr_page_clear();
    for (const pointer of tracks.splice(0)) C.free(pointer);
  },
  add(block, gravity, q, m, method, eps, tol, against) {
    put(SCENE, [...block, gravity, 0, ...q, ...m]);
    check(C.kr_page_add(SCENE, method.pointer, eps, method.adaptive ? tol : 0, against));
  },
  addTrack(block, gravity, states, eps, against) {
    const room = C.malloc(8 * states.length);
    tracks.push(room);
    put(room, states);
    put(SCENE, [...block, gravity, ...states.subarray(0, 8)]);
    check(C.kr_page_add_track(SCENE, room, states.length / 8, eps, against));
  },
  advance: (target, most) => C.kr_page_advance(target, most),
  common: () => C.kr_page_common(),
  state: (i) => doubles(C.kr_page_state(i), 8), // t, q, m
  failure: (i) => (C.kr_page_status(i) ? text(C.kr_status_text(C.kr_page_status(i))) : ""),
  steps: (i) => C.kr_page_steps(i),
  trace: (i) => doubles(C.kr_page_trace(i), 4 * C.kr_page_trace_size()),
  measure: (i) => Array.from(doubles(C.kr_page_measure(i), 5)), // energy, <m,p>/g, <m,a>/|a|, K or G, frame error
  rows: () => C.kr_page_rows(),
  time: () => doubles(C.kr_page_time(), C.kr_page_rows()),
  record(i, what) {
    const width = C.kr_page_record_width();
    const all = doubles(C.kr_page_record(), width * C.kr_page_rows());
    return Array.from({ length: C.kr_page_rows() }, (_, row) => all[row * width + 5 * i + what]);
  },
};
