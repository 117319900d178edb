// The toolbar over the picture: time, speed and view.
import { html, nothing, render } from "lit-html";
import { showHomeView } from "./camera.js";

const SPEEDS = [0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1, 2, 5, 10];

export class Toolbar {
  constructor(place, page, drags, keyboard, share) {
    Object.assign(this, { place, page, drags, keyboard, share });
  }
  draw() {
    const { page, drags, keyboard, share } = this;
    const isMoving = page.isRunning || page.goal !== null;
    const hand = document.getElementById("hand");
    const toggleDials = () => {
      hand.hidden = !hand.hidden;
      this.draw();
    };
    const togglePush = () => {
      drags.isPushing = !drags.isPushing;
      this.draw();
    };
    render(
      [
        renderButton("↺", "Rewind", "R", () => page.rewind()),
        isMoving
          ? renderButton("❚❚", "Stop", "Space", () => page.setRunning(false))
          : renderButton("▶", "Start", "Space", () => page.start()),
        renderButton("▶❚", "Step", ".", () => page.stepOnce()),
        renderButton("↶", "Undo", "Z Control+Z", () => page.undo(), {
          off: !page.undoStack.length,
        }),
        renderButton("↷", "Redo", "Control+Shift+Z Control+Y", () => page.redo(), {
          off: !page.redoStack.length,
        }),
        this.renderPaceMenu(),
        html`<span id="clock" role="timer" aria-label="Time"></span>`,
        renderButton("⊶", "Dials: spin, tilt, gravity", ",", toggleDials, { pressed: !hand.hidden }),
        renderButton("⌂", "Home view", "Home", () => showHomeView(page.view)),
        renderButton("☞", "Push", "X", togglePush, { pressed: !!drags.isPushing }),
        document.fullscreenEnabled ? renderButton("⤢", "Full screen", "F", toggleFullScreen) : "",
        renderButton("↗", "Share", "K", () => share.open()),
        renderButton("?", "Keys", "?", () => keyboard.toggleList()),
      ],
      this.place,
    );
  }
  renderPaceMenu() {
    const { page } = this;
    const { speed } = page.scene;
    const all = SPEEDS.includes(speed) ? SPEEDS : [speed, ...SPEEDS];
    const setSpeed = ({ target }) => page.setValue("speed", +target.value);
    return html`<select aria-label="Pace" title="Pace of the film: seconds of the motion per second"
      @change=${setSpeed}>
      ${all.map((x) => html`<option value=${x} .selected=${x === speed}>×${+x.toPrecision(3)}`)}
      </select>`;
  }
}
const renderButton = (sign, name, key, act, { pressed = nothing, off = false } = {}) =>
  html`<button aria-label=${name} data-tip="${name} (${key.split(" ")[0]})" aria-pressed=${pressed}
    aria-keyshortcuts=${key} ?disabled=${off} @click=${act}>${sign}</button>`;
function toggleFullScreen() {
  if (document.fullscreenElement) document.exitFullscreen();
  else document.documentElement.requestFullscreen();
}
