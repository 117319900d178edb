// Section "How accurate is the computation?": methods and steps, the changes of the integrals, and
// the attitude error of each top against a reference.
import { html } from "lit-html";
import { getSymbol, getTitle } from "./charts.js";
import { formatMethod } from "./scene.js";
import { findMeasure, methods, simulation, TICKS } from "./core.js";
import presets from "./presets.json";

const LOG_SLIDER = { min: -5, max: 1, step: 0.05, log: true };
const FOUR = presets.find((preset) => preset.name === "Compare four");
export const formatTopName = (top) => `${top.role === "ghost" ? "ghost: " : ""}${formatMethod(top)}`;
const REFERENCES = {
  exact: "the exact motion, in closed form",
  taylor: "the Taylor series with all digits of a double",
};

export const renderChartPlace = (of, words) =>
  html`<div class="chart" data-of=${of} role="img" aria-label="${words} over time"></div>
    <p class="read"></p>`;

export function renderAccuracy(panel) {
  const { scene, tops, integrals, reference } = panel.page;
  const choices = integrals.map((each) => [each.name, getTitle(each), false, each.description]);
  const drawn = getTitle(findMeasure(scene.integral));
  const common = simulation.getCommonStep();
  const meeting = common ? `every ${common / TICKS}` : "far beyond the time shown";
  return [
    renderMethods(panel),
    html`<div class="row">${panel.renderSelect("Integral in the chart", "integral", choices)}
        ${panel.renderCheckbox("log", "log")}</div>
      ${renderChartPlace("integral", drawn)}
      <p><b>Attitude error [rad]</b>: the angle to ${REFERENCES[reference] ?? reference}</p>
      ${renderChartPlace("error", "Attitude error")}
      ${renderTable(panel)}
      <p ?hidden=${tops.length < 2}>Compared ${meeting}, where all steps meet.</p>`,
    panel.renderCheckbox("Ghost: show that motion in grey", "ghost"),
    panel.renderPair("Stop at t", panel.renderNumber("Stop at t", "stop", { none: "never" })),
  ];
}
function renderMethods(panel) {
  const { scene, body } = panel.page;
  const makeChoice = ([name, { isSuitable }]) => [name, name, !isSuitable(body, scene)];
  const choices = [...methods].map(makeChoice);
  const beside = [["", "nothing"], ...choices];
  const { length } = scene.methods;
  return [
    panel.renderPair("Method", panel.renderSelect("Method", "methods.0", choices)),
    html`<p>${methods.get(scene.methods[0]).description}</p>`,
    panel.renderPair("Beside it", panel.renderSelect("Beside it", "methods.1", beside)),
    length < 2
      ? ""
      : panel.renderPair("Third", panel.renderSelect("Third method", "methods.2", beside)),
    panel.renderSlider("Step", "step.0", LOG_SLIDER),
    panel.renderCheckbox(
      "Each with a second step too",
      "both",
      null,
      scene.step.length > 1 && !scene.own,
    ),
    panel.renderCheckbox("Second step for the other methods only", "own"),
    panel.renderSlider("Second step", "step.1", { ...LOG_SLIDER, off: scene.step.length < 2 }),
    panel.renderPair("Tolerance", panel.renderNumber("Tolerance of adaptive methods", "tol")),
    panel.renderSlider("Distance", "distance", { max: 6 }),
    panel.renderButton("Compare four", () => panel.page.setValue("methods.four", FOUR), "C"),
  ];
}
// Render two rows for each top: a checkbox that shows the top in the charts, and its integrals.
function renderTable(panel) {
  const { tops, integrals } = panel.page;
  const renderHead = (each) => html`<th scope="col" title=${each.description}>${getSymbol(each)}`;
  const renderCell = (words) => html`<td>${words}`;
  const renderRows = (top, i) => html`<tbody>
    <tr><th scope="rowgroup" colspan=${integrals.length} style="accent-color: ${top.colour}">
      ${panel.renderCheckbox(formatTopName(top), `shown.${i}`)}</th></tr>
    <tr class="values">${panel.charts.formatIntegrals(i).map(renderCell)}</tr></tbody>`;
  return html`<table id="integrals">
    <caption>Integrals now, and their change since the start</caption>
    <thead><tr>${integrals.map(renderHead)}</thead>${tops.map(renderRows)}</table>`;
}
