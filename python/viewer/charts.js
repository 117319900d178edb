// Two charts of the record, and the table of integrals.
import uPlot from "uplot";
import { stage, TICKS } from "./core.js";

export const QUANTITIES = ["energy", "vertical", "axial", "fourth", "error"];
const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(name);
const name = (top) => `${top.role === "ghost" ? "ghost: " : ""}${top.method} ${top.eps / TICKS}`;
const short = (x) =>
  x === 0 ? "0" : Math.abs(x) >= 0.01 && Math.abs(x) < 1000 ? String(+x.toPrecision(3)) : x.toExponential(0);

export class Charts {
  constructor(page) {
    this.page = page;
    this.hidden = new Set(); // tops whose boxes are unticked
    document.getElementById("log").addEventListener("change", () => this.build());
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.build());
  }
  // Anew for other tops, another quantity or scale.
  build() {
    const { tops } = this.page;
    this.log = document.getElementById("log").checked;
    this.what = QUANTITIES.indexOf(this.page.scene.chart);
    this.plots?.forEach((plot) => plot.destroy());
    const width = document.getElementById("panel").clientWidth - 28;
    this.compared = tops.some((top) => top.against >= 0);
    document.getElementById("apart").hidden = !this.compared;
    this.plots = ["chart", "errors"].map((id, second) => {
      const series = tops.map((top, i) => ({
        stroke: top.colour,
        width: 1.5,
        dash: top.role === "thin" ? [5, 3] : undefined,
        show: !this.hidden.has(i) && !(second && top.against < 0),
        points: { show: false },
        spanGaps: true,
      }));
      const ink = {
        stroke: colour("--faint"),
        grid: { stroke: colour("--line"), width: 1 },
        ticks: { show: false },
        font: "11px system-ui",
      };
      const options = {
        width,
        height: 118,
        legend: { show: false },
        cursor: { drag: { x: true, y: false } },
        scales: { x: { time: false }, y: { distr: this.log ? 3 : 1 } },
        axes: [
          { ...ink, size: 22 },
          { ...ink, size: 48, space: 16, values: (_, all) => all.map((x) => (x === null ? "" : short(x))) },
        ],
        series: [{}, ...series],
      };
      return new uPlot(options, this.data(second), document.getElementById(id));
    });
    this.table();
    this.update();
  }
  data(second) {
    const time = Array.from(stage.time());
    const rows = this.page.tops.map((top, i) => {
      const values = stage.record(i, second ? 4 : this.what);
      const change = second ? values : values.map((x) => x - values[0]);
      return change.map((x) => (Number.isNaN(x) ? null : this.log ? Math.abs(x) || null : x));
    });
    return [time, ...rows];
  }
  update() {
    const some = stage.rows() > 1;
    const section = document.getElementById("charts");
    if (section.hidden === some) section.hidden = !some;
    if (some)
      this.plots.forEach((plot, second) => (second && !this.compared ? null : plot.setData(this.data(second))));
    this.values();
  }

  table() {
    const body = document.getElementById("integrals");
    body.replaceChildren(...this.page.tops.map((top) => this.row(top)));
    const several = this.page.tops.length > 1;
    document
      .getElementById("legend")
      .replaceChildren(...(several ? this.page.tops.map((top, i) => this.tick(top, i)) : []));
    document.getElementById("fourth").textContent = this.page.kind === "goryachev_chaplygin" ? "G" : "K";
  }
  row(top) {
    const row = document.createElement("tr");
    const head = row.appendChild(document.createElement("th"));
    Object.assign(head, { scope: "row", textContent: name(top) });
    head.style.color = top.colour;
    for (let k = 0; k < 4; k++) row.insertCell();
    return row;
  }
  // Its colour, and whether the charts show it.
  tick(top, i) {
    const label = document.createElement("label");
    label.className = "check";
    const tick = label.appendChild(document.createElement("input"));
    Object.assign(tick, { type: "checkbox", checked: !this.hidden.has(i) });
    tick.addEventListener("change", () => {
      this.hidden[tick.checked ? "delete" : "add"](i);
      this.build();
    });
    const words = label.appendChild(document.createElement("span"));
    words.textContent = name(top);
    words.style.color = top.colour;
    return label;
  }
  values() {
    [...document.getElementById("integrals").rows].forEach((row, i) => {
      const [energy, vertical, axial, fourth] = stage.measure(i);
      const start = [1, 2, 0, 3].map((k) => stage.record(i, k)[0]);
      [vertical * this.page.scene.gravity, axial, energy, fourth].forEach((x, k) => {
        const scale = k ? 1 : this.page.scene.gravity;
        row.cells[k + 1].innerText = Number.isNaN(x)
          ? "–"
          : `${x.toPrecision(6)}\n${(x - scale * start[k]).toExponential(1)}`;
      });
    });
  }
  csv() {
    const names = ["energy", "m_vertical", "m_axial", "fourth", "frame_error"];
    const { tops } = this.page;
    const head = [
      "t",
      ...tops.flatMap((top, i) => names.map((name) => `${name} ${i}:${top.method}:${top.eps / TICKS}`)),
    ];
    const columns = tops.flatMap((_, i) => names.map((_, what) => stage.record(i, what)));
    const rows = Array.from(stage.time(), (t, row) => [t, ...columns.map((column) => column[row])].join(","));
    return [head.join(","), ...rows].join("\n") + "\n";
  }
}
