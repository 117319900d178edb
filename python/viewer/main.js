// Create all parts of the viewer and run the frame loop.
import { Toolbar } from "./toolbar.js";
import { formatTopName } from "./accuracy.js";
import { simulation, TICKS } from "./core.js";
import { showHomeView } from "./camera.js";
import { Charts } from "./charts.js";
import { DragHandler } from "./drags.js";
import { listDownloads } from "./downloads.js";
import { Keyboard } from "./keyboard.js";
import { decodeScene } from "./links.js";
import { loadText } from "./storage.js";
import { Readout } from "./readout.js";
import { PageState } from "./page_state.js";
import { Panel } from "./panel.js";
import { Predictions } from "./predictions.js";
import presets from "./presets.json";
import { completeScene } from "./scene.js";
import { ShareDialog } from "./share.js";
import { Story } from "./story.js";
import { drawThumbnails } from "./thumbnails.js";
import { View } from "./view.js";

// The source of the viewer before any change, for the download.
const source = `<!doctype html>\n${document.documentElement.outerHTML}\n`;
const getElement = (id) => document.getElementById(id);
const LOW = 500; // height of a window without room for dials [pixels]
const NARROW = 680; // width of a picture with room for messages beside its tops [pixels]
const reducedMotion = matchMedia("(prefers-reduced-motion: reduce)");
const { style } = document.documentElement;
style.colorScheme = loadText("light or dark");

// Events without an error are notes of the browser, such as ResizeObserver notifications.
addEventListener("error", ({ message, error }) => {
  if (error) getElement("words").textContent = `The page has stopped on an error: ${message}`;
});
const view = new View(getElement("view"));
const page = new PageState(view);
const charts = new Charts(page);
const predictions = new Predictions(getElement("ask"), page, choosePreset);
const panel = new Panel(
  getElement("panel"),
  page,
  charts,
  listDownloads(page, view, charts, source),
  choosePreset,
  predictions,
);
const readout = new Readout(getElement("view"));
view.labels.avoidElement(readout.container);
const measureFooter = () => {
  const isInFlow = (part) => part.offsetHeight && getComputedStyle(part).position !== "absolute";
  const first = ["story", "ask", "hint", "hand"].map(getElement).find(isInFlow) ?? getElement("bar");
  return getElement("view").getBoundingClientRect().bottom - first.getBoundingClientRect().top;
};
const TEXTS = ["words", "times", "fold", "hand", "story", "ask"]; // that cover labels
const footerObserver = new ResizeObserver(() => {
  view.setFooter(measureFooter());
  view.labels.avoidTexts(TEXTS.map(getElement));
});
getElement("hand").hidden = innerHeight < LOW; // dials would cover a low picture
for (const id of ["view", "hint", "bar", ...TEXTS]) footerObserver.observe(getElement(id));
const drags = new DragHandler(view, page);

const keyboard = new Keyboard(getElement("keys"), { page, view, drags, presets, choosePreset });
const share = new ShareDialog(getElement("share"), page, view);
const toolbar = new Toolbar(getElement("bar"), page, drags, keyboard, share);

function choosePreset(preset) {
  if (!preset) return;
  page.replaceScene(preset);
  showHomeView(view);
  page.setRunning(!reducedMotion.matches);
}
let isStale = false; // whether the panel waits for a later frame, as during a drag
let drawn = {}; // the state at the last update
const hasChanged = (before) =>
  ["clock", "tops", "isRunning"].some((key) => before[key] !== page[key]);
function drawPanel() {
  isStale = false;
  const { clock, tops, isRunning } = page;
  drawn = { clock, tops, isRunning };
  panel.draw();
  predictions.draw();
  toolbar.draw();
  readout.update(page);
  charts.build();
  getElement("times").textContent = describeLateTops();
}
let isFirst = true;
page.onChange = () => {
  if (isFirst) view.render(); // while the panel is built, the graphics processor draws
  isFirst = false;
  if (drags.current) isStale = true;
  else drawPanel();
  wakeUp();
};
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => panel.repaint());
// Print on a light background.
let chosenScheme = "";
addEventListener("beforeprint", () => {
  chosenScheme = style.colorScheme;
  style.colorScheme = "light";
  panel.repaint();
  view.render();
});
addEventListener("afterprint", () => {
  style.colorScheme = chosenScheme;
  panel.repaint();
});
view.canvas.addEventListener("webglcontextlost", () =>
  page.showMessage("The browser has stopped drawing the picture for now"),
);
view.canvas.addEventListener("webglcontextrestored", () => page.showMessage(""));
// A double click shows one top alone in the charts, or all tops.
view.canvas.addEventListener("dblclick", ({ clientX, clientY }) => {
  const top = view.pick(clientX, clientY)?.i;
  const shown = page.scene.shown.map((_, i) => i === (top ?? i));
  page.setValue("shown", shown);
});

getElement("fold").addEventListener("click", () => {
  getElement("panel").hidden = !getElement("panel").hidden;
  getElement("fold").ariaExpanded = !getElement("panel").hidden;
});

// A viewer at rest requests no frames. Each change requests one.
let request = 0;
function wakeUp() {
  request ||= requestAnimationFrame(drawFrame);
}
view.requestFrame = wakeUp;
let lastFrame = null; // time of the previous frame while the motion runs
let nextUpdate = 0; // earliest time of the next update
function drawFrame(now) {
  request = 0;
  const rate = page.advanceFrame(lastFrame === null ? 0 : (now - lastFrame) / 1000);
  const isOutdated = () => isStale || hasChanged(drawn) || charts.clock !== page.clock;
  if (isOutdated() && now >= nextUpdate) {
    nextUpdate = now + 120;
    if (isStale || hasChanged(drawn)) drawPanel();
    charts.update();
  }
  showTime(rate);
  drags.updateHighlight();
  view.render();
  const isActive = page.isRunning || page.goal !== null || view.recording || isOutdated();
  lastFrame = isActive ? now : null;
  if (isActive) wakeUp();
}
function showTime(rate) {
  const more = page.goal ? ` → ${page.goal / TICKS}` : "";
  const digits = page.scene.speed < 0.2 ? 3 : 2;
  getElement("clock").textContent = `t = ${(page.clock / TICKS).toFixed(digits)}${more} s`;
  const slow =
    rate && `slower than the chosen pace: ${rate.toPrecision(2)} s per second`;
  getElement("clock").title = slow || "time";
}
// Describe the tops that are shown at another time than the clock, because they move in steps.
function describeLateTops() {
  const least = Math.min(...page.tops.map((top) => top.ticks));
  const words = page.tops.map((top, i) => {
    const [t] = simulation.getState(i);
    const waits = top.ticks > least && view.pixels[0] > NARROW;
    if (page.isRunning) return waits ? `${formatTopName(top)} waits for its next step` : "";
    const isBehind = Math.abs(t * TICKS - page.clock) > 0.5 && !simulation.getFailure(i);
    return isBehind ? `${formatTopName(top)} is shown at t = ${+t.toFixed(6)}` : "";
  });
  return words.filter(Boolean).join("\n");
}

function tryToOpen(open) {
  try {
    open();
  } catch (error) {
    if (!view.page) page.load(presets[0]);
    page.showMessage(`This scene cannot be shown: ${error.message}`);
  }
}
tryToOpen(() => page.load(decodeScene(location.hash) || JSON.parse(getElement("scene").textContent) || presets[0]));
const story = new Story(getElement("story"), choosePreset);
function openLink() {
  if (story.follow(location.hash)) return;
  const scene = decodeScene(location.hash);
  if (scene !== null) page.replaceScene(completeScene(scene));
}
addEventListener("hashchange", () => tryToOpen(openLink));
tryToOpen(() => story.follow(location.hash));
new ResizeObserver(() => charts.build()).observe(getElement("panel"));
// Inside a frame the motion waits, and the wheel scrolls the outer page until a click.
const isInFrame = window.parent !== window;
view.orbit.enableZoom = !isInFrame;
view.canvas.addEventListener("pointerdown", () => (view.orbit.enableZoom = true));
view.canvas.addEventListener("pointerleave", () => (view.orbit.enableZoom = !isInFrame));
if (!reducedMotion.matches && !isInFrame) setTimeout(() => page.setRunning(true), 600);
setTimeout(() => (getElement("hint").style.opacity = 0), 20000);
wakeUp();
requestAnimationFrame(() => setTimeout(drawThumbnails, 0, page.onChange)); // after the first frame

// Interface for tests and for the browser's console.
const locate = (part, i = 0, number = 0) => view.project(view.findHandle(part, i, number));
const advance = (t) => page.advance(Math.round(t * TICKS));
const readStates = () => page.tops.map((_, i) => Array.from(simulation.getState(i)));
window.kreisel = {
  page,
  view,
  drags,
  charts,
  share,
  simulation,
  presets,
  choosePreset,
  locate,
  advance,
  readStates,
};
