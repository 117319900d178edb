// The panel of controls, charts and tables, rendered by lit-html from the state of the viewer.
import { html, noChange, nothing, render } from "lit-html";
import { letKeysScroll, getTitle } from "./charts.js";
import { renderChartPlace, renderAccuracy } from "./accuracy.js";
import { findMeasure, simulation } from "./core.js";
import { saveText } from "./storage.js";
import presets from "./presets.json";
import { getValue } from "./setters.js";
import { describeStart, findExercise, renderExercises, renderStoryLink, renderWords } from "./exercises.js";
import { renderThumbnails, showThumbnail } from "./thumbnails.js";
import { toPython } from "./text_export.js";
import { THINGS } from "./things.js";

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
// Accelerations at the surface [m/s²].
const GRAVITIES = [
  ["Earth", 9.81],
  ["Moon", 1.62],
  ["Jupiter", 24.8],
];
const COLOR_SCHEMES = [
  ["", "as in the system"],
  ["light", "light"],
  ["dark", "dark"],
];
const renderButton = (words, act, key = nothing, off = false) =>
  html`<button aria-keyshortcuts=${key} ?disabled=${off} @click=${act}>${words}</button>`;
const renderSection = (words, content, { open = false, toggle = nothing } = {}) =>
  html`<details ?open=${open} @toggle=${toggle}>
    <summary>${words}</summary>${content}</details>`;

const findPresetNumber = (name) => presets.findIndex((preset) => preset.name === name);

// Replace rounding errors by zero.
const dropRounding = (x, size) => (Math.abs(x) < 1e-12 * size ? 0 : x);

// Return the next larger number with one digit.
function roundUp(x) {
  const unit = 10 ** Math.floor(Math.log10(x));
  return Math.ceil(x / unit) * unit;
}

// Format a number for a field, which cuts off the end of a longer text.
function formatNumber(x, digits) {
  const size = Math.abs(x);
  if (x === 0 || (size >= 1e-3 && size < 1e8)) return String(+x.toPrecision(digits));
  return (+x.toPrecision(3)).toExponential().replace("+", "");
}

export class Panel {
  constructor(place, page, charts, files, choosePreset, predictions) {
    Object.assign(this, {
      place,
      page,
      charts,
      files,
      choosePreset,
      predictions,
      typedPlace: null,
      renderButton,
    });
  }
  draw() {
    const { origin } = this.page;
    if (this.origin !== origin) {
      const most = this.chooseEnds();
      // The exercises of a scene have one scale of spins, so that a faster top has its knob further right.
      if (this.origin?.name === origin.name) most.spin = Math.max(most.spin, this.most.spin);
      Object.assign(this, { origin, sliderEnds: {}, most });
    }
    render(this.renderHint(), document.getElementById("hint"));
    render(this.renderHand(), document.getElementById("hand"));
    render([this.renderHeader(), this.renderChart(), ...this.renderSections()], this.place);
    letKeysScroll(document.getElementById("about"));
    const { name } = this.page.scene;
    if (this.name === name) return;
    this.name = name;
    showThumbnail(findPresetNumber(name));
  }

  // Make the event handler of a control, which sets its value at a place of the scene. `back`
  // returns the value that the control shows afterwards. The reason of a refusal is shown beside
  // the control until the next edit.
  makeSetter(place, read, back, gesture) {
    return ({ target }) => {
      this.typedPlace = null;
      const why = this.page.setValue(place, read(target), gesture);
      this.refused = why && { place, why };
      if (back) target.value = back();
      this.draw();
    };
  }
  renderSlider(words, place, { min = 0, max = 10, step = 0.1, log = false, off = false } = {}) {
    const where = () => {
      const known = this.getValue(place);
      const x = Number.isFinite(known) ? known : 0.2;
      return log ? Math.log10(x) : x;
    };
    const at = where();
    let [low, high] = this.sliderEnds[place] ?? [min, max]; // widened by each value outside
    low = Math.min(low, Math.floor(at / step) * step);
    high = Math.max(high, Math.ceil(at / step) * step);
    this.sliderEnds[place] = [low, high];
    const endGesture = () => (this.page.gesture = null);
    // Two digits give whole ticks and small common multiples.
    const read = ({ valueAsNumber: to }) => (log ? +(10 ** to).toPrecision(2) : to);
    return html`<label class="slider">${words}
      <input type="range" min=${low} max=${high} step=${step} .value=${at} ?disabled=${off}
        aria-valuetext=${this.formatValue(place) || 0.2}
        @input=${this.makeSetter(place, read, where, place)}
        @change=${endGesture} @pointerup=${endGesture}>
      ${this.renderNumber(`${words}, number`, place, { off })}</label>`;
  }
  renderNumber(words, place, { off = false, none = "" } = {}) {
    const show = () => this.formatValue(place);
    const read = (input) => input.valueAsNumber;
    const set = this.makeSetter(place, read, show);
    // The user is editing the field.
    const beginEdit = ({ type }) => {
      Object.assign(this, { typedPlace: place, isTyped: type === "input" });
      if (this.refused?.place === place) this.refused = null;
      this.draw();
    };
    // The browser reports no change if the typed value is the one shown when the edit began,
    // although the motion may have gone on since then.
    const endEdit = (event) => {
      const isMissed = this.typedPlace === place && this.isTyped && event.target.value !== show();
      this.typedPlace = null;
      if (isMissed) set(event);
    };
    const why = this.refused?.place === place ? this.refused.why : "";
    return html`<span class="number"><input type="number" step="any" aria-label=${words}
      placeholder=${none} ?disabled=${off}
      .value=${this.typedPlace === place ? noChange : show()}
      @focus=${beginEdit} @input=${beginEdit}
      @blur=${endEdit} @change=${set}
      ><span class="wrong" ?hidden=${!why}>${why}</span></span>`;
  }
  // Format the number at a place. Momentum, tilt and spin are the current ones.
  formatValue(place) {
    const x = this.getValue(place);
    const digits = /^(tilt|spin)$/.test(place) ? (x < 0 ? 4 : 5) : 6; // that fit into the field
    return Number.isFinite(x) ? formatNumber(x, digits) : ""; // a failed top has no tilt
  }
  getValue(place) {
    const { page } = this;
    const [key, k] = place.split(/\.(?=\d)/);
    if (key === "momentum") return page.readLiveState()[5 + +k];
    if (key === "mass") return page.body.mass;
    if (key === "body.half") return page.view.body.half[k];
    if (key === "body.pivot") return dropRounding(-page.view.body.centre[k], page.view.bodySize);
    if (key === "density") return page.view.body.density;
    if (key !== "tilt" && key !== "spin") return getValue(page.scene, place);
    const now = simulation.measureTop(page.findLiveTop());
    return key === "spin"
      ? dropRounding(now.spin, 1)
      : dropRounding((now.nutation * 180) / Math.PI, 1);
  }
  renderCheckbox(words, place, key, on = getValue(this.page.scene, place)) {
    return html`<label class="check"><input type="checkbox"
      aria-keyshortcuts=${key ?? nothing} .checked=${on}
      @change=${this.makeSetter(place, (box) => box.checked)}>${words}</label>`;
  }
  // Render a menu. A choice is [value, text, whether disabled, tooltip].
  renderSelect(words, place, choices, chosen = getValue(this.page.scene, place) ?? "") {
    const now = () => getValue(this.page.scene, place) ?? "";
    const option = ([value, text, off, about = nothing]) =>
      html`<option value=${value} title=${about} .selected=${value === chosen}
        ?disabled=${off}>${text}</option>`;
    const read = (list) => list.value;
    return html`<select aria-label=${words} @change=${this.makeSetter(place, read, now)}>
      ${choices.map(option)}</select>`;
  }
  renderPair(words, control) {
    return html`<label class="pair">${words}${control}</label>`;
  }

  renderHeader() {
    const { page } = this;
    const known = findPresetNumber(page.scene.name);
    const { title } = findExercise(page.scene) ?? {};
    return html`<header>
      ${renderThumbnails(known, this.choosePreset)}
      <h2 id="preset">${known < 0 ? "" : known + 1} ${page.scene.name}</h2>
      ${renderStoryLink(page.scene)}
      <div id="about">${title ? html`<h3>${title}</h3>` : ""}<p>${renderWords(page)}</p></div>
      ${renderExercises(page, this.choosePreset, this.predictions)}
    </header>`;
  }
  // Return the ends of sliders, for the momentum and the angular velocity of the scene.
  chooseEnds() {
    const { page } = this;
    const rate = Math.hypot(...simulation.getVelocity(page.findLiveTop()));
    const size = Math.hypot(...page.readLiveState().slice(5));
    return {
      spin: roundUp(2.5 * Math.max(4, Math.abs(this.getValue("spin")) || 0)),
      friction: roundUp(0.01 * size * rate) || 2,
      damping: roundUp(0.02 * size) || 0.2,
      rotor: roundUp(2 * size) || 20,
    };
  }
  // Render what can be dragged in the picture.
  renderHint() {
    const { scene, view } = this.page;
    const hasTip = scene.show.momentum;
    const round = html`Swipe the rim<span class="mouse"> to spin it</span>, drag the pen<span
      class="mouse"> to tilt it</span>${hasTip ? ", or the green tip" : ""}.`;
    const others = hasTip ? "Drag the green tip." : "Drag to look round.";
    return html`${view.isRevolution ? round : others} <span class="mouse"><kbd>Space</kbd>
      starts and stops, <kbd>?</kbd> lists all keys.</span>`;
  }
  // Render the dials in the picture.
  renderHand() {
    const { page } = this;
    const renderGravity = ([name, g]) => html`<button aria-pressed=${page.scene.gravity === g}
      @click=${() => page.setValue("gravity", g)}>${name}</button>`;
    const { most } = this;
    return html`${this.renderSlider("Spin", "spin", { max: most.spin, step: most.spin / 200 })}
      ${this.renderSlider("Tilt [°]", "tilt", { max: 180, step: 1 })}
      ${this.renderSlider("Gravity", "gravity", { max: 25 })}
      <div class="row" role="group" aria-label="Gravity of">${GRAVITIES.map(renderGravity)}</div>`;
  }
  // Render the origin of the start.
  renderStart() {
    const { page } = this;
    return html`<p id="start">Start: ${describeStart(page)}</p><div class="row">
      ${renderButton("Start from this moment", () => page.startFromNow(), nothing, !page.clock)}
      ${renderButton("Reset", () => page.reset(), "0")}</div>`;
  }
  renderChart() {
    const { page } = this;
    const drawn = getTitle(findMeasure(page.scene.chart));
    const choices = page.measures.map((each) => [
      each.name,
      getTitle(each),
      false,
      each.description,
    ]);
    return html`<section aria-label="Charts" id="charts">
      <div class="row">${this.renderSelect("Quantity in the chart", "chart", choices)}
        <button aria-pressed=${!!page.hasLargeCharts} aria-keyshortcuts="L"
          @click=${() => this.toggleLargeCharts()}>Larger</button></div>
      ${renderChartPlace("chart", drawn)}</section>`;
  }
  toggleLargeCharts() {
    this.page.hasLargeCharts = !this.page.hasLargeCharts;
    document.body.classList.toggle("large", this.page.hasLargeCharts);
    this.page.onChange();
    document.getElementById("charts").scrollIntoView({ block: "nearest" });
  }
  renderSections() {
    const files = Object.entries(this.files).map(([words, [act, key]]) =>
      renderButton(words, act, key),
    );
    const buildCharts = () => this.charts.build();
    return [
      renderSection("Motion", this.renderMotion(), { open: true }),
      renderSection("Body", this.renderBody()),
      renderSection("How accurate is the computation?", renderAccuracy(this), {
        toggle: buildCharts,
      }),
      renderSection("Looks: arrows, trace, rod, view", this.renderLooks()),
      renderSection("Save", [html`<div class="row">${files}</div>`, this.renderPython()]),
    ];
  }
  renderMotion() {
    const number = (axis, k) => this.renderNumber(`Momentum, ${axis} component`, `momentum.${k}`);
    const { friction, damping } = this.most;
    const jumpToField = ({ target }) => (
      this.page.jumpTo(target.valueAsNumber),
      (target.value = "")
    );
    return [
      this.renderSlider("Friction", "friction", { max: friction, step: friction / 100 }),
      this.renderSlider("Damping", "damping", { max: damping, step: damping / 100 }),
      this.renderSlider("Turntable", "turning.2", { min: -2, max: 2, step: 0.05 }),
      this.renderCheckbox("Seen from the room around the turntable", "show.room", "U"),
      this.renderPair(
        "Jump to t",
        html`<input type="number" step="any" @change=${jumpToField} aria-keyshortcuts="J">`,
      ),
      html`<fieldset><legend>Angular momentum m in space</legend>
        ${COMPONENTS.map(number)}
        </fieldset>`,
      this.renderStart(),
      html`<p>Units: s, m, kg (friction in N m, damping in N m s), or any other consistent set.</p>`,
    ];
  }
  renderBody() {
    const { mass, moments, com } = this.page.body;
    const { bodySize } = this.page.view;
    const { rotor } = this.most;
    const formatShort = (x) => +dropRounding(x, bodySize).toPrecision(4);
    const [unit, times] = bodySize < 1 ? ["cm", 100] : ["m", 1];
    const all = (numbers) => numbers.map(formatShort).join(", ");
    const toCapital = (first) => first.replace("_", "-").toUpperCase();
    const kind = this.page.kind.replace(/(^|_)./g, toCapital);
    const three = (words, place) => html`<fieldset><legend>${words}</legend>
      ${["N", "B", "T"].map((axis, k) => this.renderNumber(`${words}, ${axis}`, `${place}.${k}`))}
      </fieldset>`;
    return [
      this.renderPair("Shape", this.renderSelect("Shape", "shape", Object.entries(SHAPE_NAMES))),
      three("Half edges", "body.half"),
      three("Fixed point, from the centre", "body.pivot"),
      html`<div class="pairs">${this.renderPair("Mass", this.renderNumber("Mass, number", "mass"))}
        ${this.renderPair("Density", this.renderNumber("Density, number", "density"))}</div>`,
      this.renderSlider("Rotor", "rotor.2", { min: -rotor, max: rotor, step: rotor / 200 }),
      this.renderCheckbox("Corners move the fixed point (or Alt, middle button)", "corners"),
      html`<p id="body">${kind} top: mass ${formatShort(mass)} kg, moments ${all(moments)} kg m²,
        centre of mass ${all(com.map((x) => x * times))} ${unit} (along N, B, T)</p>`,
    ];
  }
  renderLooks() {
    const { view } = this.page;
    const solids = [
      ["top", "round top", !view.revolution],
      ["box", "box"],
      ...Object.entries(THINGS).map(([key, { name, isRound }]) => [key, name, isRound && !view.revolution]),
      ["none", "nothing"],
    ];
    const isHidden = this.page.scene.show.solid === "none";
    // Bodies that are not symmetric about an axis through the fixed point are drawn as boxes.
    const { solid } = this.page.scene.show;
    const drawn = isHidden ? "none" : view.thing ? solid : view.isRevolution ? "top" : "box";
    return [
      this.renderPair("Show as", this.renderSelect("Show as", "show.solid", solids, drawn)),
      this.renderCheckbox("Arrows", "show.arrows", "I"),
      this.renderCheckbox("Weight and torque, path of m", "show.torque", "Q"),
      this.renderCheckbox("Angular momentum m (green)", "show.momentum", "M"),
      this.renderCheckbox("Angular velocity ω (blue)", "show.velocity", "O"),
      this.renderCheckbox("Vertical p (grey)", "show.vertical"),
      this.renderCheckbox("Trace of the apex", "show.trace", "T"),
      this.renderCheckbox("Elastic rod (Kirchhoff)", "show.rod", "E"),
      this.renderPair("Section", this.renderSelect("Rod's section", "show.section", SECTION_NAMES)),
      this.renderCheckbox("Principal axes and centre of mass", "show.axes", "P"),
      this.renderCheckbox("Drop lines", "show.drops", "G"),
      this.renderCheckbox("Floor", "show.floor"),
      this.renderCheckbox("2D view", "show.flat", "V"),
      this.renderPair("Light", this.renderColorScheme()),
      this.renderSlider("Opacity", "show.opacity", { max: 1, step: 0.05 }),
      this.renderSlider("Thickness", "show.thickness", { min: 0.1, max: 4 }),
      html`<div class="row">${renderButton("View next side", () => view.showNextSide(), "N")}
        <button aria-pressed=${!!this.page.isProjector} aria-keyshortcuts="B"
          @click=${() => this.toggleProjector()}>Projector</button></div>`,
    ];
  }
  // Render the choice of the colour scheme, which is stored for later visits.
  renderColorScheme() {
    const { style } = document.documentElement;
    const set = ({ target }) => {
      style.colorScheme = target.value;
      saveText("light or dark", target.value);
      this.repaint();
    };
    const option = ([value, text]) =>
      html`<option value=${value} .selected=${value === style.colorScheme}>${text}</option>`;
    return html`<select aria-label="Light or dark" @change=${set}>
      ${COLOR_SCHEMES.map(option)}</select>`;
  }
  // Toggle large text, large charts and strong contrast, for a projector.
  toggleProjector() {
    this.page.isProjector = !this.page.isProjector;
    document.body.classList.toggle("projector", this.page.isProjector);
    this.repaint();
  }
  repaint() {
    this.page.view.updateBackground();
    this.page.view.build(this.page, false);
    this.page.onChange();
  }
  renderPython() {
    const words = toPython(this.page.scene, this.page.contact);
    const copyProgram = () => {
      const reportCopy = () => this.page.showMessage("Copied");
      navigator.clipboard
        ?.writeText(words)
        .then(reportCopy, () => this.page.showMessage("Copying failed: select the text and copy it"));
    };
    return html`<textarea readonly rows="9" wrap="off" aria-label="Equivalent Python program"
      .value=${words}></textarea>${renderButton("Copy", copyProgram)}`;
  }
}
