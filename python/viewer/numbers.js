// The numbers over the picture: tilt, spin, precession and turns of the first top, now. Below them
// is what the closed form of a symmetric top says: the limits of the tilt, the critical spin of a
// top that starts near the vertical, the mean precession.
import { html, render } from "lit-html";
import { stage } from "./core.js";

// A top that failed is nowhere, and has no numbers.
const known = (x, words) => (Number.isNaN(x) ? "–" : words);
const degrees = (angle) => known(angle, `${((180 * angle) / Math.PI).toFixed(1)}°`);
const short = (x) => known(x, Math.abs(x) < 5e-4 ? "0" : x.toPrecision(3));
// Closer than this to the vertical, in radians, a precession cannot be told.
const UPRIGHT = 0.02;
// The critical spin is that of an upright top. It decides whether a top falls that starts closer
// than this to the vertical; started farther from it a top falls gradually more with less spin.
const NEAR = Math.PI / 90;

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
  // Writes the numbers of the page's first top, and which one that is if there are others.
  update(page) {
    const i = page.tops.findIndex((top) => !top.track && top.role !== "ghost");
    const { spin, nutation } = stage.measure(i);
    const { limits } = page.tops[i];
    const axial = "angular velocity about its own axis, in radians per second";
    const lines = [
      ...this.which(page, i),
      ["tilt", degrees(nutation), "", between(page.tops[i]), "angle between axis and vertical"],
      ["spin", short(spin), " rad/s", critical(limits, stage.record(i, "nutation")[0]), axial],
      ...this.precession(stage.velocity(i), spin, nutation, limits),
    ];
    const turns = (stage.state(i)[0] * spin) / (2 * Math.PI);
    const since = "about its own axis, since the start";
    if (limits) lines.push(["turns", known(turns, Math.abs(turns).toFixed(1)), "", "", since]);
    const item = ([name, value, unit, note, about, colour = ""]) =>
      html`<div title=${about}><dt>${name}</dt>
        <dd class="value" data-unit=${unit} style="color: ${colour}">${value}</dd>
        <dd><small>${note}</small></dd></div>`;
    render(lines.map(item), this.place);
  }
  which({ tops, scene }, i) {
    if (tops.length < 2) return [];
    const place = tops.some((top) => top.side) && scene.distance > 0 ? "left" : "first";
    const { method, step, colour } = tops[i];
    return [["top", place, "", `${method} ${step}`, "the top of these numbers", colour]];
  }
  precession(velocity, spin, nutation, limits) {
    if (!limits || !(Math.sin(nutation) >= UPRIGHT)) return [];
    const now = precessionOf(velocity, spin, nutation);
    const round = (2 * Math.PI) / Math.abs(limits.precession);
    const mean = `mean ${short(limits.precession)}: once round in ${round.toFixed(1)} s`;
    const about = "angular velocity of the axis about the vertical, in radians per second";
    return [["precession", short(now), " rad/s", round < 1e4 ? mean : "", about]];
  }
}
// Returns between which angles the axis moves, by the closed form; other methods nearly keep to it.
function between({ limits, method }) {
  if (!limits) return "";
  const [low, high] = [degrees(limits.least), degrees(limits.greatest)];
  const words = low === high ? "constant" : `${low} to ${high}`;
  return method === "exact" ? words : `exact: ${words}`;
}
const critical = (limits, tilt) =>
  limits?.critical && tilt < NEAR ? `critical ${short(limits.critical)}` : "";
