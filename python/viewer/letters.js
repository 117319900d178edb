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
    this.corner = [0, 0];
  }
  // Keeps off what stands in the upper left corner.
  avoid(element) {
    const { offsetLeft: x, offsetTop: y } = element;
    const keep = ([{ contentRect: { width, height } }]) => (this.corner = [x + width, y + height]);
    new ResizeObserver(keep).observe(element);
  }
  // Takes other letters: each has its words, a colour or "", and a function that tells its place in
  // pixels, null where it is not to be seen. In a hall they are so many times as large.
  set(all, times = 1) {
    const letter = ({ words, colour, about = "" }) =>
      html`<span class=${colour && "arrow"} title=${about}
        style="color: ${colour}">${words}</span>`;
    render(all.map(letter), this.place);
    const spans = this.place.children;
    const wide = ({ words }) => times * (7 * words.length + 12);
    this.all = all.map((each, i) => ({ span: spans[i], at: each.at, wide: wide(each) }));
    this.gap = times * GAP;
  }
  // Puts all where they belong. Of two that would lie over each other the lower gives way.
  follow([width, height], covered) {
    const { gap, corner } = this;
    const taken = [];
    const placed = this.all.map((letter) => ({ ...letter, place: letter.at() }));
    for (const { span, place, wide } of placed.sort(isHigher)) {
      const isInside = place && place[0] > 4 && place[0] < width - 8 && place[1] > 4;
      const x = isInside && Math.min(place[0], width - wide);
      let y = isInside && place[1];
      const meets = ([a, b, w]) => a < x + wide && x < a + w && Math.abs(b - y) < gap;
      const isOver = () => (x < corner[0] && y < corner[1] + gap / 2) || taken.some(meets);
      for (let i = 0; i < 6 && isOver(); i++) y += gap;
      span.hidden = !isInside || y > height - covered - 16;
      if (span.hidden) continue;
      taken.push([x, y, wide]);
      span.style.transform = `translate(${x.toFixed(1)}px, ${y.toFixed(1)}px)`;
    }
  }
}
