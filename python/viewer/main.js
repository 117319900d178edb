// The page comes to life: controls and keys to the page's state, and a frame loop.
import { methods, stage, TICKS, version } from "./core.js";
import { Charts } from "./charts.js";
import { takeHold } from "./hands.js";
import { offerFiles } from "./files.js";
import { Page } from "./page.js";
import { fromLink, takeShape } from "./scene.js";
import { presets } from "./presets.js";
import { View } from "./view.js";

const source = `<!doctype html>\n${document.documentElement.outerHTML}\n`; // as it came, before anything is changed
const $ = (id) => document.getElementById(id);
const calm = matchMedia("(prefers-reduced-motion: reduce)");
const framed = window.parent !== window; // in a notebook: it waits to be started

const view = new View($("view"));
const page = new Page(view);
page.cornersMove = () => $("move").checked;
page.seen = (handle) => handle === "tip" && (tipSeen = true);
let tipSeen = false;
const hands = takeHold(view, page);
const charts = new Charts(page);
const files = offerFiles(page, view, charts, source);

// Controls: how each shows the scene, and how it changes it; `live`: without beginning anew.
const round = (x) => +x.toPrecision(2); // whole ticks with small common multiples
const second = (scene, eps) => (scene.eps = eps ? [scene.eps[0], eps] : [scene.eps[0]]);
const ticks = (text) => {
  const x = parseFloat(text);
  if (!(x >= 1 / TICKS && x < 1000)) throw new Error(`${text || "nothing"} is no step`);
  return Math.round(x * TICKS) / TICKS;
};
// The nearest time at which all steps meet.
const meeting = (t) => {
  const common = stage.common();
  return common ? (Math.max(1, Math.round((t * TICKS) / common)) * common) / TICKS : t;
};
const choice = (of, key) => ({ get: (s) => of(s)[key], set: (s, x) => (of(s)[key] = x) });
const value = (of, key) => ({ get: (s) => of(s)[key], set: (s, x) => (of(s)[key] = +x), shown: true });
const [whole, show] = [(scene) => scene, (scene) => scene.show];
const live = { live: true };
const controls = {
  eps1: { get: (s) => Math.log10(s.eps[0]), set: (s, x) => (s.eps[0] = round(10 ** x)) },
  eps1_number: { get: (s) => s.eps[0], set: (s, x) => (s.eps[0] = ticks(x)) },
  eps2: { get: (s) => Math.log10(s.eps[1] ?? 0.2), set: (s, x) => second(s, round(10 ** x)) },
  eps2_number: { get: (s) => s.eps[1] ?? 0.2, set: (s, x) => second(s, ticks(x)) },
  second_eps: { get: (s) => s.eps.length > 1, set: (s, on) => second(s, on && 0.2) },
  speed: { ...value(whole, "speed"), ...live },
  gravity: value(whole, "gravity"),
  shape: { get: (s) => s.shape, set: takeShape },
  method1: choice((s) => s.methods, 0),
  method2: {
    get: (s) => s.methods[1] ?? "",
    set: (s, name) => Object.assign(s, { methods: [s.methods[0], name].filter(Boolean) }, name ? {} : { second: null }),
  },
  distance: { ...value(whole, "distance"), ...live },
  ghost: choice(whole, "ghost"),
  stop: { ...live, get: (s) => s.stop ?? "", set: (s, x) => (s.stop = x > 0 ? meeting(+x) : null) },
  quantity: { ...live, get: (s) => s.chart, set: (s, name) => ((s.chart = name), charts.build()) },
  opacity: { ...value(show, "opacity"), ...live },
  thickness: { ...value(show, "thickness"), ...live },
};
for (const name of ["trace", "rod", "axes", "floor", "flat"]) controls[name] = { ...choice(show, name), ...live };
for (const k of [0, 1, 2])
  controls[`m${k}`] = {
    get: (s) => +s.momentum[k].toPrecision(5),
    set: (s, text) => Number.isFinite(parseFloat(text)) && (s.momentum[k] = parseFloat(text)),
  };
let gesture = null; // the control that is being moved: one undo for all of it
for (const [id, { set, live }] of Object.entries(controls)) {
  const control = $(id);
  const typed = control.type === "number" || control.tagName === "SELECT";
  control.addEventListener(typed ? "change" : "input", () => {
    const value = control.type === "checkbox" ? control.checked : control.value;
    if (live) {
      set(page.scene, value);
      view.show(page.scene);
      return showScene();
    }
    try {
      if (gesture !== id) page.begin();
      gesture = control.type === "range" ? id : null;
      page.edit((scene) => set(scene, value));
    } catch (error) {
      page.say(error.message);
    }
  });
  control.addEventListener("change", () => (gesture = null));
}
for (const { name } of methods) for (const id of ["method1", "method2"]) $(id).add(new Option(name, name));
$("method2").add(new Option("nothing", ""), 0);
presets.forEach((preset, i) => $("preset").add(new Option(`${i + 1}  ${preset.name}`, i)));
const asGiven = new Option("as given", -1);
$("preset").add(asGiven);

function choose(i) {
  page.replace(presets[i], true);
  page.run(!calm.matches);
}
function showScene() {
  const { scene } = page;
  for (const [id, { get, shown }] of Object.entries(controls)) {
    const [control, value] = [$(id), get(scene)];
    if (control.type === "checkbox") control.checked = value;
    else if (document.activeElement !== control || control.type !== "number") control.value = value;
    if (shown) control.nextElementSibling.textContent = value.toFixed(control.step < 0.1 ? 2 : 1);
  }
  for (const id of ["eps2", "eps2_number"]) $(id).disabled = scene.eps.length < 2;
  const fits = (name) => !name || methods.find((m) => m.name === name).suits(page.block, scene.gravity);
  for (const option of [...$("method1").options, ...$("method2").options]) option.disabled = !fits(option.value);
  const known = presets.findIndex((preset) => preset.name === scene.name);
  $("preset").value = known;
  Object.assign(asGiven, { hidden: known >= 0, text: scene.name });
  $("about").textContent = scene.about;
  $("run").textContent = page.moving ? "Stop" : "Start";
  $("undo").disabled = !page.past.length;
  const common = stage.common();
  $("common").textContent = common ? common / TICKS : "never, in numbers that fit";
  const [mass, ...b] = page.block.slice(0, 7).map((x) => +x.toPrecision(4));
  const kind = page.kind.replace(/(^|_)./g, (first) => first.replace("_", "-").toUpperCase());
  $("body").textContent = `${kind} top: mass ${mass}, moments ${b.slice(0, 3).join(", ")},
    centre of mass ${b.slice(3).join(", ")} (along N, B, T)`;
  if (built !== page.tops) charts.build();
  built = page.tops;
}
let built = null; // the tops for which the charts were made
page.onChange(showScene);

const clicks = {
  run: () => page.run(!page.moving),
  step: () => page.step(),
  reset: () => page.reset(),
  undo: () => page.undo(),
  side: () => view.turn(),
};
for (const [id, act] of Object.entries(clicks)) $(id).addEventListener("click", act);
view.canvas.addEventListener("dblclick", (event) => charts.only(view.pick(event.clientX, event.clientY)?.i));
$("preset").addEventListener("change", ({ target }) => target.value >= 0 && choose(+target.value));
$("jump").addEventListener("change", ({ target }) => target.value !== "" && page.jump(+target.value));

const KEYS = {
  " ": ["run, stop", clicks.run],
  ArrowRight: ["one step", clicks.step],
  r: ["back to the start", clicks.reset],
  z: ["undo (Ctrl Z too)", clicks.undo],
  j: ["jump to a time", () => (($("motion").open = true), $("jump").focus())],
  c: ["compare four", () => choose(1)],
  t: ["trace", () => $("trace").click()],
  e: ["elastic rod", () => $("rod").click()],
  p: ["principal axes", () => $("axes").click()],
  v: ["2D view", () => $("flat").click()],
  a: ["from the next side", clicks.side],
  d: ["panel", () => (($("panel").hidden = !$("panel").hidden), size())],
  s: ["picture", () => $("png").click()],
  "?": ["this list", () => files.say("Keys", keyList())],
  Escape: ["leave a drag", () => hands.cancel()],
};
const keyList = () => {
  const keys = Object.entries(KEYS).map(([key, [what]]) => `${key === " " ? "Space" : key}  ${what}`);
  return [`1 .. ${presets.length}  what to look at`, ...keys, "double click  a top alone in the charts"].join("\n");
};
addEventListener("keydown", (event) => {
  const typing = event.target.closest("input, select, textarea, summary, button");
  if (event.target.closest("dialog")) return;
  if ((event.ctrlKey || event.metaKey) && event.key === "z" && !event.target.closest("input[type=number]")) {
    event.preventDefault();
    return page.undo();
  }
  if (event.ctrlKey || event.metaKey || event.altKey || (typing && event.key !== "Escape")) return;
  const preset = presets[event.key - 1];
  const [, act] = KEYS[event.key.length === 1 ? event.key.toLowerCase() : event.key] ?? [];
  if (!preset && !act) return;
  event.preventDefault();
  preset ? choose(event.key - 1) : act();
});

function size() {
  const panel = $("panel");
  const phone = innerWidth <= 700;
  const [right, bottom] = panel.hidden ? [0, 0] : phone ? [0, panel.offsetHeight] : [panel.offsetWidth + 12, 0];
  view.size(innerWidth, innerHeight, right, bottom);
}
addEventListener("resize", size);
new ResizeObserver(size).observe($("panel"));

let last = 0;
let charted = 0;
function frame(now) {
  const passed = Math.min((now - last) / 1000, 0.1);
  last = now;
  const rate = page.frame(passed);
  $("clock").textContent = `${rate ? `speed ${rate.toPrecision(1)}, ` : ""}t = ${(page.clock / TICKS).toFixed(2)}`;
  if (now - charted > 120 && charts.at !== page.clock) {
    charted = now;
    charts.at = page.clock;
    charts.update();
  }
  label();
  view.render();
  requestAnimationFrame(frame);
}
// What the green tip is for, until it was taken once.
function label() {
  const first = view.tops.findIndex((top) => top.m);
  $("tip").hidden = tipSeen || first < 0 || (innerWidth <= 700 && page.running);
  if ($("tip").hidden || !view.dirty) return;
  const [x, y] = view.project(view.handle("tip", first));
  Object.assign($("tip").style, { left: `${x}px`, top: `${y}px` });
  $("tip").classList.toggle("left", x > Math.max(0.4 * innerWidth, 220));
}

size();
try {
  const linked = location.hash.startsWith("#scene=") && fromLink(location.hash.slice(7));
  page.load(linked || JSON.parse($("scene").textContent) || presets[0]);
} catch (error) {
  page.load(presets[0]);
  page.say(`The scene given cannot be shown: ${error.message}`);
}
if (!calm.matches && !framed) setTimeout(() => page.run(true), 600);
setTimeout(() => ($("hint").style.opacity = 0), 20000);
requestAnimationFrame(frame);

// For tests and for the curious: the page's state and what moves it.
window.kreisel = {
  version,
  page,
  view,
  charts,
  stage,
  presets,
  choose,
  takeShape,
  at: (kind, i = 0, number = 0) => view.project(view.handle(kind, i, number)),
  advance: (t) => page.advance(Math.round(t * TICKS)),
  states: () => page.tops.map((_, i) => Array.from(stage.state(i))),
};
