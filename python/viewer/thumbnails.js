// The strip of presets. Each has a small picture: the trace that its apex draws in the first seconds,
// seen from above at an angle. The traces are computed one by one after the first frame.
import { html, nothing } from "lit-html";
import { computeApart, makeBody, methods, simulation, TICKS, TRACE_POINTS } from "./core.js";
import presets from "./presets.json";
import { COLOURS, completeScene, findSuitable } from "./scene.js";
import { findContact } from "./setters.js";

const [STEP, SPAN] = [0.05, 12]; // of a trace at the pace ×1 [T]; faster ones have the same step
const METHODS = ["exact", "strang", "taylor"]; // the first suitable one
const ELEVATION = Math.PI / 4; // of the eye
const [COS, SIN] = [Math.cos(ELEVATION), Math.sin(ELEVATION)];
const FULL_DIGITS = 1e-15; // tolerance of adaptive methods
const [LEAST_SIZE, MARGIN] = [0.3, 1.12]; // half the size of the picture, on a sphere of radius 1
const SPHERE = '<circle r="1" stroke="currentColor" stroke-opacity=".35"/>';

const project = ([x, y, z]) => [x, -(z * COS + y * SIN)];
const formatPath = (points) => `M${points.map(([x, y]) => `${x.toFixed(2)} ${y.toFixed(2)}`).join("L")}`;
// Return the trace of a top, its newest point first.
function readTrace(i) {
  const numbers = new Float32Array(3 * TRACE_POINTS);
  const n = simulation.fillTrace(i, 1, numbers);
  return Array.from({ length: n }, (_, k) => Array.from(numbers.subarray(3 * k, 3 * k + 3)));
}
// Return the elastic rod whose tangent is the trace.
function makeRodLine(trace) {
  let at = [0, 0, 0];
  return trace.map((tangent) => (at = at.map((x, i) => x + STEP * tangent[i])));
}
// Compute the motion of a preset. Return the lines of its tops, and whether they are traces.
function computeLines(preset) {
  const scene = completeScene(preset);
  const body = makeBody(scene.body, scene.rotor, scene.wheel);
  const method = methods.get(findSuitable(METHODS, scene, body));
  const contact = findContact(scene, body);
  const starts = [[...scene.attitude, ...scene.momentum], ...(scene.second ? [scene.second] : [])];
  const step = STEP * Math.min(1, scene.speed);
  for (const start of starts) {
    const [q, m] = [start.slice(0, 4), start.slice(4)];
    simulation.addTop(body, scene, q, m, method, step * TICKS, FULL_DIGITS, -1);
    if (contact !== null) simulation.setFloor(contact);
  }
  const span = SPAN * scene.speed;
  simulation.advance(span * TICKS, (2 * span) / step);
  const { rod } = scene.show;
  const lines = starts.map((_, i) => (rod ? makeRodLine(readTrace(i)) : readTrace(i)).map(project));
  return { lines, isTrace: !rod };
}
// Return the picture of a preset: the content and the box of an SVG element.
function drawPreset(preset) {
  const { lines, isTrace } = computeLines(preset);
  const all = lines.flat();
  const [low, high] = [Math.min, Math.max].map((f) => [0, 1].map((i) => f(...all.map((p) => p[i]))));
  const half = Math.max(LEAST_SIZE, ...high.map((x, i) => (x - low[i]) / 2)) * MARGIN;
  const corner = low.map((x, i) => (x + high[i]) / 2 - half);
  const draw = (line, i) => {
    const [x, y] = line[0];
    const axis = isTrace ? `<path d="M0 0L${x} ${y}" stroke="currentColor"/>` : "";
    return `<g stroke="${COLOURS[2 * i]}">${axis}<path d="${formatPath(line)}" stroke-width="1.6"/>
      <path d="M${x} ${y}h0" stroke-width="6" stroke-linecap="round"/></g>`;
  };
  const content = (isTrace ? SPHERE : "") + lines.map(draw).reverse().join("");
  return { content, box: [...corner, 2 * half, 2 * half].map((x) => x.toFixed(2)).join(" ") };
}

const pictures = [];
// Compute all pictures, with time for events between them. Then call `show`.
export function drawThumbnails(show) {
  pictures.push(computeApart(() => drawPreset(presets[pictures.length])));
  if (pictures.length < presets.length) setTimeout(drawThumbnails, 0, show);
  else show();
}
// Render the strip; `known` is the index of the current preset, or -1 for another scene.
export function renderThumbnails(known, choosePreset) {
  const areDrawn = pictures.length === presets.length;
  const renderChoice = (preset, i) =>
    html`<label><input type="radio" name="preset" aria-label=${preset.name} .checked=${i === known}
      @change=${() => choosePreset(preset)}><svg viewBox=${areDrawn ? pictures[i].box : nothing}
      aria-hidden="true" .innerHTML=${areDrawn ? pictures[i].content : ""}></svg>${preset.name}</label>`;
  return html`<div class="strip"><div id="presets" role="radiogroup" aria-label="What to look at">
    ${presets.map(renderChoice)}</div>
    <button aria-label="More scenes" data-tip="More scenes" @click=${scrollStrip}>▸</button></div>`;
}
// Scroll the strip on by most of its width, or at its end back to its beginning.
function scrollStrip() {
  const strip = document.getElementById("presets");
  const { scrollLeft, scrollWidth, clientWidth } = strip;
  strip.scrollLeft = scrollLeft + clientWidth < scrollWidth - 1 ? scrollLeft + 0.8 * clientWidth : 0;
}
// Scroll the strip to the current preset.
export function showThumbnail(known) {
  const strip = document.getElementById("presets");
  const { offsetLeft = 0, offsetWidth = 0 } = strip.children[known] ?? {};
  strip.scrollLeft = offsetLeft - strip.offsetLeft - (strip.clientWidth - offsetWidth) / 2;
}
