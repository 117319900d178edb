// The page comes to life: buttons and keys, the window, and a frame loop.
import { Bar } from "./bar.js";
import { nameOf } from "./compute.js";
import { stage, TICKS } from "./core.js";
import { home } from "./camera.js";
import { Charts } from "./charts.js";
import { Hands } from "./hands.js";
import { fileButtons } from "./files.js";
import { Keys } from "./keys.js";
import { remembered } from "./memory.js";
import { Numbers } from "./numbers.js";
import { Page } from "./page.js";
import { Panel } from "./panel.js";
import presets from "./presets.json";
import { complete } from "./scene.js";
import { View } from "./view.js";

// The page as it came, before anything is changed.
const source = `<!doctype html>\n${document.documentElement.outerHTML}\n`;
const $ = (id) => document.getElementById(id);
const calm = matchMedia("(prefers-reduced-motion: reduce)");
const { style } = document.documentElement;
style.colorScheme = remembered();

// An event without an error is a note of the browser's, as that a size is told a frame later.
addEventListener("error", ({ message, error }) => {
  if (error) $("words").textContent = `The page has stopped on an error: ${message}`;
});
const view = new View($("view"));
const page = new Page(view);
const charts = new Charts(page);
const panel = new Panel($("panel"), page, charts, fileButtons(page, view, charts, source), choose);
const numbers = new Numbers($("view"));
view.letters.avoid(numbers.place);
const footerHeight = () => {
  const first = $("hint").offsetParent ? $("hint") : $("bar");
  return $("view").getBoundingClientRect().bottom - first.getBoundingClientRect().top;
};
const footer = new ResizeObserver(() => view.setFooter(footerHeight()));
for (const id of ["hint", "bar"]) footer.observe($(id));
const hands = new Hands(view, page);

const keys = new Keys($("keys"), { page, view, hands, presets, choose });
const bar = new Bar($("bar"), page, hands, keys);

function choose(preset) {
  if (!preset) return;
  page.replace(preset);
  home(view);
  page.run(!calm.matches);
}
let stale = false; // while a hand moves, what is told waits for the next frame
let told = {}; // of what was told last
const differs = (before) => ["clock", "tops", "running"].some((key) => before[key] !== page[key]);
function draw() {
  stale = false;
  const { clock, tops, running } = page;
  told = { clock, tops, running };
  panel.draw();
  bar.draw();
  numbers.update(page);
  charts.build();
  $("times").textContent = behind();
}
page.tell = () => {
  if (hands.drag) stale = true;
  else draw();
  wake();
};
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => panel.repaint());
// Paper is white, whatever the screen was.
let chosen = "";
addEventListener("beforeprint", () => {
  chosen = style.colorScheme;
  style.colorScheme = "light";
  panel.repaint();
  view.render();
});
addEventListener("afterprint", () => {
  style.colorScheme = chosen;
  panel.repaint();
});
view.canvas.addEventListener("webglcontextlost", () =>
  page.say("The browser has stopped drawing the picture for now"),
);
view.canvas.addEventListener("webglcontextrestored", () => page.say(""));
// A double click shows one top alone in the charts, or all of them.
view.canvas.addEventListener("dblclick", ({ clientX, clientY }) => {
  const top = view.pick(clientX, clientY)?.i;
  const shown = page.scene.shown.map((_, i) => i === (top ?? i));
  page.set("shown", shown);
});

$("fold").addEventListener("click", () => {
  $("panel").hidden = !$("panel").hidden;
  $("fold").ariaExpanded = !$("panel").hidden;
});

// A page at rest asks for no frames: whatever changes it wakes it.
let asked = 0;
function wake() {
  asked ||= requestAnimationFrame(frame);
}
view.wake = wake;
let last = null; // when the frame before was, if that was just now
let due = 0; // when all may be told again
function frame(now) {
  asked = 0;
  const rate = page.frame(last === null ? 0 : (now - last) / 1000);
  const isOld = () => stale || differs(told) || charts.clock !== page.clock;
  if (isOld() && now >= due) {
    due = now + 120;
    if (stale || differs(told)) draw();
    charts.update();
  }
  tellTime(rate);
  hands.follow();
  view.render();
  const goesOn = page.running || page.goal !== null || view.recording || isOld();
  last = goesOn ? now : null;
  if (goesOn) wake();
}
function tellTime(rate) {
  const more = page.goal ? ` → ${page.goal / TICKS}` : "";
  $("clock").textContent = `t = ${(page.clock / TICKS).toFixed(2)}${more} s`;
  const slow = rate && `slower than asked for, ${rate.toPrecision(2)} units of time per second`;
  $("clock").title = slow || "time";
}
// Says which tops stand at another time than the clock: they move from step to step.
function behind() {
  const least = Math.min(...page.tops.map((top) => top.ticks));
  const words = page.tops.map((top, i) => {
    const [t] = stage.state(i);
    if (page.running) return top.ticks > least ? `${nameOf(top)} waits for its next step` : "";
    const isBehind = Math.abs(t * TICKS - page.clock) > 0.5 && !stage.failure(i);
    return isBehind ? `${nameOf(top)} is shown at t = ${+t.toFixed(6)}` : "";
  });
  return words.filter(Boolean).join("\n");
}

const linked = () =>
  location.hash.startsWith("#scene=") && JSON.parse(decodeURIComponent(location.hash.slice(7)));
function attempt(open) {
  try {
    open();
  } catch (error) {
    if (!view.page) page.load(presets[0]);
    page.say(`This scene cannot be shown: ${error.message}`);
  }
}
attempt(() => page.load(linked() || JSON.parse($("scene").textContent) || presets[0]));
const open = () => linked() && page.replace(complete(linked()));
addEventListener("hashchange", () => attempt(open));
new ResizeObserver(() => charts.build()).observe($("panel"));
// In a notebook it waits, and the wheel scrolls that until one clicks in.
const isInside = window.parent !== window;
view.orbit.enableZoom = !isInside;
view.canvas.addEventListener("pointerdown", () => (view.orbit.enableZoom = true));
view.canvas.addEventListener("pointerleave", () => (view.orbit.enableZoom = !isInside));
if (!calm.matches && !isInside) setTimeout(() => page.run(true), 600);
setTimeout(() => ($("hint").style.opacity = 0), 20000);
wake();

// For tests and for the curious, here are the page's state and what moves it.
const at = (part, i = 0, number = 0) => view.project(view.handle(part, i, number));
const advance = (t) => page.advance(Math.round(t * TICKS));
const states = () => page.tops.map((_, i) => Array.from(stage.state(i)));
window.kreisel = { page, view, hands, charts, stage, presets, choose, at, advance, states };
