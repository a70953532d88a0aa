// What is at a place of the timeline: the bar or the mark below the pointer, in words.
import { durationText } from "cx/dom.js";
import { OUTCOMES } from "cx/outcome.js";
import { AXIS, MARKS, axisText } from "cx/timeline/paint.js";
import { spansOf } from "cx/timeline/spans.js";

const NEAR = 6; // pixels

const within = (span, value, { axis }, now, slack) =>
  span.from[axis] - slack <= value && (span.to || now)[axis] + slack >= value;

/**
 * @param scene as the painter has it
 * @param x, y pixels within the canvas
 * @returns {{mark} | {row, item, span} | {row} | null}
 */
export function findAt({ window, history, now, high, rows, marks, scroll }, x, y) {
  if (y < AXIS) return null;
  const value = window.value(x),
    slack = (NEAR / window.width) * window.span;
  if (y < AXIS + MARKS) {
    let best = null;
    for (const mark of marks)
      if (
        Math.abs(mark[window.axis] - value) <= slack &&
        (!best || Math.abs(mark[window.axis] - value) < Math.abs(best[window.axis] - value))
      )
        best = mark;
    return best && { mark: best };
  }
  const at = Math.floor((y - AXIS - MARKS + scroll) / high),
    row = rows[at];
  if (!row) return null;
  const among = (items) => {
    for (const item of items) {
      const span = spansOf(item, history).findLast(
        (each) => each.part !== "tail" && within(each, value, window, now, slack / 3),
      );
      if (span) return { row, item, span };
    }
    return null;
  };
  if (row.kind === "robot") return among(row.item) || { row };
  if (row.kind === "group") return { row };
  const inside = row.kind === "goal" && !row.isSummary && among(row.item.actions);
  return (inside && inside.span.part === "run" ? inside : among([row.item])) || { row };
}

/** What is found, in lines: the first one says what it is. */
export function tipOf(found, { now, zero }) {
  if (found.mark) {
    const { component, text, time } = found.mark;
    return [(component ? component + ": " : "") + text, axisText(time, 0.001, 1e6, zero)];
  }
  const { item, span } = found;
  if (!span) return null;
  const name =
    item.kind === "goal"
      ? "Goal " + item.id + (item.cls && item.cls !== item.id ? " (" + item.cls + ")" : "")
      : item.kind === "action"
        ? "Action " + item.id + " " + item.name
        : (item.skiller || "planner") + ": " + (item.text || item.name);
  const took = durationText(Math.max(0, (span.to || now).time - span.from.time)),
    { icon, word } = OUTCOMES[span.outcome],
    error = item.error || (item.kind === "goal" && item.changes.at(-1).error);
  const waited = span.part === "wait" ? "waited " : "";
  return [
    name,
    icon + " " + word + ", " + waited + took + (span.to ? "" : " so far"),
    "from " +
      axisText(span.from.time, 0.001, 1e6, zero) +
      (span.to ? " to " + axisText(span.to.time, 0.001, 1e6, zero) : ""),
    error,
  ].filter(Boolean);
}
