// Two charts of the record, and what the table of integrals says.
import uPlot from "uplot";
import { stage } from "./core.js";

const NAMES = ["energy", "vertical", "axial", "fourth", "error"];
const style = (id) => getComputedStyle(document.getElementById(id));
const short = (x) =>
  x === 0 ? "0" : Math.abs(x) >= 0.01 && Math.abs(x) < 1000 ? String(+x.toPrecision(3)) : x.toExponential(0);

export class Charts {
  constructor(page) {
    this.page = page;
    this.hidden = new Set(); // tops whose boxes are unticked
    this.log = false;
  }
  // Anew for other tops, another quantity or scale.
  build() {
    this.tops = this.page.tops;
    this.what = this.page.scene.chart;
    this.plots?.forEach((plot) => plot.destroy());
    const places = [...document.querySelectorAll(".chart")];
    this.plots = places.map((place, second) => new uPlot(this.options(second), this.data(second), place));
  }
  get compared() {
    return this.page.tops.some((top) => top.against >= 0);
  }
  options(second) {
    const series = this.page.tops.map((top, i) => ({
      stroke: top.colour,
      width: 1.5,
      dash: top.role === "thin" ? [5, 3] : undefined,
      show: !this.hidden.has(i) && !(second && top.against < 0),
      points: { show: false },
      spanGaps: true,
    }));
    const grid = { stroke: style("charts").borderBottomColor, width: 1 };
    const ink = { stroke: style("about").color, grid, ticks: { show: false }, font: "11px system-ui" };
    const words = (_, all) => all.map((x) => (x === null ? "" : short(x)));
    return {
      width: document.getElementById("panel").clientWidth - 28,
      height: 118,
      legend: { show: false },
      cursor: { drag: { x: true, y: false } },
      scales: { x: { time: false }, y: { distr: this.log ? 3 : 1 } },
      axes: [
        { ...ink, size: 22 },
        { ...ink, size: 48, space: 16, values: words },
      ],
      series: [{}, ...series],
    };
  }
  data(second) {
    const what = second ? 4 : NAMES.indexOf(this.what);
    const rows = this.page.tops.map((_, i) => {
      const values = stage.record(i, what);
      const change = second ? values : values.map((x) => x - values[0]);
      return change.map((x) => (Number.isNaN(x) ? null : this.log ? Math.abs(x) || null : x));
    });
    return [stage.time(), ...rows];
  }
  update() {
    if (stage.rows() > 1) this.plots.forEach((plot, second) => plot.setData(this.data(second)));
  }
  // One top shown or hidden; one alone, or all of them.
  toggle(i) {
    if (!this.hidden.delete(i)) this.hidden.add(i);
    this.build();
  }
  only(i) {
    const others = [...this.page.tops.keys()].filter((k) => k !== i);
    this.hidden = new Set(i === undefined ? [] : others);
    this.build();
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
