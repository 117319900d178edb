// Things to try: each preset has three, which are scenes that differ from it in a few words and say
// what to look for. Numbers in such texts are computed: "{round}" is what the closed form says of
// the scene, "{round before}" what it says of the preset.
import { html } from "lit-html";
import { limitsOf, makeBody } from "./core.js";
import presets from "./presets.json";
import { complete } from "./scene.js";

const degrees = (angle) => `${((180 * angle) / Math.PI).toFixed(1)}°`;
// Returns the numbers that texts may tell of a scene, as they are written.
export function factsOf(scene) {
  const { body, gravity, attitude, momentum } = scene;
  const limits = limitsOf(makeBody(body), gravity, attitude, momentum);
  if (!limits) return {};
  const { least, greatest, critical, precession, period, spin } = limits;
  const round = (2 * Math.PI) / Math.abs(precession);
  const digits = (x) => String(+x.toPrecision(3));
  return {
    highest: degrees(least),
    lowest: degrees(greatest),
    spin: digits(spin),
    critical: digits(critical),
    precession: digits(precession),
    round: digits(round),
    nod: digits(period),
    nods: digits(round / period),
  };
}
export const presetOf = ({ name }) => presets.find((preset) => preset.name === name);
const filled = (text, facts) => text.replace(/\{([a-z ]+)\}/g, (all, word) => facts[word] ?? all);
const COURSES = {
  sleeping: "The top sleeps: it stands upright.",
  hanging: "The top hangs down and turns.",
  steady: "The axis moves on a level circle, {highest} from the vertical.",
  pendulum: "A pendulum: without spin the axis swings in a plane.",
  rosette: "The axis passes through the vertical each time.",
  separatrix: "The axis rises towards the vertical, ever more slowly.",
  loops: "The axis draws loops between {highest} and {lowest}.",
  cusps: "The axis comes to rest in cusps at {highest} and falls to {lowest}.",
  waves: "The axis moves up and down in waves between {highest} and {lowest}.",
  circle: "No torque: the axis moves on a circle about the momentum.",
  resting: "No torque: the axis is at rest.",
};
// Returns what is true of a scene in words: its own, or what is computed if it has none, or a hand
// changed it.
export function aboutOf({ scene, tops }) {
  const facts = factsOf(scene);
  const preset = presetOf(scene);
  const before = preset ? factsOf(complete(preset)) : {};
  for (const [key, value] of Object.entries(before)) facts[`${key} before`] = value;
  const isOwn = scene.about && !scene.name.endsWith(", changed");
  if (isOwn) return filled(scene.about, facts);
  const { course } = tops.find((top) => top.limits)?.limits ?? {};
  return course ? filled(COURSES[course], facts) : "A scene of your own.";
}

// The buttons of a preset.
export function tries(page, choose) {
  const preset = presetOf({ name: page.scene.name.replace(/, changed$/, "") });
  const attempt = ({ ask, look, ...words }) => {
    const scene = { ...preset, ...words, about: look };
    if (words.momentum || words.attitude) delete scene.start;
    scene.show = { ...preset.show, ...words.show };
    const on = page.scene.about === look;
    const act = () => choose(scene);
    return html`<button class="try" aria-pressed=${on} @click=${act}>${ask}</button>`;
  };
  if (!preset?.tries) return "";
  const again = page.scene.about !== preset.about || page.scene.name !== preset.name;
  return html`<section aria-label="Try this" class="tries"><b>Try this</b>
    ${preset.tries.map(attempt)}
    <button class="try" ?hidden=${!again} @click=${() => choose(preset)}>Back to the start</button>
    </section>`;
}
