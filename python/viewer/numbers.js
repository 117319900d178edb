// The numbers under the eye: tilt, spin, precession and turns of the first top, now, each with what
// a symmetric top's closed form says of it: between which angles, against which critical spin, how
// long a round takes.
import { html, render } from "lit-html";
import { stage } from "./core.js";

// A top that failed is nowhere, and has no numbers.
const known = (x, words) => (Number.isNaN(x) ? "–" : words);
const degrees = (angle) => known(angle, `${((180 * angle) / Math.PI).toFixed(1)}°`);
const short = (x) => known(x, Math.abs(x) < 5e-4 ? "0" : x.toPrecision(3));
// Closer than this to the vertical no precession can be told.
const UPRIGHT = 0.02;

// Returns the rate at which the apex goes about the vertical: the part of the angular velocity w
// that is left of the spin about the apex, about the vertical.
export const precessionOf = ([, , up], spin, nutation) =>
  (up - spin * Math.cos(nutation)) / Math.sin(nutation) ** 2;

export class Numbers {
  constructor(parent) {
    this.place = document.createElement("dl");
    this.place.id = "numbers";
    this.place.ariaLabel = "The top in numbers";
    parent.append(this.place);
  }
  // Writes what is so of the page's first top.
  update(page) {
    const i = page.tops.findIndex((top) => !top.track && top.role !== "ghost");
    const { spin, nutation } = stage.measure(i);
    const { limits } = page.tops[i];
    const lines = [
      ["tilt", degrees(nutation), limits && between(limits), "between axis and vertical"],
      ["spin", short(spin), limits && against(limits), "about its own axis, in radians a time"],
      ...this.precession(stage.velocity(i), spin, nutation, limits),
    ];
    const time = stage.state(i)[0];
    const turns = (time * spin) / (2 * Math.PI);
    const since = "about its own axis, since the start";
    if (limits) lines.push(["turns", known(turns, Math.abs(turns).toFixed(1)), "", since]);
    const item = ([name, value, note, about]) =>
      html`<div title=${about}><dt>${name}</dt><dd>${value}</dd><small>${note || ""}</small></div>`;
    render(lines.map(item), this.place);
  }
  precession(velocity, spin, nutation, limits) {
    if (!limits || !(Math.sin(nutation) >= UPRIGHT)) return [];
    const now = precessionOf(velocity, spin, nutation);
    const round = (2 * Math.PI) / Math.abs(limits.precession);
    const note = round < 1e4 ? `a round in ${round.toFixed(1)}` : "";
    return [["precession", short(now), note, "of the axis about the vertical, in radians a time"]];
  }
}
function between({ least, greatest }) {
  const [low, high] = [degrees(least), degrees(greatest)];
  return low === high ? "it keeps that" : `${low} to ${high}`;
}
const against = ({ critical }) => (critical ? `critical ${short(critical)}` : "");
