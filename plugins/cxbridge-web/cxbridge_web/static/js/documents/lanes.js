// The runs of an exploration over time: each run has a lane with a bar. Sizes are pixels unless stated
// otherwise.
import { el, svg } from "cx/dom.js";

const ROW = 22, // height of a lane
  BAR = 16, // height of a bar
  HEAD = 22, // height of the axis above the lanes
  LABELS = 320, // the greatest width of the labels
  NARROWEST = 500,
  WIDEST = 12000,
  COLUMN = 1150, // the width of a document's text
  MARGINS = 64, // of both sides of the document
  PIXELS_A_SECOND = 6,
  LETTER = 6.6, // mean width of a letter
  TICK_PIXELS = 100; // the least distance of two ticks
const TICK_STEPS_S = [1, 2, 5, 10, 30, 60, 120, 300, 600]; // seconds between two ticks

/** The y of the middle of a lane. */
const middleOf = (place) => HEAD + ROW * place + ROW / 2;
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
 * lane that the run left, -1 for none; isBold}
 * @param length the end of the axis in seconds
 * @param about a description for screen readers
 */
export function lanes(rows, length, about) {
  const seconds = length > 0 ? length : 1,
    longest = Math.max(0, ...rows.map(({ label }) => label.length)),
    labelWidth = Math.min(LABELS, Math.ceil((longest + 2) * LETTER)),
    room = Math.min(innerWidth - MARGINS, COLUMN) - labelWidth,
    width = Math.min(Math.max(NARROWEST, room, seconds * PIXELS_A_SECOND), WIDEST),
    height = HEAD + ROW * rows.length + 4,
    // a margin of 4 on both sides
    x = (time) => 4 + ((width - 8) * time) / seconds;
  const label = ({ label: text, title, isBold }, place) =>
    svg.text(
      { class: isBold ? "violated" : null, x: 2, y: middleOf(place) + 4 },
      svg.title(title),
      cut(text, Math.floor(labelWidth / LETTER)),
    );
  const tick = (time) => [
    svg("line.tick", { x1: x(time), x2: x(time), y1: HEAD - 4, y2: height }),
    svg.text({ x: x(time), y: 12, "text-anchor": time >= seconds ? "end" : "start" }, time + " s"),
  ];
  const bar = ({ begin, end, kind, title, href, from }, place) => {
    const [left, middle] = [x(begin), middleOf(place)],
      box = { x: left, y: middle - BAR / 2, width: Math.max(x(end) - left, 1), height: BAR, rx: 2 };
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
