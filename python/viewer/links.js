// Links to a scene: its differences from a preset or from an exercise, or from the default scene.
import { findPreset, makeExerciseScene } from "./exercises.js";
import { completeScene, DEFAULTS } from "./scene.js";

const START = "#scene=";

// Return the entries of `given` that differ from those of `base`; `show` is compared by its parts.
function listDifferences(given, base) {
  const isOwn = ([key, value]) => JSON.stringify(value) !== JSON.stringify(base[key]);
  const own = Object.fromEntries(Object.entries(given).filter(isOwn));
  if (own.show && base.show) own.show = listDifferences(own.show, base.show);
  return own;
}
// Return the complete scene of a preset, or of one of its exercises. Throws an Error for an unknown
// name.
function findScene(name, title) {
  const preset = findPreset({ name });
  if (!preset) throw new Error(`there is no scene “${name}”`);
  if (title === undefined) return completeScene(preset);
  const exercise = preset.exercises.find((each) => each.title === title);
  if (!exercise) throw new Error(`the scene “${name}” has no exercise “${title}”`);
  return completeScene(makeExerciseScene(preset, exercise));
}

// Return the part of a link after the address of the page.
export function encodeScene(scene) {
  const preset = findPreset({ name: scene.name.replace(/, changed$/, "") });
  const title = preset?.exercises.find((each) => each.text === scene.about)?.title;
  const names = preset ? { preset: preset.name, exercise: title } : {};
  const base = preset ? findScene(preset.name, title) : DEFAULTS;
  const parts = { ...names, ...listDifferences(scene, base) };
  return START + encodeURIComponent(JSON.stringify(parts));
}
function parseLink(text) {
  try {
    return JSON.parse(decodeURIComponent(text));
  } catch {
    throw new Error("the link is damaged or cut off");
  }
}
// Return the scene of a link, or null if the address has none. Throws an Error for a damaged link.
export function decodeScene(hash) {
  if (!hash.startsWith(START)) return null;
  const given = parseLink(hash.slice(START.length));
  if (given?.preset === undefined) return given;
  const { preset, exercise, ...own } = given;
  const base = findScene(preset, exercise);
  return { ...base, ...own, show: { ...base.show, ...own.show } };
}
