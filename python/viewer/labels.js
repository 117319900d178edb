// Labels over the picture, beside arrows, circles and tops.
import { html, render } from "lit-html";

const GAP = 17; // between two labels, in pixels
const isHigher = (a, b) => (a.place?.[1] ?? 0) - (b.place?.[1] ?? 0);

export class Labels {
  constructor(parent) {
    this.container = document.createElement("div");
    Object.assign(this.container, { className: "labels", ariaHidden: true });
    parent.append(this.container);
    this.all = [];
    this.corner = [0, 0];
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
      if (this.picture) this.placeLabels(...this.picture);
    };
    new ResizeObserver(keep).observe(element);
  }
  // Replace all labels. Each has its text, a colour or "", and `at`, which returns its position in
  // pixels or null. `times` scales their size.
  setLabels(all, times = 1) {
    const label = ({ words, colour, about = "" }) =>
      html`<span class=${colour && "arrow"} title=${about}
        style="color: ${colour}">${words}</span>`;
    render(all.map(label), this.container);
    const spans = this.container.children;
    const wide = ({ words }) => times * (7 * words.length + 12);
    this.all = all.map((each, i) => ({ span: spans[i], at: each.at, wide: wide(each) }));
    this.gap = times * GAP;
  }
  // Place all labels. A label that would overlap a higher one moves down; one under the footer is
  // hidden.
  placeLabels(size, covered) {
    this.picture = [size, covered];
    const [width, height] = size;
    const { gap, corner } = this;
    const taken = [];
    const placed = this.all.map((label) => ({ ...label, place: label.at() }));
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
