// "How accurate is the computation?": methods and steps side by side, the change of the integrals,
// and the attitude error of each top against the best motion that is known.
import { html } from "lit-html";
import { symbol, title } from "./charts.js";
import { measureOf, methods, stage, TICKS } from "./core.js";
import presets from "./presets.json";

const LOG = { min: -5, max: 1, step: 0.05, log: true };
const FOUR = presets.find((preset) => preset.name === "Compare four");
export const nameOf = (top) => `${top.role === "ghost" ? "ghost: " : ""}${top.method} ${top.step}`;
const TRUTHS = {
  exact: "the exact motion, in closed form",
  taylor: "the Taylor series with all digits of a double",
};

export const chartPlace = (of, words) =>
  html`<div class="chart" data-of=${of} role="img" aria-label="${words} over time"></div>
    <p class="read"></p>`;

export function compute(panel) {
  const { scene, tops, integrals, truth } = panel.page;
  const choices = integrals.map((each) => [each.name, title(each), false, each.text]);
  const drawn = title(measureOf(scene.integral));
  const common = stage.common();
  const meet = common ? `every ${common / TICKS}` : "far beyond the time shown";
  return [
    ways(panel),
    html`<div class="row">${panel.select("Integral in the chart", "integral", choices)}
        ${panel.check("log", "log")}</div>
      ${chartPlace("integral", drawn)}
      <p><b>Attitude error [rad]</b>: the angle to ${TRUTHS[truth] ?? truth}</p>
      ${chartPlace("error", "Attitude error")}
      ${table(panel)}
      <p ?hidden=${tops.length < 2}>Compared ${meet}, where all steps meet.</p>`,
    panel.check("Ghost: show that motion in grey", "ghost"),
    panel.pair("Stop at t", panel.number("Stop at t", "stop", { none: "never" })),
  ];
}
function ways(panel) {
  const { scene, body } = panel.page;
  const choice = ([name, { suits }]) => [name, name, !suits(body, scene.gravity)];
  const choices = [...methods].map(choice);
  const beside = [["", "nothing"], ...choices];
  const { length } = scene.methods;
  return [
    panel.pair("Method", panel.select("Method", "methods.0", choices)),
    html`<p>${methods.get(scene.methods[0]).text}</p>`,
    panel.pair("Beside it", panel.select("Beside it", "methods.1", beside)),
    length < 2 ? "" : panel.pair("Third", panel.select("Third method", "methods.2", beside)),
    panel.slider("Step", "step.0", LOG),
    panel.check("Each with a second step too", "both", null, scene.step.length > 1 && !scene.own),
    panel.check("Second step for the other methods alone", "own"),
    panel.slider("Second step", "step.1", { ...LOG, off: scene.step.length < 2 }),
    panel.pair("Tolerance", panel.number("Tolerance of adaptive methods", "tol")),
    panel.slider("Distance", "distance", { max: 6 }),
    panel.button("Compare four", () => panel.page.set("methods.four", FOUR), "C"),
  ];
}
// The table has two rows for each top: whether the charts show it, and its integrals.
function table(panel) {
  const { tops, integrals } = panel.page;
  const head = (each) => html`<th scope="col" title=${each.text}>${symbol(each)}`;
  const cell = (words) => html`<td>${words}`;
  const rows = (top, i) => html`<tbody>
    <tr><th scope="rowgroup" colspan=${integrals.length} style="accent-color: ${top.colour}">
      ${panel.check(nameOf(top), `shown.${i}`)}</th></tr>
    <tr class="values">${panel.charts.integrals(i).map(cell)}</tr></tbody>`;
  return html`<table id="integrals">
    <caption>Integrals now, and their change since the start</caption>
    <thead><tr>${integrals.map(head)}</thead>${tops.map(rows)}</table>`;
}
