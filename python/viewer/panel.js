// The panel: what can be set and read, as a function of the page's state. lit-html writes what
// differs.
import { html, noChange, nothing, render } from "lit-html";
import { letKeysScroll, title } from "./charts.js";
import { chartPlace, compute } from "./compute.js";
import { measureOf, stage } from "./core.js";
import { remember } from "./memory.js";
import presets from "./presets.json";
import { valueAt } from "./rules.js";
import { aboutOf, tries } from "./tries.js";
import { toPython } from "./words.js";

const COMPONENTS = ["first", "second", "vertical"];
const SHAPE_NAMES = {
  free: "free",
  lagrange: "Lagrange: square",
  kowalewski: "Kowalewski",
  goryachev_chaplygin: "Goryachev-Chaplygin",
};
const SECTION_NAMES = [
  ["stiff", "as stiff as the body"],
  ["thesis", "as in the thesis: moments"],
  ["round", "round"],
];
const LIGHT_NAMES = [
  ["", "as in the system"],
  ["light", "light"],
  ["dark", "dark"],
];
const button = (words, act, key = nothing, off = false) =>
  html`<button aria-keyshortcuts=${key} ?disabled=${off} @click=${act}>${words}</button>`;
const section = (words, content, { open = false, toggle = nothing } = {}) =>
  html`<details ?open=${open} @toggle=${toggle}>
    <summary>${words}</summary>${content}</details>`;

// What is nothing beside a size, but for rounding, is nothing.
const dusted = (x, size) => (Math.abs(x) < 1e-12 * size ? 0 : x);

export class Panel {
  constructor(place, page, charts, files, choose) {
    Object.assign(this, { place, page, charts, files, choose, ends: {}, typed: null, button });
  }
  draw() {
    render([this.header(), this.plots(), ...this.sections()], this.place);
    letKeysScroll(document.getElementById("about"));
  }

  // A control shows what the scene has at a place, and asks the page to set what it reads off
  // itself. `back` tells what it shows then: another value than was asked for, or the old one. Why
  // a value cannot be is told beside the control until somebody is at it again.
  setter(place, read, back, gesture) {
    return ({ target }) => {
      this.typed = null;
      const why = this.page.set(place, read(target), gesture);
      this.wrong = why && { place, why };
      if (back) target.value = back();
      this.draw();
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
        aria-valuetext=${this.shown(place) || 0.2} @input=${this.setter(place, read, where, place)}
        @change=${settle} @pointerup=${settle}>
      ${this.number(`${words}, number`, place, { off })}</label>`;
  }
  number(words, place, { off = false, none = "" } = {}) {
    const show = () => this.shown(place);
    const read = (input) => input.valueAsNumber;
    // Somebody is at it.
    const type = () => {
      this.typed = place;
      if (this.wrong?.place === place) this.wrong = null;
      this.draw();
    };
    const leave = () => (this.typed = null);
    const why = this.wrong?.place === place ? this.wrong.why : "";
    return html`<span class="number"><input type="number" step="any" aria-label=${words}
      placeholder=${none} ?disabled=${off}
      .value=${this.typed === place ? noChange : show()} @focus=${type} @input=${type}
      @blur=${leave} @change=${this.setter(place, read, show)}
      ><span class="wrong" ?hidden=${!why}>${why}</span></span>`;
  }
  // Returns a number as it is shown. Momentum, tilt and spin are those of now.
  shown(place) {
    const x = this.value(place);
    const digits = /^(tilt|spin)$/.test(place) ? 5 : 6; // as fit into the field
    return Number.isFinite(x) ? +x.toPrecision(digits) : ""; // a top that failed has no tilt
  }
  value(place) {
    const { page } = this;
    const [key, k] = place.split(/\.(?=\d)/);
    if (key === "momentum") return page.leader()[5 + +k];
    if (key === "mass") return page.body.mass;
    if (key === "body.half") return page.view.body.half[k];
    if (key === "body.pivot") return dusted(-page.view.body.centre[k], page.view.reach);
    if (key === "density") return page.view.body.density;
    if (key !== "tilt" && key !== "spin") return valueAt(page.scene, place);
    const now = stage.measure(page.lead());
    return key === "spin" ? dusted(now.spin, 1) : dusted((now.nutation * 180) / Math.PI, 1);
  }
  check(words, place, key, on = valueAt(this.page.scene, place)) {
    return html`<label class="check"><input type="checkbox"
      aria-keyshortcuts=${key ?? nothing} .checked=${on}
      @change=${this.setter(place, (box) => box.checked)}>${words}</label>`;
  }
  // A choice is what it sets, its words, whether it is off, and what it is.
  select(words, place, choices, chosen = valueAt(this.page.scene, place) ?? "") {
    const now = () => valueAt(this.page.scene, place) ?? "";
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
    const known = presets.findIndex((preset) => preset.name === page.scene.name);
    const option = ({ name }, i) =>
      html`<option value=${i} .selected=${i === known}>${i + 1}  ${name}</option>`;
    const given = html`<option value="-1" .selected=${known < 0}
      ?hidden=${known >= 0}>${page.scene.name}</option>`;
    const choose = ({ target }) => this.choose(presets[target.value]);
    return html`<header>
      <label for="preset">What to look at</label>
      <select id="preset" @change=${choose}>${presets.map(option)}${given}</select>
      <p id="about">${aboutOf(page)}</p>
      ${this.start()}
      ${tries(page, this.choose)}
    </header>`;
  }
  // Says where the start is from.
  start() {
    const { page } = this;
    const { taken } = page.scene;
    const from = taken === null ? "as given" : `the motion at t = ${taken.toFixed(2)} s`;
    return html`<p id="start">Start: ${from}</p><div class="row">
      ${button("Start again from this moment", () => page.take(), nothing, !page.clock)}
      ${button("Reset", () => page.reset(), "0")}</div>`;
  }
  plots() {
    const { page } = this;
    const drawn = title(measureOf(page.scene.chart));
    const choices = page.measures.map((each) => [each.name, title(each), false, each.text]);
    return html`<section aria-label="Charts" id="charts">
      <div class="row">${this.select("Quantity in the chart", "chart", choices)}
        <button aria-pressed=${!!page.large} aria-keyshortcuts="L"
          @click=${() => this.enlarge()}>Larger</button></div>
      ${chartPlace("chart", drawn)}</section>`;
  }
  enlarge() {
    this.page.large = !this.page.large;
    document.body.classList.toggle("large", this.page.large);
    this.page.tell();
  }
  sections() {
    const files = Object.entries(this.files).map(([words, [act, key]]) => button(words, act, key));
    const unfold = () => this.charts.build();
    return [
      section("Motion", this.motion(), { open: true }),
      section("Body", this.body()),
      section("How accurate is the computation?", compute(this), { toggle: unfold }),
      section("Looks: trace, rod, view", this.looks()),
      section("Save and share", [html`<div class="row">${files}</div>`, this.python()]),
    ];
  }
  motion() {
    const jump = ({ target }) => (this.page.jump(target.valueAsNumber), (target.value = ""));
    return [
      this.slider("Speed", "speed"),
      this.slider("Gravity", "gravity"),
      html`<div class="pairs">
        ${this.pair("Tilt [°]", this.number("Tilt, degrees", "tilt"))}
        ${this.pair("Spin", this.number("Spin, number", "spin"))}</div>`,
      this.pair(
        "Jump to t",
        html`<input type="number" step="any" @change=${jump} aria-keyshortcuts="J">`,
      ),
      html`<fieldset><legend>Angular momentum m in space</legend>
        ${COMPONENTS.map((axis, k) => this.number(`Momentum, ${axis} component`, `momentum.${k}`))}
        </fieldset>
        <p>Green: angular momentum m. Blue: angular velocity ω. Grey: the vertical p. Units: s, m,
          kg, or any other consistent set.</p>`,
    ];
  }
  body() {
    const { mass, moments, com } = this.page.body;
    const { reach } = this.page.view;
    const short = (x) => +dusted(x, reach).toPrecision(4);
    const all = (numbers) => numbers.map(short).join(", ");
    const capital = (first) => first.replace("_", "-").toUpperCase();
    const kind = this.page.kind.replace(/(^|_)./g, capital);
    const three = (words, place) => html`<fieldset><legend>${words}</legend>
      ${["N", "B", "T"].map((axis, k) => this.number(`${words}, ${axis}`, `${place}.${k}`))}
      </fieldset>`;
    return [
      this.pair("Shape", this.select("Shape", "shape", Object.entries(SHAPE_NAMES))),
      three("Half edges", "body.half"),
      three("Fixed point, from the centre", "body.pivot"),
      html`<div class="pairs">${this.pair("Mass", this.number("Mass, number", "mass"))}
        ${this.pair("Density", this.number("Density, number", "density"))}</div>`,
      this.check("Corners move the fixed point (or Alt, middle button)", "corners"),
      html`<p id="body">${kind} top: mass ${short(mass)}, moments ${all(moments)},
        centre of mass ${all(com)} (along N, B, T)</p>`,
    ];
  }
  looks() {
    const { view } = this.page;
    const solids = [
      ["top", "round top", !view.turned],
      ["box", "box"],
      ["none", "nothing"],
    ];
    const isHidden = this.page.scene.show.solid === "none";
    const drawn = isHidden ? "none" : view.asTop ? "top" : "box"; // other bodies are boxes
    return [
      this.pair("Show as", this.select("Show as", "show.solid", solids, drawn)),
      this.check("Trace of the apex", "show.trace", "T"),
      this.check("Elastic rod (Kirchhoff)", "show.rod", "E"),
      this.pair("Section", this.select("Rod's section", "show.section", SECTION_NAMES)),
      this.check("Principal axes and centre of mass", "show.axes", "P"),
      this.check("Drop lines", "show.drops", "G"),
      this.check("Floor", "show.floor"),
      this.check("2D view", "show.flat", "V"),
      this.pair("Light", this.light()),
      this.slider("Opacity", "show.opacity", { max: 1, step: 0.05 }),
      this.slider("Thickness", "show.thickness", { min: 0.1, max: 4 }),
      html`<div class="row">${button("From the next side", () => view.turn(), "N")}
        <button aria-pressed=${!!this.page.big} aria-keyshortcuts="B"
          @click=${() => this.enbig()}>Projector</button></div>`,
    ];
  }
  // Light or dark is as the system has it, until somebody chooses, for later visits too.
  light() {
    const { style } = document.documentElement;
    const set = ({ target }) => {
      style.colorScheme = target.value;
      remember(target.value);
      this.repaint();
    };
    const option = ([value, text]) =>
      html`<option value=${value} .selected=${value === style.colorScheme}>${text}</option>`;
    return html`<select aria-label="Light or dark" @change=${set}>
      ${LIGHT_NAMES.map(option)}</select>`;
  }
  // For a hall: large letters, large charts, and as much contrast as a projector can make.
  enbig() {
    this.page.big = !this.page.big;
    document.body.classList.toggle("projector", this.page.big);
    this.repaint();
  }
  repaint() {
    this.page.view.paint();
    this.page.view.build(this.page, false);
    this.page.tell();
  }
  python() {
    const words = toPython(this.page.scene);
    const copy = () => {
      const copied = () => this.page.say("Copied");
      navigator.clipboard?.writeText(words).then(copied, () => this.page.say("Copy it by hand"));
    };
    return html`<textarea readonly rows="9" wrap="off" aria-label="The same in Python"
      .value=${words}></textarea>${button("Copy", copy)}`;
  }
}
