// The page's state: the scene, its undo, the clock. What happens to them goes through here.
import { kind, makeBody, methods, stage, TICKS } from "./core.js";
import { bytes, cast, complete, take } from "./scene.js";

const SLICE = 2000; // steps between two looks at the watch
const MOMENT = 8; // milliseconds of a frame that stepping may take
const GOES_ON = /^(speed|distance|stop|chart|show)/; // what is set without beginning anew

export class Page {
  constructor(view) {
    this.view = view;
    this.past = [];
    this.running = false;
    this.tell = () => {}; // what is to be done after a change
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
    }
    this.tell();
  }
  // The stage anew, at t = 0.
  build(fit) {
    const { scene } = this;
    const { gravity } = scene;
    this.block = makeBody(scene.body);
    this.kind = kind(this.block);
    for (const [i, name] of scene.methods.entries()) {
      if (!methods.has(name)) throw new Error(`there is no method ${name} in the page`);
      if (!methods.get(name).suits(this.block, gravity)) scene.methods[i] = "strang"; // the body became another
    }
    stage.clear();
    this.tops = cast(scene, this.block).map((top) => ({ ...top, ticks: Math.max(1, Math.round(top.eps * TICKS)) }));
    for (const { track, method, side, role, ticks, against } of this.tops) {
      const m = (side && scene.second) || scene.momentum;
      const tol = role === "ghost" ? 1e-13 : scene.tol;
      if (track) stage.addTrack(this.block, gravity, new Float64Array(bytes(track.states).buffer), ticks, against);
      else stage.add(this.block, gravity, scene.attitude, m, methods.get(method), ticks, tol, against);
    }
    this.target = this.clock = 0;
    this.goal = null;
    this.failed = false;
    this.view.build(this, fit);
  }

  // Before a change: the scene is kept for undo, and the state of the moment becomes the new start.
  begin(top) {
    this.past.push(JSON.stringify(this.scene));
    if (this.past.length > 200) this.past.shift();
    if (this.clock > 0 && !this.scene.tracks.length) this.adopt(top); // a track begins where it begins
  }
  adopt(top) {
    const live = this.tops.filter((each) => !each.track && each.role !== "ghost");
    const leader = live.includes(top) && !(this.scene.second && top.side) ? top : live[0];
    const [, w, x, y, z, ...momentum] = stage.state(this.tops.indexOf(leader));
    const beside = this.tops.indexOf(live.find((each) => each.side));
    const second = this.scene.second && Array.from(stage.state(beside).slice(5));
    this.scene = { ...this.scene, attitude: [w, x, y, z], momentum, second };
  }
  edit(change) {
    const scene = structuredClone(this.scene);
    change(scene);
    const differs = (key) => JSON.stringify(scene[key]) !== JSON.stringify(this.scene[key]);
    if (["body", "attitude", "momentum", "gravity"].some(differs)) scene.tracks = []; // they are of another motion
    this.load(scene, false);
  }
  // What a control sets, at a place such as "show.trace". One undo for all that a hand does to it at a time.
  set(place, x, gesture) {
    const { scene, past } = this;
    const depth = past.length;
    try {
      if (GOES_ON.test(place)) {
        take(scene, place, x);
        this.view.show(scene);
        return this.tell();
      }
      if (!gesture || gesture !== this.gesture) this.begin();
      this.gesture = gesture;
      this.edit((next) => take(next, place, x));
    } catch (error) {
      past.length = depth;
      this.scene = scene;
      this.say(error.message);
    }
  }
  replace(scene, fit = false) {
    this.begin();
    this.load(scene, fit);
  }
  undo() {
    const last = this.past.pop();
    if (!last) return;
    this.run(false);
    this.load(JSON.parse(last));
  }

  run(on) {
    this.goal = null;
    this.running = on && !this.over;
    this.tell();
  }
  get over() {
    return this.clock >= this.end;
  }
  get end() {
    return this.scene.stop === null ? Infinity : Math.round(this.scene.stop * TICKS);
  }
  get moving() {
    return this.running || this.goal !== null;
  }
  reset() {
    this.run(false);
    this.load(this.scene, false);
  }
  step() {
    this.run(false);
    const eps = Math.min(...this.tops.map((top) => top.ticks));
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
    this.target = Math.min(target, this.end);
    const until = performance.now() + most;
    const enough = this.target - Math.max(...this.tops.map((top) => top.ticks));
    let before = -1;
    this.late = false;
    while (before < this.clock && !this.late) {
      before = this.clock;
      this.clock = stage.advance(this.target, SLICE);
      this.late = performance.now() > until && this.clock < enough;
    }
    if (this.late) this.target = this.clock; // time itself goes slower
    const failure = this.tops.map((top, i) => (top.track ? "" : stage.failure(i))).find(Boolean);
    if (failure && !this.failed) this.say(`A top stopped: ${failure}`);
    this.failed = !!failure;
    if (this.over) this.run(false);
    this.view.draw();
  }
  say(words) {
    document.getElementById("words").textContent = words;
  }
}
