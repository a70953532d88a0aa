// Draws rows, axis and marks onto a canvas. Of calls and marks that are closer than some pixels, it draws the
// first.
import { fillBox, ink, line } from "cx/canvas.js";
import { clockText, durationText, pad } from "cx/dom.js";
import { countWhile } from "cx/names.js";
import { spansOf, stacked } from "cx/timeline/spans.js";
import { axisStep } from "cx/timeline/window.js";

export const AXIS = 24; // pixels: the height of the axis
export const MARKS = 18; // pixels: the height of the lane of errors below the axis
const FONT = "11px system-ui, sans-serif",
  LETTER_WIDTH = 6.1, // pixels: the mean width of a letter in this font
  LEAST_BAR_WIDTH = 4; // pixels: the width of the narrowest bar

/** Whether items with this outcome are drawn so that they stand out. */
const isLoud = (outcome) => outcome === "failed";
const lastError = (goal) => (goal.changes.findLast(({ error }) => error) || { error: "" }).error;

/**
 * The text at a value of the axis.
 * @param step the distance of marks, see axisStep()
 * @param unit 1 for an axis of steps, 1e6 for an axis of times in microseconds
 * @param zero the origin of times; null: times of day
 */
export function axisText(value, step, unit, zero) {
  if (unit === 1) return "#" + Math.round(value);
  if (zero === null) return clockText(value, step >= 1 ? 0 : step >= 0.001 ? 3 : 6);
  const seconds = (value - zero) / 1e6;
  if (step < 1 || Math.abs(seconds) < 60) return Number(seconds.toFixed(step >= 0.001 ? 3 : 6)) + " s";
  const wholeSeconds = Math.round(Math.abs(seconds)),
    [hours, minutes] = [Math.floor(wholeSeconds / 3600), Math.floor(wholeSeconds / 60) % 60],
    text = hours ? hours + ":" + pad(minutes) : minutes;
  return (seconds < 0 ? "-" : "") + text + ":" + pad(wholeSeconds % 60);
}

/** A text, cut to a width in pixels; "" if it must be cut to fewer than three letters. */
const cutTo = (text, room) => {
  const mostLetters = Math.floor(room / LETTER_WIDTH);
  if (text.length <= mostLetters) return text;
  return mostLetters < 3 ? "" : text.slice(0, mostLetters - 1) + "…";
};

/** Draws the parts of a scene. */
export class Painter {
  /**
   * @param context of a canvas
   * @param scene see Timeline.scene; and `palette`, see canvas.js
   */
  constructor(context, scene) {
    this.context = context;
    Object.assign(this, scene);
    Object.assign(context, { font: FONT, textAlign: "left", textBaseline: "middle", lineJoin: "round" });
  }
  write(text, colour, x, y) {
    this.context.fillStyle = colour;
    this.context.fillText(text, x, y);
  }

  /**
   * The left and right end of a span in pixels; null for an invisible span. An end beside the canvas is at
   * most 20 pixels away, far enough that the rounded corners of the bar are not seen.
   */
  edges({ from, to }) {
    const { timeWindow } = this,
      left = timeWindow.place(from),
      right = timeWindow.place(to || this.now);
    return right < -LEAST_BAR_WIDTH || left > timeWindow.width + LEAST_BAR_WIDTH
      ? null
      : [Math.max(left, -20), Math.min(right, timeWindow.width + 20)];
  }
  /** The visible spans of an item except tails: {span, edges, freeUntil}, see edges() and freeUntil(). */
  *spans(item) {
    const spans = spansOf(item, this.history).filter(({ part }) => part !== "tail");
    for (const [at, span] of spans.entries()) {
      const edges = this.edges(span);
      if (edges) yield { span, edges, freeUntil: this.freeUntil(spans[at + 1]?.from) };
    }
  }
  /**
   * The pixel at which the room behind a bar ends. @param point the begin of the next bar, if there is one
   */
  freeUntil(point) {
    return point ? this.timeWindow.place(point) : this.timeWindow.width;
  }

  row(row, y) {
    const { palette, rowHeight } = this;
    if (row.key === this.selected)
      fillBox(this.context, palette.focus, 0, y, this.timeWindow.width, rowHeight - 1, 0.1);
    if (row.kind === "robot") this.robot(row.item, y);
    else if (row.kind === "group") {
      // a closed group has the calls of all its robots in its row
      if (row.key === "robots" && !row.open) for (const lane of row.item) this.robot(lane.item, y);
    } else if (row.isSummary) this.summary(row.item, y);
    else this.goalOrAction(row.item, y);
  }

  /** Draw a goal as a line, see Row.isSummary. */
  summary(goal, y) {
    for (const { span, edges } of this.spans(goal)) {
      const [left, right] = edges,
        { fill, edge } = this.palette.outcomes[span.outcome],
        [colour, alpha] = isLoud(span.outcome) ? [fill, 1] : [edge, 0.55];
      if (span.part === "wait") this.wait(edges, y);
      else
        fillBox(this.context, colour, left, y + this.rowHeight / 2 - 2, Math.max(right - left, 2), 4, alpha);
    }
  }

  /** Draw a goal with its actions in its bar, or an action. */
  goalOrAction(item, y) {
    for (const { span, edges, freeUntil } of this.spans(item)) {
      const hasActions = item.kind === "goal" && item.actions.length;
      if (span.part === "wait" || hasActions) this.wait(edges, y);
      if (span.part === "wait") continue;
      if (hasActions) this.actions(item.actions, span, y, freeUntil);
      else this.bar(item, span.outcome, edges, y, this.textOf(item, span), freeUntil);
    }
  }
  /** Draw the actions within a span of their goal, parallel actions below each other. */
  actions(actions, goalSpan, y, goalFreeUntil) {
    const spans = stacked(actions, goalSpan, this.history);
    for (const [at, { item, span, lane, lanes }] of spans.entries()) {
      const edges = this.edges(span),
        next = spans.slice(at + 1).find((each) => each.lane === lane),
        freeUntil = next ? this.freeUntil(next.span.from) : goalFreeUntil,
        text = lanes > 1 ? "" : this.textOf(item, span);
      if (edges) this.bar(item, span.outcome, edges, y, text, freeUntil, lane, lanes);
    }
  }
  /**
   * The text in a bar: the duration of a goal, the skill string of an action; with the error of a failure.
   */
  textOf(item, span) {
    const end = span.to || this.now,
      duration = durationText(Math.max(0, end.time - span.from.time)),
      hasFailed = span.outcome === "failed";
    if (item.kind === "goal") return duration + "  " + (hasFailed ? lastError(item) : "");
    const call = item.calls?.findLast(({ begin }) => begin.step <= end.step),
      name = call ? call.text : item.text || item.name,
      { error } = call || item;
    return hasFailed && error ? name + ": " + error : name;
  }

  /** Draw the time of waiting as a thin line. */
  wait([left, right], y) {
    const colour = this.palette.outcomes.formulated.edge;
    fillBox(this.context, colour, left, y + this.rowHeight / 2 - 0.5, right - left, 1, 0.6);
  }

  /** Draw the calls of a robot. @param calls ordered by their begin */
  robot(calls, y) {
    let drawnX = -Infinity; // the right end of the last drawn bar
    for (let at = firstVisible(calls, this.timeWindow); at < calls.length; at++) {
      const call = calls[at];
      if (call.begin[this.timeWindow.axis] > this.timeWindow.to) break;
      const [span] = spansOf(call, this.history),
        edges = this.edges(span);
      if (!edges || edges[1] < drawnX + 0.5) continue;
      drawnX = Math.max(...edges);
      this.bar(call, span.outcome, edges, y, call.text || call.name, this.freeUntil(calls[at + 1]?.begin));
    }
  }

  /**
   * Draw a bar with its text; the text of a narrow failed bar stands behind the bar.
   * @param freeUntil the pixel up to which there is room behind the bar
   * @param lane, lanes the place of the bar among bars below each other
   */
  bar(item, outcome, [left, right], y, text, freeUntil, lane = 0, lanes = 1) {
    const { context, rowHeight, late, palette } = this,
      look = palette.outcomes[outcome],
      isLate = late.has(item) || item.calls?.some((call) => late.has(call)),
      height = (rowHeight - 8) / lanes,
      top = y + 4 + lane * height,
      width = Math.max(right - left - (right - left > 4 ? 1 : 0), LEAST_BAR_WIDTH),
      hasEdge = outcome !== "completed" && !isLoud(outcome) && width > 3;
    context.beginPath();
    context.roundRect(left, top, width, height - (lanes > 1 ? 1 : 0), Math.min(3, width / 4));
    ink(context, { fill: look.fill, stroke: hasEdge ? look.edge : null });
    if (isLate || item === this.chosen)
      ink(context, { stroke: isLate ? palette.outcomes.failed.fill : palette.focus, width: 2.5 });
    if (!text) return;
    const middle = top + height / 2 + 1,
      mark = isLate ? "late: " : isLoud(outcome) || outcome === "rejected" ? look.icon + " " : "",
      markedText = mark + text,
      visibleLeft = Math.max(left, 0),
      room = Math.min(left + width, this.timeWindow.width) - visibleLeft - 10,
      behind = freeUntil - left - width;
    if (room > 20) this.write(cutTo(markedText, room), look.ink, visibleLeft + 5, middle);
    if (room < markedText.length * LETTER_WIDTH && isLoud(outcome) && behind > 60)
      this.write(cutTo(markedText, behind - 12), palette.loud, left + width + 5, middle);
  }

  /** Draw the axis, and its lines through the rows. */
  axis(bottom) {
    const { context, timeWindow, palette } = this,
      { step, unit } = axisStep(timeWindow),
      zero = unit === 1 ? 0 : (this.zero ?? dayBegin(timeWindow.from)),
      gap = step * unit;
    for (
      let value = zero + Math.ceil((timeWindow.from - zero) / gap) * gap;
      value <= timeWindow.to;
      value += gap
    ) {
      const x = Math.round(timeWindow.x(value)),
        text = axisText(value, step, unit, this.zero),
        width = text.length * LETTER_WIDTH;
      fillBox(context, palette.line, x, AXIS - 6, 1, bottom - AXIS + 6, 0.5);
      this.write(text, palette.dim, Math.max(2, Math.min(x - width / 2, timeWindow.width - width - 2)), 10);
    }
  }

  /** Draw a triangle for each error, at most one in three pixels. */
  errors(marks) {
    const { context, timeWindow, palette } = this,
      { fill, ink: colour } = palette.outcomes.failed;
    let drawnX = -10; // the place of the last drawn mark
    for (let at = firstVisible(marks, timeWindow, (each) => each); at < marks.length; at++) {
      const x = timeWindow.place(marks[at]);
      if (x > timeWindow.width + 6) break;
      if (x < drawnX + 3) continue;
      drawnX = x;
      const corners = [0, 6, -6].map((dx) => [x + dx, AXIS + (dx ? 14 : 2)]);
      line(context, corners, { fill, stroke: palette.loud, width: 1.2 });
      fillBox(context, colour, x - 0.8, AXIS + 6, 1.6, 4);
      fillBox(context, colour, x - 0.8, AXIS + 11, 1.6, 1.6);
    }
  }

  /** Draw the chosen moment as a line with a triangle at the axis. */
  cursor(value, bottom) {
    const x = this.timeWindow.x(value),
      fill = this.palette.focus;
    if (x < -6 || x > this.timeWindow.width + 6) return;
    fillBox(this.context, fill, x - 0.75, 14, 1.5, bottom - 14);
    line(
      this.context,
      [-6, 6, 0].map((dx) => [x + dx, dx ? 12 : 22]),
      { fill },
    );
  }
}

/** The begin of the day of a time, in microseconds. */
const dayBegin = (time) => new Date(time / 1000).setHours(0, 0, 0, 0) * 1000;

/** The index of the last item that begins before the window, and so may reach into the window. */
const firstVisible = (list, timeWindow, pointOf = (each) => each.begin) =>
  Math.max(0, countWhile(list, (each) => pointOf(each)[timeWindow.axis] < timeWindow.from) - 1);
