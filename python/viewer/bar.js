// The bar in the picture: what makes time go on and leads the eye, always within reach.
import { html, nothing, render } from "lit-html";
import { home } from "./camera.js";

const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 5, 10];

export class Bar {
  constructor(place, page, hands, keys) {
    Object.assign(this, { place, page, hands, keys });
  }
  draw() {
    const { page, hands, keys } = this;
    const moving = page.running || page.goal !== null;
    const push = () => {
      hands.pushes = !hands.pushes;
      this.draw();
    };
    render(
      [
        tool("↺", "Rewind", "R", () => page.restart()),
        moving
          ? tool("❚❚", "Stop", "Space", () => page.run(false))
          : tool("▶", "Start", "Space", () => page.run(true)),
        tool("▶❚", "Step", ".", () => page.step()),
        tool("↶", "Undo", "Z Control+Z", () => page.undo(), { off: !page.past.length }),
        tool("↷", "Redo", "Control+Shift+Z Control+Y", () => page.redo(), {
          off: !page.future.length,
        }),
        this.speed(),
        html`<span id="clock" role="timer" aria-label="Time"></span>`,
        tool("⌂", "Home view", "Home", () => home(page.view)),
        tool("☞", "Push", "X", push, { pressed: !!hands.pushes }),
        document.fullscreenEnabled ? tool("⤢", "Full screen", "F", fill) : "",
        tool("?", "Keys", "?", () => keys.toggle()),
      ],
      this.place,
    );
  }
  speed() {
    const { page } = this;
    const { speed } = page.scene;
    const all = SPEEDS.includes(speed) ? SPEEDS : [speed, ...SPEEDS];
    const set = ({ target }) => page.set("speed", +target.value);
    return html`<select aria-label="Pace" title="Pace: units of time per second" @change=${set}>
      ${all.map((x) => html`<option value=${x} .selected=${x === speed}>×${+x.toPrecision(3)}`)}
      </select>`;
  }
}
const tool = (sign, name, key, act, { pressed = nothing, off = false } = {}) =>
  html`<button aria-label=${name} title="${name} (${key.split(" ")[0]})" aria-pressed=${pressed}
    aria-keyshortcuts=${key} ?disabled=${off} @click=${act}>${sign}</button>`;
function fill() {
  if (document.fullscreenElement) document.exitFullscreen();
  else document.documentElement.requestFullscreen();
}
