// Two charts of the record, of a measure that is chosen and of the frame error, and what the table
// of integrals says.
import uPlot from "uplot";
import { measureOf, stage } from "./core.js";

// What has no symbol goes by its name.
const SYMBOLS = {
  energy: "E",
  vertical_momentum: "⟨m, e₃⟩",
  axial_momentum: "⟨m, a⟩",
  kowalewski: "K",
  goryachev_chaplygin: "G",
};
const inWords = (name) => name.replaceAll("_", " ");
export const symbol = ({ name }) => SYMBOLS[name] ?? inWords(name);
// Integrals are drawn as a change, for only that is to be seen of them.
export const title = ({ name, kept }) => (kept ? "Change of " : "") + inWords(name);

const style = (id) => getComputedStyle(document.getElementById(id));
function short(x) {
  if (x === 0) return "0";
  const plain = Math.abs(x) >= 0.01 && Math.abs(x) < 1000;
  return plain ? String(+x.toPrecision(3)) : x.toExponential(0);
}
// Returns powers of ten to write at an axis, at most four.
function decades(low, high) {
  const [from, to] = [Math.floor(Math.log10(low)), Math.ceil(Math.log10(high))];
  const step = Math.ceil((to - from + 1) / 4);
  const count = Math.floor((to - from) / step) + 1;
  return Array.from({ length: count }, (_, i) => 10 ** (from + i * step));
}
// A line that does not move has this height.
const LEVEL = 1e-16;
const range = (_, low, high) =>
  high > low ? uPlot.rangeNum(low, high, 0.1, true) : [low - LEVEL, high + LEVEL];

export class Charts {
  constructor(page) {
    this.page = page;
  }
  // Makes the charts anew for other tops, another measure or scale.
  build() {
    const { tops, scene } = this.page;
    const width = document.getElementById("panel").clientWidth - 28;
    const dark = matchMedia("(prefers-color-scheme: dark)").matches;
    const looks = JSON.stringify([scene.chart, scene.log, scene.shown, width, dark]);
    if (width < 0 || (this.tops === tops && this.looks === looks)) return;
    Object.assign(this, { tops, looks, width });
    this.plots?.forEach((plot) => plot.destroy());
    const places = [...document.querySelectorAll(".chart")];
    const plot = (place, second) => new uPlot(this.options(second), this.data(second), place);
    this.plots = places.map(plot);
  }
  options(second) {
    const { log, shown } = this.page.scene;
    const series = this.tops.map((top, i) => ({
      stroke: top.colour,
      width: 1.5,
      dash: top.role === "thin" ? [5, 3] : undefined,
      show: shown[i] && !(second && top.against < 0),
      points: { show: false },
      spanGaps: true,
    }));
    const grid = { stroke: style("preset").borderTopColor, width: 1 };
    const font = "11px system-ui";
    const ink = { stroke: style("about").color, grid, ticks: { show: false }, font };
    const values = (_, all) => all.map((x) => (x === null ? "" : short(x)));
    const splits = (_, axis, low, high) => decades(low, high);
    const powers = log && { splits, filter: (_, all) => all };
    return {
      width: this.width,
      height: 118,
      legend: { show: false },
      cursor: { drag: { x: true, y: false }, sync: { key: "time" } },
      scales: { x: { time: false }, y: log ? { distr: 3 } : { range } },
      axes: [
        { ...ink, size: 22 },
        { ...ink, size: 48, space: 16, values, ...powers },
      ],
      series: [{}, ...series],
    };
  }
  data(second) {
    const { log, chart } = this.page.scene;
    const { name, kept } = measureOf(second ? "error" : chart);
    const pairs = (one, other) => one.flatMap((x, row) => [x, other[row]]);
    const drawn = (x) => (Number.isNaN(x) ? null : log ? Math.abs(x) || null : x);
    const lines = this.tops.map((_, i) => {
      const start = kept ? stage.record(i, name)[0] : 0;
      const ends = pairs(stage.record(i, name, -1), stage.record(i, name, 1));
      return ends.map((x) => drawn(x - start));
    });
    const times = stage.time();
    return [pairs(times, times), ...lines]; // up and down between the extremes that a row holds
  }
  update() {
    if (stage.rows() < 2) return;
    this.plots.forEach((plot, second) => {
      const { min, max } = plot.scales.x;
      const zoomed = min > 0 || max < plot.data[0].at(-1);
      plot.setData(this.data(second), !zoomed);
      if (zoomed) plot.redraw();
    });
  }
  // Returns what the table says of the integrals of top i: the value now, and its change since the
  // start.
  integrals(i) {
    const now = stage.measure(i);
    return this.page.integrals.map(({ name }) => {
      const change = now[name] - stage.record(i, name)[0];
      if (Number.isNaN(now[name])) return "–";
      return `${now[name].toPrecision(6)}\n${change.toExponential(1)}`;
    });
  }
  csv() {
    const { tops, measures } = this.page;
    const names = [...measures.map(({ name }) => name), "error"];
    const heads = (top, i) => names.map((name) => `${name} ${i}:${top.method}:${top.step}`);
    const columns = (_, i) => names.map((name) => stage.record(i, name));
    const all = [stage.time(), ...tops.flatMap(columns)];
    const rows = all[0].map((_, row) => all.map((column) => column[row]).join(","));
    return [["t", ...tops.flatMap(heads)].join(","), ...rows, ""].join("\n");
  }
}
