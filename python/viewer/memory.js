// Remembers light or dark, where a browser lets the page: a notebook's frame or a visitor may
// forbid it, and then each visit begins as the system has it.
const KEY = "kreisel: light or dark";

export function remembered() {
  try {
    return localStorage.getItem(KEY) ?? "";
  } catch {
    return "";
  }
}
export function remember(light) {
  try {
    localStorage.setItem(KEY, light);
  } catch {
    // It is not remembered.
  }
}
