// Letters in the picture, beside what they name. They stand upright while all else moves.
import { html, render } from "lit-html";

const GAP = 17; // between two letters, in pixels
const isHigher = (a, b) => (a.place?.[1] ?? 0) - (b.place?.[1] ?? 0);

export class Letters {
  constructor(parent) {
    this.place = document.createElement("div");
    Object.assign(this.place, { className: "letters", ariaHidden: true });
    parent.append(this.place);
    this.all = [];
  }
  // Takes other letters: each has its words, a colour or "", and a function that tells its place in
  // pixels, null where it is not to be seen.
  set(all) {
    const letter = ({ words, colour, about = "" }) =>
      html`<span class=${colour && "arrow"} title=${about} style="color: ${colour}">${words}</span>`;
    render(all.map(letter), this.place);
    const spans = this.place.children;
    this.all = all.map(({ words, at }, i) => ({ span: spans[i], at, wide: 7 * words.length + 12 }));
  }
  // Puts all where they belong. Of two that would lie over each other the lower gives way.
  follow([width, height]) {
    const taken = [];
    const placed = this.all.map((letter) => ({ ...letter, place: letter.at() }));
    for (const { span, place, wide } of placed.sort(isHigher)) {
      const inside = place && place[0] > 4 && place[0] < width - 8;
      span.hidden = !inside || place[1] < 4 || place[1] > height - 8;
      if (span.hidden) continue;
      const x = Math.min(place[0], width - wide);
      let [, y] = place;
      const meets = ([a, b, w]) => a < x + wide && x < a + w && Math.abs(b - y) < GAP;
      for (let i = 0; i < 4 && taken.some(meets); i++) y += GAP;
      taken.push([x, y, wide]);
      span.style.transform = `translate(${x.toFixed(1)}px, ${y.toFixed(1)}px)`;
    }
  }
}
