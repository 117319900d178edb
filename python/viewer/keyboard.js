// Keys of the viewer. A control names its keys in aria-keyshortcuts; arrows and W, A, S, D move the
// camera. "?" opens the list of keys, or of gestures where there are none.
import { zoomBy, panBy, orbitBy } from "./camera.js";
import { html, render } from "lit-html";

const TURN_ANGLE = Math.PI / 36;
const CAMERA_KEYS = {
  ArrowLeft: (view) => orbitBy(view, -TURN_ANGLE, 0),
  ArrowRight: (view) => orbitBy(view, TURN_ANGLE, 0),
  ArrowUp: (view) => orbitBy(view, 0, TURN_ANGLE),
  ArrowDown: (view) => orbitBy(view, 0, -TURN_ANGLE),
  "+": (view) => zoomBy(view, 0.9),
  "-": (view) => zoomBy(view, 1 / 0.9),
  W: (view) => zoomBy(view, 0.9),
  S: (view) => zoomBy(view, 1 / 0.9),
  A: (view) => panBy(view, -0.05),
  D: (view) => panBy(view, 0.05),
};
const OTHER_KEYS = [
  ["← → ↑ ↓", "Turn the view about the top"],
  ["W S + -", "Zoom in, out"],
  ["A D", "Move the view left, right"],
  ["Escape", "Stop; cancel a drag or a jump"],
  ["Shift + drag", "Green tip: change its length only"],
  ["Alt + drag", "Corner: move the fixed point; so does the middle button"],
  ["Double click", "Show one top alone in the charts; reset the zoom of a chart"],
];

const GESTURES = [
  ["Swipe along the rim", "Spin a round top, faster or slower"],
  ["Drag the pen", "Tilt the top and turn it about the vertical"],
  ["Drag the green tip", "Change the momentum m"],
  ["☞, then swipe", "Push the top"],
  ["One finger beside it", "Turn the view"],
  ["Two fingers", "Zoom, or move the view"],
  ["Two taps on a top", "Show it alone in the charts"],
  ["green m", "Angular momentum: only a torque changes it"],
  ["blue ω", "The axis about which the top turns now"],
  ["grey p", "The vertical, as long as gravity is strong"],
  ["violet torque", "Turns m sideways: “Why does it not fall?” shows it"],
];

// Render a line of the list: the keys and their action.
const renderLine = ([keys, words]) =>
  html`<li>${keys.split("\n").map((key) => html`<kbd>${key}</kbd> `)}${words}`;

export class Keyboard {
  hasLetterKeys = true; // false disables single characters without Control, except Space
  constructor(place, { page, view, drags, presets, choosePreset }) {
    const share = document.getElementById("share");
    Object.assign(this, { place, share, page, view, drags, presets, choosePreset });
    addEventListener("keydown", (event) => this.handleKey(event));
  }
  handleKey(event) {
    const { key, target, ctrlKey, metaKey, shiftKey, altKey } = event;
    if (key === "Escape") return this.handleEscape();
    if (this.place.open && key !== "?") return;
    const name = key === " " ? "Space" : key.length === 1 ? key.toUpperCase() : key;
    const isChord = ctrlKey || metaKey;
    const own = /^(Space|Enter)$/.test(name)
      ? "summary, button, [type=checkbox], "
      : /^(Arrow|Home)/.test(name)
        ? "input, "
        : "";
    if (this.drags.current) return event.preventDefault(); // Control+Z would change a field
    if (altKey) return;
    if (target.closest(`${own}[type=number], select, textarea`)) return;
    if (!this.hasLetterKeys && !isChord && key.length === 1 && key !== " ") return;
    const act = this.findAction(isChord ? `Control+${shiftKey ? "Shift+" : ""}${name}` : name);
    if (!act) return;
    event.preventDefault();
    act();
  }
  findAction(chord) {
    const control = document.querySelector(`[aria-keyshortcuts~="${CSS.escape(chord)}"]`);
    if (control) return () => this.activateControl(control);
    if (CAMERA_KEYS[chord]) return () => CAMERA_KEYS[chord](this.view);
    return this.presets[chord - 1] && (() => this.choosePreset(this.presets[chord - 1]));
  }
  activateControl(control) {
    if (!control.matches("[type=number]")) return control.disabled || control.click();
    document.getElementById("panel").hidden = false;
    control.closest("details").open = true;
    control.focus();
  }
  handleEscape() {
    if (this.drags.current) this.drags.cancelDrag();
    else if (this.place.open) this.place.close();
    else if (this.share.open) this.share.close();
    else this.page.setRunning(false);
  }
  toggleList() {
    if (this.place.open) return this.place.close();
    const set = ({ target }) => (this.hasLetterKeys = target.checked);
    const isTouched = matchMedia("(hover: none)").matches; // a phone has no keys
    const letters = html`<label class="check"><input type="checkbox" .checked=${this.hasLetterKeys}
      @change=${set}>Single letters are keys</label>`;
    render(
      html`<header><h2>${isTouched ? "Gestures and arrows" : "Keys"}</h2>${isTouched ? "" : letters}
          <button autofocus @click=${() => this.place.close()}>Close</button></header>
        <ul>${(isTouched ? GESTURES : this.listKeys()).map(renderLine)}</ul>`,
      this.place,
    );
    this.place.showModal();
  }
  // List all keys, first those of the controls.
  listKeys() {
    const words = (control) =>
      control.ariaLabel || (control.labels?.[0] ?? control).textContent.trim();
    const all = [...document.querySelectorAll("[aria-keyshortcuts]")];
    const key = (control) =>
      control.getAttribute("aria-keyshortcuts").replaceAll(" ", "\n").replaceAll("Control", "Ctrl");
    const own = all.map((control) => [key(control), words(control)]);
    const presets = [`1 to ${Math.min(9, this.presets.length)}`, "Choose a scene"];
    return [...own, presets, ...OTHER_KEYS];
  }
}
