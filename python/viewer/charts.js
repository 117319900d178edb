// Two charts of the record, and the table of integrals.
import uPlot from "uplot";
import { stage, TICKS } from "./core.js";

const QUANTITIES = ["energy", "vertical", "axial", "fourth", "error"];
const NAMES = ["energy", "m_vertical", "m_axial", "fourth", "frame_error"];
const $ = (id) => document.getElementById(id);
const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(name);
const name = (top) => `${top.role === "ghost" ? "ghost: " : ""}${top.method} ${top.eps / TICKS}`;
const short = (x) =>
  x === 0 ? "0" : Math.abs(x) >= 0.01 && Math.abs(x) < 1000 ? String(+x.toPrecision(3)) : x.toExponential(0);
const element = (tag, properties, ...children) => {
  const made = Object.assign(document.createElement(tag), properties);
  made.append(...children);
  return made;
};

export class Charts {
  constructor(page) {
    this.page = page;
    this.hidden = new Set(); // tops whose boxes are unticked
    $("log").addEventListener("change", () => this.build());
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.build());
  }
  // Anew for other tops, another quantity or scale.
  build() {
    const { tops, kind } = this.page;
    this.log = $("log").checked;
    this.what = QUANTITIES.indexOf(this.page.scene.chart);
    this.compared = tops.some((top) => top.against >= 0);
    $("apart").hidden = !this.compared;
    this.plots?.forEach((plot) => plot.destroy());
    this.plots = ["chart", "errors"].map((id, second) => new uPlot(this.options(second), this.data(second), $(id)));
    const heads = tops.map((top) => element("th", { scope: "row", textContent: name(top) }));
    heads.forEach((head, i) => (head.style.color = tops[i].colour));
    const cells = () => Array.from({ length: 4 }, () => element("td"));
    $("integrals").replaceChildren(...heads.map((head) => element("tr", {}, head, ...cells())));
    $("legend").replaceChildren(...(tops.length > 1 ? tops.map((top, i) => this.tick(top, i)) : []));
    $("fourth").textContent = kind === "goryachev_chaplygin" ? "G" : "K";
    this.update();
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
    const grid = { stroke: colour("--line"), width: 1 };
    const ink = { stroke: colour("--faint"), grid, ticks: { show: false }, font: "11px system-ui" };
    const words = (_, all) => all.map((x) => (x === null ? "" : short(x)));
    return {
      width: $("panel").clientWidth - 28,
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
  // Its colour, and whether the charts show it.
  tick(top, i) {
    const tick = element("input", { type: "checkbox", checked: !this.hidden.has(i) });
    tick.addEventListener("change", () => {
      this.hidden[tick.checked ? "delete" : "add"](i);
      this.build();
    });
    const label = element("label", { className: "check" }, tick, name(top));
    label.style.color = top.colour;
    return label;
  }
  // One top alone, or all of them.
  only(i) {
    const others = this.page.tops.map((_, k) => k).filter((k) => k !== i);
    this.hidden = new Set(i === undefined ? [] : others);
    this.build();
  }
  data(second) {
    const rows = this.page.tops.map((_, i) => {
      const values = stage.record(i, second ? 4 : this.what);
      const change = second ? values : values.map((x) => x - values[0]);
      return change.map((x) => (Number.isNaN(x) ? null : this.log ? Math.abs(x) || null : x));
    });
    return [Array.from(stage.time()), ...rows];
  }
  update() {
    const some = stage.rows() > 1;
    if ($("charts").hidden === some) $("charts").hidden = !some;
    if (some) this.plots.forEach((plot, second) => (!second || this.compared) && plot.setData(this.data(second)));
    const { gravity } = this.page.scene;
    [...$("integrals").rows].forEach((row, i) => {
      const now = stage.measure(i);
      [1, 2, 0, 3].forEach((what, k) => {
        const scale = what === 1 ? gravity : 1; // <m, p>, not <m, e3>
        const change = scale * (now[what] - stage.record(i, what)[0]);
        const words = `${(scale * now[what]).toPrecision(6)}\n${change.toExponential(1)}`;
        row.cells[k + 1].innerText = Number.isNaN(now[what]) ? "–" : words;
      });
    });
  }
  csv() {
    const { tops } = this.page;
    const heads = tops.flatMap((top, i) => NAMES.map((name) => `${name} ${i}:${top.method}:${top.eps / TICKS}`));
    const columns = tops.flatMap((_, i) => NAMES.map((_, what) => stage.record(i, what)));
    const rows = Array.from(stage.time(), (t, row) => [t, ...columns.map((column) => column[row])].join(","));
    return [["t", ...heads].join(","), ...rows].join("\n") + "\n";
  }
}
