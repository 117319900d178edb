// Charts of the record, each with its values under the cursor, and what the table of integrals
// says. A place in the panel says which measure it draws: the chart's, the integral's, the error.
import uPlot from "uplot";
import { measureOf, stage } from "./core.js";

// Symbols of integrals; other measures have their names.
const SYMBOLS = {
  energy: "E",
  modified_energy: "H_ε",
  vertical_momentum: "⟨m, e₃⟩",
  axial_momentum: "⟨m, a⟩",
  kowalewski: "K",
  goryachev_chaplygin: "G",
};
const WORDS = {
  kowalewski: "integral K",
  goryachev_chaplygin: "integral G",
  nutation: "tilt (nutation) [°]",
  spin: "spin [rad/s]",
  spin_angle: "spin angle [rad]",
  error: "attitude error [rad]",
  modified_energy: "modified energy H_ε",
};
const inWords = (name) => WORDS[name] ?? name.replaceAll("_", " ");
// Charts tell the tilt in degrees, as all else does.
const scaleOf = (name) => (name === "nutation" ? 180 / Math.PI : 1);
export const symbol = ({ name }) => SYMBOLS[name] ?? inWords(name);
// Integrals are drawn as a change, for only that is to be seen of them.
export const title = ({ name, kept }) => (kept ? "Change of " : "") + inWords(name);

const style = (id) => getComputedStyle(document.getElementById(id));
const plainly = (x) =>
  x === 0 || (Math.abs(x) >= 1e-3 && Math.abs(x) < 1e5) ? String(x) : x.toExponential();
// Writes a number at an axis, with the digits that tell it from the next one.
export function tick(x, step) {
  if (x === null) return "";
  const last = Math.floor(Math.log10(step)) - 1;
  const digits = x ? Math.floor(Math.log10(Math.abs(x))) - last + 1 : 1;
  return plainly(+x.toPrecision(Math.max(1, Math.min(17, digits))));
}
// Returns powers of ten to write at an axis, at most four.
function decades(low, high) {
  const [from, to] = [Math.floor(Math.log10(low)), Math.ceil(Math.log10(high))];
  const step = Math.ceil((to - from + 1) / 4);
  const count = Math.floor((to - from) / step) + 1;
  return Array.from({ length: count }, (_, i) => 10 ** (from + i * step));
}
const LEVEL = 1e-16; // A line that does not move has this height.
const isNothing = (low, high) => low === null || high === null;
// A line that is level but for rounding is drawn level: `fine` of its size is nothing.
// `known` is what the line will reach: the scale has room for it from the start.
const range = (fine, known) => (_, least, greatest) => {
  if (isNothing(least, greatest)) return [-1, 1];
  const [low, high] = [Math.min(least, ...known()), Math.max(greatest, ...known())];
  const fair = Math.max(LEVEL, fine * Math.max(Math.abs(low), Math.abs(high)));
  return high - low > fair ? uPlot.rangeNum(low, high, 0.1, true) : [low - fair, high + fair];
};
const logRange = (_, low, high) =>
  isNothing(low, high) ? [LEVEL, 1] : uPlot.rangeLog(low, high, 10, true);
const timeRange = (_, low, high) => (high > low ? [low, high] : [0, 1]);
// uPlot sets a scale some time after `setData` asks for it. So a zoom is noted when a scale has been
// set.
function noteZoom(plot, key) {
  if (key !== "x") return;
  const { min, max } = plot.scales.x;
  const [first, last] = [plot.data[0][0], plot.data[0].at(-1)];
  plot.isZoomed = last > first && (min > first || max < last);
}
// Lets the Tab key reach an element whose content it cannot show whole: then arrow keys scroll it.
export function letKeysScroll(element) {
  const { scrollWidth, clientWidth, scrollHeight, clientHeight } = element;
  if (scrollWidth > clientWidth || scrollHeight > clientHeight) element.tabIndex = 0;
  else element.removeAttribute("tabindex");
}
const [SMALL, LARGE, HALL] = [118, 250, 320]; // pixels

export class Charts {
  constructor(page) {
    this.page = page;
  }
  // Makes the charts anew for tops of other looks, another measure or scale.
  build() {
    const { scene, large, big } = this.page;
    const tops = this.page.tops.map(({ colour, role, against }) => [colour, role, against < 0]);
    const width = document.getElementById("panel").clientWidth - 28;
    const ground = getComputedStyle(document.body).backgroundColor; // light, dark, or black
    const { chart, integral, log, shown } = scene;
    const places = [...document.querySelectorAll(".chart")].filter((place) => place.offsetParent);
    const names = places.map((place) => place.dataset.of); // of those that are not folded away
    const all = [tops, chart, integral, log, shown, width, ground, large, big, names];
    const looks = JSON.stringify(all);
    if (width < 0) return;
    if (this.looks === looks) return this.update();
    const height = big ? HALL : large ? LARGE : SMALL;
    Object.assign(this, { looks, width, height });
    this.know();
    this.plots?.forEach((plot) => plot.destroy());
    this.plots = places.map((place) => this.make(place));
  }
  // Other tops have another record.
  know() {
    const { tops, clock } = this.page;
    const isNew = this.tops !== tops || this.clock !== clock;
    Object.assign(this, { tops, clock });
    return isNew;
  }
  make(place) {
    const what = place.dataset.of;
    const plot = new uPlot(this.options(what), this.data(what), place);
    return Object.assign(plot, { what, place, tops: this.tops });
  }
  measure(what) {
    return measureOf(what === "error" ? what : this.page.scene[what]);
  }
  isLog(what) {
    const { name, kept } = this.measure(what);
    return this.page.scene.log && (name === "error" || kept);
  }
  options(what) {
    const series = this.tops.map((top, i) => ({
      stroke: top.colour,
      width: this.page.big ? 3 : 1.5,
      dash: top.role === "thin" ? [5, 3] : undefined,
      show: this.page.scene.shown[i] && !(what === "error" && top.against < 0),
      points: { show: false },
      spanGaps: true,
    }));
    const log = this.isLog(what);
    const fine = what === "error" || this.measure(what).kept ? 1e-9 : 1e-3;
    return {
      width: this.width,
      height: this.height,
      legend: { show: false },
      cursor: { drag: { x: true, y: false }, sync: { key: "time" } },
      scales: {
        x: { time: false, range: timeRange },
        y: log ? { distr: 3, range: logRange } : { range: range(fine, () => this.known(what)) },
      },
      axes: this.axes(log),
      series: [{}, ...series],
      hooks: { setCursor: [(plot) => this.read(plot)], setScale: [noteZoom] },
    };
  }
  // Returns the limits of the tilt, of tops for which they are known.
  known(what) {
    const { name } = this.measure(what);
    const all = name === "nutation" ? this.page.tops.map((top) => top.limits ?? []) : [];
    const angles = all.flatMap(({ least, greatest }) => [least, greatest]);
    return angles.filter(Number.isFinite).map((x) => x * scaleOf(name));
  }
  axes(log) {
    const grid = { stroke: style("charts").borderBottomColor, width: 1 };
    const { big } = this.page;
    const font = `${big ? 22 : 11}px system-ui`;
    const ink = { stroke: style("about").color, grid, ticks: { show: false }, font };
    const values = (_, all, axis, room, step) => all.map((x) => tick(x, log ? x : step));
    const splits = (_, axis, low, high) => decades(low, high);
    // The lowest would stand where the time begins.
    const isHigh = ({ min, max }, x) => Math.log(x / min) > 0.1 * Math.log(max / min);
    const high = (plot, all) => all.map((x) => (isHigh(plot.scales.y, x) ? x : null));
    const powers = log && { splits, filter: high };
    const letter = big ? 12.4 : 6.2;
    const longest = (all) => Math.max(0, ...(all ?? []).map((x) => x.length));
    const wide = (_, all) => Math.max(50, 10 + letter * longest(all));
    return [
      { ...ink, size: big ? 40 : 22, space: big ? 90 : 50 },
      { ...ink, size: wide, space: big ? 40 : 16, values, ...powers },
    ];
  }
  data(what) {
    const { name, kept } = this.measure(what);
    const log = this.isLog(what);
    const pairs = (one, other) => one.flatMap((x, row) => [x, other[row]]);
    const drawn = (x) => (Number.isNaN(x) ? null : log ? Math.abs(x) || null : x);
    const lines = this.tops.map((_, i) => {
      const start = kept ? stage.record(i, name)[0] : 0;
      const ends = pairs(stage.record(i, name, -1), stage.record(i, name, 1));
      return ends.map((x) => drawn((x - start) * scaleOf(name)));
    });
    const times = stage.time();
    const all = [pairs(times, times), ...lines]; // up and down between the extremes of a row
    const before = this.before(name, (x, start) => drawn((x - (kept ? start : 0)) * scaleOf(name)));
    return before ? all.map((line, i) => [...before[i], ...line]) : all;
  }
  // Returns the chart of the motion before a push, whose time ends at 0.
  before(name, drawn) {
    const { time, lines, end } = this.page.before ?? {};
    if (!lines?.[name]) return null;
    const values = lines[name].map(([low, at, high]) =>
      low.flatMap((x, row) => [x, high[row]]).map((x) => drawn(x, at[0])),
    );
    return [time.flatMap((t) => [t - end, t - end]), ...values];
  }
  update() {
    if (!this.know()) return;
    for (const plot of this.plots) {
      plot.setData(this.data(plot.what), !plot.isZoomed);
      if (plot.isZoomed) plot.redraw();
      this.read(plot);
    }
  }
  // Writes below a chart what it shows under the cursor, or else at its end.
  read(plot) {
    const place = plot.place?.nextElementSibling;
    if (!place) return;
    const row = plot.cursor.idx ?? plot.data[0].length - 1;
    const digits = [5, 5, 5, 3][plot.tops.length] ?? 2; // as fit into a line
    const words = plot.tops.map((top, i) => {
      const x = plot.series[i + 1].show ? plot.data[i + 1][row] : null;
      const value = document.createElement("span");
      value.textContent = x === null || x === undefined ? "" : plainly(+x.toPrecision(digits));
      value.style.setProperty("--of", top.colour);
      return value;
    });
    place.replaceChildren(`t = ${+(plot.data[0][row] ?? 0).toPrecision(6)} s`, ...words);
    letKeysScroll(place);
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
    const names = [...new Set([...measures.map(({ name }) => name), "error"])];
    const heads = (top, i) => names.map((name) => `${name} ${i}:${top.method}:${top.step}`);
    const columns = (_, i) => names.map((name) => stage.record(i, name));
    const all = [stage.time(), ...tops.flatMap(columns)];
    const rows = all[0].map((_, row) => all.map((column) => column[row]).join(","));
    return [["t", ...tops.flatMap(heads)].join(","), ...rows, ""].join("\n");
  }
}
