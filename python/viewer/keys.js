// Keys: each does what the control does that names it as its own; arrows and W, A, S, D move the
// eye. "?" lists them all, over the picture.
import { approach, slide, swing } from "./camera.js";
import { html, render } from "lit-html";

const TURN = Math.PI / 36;
const EYE = {
  ArrowLeft: (view) => swing(view, -TURN, 0),
  ArrowRight: (view) => swing(view, TURN, 0),
  ArrowUp: (view) => swing(view, 0, TURN),
  ArrowDown: (view) => swing(view, 0, -TURN),
  "+": (view) => approach(view, 0.9),
  "-": (view) => approach(view, 1 / 0.9),
  W: (view) => approach(view, 0.9),
  S: (view) => approach(view, 1 / 0.9),
  A: (view) => slide(view, -0.05),
  D: (view) => slide(view, 0.05),
};
const MORE = [
  ["← → ↑ ↓", "Turn the view about the top"],
  ["W S + -", "Move the view nearer, farther"],
  ["A D", "Move the view left, right"],
  ["Escape", "Stop; cancel a drag or a jump"],
  ["Shift + drag", "Green tip: change its length only"],
  ["Alt + drag", "Corner: move the fixed point; so does the middle button"],
  ["Double click", "Show one top alone in the charts; unzoom a chart"],
];

// A line of the list: a key, or two that do the same, and what they do.
const line = ([keys, words]) =>
  html`<li>${keys.split("\n").map((key) => html`<kbd>${key}</kbd> `)}${words}`;

export class Keys {
  letters = true; // whether single letters are keys
  constructor(place, { page, view, hands, presets, choose }) {
    Object.assign(this, { place, page, view, hands, presets, choose });
    addEventListener("keydown", (event) => this.press(event));
  }
  press(event) {
    const { key, target, ctrlKey, metaKey, shiftKey, altKey } = event;
    if (key === "Escape") return this.leave();
    if (this.place.open && key !== "?") return;
    const name = key === " " ? "Space" : key.length === 1 ? key.toUpperCase() : key;
    const isChord = ctrlKey || metaKey;
    const own = /^(Space|Enter)$/.test(name)
      ? "summary, button, [type=checkbox], "
      : /^(Arrow|Home)/.test(name)
        ? "input, "
        : "";
    if (this.hands.drag) return event.preventDefault(); // or Control+Z is for a field elsewhere
    if (altKey) return;
    if (target.closest(`${own}[type=number], select, textarea`)) return;
    if (!this.letters && !isChord && key.length === 1 && key !== " ") return;
    const act = this.meaning(isChord ? `Control+${shiftKey ? "Shift+" : ""}${name}` : name);
    if (!act) return;
    event.preventDefault();
    act();
  }
  meaning(chord) {
    const control = document.querySelector(`[aria-keyshortcuts~="${CSS.escape(chord)}"]`);
    if (control) return () => this.use(control);
    if (EYE[chord]) return () => EYE[chord](this.view);
    return this.presets[chord - 1] && (() => this.choose(this.presets[chord - 1]));
  }
  use(control) {
    if (!control.matches("[type=number]")) return control.disabled || control.click();
    document.getElementById("panel").hidden = false;
    control.closest("details").open = true;
    control.focus();
  }
  leave() {
    if (this.hands.drag) this.hands.cancel();
    else if (this.place.open) this.place.close();
    else this.page.run(false);
  }
  toggle() {
    if (this.place.open) return this.place.close();
    const set = ({ target }) => (this.letters = target.checked);
    render(
      html`<header><h2>Keys</h2>
          <label class="check"><input type="checkbox" .checked=${this.letters} @change=${set}>Single
            letters are keys</label>
          <button autofocus @click=${() => this.place.close()}>Close</button></header>
        <ul>${this.list().map(line)}</ul>`,
      this.place,
    );
    this.place.showModal();
  }
  // Each control that has a key names it.
  list() {
    const words = (control) =>
      control.ariaLabel || (control.labels?.[0] ?? control).textContent.trim();
    const all = [...document.querySelectorAll("[aria-keyshortcuts]")];
    const key = (control) =>
      control.getAttribute("aria-keyshortcuts").replaceAll(" ", "\n").replaceAll("Control", "Ctrl");
    const own = all.map((control) => [key(control), words(control)]);
    const presets = [`1 to ${Math.min(9, this.presets.length)}`, "Choose a scene"];
    return [...own, presets, ...MORE];
  }
}
