// The page's state: the scene, its undo, the clock. What happens to them goes through here. Initial
// data are sacred: what only computes begins again from the same start and goes on to the same
// time; a hand that moves the top takes the state of the moment as the start, and that is told.
import { kindOf, limitsOf, makeBody, measureOf, measures, methods } from "./core.js";
import { stage, TICKS, TOPS } from "./core.js";
import { assign, meeting, nameOf } from "./rules.js";
import { bytes, chartOf, complete, rangeOf, topsOf } from "./scene.js";

const MOMENT = 8; // milliseconds of a frame that stepping may take
// Steps between two looks at the watch; at the least, all tops step once.
const [LEAST, MOST] = [TOPS, 2000];
const MOVES = /^(body|shape|attitude|momentum|second|gravity|taken)/; // what a track cannot follow
// These are set without beginning anew.
const GOES_ON = /^(speed|distance|stop|chart|integral|log|shown|corners|show)/;
const COMPUTES = /^(methods|step|both|own|tol|ghost)/; // the motion stays, and its time
const OF_NOW = /^(momentum|tilt|spin)/; // read off the moment, and set in it
const differ = (a, b) => JSON.stringify(a) !== JSON.stringify(b);

export class Page {
  past = []; // for undo
  future = []; // for redo
  before = null; // the charts and traces of the motion before a push, see `push`
  running = false;
  tell = () => {}; // what is to be done after a change
  constructor(view) {
    this.view = view;
  }
  say(words) {
    document.getElementById("words").textContent = words;
  }

  // Shows another scene, and says whether that could be; else the one before stays. With `fit` it
  // is one from outside, to which Reset leads back.
  load(given, fit = true) {
    const before = this.scene;
    try {
      this.scene = complete(given);
      this.keepBefore();
      this.build(fit);
      if (fit) this.origin = structuredClone(this.scene);
    } catch (error) {
      if (!before) throw error;
      Object.assign(this, { scene: before, before: null });
      this.build(false);
      this.say(`This cannot be: ${error.message}`);
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
    const cast = topsOf(scene, this.body).map((top) => ({
      ...top,
      ticks: Math.max(1, Math.round(top.step * TICKS)),
    }));
    cast.forEach((top) => this.enter(top));
    this.tops = cast.filter(({ role }) => role !== "truth");
    this.truth = cast.at(-1).method;
    this.offer();
    this.meet();
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
      this.say(`${name} does not apply to this body: strang is used instead`);
    });
  }
  enter(top) {
    const { track, method, side, role, ticks, against } = top;
    const { scene, body } = this;
    const { second } = scene;
    const start = (side === 1 && !track && second) || [...scene.attitude, ...scene.momentum];
    const [q, m] = [start.slice(0, 4), start.slice(4)];
    const tol = role === "ghost" || role === "truth" ? 1e-15 : scene.tol;
    top.limits = limitsOf(body, scene.gravity, q, m);
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
    const { scene } = this;
    const among = (offered, name) => (offered.includes(measureOf(name)) ? name : "energy");
    scene.chart = among(this.measures, chartOf(scene.chart, this.kind));
    scene.integral = among(this.integrals, chartOf(scene.integral, this.kind));
  }
  // The stop time is one at which all steps meet, whatever becomes of the steps.
  meet() {
    const { stop } = this.scene;
    if (stop === null || meeting(stop) === stop) return;
    this.scene.stop = meeting(stop);
    this.say(`The stop time is now ${this.scene.stop}, where all steps meet`);
  }

  // Keeps scene and time for undo, before a change.
  keep(how) {
    this.past.push(this.moment(how));
    if (this.past.length > 200) this.past.shift();
    [this.undone, this.future] = [this.future, []];
    this.say("");
  }
  // Returns scene and time of now, to come back to.
  moment(how) {
    const { origin, goal, clock } = this;
    return { scene: structuredClone(this.scene), origin, clock: goal ?? clock, ...how };
  }
  // Begins a change; with `now` one of the moment, whose state becomes the start.
  begin({ top, now = true, ...how } = {}) {
    this.keep(how);
    if (!this.clock || !now) return;
    const { second } = this.scene;
    const [, w, x, y, z, ...momentum] = this.leader(second && top?.side ? null : top);
    const beside = second && this.leader(this.tops.find((each) => each.side)).slice(1);
    const taken = this.clock / TICKS;
    Object.assign(this.scene, { attitude: [w, x, y, z], momentum, second: beside, taken });
    this.rename(this.scene);
  }
  // Begins another motion by a change of the momentum of a top. The charts and the traces of the
  // motion until now stay in sight.
  push(top, change) {
    const before = this.clock ? this.seen() : null;
    this.begin({ top });
    this.before = before;
    this.edit(change);
    this.run(true);
  }
  // Returns what charts and traces show now.
  seen() {
    const names = [this.scene.chart, this.scene.integral, "error"];
    const rows = (i, name) => [-1, 0, 1].map((side) => stage.record(i, name, side));
    const lines = (name) => [name, this.tops.map((_, i) => rows(i, name))];
    return {
      time: stage.time(),
      lines: Object.fromEntries(names.map(lines)),
      ways: this.tops.map((_, i) => this.view.wayOf(i)),
      end: this.clock / TICKS,
    };
  }
  // Drops what is kept of the motion before a push, if the scene is another one than the push made.
  keepBefore() {
    if (!this.before) return;
    const kept = Object.entries(this.scene).filter(([key]) => !GOES_ON.test(key));
    const scene = JSON.stringify(kept);
    this.before.scene ??= scene;
    if (this.before.scene !== scene) this.before = null;
  }
  // What was said of a scene may not hold for one that was changed.
  rename(scene) {
    if (scene.name && !scene.name.endsWith(", changed")) scene.name += ", changed";
    scene.about = "";
  }
  // Returns the number of a live top, or if that is none, of the first of them; and its state.
  lead(top) {
    const live = this.tops.filter((each) => !each.track && each.role !== "ghost");
    return this.tops.indexOf(live.includes(top) ? top : live[0]);
  }
  leader(top) {
    return Array.from(stage.state(this.lead(top)));
  }
  edit(change) {
    const scene = structuredClone(this.scene);
    change(scene);
    const changed = Object.keys(scene).filter(
      (key) => !GOES_ON.test(key) && differ(scene[key], this.scene[key]),
    );
    const isLost = scene.tracks.length > 0 && changed.some((key) => MOVES.test(key));
    if (isLost) scene.tracks = [];
    if (changed.length) this.rename(scene);
    const done = this.load(scene, false);
    if (done && isLost)
      this.say("The path belonged to another motion and is removed. Undo brings it back");
    return done;
  }
  // Takes the state of the moment as the start.
  take() {
    if (!this.clock) return;
    this.begin();
    this.edit((scene) => (scene.tracks = []));
  }
  // Takes a scene that differs in looks alone.
  dress(scene) {
    const isOther = scene.show.solid !== this.scene.show.solid;
    this.scene = scene;
    this.chart();
    if (isOther) this.view.build(this, false);
    else this.view.show(scene);
    this.tell();
  }
  // Sets what a control asks for, at a place such as "show.trace", and returns why it cannot be.
  // All that a hand does to a control at a time is one gesture, and taken back by one undo.
  set(place, x, gesture) {
    const change = (scene) => (assign(scene, place, x), scene);
    const fresh = !gesture || gesture !== this.gesture;
    try {
      const wanted = complete(change(structuredClone(this.scene)));
      if (GOES_ON.test(place)) {
        if (!differ(wanted, this.scene)) return "";
        if (fresh) this.keep({ goesOn: true });
        this.gesture = gesture;
        this.dress(wanted);
        return "";
      }
    } catch ({ message }) {
      return this.refuse(place, x, message);
    }
    const time = this.goal ?? this.clock;
    const goesOn = this.running || this.resume;
    if (fresh) this.begin({ now: OF_NOW.test(place) });
    this.gesture = gesture;
    if (this.edit(change)) {
      if (COMPUTES.test(place) && time) this.goTo(time, goesOn);
      return "";
    }
    this.gesture = null;
    if (fresh) this.undo(true);
    return document.getElementById("words").textContent;
  }
  refuse(place, x, message) {
    const [range, value] = [rangeOf(place), Number.isNaN(x) ? "empty" : x];
    const own = `${nameOf(place)} cannot be ${value}${range ? `: ${range}` : ""}`;
    const words = /^[A-Z].* cannot be/.test(message) ? message : own;
    this.say(words);
    return words;
  }
  replace(scene) {
    this.keep({ fit: true });
    if (!this.load(scene)) this.undo(true);
  }
  // Takes back the last change; `quietly` one that could not be, as if it had never been tried.
  undo(quietly = false) {
    if (!quietly) return this.comeBack(this.past, this.future);
    this.comeBack(this.past, [], true);
    this.future = this.undone;
  }
  redo() {
    this.comeBack(this.future, this.past);
  }
  comeBack(from, other, quietly = false) {
    const { scene, origin, clock, fit = false, goesOn } = from.pop() ?? {};
    if (!quietly) this.say("");
    if (!scene) return;
    other.push(this.moment({ fit, goesOn }));
    if (goesOn) return this.dress(scene);
    this.run(false);
    this.load(scene, fit);
    this.origin = origin;
    if (clock) this.goTo(clock);
  }

  run(on) {
    Object.assign(this, { goal: null, resume: false, running: on });
    this.tell();
  }
  // Goes back to the start, as it is now.
  restart() {
    this.say("");
    this.load(this.scene, false);
  }
  // Goes back to the scene as it came.
  reset() {
    this.keep();
    this.run(false);
    this.load(this.origin, false);
  }
  step() {
    this.run(false);
    const least = Math.min(...this.tops.map((top) => top.ticks));
    this.goTo((Math.floor(this.clock / least) + 1) * least);
  }
  jump(t) {
    this.say("");
    if (!(t >= 0 && t <= 1e9)) return this.say(`Cannot jump to t = ${t}: it must be from 0 to 1e9`);
    this.goTo(Math.round(t * TICKS));
  }
  // Goes to a time in ticks, over as many frames as it takes; by way of the start if it is past.
  goTo(goal, resume = false) {
    if (goal < this.clock) this.load(this.scene, false);
    Object.assign(this, { goal, resume, running: false });
    this.approach();
    this.tell();
  }
  approach() {
    this.advance(this.goal, 12 * MOMENT);
    if (!this.late && this.goal !== null) this.run(this.resume);
  }
  // Does what a frame does after so many seconds. Returns the speed of the last half second, if it
  // is less than was asked for.
  frame(passed) {
    const { target, scene } = this;
    if (this.goal !== null) this.approach();
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
    this.late = false;
    for (let [more, now] = [true, performance.now()]; more && !this.late; ) {
      const before = this.clock;
      this.clock = stage.advance(this.target, this.slice);
      const took = performance.now() - now;
      this.slice = Math.max(LEAST, Math.min(MOST, this.slice * (took < 1 ? 2 : 2 / took)));
      now += took;
      more = this.clock > before || stage.late();
      this.late = now > until && more && (this.clock < enough || stage.late());
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
