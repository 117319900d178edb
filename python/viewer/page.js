// The page's state: the scene, its undo, the clock. What happens to them goes through here.
import { kind, makeBody, methods, stage, TICKS } from "./core.js";
import { bytes, cast, complete } from "./scene.js";

const differ = (a, b) => JSON.stringify(a) !== JSON.stringify(b);
const SLICE = 2000; // steps between two looks at the watch
const MOMENT = 8; // milliseconds of a frame that stepping may take

export class Page {
  constructor(view) {
    this.view = view;
    this.past = [];
    this.running = false;
    this.listeners = [];
  }
  onChange(listener) {
    this.listeners.push(listener);
  }
  tell() {
    this.listeners.forEach((listener) => listener());
  }

  load(given, fit = true) {
    const before = this.scene;
    try {
      this.scene = complete(given);
      this.build(fit);
    } catch (error) {
      if (!before) throw error;
      this.scene = before;
      this.build(false);
      this.say(`That cannot be: ${error.message}`);
      return;
    }
    this.tell();
  }
  // The stage anew, at t = 0.
  build(fit) {
    const { scene } = this;
    const block = makeBody(scene.body);
    if (!scene.methods.length) throw new Error("there is no method in it");
    for (const [i, name] of scene.methods.entries()) {
      const method = methods.find((m) => m.name === name);
      if (!method) throw new Error(`there is no method ${name} in the page`);
      if (!method.suits(block, scene.gravity)) scene.methods[i] = "strang"; // the body became one that it is not for
    }
    this.kind = kind(block);
    stage.clear();
    this.tops = cast(scene).map((top) => ({ ...top, eps: Math.max(1, Math.round(top.eps * TICKS)) }));
    for (const top of this.tops) {
      const m = (top.side && scene.second) || scene.momentum;
      if (top.track) {
        const states = new Float64Array(bytes(top.track.states).buffer);
        stage.addTrack(block, scene.gravity, states, top.eps, top.against);
      } else {
        const method = methods.find((each) => each.name === top.method);
        const tol = top.role === "ghost" ? 1e-13 : scene.tol;
        stage.add(block, scene.gravity, scene.attitude, m, method, top.eps, tol, top.against);
      }
    }
    this.block = block;
    this.target = this.clock = 0;
    this.goal = null;
    this.failed = false;
    this.view.build(scene, this.tops, block, fit);
  }

  // A change: by hand, or by a control. The state of the moment becomes the new start.
  begin(top) {
    this.past.push(JSON.stringify(this.scene));
    if (this.past.length > 200) this.past.shift();
    if (this.clock > 0 && !this.scene.tracks.length) this.adopt(top); // a track begins where it begins
  }
  adopt(top) {
    const live = this.tops.filter((each) => !each.track && each.role !== "ghost");
    const leader = live.includes(top) && !(this.scene.second && top.side) ? top : live[0];
    const [, w, x, y, z, ...m] = stage.state(this.tops.indexOf(leader));
    Object.assign(this.scene, { attitude: [w, x, y, z], momentum: m });
    const beside = this.tops.indexOf(live.find((each) => each.side));
    if (this.scene.second) this.scene.second = Array.from(stage.state(beside).slice(5));
  }
  edit(change) {
    const scene = structuredClone(this.scene);
    change(scene);
    // A track is of another motion then.
    if (["body", "attitude", "momentum", "gravity"].some((key) => differ(scene[key], this.scene[key])))
      scene.tracks = [];
    this.load(scene, false);
  }
  replace(scene, fit = false) {
    this.begin();
    this.load(scene, fit);
  }
  undo() {
    const last = this.past.pop();
    if (!last) return;
    this.run(false);
    this.load(JSON.parse(last), true);
  }

  run(on) {
    this.goal = null;
    this.running = on && !this.over;
    this.tell();
  }
  get over() {
    return this.scene.stop !== null && this.clock >= Math.round(this.scene.stop * TICKS);
  }
  reset() {
    this.run(false);
    this.load(this.scene, false);
  }
  step() {
    this.run(false);
    const eps = Math.min(...this.tops.map((top) => top.eps));
    this.advance((Math.floor(this.clock / eps) + 1) * eps);
  }
  // To a time, over as many frames as it takes; back to the start first if it is past.
  jump(t) {
    if (!(t >= 0 && t <= 1e9)) return this.say(`${t} is no time to jump to: 0 to 1e9 are`);
    const goal = Math.round(t * TICKS);
    if (goal < this.clock) this.load(this.scene, false);
    this.run(false);
    this.goal = goal;
    this.tell();
  }
  get moving() {
    return this.running || this.goal !== null;
  }
  // What a frame does after so many seconds. The speed reached, where it is less than asked.
  frame(passed) {
    const { clock, goal } = this;
    if (goal !== null) this.advance(goal, 4 * MOMENT);
    else if (this.running) this.advance(this.target + passed * this.scene.speed * TICKS, MOMENT);
    if (goal !== null && !this.late) this.run(false);
    return this.running && this.late && (this.clock - clock) / TICKS / passed;
  }
  // On to a time in ticks, as far as so many milliseconds allow.
  advance(target, most = Infinity) {
    const end = this.scene.stop === null ? Infinity : Math.round(this.scene.stop * TICKS);
    const goal = Math.min(target, end);
    const until = performance.now() + most;
    this.target = goal;
    let before = -1;
    this.late = false;
    while (before < this.clock && !this.late) {
      before = this.clock;
      this.clock = stage.advance(goal, SLICE);
      this.late = performance.now() > until && this.clock < goal - Math.max(...this.tops.map((top) => top.eps));
    }
    if (this.late) this.target = this.clock; // time itself goes slower
    const failure = this.tops.map((_, i) => (this.tops[i].track ? "" : stage.failure(i))).find(Boolean);
    if (failure && !this.failed) this.say(`A top stopped: ${failure}`);
    this.failed = !!failure;
    if (this.over) this.run(false);
    this.view.draw();
  }
  say(words) {
    document.getElementById("words").textContent = words;
  }
}
