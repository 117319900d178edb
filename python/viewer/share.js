// The dialog "Share": a link to the scene, a square picture, and a film of six seconds.
import { html, render } from "lit-html";
import { saveFile } from "./downloads.js";
import { encodeScene } from "./links.js";

const CAPTION = 0.035; // height of the name in the picture
const FILM_TYPES = ["video/mp4", "video/webm"];

// Put the link to the scene into the address bar, and offer it to other programs: by the menu of a
// phone, or by the clipboard. `showMessage` receives words on where the link is.
async function shareLink({ scene }, showMessage) {
  try {
    history.replaceState(null, "", encodeScene(scene));
  } catch {
    return showMessage("A page in a notebook has no address: save “This page” instead");
  }
  const { href } = location;
  showMessage("The address of this page is now a link to this scene");
  try {
    if (navigator.share && matchMedia("(pointer: coarse)").matches)
      return await navigator.share({ title: scene.name, url: href });
    await navigator.clipboard.writeText(href);
    showMessage("Copied: a link to this scene, which is now the address of this page");
  } catch {
    // The address bar shows the link.
  }
}

// Make a square canvas. `draw` copies the middle of the picture onto it and writes the name of the
// scene over it.
function makeSquare({ canvas }, { scene }, size) {
  const square = Object.assign(document.createElement("canvas"), { width: size, height: size });
  const paper = square.getContext("2d");
  const draw = () => {
    const { width, height } = canvas;
    const side = Math.min(width, height);
    paper.drawImage(canvas, (width - side) / 2, (height - side) / 2, side, side, 0, 0, size, size);
    paper.font = `${CAPTION * size}px system-ui`;
    paper.fillStyle = getComputedStyle(document.getElementById("about")).color;
    paper.fillText(scene.name, CAPTION * size, (1 - CAPTION) * size);
  };
  return { square, draw };
}

export class ShareDialog {
  size = 1080; // of a picture or a film, in pixels
  seconds = 6; // length of a film
  constructor(place, page, view) {
    Object.assign(this, { place, page, view, isFilming: false });
    this.filmType = FILM_TYPES.find((type) => globalThis.MediaRecorder?.isTypeSupported(type));
  }
  open() {
    shareLink(this.page, (words) => {
      this.words = words;
      this.draw();
    });
    if (!this.place.open) this.place.show();
  }
  draw() {
    const film = this.isFilming ? "Filming …" : `Film of ${this.seconds} seconds`;
    render(
      html`<p role="status">${this.words}</p><div class="row">
        <button @click=${() => this.savePicture()}>Square picture</button>
        <button ?disabled=${this.isFilming} @click=${() => this.saveFilm()}>${film}</button>
        <button @click=${() => this.place.close()}>Close</button></div>`,
      this.place,
    );
  }
  savePicture() {
    const { view, page } = this;
    view.renderSquare(this.size, () => {
      const { square, draw } = makeSquare(view, page, this.size);
      draw();
      square.toBlob((blob) => saveFile("kreisel.png", blob));
    });
  }
  // Record the picture while the top moves.
  saveFilm() {
    const { view, page, filmType } = this;
    const { square, draw } = makeSquare(view, page, this.size);
    if (!filmType || !square.captureStream)
      return page.showMessage("This browser cannot record films");
    const recorder = new MediaRecorder(square.captureStream(30), { mimeType: filmType });
    recorder.ondataavailable = ({ data }) =>
      data.size
        ? saveFile(`kreisel.${filmType.slice(6)}`, data)
        : page.showMessage("The browser has recorded no film: it may be too slow");
    const end = performance.now() + 1000 * this.seconds;
    const drawFrame = () => {
      draw();
      if (performance.now() < end) return requestAnimationFrame(drawFrame);
      recorder.stop();
      view.recording = false;
      this.isFilming = false;
      this.draw();
    };
    page.start();
    recorder.start();
    view.recording = view.isDirty = true;
    this.isFilming = true;
    this.draw();
    drawFrame();
  }
}
