// The page comes to life: buttons and keys, the window, and a frame loop.
import { stage, TICKS } from "./core.js";
import { Charts } from "./charts.js";
import { Hands } from "./hands.js";
import { fileButtons } from "./files.js";
import { Page } from "./page.js";
import { Panel } from "./panel.js";
import presets from "./presets.json";
import { complete } from "./scene.js";
import { View } from "./view.js";

// The page as it came, before anything is changed.
const source = `<!doctype html>\n${document.documentElement.outerHTML}\n`;
const $ = (id) => document.getElementById(id);
const calm = matchMedia("(prefers-reduced-motion: reduce)");

// An event without an error is a note of the browser's, as that a size is told a frame later.
addEventListener("error", ({ message, error }) => {
  if (error) $("words").textContent = `The page cannot go on: ${message}`;
});
const view = new View($("view"));
const page = new Page(view);
const charts = new Charts(page);
const panel = new Panel($("panel"), page, charts, fileButtons(page, view, charts, source), choose);
const hands = new Hands(view, page);

function choose(preset) {
  if (!preset) return;
  page.replace(preset);
  page.run(!calm.matches);
}
page.tell = () => (panel.draw(), charts.build());
matchMedia("(prefers-color-scheme: dark)").addEventListener(
  "change",
  () => (view.build(page, false), page.tell()),
);
view.canvas.addEventListener("webglcontextlost", () =>
  page.say("The browser took the picture away, for now"),
);
view.canvas.addEventListener("webglcontextrestored", () => page.say(""));
// A double click shows one top alone in the charts, or all of them.
view.canvas.addEventListener("dblclick", ({ clientX, clientY }) => {
  const top = view.pick(clientX, clientY)?.i;
  const shown = page.scene.shown.map((_, i) => i === (top ?? i));
  page.set("shown", shown);
});

// A key does what the control does that names it as its own; Escape lets go.
function press(control) {
  if (!control.matches("summary, [type=number]")) return control.click();
  $("panel").hidden = false;
  control.closest("details").open = true;
  control.focus();
}
addEventListener("keydown", (event) => {
  const { key, target, ctrlKey, metaKey, altKey } = event;
  if (key === "Escape") return hands.drag ? hands.cancel() : page.run(false);
  const name = key === " " ? "Space" : key.length === 1 ? key.toUpperCase() : key;
  const chord = ctrlKey || metaKey ? `Control+${name}` : name;
  const own = /^(Space|Enter)$/.test(name)
    ? "summary, button, [type=checkbox], "
    : /^Arrow/.test(name)
      ? "input, "
      : "";
  if (hands.drag || altKey || target.closest(`${own}[type=number], select, textarea`)) return;
  const control = document.querySelector(`[aria-keyshortcuts~="${CSS.escape(chord)}"]`);
  if (!control && !presets[chord - 1]) return;
  event.preventDefault();
  control ? press(control) : choose(presets[chord - 1]);
});
$("fold").addEventListener("click", () => ($("panel").hidden = !$("panel").hidden));

let last = 0;
let shown = { at: 0 };
function frame(now) {
  const rate = page.frame((now - last) / 1000);
  last = now;
  const more = page.goal ? ` → ${page.goal / TICKS}` : "";
  const slow = rate ? `speed ${rate.toPrecision(2)}, ` : "";
  $("clock").textContent = `${slow}t = ${(page.clock / TICKS).toFixed(2)}${more}`;
  const isNew = shown.clock !== page.clock || shown.tops !== page.tops;
  if (now - shown.at > 120 && isNew) {
    shown = { at: now, clock: page.clock, tops: page.tops };
    panel.draw();
    charts.update();
  }
  label();
  view.render();
  requestAnimationFrame(frame);
}
// Beside the green tip stands what it is for, until it was taken once: away from the top if there
// is room.
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

const linked = () =>
  location.hash.startsWith("#scene=") && JSON.parse(decodeURIComponent(location.hash.slice(7)));
function attempt(open) {
  try {
    open();
  } catch (error) {
    if (!view.page) page.load(presets[0]);
    page.say(`The scene given cannot be shown: ${error.message}`);
  }
}
attempt(() => page.load(linked() || JSON.parse($("scene").textContent) || presets[0]));
const open = () => linked() && page.replace(complete(linked()));
addEventListener("hashchange", () => attempt(open));
new ResizeObserver(() => page.tell()).observe($("panel"));
// In a notebook it waits.
if (!calm.matches && window.parent === window) setTimeout(() => page.run(true), 600);
setTimeout(() => ($("hint").style.opacity = 0), 20000);
requestAnimationFrame(frame);

// For tests and for the curious, here are the page's state and what moves it.
const at = (part, i = 0, number = 0) => view.project(view.handle(part, i, number));
const advance = (t) => page.advance(Math.round(t * TICKS));
const states = () => page.tops.map((_, i) => Array.from(stage.state(i)));
window.kreisel = { page, view, charts, stage, presets, choose, at, advance, states };
