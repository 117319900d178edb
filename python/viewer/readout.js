// The numbers over the picture: current tilt, spin and precession of the first top. Below them stand limits, critical spin and mean precession from the closed form.
import { html, render } from "lit-html";
import { simulation } from "./core.js";
import { loadLongestTime } from "./game.js";
import { formatMethod, isRodAlone } from "./scene.js";

// Failed tops have no numbers.
const formatKnown = (x, words) => (Number.isNaN(x) ? "–" : words);
const formatDegrees = (angle) => formatKnown(angle, `${((180 * angle) / Math.PI).toFixed(1)}°`);
const formatShort = (x) => formatKnown(x, Math.abs(x) < 5e-4 ? "0" : x.toPrecision(3));
// Nearer to the vertical [rad] the precession is undefined.
const UPRIGHT = 0.02;
// The critical spin is that of an upright top. It is shown for tops that start nearer to the
// vertical than this [rad]; others fall gradually deeper with less spin.
const NEAR = Math.PI / 90;

// Return the angular velocity of the apex about the vertical.
export const computePrecession = ([, , up], spin, nutation) =>
  (up - spin * Math.cos(nutation)) / Math.sin(nutation) ** 2;

export class Readout {
  constructor(parent) {
    this.container = document.createElement("dl");
    this.container.id = "numbers";
    this.container.ariaLabel = "The top in numbers";
    parent.append(this.container);
  }
  // Show the numbers of the first top, and its name if there are others.
  update(page) {
    const i = page.tops.findIndex((top) => !top.track && top.role !== "ghost");
    const { spin, nutation } = simulation.measureTop(i);
    const { limits } = page.tops[i];
    const { body, view, scene } = page;
    // A free body without symmetry spins about any of its axes.
    const isAny = !view.revolution && body.com.every((x) => x === 0) && !scene.gradient;
    const axial = `angular velocity${isAny ? "" : " about its own axis"}, in radians per second`;
    const lines = [
      ...this.describeTop(page, i),
      [
        "tilt",
        formatDegrees(nutation),
        "",
        describeLimits(page.tops[i]),
        "angle between axis and vertical",
      ],
      [
        isAny ? "rotation" : "spin",
        formatShort(isAny ? Math.hypot(...simulation.getVelocity(i)) : spin),
        " rad/s",
        view.wheel
          ? "of the frame"
          : describeCriticalSpin(limits, simulation.getRecord(i, "nutation")[0]),
        axial,
      ],
    ];
    const hasPrecession = limits || page.contact !== null;
    if (hasPrecession)
      lines.push(...describePrecession(simulation.getVelocity(i), spin, nutation, limits));
    lines.push(...describeWheel(page, i), ...describeStanding(page, i));
    if (limits && page.scene.show.torque) lines.push(...describeRule(page, spin, limits));
    const item = ([name, value, unit, note, about, colour = ""]) =>
      html`<div title=${about} class=${name}>
        <dt>${name}</dt>
        <dd class="value" data-unit=${unit} style="color: ${colour}">${value}</dd>
        <dd><small>${note}</small></dd>
      </div>`;
    render(isRodAlone(page.scene) ? "" : lines.map(item), this.container);
  }
  describeTop({ tops, scene }, i) {
    if (tops.length < 2) return [];
    const place = tops.some((top) => top.side) && scene.distance > 0 ? "left" : "first";
    const { colour } = tops[i];
    return [["top", place, "", formatMethod(tops[i]), "the top of these numbers", colour]];
  }
}
function describePrecession(velocity, spin, nutation, limits) {
  if (!(Math.sin(nutation) >= UPRIGHT)) return [];
  const now = computePrecession(velocity, spin, nutation);
  const round = (2 * Math.PI) / Math.abs(limits?.precession);
  const mean = () => `mean ${formatShort(limits.precession)}: once round in ${formatShort(round)} s`;
  const about = "angular velocity of the axis about the vertical, in radians per second";
  return [["precession", formatShort(now), " rad/s", round < 1e4 ? mean() : "", about]];
}
// Return the rate of the wheel in the body.
function describeWheel({ view, scene }, i) {
  if (!view.wheel || scene.show.solid === "none") return [];
  const about = "angular velocity of the wheel in its frame, in radians per second";
  const note = view.wheel.isFree ? "on a free axle" : "driven by a motor";
  return [["wheel", formatShort(view.findRates(i)[1]), " rad/s", note, about]];
}
// Return how long a top with friction has stood, and the longest time of the game that it plays.
function describeStanding({ contact, scene }, i) {
  if (contact === null) return [];
  const end = simulation.getEnd(i);
  const hasEnded = !Number.isNaN(end);
  const time = hasEnded ? end : simulation.getState(i)[0];
  const longest = loadLongestTime(scene);
  const note = longest ? `longest ${longest.toFixed(2)} s` : "";
  const about = "time since the start, until the rim meets the floor";
  return [[hasEnded ? "stood" : "stands", time.toFixed(hasEnded ? 2 : 1), " s", note, about]];
}
// Return the limits of the tilt from the closed form, which other methods only approximate.
function describeLimits({ limits, method }) {
  if (!limits) return "";
  const [low, high] = [formatDegrees(limits.least), formatDegrees(limits.greatest)];
  const words = low === high ? "constant" : `${low} to ${high}`;
  return method === "exact" ? words : `exact: ${words}`;
}
// Return the precession rate of a fast top, M g l / (I3 w3), beside the mean one. M g l is the
// torque of the weight at a horizontal axis, I3 w3 the angular momentum about the axis.
function describeRule({ body, scene }, spin, { precession }) {
  const { mass, moments, com, rotor } = body;
  const axis = com.findIndex((x) => x !== 0);
  const axial = moments[axis] * spin + rotor[axis] * Math.sign(com[axis]);
  if (!scene.gravity || !(Math.abs(precession) > 0) || !(Math.abs(axial) > 1e-9)) return [];
  const rule = (mass * scene.gravity * Math.abs(com[axis])) / axial;
  const percent = 100 * (rule / precession - 1);
  const side = percent < 0 ? "below" : "above";
  const words = `Mgl / I₃ω₃: ${Math.abs(percent).toFixed(1)} % ${side} the mean precession`;
  const about =
    "For fast tops, the precession is the torque of the weight, M g l with a level axis, " +
    "over the angular momentum about the axis, I₃ω₃";
  return [["fast-top rule", formatShort(rule), " rad/s", words, about]];
}
const describeCriticalSpin = (limits, tilt) =>
  limits?.critical && tilt < NEAR ? `critical ${formatShort(limits.critical)}` : "";
