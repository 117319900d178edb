// Labels over the picture, beside arrows, circles and tops.
import { html, render } from "lit-html";

const GAP = 20; // between two labels, in pixels
const [ABOVE, BELOW] = [10, 12]; // of a label, from its position to its ends
const MARGIN = 8; // from a label to the position on its right
const isHigher = (a, b) => (a.place?.[1] ?? 0) - (b.place?.[1] ?? 0);

export class Labels {
  constructor(parent) {
    this.container = document.createElement("div");
    Object.assign(this.container, { className: "labels", ariaHidden: true });
    parent.append(this.container);
    this.all = [];
    this.corner = [0, 0];
    this.texts = [];
  }
  // Keep labels off an element in the upper left corner.
  avoidElement(element) {
    const { offsetLeft: x, offsetTop: y } = element;
    const keep = ([
      {
        contentRect: { width, height },
      },
    ]) => {
      this.corner = [x + width, y + height];
      this.placeAgain();
    };
    new ResizeObserver(keep).observe(element);
  }
  // Keep labels off elements with a text, where they are now.
  avoidTexts(elements) {
    const { x, y } = this.container.getBoundingClientRect();
    const boxes = elements.filter((each) => each.textContent).map((each) => each.getBoundingClientRect());
    this.texts = boxes.map((box) => [box.left - x, box.top - y, box.right - x, box.bottom - y]);
    this.placeAgain();
  }
  placeAgain() {
    if (this.picture) this.placeLabels(...this.picture);
  }
  // Replace all labels. Each has its text, a colour or "", and `at`, which returns its position in
  // pixels, and whether it stands to the left of it, or null. `times` scales the room for each of
  // them; the style sheet scales the text.
  setLabels(all, times = 1) {
    const label = ({ words, colour, about = "" }) =>
      html`<span class=${colour && "arrow"} title=${about}
        style=${colour && `color: color-mix(in srgb, ${colour} 80%, light-dark(#000, #fff))`}>${words}</span>`;
    render(all.map(label), this.container);
    const spans = this.container.children;
    const wide = ({ words, colour }) => times * (colour ? 9 * words.length + 20 : 7 * words.length + 12);
    this.all = all.map((each, i) => ({ span: spans[i], at: each.at, wide: wide(each) }));
    this.gap = times * GAP;
  }
  // Place all labels. A label that would overlap a higher one moves down; one under the footer or
  // another text is hidden.
  placeLabels(size, covered) {
    this.picture = [size, covered];
    const [width, height] = size;
    const { gap, corner } = this;
    const taken = [];
    const placed = this.all.map((label) => ({ ...label, place: label.at() }));
    for (const { span, place, wide } of placed.sort(isHigher)) {
      const isInside = place && place[0] > 4 && place[0] < width - 8 && place[1] > 4;
      const isLeft = isInside && place[2] && place[0] > wide + MARGIN;
      const right = isInside && Math.min(place[0], width - wide - MARGIN);
      const x = isLeft ? place[0] - wide - MARGIN : right;
      let y = isInside && place[1];
      const meets = ([a, b, w]) => a < x + wide && x < a + w && Math.abs(b - y) < gap;
      const isOver = () => (x < corner[0] && y < corner[1] + gap / 2) || taken.some(meets);
      for (let i = 0; i < 6 && isOver(); i++) y += gap;
      const isUnder = ([left, top, right, bottom]) =>
        x < right && x + wide > left && y + BELOW > top && y - ABOVE < bottom;
      span.hidden = !isInside || y > height - covered - 16 || this.texts.some(isUnder);
      if (span.hidden) continue;
      taken.push([x, y, wide]);
      const across = isLeft ? `calc(${place[0].toFixed(1)}px - 100% - 1.2em)` : `${x.toFixed(1)}px`;
      span.style.transform = `translate(${across}, ${y.toFixed(1)}px)`;
    }
  }
}
