// The panel: what can be set and read, as a function of the page's state. lit-html writes what
// differs.
import { html, noChange, nothing, render } from "lit-html";
import { symbol, title } from "./charts.js";
import { measureOf, methods, stage, TICKS } from "./core.js";
import presets from "./presets.json";
import { valueAt } from "./scene.js";
import { toPython } from "./words.js";

const COMPONENTS = ["first", "second", "vertical"];
const SHAPE_NAMES = {
  free: "free",
  lagrange: "Lagrange: square",
  kowalewski: "Kowalewski",
  goryachev_chaplygin: "Goryachev-Chaplygin",
};
const LOG = { min: -5, max: 1, step: 0.05, log: true };
const FOUR = presets.find((preset) => preset.name === "Compare four");
const nameOf = (top) => `${top.role === "ghost" ? "ghost: " : ""}${top.method} ${top.step}`;
const button = (words, act, key = nothing, off = false) =>
  html`<button aria-keyshortcuts=${key} ?disabled=${off} @click=${act}>${words}</button>`;
const section = (words, content, { open = false, key = nothing } = {}) =>
  html`<details ?open=${open}>
    <summary aria-keyshortcuts=${key}>${words}</summary>${content}</details>`;
const HANDS = `1 .. ${presets.length}  What to look at
Escape  leave a drag or a jump
Shift, while dragging the green tip  along itself
Alt or middle button, at a corner  moves the fixed point
Double click  a top alone in the charts; a chart whole again`;

export class Panel {
  constructor(place, page, charts, files, choose) {
    Object.assign(this, { place, page, charts, files, choose, ends: {}, typed: null });
  }
  draw() {
    render([this.header(), this.plots(), ...this.sections()], this.place);
  }

  // A control shows what the scene has at a place, and asks the page to set what it reads off
  // itself. `back` tells what it shows then: another value than was asked for, or the old one.
  setter(place, read, back, gesture) {
    return ({ target }) => {
      this.typed = null;
      this.page.set(place, read(target), gesture);
      if (back) target.value = back();
    };
  }
  slider(words, place, { min = 0, max = 10, step = 0.1, log = false, off = false } = {}) {
    const where = () => {
      const x = valueAt(this.page.scene, place) ?? 0.2;
      return log ? Math.log10(x) : x;
    };
    const at = where();
    let [low, high] = this.ends[place] ?? [min, max]; // as wide as any value was
    low = Math.min(low, Math.floor(at / step) * step);
    high = Math.max(high, Math.ceil(at / step) * step);
    this.ends[place] = [low, high];
    const settle = () => (this.page.gesture = null);
    // Two digits make whole ticks, and small common multiples.
    const read = ({ valueAsNumber: to }) => (log ? +(10 ** to).toPrecision(2) : to);
    return html`<label class="slider">${words}
      <input type="range" min=${low} max=${high} step=${step} .value=${at} ?disabled=${off}
        @input=${this.setter(place, read, where, place)}
        @change=${settle} @pointerup=${settle}>
      ${this.number(`${words}, number`, place, { off })}</label>`;
  }
  number(words, place, { off = false, none = "" } = {}) {
    const show = () => this.shown(place);
    const read = (input) => input.valueAsNumber;
    const type = () => (this.typed = place); // somebody is at it
    const leave = () => (this.typed = null);
    return html`<input type="number" step="any" aria-label=${words}
      placeholder=${none} ?disabled=${off}
      .value=${this.typed === place ? noChange : show()} @focus=${type} @input=${type}
      @blur=${leave} @change=${this.setter(place, read, show)}>`;
  }
  // Returns a number as it is shown. The momentum is that of now.
  shown(place) {
    const [key, k] = place.split(".");
    const x = key === "momentum" ? this.page.leader()[5 + +k] : valueAt(this.page.scene, place);
    return x === null || x === undefined ? "" : +x.toPrecision(6);
  }
  check(words, place, key, on = valueAt(this.page.scene, place)) {
    return html`<label class="check"><input type="checkbox"
      aria-keyshortcuts=${key ?? nothing} .checked=${on}
      @change=${this.setter(place, (box) => box.checked)}>${words}</label>`;
  }
  // A choice is what it sets, its words, whether it is off, and what it is.
  select(words, place, choices) {
    const now = () => valueAt(this.page.scene, place) ?? "";
    const chosen = now();
    const option = ([value, text, off, about = nothing]) =>
      html`<option value=${value} title=${about} .selected=${value === chosen}
        ?disabled=${off}>${text}</option>`;
    const read = (list) => list.value;
    return html`<select aria-label=${words} @change=${this.setter(place, read, now)}>
      ${choices.map(option)}</select>`;
  }
  pair(words, control) {
    return html`<label class="pair">${words}${control}</label>`;
  }

  header() {
    const { page } = this;
    const moving = page.running || page.goal !== null;
    const known = presets.findIndex((preset) => preset.name === page.scene.name);
    const option = ({ name }, i) =>
      html`<option value=${i} .selected=${i === known}>${i + 1}  ${name}</option>`;
    const given = html`<option value="-1" .selected=${known < 0}
      ?hidden=${known >= 0}>${page.scene.name}</option>`;
    const choose = ({ target }) => this.choose(presets[target.value]);
    return html`<header>
      <div class="row"><label for="preset">What to look at</label>
        <span id="clock" role="timer" aria-label="Time"></span></div>
      <select id="preset" @change=${choose}>${presets.map(option)}${given}</select>
      <p id="about">${page.scene.about}</p>
      <div class="row">
        ${button(moving ? "Stop" : "Start", () => page.run(!moving), "Space")}
        ${button("Step", () => page.step(), "ArrowRight")}
        ${button("Reset", () => page.reset(), "R")}
        ${button("Undo", () => page.undo(), "Z Control+Z", !page.past.length)}
      </div>
    </header>`;
  }
  plots() {
    const { tops, scene, measures } = this.page;
    const drawn = title(measureOf(scene.chart));
    const choices = measures.map((each) => [each.name, title(each), false, each.text]);
    const common = stage.common();
    const meet = common ? `each ${common / TICKS}` : "too far on";
    return html`<section aria-label="Charts"><div ?hidden=${stage.rows() < 2} id="charts">
      <div class="row">${this.select("Quantity in the chart", "chart", choices)}
        ${this.check("log", "log")}</div>
      <div class="chart" role="img" aria-label="${drawn} over time"></div>
      <div ?hidden=${tops.every((top) => top.against < 0)}><b>Frame error L [rad]</b>
        <div class="chart" role="img" aria-label="Frame error over time"></div></div>
      ${this.table()}</div>
      <p ?hidden=${tops.length < 2}>Values are taken where all steps meet: ${meet}</p></section>`;
  }
  // The table has a row for each top: whether the charts show it, and its integrals.
  table() {
    const { tops, integrals } = this.page;
    const head = (each) => html`<th scope="col" title=${each.text}>${symbol(each)}`;
    const cell = (words) => html`<td>${words}`;
    const row = (top, i) => html`<tr><th scope="row" style="accent-color: ${top.colour}">
      ${this.check(nameOf(top), `shown.${i}`)}</th>${this.charts.integrals(i).map(cell)}`;
    return html`<table><caption>Integrals now, and their change since the start</caption>
      <thead><tr><th scope="col">top</th>${integrals.map(head)}</thead>
      <tbody id="integrals">${tops.map(row)}</tbody></table>`;
  }
  sections() {
    const files = Object.entries(this.files).map(([words, [act, key]]) => button(words, act, key));
    return [
      section("Motion", this.motion(), { open: true }),
      section("Body", this.body()),
      section("Compare", this.compare()),
      section("Looks: trace, rod, view", this.looks()),
      section("Save and share", [html`<div class="row">${files}</div>`, this.python()]),
      section("Keys", html`<p id="keys">${this.keys()}</p>`, { key: "?" }),
    ];
  }
  motion() {
    const jump = ({ target }) => (this.page.jump(target.valueAsNumber), (target.value = ""));
    return [
      this.slider("Step", "step.0", LOG),
      this.slider("Speed", "speed"),
      this.slider("Gravity", "gravity"),
      this.pair(
        "Jump to t",
        html`<input type="number" step="any" @change=${jump} aria-keyshortcuts="J">`,
      ),
      html`<fieldset><legend>Momentum m in space</legend>
        ${COMPONENTS.map((axis, k) => this.number(`Momentum, ${axis} component`, `momentum.${k}`))}
        </fieldset>
        <p>Green is the momentum m, blue the angular velocity ω, grey the vertical p.</p>`,
    ];
  }
  body() {
    const { mass, moments, com } = this.page.body;
    const short = (x) => +x.toPrecision(4);
    const all = (numbers) => numbers.map(short).join(", ");
    const capital = (first) => first.replace("_", "-").toUpperCase();
    const kind = this.page.kind.replace(/(^|_)./g, capital);
    return [
      this.pair("Shape", this.select("Shape", "shape", Object.entries(SHAPE_NAMES))),
      this.check("Corners move the fixed point (or Alt, middle button)", "corners"),
      html`<p id="body">${kind} top: mass ${short(mass)}, moments ${all(moments)},
        centre of mass ${all(com)} (along N, B, T)</p>`,
    ];
  }
  compare() {
    const { scene, body } = this.page;
    const choice = ([name, { suits }]) => [name, name, !suits(body, scene.gravity)];
    const choices = [...methods].map(choice);
    return [
      button("Compare four", () => this.choose(FOUR), "C"),
      this.pair("Method", this.select("Method", "methods.0", choices)),
      html`<p>${methods.get(scene.methods[0]).text}</p>`,
      this.pair("Beside it", this.select("Beside it", "methods.1", [["", "nothing"], ...choices])),
      this.slider("Distance", "distance", { max: 6 }),
      this.check("Each with a second step too", "both", null, scene.step.length > 1),
      this.slider("Second step", "step.1", { ...LOG, off: scene.step.length < 2 }),
      this.check("Ghost: as exact as the core can", "ghost"),
      this.pair("Tolerance", this.number("Tolerance of adaptive methods", "tol")),
      this.pair("Stop at t", this.number("Stop at t", "stop", { none: "never" })),
    ];
  }
  looks() {
    return [
      this.check("Trace of the apex", "show.trace", "T"),
      this.check("Elastic rod (Kirchhoff)", "show.rod", "E"),
      this.check("Principal axes and centre of mass", "show.axes", "P"),
      this.check("Floor", "show.floor"),
      this.check("2D view", "show.flat", "V"),
      this.slider("Opacity", "show.opacity", { max: 1, step: 0.05 }),
      this.slider("Thickness", "show.thickness", { min: 0.1, max: 4 }),
      button("From the next side", () => this.page.view.turn(), "A"),
    ];
  }
  python() {
    const words = toPython(this.page.scene);
    return html`<textarea readonly rows="9" wrap="off" aria-label="The same in Python"
      .value=${words}></textarea>`;
  }
  // Each control that has a key names it.
  keys() {
    const words = (control) => (control.labels?.[0] ?? control).textContent.trim();
    const all = [...document.querySelectorAll("[aria-keyshortcuts]")];
    const key = (control) => control.getAttribute("aria-keyshortcuts");
    const lines = all.map((control) => `${key(control)}  ${words(control)}`);
    return [...new Set(lines), HANDS].join("\n");
  }
}
