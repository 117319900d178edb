// Letters in the picture, beside what they name. They stand upright while all else moves.
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
    this.all = all.map(({ words, colour, at, about = "" }) => {
      const span = Object.assign(document.createElement("span"), { textContent: words });
      Object.assign(span, { title: about, className: colour ? "arrow" : "" });
      span.style.color = colour;
      return { span, at, wide: 7 * words.length + 12 };
    });
    this.place.replaceChildren(...this.all.map(({ span }) => span));
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
