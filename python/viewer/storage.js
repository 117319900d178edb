// Storage of texts between visits: the colour scheme, and the longest time of a game. Where a browser
// forbids storage, they last for this visit only.
const kept = {};

export function loadText(name) {
  try {
    return localStorage.getItem(`kreisel: ${name}`) ?? "";
  } catch {
    return kept[name] ?? "";
  }
}
export function saveText(name, text) {
  kept[name] = text;
  try {
    localStorage.setItem(`kreisel: ${name}`, text);
  } catch {
    // `kept` has it.
  }
}
