// The game "How long can yours stand?". A time counts for the body, gravity and friction of a preset
// with a game, and for a start with at most its kinetic energy.
import { makeBody, measureStart } from "./core.js";
import presets from "./presets.json";
import { completeScene } from "./scene.js";
import { loadText, saveText } from "./storage.js";

// Parts of a scene that are equal within one game.
const EQUAL = ["body", "gravity", "damping", "friction", "turning", "rotor"];
const ROUNDING = 1e-9; // of the energy, relative

// Return the kinetic energy at the start of a scene.
export const computeKineticEnergy = ({ body, rotor, attitude, momentum, ...world }) =>
  measureStart(makeBody(body, rotor), world, attitude, momentum).kinetic;
// Return the name of the game that a scene plays, and the largest energy at its start, or null.
function findGame(scene) {
  const isEqual = (other) => EQUAL.every((k) => JSON.stringify(scene[k]) === JSON.stringify(other[k]));
  const preset = presets.find((each) => each.isGame && isEqual(completeScene(each)));
  return preset ? { name: preset.name, most: computeKineticEnergy(completeScene(preset)) } : null;
}
const getKey = ({ name }) => `longest time, ${name}`;
// Return the longest time of the game that a scene plays: 0 for none yet, null for no game.
export function loadLongestTime(scene) {
  const game = findGame(scene);
  return game && +loadText(getKey(game));
}
// Return the words for a time, and keep it if it is the longest.
export function describeResult(scene, time) {
  const game = findGame(scene);
  if (!game) return "";
  const energy = computeKineticEnergy(scene);
  const [now, most] = [energy, game.most].map((x) => x.toPrecision(4));
  if (energy > game.most * (1 + ROUNDING))
    return `It started with ${now} J, more than ${most} J: this time does not count`;
  const longest = loadLongestTime(scene);
  if (time <= longest) return `The longest time is ${longest.toFixed(2)} s`;
  saveText(getKey(game), time);
  return "This is your longest time";
}
