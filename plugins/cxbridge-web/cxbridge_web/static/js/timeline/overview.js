// The whole run in a strip: the number of running goals over time, failures, and a frame around the visible
// part, which users drag and resize.
import { Canvas, fillBox, gestures, ink } from "cx/canvas.js";
import { el } from "cx/dom.js";
import { spansOf } from "cx/timeline/spans.js";

const HEIGHT = 34, // pixels: the height of the strip, as in css/timeline.css
  GRAB_DISTANCE = 8; // pixels around an end of the frame at which it can be grabbed

export class Overview {
  constructor(timeline) {
    this.timeline = timeline;
    this.canvas = new Canvas((...args) => this.paint(...args), { class: "tl-overview" });
    this.picture = el.canvas(); // the strip without the frame, which changes more often
    this.sign = ""; // identifies the content of the picture
    const { node } = this.canvas,
      { timeWindow } = timeline;
    gestures(node, {
      pan: (dx) => timeWindow.pan(-dx),
      zoom: (factor, x) => timeWindow.zoom(1 / factor, timeWindow.x(this.valueAt(x))),
      point: (x) => {
        node.style.cursor =
          this.isNear(x, timeWindow.from) || this.isNear(x, timeWindow.to) ? "ew-resize" : "grab";
      },
      leave() {},
      press() {},
      grab: (x) => this.grab(x),
    });
    node.addEventListener("dblclick", () => timeWindow.fit());
  }

  /** The range of the whole run. */
  get whole() {
    return this.timeline.timeWindow.whole();
  }
  valueAt(x) {
    const { from, to } = this.whole;
    return from + (x / this.canvas.width) * (to - from);
  }
  xOf(value) {
    const { from, to } = this.whole;
    return ((value - from) / (to - from)) * this.canvas.width;
  }
  isNear(x, value) {
    return Math.abs(x - this.xOf(value)) < GRAB_DISTANCE;
  }

  /**
   * Begin a drag of the frame or of its end; a press beside the frame moves it to the pointer.
   * @returns the function that gets the pixels to which the pointer is dragged
   */
  grab(x) {
    const { timeWindow } = this.timeline,
      begin = this.valueAt(x),
      isLeft = this.isNear(x, timeWindow.from),
      isRight = this.isNear(x, timeWindow.to);
    if (!isLeft && !isRight && (begin < timeWindow.from || begin > timeWindow.to))
      timeWindow.set(begin - timeWindow.span / 2, begin + timeWindow.span / 2);
    const { from, to } = timeWindow;
    return (draggedX) => {
      const by = this.valueAt(draggedX) - begin;
      if (isLeft && !isRight) timeWindow.set(Math.min(from + by, to), to);
      else if (isRight) timeWindow.set(from, Math.max(to + by, from));
      else timeWindow.set(from + by, to + by);
    };
  }

  /** For each pixel, the number of running goals, and 1 for a failure: {running, failed}. */
  countGoals(width) {
    const { history, now, timeWindow, rows } = this.timeline,
      size = Math.ceil(width) + 1,
      changes = new Int32Array(size + 1), // of the number of running goals, at each pixel
      failed = new Uint8Array(size);
    const place = (point) => Math.min(size - 1, Math.max(0, Math.floor(this.xOf(point[timeWindow.axis]))));
    for (const goal of rows.goals) {
      if (rows.outcomes.size && !rows.fits(goal)) continue;
      for (const { part, from, to, outcome } of spansOf(goal, history)) {
        if (part !== "run") continue;
        changes[place(from)] += 1;
        changes[place(to || now) + 1] -= 1;
        if (outcome === "failed" && to) failed[place(to)] = 1;
      }
    }
    for (const call of history.calls) if (call.error) failed[place(call.end || now)] = 1;
    let running = 0; // the sum of the changes up to a pixel
    return { failed, running: Array.from(failed, (_, x) => (running += changes[x])) };
  }

  draw() {
    this.canvas.draw();
  }
  paint(context, width, height, colours) {
    const { timeWindow, history, now, rows, cursorValue } = this.timeline,
      { node } = this.canvas,
      { from, to } = this.whole,
      state = [
        node.width,
        history.revision,
        now.time,
        from,
        to,
        timeWindow.axis,
        colours.back,
        ...rows.outcomes,
      ];
    if (state.join() !== this.sign) {
      this.sign = state.join();
      Object.assign(this.picture, { width: node.width, height: node.height });
      this.paintPicture(this.picture.getContext("2d"), width, node.width / width, colours);
    }
    context.clearRect(0, 0, width, height);
    context.drawImage(this.picture, 0, 0, width, height);
    this.paintFrame(context, width, colours, cursorValue);
  }
  paintPicture(context, width, ratio, { dim, outcomes }) {
    const { running, failed } = this.countGoals(width),
      scale = (HEIGHT - 10) / Math.max(1, ...running);
    context.scale(ratio, ratio);
    for (const [x, count] of running.entries())
      if (count) fillBox(context, dim, x, HEIGHT - 3 - count * scale, 1, count * scale, 0.25);
    for (const [x, hasFailure] of failed.entries())
      if (hasFailure) fillBox(context, outcomes.failed.fill, x - 1, 1, 3, 6);
  }
  paintFrame(context, width, { panel, focus }, cursorValue) {
    const { timeWindow } = this.timeline,
      left = Math.max(0, this.xOf(timeWindow.from)),
      right = Math.min(width, this.xOf(timeWindow.to));
    fillBox(context, panel, 0, 0, left, HEIGHT, 0.72);
    fillBox(context, panel, right, 0, width - right, HEIGHT, 0.72);
    context.beginPath();
    context.rect(left + 0.75, 0.75, Math.max(2, right - left - 1.5), HEIGHT - 1.5);
    ink(context, { stroke: focus, width: 1.5 });
    for (const x of [left, right - 3]) fillBox(context, focus, x, HEIGHT / 2 - 7, 3, 14);
    if (cursorValue !== null) fillBox(context, focus, this.xOf(cursorValue) - 0.5, 0, 1.5, HEIGHT);
  }
  gone() {
    this.canvas.gone();
  }
}
