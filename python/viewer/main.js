// The page comes to life: buttons and keys, the window, and a frame loop.
import { stage, TICKS, version } from "./core.js";
import { Charts } from "./charts.js";
import { takeHold } from "./hands.js";
import { fileButtons, say } from "./files.js";
import { Page } from "./page.js";
import { Panel } from "./panel.js";
import { presets } from "./presets.js";
import { fromLink } from "./scene.js";
import { View } from "./view.js";

const source = `<!doctype html>\n${document.documentElement.outerHTML}\n`; // as it came, before anything is changed
const $ = (id) => document.getElementById(id);
const calm = matchMedia("(prefers-reduced-motion: reduce)");
const framed = window.parent !== window; // in a notebook: it waits to be started

const view = new View($("view"));
const page = new Page(view);
const charts = new Charts(page);
const panel = new Panel($("panel"), page, charts, {
  motion: {
    run: ["Start", () => page.run(!page.moving), "Space"],
    step: ["Step", () => page.step(), "ArrowRight"],
    reset: ["Reset", () => page.reset(), "R"],
    undo: ["Undo", () => page.undo(), "Control+Z"],
  },
  looks: { side: ["From the next side", () => view.turn(), "A"] },
  files: fileButtons(page, view, charts, source),
});
const hands = takeHold(view, page, panel);

function choose(i) {
  if (!presets[i]) return;
  page.replace(presets[i], true);
  page.run(!calm.matches);
}
panel.choose = choose;

page.tell = () => {
  panel.draw();
  if (charts.tops !== page.tops || charts.what !== page.scene.chart) charts.build();
};
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => (view.build(page, false), charts.build()));
view.canvas.addEventListener("dblclick", (event) => {
  charts.only(view.pick(event.clientX, event.clientY)?.i);
  panel.draw();
});

const flip = (what) => () => page.set(`show.${what}`, !page.scene.show[what]);
const press = (id) => () => $(id).click();
const KEYS = {
  " ": ["run, stop", press("run")],
  ArrowRight: ["one step", press("step")],
  r: ["back to the start", press("reset")],
  z: ["undo (Ctrl Z too)", press("undo")],
  j: ["jump to a time", () => (($("jump").closest("details").open = true), $("jump").focus())],
  c: ["compare four", () => choose(1)],
  t: ["trace", flip("trace")],
  e: ["elastic rod", flip("rod")],
  p: ["principal axes", flip("axes")],
  v: ["2D view", flip("flat")],
  a: ["from the next side", press("side")],
  d: ["panel", () => ($("panel").hidden = !$("panel").hidden)],
  s: ["picture", press("png")],
  "?": ["this list", () => say("Keys", keyList())],
  Escape: ["leave a drag", () => hands.cancel()],
};
const keyList = () => {
  const keys = Object.entries(KEYS).map(([key, [what]]) => `${key === " " ? "Space" : key}  ${what}`);
  return [`1 .. ${presets.length}  what to look at`, ...keys, "double click  a top alone in the charts"].join("\n");
};
addEventListener("keydown", (event) => {
  const { key, target } = event;
  const undo = (event.ctrlKey || event.metaKey) && key === "z" && !target.closest("input[type=number]");
  const typing = target.closest("input, select, textarea, summary, button") && key !== "Escape";
  if (target.closest("dialog") || (!undo && (typing || event.ctrlKey || event.metaKey || event.altKey))) return;
  const [, act] = KEYS[key.length === 1 ? key.toLowerCase() : key] ?? [, presets[key - 1] && (() => choose(key - 1))];
  if (!act) return;
  event.preventDefault();
  act();
});

let last = 0;
let shown = { at: 0 };
function frame(now) {
  const rate = page.frame(Math.min((now - last) / 1000, 0.1));
  last = now;
  $("clock").textContent = `${rate ? `speed ${rate.toPrecision(1)}, ` : ""}t = ${(page.clock / TICKS).toFixed(2)}`;
  if (now - shown.at > 120 && shown.clock !== page.clock) {
    shown = { at: now, clock: page.clock };
    panel.draw();
    charts.update();
  }
  label();
  view.render();
  requestAnimationFrame(frame);
}
// What the green tip is for, until it was taken once: beside it, away from the top if there is room.
function label() {
  const [tip, first] = [$("tip"), view.tops.findIndex((top) => top.m)];
  tip.hidden = hands.tipSeen || first < 0 || (innerWidth <= 700 && page.running);
  if (tip.hidden || !view.dirty) return;
  const [x, y] = view.project(view.handle("tip", first));
  const [width, room] = [view.pixels[0], 220];
  const left = x > width - room || (x < width / 2 && x > room);
  Object.assign(tip.style, { left: `${x}px`, top: `${y}px` });
  tip.classList.toggle("left", left);
}

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
const at = (kind, i = 0, number = 0) => view.project(view.handle(kind, i, number));
const advance = (t) => page.advance(Math.round(t * TICKS));
const states = () => page.tops.map((_, i) => Array.from(stage.state(i)));
window.kreisel = { version, page, view, charts, stage, presets, choose, at, advance, states };
