// Exercises: each preset has variations with a title and a text. Numbers in texts are
// computed from the closed form: "{round}" for the scene, "{round before}" for the preset.
import { html, nothing } from "lit-html";
import { computeLimits, makeBody } from "./core.js";
import presets from "./presets.json";
import { computeKineticEnergy } from "./game.js";
import { completeScene, hasFriction } from "./scene.js";

const formatDegrees = (angle) => `${((180 * angle) / Math.PI).toFixed(1)}°`;
// Return the limits of the motion of a scene, without friction, with which it has no closed form.
export function findLimits({ body, rotor, wheel, attitude, momentum, ...scene }) {
  const world = { ...scene, damping: 0, friction: 0 };
  return computeLimits(makeBody(body, rotor, wheel), world, attitude, momentum);
}
// Return the numbers for the texts of a scene, formatted.
function computeFacts(scene) {
  const limits = findLimits(scene);
  if (!limits) return {};
  const { least, greatest, critical, precession, period, spin } = limits;
  const round = (2 * Math.PI) / Math.abs(precession);
  const formatDigits = (x) => String(+x.toPrecision(3));
  return {
    highest: formatDegrees(least),
    lowest: formatDegrees(greatest),
    spin: formatDigits(spin),
    critical: formatDigits(critical),
    precession: formatDigits(precession),
    round: formatDigits(round),
    nod: formatDigits(period),
    nods: formatDigits(round / period),
    table: formatDigits((2 * Math.PI) / Math.abs(scene.turning[2])),
    energy: formatDigits(computeKineticEnergy(scene)),
  };
}
export const findPreset = ({ name }) => presets.find((preset) => preset.name === name);
export const fillIn = (text, facts) => text.replace(/\{([a-z ]+)\}/g, (all, word) => facts[word] ?? all);
const MOTION_TEXTS = {
  sleeping: "The top sleeps: it stands upright.",
  hanging: "The top hangs down and turns.",
  steady: "The axis moves on a horizontal circle, {highest} from the vertical.",
  pendulum: "A pendulum: without spin the axis swings in a plane.",
  rosette: "The axis passes through the vertical each time.",
  separatrix: "The axis approaches the vertical, ever more slowly.",
  loops: "The axis draws loops between {highest} and {lowest}.",
  cusps: "The axis comes to rest in cusps at {highest} and falls to {lowest}.",
  waves: "The axis moves up and down in waves between {highest} and {lowest}.",
  circle: "No torque: the axis moves on a circle about the momentum.",
  resting: "No torque: the axis is at rest.",
};
// Return the numbers for the texts of a scene, and those of its preset with "before" in their names.
export function collectFacts(scene) {
  const preset = findPreset(scene);
  const before = preset ? computeFacts(completeScene(preset)) : {};
  const earlier = Object.entries(before).map(([key, value]) => [`${key} before`, value]);
  return { ...computeFacts(scene), ...Object.fromEntries(earlier) };
}
// Return the text of a scene. Scenes without a text and edited scenes get a computed one.
export function describeScene({ scene, tops }) {
  const facts = collectFacts(scene);
  const isOwn = scene.about && !scene.name.endsWith(", changed");
  if (isOwn) return fillIn(scene.about, facts);
  if (hasFriction(scene)) return "Friction takes energy from this top.";
  const { motionType } = tops.find((top) => top.limits)?.limits ?? {};
  return motionType ? fillIn(MOTION_TEXTS[motionType], facts) : "A scene of your own.";
}

// Render the text of a scene. Names of visible arrows have the colours of the arrows.
const NAMES = {
  "momentum m": "momentum",
  "momentum h": "rotor",
  torque: "torque",
  weight: "weight",
};
export function renderWords(page) {
  const { rotor, show } = page.scene;
  const { arrows, torque, momentum } = show;
  const isTurning = rotor.some((x) => x !== 0);
  const seen = { momentum, rotor: isTurning, torque: torque && momentum, weight: torque };
  const render = (words) =>
    arrows && seen[NAMES[words]] ? html`<b class=${NAMES[words]}>${words}</b>` : words;
  return describeScene(page).split(/\b(momentum [mh]|torque|weight)\b/).map(render);
}

// Return the scene of an exercise.
export function makeExerciseScene(preset, { text, ...changes }) {
  const scene = { ...preset, ...changes, about: text };
  if (changes.momentum || changes.attitude) delete scene.start;
  scene.show = { ...preset.show, ...changes.show };
  return scene;
}

// Return the exercise that a scene was made from, or undefined.
export const findExercise = ({ name, about }) =>
  findPreset({ name })?.exercises?.find(({ text }) => text === about);
const START_KEYS = ["attitude", "momentum", "second"];
const hasSameStart = (one, other) =>
  START_KEYS.every((key) => JSON.stringify(one[key]) === JSON.stringify(other[key]));
// Return the words for where the start of the scene comes from.
export function describeStart({ scene, origin }) {
  if (scene.taken !== null) return `the motion at t = ${scene.taken.toFixed(2)} s`;
  if (!hasSameStart(scene, origin)) return "changed by hand";
  const exercise = findExercise(origin);
  const isChanged = exercise && !hasSameStart(scene, completeScene(findPreset(origin)));
  return isChanged ? `changed by “${exercise.title}”` : "as given";
}

export const hasQuestions = (preset) => !!preset?.exercises?.some(({ ask }) => ask);
// Render a link to the story of the current preset, if it has one.
export const renderStoryLink = (scene) =>
  findPreset(scene)?.story ? html`<a class="beat" href="#story">Why? In one minute ▸</a>` : "";
// Render the buttons of the current preset.
export function renderExercises(page, choosePreset, predictions) {
  const preset = findPreset({ name: page.scene.name.replace(/, changed$/, "") });
  if (!preset?.exercises) return "";
  const { exercises } = preset;
  const isOpen = ({ text }) => page.scene.about === text;
  const open = (exercise) => predictions.open(preset, exercise);
  const renderExercise = (exercise) =>
    html`<button class="exercise" aria-pressed=${isOpen(exercise)} @click=${() => open(exercise)}>
      ${exercise.title}</button>`;
  const openNext = () => open(exercises[(exercises.findIndex(isOpen) + 1) % exercises.length]);
  const again = page.scene.about !== preset.about || page.scene.name !== preset.name;
  return html`<section aria-label="Try this" class="exercises"><div class="row"><b>Try this</b>
    <button aria-label="Next exercise" aria-keyshortcuts="Y" @click=${openNext}>Next ▸</button>
    <button aria-pressed=${predictions.isOn} aria-keyshortcuts=";" ?disabled=${!hasQuestions(preset)}
      title=${hasQuestions(preset) ? nothing : "no exercise of this scene asks a question"}
      @click=${() => predictions.toggle()}>Predict first</button>
    <button aria-label="Back to the start" ?hidden=${!again}
      @click=${() => choosePreset(preset)}>Back</button></div>
    ${exercises.map(renderExercise)}
    </section>`;
}
