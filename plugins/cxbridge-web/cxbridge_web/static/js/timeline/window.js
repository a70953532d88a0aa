// The visible part of the run: zoom, pan, fit, and following the newest moment. Values are microseconds or
// steps, depending on the axis.
const LEAST_SPAN = { time: 200, step: 4 }; // the smallest visible part: microseconds, steps
const MARGIN = 0.02, // beside the whole run, as a share of its length; twice as much after its end
  LONGEST_SPAN = 1e15; // 30 years in microseconds: repeated zooms must not overflow before set() limits them

export class TimeWindow {
  /** @param range() the range of the run: {from, to} in the unit of the axis */
  constructor(range) {
    this.range = range;
    this.axis = "time"; // or "step": each transition has the same width
    this.from = 0;
    this.to = 1;
    this.width = 600; // pixels
    this.follows = false; // the newest moment stays visible while the run grows
    this.fits = true; // the whole run is visible, and stays visible while it grows
    this.listeners = new Set();
  }

  get span() {
    return this.to - this.from;
  }
  /** The pixel of a value. */
  x(value) {
    return ((value - this.from) / this.span) * this.width;
  }
  /** The pixel of a moment {time, step}. */
  place(point) {
    return this.x(point[this.axis]);
  }
  /** The value of a pixel. */
  value(x) {
    return this.from + (x / this.width) * this.span;
  }

  /** The range of the whole run with margins; the newest moment has room to move. */
  whole() {
    const { from, to } = this.range(this.axis),
      span = Math.max(to - from, this.axis === "time" ? 1000 : 1); // 1 ms, 1 step: an empty run has a length
    return { from: from - span * MARGIN, to: from + span * (1 + MARGIN * 2) };
  }

  /** Show a range, within limits. @param options whether to keep `fits` and `follows` */
  set(from, to, { keepsFit = false, keepsFollowing = false } = {}) {
    const whole = this.whole(),
      longest = (whole.to - whole.from) * 1.5, // a third of the picture may be empty
      span = Math.min(Math.max(to - from, LEAST_SPAN[this.axis]), Math.max(longest, LEAST_SPAN[this.axis]));
    // a pan leaves at most half of the picture empty
    const begin = Math.min(Math.max(from, whole.from - span / 2), whole.to - span / 2);
    if (!keepsFit) this.fits = false;
    if (!keepsFollowing) this.follows = false;
    if (begin === this.from && begin + span === this.to) return;
    this.from = begin;
    this.to = begin + span;
    for (const listener of this.listeners) listener();
  }

  /** Scale the visible part by a factor around a pixel. */
  zoom(factor, x = this.width / 2) {
    const at = this.follows ? this.to : this.value(x), // the newest moment stays in its place
      span = Math.min(Math.max(this.span * factor, LEAST_SPAN[this.axis]), LONGEST_SPAN),
      share = (at - this.from) / this.span;
    this.set(at - span * share, at + span * (1 - share), { keepsFollowing: this.follows });
  }
  pan(pixels) {
    const by = (pixels / this.width) * this.span;
    this.set(this.from + by, this.to + by);
  }
  fit() {
    const { from, to } = this.whole();
    this.set(from, to, { keepsFit: true, keepsFollowing: true });
    this.fits = true;
  }
  /** Show a range with a margin. */
  show(from, to) {
    // 15 % at each side; 0.5 ms or 1 step beside a single moment
    const room = Math.max((to - from) * 0.15, this.axis === "time" ? 500 : 1);
    this.set(from - room, to + room);
  }
  /** Make a value visible. */
  reveal(value) {
    if (value >= this.from && value <= this.to) return;
    this.set(value - this.span / 2, value + this.span / 2);
  }

  /** Follow the newest moment from now on. */
  follow() {
    this.follows = true;
    this.advance();
  }
  /** Follow a run that has grown. */
  advance() {
    if (this.fits) this.fit();
    else if (this.follows) {
      const { to } = this.whole(),
        { span } = this;
      this.set(to - span, to, { keepsFollowing: true });
    }
  }

  /** Change the axis: "time" or "step". */
  useAxis(axis) {
    this.axis = axis;
    this.fit();
  }
}

/**
 * The distance of the axis's marks: {step, unit}; step is a round number of seconds (unit 1e6) or of steps
 * (1).
 */
export function axisStep(timeWindow) {
  const unit = timeWindow.axis === "time" ? 1e6 : 1,
    // marks have a distance of at least 105 pixels, or of half the width if it has less than 210 pixels
    leastStep = (timeWindow.span / unit) * Math.min(0.5, 105 / timeWindow.width),
    power = 10 ** Math.floor(Math.log10(leastStep));
  // minutes and hours; from 45 s on, the next step is a minute, which 50 s would nearly repeat
  const longStep = unit === 1e6 && leastStep > 45 ? clockStep(leastStep) : null;
  const step = // there is no part of a step, but of a second
    longStep || Math.max([1, 2, 5, 10].find((each) => each * power >= leastStep) * power, unit === 1 ? 1 : 0);
  return { step, unit };
}
// seconds: parts of an hour and of a day
const CLOCK_STEPS = [60, 120, 300, 600, 900, 1800, 3600, 7200, 10800, 21600, 43200, 86400];
const clockStep = (leastStep) =>
  CLOCK_STEPS.find((each) => each >= leastStep) || Math.ceil(leastStep / 86400) * 86400;
