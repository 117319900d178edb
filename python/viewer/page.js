// The page's state: the scene, its undo, the clock. What happens to them goes through here.
import { kindOf, makeBody, measureOf, measures, methods, stage, TICKS } from "./core.js";
import { assign, bytes, chartOf, complete, topsOf } from "./scene.js";

const MOMENT = 8; // milliseconds of a frame that stepping may take
// Steps between two looks at the watch; at the least, all tops step at least once.
const [LEAST, MOST] = [8, 2000];
const MOVES = /^(body|shape|attitude|momentum|second|gravity)/; // what a track cannot follow
// These are set without beginning anew.
const GOES_ON = /^(speed|distance|stop|chart|log|corners|show)/;
const differ = (a, b) => JSON.stringify(a) !== JSON.stringify(b);

export class Page {
  past = [];
  running = false;
  tell = () => {}; // what is to be done after a change
  constructor(view) {
    this.view = view;
  }
  say(words) {
    document.getElementById("words").textContent = words;
  }

  // Shows another scene, and says whether that could be; else the one before stays.
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
    return this.scene !== before;
  }
  // Fills the stage anew, at t = 0.
  build(fit) {
    const { scene } = this;
    this.body = makeBody(scene.body);
    this.kind = kindOf(this.body);
    this.suit();
    stage.clear();
    this.tops = topsOf(scene, this.body).map((top) => ({
      ...top,
      ticks: Math.max(1, Math.round(top.step * TICKS)),
    }));
    this.tops.forEach((top) => this.enter(top));
    this.offer();
    Object.assign(this, { clock: 0, target: 0, goal: null, slice: LEAST, failures: "" });
    this.asked = this.gone = 0;
    this.view.build(this, fit);
  }
  // Methods that are not for this body give way to strang, which is for all.
  suit() {
    const { scene, body } = this;
    scene.methods.forEach((name, i) => {
      if (!methods.has(name)) throw new Error(`there is no method ${name} in the page`);
      if (methods.get(name).suits(body, scene.gravity)) return;
      scene.methods[i] = "strang";
      this.say(`${name} is not for this body: strang instead`);
    });
  }
  enter({ track, method, side, role, ticks, against }) {
    const { scene, body } = this;
    const start = (side && scene.second) || [...scene.attitude, ...scene.momentum];
    const [q, m] = [start.slice(0, 4), start.slice(4)];
    const tol = role === "ghost" ? 1e-13 : scene.tol;
    const states = track && new Float64Array(bytes(track.states).buffer);
    if (track) stage.addTrack(body, scene.gravity, states, ticks, against);
    else stage.add(body, scene.gravity, q, m, methods.get(method), ticks, tol, against);
  }
  // Measures that this body has not, as K of most, are NaN from the start: they are not offered.
  offer() {
    const now = stage.measure(0);
    this.measures = measures.filter(({ name }) => !Number.isNaN(now[name]));
    this.integrals = this.measures.filter(({ kept }) => kept);
    this.chart();
  }
  // A chart of what is not offered gives way to that of the energy.
  chart() {
    const name = chartOf(this.scene.chart, this.kind);
    this.scene.chart = this.measures.includes(measureOf(name)) ? name : "energy";
  }

  // Keeps scene and time for undo, before a change.
  keep(how) {
    this.past.push({ scene: structuredClone(this.scene), clock: this.goal ?? this.clock, ...how });
    if (this.past.length > 200) this.past.shift();
    this.say("");
  }
  // Begins a change: the state of the moment becomes the new start. Where a track stays it does
  // not, for the track begins where it begins.
  begin({ top, moves = true, ...how } = {}) {
    this.keep(how);
    if (!this.clock || (this.scene.tracks.length && !moves)) return;
    const { second } = this.scene;
    const [, w, x, y, z, ...momentum] = this.leader(second && top?.side ? null : top);
    const beside = second && this.leader(this.tops.find((each) => each.side));
    Object.assign(this.scene, {
      attitude: [w, x, y, z],
      momentum,
      second: beside && beside.slice(1),
    });
  }
  // Returns the state of a live top, or if that is none, of the first of them.
  leader(top) {
    const live = this.tops.filter((each) => !each.track && each.role !== "ghost");
    return Array.from(stage.state(this.tops.indexOf(live.includes(top) ? top : live[0])));
  }
  edit(change) {
    const scene = structuredClone(this.scene);
    change(scene);
    const changed = Object.keys(scene).filter(
      (key) => !GOES_ON.test(key) && differ(scene[key], this.scene[key]),
    );
    if (changed.some((key) => MOVES.test(key))) scene.tracks = [];
    if (changed.length && scene.name && !scene.name.endsWith(", changed"))
      scene.name += ", changed";
    return this.load(scene, false);
  }
  // Takes a scene that differs in looks alone.
  dress(scene) {
    this.scene = scene;
    this.chart();
    this.view.show(scene);
    this.tell();
  }
  // Sets what a control asks for, at a place such as "show.trace". All that a hand does to a
  // control at a time is one gesture, and taken back by one undo.
  set(place, x, gesture) {
    const change = (scene) => (assign(scene, place, x), scene);
    try {
      const wanted = complete(change(structuredClone(this.scene)));
      const goesOn = GOES_ON.test(place);
      if (goesOn && !differ(wanted, this.scene)) return;
      const fresh = !gesture || gesture !== this.gesture;
      if (fresh) goesOn ? this.keep({ goesOn }) : this.begin({ moves: MOVES.test(place) });
      this.gesture = gesture;
      if (goesOn) return this.dress(wanted);
      if (this.edit(change)) return;
      this.gesture = null;
      if (fresh) this.undo(true);
    } catch {
      const name = place.split(".").find((part) => part !== "show");
      this.say(`${name} cannot be ${Number.isNaN(x) ? "empty" : x}`);
    }
  }
  replace(scene) {
    this.begin({ fit: true, moves: false });
    if (!this.load(scene)) this.undo(true);
  }
  undo(quietly = false) {
    const { scene, clock, fit = false, goesOn } = this.past.pop() ?? {};
    if (!quietly) this.say("");
    if (!scene) return;
    if (goesOn) return this.dress(scene);
    this.run(false);
    this.load(scene, fit);
    if (clock) this.jump(clock / TICKS);
  }

  run(on) {
    this.goal = null;
    this.running = on;
    this.tell();
  }
  reset() {
    this.say("");
    this.run(false);
    this.load(this.scene, false);
  }
  step() {
    this.run(false);
    const least = Math.min(...this.tops.map((top) => top.ticks));
    this.advance((Math.floor(this.clock / least) + 1) * least);
  }
  // Goes to a time, over as many frames as it takes; by way of the start if it is past.
  jump(t) {
    if (!(t >= 0 && t <= 1e9)) return this.say(`${t} is no time to jump to: 0 to 1e9 are`);
    const goal = Math.round(t * TICKS);
    if (goal < this.clock) this.load(this.scene, false);
    this.run(false);
    this.goal = goal;
    this.tell();
  }
  // Does what a frame does after so many seconds. Returns the speed of the last half second, if it
  // is less than was asked for.
  frame(passed) {
    const { target, goal, scene } = this;
    if (goal !== null) this.advance(goal, 4 * MOMENT);
    if (goal !== null && !this.late) this.run(false);
    if (!this.running) return (this.slow = 0);
    this.advance(target + Math.min(passed, 0.1) * scene.speed * TICKS, MOMENT);
    this.asked += passed;
    this.gone += (this.target - target) / TICKS;
    if (this.asked < 0.5) return this.slow;
    const rate = this.gone / this.asked;
    this.slow = rate < 0.9 * scene.speed && rate;
    this.asked = this.gone = 0;
    return this.slow;
  }
  // Goes on to a time in ticks, as far as so many milliseconds allow.
  advance(target, most = Infinity) {
    const { stop } = this.scene;
    const end = stop === null ? Infinity : Math.round(stop * TICKS);
    this.target = Math.min(target, end);
    const until = performance.now() + most;
    const enough = this.target - Math.max(...this.tops.map((top) => top.ticks));
    let [before, now] = [-1, performance.now()];
    this.late = false;
    while (before < this.clock && !this.late) {
      before = this.clock;
      this.clock = stage.advance(this.target, this.slice);
      const took = performance.now() - now;
      this.slice = Math.max(LEAST, Math.min(MOST, this.slice * (took < 1 ? 2 : 2 / took)));
      now += took;
      this.late = (now > until && this.clock < enough) || stage.late();
    }
    if (this.late) this.target = this.clock; // time itself goes slower
    const stopped = ({ method, step, track }, i) => {
      const why = stage.failure(i);
      return why && (track ? `${method} ends` : `${method} ${step} stopped: ${why}`);
    };
    const words = this.tops.map(stopped);
    if (words.join() !== this.failures && words.some(Boolean))
      this.say(words.filter(Boolean).join("; "));
    this.failures = words.join();
    const over = target > end && !this.late;
    if (over) this.say(`The stop time ${stop} is reached`);
    if (over || this.tops.every((top, i) => words[i] || top.role === "ghost")) this.run(false);
    this.view.draw();
  }
}
