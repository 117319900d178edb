// Storage of the colour scheme. Where a browser forbids storage, each visit uses the scheme of the
// system.
const KEY = "kreisel: light or dark";

export function loadColorScheme() {
  try {
    return localStorage.getItem(KEY) ?? "";
  } catch {
    return "";
  }
}
export function saveColorScheme(light) {
  try {
    localStorage.setItem(KEY, light);
  } catch {
    // The choice lasts for this visit only.
  }
}
