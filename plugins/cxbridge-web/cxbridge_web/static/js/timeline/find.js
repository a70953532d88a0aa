// The bar or mark of the timeline below the pointer, and the box that describes it.
import { durationText, el, refill } from "cx/dom.js";
import { OUTCOMES } from "cx/outcome.js";
import { AXIS, MARKS, axisText } from "cx/timeline/paint.js";
import { spansOf } from "cx/timeline/spans.js";

const NEAR = 6; // pixels

const within = (span, value, { axis }, now, slack) =>
  span.from[axis] - slack <= value && (span.to || now)[axis] + slack >= value;

/**
 * @param scene see Painter
 * @param x, y pixels within the canvas
 * @returns {{mark} | {row, item, span} | {row} | null}
 */
export function findAt({ window, history, now, high, rows, marks, scroll }, x, y) {
  if (y < AXIS) return null;
  const value = window.value(x),
    slack = (NEAR / window.width) * window.span;
  if (y < AXIS + MARKS) {
    const away = (mark) => Math.abs(mark[window.axis] - value),
      [mark] = marks.filter((each) => away(each) <= slack).sort((a, b) => away(a) - away(b));
    return mark ? { mark } : null;
  }
  const row = rows[Math.floor((y - AXIS - MARKS + scroll) / high)];
  const isAt = (span) => span.part !== "tail" && within(span, value, window, now, slack / 3);
  const among = (items) => {
    for (const item of items) {
      const span = spansOf(item, history).findLast(isAt);
      if (span) return { row, item, span };
    }
    return null;
  };
  if (!row || row.kind === "group") return row ? { row } : null;
  if (row.kind === "robot") return among(row.item) || { row };
  const inside = row.kind === "goal" && !row.isSummary && among(row.item.actions);
  return (inside && inside.span.part === "run" ? inside : among([row.item])) || { row };
}

function nameOf({ kind, id, cls, name, skiller, text }) {
  if (kind === "goal") return "Goal " + id + (cls && cls !== id ? " (" + cls + ")" : "");
  return kind === "action" ? "Action " + id + " " + name : (skiller || "planner") + ": " + (text || name);
}

/** The lines of a tip: first the name. */
export function tipOf({ mark, item, span }, { now, zero }) {
  const at = (point) => axisText(point.time, 0.001, 1e6, zero);
  if (mark) return [(mark.component ? mark.component + ": " : "") + mark.text, at(mark)];
  if (!span) return null;
  const { from, to, outcome, part } = span,
    { icon, word } = OUTCOMES[outcome],
    took = (part === "wait" ? "waited " : "") + durationText(Math.max(0, (to || now).time - from.time));
  return [
    nameOf(item),
    icon + " " + word + ", " + took + (to ? "" : " so far"),
    "from " + at(from) + (to ? " to " + at(to) : ""),
    item.error || (item.kind === "goal" && item.changes.at(-1).error),
  ].filter(Boolean);
}

export class Tip {
  /** @param canvas beside which it stands, in the same box */
  constructor(canvas) {
    this.canvas = canvas;
    this.box = el("div.tl-tip", { role: "status", hidden: true });
  }

  show([first, ...rest], x, y) {
    const { box, canvas } = this;
    refill(
      box,
      el.b(first),
      rest.map((line) => el.span(line)),
    );
    box.hidden = false;
    const most = Math.max(0, canvas.clientWidth - box.offsetWidth),
      below = y + 18,
      isLow = below + box.offsetHeight > canvas.clientHeight;
    box.style.left = canvas.offsetLeft + Math.min(Math.max(x + 14, 0), most) + "px";
    box.style.top = Math.max(0, isLow ? y - box.offsetHeight - 10 : below) + "px";
  }
  hide() {
    this.box.hidden = true;
  }
}
