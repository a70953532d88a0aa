// Draws rows, the axis and marks onto a canvas: only what is seen, and of what falls on one pixel only one.
import { clockText, durationText } from "cx/dom.js";
import { spansOf, stacked } from "cx/timeline/spans.js";
import { ticks } from "cx/timeline/window.js";

export const AXIS = 24; // pixels: the axis
export const MARKS = 18; // and the lane of errors below it
const FONT = "11px system-ui, sans-serif",
  LETTER = 6.1,
  LEAST = 4, // no bar is narrower
  LOUD = new Set(["failed"]);

const lastError = (goal) => (goal.changes.findLast(({ error }) => error) || { error: "" }).error;

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
   * @param scene what is drawn: {window, history, palette, now, zero, high, selected, chosen, late}
   */
  constructor(context, scene) {
    this.context = context;
    Object.assign(this, scene);
    context.font = FONT;
    context.textBaseline = "middle";
    context.lineJoin = "round";
  }

  /** Left and right of a span in pixels; null: it is out of sight. */
  edges({ from, to }) {
    const { window } = this,
      left = window.place(from),
      right = window.place(to || this.now);
    return right < -LEAST || left > window.width + LEAST
      ? null
      : [Math.max(left, -20), Math.min(right, window.width + 20)];
  }

  row(row, y) {
    const { context, high } = this;
    if (row.key === this.selected) {
      context.fillStyle = this.palette.focus;
      context.globalAlpha = 0.1;
      context.fillRect(0, y, this.window.width, high - 1);
      context.globalAlpha = 1;
    }
    if (row.kind === "robot") this.robot(row.item, y);
    else if (row.kind === "group") {
      if (row.key === "robots" && !row.open) for (const lane of row.item) this.robot(lane.item, y);
    } else if (row.isSummary) this.summary(row.item, y);
    else this.life(row.item, y);
  }

  /** A goal whose parts have rows of their own: a line. */
  summary(goal, y) {
    for (const span of spansOf(goal, this.history)) {
      const edges = this.edges(span);
      if (!edges || span.part === "tail") continue;
      if (span.part === "wait") {
        this.wait(edges, y);
        continue;
      }
      this.line(span.outcome, edges, y);
    }
  }
  line(outcome, [left, right], y) {
    const { context, high } = this,
      look = this.palette.outcomes[outcome],
      isLoud = LOUD.has(outcome);
    context.fillStyle = isLoud ? look.fill : look.edge;
    context.globalAlpha = isLoud ? 1 : 0.55;
    context.fillRect(left, y + high / 2 - 2, Math.max(right - left, 2), 4);
    context.globalAlpha = 1;
  }

  /** A goal with its actions within its bar, or an action. */
  life(item, y) {
    const spans = spansOf(item, this.history).filter(({ part }) => part !== "tail");
    for (const [at, span] of spans.entries()) {
      const edges = this.edges(span);
      if (!edges) continue;
      if (span.part === "wait") {
        this.wait(edges, y);
        continue;
      }
      const next = spans[at + 1],
        until = next ? this.window.place(next.from) : this.window.width;
      if (item.kind === "goal" && item.actions.length) {
        this.wait(edges, y);
        this.actions(item.actions, span, y, until);
      } else this.bar(item, span.outcome, edges, y, this.textOf(item, span), until);
    }
  }
  /** The actions that ran within a span of their goal; those at the same time below each other. */
  actions(actions, whole, y, until) {
    const spans = stacked(actions, whole, this.history);
    for (const [at, { item, span, lane, lanes }] of spans.entries()) {
      const edges = this.edges(span);
      if (!edges) continue;
      const next = spans.slice(at + 1).find((each) => each.lane === lane),
        free = next ? this.window.place(next.span.from) : until;
      const text = lanes > 1 ? "" : this.textOf(item, span);
      this.bar(item, span.outcome, edges, y, text, free, lane, lanes);
    }
  }
  textOf(item, span) {
    const took = durationText(Math.max(0, (span.to || this.now).time - span.from.time));
    if (item.kind === "goal") return [took, span.outcome === "failed" ? lastError(item) : ""].join("  ");
    const call = item.calls?.findLast(({ begin }) => begin.step <= (span.to || this.now).step),
      name = call ? call.text : item.text || item.name,
      error = span.outcome === "failed" ? (call || item).error : "";
    return error ? name + ": " + error : name;
  }

  wait([left, right], y) {
    const { context, high } = this;
    context.fillStyle = this.palette.outcomes.formulated.edge;
    context.globalAlpha = 0.6;
    context.fillRect(left, y + high / 2 - 0.5, right - left, 1);
    context.globalAlpha = 1;
  }

  /** The calls of a robot, in the order of their beginnings. */
  robot(calls, y) {
    let drawn = -Infinity;
    for (let at = firstSeen(calls, this.window); at < calls.length; at++) {
      const call = calls[at];
      if (call.begin[this.window.axis] > this.window.to) break;
      const [span] = spansOf(call, this.history),
        edges = this.edges(span);
      if (!edges || edges[1] < drawn + 0.5) continue;
      drawn = Math.max(edges[0], edges[1]);
      const next = calls[at + 1],
        until = next ? this.window.place(next.begin) : this.window.width;
      this.bar(call, span.outcome, edges, y, call.text || call.name, until);
    }
  }

  /** A bar with its text in it, or, of a narrow one that matters, behind it. */
  bar(item, outcome, [left, right], y, text, freeUntil, lane = 0, lanes = 1) {
    const { context, high, late } = this,
      look = this.palette.outcomes[outcome],
      isLoud = LOUD.has(outcome),
      isLate = late.has(item) || item.calls?.some((call) => late.has(call)),
      height = (high - 8) / lanes,
      top = y + 4 + lane * height,
      width = Math.max(right - left - (right - left > 4 ? 1 : 0), LEAST);
    context.beginPath();
    context.roundRect(left, top, width, height - (lanes > 1 ? 1 : 0), Math.min(3, width / 4));
    context.fillStyle = look.fill;
    context.fill();
    if (outcome !== "completed" && outcome !== "failed" && width > 3) {
      context.strokeStyle = look.edge;
      context.lineWidth = 1;
      context.stroke();
    }
    if (isLate || item === this.chosen) {
      context.strokeStyle = isLate ? this.palette.outcomes.failed.fill : this.palette.focus;
      context.lineWidth = 2.5;
      context.stroke();
    }
    if (!text) return;
    const middle = top + height / 2 + 1,
      words = (isLate ? "late: " : isLoud || outcome === "rejected" ? look.icon + " " : "") + text,
      seen = Math.max(left, 0),
      room = Math.min(left + width, this.window.width) - seen - 10;
    if (room > 20) {
      context.fillStyle = look.ink;
      context.fillText(cutTo(words, room), seen + 5, middle);
    }
    if (room < words.length * LETTER && isLoud && freeUntil - left - width > 60) {
      context.fillStyle = this.palette.loud;
      context.fillText(cutTo(words, freeUntil - left - width - 12), left + width + 5, middle);
    }
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
    context.strokeStyle = palette.loud;
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
