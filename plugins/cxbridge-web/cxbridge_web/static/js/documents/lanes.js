// The runs of an exploration over time: each run has a lane with a bar. Sizes are pixels unless stated
// otherwise.
import { el, svg } from "cx/dom.js";

const ROW_HEIGHT = 22, // of a lane
  BAR_HEIGHT = 16,
  AXIS_HEIGHT = 22, // above the lanes
  MAX_LABEL_WIDTH = 320,
  MIN_WIDTH = 500,
  MAX_WIDTH = 12000,
  TEXT_WIDTH = 1150, // of a document
  MARGINS = 64, // of both sides of the document
  PIXELS_A_SECOND = 6,
  LETTER_WIDTH = 6.6, // mean
  TICK_PIXELS = 100; // the least distance between two ticks
const TICK_STEPS_S = [1, 2, 5, 10, 30, 60, 120, 300, 600]; // seconds between two ticks

/** The y of the middle of a lane. */
const middleOf = (rowIndex) => AXIS_HEIGHT + ROW_HEIGHT * rowIndex + ROW_HEIGHT / 2;
const cut = (text, letters) => (text.length <= letters ? text : text.slice(0, letters - 1) + "…");

/** The times of the ticks in seconds, from 0. */
function tickTimes(seconds, width) {
  const leastStep = (seconds * TICK_PIXELS) / width,
    step = TICK_STEPS_S.find((candidate) => candidate >= leastStep) || Math.ceil(leastStep);
  return Array.from({ length: Math.floor(seconds / step) + 1 }, (_, at) => at * step);
}

/**
 * Draw a lane for each run.
 * @param rows {label, begin, end (both seconds), kind: a CSS class, title, href, from: the index of the
 * lane that the run left, -1 for none; isViolated: whether the run violates a property}
 * @param endSeconds the end of the axis
 * @param about a description for screen readers
 */
export function lanes(rows, endSeconds, about) {
  const seconds = endSeconds > 0 ? endSeconds : 1, // widths are divided by it
    longest = Math.max(0, ...rows.map(({ label }) => label.length)),
    labelWidth = Math.min(MAX_LABEL_WIDTH, Math.ceil((longest + 2) * LETTER_WIDTH)),
    room = Math.min(innerWidth - MARGINS, TEXT_WIDTH) - labelWidth,
    width = Math.min(Math.max(MIN_WIDTH, room, seconds * PIXELS_A_SECOND), MAX_WIDTH),
    height = AXIS_HEIGHT + ROW_HEIGHT * rows.length + 4,
    // a margin of 4 on both sides
    x = (time) => 4 + ((width - 8) * time) / seconds;
  const label = ({ label: text, title, isViolated }, rowIndex) =>
    svg.text(
      { class: isViolated ? "violated" : null, x: 2, y: middleOf(rowIndex) + 4 },
      svg.title(title),
      cut(text, Math.floor(labelWidth / LETTER_WIDTH)),
    );
  const tick = (time) => [
    svg("line.tick", { x1: x(time), x2: x(time), y1: AXIS_HEIGHT - 4, y2: height }),
    svg.text({ x: x(time), y: 12, "text-anchor": time >= seconds ? "end" : "start" }, time + " s"),
  ];
  const bar = ({ begin, end, kind, title, href, from }, rowIndex) => {
    const [left, middle] = [x(begin), middleOf(rowIndex)],
      box = {
        x: left,
        y: middle - BAR_HEIGHT / 2,
        width: Math.max(x(end) - left, 1),
        height: BAR_HEIGHT,
        rx: 2,
      };
    return svg(
      href ? "a" : "g",
      { href, "aria-label": href && title },
      svg.title(title),
      from >= 0 && svg.path({ d: "M" + left + " " + middleOf(from) + " V" + middle }),
      svg.rect({ class: kind, ...box }),
    );
  };
  const hasLinks = rows.some(({ href }) => href); // screen readers do not enter an image
  return el(
    "div.lanes",
    svg.svg({ width: labelWidth, height, "aria-hidden": "true" }, rows.map(label)),
    el(
      "div.wide",
      { tabindex: 0, role: "region", "aria-label": about },
      svg.svg(
        { width, height, role: hasLinks ? "group" : "img", "aria-label": about },
        tickTimes(seconds, width).map(tick),
        rows.map(bar),
      ),
    ),
  );
}
