// The state of the viewer: scene, undo, clock. Changes of the computation keep the start and the
// time. Drags, pushes and new values of momentum, tilt or spin make the current state the start.
// Other changes of the motion restart it from the start of the scene.
import { findKind, computeLimits, makeBody, findMeasure } from "./core.js";
import { measures, methods, simulation, TICKS, MAX_TOPS } from "./core.js";
import { describeResult } from "./game.js";
import { findContact, setValue, findMeetingTime, getPlaceName } from "./setters.js";
import { decodeBase64, getMeasureName, completeScene, findSuitable } from "./scene.js";
import { computeRoomAngle, getRange, listTops } from "./scene.js";

const FINE_STEP = 0.02; // with larger steps the time of the end is told as an interval
const FRAME_BUDGET = 8; // milliseconds per frame for computing steps
// Steps between two checks of the time: at least one for each possible top.
const [MIN_SLICE, MAX_SLICE] = [MAX_TOPS, 2000];
// Places whose change invalidates a path computed elsewhere.
const CHANGES_MOTION = /^(body|shape|attitude|momentum|second|gravity|damping|friction|turning|shaking|gradient|rotor|wheel|taken)/;
// Places that leave the motion as it is.
const KEEPS_MOTION = /^(speed|distance|stop|chart|integral|log|shown|corners|show)/;
// Places whose change starts the motion again; it then returns to its time.
const KEEPS_START = /^(methods|step|both|own|tol|ghost)/;
const READ_FROM_MOTION = /^(momentum|tilt|spin)/; // shown and set for the current state
const isDifferent = (a, b) => JSON.stringify(a) !== JSON.stringify(b);

export class PageState {
  undoStack = []; // moments to return to
  redoStack = []; // moments that were undone
  previousMotion = null; // traces and charts before a change of the motion
  isRunning = false;
  onChange = () => {}; // called after each change
  constructor(view) {
    this.view = view;
  }
  showMessage(words) {
    document.getElementById("words").textContent = words;
  }

  // Load a scene and return whether it is valid; otherwise keep the previous one. With `fit` the
  // camera moves home and Reset returns to this scene.
  load(given, fit = true) {
    const before = this.scene;
    try {
      this.scene = completeScene(given);
      this.updatePreviousMotion();
      this.buildTops(fit);
      if (fit) this.origin = structuredClone(this.scene);
    } catch (error) {
      if (!before) throw error;
      Object.assign(this, { scene: before, previousMotion: null });
      this.buildTops(false);
      this.showMessage(`This scene cannot be used: ${error.message}`);
    }
    this.onChange();
    return this.scene !== before;
  }
  // Create all tops of the simulation at t = 0.
  buildTops(fit) {
    const { scene } = this;
    this.body = makeBody(scene.body, scene.rotor, scene.wheel);
    this.kind = findKind(this.body);
    this.replaceUnsuitableMethods();
    this.contact = findContact(scene, this.body);
    simulation.clear();
    const tops = listTops(scene, this.body).map((top) => ({
      ...top,
      ticks: Math.max(1, Math.round(top.step * TICKS)),
    }));
    tops.forEach((top) => this.addTop(top));
    this.tops = tops.filter(({ role }) => role !== "reference");
    this.reference = tops.at(-1).method;
    this.selectMeasures();
    this.adjustStopTime();
    Object.assign(this, { clock: 0, target: 0, goal: null, slice: MIN_SLICE, failures: "" });
    this.secondsPassed = this.timePassed = 0;
    this.view.build(this, fit);
  }
  // Replace methods that do not apply to the top by one that does. taylor gets all digits.
  replaceUnsuitableMethods() {
    const { scene, body } = this;
    scene.methods.forEach((name, i) => {
      if (!methods.has(name)) throw new Error(`the viewer has no method ${name}`);
      if (methods.get(name).isSuitable(body, scene)) return;
      const other = findSuitable(["strang", "taylor"], scene, body);
      if (!other) throw new Error("no method of the viewer applies to this top");
      scene.methods[i] = other;
      if (other === "taylor") scene.tol = 1e-15;
      this.showMessage(`${name} does not apply to this top: ${other} is used instead`);
    });
  }
  addTop(top) {
    const { track, method, side, role, ticks, comparedWith } = top;
    const { scene, body } = this;
    const { second } = scene;
    const start = (side === 1 && !track && second) || [...scene.attitude, ...scene.momentum];
    const [q, m] = [start.slice(0, 4), start.slice(4)];
    const tol = role === "ghost" || role === "reference" ? 1e-15 : scene.tol;
    top.limits = computeLimits(body, scene, q, m);
    const states = track && new Float64Array(decodeBase64(track.states).buffer);
    if (track) simulation.addTrack(body, scene, states, ticks, comparedWith);
    else simulation.addTop(body, scene, q, m, methods.get(method), ticks, tol, comparedWith);
    if (this.contact !== null && !track) simulation.setFloor(this.contact);
  }
  // Select the measures that are defined for this body: NaN at the start means undefined.
  selectMeasures() {
    const now = simulation.measureTop(0);
    this.measures = measures.filter(({ name }) => !Number.isNaN(now[name]));
    this.integrals = this.measures.filter(({ isConserved }) => isConserved);
    this.selectCharts();
  }
  // Replace charts of undefined measures by the energy.
  selectCharts() {
    const { scene } = this;
    const chooseDefined = (offered, name) =>
      offered.includes(findMeasure(name)) ? name : "energy";
    scene.chart = chooseDefined(this.measures, getMeasureName(scene.chart, this.kind));
    scene.integral = chooseDefined(this.integrals, getMeasureName(scene.integral, this.kind));
  }
  // Move the stop time to one at which all steps meet.
  adjustStopTime() {
    const { stop } = this.scene;
    if (stop === null || findMeetingTime(stop) === stop) return;
    this.scene.stop = findMeetingTime(stop);
    this.showMessage(`The stop time is now ${this.scene.stop}, where all steps meet`);
  }

  // Record scene and time for undo, before a change.
  recordUndo(how) {
    this.undoStack.push(this.captureMoment(how));
    if (this.undoStack.length > 200) this.undoStack.shift();
    [this.redoBefore, this.redoStack] = [this.redoStack, []];
    this.showMessage("");
  }
  // Return the current scene and time, for `restoreMoment`.
  captureMoment(how) {
    const { origin, goal, clock } = this;
    return { scene: structuredClone(this.scene), origin, clock: goal ?? clock, ...how };
  }
  // Begin a change. With `now` the current state becomes the start.
  beginChange({ top, now = true, ...how } = {}) {
    this.recordUndo(how);
    this.previousMotion = this.clock ? this.captureMotion() : null;
    if (!this.clock || !now) return;
    const { second } = this.scene;
    const [, w, x, y, z, ...momentum] = this.readLiveState(second && top?.side ? null : top);
    const beside = second && this.readLiveState(this.tops.find((each) => each.side)).slice(1);
    const taken = this.clock / TICKS;
    const heading = computeRoomAngle(this.scene, taken);
    const [amplitude, rate, phase] = this.scene.shaking;
    const shaking = [amplitude, rate, (phase + rate * taken) % (2 * Math.PI)];
    const start = { attitude: [w, x, y, z], momentum, second: beside, taken, heading, shaking };
    Object.assign(this.scene, start);
    this.markChanged(this.scene);
  }
  // Change the momentum of a top and run.
  pushTop(top, change) {
    this.beginChange({ top });
    this.editScene(change);
    this.setRunning(true);
  }
  // Return the current traces, and the content of the charts.
  captureMotion() {
    const names = [this.scene.chart, this.scene.integral, "error"];
    const readRows = (i, name) => [-1, 0, 1].map((side) => simulation.getRecord(i, name, side));
    const readTops = (name) => [name, this.tops.map((_, i) => readRows(i, name))];
    return {
      times: simulation.getTimes(),
      records: Object.fromEntries(names.map(readTops)),
      tops: this.tops,
      ways: this.tops.map((_, i) => this.view.getTrace(i)),
    };
  }
  // Drop the motion before a change when the scene is no longer the changed one. A gesture changes
  // it many times.
  updatePreviousMotion() {
    if (!this.previousMotion) return;
    const kept = Object.entries(this.scene).filter(([key]) => !KEEPS_MOTION.test(key));
    const scene = JSON.stringify(kept);
    if (this.gesture || this.view.isHeld) this.previousMotion.scene = scene;
    this.previousMotion.scene ??= scene;
    if (this.previousMotion.scene !== scene) this.previousMotion = null;
  }
  // Mark a scene as changed. Its text may no longer be true.
  markChanged(scene) {
    if (scene.name && !scene.name.endsWith(", changed")) scene.name += ", changed";
    scene.about = "";
  }
  // Return the index of a top that is computed here, or of the first such top.
  findLiveTop(top) {
    const live = this.tops.filter((each) => !each.track && each.role !== "ghost");
    return this.tops.indexOf(live.includes(top) ? top : live[0]);
  }
  readLiveState(top) {
    return Array.from(simulation.getState(this.findLiveTop(top)));
  }
  editScene(change) {
    const scene = structuredClone(this.scene);
    change(scene);
    const changed = Object.keys(scene).filter(
      (key) => !KEEPS_MOTION.test(key) && isDifferent(scene[key], this.scene[key]),
    );
    const isLost = scene.tracks.length > 0 && changed.some((key) => CHANGES_MOTION.test(key));
    if (isLost) scene.tracks = [];
    if (changed.length) this.markChanged(scene);
    const isLoaded = this.load(scene, false);
    if (isLoaded && isLost)
      this.showMessage("The path belongs to another motion and was removed. Undo restores it");
    return isLoaded;
  }
  // Make the current state the start.
  startFromNow() {
    if (!this.clock) return;
    this.beginChange();
    this.editScene((scene) => (scene.tracks = []));
  }
  // Apply a scene that differs only in looks.
  applyLooks(scene) {
    const isOther = scene.show.solid !== this.scene.show.solid;
    this.scene = scene;
    this.adjustStopTime();
    this.selectCharts();
    if (isOther) this.view.build(this, false);
    else this.view.showScene(scene);
    this.onChange();
  }
  // Set the value at a place such as "show.trace". Return why it is invalid, or "". One undo takes
  // back all changes of one gesture.
  setValue(place, x, gesture) {
    const change = (scene) => (setValue(scene, place, x), scene);
    const isNew = !gesture || gesture !== this.gesture;
    try {
      const wanted = completeScene(change(structuredClone(this.scene)));
      if (KEEPS_MOTION.test(place)) {
        if (!isDifferent(wanted, this.scene)) return "";
        if (isNew) this.recordUndo({ isLookOnly: true });
        this.gesture = gesture;
        this.applyLooks(wanted);
        return "";
      }
    } catch ({ message }) {
      return this.refuseValue(place, x, message);
    }
    const time = this.goal ?? this.clock;
    const wasRunning = this.isRunning || this.isResuming;
    if (isNew) this.beginChange({ now: READ_FROM_MOTION.test(place) });
    this.gesture = gesture;
    if (this.editScene(change)) {
      if (KEEPS_START.test(place) && time) this.goToTime(time, wasRunning);
      return "";
    }
    this.gesture = null;
    if (isNew) this.undo(true);
    return document.getElementById("words").textContent;
  }
  refuseValue(place, x, message) {
    const [range, value] = [getRange(place), Number.isNaN(x) ? "empty" : x];
    const own = `${getPlaceName(place)} cannot be ${value}${range ? `: ${range}` : ""}`;
    const words = /^[A-Z].* cannot be/.test(message) ? message : own;
    this.showMessage(words);
    return words;
  }
  replaceScene(scene) {
    this.recordUndo({ fit: true });
    if (!this.load(scene)) this.undo(true);
  }
  // Undo the last change. With `quietly` it leaves no trace in redo, as for an invalid change.
  undo(quietly = false) {
    if (!quietly) return this.restoreMoment(this.undoStack, this.redoStack);
    this.restoreMoment(this.undoStack, [], true);
    this.redoStack = this.redoBefore;
    this.onChange();
  }
  redo() {
    this.restoreMoment(this.redoStack, this.undoStack);
  }
  restoreMoment(from, other, quietly = false) {
    const { scene, origin, clock, fit = false, isLookOnly } = from.pop() ?? {};
    if (!quietly) this.showMessage("");
    if (!scene) return;
    other.push(this.captureMoment({ fit, isLookOnly }));
    if (isLookOnly) return this.applyLooks(scene);
    this.setRunning(false);
    this.load(scene, fit);
    this.origin = origin;
    if (clock) this.goToTime(clock);
  }

  setRunning(on) {
    Object.assign(this, { goal: null, isResuming: false, isRunning: on });
    if (!on) this.view.draw(); // without the blur of a motion
    this.onChange();
  }
  // Run, from the start if no top can go on.
  start() {
    if (this.hasEnded()) this.rewind();
    this.setRunning(true);
  }
  // Return to the start of the current scene.
  rewind() {
    this.showMessage("");
    this.load(this.scene, false);
  }
  // Return to the scene as it was loaded.
  reset() {
    this.recordUndo();
    this.setRunning(false);
    this.load(this.origin, false);
  }
  stepOnce() {
    this.setRunning(false);
    const least = Math.min(...this.tops.map((top) => top.ticks));
    this.goToTime((Math.floor(this.clock / least) + 1) * least);
  }
  jumpTo(t) {
    this.showMessage("");
    if (!(t >= 0 && t <= 1e9))
      return this.showMessage(`Cannot jump to t = ${t}: it must be from 0 to 1e9`);
    this.goToTime(Math.round(t * TICKS));
  }
  // Go to a time in ticks, over several frames if needed; to an earlier time from the start.
  goToTime(goal, isResuming = false) {
    if (goal < this.clock) this.load(this.scene, false);
    Object.assign(this, { goal, isResuming, isRunning: false });
    this.approachGoal();
    this.onChange();
  }
  approachGoal() {
    this.advance(this.goal, 12 * FRAME_BUDGET);
    if (!this.isLate && this.goal !== null) this.setRunning(this.isResuming);
  }
  // Advance by the seconds that passed since the last frame. Return the speed of the last half
  // second if it is too slow, else 0 or false.
  advanceFrame(passed) {
    const { target, scene } = this;
    if (this.goal !== null) this.approachGoal();
    if (!this.isRunning) return (this.slowRate = 0);
    this.advance(target + Math.min(passed, 0.1) * scene.speed * TICKS, FRAME_BUDGET);
    this.secondsPassed += passed;
    this.timePassed += (this.target - target) / TICKS;
    if (this.secondsPassed < 0.5) return this.slowRate;
    const rate = this.timePassed / this.secondsPassed;
    this.slowRate = rate < 0.9 * scene.speed && rate;
    this.secondsPassed = this.timePassed = 0;
    return this.slowRate;
  }
  // Advance to a time in ticks, for at most `most` milliseconds.
  advance(target, most = Infinity) {
    const { stop } = this.scene;
    const end = stop === null ? Infinity : Math.round(stop * TICKS);
    this.target = Math.min(target, end);
    const until = performance.now() + most;
    const enough = this.target - Math.max(...this.tops.map((top) => top.ticks));
    this.isLate = false;
    for (let [isMoving, now] = [true, performance.now()]; isMoving && !this.isLate;) {
      const before = this.clock;
      this.clock = simulation.advance(this.target, this.slice);
      const took = performance.now() - now;
      this.slice = Math.max(MIN_SLICE, Math.min(MAX_SLICE, this.slice * (took < 1 ? 2 : 2 / took)));
      now += took;
      isMoving = this.clock > before || simulation.isLate();
      this.isLate = now > until && isMoving && (this.clock < enough || simulation.isLate());
    }
    if (this.isLate) this.target = this.clock; // the clock runs slower
    const describeFailure = ({ method, step, track }, i) => {
      const why = simulation.getFailure(i);
      const end = simulation.getEnd(i);
      if (!Number.isNaN(end)) return this.describeEnd(i, end);
      return why && (track ? `${method} ends` : `${method} ${step} stopped: ${why}`);
    };
    const words = this.tops.map(describeFailure);
    if (words.join() !== this.failures && words.some(Boolean))
      this.showMessage([...words, this.judgeEnd()].filter(Boolean).join(". "));
    this.failures = words.join();
    const isOver = target > end && !this.isLate;
    if (isOver) this.showMessage(`The stop time ${stop} is reached`);
    if (isOver || this.tops.every((top, i) => words[i] || top.role === "ghost"))
      this.setRunning(false);
    this.view.draw();
  }
  // Return whether no top can go on.
  hasEnded() {
    return this.tops.every((top, i) => top.role === "ghost" || simulation.hasEnded(i));
  }
  // Return the words for the end of a top, whose rim met the floor at the time `end`.
  describeEnd(i, end) {
    const { side, step } = this.tops[i];
    const first = Math.floor(end / step) * step;
    const when = step > FINE_STEP
      ? `between t = ${+first.toFixed(6)} and ${+(first + step).toFixed(6)} s`
      : `at t = ${end.toFixed(2)} s`;
    const which = this.tops.length > 1 ? (side ? "Right: the" : "Left: the") : "The";
    return `${which} rim meets the floor ${when}, where this model ends`;
  }
  // Return the result of a game that the first top has ended, and how to try again, or "".
  judgeEnd() {
    const [{ step }] = this.tops;
    const end = simulation.getEnd(0);
    if (Number.isNaN(end)) return "";
    const result = step > FINE_STEP ? "" : describeResult(this.scene, end);
    return [result, this.hasEnded() && "▶ starts again"].filter(Boolean).join(". ");
  }
}
