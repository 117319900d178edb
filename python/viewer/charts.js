// Two charts of the record, and what the table of integrals says.
import uPlot from "uplot";
import { stage } from "./core.js";

export const QUANTITIES = {
  energy: "Energy error E − E₀",
  vertical: "Change of ⟨m, p⟩",
  axial: "Change of ⟨m, a⟩",
  fourth: "Change of K or G",
};
const NAMES = [...Object.keys(QUANTITIES), "error"];
const style = (id) => getComputedStyle(document.getElementById(id));
const short = (x) =>
  x === 0 ? "0" : Math.abs(x) >= 0.01 && Math.abs(x) < 1000 ? String(+x.toPrecision(3)) : x.toExponential(0);
// At most four powers of ten.
function decades(low, high) {
  const [from, to] = [Math.floor(Math.log10(low)), Math.ceil(Math.log10(high))];
  const step = Math.ceil((to - from + 1) / 4);
  return Array.from({ length: Math.floor((to - from) / step) + 1 }, (_, i) => 10 ** (from + i * step));
}

export class Charts {
  constructor(page) {
    this.page = page;
  }
  // Anew for other tops, another quantity or scale.
  build() {
    const { tops, scene } = this.page;
    const width = document.getElementById("panel").clientWidth - 28;
    const looks = JSON.stringify([
      scene.chart,
      scene.log,
      scene.shown,
      width,
      matchMedia("(prefers-color-scheme: dark)").matches,
    ]);
    if (width < 0 || (this.tops === tops && this.looks === looks)) return;
    Object.assign(this, { tops, looks, width });
    this.plots?.forEach((plot) => plot.destroy());
    const places = [...document.querySelectorAll(".chart")];
    this.plots = places.map((place, second) => new uPlot(this.options(second), this.data(second), place));
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
    const ink = { stroke: style("about").color, grid, ticks: { show: false }, font: "11px system-ui" };
    const words = (_, all) => all.map((x) => (x === null ? "" : short(x)));
    const kept = 1e-16; // the height of a line that does not move
    const range = (_, low, high) => (high > low ? uPlot.rangeNum(low, high, 0.1, true) : [low - kept, high + kept]);
    const powers = log && { splits: (_, axis, low, high) => decades(low, high), filter: (_, all) => all };
    return {
      width: this.width,
      height: 118,
      legend: { show: false },
      cursor: { drag: { x: true, y: false }, sync: { key: "time" } },
      scales: { x: { time: false }, y: log ? { distr: 3 } : { range } },
      axes: [
        { ...ink, size: 22 },
        { ...ink, size: 48, space: 16, values: words, ...powers },
      ],
      series: [{}, ...series],
    };
  }
  data(second) {
    const { log, chart } = this.page.scene;
    const what = second ? 4 : NAMES.indexOf(chart);
    const pairs = (one, other) => one.flatMap((x, row) => [x, other[row]]);
    const rows = this.tops.map((_, i) => {
      const [start] = second ? [0] : stage.record(i, what);
      const change = pairs(stage.record(i, what, 1), stage.record(i, what, 2)).map((x) => x - start);
      return change.map((x) => (Number.isNaN(x) ? null : log ? Math.abs(x) || null : x));
    });
    return [pairs(stage.time(), stage.time()), ...rows]; // up and down between the extremes that a row holds
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
  // <m, p>, <m, a>, E, and K or G: the value now, and its change since the start.
  integrals(i) {
    const now = stage.measure(i);
    return [1, 2, 0, 3].map((what) => {
      const scale = what === 1 ? this.page.scene.gravity : 1; // <m, p>, not <m, e3>
      const change = scale * (now[what] - stage.record(i, what)[0]);
      return Number.isNaN(now[what]) ? "–" : `${(scale * now[what]).toPrecision(6)}\n${change.toExponential(1)}`;
    });
  }
  csv() {
    const { tops } = this.page;
    const heads = tops.flatMap((top, i) => NAMES.map((name) => `${name} ${i}:${top.method}:${top.eps}`));
    const columns = [stage.time(), ...tops.flatMap((_, i) => NAMES.map((_, what) => stage.record(i, what)))];
    const rows = columns[0].map((_, row) => columns.map((column) => column[row]).join(","));
    return [["t", ...heads].join(","), ...rows, ""].join("\n");
  }
}
