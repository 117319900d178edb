// Charts of the recorded measures, with the values under the cursor, and the table of integrals.
// The `data-of` of a place is "chart", "integral" or "error".
import uPlot from "uplot";
import { findMeasure, simulation } from "./core.js";
import { EarlierCurves } from "./earlier_curves.js";

// Symbols of the integrals. Other measures show their names.
const SYMBOLS = {
  energy: "E",
  modified_energy: "H_ε",
  vertical_momentum: "⟨m, e₃⟩",
  axial_momentum: "⟨m, a⟩",
  kowalewski: "K",
  goryachev_chaplygin: "G",
};
const NAMES = {
  kowalewski: "integral K",
  goryachev_chaplygin: "integral G",
  nutation: "tilt (nutation) [°]",
  spin: "spin [rad/s]",
  spin_angle: "spin angle [rad]",
  error: "attitude error [rad]",
  modified_energy: "modified energy H_ε",
};
const describeMeasure = (name) => NAMES[name] ?? name.replaceAll("_", " ");
// Charts show the tilt in degrees, as the readout does.
const getScale = (name) => (name === "nutation" ? 180 / Math.PI : 1);
export const getSymbol = ({ name }) => SYMBOLS[name] ?? describeMeasure(name);
// Integrals are drawn as changes, which would be too small to see beside the value.
export const getTitle = ({ name, isConserved }) =>
  (isConserved ? "Change of " : "") + describeMeasure(name);

const getStyle = (id) => getComputedStyle(document.getElementById(id));
const formatNumber = (x) =>
  x === 0 || (Math.abs(x) >= 1e-3 && Math.abs(x) < 1e5) ? String(x) : x.toExponential();
// Format a tick with the digits that distinguish it from the next one.
export function formatTick(x, step) {
  if (x === null) return "";
  const last = Math.floor(Math.log10(step)) - 1;
  const digits = x ? Math.floor(Math.log10(Math.abs(x))) - last + 1 : 1;
  return formatNumber(+x.toPrecision(Math.max(1, Math.min(17, digits))));
}
// Return at most four powers of ten for the ticks of an axis.
function listDecades(low, high) {
  const [from, to] = [Math.floor(Math.log10(low)), Math.ceil(Math.log10(high))];
  const step = Math.ceil((to - from + 1) / 4);
  const count = Math.floor((to - from) / step) + 1;
  return Array.from({ length: count }, (_, i) => 10 ** (from + i * step));
}
const FLAT_HEIGHT = 1e-16; // smallest half height of a range, used for constant curves
const isEmpty = (low, high) => low === null || high === null;
const CONSTANT_ROOM = 0.05; // half the height of the range of a constant value, over the value
// Make the range of a chart. Changes smaller than `fine` times the values are drawn as constant.
// `known` returns values for which the chart has room from the start.
const makeRange = (isChange, known) => (_, least, greatest) => {
  if (isEmpty(least, greatest)) return [-1, 1];
  const [low, high] = [Math.min(least, ...known()), Math.max(greatest, ...known())];
  const fine = isChange ? 1e-9 : 1e-3;
  const fair = Math.max(FLAT_HEIGHT, fine * Math.max(Math.abs(low), Math.abs(high)));
  if (high - low > fair) return uPlot.rangeNum(low, high, 0.1, true);
  const room = isChange ? fair : Math.max(fair, CONSTANT_ROOM * Math.max(Math.abs(low), Math.abs(high)));
  return [low - room, high + room];
};
const makeLogRange = (known) => (_, low, high) => {
  const all = [low, high, ...known()].filter((x) => x !== null);
  if (!all.length) return [FLAT_HEIGHT, 1];
  return uPlot.rangeLog(Math.min(...all), Math.max(...all), 10, true);
};
// Make the range of the time. A chart without a zoom has room for the curves before a change.
const makeTimeRange = (earlier) => ({ data: [times] }, low, high) => {
  const [first, last] = [times[0], times.at(-1)];
  const isWhole = first === last || (low === first && high === last);
  const end = isWhole ? earlier.extend(last) : high;
  if (isWhole) return [first, end > first ? end : first + 1];
  return high > low ? [low, high] : [0, 1];
};
// Note whether the user has zoomed in. uPlot sets a scale some time after `setData`, so only the
// hook after the change knows.
function noteZoom(plot, key) {
  if (key !== "x") return;
  const { min, max } = plot.scales.x;
  const [first, last] = [plot.data[0][0], plot.data[0].at(-1)];
  plot.isZoomed = last > first && (min > first || max < last);
}
// Make an element focusable while its content overflows, so that arrow keys can scroll it.
export function letKeysScroll(element) {
  const { scrollWidth, clientWidth, scrollHeight, clientHeight } = element;
  if (scrollWidth > clientWidth || scrollHeight > clientHeight) element.tabIndex = 0;
  else element.removeAttribute("tabindex");
}
const [SMALL_HEIGHT, LARGE_HEIGHT, PROJECTOR_HEIGHT] = [118, 250, 320]; // pixels

export class Charts {
  plots = []; // none until the panel is seen
  constructor(page) {
    this.page = page;
  }
  // Make new charts if the tops, the measure, the scale or the size have changed.
  build() {
    const { scene, hasLargeCharts, isProjector } = this.page;
    const tops = this.page.tops.map(({ colour, role, comparedWith }) => [
      colour,
      role,
      comparedWith < 0,
    ]);
    const width = document.getElementById("panel").clientWidth - 28;
    // Changes with the colour scheme.
    const ground = getComputedStyle(document.body).backgroundColor;
    const { chart, integral, log, shown } = scene;
    const places = [...document.querySelectorAll(".chart")].filter((place) => place.offsetParent);
    const names = places.map((place) => place.dataset.of); // of charts in open sections
    const all = [
      tops,
      chart,
      integral,
      log,
      shown,
      width,
      ground,
      hasLargeCharts,
      isProjector,
      names,
    ];
    const signature = JSON.stringify(all);
    if (width < 0) return;
    if (this.signature === signature) return this.update();
    const height = isProjector ? PROJECTOR_HEIGHT : hasLargeCharts ? LARGE_HEIGHT : SMALL_HEIGHT;
    Object.assign(this, { signature, width, height });
    this.noteRecord();
    this.plots.forEach((plot) => plot.destroy());
    this.plots = places.map((place) => this.makePlot(place));
  }
  // Remember which record is drawn. Return whether it is new.
  noteRecord() {
    const { tops, clock } = this.page;
    const isNew = this.tops !== tops || this.clock !== clock;
    Object.assign(this, { tops, clock });
    return isNew;
  }
  makePlot(place) {
    const what = place.dataset.of;
    const earlier = new EarlierCurves(this.page, this.getMeasure(what), this.makeTransform(what));
    const plot = new uPlot(this.makeOptions(what, earlier), this.collectData(what), place);
    const values = place.nextElementSibling;
    return Object.assign(plot, { what, place, values, earlier, tops: this.tops });
  }
  getMeasure(what) {
    return findMeasure(what === "error" ? what : this.page.scene[what]);
  }
  isLog(what) {
    const { name, isConserved } = this.getMeasure(what);
    return this.page.scene.log && (name === "error" || isConserved);
  }
  makeOptions(what, earlier) {
    const series = this.tops.map((top, i) => ({
      stroke: top.colour,
      width: this.page.isProjector ? 3 : 1.5,
      dash: top.role === "thin" ? [5, 3] : undefined,
      show: this.page.scene.shown[i] && !(what === "error" && top.comparedWith < 0),
      points: { show: false },
      spanGaps: true,
    }));
    const log = this.isLog(what);
    const listEarlier = () => earlier.listExtremes(simulation.getTimes().at(-1) ?? 0);
    const isChange = what === "error" || this.getMeasure(what).isConserved;
    return {
      width: this.width,
      height: this.height,
      legend: { show: false },
      cursor: { drag: { x: true, y: false }, sync: { key: "time" } },
      scales: {
        x: { time: false, range: makeTimeRange(earlier) },
        y: log
          ? { distr: 3, range: makeLogRange(listEarlier) }
          : { range: makeRange(isChange, () => [...this.listLimits(what), ...listEarlier()]) },
      },
      axes: this.makeAxes(log),
      series: [{}, ...series],
      hooks: {
        setCursor: [(plot) => plot.place && this.showValues([plot])],
        setScale: [noteZoom],
        drawAxes: [(plot) => earlier.draw(plot)],
      },
    };
  }
  // Return the known limits of the tilt of all tops.
  listLimits(what) {
    const { name } = this.getMeasure(what);
    const all = name === "nutation" ? this.page.tops.map((top) => top.limits ?? []) : [];
    const angles = all.flatMap(({ least, greatest }) => [least, greatest]);
    return angles.filter(Number.isFinite).map((x) => x * getScale(name));
  }
  makeAxes(log) {
    const grid = { stroke: getStyle("charts").borderBottomColor, width: 1 };
    const { isProjector } = this.page;
    const font = `${isProjector ? 22 : 11}px system-ui`;
    const ink = { stroke: getStyle("about").color, grid, ticks: { show: false }, font };
    const values = (_, all, axis, room, step) => all.map((x) => formatTick(x, log ? x : step));
    const splits = (_, axis, low, high) => listDecades(low, high);
    // Skip the lowest tick, which would overlap the time axis.
    const isAboveTime = ({ min, max }, x) => Math.log(x / min) > 0.1 * Math.log(max / min);
    const high = (plot, all) => all.map((x) => (isAboveTime(plot.scales.y, x) ? x : null));
    const powers = log && { splits, filter: high };
    const letter = isProjector ? 12.4 : 6.2;
    const measureLongest = (all) => Math.max(0, ...(all ?? []).map((x) => x.length));
    const computeWidth = (_, all) => Math.max(50, 10 + letter * measureLongest(all));
    return [
      { ...ink, size: isProjector ? 40 : 22, space: isProjector ? 90 : 50 },
      { ...ink, size: computeWidth, space: isProjector ? 40 : 16, values, ...powers },
    ];
  }
  // Make the function of a recorded value, and of the first one, that returns the drawn value.
  makeTransform(what) {
    const { name, isConserved } = this.getMeasure(what);
    const log = this.isLog(what);
    const draw = (x) => (Number.isNaN(x) ? null : log ? Math.abs(x) || null : x);
    return (x, first) => draw((x - (isConserved ? first : 0)) * getScale(name));
  }
  collectData(what) {
    const { name } = this.getMeasure(what);
    const transform = this.makeTransform(what);
    const mergeRows = (one, other) => one.flatMap((x, row) => [x, other[row]]);
    const lines = this.tops.map((_, i) => {
      const [first] = simulation.getRecord(i, name);
      const ends = mergeRows(simulation.getRecord(i, name, -1), simulation.getRecord(i, name, 1));
      return ends.map((x) => transform(x, first));
    });
    const times = simulation.getTimes();
    return [mergeRows(times, times), ...lines]; // the least and the greatest value
  }
  update() {
    if (!this.noteRecord()) return;
    for (const plot of this.plots) {
      plot.setData(this.collectData(plot.what), !plot.isZoomed);
      if (plot.isZoomed) plot.redraw();
    }
    this.showValues(this.plots);
  }
  // Write below charts their values under the cursor, or at the end. All are written before they
  // are measured, because each measurement after a change lets the browser compute the layout.
  showValues(plots) {
    const places = plots.filter((plot) => this.writeValues(plot)).map(({ values }) => values);
    places.forEach(letKeysScroll);
  }
  // Write the values of a chart, and return whether they have changed.
  writeValues(plot) {
    const row = plot.cursor.idx ?? plot.data[0].length - 1;
    const digits = [5, 5, 5, 3][plot.tops.length] ?? 2; // that fit into the line
    const words = plot.tops.map((top, i) => {
      const x = plot.series[i + 1].show ? plot.data[i + 1][row] : null;
      const value = document.createElement("span");
      value.textContent = x === null || x === undefined ? "" : formatNumber(+x.toPrecision(digits));
      value.style.setProperty("--of", top.colour);
      return value;
    });
    const more = plot.earlier.list().length ? [" (pale: before the change)"] : [];
    const all = [`t = ${+(plot.data[0][row] ?? 0).toPrecision(6)} s`, ...words, ...more];
    const text = all.map((each) => each.textContent ?? each).join();
    if (plot.written === text) return false;
    plot.values.replaceChildren(...all);
    return (plot.written = text);
  }
  // Return the cells of the table for top `i`: current values and changes since the start.
  formatIntegrals(i) {
    const now = simulation.measureTop(i);
    return this.page.integrals.map(({ name }) => {
      const change = now[name] - simulation.getRecord(i, name)[0];
      if (Number.isNaN(now[name])) return "–";
      return `${now[name].toPrecision(6)}\n${change.toExponential(1)}`;
    });
  }
  formatCsv() {
    const { tops, measures } = this.page;
    const names = [...new Set([...measures.map(({ name }) => name), "error"])];
    const listHeads = (top, i) => names.map((name) => `${name} ${i}:${top.method}:${top.step}`);
    const listColumns = (_, i) => names.map((name) => simulation.getRecord(i, name));
    const all = [simulation.getTimes(), ...tops.flatMap(listColumns)];
    const rows = all[0].map((_, row) => all.map((column) => column[row]).join(","));
    return [["t", ...tops.flatMap(listHeads)].join(","), ...rows, ""].join("\n");
  }
}
