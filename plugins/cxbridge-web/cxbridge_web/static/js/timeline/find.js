// The bar or mark of the timeline below the pointer, and the box that describes it.
import { durationText, el, refill } from "cx/dom.js";
import { OUTCOMES } from "cx/outcome.js";
import { AXIS, MARKS, axisText } from "cx/timeline/paint.js";
import { spansOf } from "cx/timeline/spans.js";

const NEAR = 6; // pixels: the greatest distance of the pointer from a mark; from a bar, a third of it

/** Whether a value of the axis lies in a span, or at most `slack` away. */
const isWithin = (span, value, { axis }, now, slack) =>
  span.from[axis] - slack <= value && (span.to || now)[axis] + slack >= value;

/**
 * The item at a place of the canvas.
 * @param scene see Timeline.scene
 * @param x, y pixels within the canvas
 * @returns {{mark} | {row, item, span} | {row} | null}
 */
export function findAt({ timeWindow, history, now, rowHeight, rows, marks, scroll }, x, y) {
  if (y < AXIS) return null;
  const value = timeWindow.value(x),
    slack = (NEAR / timeWindow.width) * timeWindow.span;
  if (y < AXIS + MARKS) {
    const distance = (mark) => Math.abs(mark[timeWindow.axis] - value),
      [mark] = marks
        .filter((candidate) => distance(candidate) <= slack)
        .sort((a, b) => distance(a) - distance(b));
    return mark ? { mark } : null;
  }
  const row = rows[Math.floor((y - AXIS - MARKS + scroll) / rowHeight)];
  // tails are not drawn
  const isAt = (span) => span.part !== "tail" && isWithin(span, value, timeWindow, now, slack / 3);
  const findAmong = (items) => {
    for (const item of items) {
      const span = spansOf(item, history).findLast(isAt);
      if (span) return { row, item, span };
    }
    return null;
  };
  if (!row || row.kind === "group") return row ? { row } : null;
  if (row.kind === "robot") return findAmong(row.item) || { row }; // its calls
  // the bar of a goal contains the runs of its actions, but not their waits
  const actionHit = row.kind === "goal" && !row.isSummary && findAmong(row.item.actions);
  return (actionHit && actionHit.span.part === "run" ? actionHit : findAmong([row.item])) || { row };
}

function nameOf({ kind, id, cls, name, skiller, text }) {
  if (kind === "goal") return "Goal " + id + (cls && cls !== id ? " (" + cls + ")" : "");
  return kind === "action" ? "Action " + id + " " + name : (skiller || "planner") + ": " + (text || name);
}

/** The lines of the tip for a result of findAt(), first the name; null for a row without a bar. */
export function tipOf({ mark, item, span }, { now, zero }) {
  const textOf = (point) => axisText(point.time, 0.001, 1e6, zero); // to the millisecond
  if (mark) return [(mark.component ? mark.component + ": " : "") + mark.text, textOf(mark)];
  if (!span) return null;
  const { from, to, outcome, part } = span,
    { icon, word } = OUTCOMES[outcome],
    duration = (part === "wait" ? "waited " : "") + durationText(Math.max(0, (to || now).time - from.time));
  return [
    nameOf(item),
    icon + " " + word + ", " + duration + (to ? "" : " so far"),
    "from " + textOf(from) + (to ? " to " + textOf(to) : ""),
    item.error || (item.kind === "goal" && item.changes.at(-1).error),
  ].filter(Boolean);
}

/** The box that describes the item below the pointer. */
export class Tip {
  /** @param canvas the canvas of the items, in the same element as the tip */
  constructor(canvas) {
    this.canvas = canvas;
    this.box = el("div.tl-tip", { role: "status", hidden: true });
  }

  /** Show lines beside a pixel of the canvas, but within the canvas. */
  show([title, ...details], x, y) {
    const { box, canvas } = this;
    refill(
      box,
      el.b(title),
      details.map((line) => el.span(line)),
    );
    box.hidden = false;
    // some pixels beside the pointer, so that the pointer does not cover the tip
    const mostLeft = Math.max(0, canvas.clientWidth - box.offsetWidth),
      below = y + 18,
      isLow = below + box.offsetHeight > canvas.clientHeight;
    box.style.left = canvas.offsetLeft + Math.min(Math.max(x + 14, 0), mostLeft) + "px";
    box.style.top = Math.max(0, isLow ? y - box.offsetHeight - 10 : below) + "px";
  }
  hide() {
    this.box.hidden = true;
  }
}
