// The curves of the motion before a change, drawn pale below those of now. Both begin at t = 0.
const SPAN = 12; // time for which a chart shows them at least, in seconds at the scene's speed
const [PALENESS, WIDTH] = [0.4, 1.5]; // opacity; pixels

export class EarlierCurves {
  // The curves of a measure; `transform(x, first)` returns the drawn value for a recorded one.
  constructor(page, { name }, transform) {
    Object.assign(this, { page, name, transform, motion: null, times: [], curves: [] });
  }
  // Read the curves of the previous motion. Return whether there are any.
  update() {
    const { previousMotion } = this.page;
    if (this.motion === previousMotion) return this.curves.length > 0;
    const { times = [], tops = [], records } = previousMotion ?? {};
    this.motion = previousMotion;
    this.times = times.flatMap((t) => [t, t]); // the least and the greatest value
    this.curves = (records?.[this.name] ?? []).map(([low, at, high], i) => ({
      colour: tops[i].colour,
      isCompared: tops[i].comparedWith >= 0,
      values: low.flatMap((x, row) => [x, high[row]]).map((x) => this.transform(x, at[0])),
    }));
    return this.curves.length > 0;
  }
  // Return the shown curves.
  list() {
    const { shown } = this.page.scene;
    if (!this.update()) return [];
    return this.curves.filter(
      ({ isCompared }, i) => shown[i] && (this.name !== "error" || isCompared),
    );
  }
  // Return the time to which a chart that ends at `last` extends for the curves.
  extend(last) {
    if (!this.list().length) return last;
    return Math.max(last, Math.min(this.times.at(-1), SPAN * this.page.scene.speed));
  }
  // Return the least and the greatest value in a chart of the motion to `last`.
  listExtremes(last) {
    const end = this.extend(last);
    const isSeen = (x, row) => x !== null && this.times[row] <= end;
    const values = this.list().flatMap((curve) => curve.values.filter(isSeen));
    const find = (choose) => values.reduce((x, y) => choose(x, y), values[0]);
    return values.length ? [find(Math.min), find(Math.max)] : [];
  }
  draw(plot) {
    const { ctx, bbox } = plot;
    const { left, top, width, height } = bbox;
    ctx.save();
    ctx.beginPath();
    ctx.rect(left, top, width, height);
    ctx.clip();
    Object.assign(ctx, { globalAlpha: PALENESS, lineWidth: WIDTH * devicePixelRatio });
    for (const { colour, values } of this.list()) {
      ctx.strokeStyle = colour;
      ctx.beginPath();
      values.forEach((x, row) => {
        if (x === null) return;
        ctx.lineTo(plot.valToPos(this.times[row], "x", true), plot.valToPos(x, "y", true));
      });
      ctx.stroke();
    }
    ctx.restore();
  }
}
