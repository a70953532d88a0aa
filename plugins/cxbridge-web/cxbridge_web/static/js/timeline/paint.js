// Draws rows, the axis and marks onto a canvas: only what is seen, and of what falls on one pixel only one.
import { clockText, durationText } from "cx/dom.js";
import { spansOf } from "cx/timeline/spans.js";
import { ticks } from "cx/timeline/window.js";

export const AXIS = 24; // pixels: the axis
export const MARKS = 18; // and the lane of errors below it
const FONT = "11px system-ui, sans-serif",
  LETTER = 6.1,
  LEAST = 4; // no bar is narrower

/** What stands at a value of the axis. `zero`: where a recording begins; null: the time of day. */
export function axisText(value, step, unit, zero) {
  if (unit === 1) return "#" + Math.round(value);
  if (zero === null) return clockText(value, step >= 1 ? 0 : step >= 0.001 ? 3 : 6);
  const seconds = (value - zero) / 1e6;
  if (step >= 1 && Math.abs(seconds) >= 60) {
    const whole = Math.round(Math.abs(seconds)),
      pad = (number) => String(number).padStart(2, "0"),
      sign = seconds < 0 ? "-" : "",
      rest = pad(Math.floor(whole / 60) % 60) + ":" + pad(whole % 60);
    return sign + (whole >= 3600 ? Math.floor(whole / 3600) + ":" + rest : rest.replace(/^0/, "")) + "";
  }
  return Number(seconds.toFixed(step >= 0.001 ? 3 : 6)) + " s";
}

const cutTo = (text, room) => {
  const most = Math.floor(room / LETTER);
  return text.length <= most ? text : most < 3 ? "" : text.slice(0, most - 1) + "…";
};

export class Painter {
  /**
   * @param context of a canvas
   * @param scene what is drawn: {window, history, palette, now, zero, high, selected}
   */
  constructor(context, scene) {
    this.context = context;
    Object.assign(this, scene);
    context.font = FONT;
    context.textBaseline = "middle";
    context.lineJoin = "round";
  }

  /** Left and right of a span in pixels; null: not seen. */
  edges({ from, to }) {
    const { window } = this,
      left = window.place(from),
      right = window.place(to || this.now);
    return right < -LEAST || left > window.width + LEAST
      ? null
      : [Math.max(left, -20), Math.min(right, window.width + 20)];
  }

  fill(look, left, top, width, height, round = 3) {
    const { context } = this;
    context.fillStyle = look.fill;
    context.strokeStyle = look.edge;
    context.lineWidth = 1;
    context.beginPath();
    if (width > 8)
      context.roundRect(left + 0.5, top + 0.5, width - 1, height - 1, Math.min(round, width / 4));
    else context.rect(left, top, width, height);
    context.fill();
    if (look.pattern && width > 5) {
      context.fillStyle = look.pattern;
      context.fill();
    }
    if (width > 3) context.stroke();
  }

  /** A bar with its icon, and a text within it or, where it is too narrow, behind it. */
  bar(span, top, height, text, freeUntil) {
    const edges = this.edges(span);
    if (!edges) return;
    const { context } = this,
      look = this.palette.outcomes[span.outcome],
      left = edges[0],
      width = Math.max(edges[1] - left, LEAST);
    if (span.part === "tail") {
      context.fillStyle = look.edge;
      context.globalAlpha = 0.55;
      context.fillRect(left, top + height / 2 - 1, width, 2);
      context.globalAlpha = 1;
      return;
    }
    const isThin = span.part === "wait" && span.outcome === "formulated";
    this.fill(look, left, isThin ? top + height * 0.28 : top, width, isThin ? height * 0.44 : height);
    if (isThin) return;
    const middle = top + height / 2 + 1,
      seen = Math.max(left, 0),
      room = Math.min(left + width, this.window.width) - seen;
    if (room > 15) this.label(look, look.icon + " " + text, seen + 4, middle, room - 8);
    else if (width <= 15 && freeUntil - left - width > 30) {
      context.fillStyle = look.edge;
      context.fillText(look.icon, left + width + 3, middle);
      context.fillStyle = this.palette.dim;
      context.fillText(cutTo(text, freeUntil - left - width - 20), left + width + 15, middle);
    }
  }
  label(look, text, x, y, room) {
    const shown = room < 20 ? text[0] : cutTo(text, room),
      { context } = this;
    if (!shown) return;
    if (look.pattern) {
      // a halo, so that the texture does not cross the letters
      context.strokeStyle = look.fill;
      context.lineWidth = 3;
      context.strokeText(shown, x, y);
    }
    context.fillStyle = look.ink;
    context.fillText(shown, x, y);
  }

  row(row, y) {
    const { context, high } = this,
      hasStrip = row.kind === "goal" || row.kind === "action",
      top = y + 4,
      height = hasStrip ? high - 14 : high - 9;
    context.fillStyle = this.palette.line;
    context.globalAlpha = 0.45;
    context.fillRect(0, y + high - 1, this.window.width, 1);
    context.globalAlpha = 1;
    if (row.key === this.selected) {
      context.fillStyle = this.palette.focus;
      context.globalAlpha = 0.1;
      context.fillRect(0, y, this.window.width, high - 1);
      context.globalAlpha = 1;
    }
    if (row.kind === "robot") this.calls(row.item, top, height, true);
    else if (row.kind === "marks") this.points(row.item, top, height);
    else if (row.kind === "curve") this.curve(row.item, top, height);
    else if (row.kind !== "group") this.life(row, top, height);
    else if (row.open === false && row.key === "robots")
      for (const lane of row.item) this.calls(lane.item, top, height, false);
  }

  /** A goal or an action: its bars, and below them the skill calls, of a goal its actions. */
  life(row, top, height) {
    const { item } = row,
      spans = spansOf(item, this.history),
      strip = top + height + 1;
    for (let at = 0; at < spans.length; at++) {
      const next = spans.slice(at + 1).find(({ part }) => part !== "tail"),
        until = next ? this.window.place(next.from) : this.window.width;
      this.bar(spans[at], top, height, this.textOf(item, spans[at]), until);
    }
    if (item.kind === "action") this.calls(item.calls, strip, 5, false);
    else
      for (const action of item.actions)
        for (const span of spansOf(action, this.history)) if (span.part === "run") this.thin(span, strip);
  }
  textOf(item, span) {
    const to = (span.to || this.now).time,
      took = durationText(Math.max(0, to - span.from.time));
    if (item.kind === "action") {
      const [call] = item.calls;
      return (call ? call.text : item.text || item.name) + "  " + took;
    }
    const error = span.outcome === "failed" && item.changes.findLast((each) => each.error);
    return error ? took + "  " + error.error : took;
  }
  thin(span, top) {
    const edges = this.edges(span);
    if (edges) {
      const look = this.palette.outcomes[span.outcome];
      this.context.fillStyle = span.outcome === "failed" ? look.edge : look.fill;
      this.context.fillRect(edges[0], top, Math.max(edges[1] - edges[0] - 0.5, 2), 5);
      this.context.fillStyle = look.edge;
      this.context.fillRect(edges[0], top + 4, Math.max(edges[1] - edges[0] - 0.5, 2), 1);
    }
  }

  /** Calls of a lane, in the order of their beginnings. */
  calls(calls, top, height, isWide) {
    let drawn = -Infinity;
    for (let at = firstSeen(calls, this.window); at < calls.length; at++) {
      const call = calls[at];
      if (call.begin[this.window.axis] > this.window.to) break;
      const [span] = spansOf(call, this.history),
        edges = this.edges(span);
      if (!edges || edges[1] < drawn + 0.5) continue;
      drawn = Math.max(edges[0], edges[1]);
      const next = calls[at + 1];
      if (isWide)
        this.bar(
          span,
          top,
          height,
          call.text || call.name,
          next ? this.window.place(next.begin) : this.window.width,
        );
      else this.thin(span, top);
    }
  }
  points({ points, outcome }, top, height) {
    const { context, window } = this;
    context.fillStyle = outcome ? this.palette.outcomes[outcome].edge : this.palette.dim;
    let drawn = -1;
    for (let at = firstSeen(points, window, (each) => each); at < points.length; at++) {
      const x = Math.round(window.place(points[at]));
      if (x > window.width) break;
      if (x === drawn) continue;
      drawn = x;
      context.fillRect(x - 1, top + 2, 2, height - 4);
    }
  }
  curve({ points }, top, height) {
    const { context, window } = this,
      values = points.map(({ value }) => value),
      least = Math.min(...values),
      most = Math.max(...values, least + 1);
    context.beginPath();
    let y = top + height;
    context.moveTo(-5, y);
    for (const point of points) {
      const x = Math.min(Math.max(window.place(point), -5), window.width + 5);
      context.lineTo(x, y);
      y = top + height - ((point.value - least) / (most - least)) * height;
      context.lineTo(x, y);
    }
    context.lineTo(Math.min(window.place(this.now), window.width + 5), y);
    context.strokeStyle = this.palette.focus;
    context.lineWidth = 1.3;
    context.stroke();
  }

  /** The axis, with lines through the rows below it. */
  axis(bottom) {
    const { context, window, palette } = this,
      { step, unit } = ticks(window),
      zero = unit === 1 ? 0 : (this.zero ?? dayBegin(window.from)),
      gap = step * unit;
    context.fillStyle = palette.dim;
    for (let value = zero + Math.ceil((window.from - zero) / gap) * gap; value <= window.to; value += gap) {
      const x = Math.round(window.x(value));
      context.globalAlpha = 0.5;
      context.fillStyle = palette.line;
      context.fillRect(x, AXIS - 6, 1, bottom - AXIS + 6);
      context.globalAlpha = 1;
      context.fillStyle = palette.dim;
      const text = axisText(value, step, unit, this.zero),
        width = text.length * LETTER;
      context.fillText(text, Math.max(2, Math.min(x - width / 2, window.width - width - 2)), 10);
    }
  }

  /** Errors: a triangle each, as many as there are pixels. */
  errors(marks) {
    const { context, window, palette } = this;
    let drawn = -10;
    context.fillStyle = palette.outcomes.failed.fill;
    context.strokeStyle = palette.error;
    context.lineWidth = 1.2;
    for (let at = firstSeen(marks, window, (each) => each); at < marks.length; at++) {
      const x = window.place(marks[at]);
      if (x > window.width + 6) break;
      if (x < drawn + 3) continue;
      drawn = x;
      context.beginPath();
      context.moveTo(x, AXIS + 2);
      context.lineTo(x + 6, AXIS + 14);
      context.lineTo(x - 6, AXIS + 14);
      context.closePath();
      context.fill();
      context.stroke();
      context.fillStyle = palette.outcomes.failed.ink;
      context.fillRect(x - 0.8, AXIS + 6, 1.6, 4);
      context.fillRect(x - 0.8, AXIS + 11, 1.6, 1.6);
      context.fillStyle = palette.outcomes.failed.fill;
    }
  }

  cursor(value, bottom) {
    const x = this.window.x(value);
    if (x < -6 || x > this.window.width + 6) return;
    const { context } = this;
    context.fillStyle = this.palette.focus;
    context.fillRect(x - 0.75, 14, 1.5, bottom - 14);
    context.beginPath();
    context.moveTo(x - 6, 12);
    context.lineTo(x + 6, 12);
    context.lineTo(x, 22);
    context.closePath();
    context.fill();
  }
}

const dayBegin = (time) => new Date(time / 1000).setHours(0, 0, 0, 0) * 1000;

/** The first that may be seen: the one before the first that begins within the window. */
function firstSeen(list, window, pointOf = (each) => each.begin) {
  let low = 0,
    high = list.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (pointOf(list[middle])[window.axis] < window.from) low = middle + 1;
    else high = middle;
  }
  return Math.max(0, low - 1);
}
