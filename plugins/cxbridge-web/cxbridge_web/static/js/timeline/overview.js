// The whole run in a strip: how many goals ran when, where something failed, and the stretch that is seen, which
// can be dragged, and resized at its ends.
import { spansOf } from "cx/timeline/spans.js";

const HIGH = 34,
  END = 8; // pixels in which an end can be taken

export class Overview {
  /** @param component the timeline: {window, rows, history, now, palette, marks} */
  constructor(canvas, component) {
    this.canvas = canvas;
    this.component = component;
    this.picture = document.createElement("canvas");
    this.sign = "";
    this.drag = null;
    canvas.addEventListener("pointerdown", (event) => this.press(event));
    canvas.addEventListener("pointermove", (event) => this.move(event));
    for (const end of ["pointerup", "pointercancel"])
      canvas.addEventListener(end, () => {
        this.drag = null;
      });
    canvas.addEventListener("dblclick", () => component.window.fit());
    canvas.addEventListener(
      "wheel",
      (event) => {
        event.preventDefault();
        const { window } = component;
        window.zoom(Math.exp(event.deltaY / 400), window.x(this.valueAt(event)));
      },
      { passive: false },
    );
  }

  get whole() {
    return this.component.window.whole();
  }
  valueAt(event) {
    const { from, to } = this.whole,
      box = this.canvas.getBoundingClientRect();
    return from + ((event.clientX - box.left) / box.width) * (to - from);
  }
  xOf(value) {
    const { from, to } = this.whole;
    return ((value - from) / (to - from)) * this.width;
  }

  press(event) {
    const { window } = this.component,
      value = this.valueAt(event),
      slack = (END / this.width) * (this.whole.to - this.whole.from);
    this.canvas.setPointerCapture(event.pointerId);
    const isLeft = Math.abs(value - window.from) < slack,
      isRight = Math.abs(value - window.to) < slack;
    if (value < window.from - slack || value > window.to + slack)
      window.set(value - window.span / 2, value + window.span / 2);
    this.drag = { isLeft: isLeft && !isRight, isRight, value, from: window.from, to: window.to };
  }
  move(event) {
    const { window } = this.component,
      value = this.valueAt(event);
    if (!this.drag) {
      const slack = (END / this.width) * (this.whole.to - this.whole.from),
        isEnd = Math.min(Math.abs(value - window.from), Math.abs(value - window.to)) < slack;
      this.canvas.style.cursor = isEnd ? "ew-resize" : "grab";
      return;
    }
    const { isLeft, isRight, from, to } = this.drag,
      by = value - this.drag.value;
    if (isLeft) window.set(Math.min(from + by, to), to);
    else if (isRight) window.set(from, Math.max(to + by, from));
    else window.set(from + by, to + by);
  }

  /** How many goals, actions and skills ran in each pixel's time, and in which something failed. */
  count() {
    const { history, now, window, rows } = this.component,
      size = Math.ceil(this.width) + 1,
      starts = new Int32Array(size + 1),
      failed = new Uint8Array(size);
    const place = (point) => Math.min(size - 1, Math.max(0, Math.floor(this.xOf(point[window.axis]))));
    for (const goal of rows.goals) {
      if (rows.outcomes.size && !rows.fits(goal)) continue;
      for (const { part, from, to, outcome } of spansOf(goal, history)) {
        if (part !== "run") continue;
        starts[place(from)] += 1;
        starts[place(to || now) + 1] -= 1;
        if (outcome === "failed" && to) failed[place(to)] = 1;
      }
    }
    for (const call of history.calls) if (call.error) failed[place(call.end || now)] = 1;
    return { starts, failed };
  }

  draw() {
    const { window, palette, history, now, rows, cursorValue } = this.component,
      { canvas } = this,
      ratio = Math.min(devicePixelRatio || 1, 3);
    this.width = canvas.clientWidth || 100;
    const whole = this.whole,
      sign = [
        this.width,
        history.revision,
        now.time,
        whole.from,
        whole.to,
        window.axis,
        ratio,
        [...rows.outcomes],
      ].join();
    if (canvas.width !== Math.round(this.width * ratio)) {
      canvas.width = this.picture.width = Math.round(this.width * ratio);
      canvas.height = this.picture.height = HIGH * ratio;
    }
    if (sign !== this.sign || palette !== this.palette) {
      this.sign = sign;
      this.palette = palette;
      this.drawPicture(palette, ratio);
    }
    const context = canvas.getContext("2d");
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.clearRect(0, 0, canvas.width, canvas.height);
    context.drawImage(this.picture, 0, 0);
    context.scale(ratio, ratio);
    this.brush(context, window, palette, cursorValue);
  }
  /** What does not change when the window moves. */
  drawPicture(palette, ratio) {
    const context = this.picture.getContext("2d"),
      { starts, failed } = this.count();
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, this.width, HIGH);
    let running = 0,
      most = 1;
    const heights = Array.from(failed, (_, x) => {
      running += starts[x];
      most = Math.max(most, running);
      return running;
    });
    context.fillStyle = palette.dim;
    context.globalAlpha = 0.25;
    for (const [x, count] of heights.entries())
      if (count)
        context.fillRect(x, HIGH - 3 - (count / most) * (HIGH - 10), 1, (count / most) * (HIGH - 10));
    context.globalAlpha = 1;
    context.fillStyle = palette.outcomes.failed.fill;
    for (const [x, is] of failed.entries()) if (is) context.fillRect(x - 1, 1, 3, 6);
  }
  brush(context, window, palette, cursorValue) {
    const left = Math.max(0, this.xOf(window.from)),
      right = Math.min(this.width, this.xOf(window.to));
    context.fillStyle = palette.panel;
    context.globalAlpha = 0.72;
    context.fillRect(0, 0, left, HIGH);
    context.fillRect(right, 0, this.width - right, HIGH);
    context.globalAlpha = 1;
    context.strokeStyle = palette.focus;
    context.lineWidth = 1.5;
    context.strokeRect(left + 0.75, 0.75, Math.max(2, right - left - 1.5), HIGH - 1.5);
    context.fillStyle = palette.focus;
    for (const x of [left, right - 3]) context.fillRect(x, HIGH / 2 - 7, 3, 14);
    if (cursorValue !== null) context.fillRect(this.xOf(cursorValue) - 0.5, 0, 1.5, HIGH);
  }
}
